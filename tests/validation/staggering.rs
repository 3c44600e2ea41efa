//! Acceleration, rates and checkpoints of the staggered iteration, on linear maps whose solutions are known.
//!
//! - A strongly coupled pair on which plain iteration diverges converges with Aitken and with IQN-ILS.
//! - A node that solves every n-th step covers all of the simulated time once, whatever the steps; one that only reads
//!   solves once per accepted step.
//! - A run that is split at a checkpoint goes on with the same bits as one that is not.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex},
};

use stagger_coupling::{
    self, Acceleration, CouplingController, FieldSettings, Frozen, InProcess, Local, Participant, Physics, Reply,
    Settings, SolveError, Window,
};
use stagger_messages::{Checkpoint, Decision, Field, Fields, Measure, Port, Ports, Verdict, Version};

use super::coupling::{Log, settings};

pub type Members = BTreeMap<String, Box<dyn Participant>>;
/// Windows solved by each node, trials included: node, start and length in s.
type Solved = Arc<Mutex<Vec<(String, f64, f64)>>>;

/// w(t+Δt) = w(t) + Δt·(source + gain · Σ of the fields read at t+Δt), row by row.
struct Relay {
    name: String,
    reads: Vec<Port>,
    writes: Arc<Port>,
    gain_1_s: Vec<f64>,
    source_1_s: f64,
    solved: Solved,
}

fn port(name: &str) -> Port {
    Port::f64(name, "1", "points", 1, Measure::Magnitude)
}

fn relay(members: &mut Members, solved: &Solved, name: &str, field: &str, reads: Vec<Port>, gain_1_s: &[f64]) {
    let physics = Relay {
        name: name.into(),
        reads,
        writes: Arc::new(port(field)),
        gain_1_s: gain_1_s.to_vec(),
        source_1_s: 1.0,
        solved: Arc::clone(solved),
    };
    members.insert(name.into(), Box::new(Local::new(name, physics)));
}

impl Relay {
    fn reply(&self, values: &[f64]) -> Result<Reply, SolveError> {
        let field = Field::new(&self.writes, 0, values.to_vec())?;
        Ok(Reply { fields: Fields::from([(field.name().into(), field)]), ..Reply::default() })
    }
}

impl Physics for Relay {
    type State = Vec<f64>;

    fn ports(&self) -> Ports {
        Ports::new(self.reads.clone(), vec![(*self.writes).clone()])
    }

    fn initial(&self) -> Result<(Vec<f64>, Reply), SolveError> {
        let start: Vec<f64> = (0..self.gain_1_s.len()).map(|row| 0.1 * row as f64).collect();
        let reply = self.reply(&start)?;
        Ok((start, reply))
    }

    fn solve(&self, state: &Vec<f64>, frozen: &Frozen, window: Window) -> Result<(Vec<f64>, Reply), SolveError> {
        self.solved.lock().unwrap().push((self.name.clone(), window.t_s, window.dt_s));
        let mut next = state.clone();
        for (row, value) in next.iter_mut().enumerate() {
            let mut read = 0.0;
            for port in &self.reads {
                read += frozen.at_end(&port.field)?.f64()?[row];
            }
            *value += window.dt_s * (self.source_1_s + self.gain_1_s[row] * read);
        }
        let reply = self.reply(&next)?;
        Ok((next, reply))
    }
}

/// Runs to `duration_s`; fields, decisions, and the last checkpoint, one being taken every `checkpoint_steps`.
pub fn run(
    members: Members,
    settings: &Settings,
    duration_s: f64,
    checkpoint_steps: u64,
    from: Option<Checkpoint>,
) -> Result<(Fields, Vec<Decision>, Option<Checkpoint>), stagger_coupling::InProcessError> {
    let mut ensemble = InProcess::new(members);
    let ports = ensemble.ports();
    let mut plan = stagger_coupling::plan(&ports, settings)?;
    let mut controller =
        CouplingController::new(settings, &plan, &stagger_coupling::measured(&ports, &plan), duration_s);
    if let Some(checkpoint) = from {
        plan.from = checkpoint.envelope.as_ref().unwrap().version;
        controller.restore(&checkpoint.coordinator)?;
        ensemble = ensemble.from_checkpoint(checkpoint);
    }
    let mut log = Log::default();
    stagger_coupling::run_loop(&mut ensemble, &plan, &mut controller, checkpoint_steps, &mut log)?;
    Ok((ensemble.fields(), log.0, ensemble.last_checkpoint().cloned()))
}

/// Two nodes with several rows each; row i contracts with gain_i² Δt².
fn pair(solved: &Solved, gains_1_s: &[f64]) -> Members {
    let mut members = Members::new();
    relay(&mut members, solved, "a", "x", vec![port("y").as_read()], gains_1_s);
    relay(&mut members, solved, "b", "y", vec![port("x").as_read()], gains_1_s);
    members
}

fn accepted(decisions: &[Decision]) -> Vec<Version> {
    let accepted = decisions.iter().filter(|decision| decision.verdict() == Verdict::Accept);
    accepted.map(|decision| decision.version.unwrap()).collect()
}

pub const AITKEN: Acceleration = Acceleration::Aitken { relaxation: 0.5 };
pub const IQN_ILS: Acceleration = Acceleration::IqnIls { relaxation: 0.5, reused_steps: 4, columns: 20, filter: 1e-8 };

#[test]
fn a_pair_on_which_plain_iteration_diverges_converges_with_aitken_and_iqn_ils() {
    // Gauss–Seidel: x ← c + g²Δt² x with g²Δt² = 2.25 and 1.44: repelling. x = y = (w + Δt)/(1 − gΔt) in each row.
    let gains = [-1.5, -1.2];
    let plain = settings(1.0, 1e-10, 60);
    let rejected = |decisions: &[Decision]| decisions.iter().any(|decision| decision.verdict() == Verdict::Reject);
    let (_, decisions, _) = run(pair(&Solved::default(), &gains), &plain, 1.0, 0, None).unwrap();
    assert!(rejected(&decisions), "plain iteration must diverge at the full step");
    for (method, most) in [(AITKEN, 60), (IQN_ILS, 5)] {
        let settings = Settings { acceleration: method, ..plain.clone() };
        let (fields, decisions, _) = run(pair(&Solved::default(), &gains), &settings, 1.0, 0, None).unwrap();
        assert!(!rejected(&decisions), "{method:?}");
        let iterations = accepted(&decisions)[0].iteration;
        assert!(iterations <= most, "{method:?}: {iterations} iterations");
        for (row, gain) in gains.iter().enumerate() {
            let expected = (0.1 * row as f64 + 1.0) / (1.0 - gain);
            let found = fields["x"].f64().unwrap()[row];
            // The change in the last iteration was below 1e-10 of the field; the error is that over |1 − g²| or less.
            assert!((found - expected).abs() < 1e-9, "{method:?}: {found}, expected {expected}");
        }
    }
}

#[test]
fn a_slow_node_covers_the_time_once_and_a_reader_solves_once_per_accepted_step() {
    let solved = Solved::default();
    let mut members = pair(&solved, &[0.3]);
    relay(&mut members, &solved, "probe", "z", vec![port("x").as_read()], &[1.0]);
    let every = BTreeMap::from([("b".to_owned(), 3)]);
    let settings = Settings { every, ..settings(0.1, 1e-9, 30) };
    let (_, decisions, _) = run(members, &settings, 1.0, 0, None).unwrap();
    let steps = accepted(&decisions).len();
    assert_eq!(steps, 10);
    let windows = |node: &str| {
        let mut windows: Vec<(f64, f64)> =
            solved.lock().unwrap().iter().filter(|(name, ..)| name == node).map(|(_, t, dt)| (*t, *dt)).collect();
        windows.dedup();
        windows
    };
    // Steps 3, 6, 9 and the last one.
    let slow = windows("b");
    assert_eq!(slow.len(), 4, "{slow:?}");
    let mut reached = 0.0;
    for (t, dt) in slow {
        // Sums of ten steps of 0.1 s, to rounding.
        assert!((t - reached).abs() < 1e-12, "{t} after {reached}");
        reached = t + dt;
    }
    assert!((reached - 1.0).abs() < 1e-12);
    let probe = solved.lock().unwrap().iter().filter(|(name, ..)| name == "probe").count();
    assert_eq!(probe, steps, "a node nobody reads solves once per accepted step");
    assert!(decisions.iter().all(|decision| decision.errors.iter().all(|error| error.field != "z")));
}

#[test]
fn a_run_split_at_a_checkpoint_goes_on_with_the_same_bits() {
    // Every kind of memory a run has: step size, acceleration with columns of steps before, a slow node in mid-window.
    for method in [Acceleration::None, AITKEN, IQN_ILS] {
        for every in [1, 4] {
            let every = BTreeMap::from([("b".to_owned(), every)]);
            let mut settings = Settings { acceleration: method, every, ..settings(0.05, 1e-10, 12) };
            settings.dt.limit_s = 0.4;
            let members = || pair(&Solved::default(), &[0.9, -0.7, 0.4, 1.1]);
            let (whole, decisions, _) = run(members(), &settings, 3.0, 0, None).unwrap();
            let steps = accepted(&decisions).len() as u64;
            for split in [1, 2, 3, 5, steps - 1] {
                // The last checkpoint of a run that takes one after `split` steps and none after that.
                let (fields, _, checkpoint) = run(members(), &settings, 3.0, split, None).unwrap();
                assert_eq!(fields, whole, "taking checkpoints changes nothing");
                let checkpoint = checkpoint.unwrap();
                let (fields, rest, _) = run(members(), &settings, 3.0, 0, Some(checkpoint)).unwrap();
                assert_eq!(fields, whole, "{method:?}, split near {split} of {steps}");
                assert_eq!(rest, decisions[decisions.len() - rest.len()..]);
            }
        }
    }
}

#[test]
fn an_absolute_tolerance_suffices_for_a_field_near_zero() {
    // y stays within 1e-12 of zero, where a relative change means nothing.
    let tiny = |absolute| {
        let fields = BTreeMap::from([("x".to_owned(), FieldSettings { absolute, acceleration: None })]);
        let settings = Settings { fields, ..settings(1.0, 1e-3, 4) };
        run(pair(&Solved::default(), &[-0.9]), &settings, 1.0, 0, None).unwrap().1
    };
    let rejected = |decisions: &[Decision]| decisions.iter().filter(|d| d.verdict() == Verdict::Reject).count();
    assert!(rejected(&tiny(None)) > 0, "a rate of 0.81 does not reach 1e-3 in 4 iterations");
    let loose = tiny(Some(10.0));
    // y has no such tolerance and decides now.
    assert!(loose.iter().all(|decision| decision.limiting == "y"), "{:?}", loose[0]);
}

#[test]
fn two_writers_of_a_field_are_added_up() {
    let solved = Solved::default();
    let mut members = Members::new();
    relay(&mut members, &solved, "first", "x", Vec::new(), &[0.0]);
    relay(&mut members, &solved, "second", "x", Vec::new(), &[0.0]);
    relay(&mut members, &solved, "sum", "z", vec![port("x").as_sum()], &[1.0]);
    let settings = settings(1.0, 1e-9, 5);
    let (fields, ..) = run(members, &settings, 1.0, 0, None).unwrap();
    // z = Δt (1 + 2 x) with x = Δt = 1.
    assert_eq!(fields["z"].f64().unwrap(), [3.0]);
    let mut members = Members::new();
    relay(&mut members, &solved, "first", "x", Vec::new(), &[0.0]);
    relay(&mut members, &solved, "second", "x", Vec::new(), &[0.0]);
    relay(&mut members, &solved, "one", "z", vec![port("x").as_read()], &[1.0]);
    let ports = InProcess::new(members).ports();
    let error = stagger_coupling::plan(&ports, &settings).unwrap_err().to_string();
    assert!(error.contains("written by both `first` and `second`"), "{error}");
}
