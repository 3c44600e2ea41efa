//! The staggered iteration against solutions that know nothing of it.
//!
//! - Acceleration saves iterations on maps of known spectrum, and converges where the plain iteration does not.
//! - A linear pair contracts at the spectral radius of its coupling, and Λ names the step that converges in K_d.
//! - Two soft spheres squeezed between a cold and a hot wall: their motion softens with temperature, their conduction
//!   follows their motion. Staggered to a tight tolerance they give what one implicit solve of all unknowns gives, and
//!   the error against a far finer solution falls with the order of the weight φ.

mod acceleration;
mod monolithic;
mod pair;

use std::collections::BTreeMap;

use stagger_coupling::{
    self, CouplingController, Frozen, InProcess, Listener, Local, Order, Outcome, Participant, Physics, Reply,
    Settings, SolveError, StepSize, Window,
};
use stagger_messages::{Decision, Field, Fields, Measure, Port, Ports, Ready, Verdict};

/// Settings of a run with a fixed window.
pub fn settings(dt_s: f64, tolerance: f64, iterations: u32) -> Settings {
    let dt = StepSize { start_s: dt_s, limit_s: dt_s, minimum_s: 1e-9 * dt_s, growth: 1.5 };
    Settings { default_tolerance: tolerance, iterations, reuse: 0.0, ..Settings::new(dt) }
}

/// All decisions of a run.
#[derive(Default)]
pub struct Log(pub Vec<Decision>);

impl Listener for Log {
    fn started(&mut self, _ready: &[(String, Ready)]) {}

    fn decided(&mut self, decision: &Decision, _outcomes: &[Outcome]) -> bool {
        self.0.push(decision.clone());
        true
    }
}

/// Runs participants to `duration_s`; the fields at the end and all decisions.
pub fn run(
    members: BTreeMap<String, Box<dyn Participant>>,
    settings: &Settings,
    duration_s: f64,
) -> (Fields, Vec<Decision>) {
    let mut ensemble = InProcess::new(members);
    let ports = ensemble.ports();
    let plan = stagger_coupling::plan(&ports, settings).unwrap();
    let mut controller =
        CouplingController::new(settings, &plan, &stagger_coupling::measured(&ports, &plan), duration_s);
    let mut log = Log::default();
    stagger_coupling::run_loop(&mut ensemble, &plan, &mut controller, 0, &mut log).unwrap();
    (ensemble.fields(), log.0)
}

/// w(t+Δt) = 1 + Δt · gain · (the other field at t+Δt).
struct Linear {
    own: Port,
    other: Port,
    gain_1_s: f64,
}

impl Linear {
    fn member(own: &str, other: &str, gain_1_s: f64) -> (String, Box<dyn Participant>) {
        let port = |name| Port::f64(name, "1", "points", 1, Measure::Magnitude);
        let physics = Self { own: port(own), other: port(other), gain_1_s };
        (own.into(), Box::new(Local::new(own, physics)))
    }

    fn reply(&self, value: f64) -> Result<Reply, SolveError> {
        let field = Field::new(&self.own.clone().into(), 0, vec![value])?;
        Ok(Reply { fields: Fields::from([(self.own.field.clone(), field)]), ..Reply::default() })
    }
}

impl Physics for Linear {
    type State = ();

    fn ports(&self) -> Ports {
        Ports::new(vec![self.other.as_read()], vec![self.own.clone()])
    }

    fn initial(&self) -> Result<((), Reply), SolveError> {
        Ok(((), self.reply(0.0)?))
    }

    fn solve(&self, (): &(), frozen: &Frozen, window: Window) -> Result<((), Reply), SolveError> {
        let other = frozen.at_end(&self.other.field)?.f64()?[0];
        Ok(((), self.reply(1.0 + window.dt_s * self.gain_1_s * other)?))
    }
}

/// The pair whose two couplings are `gain` and 1: the iteration matrix of Gauss–Seidel order has the spectral radius
/// gain·Δt, that of Jacobi order its square root.
fn linear(gain_1_s: f64) -> BTreeMap<String, Box<dyn Participant>> {
    BTreeMap::from([Linear::member("x", "y", gain_1_s), Linear::member("y", "x", 1.0)])
}

#[test]
fn a_linear_pair_contracts_at_the_spectral_radius_of_its_coupling() {
    // With Δt = 1 both gains act in full: ρ = 0.3 for Gauss–Seidel, √0.3 for Jacobi.
    for (order, expected) in [(Order::GaussSeidel, 0.3), (Order::Jacobi, 0.3f64.sqrt())] {
        let settings = Settings { order, ..settings(1.0, 1e-12, 100) };
        let (fields, decisions) = run(linear(0.3), &settings, 1.0);
        let errors: Vec<f64> = decisions.iter().map(|d| d.errors.iter().fold(0.0, |z, e| e.error.max(z))).collect();
        // Over an even number of iterations, because in Jacobi order the two fields change by turns. The sums the
        // errors are divided by still move in the first iterations, so the tail is used: it is at 1e-4 of the fields
        // and below, and the rate is that exact there.
        let (first, last) = (10, errors.len() - 2 - errors.len() % 2);
        let rate = (errors[last] / errors[first]).powf(1.0 / (last - first) as f64);
        assert!((rate - expected).abs() < 2e-3, "{order:?}: rate {rate}, expected {expected}");
        // x = 1 + 0.3 y, y = 1 + x has the solution x = 1.3/0.7.
        assert!((fields["x"].f64().unwrap()[0] - 1.3 / 0.7).abs() < 1e-11);
    }
}

#[test]
fn lambda_names_the_step_that_converges_in_k_d_iterations() {
    // A linear map in one field contracts like Δt to the first power: p = 1, as the measure says.
    let wanted = 8;
    let settings = settings(1.0, 1e-8, wanted);
    let (_, decisions) = run(linear(0.5), &settings, 1.0);
    assert_eq!(decisions[wanted as usize - 1].verdict(), Verdict::Reject, "a rate of 0.5 needs some 26 iterations");
    let accepted: Vec<u32> = decisions
        .iter()
        .filter(|decision| decision.verdict() == Verdict::Accept)
        .map(|decision| decision.version.unwrap().iteration)
        .collect();
    // After one rejection the step fits: it takes K_d iterations, or one less.
    let rejected = decisions.iter().filter(|decision| decision.verdict() == Verdict::Reject).count();
    assert!(rejected <= 2, "{rejected} rejections");
    assert!((wanted - 1..=wanted).contains(&accepted[0]), "{accepted:?}");
}
