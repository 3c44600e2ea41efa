//! How a wall moves.

use std::f64::consts::TAU;

use nalgebra::Unit;
use serde::{Deserialize, Serialize};
use stagger_coupling::{SolveError, math};
use stagger_messages::Shown;

use super::{Pose, Pressed, Series, Vec3, finite, series::Piece, unit};
use crate::common::checks;

/// How the frame of a wall moves. At rest it is the scene's.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Motion {
    /// It does not.
    Fixed,
    /// By displacements in m at given times.
    Path(Series<[f64; 3]>),
    /// With one velocity.
    Constant {
        /// The velocity, in m/s.
        velocity_m_s: [f64; 3],
        /// When.
        during: During,
    },
    /// About an axis.
    Rotation {
        /// A point on the axis, in m.
        through_m: [f64; 3],
        /// Unit vector along it.
        axis: [f64; 3],
        /// Angular speed by the right-hand rule, in rad/s.
        speed_rad_s: f64,
        /// When.
        during: During,
    },
    /// Displaced by A sin(2π f t + φ).
    Oscillation {
        /// A, in m.
        amplitude_m: [f64; 3],
        /// f, in Hz.
        frequency_hz: f64,
        /// φ, in rad.
        phase_rad: f64,
    },
    /// Pressed against the particles by a set force.
    Pressed(Pressed),
}

/// An interval of time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct During {
    /// Its start, in s.
    pub from_s: f64,
    /// Its end, in s; infinity is no end.
    pub until_s: f64,
}

/// What a wall's place depends on beside the time: the motion of a [`Pressed`] one, zero for all others.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct WallState {
    /// Displacement along the direction of pressing, in m.
    pub displacement_m: f64,
    /// Its speed, in m/s.
    pub speed_m_s: f64,
}

impl During {
    /// From t = 0 without an end.
    pub const ALWAYS: Self = Self { from_s: 0.0, until_s: f64::INFINITY };

    /// How much of it has passed at an instant, in s.
    fn passed_s(&self, t_s: f64) -> f64 {
        t_s.clamp(self.from_s, self.until_s) - self.from_s
    }

    /// 1 while it lasts, 0 before and after.
    fn active(&self, t_s: f64) -> f64 {
        if checks::reached(t_s, self.from_s) && !checks::reached(t_s, self.until_s) { 1.0 } else { 0.0 }
    }

    /// Whether it lasts at some time between two instants, in s.
    pub(super) fn overlaps(&self, [from_s, until_s]: [f64; 2]) -> bool {
        self.from_s <= until_s && from_s <= self.until_s
    }

    fn check(&self, wall: &str) -> Result<(), SolveError> {
        finite(wall, "the start of its motion", &[self.from_s])?;
        let after = format!("after its start, {} s", Shown(self.from_s));
        checks::setting(wall, "the end of its motion", self.until_s, self.until_s > self.from_s, &after)
    }
}

impl Motion {
    /// Where the wall is at an instant, and how fast it moves. Where a speed jumps, the later one holds.
    ///
    /// The motion must be one that [`super::Wall::check`] accepts.
    #[must_use]
    pub fn pose(&self, t_s: f64, state: &WallState) -> Pose {
        match self {
            Self::Fixed => Pose::at_rest(),
            Self::Path(displacements) => {
                let Piece { from, to, share, duration_s } = displacements.piece(t_s);
                let (from, way) = (Vec3::from(from), Vec3::from(to) - Vec3::from(from));
                Pose::shifted(from + way * share, way / duration_s)
            }
            Self::Constant { velocity_m_s, during } => {
                let velocity = Vec3::from(*velocity_m_s);
                Pose::shifted(velocity * during.passed_s(t_s), velocity * during.active(t_s))
            }
            Self::Rotation { through_m, axis, speed_rad_s, during } => {
                // Whole turns are taken off first: they would cost the angle its digits.
                let angle = (speed_rad_s * during.passed_s(t_s)) % TAU;
                let axis = Unit::new_normalize(Vec3::from(*axis));
                let spin = axis.into_inner() * (speed_rad_s * during.active(t_s));
                Pose::turned(math::rotation(axis, angle), Vec3::from(*through_m), spin)
            }
            Self::Oscillation { amplitude_m, frequency_hz, phase_rad } => {
                let (amplitude, pulsation) = (Vec3::from(*amplitude_m), TAU * frequency_hz);
                let angle = pulsation * t_s + phase_rad;
                Pose::shifted(amplitude * math::sin(angle), amplitude * (pulsation * math::cos(angle)))
            }
            Self::Pressed(pressed) => {
                let direction = Vec3::from(pressed.direction);
                Pose::shifted(direction * state.displacement_m, direction * state.speed_m_s)
            }
        }
    }

    /// Largest speed of its set displacement between two instants in s, in m/s; zero where it turns, or a force moves it. Of an
    /// oscillation it is that of a whole period.
    #[must_use]
    pub fn speed_m_s(&self, between: [f64; 2]) -> f64 {
        match self {
            Self::Path(Series { times_s, values }) => {
                let ways = values.windows(2).map(|pair| (Vec3::from(pair[1]) - Vec3::from(pair[0])).norm());
                let pieces =
                    ways.zip(times_s.windows(2)).filter(|(_, pair)| pair[0] <= between[1] && between[0] <= pair[1]);
                pieces.map(|(way_m, pair)| way_m / (pair[1] - pair[0])).fold(0.0, f64::max)
            }
            Self::Constant { velocity_m_s, during } if during.overlaps(between) => Vec3::from(*velocity_m_s).norm(),
            Self::Oscillation { amplitude_m, frequency_hz, .. } => TAU * frequency_hz * Vec3::from(*amplitude_m).norm(),
            Self::Fixed | Self::Constant { .. } | Self::Rotation { .. } | Self::Pressed(_) => 0.0,
        }
    }

    /// Checks ranges; `wall` names the wall.
    pub(super) fn check(&self, wall: &str) -> Result<(), SolveError> {
        match self {
            Self::Fixed => Ok(()),
            Self::Path(displacements) => {
                displacements.check(wall, "path")?;
                finite(wall, "a displacement of its path", displacements.values.as_flattened())
            }
            Self::Constant { velocity_m_s, during } => {
                finite(wall, "its velocity", velocity_m_s)?;
                during.check(wall)
            }
            Self::Rotation { through_m, axis, speed_rad_s, during } => {
                finite(wall, "a point on its axis", through_m)?;
                unit(wall, "the length of its axis' direction", axis)?;
                finite(wall, "its angular speed", &[*speed_rad_s])?;
                during.check(wall)
            }
            Self::Oscillation { amplitude_m, frequency_hz, phase_rad } => {
                finite(wall, "its amplitude", amplitude_m)?;
                finite(wall, "its phase", &[*phase_rad])?;
                checks::positive(wall, "its frequency", *frequency_hz)
            }
            Self::Pressed(pressed) => pressed.check(wall),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    const ALL_TIMES: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

    fn motions() -> Vec<Motion> {
        let during = During { from_s: 0.2, until_s: 0.7 };
        vec![
            Motion::Fixed,
            Motion::Path(Series {
                times_s: vec![0.1, 0.4, 0.5],
                values: vec![[0.0; 3], [1.0, 0.0, -2.0], [1.0, 0.5, -2.0]],
            }),
            Motion::Constant { velocity_m_s: [1.0, -2.0, 0.5], during },
            Motion::Rotation {
                through_m: [0.3, -0.2, 0.1],
                axis: (Vec3::new(1.0, 2.0, 2.0) / 3.0).into(),
                speed_rad_s: 3.0,
                during,
            },
            Motion::Oscillation { amplitude_m: [0.1, 0.0, 0.2], frequency_hz: 2.0, phase_rad: 0.4 },
        ]
    }

    #[test]
    fn velocities_are_the_derivatives_of_places() {
        let (state, own, h) = (WallState::default(), Vec3::new(0.9, 0.4, -0.6), 1e-5);
        for motion in motions() {
            motion.check("wall `w`").unwrap();
            // None of the instants is one where a speed jumps.
            for t_s in [0.05, 0.15, 0.33, 0.45, 0.6, 0.9] {
                let at = |t_s: f64| motion.pose(t_s, &state).to_world(&own);
                let difference = (at(t_s + h) - at(t_s - h)) / (2.0 * h);
                let velocity = motion.pose(t_s, &state).velocity_at(&at(t_s));
                // Third derivative h²/6: at most 0.22 (4π)³ 1e-10/6 = 7.3e-9 (oscillation); rounding 1e-11.
                assert!((difference - velocity).norm() < 1e-8, "{motion:?} at {t_s} s: {difference} {velocity}");
            }
        }
    }

    #[test]
    fn no_displacement_is_faster_than_its_largest_speed() {
        for (motion, expected) in
            motions().iter().zip([0.0, 5.0f64.sqrt() / 0.3, 5.25f64.sqrt(), 0.0, 4.0 * 0.05f64.sqrt() * PI])
        {
            let speed = motion.speed_m_s(ALL_TIMES);
            assert!((speed - expected).abs() < 1e-14, "{motion:?}: {speed}");
        }
    }

    #[test]
    fn a_motion_is_as_fast_as_while_it_lasts() {
        let [_, path, constant, ..] = &motions()[..] else { unreachable!() };
        for (between, expected) in
            [([0.0, 0.05], 0.0), ([0.2, 0.3], 5.0f64.sqrt() / 0.3), ([0.45, 0.9], 5.0), ([0.6, 0.9], 0.0)]
        {
            assert!((path.speed_m_s(between) - expected).abs() < 1e-14, "{between:?}");
        }
        for (between, expected) in [([0.0, 0.1], 0.0), ([0.1, 0.3], 5.25f64.sqrt()), ([0.8, 0.9], 0.0)] {
            assert!((constant.speed_m_s(between) - expected).abs() < 1e-14, "{between:?}");
        }
    }

    #[test]
    fn places_are_those_of_the_settings() {
        let at = |motion: &Motion, t_s| motion.pose(t_s, &WallState::default()).to_world(&Vec3::x());
        let near = |left: Vec3, right: [f64; 3]| assert!((left - Vec3::from(right)).norm() < 1e-14, "{left}");
        let [_, path, constant, _, oscillation] = &motions()[..] else { unreachable!() };
        near(at(path, 0.0), [1.0, 0.0, 0.0]);
        near(at(path, 0.25), [1.5, 0.0, -1.0]);
        near(at(path, 9.0), [2.0, 0.5, -2.0]);
        near(at(constant, 0.1), [1.0, 0.0, 0.0]);
        near(at(constant, 0.4), [1.2, -0.4, 0.1]);
        near(at(constant, 9.0), [1.5, -1.0, 0.25]);
        let sine = 0.4f64.sin();
        near(at(oscillation, 0.0), [1.0 + 0.1 * sine, 0.0, 0.2 * sine]);
        let turn = Motion::Rotation {
            through_m: [0.0, 1.0, 0.0],
            axis: [0.0, 0.0, 1.0],
            speed_rad_s: TAU,
            during: During::ALWAYS,
        };
        near(at(&turn, 0.25), [1.0, 2.0, 0.0]);
        // Whole turns leave it where it was.
        assert!((at(&turn, 1000.25) - at(&turn, 0.25)).norm() < 1e-12);
    }

    #[test]
    fn settings_out_of_range_are_named() {
        let wrong = |motion: Motion| motion.check("wall `w`").unwrap_err().to_string();
        let during = During { from_s: 2.0, until_s: 1.0 };
        assert_eq!(
            wrong(Motion::Constant { velocity_m_s: [0.0; 3], during }),
            "wall `w`: the end of its motion is 1, but must be after its start, 2 s"
        );
        let frequency = Motion::Oscillation { amplitude_m: [0.0; 3], frequency_hz: 0.0, phase_rad: 0.0 };
        assert_eq!(wrong(frequency), "wall `w`: its frequency is 0, but must be positive and finite");
        let path = Motion::Path(Series::constant([f64::INFINITY, 0.0, 0.0]));
        assert_eq!(wrong(path), "wall `w`: a displacement of its path is inf, but must be finite");
    }
}
