//! Watches a run: counts, energy, time per node, and a line of progress on a terminal.

use std::{
    collections::BTreeMap,
    io::{IsTerminal as _, Write as _},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};

use serde::{Deserialize, Serialize};
use stagger_coupling::{Ledger, Listener, Outcome};
use stagger_messages::{Decision, Done, Ready, Verdict};

use crate::diagnostics;

/// How often the line of progress is written on a terminal, over the one before.
const REFRESH: Duration = Duration::from_millis(200);
/// How often a line of progress is written elsewhere, such as into a log.
const LOG: Duration = Duration::from_secs(10);
/// Part of the rejections that end a run, at which they are told.
const WARNED: u32 = 5;

/// What happened to the steps of a run.
#[derive(Clone, Debug, Default, Serialize, Deserialize, PartialEq)]
pub struct Steps {
    /// Steps accepted.
    pub accepted: u64,
    /// Attempts rejected.
    pub rejected: u64,
    /// Iterations, those of rejected attempts too.
    pub iterations: u64,
    /// Simulated time reached, in s.
    pub time_s: f64,
    /// Smallest accepted window, in s.
    pub dt_min_s: f64,
    /// Mean accepted window, in s.
    pub dt_mean_s: f64,
    /// Largest accepted window, in s.
    pub dt_max_s: f64,
    /// How often each field had the largest error over its tolerance in the first iteration of an attempt.
    pub limiting: BTreeMap<String, u64>,
    /// How often each field set the size of the step after an accepted one: the most sensitive field.
    pub sensitive: BTreeMap<String, u64>,
    /// Mean contraction rate of the limiting field, over attempts of two iterations and more; 0 where there is none.
    pub contraction: f64,
    /// Attempts that rate is the mean of.
    pub contractions: u64,
}

/// What a node did.
#[derive(Clone, Debug, Default, Serialize, Deserialize, PartialEq)]
pub struct Work {
    /// Windows solved.
    pub solves: u64,
    /// Replies given again because the frozen fields had not changed.
    pub reused: u64,
    /// Time in solve, in s.
    pub solve_s: f64,
    /// Time waiting for frozen fields, in s.
    pub wait_s: f64,
    /// Fields published.
    pub exchanges: u64,
    /// Bytes of their values.
    pub bytes: u64,
    /// Messages refused.
    pub refused: u64,
    /// Quantities of the physics in its last accepted window.
    pub figures: BTreeMap<String, f64>,
}

/// What a checkpoint keeps of a [`Monitor`].
#[derive(Default, Serialize, Deserialize)]
struct Totals {
    steps: Steps,
    nodes: BTreeMap<String, Work>,
}

/// Everything a run's summary is made of.
pub struct Monitor {
    /// Steps.
    pub steps: Steps,
    /// Work by node.
    pub nodes: BTreeMap<String, Work>,
    /// Energy.
    pub ledger: Ledger,
    begun: Instant,
    duration_s: f64,
    shown: Option<Instant>,
    interrupted: Arc<AtomicBool>,
    /// When the nodes were ready last.
    ready_at: Option<Instant>,
    /// Rejections of one step, one after the other, that end the run.
    pub rejections: u32,
}

impl Monitor {
    /// Watches a run of `duration_s` simulated seconds; `interrupted` ends it after the current step.
    #[must_use]
    pub fn new(duration_s: f64, interrupted: Arc<AtomicBool>) -> Self {
        Self {
            steps: Steps::default(),
            nodes: BTreeMap::new(),
            ledger: Ledger::default(),
            begun: Instant::now(),
            duration_s,
            shown: None,
            interrupted,
            ready_at: None,
            rejections: u32::MAX,
        }
    }

    /// When the nodes were ready last.
    #[must_use]
    pub fn ready_at(&self) -> Option<Instant> {
        self.ready_at
    }

    /// Counts on from a checkpoint, or from nothing.
    ///
    /// # Errors
    /// The bytes are not those of a checkpoint.
    pub fn restore(&mut self, saved: Option<(Ledger, Vec<u8>)>) -> Result<(), postcard::Error> {
        let (ledger, Totals { steps, nodes }) = match saved {
            Some((ledger, totals)) => (ledger, postcard::from_bytes(&totals)?),
            None => Default::default(),
        };
        (self.steps, self.nodes, self.ledger) = (steps, nodes, ledger);
        Ok(())
    }

    fn book(&mut self, node: &str, done: &Done, accepted_s: Option<f64>) {
        let work = self.nodes.entry(node.into()).or_default();
        if done.reused {
            work.reused += 1;
        } else {
            work.solves += 1;
        }
        work.solve_s += done.solve_s;
        work.wait_s += done.wait_s;
        work.exchanges += u64::from(done.fields);
        work.bytes += done.bytes;
        work.refused = done.refused;
        if let Some(t_s) = accepted_s {
            work.figures = done.figures.clone().into_iter().collect();
            self.ledger.book_until(node, &done.ledger, t_s);
        }
    }

    fn show(&mut self, decision: &Decision) {
        let now = Instant::now();
        let terminal = std::io::stderr().is_terminal();
        // A log is not told of a run that is over before long.
        let due = match (self.shown, terminal) {
            (Some(last), true) => now.duration_since(last) >= REFRESH,
            (last, false) => now.duration_since(last.unwrap_or(self.begun)) >= LOG,
            (None, true) => true,
        };
        if !due {
            return;
        }
        self.shown = Some(now);
        let share = self.steps.time_s / self.duration_s;
        let left = match share > 0.0 {
            true => format!("{:.0} s left", self.begun.elapsed().as_secs_f64() * (1.0 - share) / share),
            false => "starting".into(),
        };
        let line = format!(
            "{:3.0} %  t {:.4} ms  dt {:.3} us  step {}  {} iterations  {} rejected  {left}",
            100.0 * share,
            1e3 * self.steps.time_s,
            1e6 * decision.next_dt_s,
            self.steps.accepted,
            self.steps.iterations,
            self.steps.rejected,
        );
        if terminal {
            // A terminal that is gone is no reason to end the run.
            let _ = std::io::stderr().write_all(format!("\r\x1b[K{line}").as_bytes());
        } else {
            diagnostics::note(line.trim_start());
        }
    }

    /// Ends the line of progress and returns the wall time, in s.
    pub fn finish(&mut self) -> f64 {
        if self.shown.take().is_some() && std::io::stderr().is_terminal() {
            let _ = std::io::stderr().write_all(b"\r\x1b[K");
        }
        self.begun.elapsed().as_secs_f64()
    }
}

impl Listener for Monitor {
    fn started(&mut self, ready: &[(String, Ready)]) {
        self.ready_at = Some(Instant::now());
        for (node, ready) in ready {
            self.nodes.entry(node.clone()).or_default();
            self.ledger.start(node, &ready.ledger);
        }
    }

    fn decided(&mut self, decision: &Decision, outcomes: &[Outcome]) -> bool {
        let accepted = decision.verdict() == Verdict::Accept;
        for outcome in outcomes {
            if let Ok(done) = &outcome.result {
                self.book(&outcome.node, done, accepted.then_some(decision.t_s));
            }
        }
        let steps = &mut self.steps;
        steps.iterations += 1;
        if decision.version.is_some_and(|version| version.iteration == 1) && !decision.limiting.is_empty() {
            *steps.limiting.entry(decision.limiting.clone()).or_default() += 1;
        }
        match decision.verdict() {
            Verdict::Accept => {
                steps.accepted += 1;
                steps.time_s = decision.t_s;
                steps.dt_min_s = if steps.accepted == 1 { decision.dt_s } else { steps.dt_min_s.min(decision.dt_s) };
                steps.dt_max_s = steps.dt_max_s.max(decision.dt_s);
                steps.dt_mean_s = decision.t_s / steps.accepted as f64;
            }
            Verdict::Reject => {
                steps.rejected += 1;
                let times = decision.version.map_or(0, |version| version.attempt);
                if times == (self.rejections / WARNED).max(1) {
                    diagnostics::warn(&format!(
                        "the step from t = {:e} s was rejected {times} times, the last with dt = {:e} s: {}; after {} the run ends",
                        decision.t_s, decision.dt_s, decision.reason, self.rejections
                    ));
                }
            }
            Verdict::Iterate | Verdict::None => {}
        }
        if decision.verdict() != Verdict::Iterate {
            if !decision.sensitive.is_empty() {
                *steps.sensitive.entry(decision.sensitive.clone()).or_default() += 1;
            }
            if decision.contraction > 0.0 && decision.contraction.is_finite() {
                steps.contractions += 1;
                steps.contraction += (decision.contraction - steps.contraction) / steps.contractions as f64;
            }
        }
        self.show(decision);
        !self.interrupted.load(Ordering::Relaxed)
    }

    fn ledger(&self) -> Ledger {
        self.ledger.clone()
    }

    fn save(&self) -> Vec<u8> {
        let totals = Totals { steps: self.steps.clone(), nodes: self.nodes.clone() };
        // Numbers and names into memory: nothing that could fail; and totals that are lost lose no result.
        postcard::to_stdvec(&totals).unwrap_or_default()
    }
}
