//! The beam in time: its power, and where its axis passes.

use nalgebra::Vector3;
use stagger_coupling::{SolveError, Window};

use super::{Beam, Path, Pulses};
use crate::common::checks::{positive, setting};

impl Beam {
    /// Refuses settings outside their range, as those of `node`.
    pub(crate) fn check(&self, node: &str) -> Result<(), SolveError> {
        let power = self.power_w;
        setting(node, "beam power", power, power.is_finite() && power >= 0.0, "finite and at least 0 W")?;
        let length = Vector3::from(self.direction).norm();
        setting(node, "length of the beam's direction", length, (length - 1.0).abs() < 1e-6, "1")?;
        setting(node, "beam start", self.starts_s, self.starts_s.is_finite(), "finite")?;
        setting(node, "beam end", self.ends_s, self.ends_s >= self.starts_s, "at or after the beam's start")?;
        if let Some(Pulses { period_s, on_s }) = self.pulses {
            positive(node, "pulse period", period_s)?;
            setting(node, "pulse length", on_s, (0.0..=period_s).contains(&on_s), "from 0 to the pulse period")?;
        }
        let points = match self.path {
            Path::Fixed { at_m } => [at_m, at_m],
            Path::Sweep { from_m, to_m, speed_m_s } => {
                positive(node, "sweep speed", speed_m_s)?;
                [from_m, to_m]
            }
        };
        for coordinate in points.as_flattened() {
            setting(node, "coordinate of the beam's path", *coordinate, coordinate.is_finite(), "finite")?;
        }
        self.profile.check(node)
    }

    /// Exact mean of the power over `window`, in W: pulses and switching within the window count by their time.
    pub fn mean_power_w(&self, window: Window) -> f64 {
        // Counted from the window's start: far from t = 0 a short window would otherwise lose digits.
        let from_s = (self.starts_s - window.t_s).max(0.0);
        let until_s = (self.ends_s - window.t_s).min(window.dt_s);
        let lit_s = until_s - from_s;
        if lit_s <= 0.0 || window.dt_s <= 0.0 {
            return 0.0;
        }
        let on_s = match self.pulses {
            Some(pulses) => pulses.on_time_s((window.t_s - self.starts_s + from_s).max(0.0), lit_s),
            None => lit_s,
        };
        self.power_w * (on_s / window.dt_s)
    }

    /// The point at which the beam's axis passes at `t_s`, in m. Before the beam starts a sweep waits where it begins.
    pub fn spot_m(&self, t_s: f64) -> Vector3<f64> {
        match self.path {
            Path::Fixed { at_m } => at_m.into(),
            Path::Sweep { from_m, to_m, speed_m_s } => {
                let (from, to) = (Vector3::from(from_m), Vector3::from(to_m));
                let length = (to - from).norm();
                if length <= 0.0 {
                    return from;
                }
                let run = (speed_m_s * (t_s - self.starts_s).max(0.0)).rem_euclid(2.0 * length);
                let distance = if run <= length { run } else { 2.0 * length - run };
                from + (to - from) * (distance / length)
            }
        }
    }
}

impl Pulses {
    /// Time on within `length_s` from `since_start_s` after the train's start, in s.
    fn on_time_s(&self, since_start_s: f64, length_s: f64) -> f64 {
        let phase_s = since_start_s.rem_euclid(self.period_s);
        self.on_time_until_s(phase_s + length_s) - self.on_time_until_s(phase_s)
    }

    /// Time on from the start of a pulse until `t_s` later.
    fn on_time_until_s(&self, t_s: f64) -> f64 {
        let whole = (t_s / self.period_s).floor();
        whole * self.on_s + (t_s - whole * self.period_s).clamp(0.0, self.on_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::beam::Profile;

    fn beam() -> Beam {
        Beam {
            power_w: 40.0,
            profile: Profile::TopHat { radius_m: 1e-4 },
            direction: [0.0, 0.0, -1.0],
            path: Path::Sweep { from_m: [0.0, 1.0, 0.0], to_m: [3.0, 1.0, 0.0], speed_m_s: 2.0 },
            starts_s: 5.0,
            ends_s: f64::INFINITY,
            pulses: None,
        }
    }

    #[test]
    fn the_sweep_waits_runs_and_turns() {
        // 3 m at 2 m/s: at the turn after 1.5 s, back after 3 s.
        for (t_s, x) in [(0.0, 0.0), (5.0, 0.0), (6.0, 2.0), (6.5, 3.0), (7.0, 2.0), (8.0, 0.0), (8.5, 1.0)] {
            let spot = beam().spot_m(t_s);
            assert!((spot - Vector3::new(x, 1.0, 0.0)).norm() < 1e-12, "at {t_s} s: {spot}");
        }
    }

    #[test]
    fn the_mean_power_is_that_of_the_time_on() {
        let train = Beam { pulses: Some(Pulses { period_s: 1.0, on_s: 0.25 }), ends_s: 7.125, ..beam() };
        // From 5 s on the train is on in [5, 5.25], [6, 6.25] and, cut by its end, [7, 7.125].
        for (t_s, dt_s, on_s) in [
            (0.0, 5.0, 0.0),
            (4.5, 1.0, 0.25),
            (5.0, 0.25, 0.25),
            (5.125, 1.0, 0.25),
            (5.5, 0.25, 0.0),
            (4.0, 6.0, 0.625),
            (7.0625, 1.0, 0.0625),
            (8.0, 1.0, 0.0),
        ] {
            let mean_w = train.mean_power_w(Window { t_s, dt_s });
            // All these times are exact in binary, so is the mean up to the rounding of one division.
            assert!((mean_w - 40.0 * on_s / dt_s).abs() < 1e-14, "window of {dt_s} s at {t_s} s: {mean_w}");
        }
        // A window wholly inside a continuous beam has the power to the last bit, however late and short it is.
        assert_eq!(beam().mean_power_w(Window { t_s: 1e3 + 0.1, dt_s: 1e-7 }).to_bits(), 40.0_f64.to_bits());
    }
}
