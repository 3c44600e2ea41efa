//! The piston: a wall that a set force presses against the particles.

use serde::Serialize;
use stagger_coupling::{SolveError, math};

use super::{Series, WallState, finite, unit};
use crate::common::checks;

/// A wall that is free along one direction n and pressed along it: with displacement s from its place in the scene,
///
///   m s̈ = F(t) − c ṡ + f,
///
/// F the set force, f the contact forces on the wall along n. Gravity does not act on it: its weight belongs to F. From a
/// given time on it may be withdrawn at a set speed instead, whatever that takes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Pressed {
    /// n, a unit vector: the way it is pressed.
    pub direction: [f64; 3],
    /// m, in kg; positive.
    pub mass_kg: f64,
    /// c, in N s/m; not negative.
    pub damping_n_s_m: f64,
    /// F along n, in N, by time.
    pub force_n: Series<f64>,
    /// When it is withdrawn, and how fast.
    pub withdrawal: Option<Withdrawal>,
    /// Stops: the least and the greatest s, in m, about 0; infinite where there is none. It does not bounce off them.
    pub limits_m: [f64; 2],
}

/// How a piston goes back.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Withdrawal {
    /// From when on, in s.
    pub from_s: f64,
    /// How fast, against n, in m/s; positive.
    pub speed_m_s: f64,
}

/// What moved energy into and out of a piston: its kinetic energy ½ m ṡ² grows by `drive_j + contacts_j − damped_j`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Work {
    /// Work of the set force, or of what withdraws it, in J.
    pub drive_j: f64,
    /// Work of the contact forces, in J.
    pub contacts_j: f64,
    /// Lost in the damper and at the stops, in J.
    pub damped_j: f64,
}

impl std::ops::AddAssign for Work {
    fn add_assign(&mut self, other: Self) {
        self.drive_j += other.drive_j;
        self.contacts_j += other.contacts_j;
        self.damped_j += other.damped_j;
    }
}

impl Pressed {
    /// Acceleration s̈ in m/s² under the contact force f along n, in N; zero against a stop and while withdrawn.
    #[must_use]
    pub fn acceleration(&self, t_s: f64, state: &WallState, contact_force_n: f64) -> f64 {
        let force_n = self.force_n.at(t_s) - self.damping_n_s_m * state.speed_m_s + contact_force_n;
        if self.withdrawal_speed(t_s, state).is_some() || self.is_held(state, force_n) {
            return 0.0;
        }
        force_n / self.mass_kg
    }

    /// Power of the set force, or of what withdraws it, in W, under the contact force f along n, in N.
    #[must_use]
    pub fn power_w(&self, t_s: f64, state: &WallState, contact_force_n: f64) -> f64 {
        match self.withdrawal_speed(t_s, state) {
            Some(speed_m_s) => (self.damping_n_s_m * speed_m_s - contact_force_n) * speed_m_s,
            None => self.force_n.at(t_s) * state.speed_m_s,
        }
    }

    /// Kinetic energy in J.
    #[must_use]
    pub fn energy_j(&self, state: &WallState) -> f64 {
        0.5 * self.mass_kg * state.speed_m_s * state.speed_m_s
    }

    /// Lets the forces at `t_s` act for `duration_s`, as the kick of velocity Verlet does, and says what work they do.
    ///
    /// The damper acts exactly: the speed relaxes by e^(−c Δt/m), so that no Δt makes it unstable. The work is
    /// force times Δt times the mean of the two speeds.
    pub fn kick(&self, t_s: f64, duration_s: f64, contact_force_n: f64, state: &mut WallState) -> Work {
        let before = *state;
        if let Some(speed_m_s) = self.withdrawal_speed(t_s, state) {
            state.speed_m_s = speed_m_s;
            let way_m = speed_m_s * duration_s;
            let (contacts_j, damped_j) = (contact_force_n * way_m, self.damping_n_s_m * speed_m_s * way_m);
            let gained_j = self.energy_j(state) - self.energy_j(&before);
            return Work { drive_j: gained_j - contacts_j + damped_j, contacts_j, damped_j };
        }
        let set_n = self.force_n.at(t_s);
        let force_n = set_n + contact_force_n;
        if self.is_held(state, force_n) {
            return Work::default();
        }
        let decay = self.damping_n_s_m * duration_s / self.mass_kg;
        // (1 − e^(−x))/x, which is 1 without a damper.
        let share = if decay > 0.0 { -math::exp_m1(-decay) / decay } else { 1.0 };
        state.speed_m_s = before.speed_m_s * math::exp(-decay) + force_n * duration_s / self.mass_kg * share;
        let way_m = 0.5 * (before.speed_m_s + state.speed_m_s) * duration_s;
        let gained_j = self.energy_j(state) - self.energy_j(&before);
        Work { drive_j: set_n * way_m, contacts_j: contact_force_n * way_m, damped_j: force_n * way_m - gained_j }
    }

    /// Lets it go on at its speed for `duration_s`, as the drift of velocity Verlet does; a stop ends the motion. Returns
    /// the kinetic energy lost there, in J.
    pub fn drift(&self, duration_s: f64, state: &mut WallState) -> f64 {
        let [least_m, greatest_m] = self.limits_m;
        let free_m = state.displacement_m + state.speed_m_s * duration_s;
        state.displacement_m = free_m.clamp(least_m, greatest_m);
        // It stays free where it arrives at the stop exactly: the next drift, or nothing, ends it.
        if (least_m..=greatest_m).contains(&free_m) {
            return 0.0;
        }
        let lost_j = self.energy_j(state);
        state.speed_m_s = 0.0;
        lost_j
    }

    /// The speed it is given; `None` while the set force drives it.
    fn withdrawal_speed(&self, t_s: f64, state: &WallState) -> Option<f64> {
        let withdrawal = self.withdrawal.filter(|withdrawal| checks::reached(t_s, withdrawal.from_s))?;
        Some(if state.displacement_m <= self.limits_m[0] { 0.0 } else { -withdrawal.speed_m_s })
    }

    /// Whether it rests at a stop that a force presses it against.
    fn is_held(&self, state: &WallState, force_n: f64) -> bool {
        let [least_m, greatest_m] = self.limits_m;
        (state.displacement_m >= greatest_m && force_n >= 0.0 && state.speed_m_s >= 0.0)
            || (state.displacement_m <= least_m && force_n <= 0.0 && state.speed_m_s <= 0.0)
    }

    /// Checks ranges; `wall` names the wall.
    pub(super) fn check(&self, wall: &str) -> Result<(), SolveError> {
        unit(wall, "the length of its direction", &self.direction)?;
        checks::positive(wall, "its mass", self.mass_kg)?;
        let damping = self.damping_n_s_m;
        let damps = damping.is_finite() && damping >= 0.0;
        checks::setting(wall, "its damping", damping, damps, "finite and not negative")?;
        self.force_n.check(wall, "force")?;
        finite(wall, "its force", &self.force_n.values)?;
        let [least_m, greatest_m] = self.limits_m;
        checks::setting(wall, "its lower stop", least_m, least_m <= 0.0, "at or below its start, 0 m")?;
        checks::setting(wall, "its upper stop", greatest_m, greatest_m >= 0.0, "at or above its start, 0 m")?;
        self.withdrawal.map_or(Ok(()), |withdrawal| {
            finite(wall, "the time of its withdrawal", &[withdrawal.from_s])?;
            checks::positive(wall, "the speed of its withdrawal", withdrawal.speed_m_s)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn piston(force_n: f64) -> Pressed {
        Pressed {
            direction: [0.0, 0.0, -1.0],
            mass_kg: 0.5,
            damping_n_s_m: 0.0,
            force_n: Series::constant(force_n),
            withdrawal: None,
            limits_m: [f64::NEG_INFINITY, f64::INFINITY],
        }
    }

    /// Velocity Verlet with a contact force by displacement, in N; returns state and work after `steps`.
    fn advance(piston: &Pressed, contact: impl Fn(f64) -> f64, step_s: f64, steps: u32) -> (WallState, Work) {
        let (mut state, mut work) = (WallState::default(), Work::default());
        for step in 0..steps {
            let t_s = f64::from(step) * step_s;
            work += piston.kick(t_s, 0.5 * step_s, contact(state.displacement_m), &mut state);
            work.damped_j += piston.drift(step_s, &mut state);
            work += piston.kick(t_s + step_s, 0.5 * step_s, contact(state.displacement_m), &mut state);
        }
        (state, work)
    }

    #[test]
    fn under_a_constant_force_it_moves_on_a_parabola() {
        let piston = piston(3.0);
        let (state, work) = advance(&piston, |_| 0.0, 1e-3, 1000);
        // Verlet is exact; a thousand steps round to 1e-13.
        assert!((state.displacement_m - 0.5 * 6.0).abs() < 1e-12 && (state.speed_m_s - 6.0).abs() < 1e-12);
        assert!((work.drive_j - 3.0 * state.displacement_m).abs() < 1e-11 && work.damped_j.abs() < 1e-11);
        assert!((piston.acceleration(0.0, &state, -1.0) - 4.0).abs() < 1e-15);
        assert!((piston.power_w(1.0, &state, -1.0) - 18.0).abs() < 1e-11);
        assert_eq!(state.displacement_m.to_bits(), advance(&piston, |_| 0.0, 1e-3, 1000).0.displacement_m.to_bits());
    }

    #[test]
    fn against_a_damper_it_reaches_its_final_speed_for_every_step() {
        let piston = Pressed { damping_n_s_m: 2.0, ..piston(3.0) };
        // F/c (1 − e^(−ct/m)) exactly, as nothing depends on the place.
        let exact = |t_s: f64| 1.5 * (1.0 - (-4.0 * t_s).exp());
        for (step_s, steps) in [(1e-3, 700), (0.1, 7), (10.0, 3)] {
            let (state, work) = advance(&piston, |_| 0.0, step_s, steps);
            assert!((state.speed_m_s - exact(step_s * f64::from(steps))).abs() < 1e-12, "{step_s}");
            let balance_j = work.drive_j + work.contacts_j - work.damped_j - piston.energy_j(&state);
            assert!(balance_j.abs() < 1e-12 * work.drive_j.abs(), "{balance_j}");
        }
    }

    #[test]
    fn on_a_spring_it_swings_about_the_static_place_and_the_books_balance() {
        let (piston, stiffness) = (piston(3.0), 200.0);
        // s = F/k (1 − cos ωt), ω = 20: after half a period 2 F/k.
        let half_s = std::f64::consts::PI / 20.0;
        let error = |steps: u32| {
            let (state, work) = advance(&piston, |s| -stiffness * s, half_s / f64::from(steps), steps);
            let balance_j = work.drive_j + work.contacts_j - work.damped_j - piston.energy_j(&state);
            assert!(balance_j.abs() < 1e-14, "{balance_j}");
            assert!(work.damped_j.abs() < 1e-14);
            let stored_j = 0.5 * stiffness * state.displacement_m.powi(2);
            assert!((work.contacts_j + stored_j).abs() < 0.1 * stored_j / f64::from(steps));
            let quarter = advance(&piston, |s| -stiffness * s, half_s / f64::from(steps), steps / 2).0;
            (quarter.displacement_m - 3.0 / stiffness).abs()
        };
        // Second order: a factor of 4, to a tenth.
        assert!((error(40) / error(80) - 4.0).abs() < 0.4, "{} {}", error(40), error(80));
    }

    #[test]
    fn a_stop_holds_it_until_a_force_pulls_it_off() {
        let force_n = Series { times_s: vec![0.0, 1.0, 1.001], values: vec![3.0, 3.0, -3.0] };
        let piston = Pressed { limits_m: [-0.25, 0.5], force_n, ..piston(0.0) };
        let (state, work) = advance(&piston, |_| 0.0, 1e-3, 900);
        assert_eq!((state.displacement_m.to_bits(), state.speed_m_s.to_bits()), (0.5f64.to_bits(), 0));
        assert_eq!(piston.acceleration(0.9, &state, 0.0).to_bits(), 0);
        // All work went into the stop: 3 N over 0.5 m, but for the step in which it hit, at 2.4 m/s: 2.5 mm.
        assert!((work.drive_j - work.damped_j).abs() < 1e-12 && (work.damped_j - 1.5).abs() < 3.0 * 2.5e-3);
        let state = advance(&piston, |_| 0.0, 1e-3, 1200).0;
        assert!(state.displacement_m < 0.5 && state.speed_m_s < 0.0);
        let state = advance(&piston, |_| 0.0, 1e-3, 3000).0;
        assert_eq!((state.displacement_m.to_bits(), state.speed_m_s.to_bits()), ((-0.25f64).to_bits(), 0));
    }

    #[test]
    fn withdrawn_it_goes_back_at_its_speed_whatever_pushes() {
        let withdrawal = Some(Withdrawal { from_s: 0.1, speed_m_s: 0.5 });
        let piston = Pressed { withdrawal, damping_n_s_m: 1.0, limits_m: [-0.1, 1.0], ..piston(3.0) };
        let (state, work) = advance(&piston, |_| -7.0, 1e-3, 200);
        assert!((state.speed_m_s + 0.5).abs() < 1e-15);
        let balance_j = work.drive_j + work.contacts_j - work.damped_j - piston.energy_j(&state);
        assert!(balance_j.abs() < 1e-13, "{balance_j}");
        // It is held back against a push of 7 N along its way: the drive takes up what the damper does not.
        assert!((piston.power_w(0.15, &state, -7.0) + (7.0 - 0.5) * 0.5).abs() < 1e-13);
        assert_eq!(piston.acceleration(0.15, &state, -7.0).to_bits(), 0);
        let state = advance(&piston, |_| 0.0, 1e-3, 2000).0;
        assert_eq!((state.displacement_m.to_bits(), state.speed_m_s.to_bits()), ((-0.1f64).to_bits(), 0));
    }

    #[test]
    fn a_state_is_restored_to_the_last_bit() {
        let state = WallState { displacement_m: 0.1 + 0.2, speed_m_s: -1e-300 };
        let bytes = postcard::to_stdvec(&state).unwrap();
        let restored: WallState = postcard::from_bytes(&bytes).unwrap();
        assert_eq!(restored.displacement_m.to_bits(), state.displacement_m.to_bits());
        assert_eq!(restored.speed_m_s.to_bits(), state.speed_m_s.to_bits());
    }

    #[test]
    fn settings_out_of_range_are_named() {
        let wrong = |piston: Pressed| piston.check("wall `lid`").unwrap_err().to_string();
        assert_eq!(
            wrong(Pressed { mass_kg: 0.0, ..piston(1.0) }),
            "wall `lid`: its mass is 0, but must be positive and finite"
        );
        assert_eq!(
            wrong(Pressed { limits_m: [0.1, 0.2], ..piston(1.0) }),
            "wall `lid`: its lower stop is 0.1, but must be at or below its start, 0 m"
        );
        assert_eq!(
            wrong(Pressed { damping_n_s_m: f64::NAN, ..piston(1.0) }),
            "wall `lid`: its damping is NaN, but must be finite and not negative"
        );
        let withdrawal = Some(Withdrawal { from_s: 0.0, speed_m_s: -1.0 });
        assert_eq!(
            wrong(Pressed { withdrawal, ..piston(1.0) }),
            "wall `lid`: the speed of its withdrawal is -1, but must be positive and finite"
        );
        assert_eq!(wrong(piston(f64::INFINITY)), "wall `lid`: its force is inf, but must be finite");
    }
}
