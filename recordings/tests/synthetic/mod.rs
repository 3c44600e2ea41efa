//! A made-up run of three nodes, for trying recordings without solving anything: powder falls on a plate, a beam sweeps
//! over it and heats it. Every step takes three iterations; each 25th step is rejected once.

#![allow(clippy::unwrap_used, reason = "the fields made up here fill their ports")]

use std::sync::Arc;

use stagger_messages::{
    Decision, Directive, Done, Energy, Envelope, Field, FieldError, Iterate, Manifest, Measure, Plan, Port, Ready,
    Report, SCHEMA_VERSION, Stop, Verdict, Version, codec, directive, report,
};
use stagger_recordings::{ControlKind, Exchange, RunInfo};

/// Radius of a particle, in m.
pub const RADIUS_M: f64 = 25e-6;
/// Radius of the beam, in m.
const BEAM_RADIUS_M: f64 = 60e-6;
/// Power of the beam, in W.
const BEAM_POWER_W: f64 = 40.0;
/// When the beam is switched on, in s.
const BEAM_STARTS_S: f64 = 7e-3;
/// Iterations of an accepted attempt.
pub const ITERATIONS: u32 = 3;
/// Each n-th step is rejected once.
pub const REJECTED_EVERY: u64 = 25;

/// What kind of run to make up.
#[derive(Clone, Copy)]
pub struct Script {
    /// Number of particles.
    pub particles: usize,
    /// Number of accepted steps.
    pub steps: u64,
    /// Window size, in s.
    pub dt_s: f64,
}

/// Description of the made-up run.
pub fn info() -> RunInfo {
    RunInfo {
        run: "synthetic".into(),
        scene_file: "synthetic.toml".into(),
        scene_text: "title = \"Powder falls on a plate, a beam sweeps over it\"\n".into(),
        files: [("bed.csv".to_owned(), b"x,y,z,radius\n".as_slice().into())].into(),
        scene_hash: 0x5ca1_ab1e,
        overrides: vec![("duration".into(), "20 ms".into()), ("seed".into(), "7".into())],
        seed: 7,
        program: "synthetic recording".into(),
        started_unix_ns: 1_700_000_000_000_000_000,
        machine: [("threads".to_owned(), "1".to_owned())].into(),
        ..RunInfo::default()
    }
}

/// The exchanges of a whole run, in the order in which they are sent.
pub fn exchanges(script: Script) -> Vec<Exchange> {
    let mut run =
        Run { script, sent: Vec::new(), sequence: [0; 4], contacts: Vec::new(), revision: 0, contacts_at: None };
    run.start();
    (1..=script.steps).for_each(|step| run.step(step));
    run.sent
}

const NODES: [&str; 4] = ["coordinator", "particles", "thermal", "optics"];

struct Run {
    script: Script,
    sent: Vec<Exchange>,
    sequence: [u64; 4],
    contacts: Vec<u32>,
    revision: u64,
    contacts_at: Option<Version>,
}

impl Run {
    fn start(&mut self) {
        for node in &NODES[1..] {
            let message = Manifest {
                run: "synthetic".into(),
                schema: SCHEMA_VERSION,
                node: (*node).into(),
                ..Manifest::default()
            };
            self.control(format!("meta/{node}"), &message, ControlKind::Manifest);
        }
        self.directive(Version::INITIAL, 0.0, None, Some(directive::Task::Plan(Plan::default())));
        self.fields(Version::INITIAL, 0.0, 0.0);
        for node in 1..4 {
            let ledger = ledger(NODES[node], self.script, 0.0, 0.0);
            let ledger = ledger.into_iter().filter(|line| line.kind() == stagger_messages::energy::Kind::Stored);
            let body = report::Body::Ready(Ready { ledger: ledger.collect() });
            self.report(node, Version::INITIAL, 0.0, body);
        }
        let task =
            directive::Task::Iterate(Iterate { committed: Some(Version::INITIAL), again: false, parts: Vec::new() });
        self.directive(Version::first(1), 0.0, None, Some(task));
    }

    fn step(&mut self, step: u64) {
        let dt = self.script.dt_s;
        let t = (step - 1) as f64 * dt;
        let rejected = step.is_multiple_of(REJECTED_EVERY);
        for attempt in 1..=1 + u32::from(rejected) {
            let given_up = rejected && attempt == 1;
            let last = if given_up { ITERATIONS - 1 } else { ITERATIONS };
            for iteration in 1..=last {
                let version = Version { step, attempt, iteration };
                // A trial of the attempt given up goes too far.
                let error = 0.1f64.powi(iteration as i32) + if given_up { 1.0 } else { 0.0 };
                self.fields(version, t, error);
                self.reports(version, t);
                let (verdict, next) = match iteration == last {
                    false => (Verdict::Iterate, version.next_iteration()),
                    true if given_up => (Verdict::Reject, version.next_attempt()),
                    true => (Verdict::Accept, Version::first(step + 1)),
                };
                let accepted = verdict == Verdict::Accept;
                let reached = if accepted { t + dt } else { t };
                let errors = [("positions", 1e-6 * 300.0), ("temperature", 1e-6 * 500.0)];
                let errors = errors.map(|(field, scale)| FieldError {
                    field: field.into(),
                    error: error * scale,
                    tolerance: 1e-6,
                    ..FieldError::default()
                });
                let decision = Decision {
                    version: Some(version),
                    verdict: verdict.into(),
                    violation: error * 500.0,
                    factor: 1.0,
                    limiting: "temperature".into(),
                    errors: errors.into(),
                    t_s: reached,
                    dt_s: dt,
                    next_dt_s: dt,
                    ..Decision::default()
                };
                let end = accepted && step == self.script.steps;
                let task = if end {
                    directive::Task::Stop(Stop { completed: true, reason: "duration reached".into() })
                } else {
                    let committed = if accepted { version } else { Version::INITIAL };
                    directive::Task::Iterate(Iterate { committed: Some(committed), again: false, parts: Vec::new() })
                };
                self.directive(next, reached, Some(decision), Some(task));
            }
        }
    }

    fn fields(&mut self, version: Version, t: f64, error: f64) {
        let script = self.script;
        let end = t + if version.step == 0 { 0.0 } else { script.dt_s };
        let motion: Vec<[f64; 3]> = (0..script.particles).map(|i| position(i, end + error * 1e-6)).collect();
        let velocities = (0..script.particles).flat_map(|i| [0.0, 0.0, velocity(i, end)]).collect::<Vec<f64>>();
        let same_as = (version.step > 0).then_some(Version::INITIAL);
        let f64_port =
            |field: &str, unit: &str, components| Port::f64(field, unit, "particles", components, Measure::None);
        let positions = Port::f64("positions", "m", "particles", 3, Measure::Increment);
        self.f64(1, version, t, positions, motion.concat(), None);
        self.f64(1, version, t, f64_port("velocities", "m/s", 3), velocities, None);
        self.f64(1, version, t, f64_port("radii", "m", 1), vec![RADIUS_M; script.particles], same_as);
        self.contacts(version, t, &motion);
        let temperature = Port::f64("temperature", "K", "particles", 1, Measure::Magnitude);
        let kelvin = (0..script.particles).map(|i| kelvin(i, end) + error).collect();
        self.f64(2, version, t, temperature, kelvin, None);
        let beam = |field: &str, unit: &str, components| Port::f64(field, unit, "beam", components, Measure::None);
        self.f64(3, version, t, beam("beam_spot", "m", 3), beam_spot(end).into(), None);
        self.f64(3, version, t, beam("beam_radius", "m", 1), vec![BEAM_RADIUS_M], same_as);
        self.f64(3, version, t, beam("beam_power", "W", 1), vec![power(end)], None);
    }

    fn contacts(&mut self, version: Version, t: f64, positions: &[[f64; 3]]) {
        let mut pairs = Vec::new();
        for (i, a) in positions.iter().enumerate() {
            for (j, b) in positions.iter().enumerate().skip(i + 1) {
                let square: f64 = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum();
                if square.sqrt() < 2.0 * RADIUS_M {
                    pairs.extend([i as u32, j as u32]);
                }
            }
        }
        let unchanged = self.contacts_at.filter(|_| pairs == self.contacts);
        if unchanged.is_none() {
            self.revision += 1;
            self.contacts.clone_from(&pairs);
            self.contacts_at = Some(version);
        }
        let field = Field::new(&Arc::new(Port::u32("contact_pairs", "contacts", 2)), self.revision, pairs).unwrap();
        self.field(1, version, t, &field, unchanged);
    }

    fn f64(&mut self, node: usize, version: Version, t: f64, port: Port, values: Vec<f64>, same_as: Option<Version>) {
        let field = Field::new(&Arc::new(port), 0, values).unwrap();
        self.field(node, version, t, &field, same_as);
    }

    fn field(&mut self, node: usize, version: Version, t: f64, field: &Field, same_as: Option<Version>) {
        let attachment = codec::field_attachment(&self.envelope(node, version, t), field, same_as);
        let payload = if same_as.is_some() { Default::default() } else { field.values().bytes().clone() };
        let topic = format!("field/{}/{}", NODES[node], field.name());
        self.sent.push(Exchange::Field { topic, attachment: attachment.into(), payload });
    }

    fn reports(&mut self, version: Version, t: f64) {
        for (node, solve_s) in [(1, 4e-3), (2, 1e-3), (3, 2e-3)] {
            let done = Done {
                converged: true,
                ledger: ledger(NODES[node], self.script, t, self.script.dt_s),
                solve_s: solve_s * (1.0 + 0.2 * (t * 2e3).sin()),
                wait_s: 3e-4,
                ..Done::default()
            };
            self.report(node, version, t, report::Body::Done(done));
        }
    }

    fn report(&mut self, node: usize, version: Version, t: f64, body: report::Body) {
        let message = Report { envelope: Some(self.envelope(node, version, t)), body: Some(body) };
        self.control(format!("done/{}", NODES[node]), &message, ControlKind::Report);
    }

    fn directive(&mut self, version: Version, t: f64, decision: Option<Decision>, task: Option<directive::Task>) {
        let message = Directive { envelope: Some(self.envelope(0, version, t)), decision, task, checkpoint: false };
        self.control("ctl/directive".into(), &message, ControlKind::Directive);
    }

    fn control(&mut self, topic: String, message: &impl prost::Message, kind: ControlKind) {
        self.sent.push(Exchange::Control { topic, message: message.encode_to_vec().into(), kind });
    }

    fn envelope(&mut self, node: usize, version: Version, t: f64) -> Envelope {
        let sequence = self.sequence[node];
        self.sequence[node] += 1;
        Envelope {
            run: "synthetic".into(),
            schema: SCHEMA_VERSION,
            epoch: 1,
            sender: NODES[node].into(),
            sequence,
            version: Some(version),
            t_s: t,
            dt_s: self.script.dt_s,
        }
    }
}

/// Evenly scattered numbers in [0, 1): multiples of an irrational number.
fn scattered(i: usize, irrational: f64) -> f64 {
    (i as f64 * irrational).fract()
}

/// Where a particle comes to rest: in layers of 10 by 10, in m.
fn rest(i: usize) -> [f64; 3] {
    let (column, row, layer) = (i % 10, i / 10 % 10, i / 100);
    let jitter = |irrational| (scattered(i, irrational) - 0.5) * 8e-6;
    [
        (column as f64 - 4.5) * 51e-6 + jitter(0.618_034),
        (row as f64 - 4.5) * 51e-6 + jitter(0.414_214),
        RADIUS_M + layer as f64 * 49e-6,
    ]
}

/// Height from which a particle falls, in m.
fn drop_height(i: usize) -> f64 {
    0.3e-3 + 1.2e-3 * (i as f64 / 300.0) + 0.1e-3 * scattered(i, 0.732_051)
}

fn position(i: usize, t: f64) -> [f64; 3] {
    let [x, y, z] = rest(i);
    [x, y, z.max(drop_height(i) - 0.25 * t)]
}

fn velocity(i: usize, t: f64) -> f64 {
    if drop_height(i) - 0.25 * t > rest(i)[2] { -0.25 } else { 0.0 }
}

fn power(t: f64) -> f64 {
    if t < BEAM_STARTS_S { 0.0 } else { BEAM_POWER_W }
}

fn beam_spot(t: f64) -> [f64; 3] {
    [-0.3e-3 + 0.05 * (t - BEAM_STARTS_S).max(0.0), 0.0, 0.0]
}

/// Temperature after the beam has passed: a rise by its Gaussian profile and a slow decay, in K.
fn kelvin(i: usize, t: f64) -> f64 {
    let [x, y, z] = rest(i);
    let passed_s = t - BEAM_STARTS_S - (x + 0.3e-3) / 0.05;
    let profile = (-2.0 * (y / BEAM_RADIUS_M).powi(2) + z / 2e-4).exp();
    let rise = 1.0 / (1.0 + (-passed_s / 4e-4).exp());
    300.0 + 900.0 * profile * rise * (-passed_s.max(0.0) / 2e-2).exp()
}

fn ledger(node: &str, script: Script, t: f64, dt: f64) -> Vec<Energy> {
    // Mass of a steel particle and its heat capacity times mass.
    let mass = 7900.0 * 4.0 / 3.0 * std::f64::consts::PI * RADIUS_M.powi(3);
    let (heat_capacity, gravity) = (500.0 * mass, 9.81);
    let sum = |f: &dyn Fn(usize) -> f64| (0..script.particles).map(f).sum::<f64>();
    let kinetic = |t: f64| sum(&|i| 0.5 * mass * velocity(i, t).powi(2));
    let potential = |t: f64| sum(&|i| mass * gravity * position(i, t)[2]);
    let heat = |t: f64| sum(&|i| heat_capacity * (kelvin(i, t) - 300.0));
    let end = t + dt;
    match node {
        "particles" => vec![
            Energy::stored("kinetic", kinetic(end)),
            Energy::stored("potential", potential(end)),
            Energy::stored("elastic", 0.0),
            Energy::lost("contact_damping", kinetic(t) + potential(t) - kinetic(end) - potential(end)),
        ],
        "thermal" => vec![
            Energy::stored("heat", heat(end)),
            Energy::gained("absorbed", 0.3 * power(end) * dt),
            Energy::lost("to_walls", 0.3 * power(end) * dt - heat(end) + heat(t)),
        ],
        _ => vec![
            Energy::gained("laser", power(end) * dt),
            Energy::lost("absorbed", 0.3 * power(end) * dt),
            Energy::lost("passed", 0.7 * power(end) * dt),
        ],
    }
}
