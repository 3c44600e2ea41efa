//! Beams, of light or of sound: power over time and over the cross-section, and where the axis passes.

mod course;
mod frame;
mod instants;
mod profile;

use serde::Serialize;

pub use self::frame::Frame;
pub(crate) use self::instants::{AtInstant, ends};

/// A beam: parallel light, or sound, along `direction`, switched on from `starts_s` to `ends_s`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Beam {
    /// Power while on, in W.
    pub power_w: f64,
    /// Profile over the cross-section; its integral is the power.
    pub profile: Profile,
    /// Unit vector it travels along.
    pub direction: [f64; 3],
    /// Where the beam's axis passes.
    pub path: Path,
    /// When it is switched on, in s.
    pub starts_s: f64,
    /// When it is switched off, in s; infinity is never.
    pub ends_s: f64,
    /// Pulses: on for `on_s` at the start of each `period_s`; `None` is continuous.
    pub pulses: Option<Pulses>,
}

/// A train of pulses from the beam's start.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Pulses {
    /// Time from one pulse's start to the next's, in s.
    pub period_s: f64,
    /// Length of a pulse, in s; at most the period.
    pub on_s: f64,
}

/// Irradiance over the beam's cross-section as a function of the distance d from its axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Profile {
    /// Constant within the radius.
    TopHat {
        /// Radius in m.
        radius_m: f64,
    },
    /// I(0) e^{−2 d²/w²}: w is where the irradiance falls to 1/e².
    Gaussian {
        /// Radius w in m.
        radius_m: f64,
    },
    /// I(0) e^{−b d} (eq. 6.43).
    Exponential {
        /// Decay b in 1/m; positive.
        decay_1_m: f64,
    },
}

/// Path of the beam's axis.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Path {
    /// Stays at a point.
    Fixed {
        /// The point, in m.
        at_m: [f64; 3],
    },
    /// Runs from one point to another and back again, from the beam's start on.
    Sweep {
        /// Where it starts, in m.
        from_m: [f64; 3],
        /// Where it turns, in m.
        to_m: [f64; 3],
        /// Speed in m/s; positive.
        speed_m_s: f64,
    },
}
