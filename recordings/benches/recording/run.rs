//! A made-up run: its exchanges, and the records they become.

use std::sync::Arc;

use bytes::Bytes;
use stagger_messages::{
    Decision, Directive, Done, Envelope, Field, Iterate, Measure, Port, Report, SCHEMA_VERSION, ValueKind, Verdict,
    Version, codec, directive, report,
};
use stagger_recordings::{ControlKind, Exchange, RunInfo};

const ITERATIONS: u32 = 3;
const DT_S: f64 = 1e-5;

/// Fields, their units and components.
const FIELDS: [(&str, &str, &str, u32); 4] = [
    ("particles", "positions", "m", 3),
    ("particles", "velocities", "m/s", 3),
    ("thermal", "temperature", "K", 1),
    ("optics", "absorbed_power", "W", 1),
];

/// What the runs are called.
pub fn info() -> RunInfo {
    RunInfo {
        run: "bench".into(),
        scene_file: "bench.toml".into(),
        scene_text: "duration = 1".into(),
        ..RunInfo::default()
    }
}

/// A run of so many particles that makes so many bytes.
pub struct Run {
    steps: u64,
    fields: Vec<Field>,
}

impl Run {
    pub fn of(particles: usize, amount: usize) -> Self {
        let mut state = 0x9e37_79b9_7f4a_7c15_u64;
        let mut number = || {
            // Marsaglia's xorshift: digits as random as those of a position.
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            1e-3 * (state >> 11) as f64 / (1u64 << 53) as f64
        };
        let fields = FIELDS.map(|(_, name, unit, components)| {
            let port = Arc::new(Port::f64(name, unit, "particles", components, Measure::None));
            let values: Vec<f64> = (0..particles * components as usize).map(|_| number()).collect();
            Field::new(&port, 0, values).expect("values fill the port")
        });
        let per_step = ITERATIONS as usize * fields.iter().map(|field| field.values().bytes().len()).sum::<usize>();
        Self { steps: (amount / per_step).max(1) as u64, fields: fields.into() }
    }

    /// Bytes of all values.
    pub fn bytes(&self) -> usize {
        let per_iteration: usize = self.fields.iter().map(|field| field.values().bytes().len()).sum();
        per_iteration * ITERATIONS as usize * self.steps as usize
    }

    /// Simulated time, in s.
    pub fn duration_s(&self) -> f64 {
        self.steps as f64 * DT_S
    }

    /// The exchanges, iteration by iteration.
    pub fn rounds(&self) -> impl Iterator<Item = Vec<Exchange>> {
        let versions = (1..=self.steps)
            .flat_map(|step| (1..=ITERATIONS).map(move |iteration| Version { step, attempt: 1, iteration }));
        std::iter::once(vec![directive(0, None, Version::first(1), 0.0)])
            .chain(versions.enumerate().map(|(number, version)| self.round(number as u64 + 1, version)))
    }

    fn round(&self, number: u64, version: Version) -> Vec<Exchange> {
        let t_s = (version.step - 1) as f64 * DT_S;
        let mut round: Vec<Exchange> = Vec::new();
        for ((node, name, ..), field) in FIELDS.iter().zip(&self.fields) {
            let attachment = codec::field_attachment(&envelope(node, number, version, t_s), field, None);
            let payload = field.values().bytes().clone();
            round.push(Exchange::Field {
                topic: format!("field/{node}/{name}"),
                attachment: attachment.into(),
                payload,
            });
        }
        for node in ["particles", "thermal", "optics"] {
            let done = report::Body::Done(Done { converged: true, solve_s: 1e-3, ..Done::default() });
            let message = Report { envelope: Some(envelope(node, number, version, t_s)), body: Some(done) };
            round.push(control(format!("done/{node}"), &message, ControlKind::Report));
        }
        let accepted = version.iteration == ITERATIONS;
        let verdict = if accepted { Verdict::Accept } else { Verdict::Iterate };
        let t_s = if accepted { t_s + DT_S } else { t_s };
        let decision =
            Decision { version: Some(version), verdict: verdict.into(), t_s, dt_s: DT_S, ..Decision::default() };
        let next = if accepted { Version::first(version.step + 1) } else { version.next_iteration() };
        round.push(directive(number, Some(decision), next, t_s));
        round
    }

    /// The same as it stands in the file.
    pub fn records(&self) -> impl Iterator<Item = Ready> {
        self.rounds().flatten().map(|exchange| {
            let (topic, schema, record) = match exchange {
                Exchange::Field { topic, attachment, payload } => {
                    let record = codec::field_record(&attachment, ValueKind::F64, &payload).into();
                    (topic, "stagger.v1.FieldMessage", record)
                }
                Exchange::Control { topic, message, kind: ControlKind::Report } => {
                    (topic, "stagger.v1.Report", message)
                }
                Exchange::Control { topic, message, .. } => (topic, "stagger.v1.Directive", message),
            };
            Ready { topic, schema, log_time: 0, record }
        })
    }
}

/// A message as it stands in the file.
pub struct Ready {
    pub topic: String,
    pub schema: &'static str,
    /// In ns.
    pub log_time: u64,
    pub record: Bytes,
}

fn directive(number: u64, decision: Option<Decision>, next: Version, t_s: f64) -> Exchange {
    let task = directive::Task::Iterate(Iterate::default());
    let envelope = Some(envelope("coordinator", number, next, t_s));
    let message = Directive { envelope, decision, task: Some(task), checkpoint: false };
    control("ctl/directive".into(), &message, ControlKind::Directive)
}

fn control(topic: String, message: &impl prost::Message, kind: ControlKind) -> Exchange {
    Exchange::Control { topic, message: message.encode_to_vec().into(), kind }
}

fn envelope(node: &str, sequence: u64, version: Version, t_s: f64) -> Envelope {
    Envelope {
        run: "bench".into(),
        schema: SCHEMA_VERSION,
        epoch: 1,
        sender: node.into(),
        sequence,
        version: Some(version),
        t_s,
        dt_s: DT_S,
    }
}
