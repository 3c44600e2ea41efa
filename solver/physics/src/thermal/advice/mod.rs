//! Advice on the temperature, and what it is to others' advice.

mod biot;
mod fourier;
mod heat;
mod melting;
mod peclet;
mod radiation;
mod unread;

pub use self::biot::lumped_error;
use crate::common::advice::Advisor;

/// What the temperature contributes to advice.
pub static ADVISOR: Advisor = Advisor {
    tell: heat::tell,
    numbers: &[
        &unread::UNREAD,
        &fourier::FOURIER,
        &peclet::PECLET,
        &biot::BIOT,
        &radiation::RADIATION,
        &melting::MELTING,
    ],
};
