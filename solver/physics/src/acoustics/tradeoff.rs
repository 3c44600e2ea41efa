//! Trade-offs of sound: its work is what errors are measured by, and it limits the order of accuracy.

use super::settings::Settings;
use crate::common::tradeoff::Tradeoff;

/// What sound contributes to trade-offs.
pub static TRADEOFF: Tradeoff = Tradeoff {
    first_order: |setup| {
        let sound = setup.tables.main::<Settings>();
        sound.map(|_| "sound sees the particles where they were at the step's start")
    },
    usual: &["energy sound_work"],
    ..Tradeoff::NONE
};
