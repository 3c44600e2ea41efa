//! What programs that know nothing of this one show of a recording: points and grids as Foxglove's point clouds, numbers of
//! the run, and log lines. Foxglove and Rerun open them as they are.
//!
//! They are made from the exchanges while these are recorded, at most so many over the run as the scene says, and stand in
//! the file beside them; nothing here reads them back.

mod cloud;
mod colour;
pub mod colour_scale;
pub mod quantities;
mod scalars;

use std::collections::BTreeMap;

use prost::Message as _;
use prost_types::Timestamp;
use stagger_messages::{Directive, Report, Verdict, directive, report};

use crate::{Body, Message, Outcome, RunInfo, Step, Steps, display::colour_scale::Range};
use schema::foxglove::{Log, log::Level};

/// The types generated from `recordings/proto`.
mod schema {
    // Generated: the comments of the .proto files are its documentation, and its lints are prost's concern.
    #![allow(missing_docs, clippy::all, unused_qualifications)]
    pub(super) mod foxglove {
        include!(concat!(env!("OUT_DIR"), "/foxglove.rs"));
    }
    pub(super) mod display {
        include!(concat!(env!("OUT_DIR"), "/stagger.display.v1.rs"));
    }
}

/// The compiled `FileDescriptorSet` of the schemas written here.
pub(crate) const DESCRIPTORS: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/display.bin"));
/// What the topics of this module begin with.
pub(crate) const TOPICS: &str = "display/";
const LOG: &str = "display/log";

/// Share of a time by which a sum of steps may miss it, and counts as having reached it: a million additions miss by some
/// 1e-10.
const ROUNDING: f64 = 1e-9;

/// Whether a run whose steps add up to `t_s` has come to a time of its scene, in s.
fn reached(t_s: f64, at_s: f64) -> bool {
    t_s * (1.0 + ROUNDING) >= at_s
}

/// A message on its way into the file.
pub(crate) struct Shown {
    pub(crate) topic: String,
    /// Full name of its protobuf type.
    pub(crate) schema: &'static str,
    pub(crate) data: Vec<u8>,
}

/// Makes what is shown from the messages of a run.
pub(crate) struct Display {
    steps: Steps,
    period_s: f64,
    /// When the next picture is due.
    next_s: f64,
    /// The decision about the step reached.
    reached: Option<Outcome>,
    epoch: Option<u32>,
    greeting: Option<String>,
    /// What colours the points of each support.
    ranges: BTreeMap<String, Range>,
}

impl Display {
    /// Pictures are at least `period_s` of simulated time apart.
    pub(crate) fn new(info: &RunInfo, period_s: f64) -> Self {
        let greeting = format!("run {}: {}, seed {}, {}", info.run, info.scene_file, info.seed, info.program);
        Self {
            steps: Steps::default(),
            period_s,
            next_s: f64::NEG_INFINITY,
            reached: None,
            epoch: None,
            greeting: Some(greeting),
            ranges: BTreeMap::new(),
        }
    }

    /// Takes a message of the run in the order of recording; returns what is to be written behind it.
    pub(crate) fn take(&mut self, topic: &str, body: Body) -> Vec<Shown> {
        let mut shown = Vec::new();
        let mut last = false;
        match &body {
            Body::Report(report) => shown.extend(failure(report)),
            Body::Directive(directive) => {
                last = matches!(directive.task, Some(directive::Task::Stop(_)));
                shown.extend(self.news(directive));
            }
            Body::Field(_) | Body::Manifest(_) | Body::Checkpoint(_) => {}
        }
        let message = Message { topic: topic.into(), log_time_ns: 0, publish_time_ns: 0, bytes: 0, body };
        let progress = self.steps.take(message);
        if let Some(outcome) = progress.outcome {
            match outcome.decision.verdict() {
                Verdict::Reject => shown.push(rejection(&outcome)),
                Verdict::Accept => self.reached = Some(outcome),
                Verdict::Iterate | Verdict::None => {}
            }
        }
        if let Some(step) = progress.step.filter(|step| last || reached(step.t_s, self.next_s)) {
            self.picture(&step, &mut shown);
        }
        shown
    }

    fn picture(&mut self, step: &Step, shown: &mut Vec<Shown>) {
        // Of the multiples of the period, the first one after this time: pictures do not drift apart.
        let next_s = ((step.t_s * (1.0 + ROUNDING) / self.period_s).floor() + 1.0) * self.period_s;
        self.next_s = if next_s.is_finite() { next_s } else { f64::INFINITY };
        for (support, shape) in step.supports.shapes(&step.fields) {
            let range = self.ranges.entry(support.clone()).or_insert(Range::EMPTY);
            if let Some(cloud) = cloud::point_cloud(step, &support, &shape, range) {
                // A support may have the name of another topic here.
                let other = support == "log" || support.starts_with("scalars");
                let topic = format!("{TOPICS}{}{support}", if other { "points/" } else { "" });
                let schema = "foxglove.PointCloud";
                shown.push(Shown { topic, schema, data: cloud.encode_to_vec() });
            }
        }
        let ledger = self.steps.decisions().ledger();
        for (name, scalar) in scalars::scalars(step, self.reached.as_ref(), ledger) {
            let topic = format!("{TOPICS}scalars/{name}");
            shown.push(Shown { topic, schema: "stagger.display.v1.Scalar", data: scalar.encode_to_vec() });
        }
    }

    /// Lines about what a directive says beside its decision.
    fn news(&mut self, directive: &Directive) -> Vec<Shown> {
        let Some(envelope) = &directive.envelope else { return Vec::new() };
        let mut lines: Vec<Shown> = self
            .greeting
            .take()
            .map(|text| line(envelope.t_s, Level::Info, "coordinator", &text))
            .into_iter()
            .collect();
        let again = self.epoch.replace(envelope.epoch).is_some_and(|before| before < envelope.epoch);
        if again {
            let step = envelope.version.unwrap_or_default().step;
            let text = format!("a node was started again; the run goes on from its last checkpoint, at step {step}");
            lines.push(line(envelope.t_s, Level::Warning, "coordinator", &text));
        }
        if let Some(directive::Task::Stop(stop)) = &directive.task {
            let level = if stop.completed { Level::Info } else { Level::Error };
            let t_s = directive.decision.as_ref().map_or(envelope.t_s, |decision| decision.t_s);
            lines.push(line(t_s, level, "coordinator", &format!("the run ends: {}", stop.reason)));
        }
        lines
    }
}

fn failure(report: &Report) -> Option<Shown> {
    let (Some(envelope), Some(report::Body::Failure(failure))) = (&report.envelope, &report.body) else { return None };
    // One that a smaller step may help is told as the rejection that follows.
    let level = if failure.retry { Level::Warning } else { Level::Error };
    Some(line(envelope.t_s, level, &envelope.sender, &failure.message))
}

fn rejection(outcome: &Outcome) -> Shown {
    let decision = &outcome.decision;
    let text = format!(
        "{} rejected at dt = {:.3e} s: {}; tried again with {:.3e} s",
        outcome.version, decision.dt_s, decision.reason, decision.next_dt_s
    );
    line(decision.t_s, Level::Warning, "coordinator", &text)
}

fn line(t_s: f64, level: Level, name: &str, message: &str) -> Shown {
    let log = Log {
        timestamp: Some(timestamp(t_s)),
        level: level.into(),
        message: message.into(),
        name: name.into(),
        ..Log::default()
    };
    Shown { topic: LOG.into(), schema: "foxglove.Log", data: log.encode_to_vec() }
}

/// Simulated time as the clocks of other programs have it.
fn timestamp(t_s: f64) -> Timestamp {
    const NS_PER_S: u64 = 1_000_000_000;
    // What is no time, or before the start, is shown at the start.
    let ns = (t_s * 1e9).round().max(0.0) as u64;
    Timestamp {
        seconds: i64::try_from(ns / NS_PER_S).unwrap_or(i64::MAX),
        nanos: i32::try_from(ns % NS_PER_S).unwrap_or_default(),
    }
}
