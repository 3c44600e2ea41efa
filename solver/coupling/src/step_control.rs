//! Accept, iterate or reject a step, and how long the next one is (Zohdi 2018, section 6.4).

use std::{collections::BTreeMap, sync::Arc};

use serde::{Deserialize, Serialize};
use stagger_messages::Shown;
use stagger_messages::{Decision, Done, Failure, FieldError, Measure, Verdict, Version};

use super::{Acceleration, Measured, Precedent, Settings, Window, order, relative};
use crate::math;

/// What one node answered to one iteration.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The node.
    pub node: String,
    /// Its reply, or why it has none.
    pub result: Result<Done, Failure>,
}

/// What to do where a node's own words say why a step cannot be solved.
const NODE_HINT: &str = "Look at the settings and the inputs of that node, or lower coupling.dt.minimum";
/// The same where a change overflows.
const BROKEN_HINT: &str = "Look at the settings and the inputs of the node that writes it";
/// The same where fields do not converge.
const FIELD_HINT: &str = "Loosen the tolerance, raise coupling.iterations, or look at the inputs of that row";
/// The same where the iteration diverges and is not accelerated by IQN-ILS.
const DIVERGES_HINT: &str = "Set coupling.acceleration = \"iqn-ils\", which converges where the iteration by itself grows, or \
                             weaken what the fields do to each other";
/// The same where it contracts, but too slowly.
const SLOW_HINT: &str = "Set coupling.acceleration = \"iqn-ils\", which needs fewer iterations, raise coupling.iterations, loosen \
                         the tolerance, or look at the inputs of that row";

/// Why a run cannot go on.
#[derive(Debug, Clone, thiserror::Error, PartialEq)]
pub enum ControlError {
    /// The window would have to be smaller than the scene allows.
    #[error(
        "the step from t = {:e} s does not converge above coupling.dt.minimum = {:e} s: {what}. {hint}",
        Shown(*.t_s),
        Shown(*.minimum_s)
    )]
    TooSmall {
        /// Start of the window, in s.
        t_s: f64,
        /// Δt_min, in s.
        minimum_s: f64,
        /// The field and the row that would not converge, or the node's own words.
        what: String,
        /// What to do.
        hint: &'static str,
    },
    /// One step was rejected again and again.
    #[error(
        "the step from t = {:e} s was rejected {rejections} times, the last with dt = {:e} s: {what}. {hint}; \
         coupling.rejections says how often a step may be rejected",
        Shown(*.t_s),
        Shown(*.dt_s)
    )]
    TooOften {
        /// Start of the window, in s.
        t_s: f64,
        /// Attempts rejected.
        rejections: u32,
        /// The last window, in s.
        dt_s: f64,
        /// The field and the row that would not converge, or the node's own words.
        what: String,
        /// What to do.
        hint: &'static str,
    },
    /// A node cannot go on whatever the step.
    #[error("node `{node}` failed: {message}")]
    Node {
        /// The node.
        node: String,
        /// Its words.
        message: String,
    },
    /// Fields on the same rows do not have as many.
    #[error(transparent)]
    Rows(Box<OtherRows>),
    /// A trial is needed that the earlier run did not ask for, whose recorded nodes take part.
    #[error(
        "{wanted} is needed, but was never recorded: {why}. Loosen coupling.tolerance of the field, run more of the nodes \
         live, or record again with a smaller tolerance, which takes more iterations, or a smaller coupling.dt.limit"
    )]
    NotRecorded {
        /// The trial.
        wanted: Version,
        /// Why it is needed, in words.
        why: String,
    },
}

/// Fields of two nodes on the same rows that do not have as many.
#[derive(Debug, Clone, thiserror::Error, PartialEq)]
#[error(
    "node `{node}` wrote {rows} rows of `{field}` on `{support}`, but `{other_field}` of node `{other}` has {other_rows}, both of \
     revision {revision}: every field on `{support}` has a row for each of them; look at what a node of your own writes"
)]
pub struct OtherRows {
    /// The node.
    pub node: String,
    /// Its field.
    pub field: String,
    /// Rows it has.
    pub rows: u64,
    /// What they stand on.
    pub support: String,
    /// Its revision.
    pub revision: u64,
    /// The other node.
    pub other: String,
    /// Its field.
    pub other_field: String,
    /// Rows that has.
    pub other_rows: u64,
}

/// The adaptive step: accept, iterate or reject, and the size of the next window (Zohdi 2018, section 6.4).
#[derive(Clone, Debug)]
pub struct StepControl {
    settings: Settings,
    /// Measured fields by node and name.
    fields: BTreeMap<(String, String), Tolerances>,
    duration_s: f64,
    progress: Progress,
    precedent: Option<Arc<Precedent>>,
    rejects_every: Option<u64>,
}

/// When a field has converged.
#[derive(Clone, Copy, Debug)]
struct Tolerances {
    measure: Measure,
    relative: f64,
    absolute: Option<f64>,
}

/// How far the step control has come: what a checkpoint keeps of it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Progress {
    t_s: f64,
    /// Size of the next window before it is cut to end with the run.
    dt_s: f64,
    version: Version,
    committed: Version,
    /// ε⁰ of each field: its change in the first iteration of this attempt.
    first_errors: BTreeMap<(String, String), f64>,
    /// Contraction rate and most sensitive field, from the last iteration of this attempt that tells: where nothing
    /// changes any more, nothing does.
    estimate: (f64, String),
}

impl StepControl {
    /// Starts at t = 0. `measured` are the fields that decide convergence; a run ends at `duration_s`.
    #[must_use]
    pub fn new(settings: &Settings, measured: &Measured, duration_s: f64) -> Self {
        let fields = measured
            .iter()
            .filter(|(_, measure)| **measure != Measure::None)
            .map(|(key, measure)| {
                let field = &key.1;
                let absolute = settings.fields.get(field).and_then(|field| field.absolute);
                (key.clone(), Tolerances { measure: *measure, relative: settings.tolerance_of(field), absolute })
            })
            .collect();
        let progress = Progress {
            t_s: 0.0,
            dt_s: settings.dt.start_s.min(settings.dt.limit_s),
            version: Version::first(1),
            committed: Version::INITIAL,
            first_errors: BTreeMap::new(),
            estimate: (0.0, String::new()),
        };
        Self { settings: settings.clone(), fields, duration_s, progress, precedent: None, rejects_every: None }
    }

    /// How far it has come, for a checkpoint.
    #[must_use]
    pub fn progress(&self) -> &Progress {
        &self.progress
    }

    /// Goes on from a checkpoint.
    pub fn restore(&mut self, progress: Progress) {
        self.progress = progress;
    }

    /// Takes the windows, iterations and rejections of an earlier run instead of its own. An iteration that was accepted
    /// then must have converged now too.
    pub fn follow(&mut self, precedent: Arc<Precedent>) {
        self.precedent = Some(precedent);
        if let Some(dt_s) = self.recorded_size(self.progress.version) {
            self.progress.dt_s = dt_s;
        }
    }

    /// Rejects each `steps`-th step once, when it has converged, and has the same window solved again. A solve depends on its
    /// arguments alone, so that the run must reach the same end, to the bit: a test of every physics that keeps anything
    /// from one solve to the next. Not for runs that follow a precedent.
    pub fn reject_every(&mut self, steps: std::num::NonZeroU64) {
        self.rejects_every = Some(steps.get());
    }

    fn recorded_size(&self, version: Version) -> Option<f64> {
        self.precedent.as_ref()?.dt_s(version)
    }

    /// The window to solve now; the last one ends with the run.
    #[must_use]
    pub fn window(&self) -> Window {
        let Progress { t_s, dt_s, .. } = self.progress;
        let left = self.duration_s - t_s;
        // A remainder of rounding, which a million additions make 1e-7 of a window, would be a window of no meaning.
        let dt_s = if left <= dt_s * (1.0 + 1e-6) { left } else { dt_s };
        Window { t_s, dt_s }
    }

    /// The version to solve now.
    #[must_use]
    pub fn version(&self) -> Version {
        self.progress.version
    }

    /// The version committed last.
    #[must_use]
    pub fn committed(&self) -> Version {
        self.progress.committed
    }

    /// Whether the window to solve now ends the run.
    #[must_use]
    pub fn is_last(&self) -> bool {
        let Window { t_s, dt_s } = self.window();
        t_s + dt_s >= self.duration_s
    }

    /// Whether the run has reached its end.
    #[must_use]
    pub fn finished(&self) -> bool {
        self.progress.t_s >= self.duration_s
    }

    /// Decides about one iteration of all nodes and moves on to what follows from it.
    ///
    /// # Errors
    /// A node failed for good, the window would fall under Δt_min, or an earlier run that is followed decided otherwise.
    pub fn judge(&mut self, outcomes: &[Outcome]) -> Result<Decision, ControlError> {
        let window = self.window();
        let mut decision = Decision {
            version: Some(self.progress.version),
            t_s: window.t_s,
            dt_s: window.dt_s,
            next_dt_s: window.dt_s,
            ..Decision::default()
        };
        let recorded = self.precedent.as_ref().and_then(|precedent| precedent.verdict(self.progress.version));
        if let Some((what, factor)) = self.hindrance(outcomes)? {
            if recorded.is_some_and(|verdict| verdict != Verdict::Reject) {
                return Err(ControlError::NotRecorded { wanted: self.progress.version.next_attempt(), why: what });
            }
            decision.reason = what;
            self.reject(&mut decision, factor, NODE_HINT)?;
            return Ok(decision);
        }
        self.measure(outcomes, &mut decision);
        // Who has read from rows that are no longer those of the window is given another iteration, where there is one.
        let unseen = outcomes.iter().filter_map(|outcome| outcome.result.as_ref().ok()).flat_map(|done| &done.changes);
        let unseen = unseen.into_iter().any(|sums| sums.other_rows);
        let last = self.progress.version.iteration >= self.settings.iterations;
        let converged = decision.violation <= 1.0 && (last || !unseen);
        let broken = !decision.violation.is_finite() && (last || decision.violation.is_nan());
        let own = match (converged, broken || last) {
            (true, _) => Verdict::Accept,
            (false, true) => Verdict::Reject,
            (false, false) => Verdict::Iterate,
        };
        let version = self.progress.version;
        match recorded.unwrap_or(own) {
            Verdict::Accept if converged && self.is_to_repeat() => self.repeat(&mut decision),
            Verdict::Accept if converged => self.accept(&mut decision, window),
            Verdict::Accept => {
                let limiting = decision.errors.iter().find(|error| error.field == decision.limiting);
                let FieldError { error, tolerance, .. } = limiting.cloned().unwrap_or_default();
                let field = &decision.limiting;
                let why =
                    format!("`{field}` has not converged in {version}: error {error:.1e}, tolerance {tolerance:.1e}");
                return Err(ControlError::NotRecorded { wanted: version.next_iteration(), why });
            }
            Verdict::Reject => {
                let (field, worst) = (&decision.limiting, least(outcomes, &decision));
                let far = far(&decision);
                decision.reason = match own {
                    Verdict::Reject if broken => format!("the change of `{field}` is not finite{worst}"),
                    Verdict::Reject => {
                        let rate = rate(decision.contraction);
                        format!("`{field}` did not converge in {} iterations{rate}{worst}{far}", version.iteration)
                    }
                    _ => "it was rejected in the run that is followed".into(),
                };
                let factor = if broken { 0.5 } else { decision.factor };
                let hint = if broken { BROKEN_HINT } else { self.field_hint(&decision) };
                self.reject(&mut decision, factor, hint)?;
            }
            Verdict::Iterate | Verdict::None => {
                decision.verdict = Verdict::Iterate.into();
                if !decision.factor.is_finite() {
                    decision.factor = 0.0;
                }
                self.progress.version = version.next_iteration();
            }
        }
        Ok(decision)
    }

    /// What to do about the limiting field of an iteration that did not converge.
    fn field_hint(&self, decision: &Decision) -> &'static str {
        let field = self.settings.fields.get(&decision.limiting).and_then(|field| field.acceleration);
        match field.unwrap_or(self.settings.acceleration) {
            Acceleration::IqnIls { .. } => FIELD_HINT,
            _ if decision.contraction >= 1.0 => DIVERGES_HINT,
            _ => SLOW_HINT,
        }
    }

    /// What makes a node's reply unusable for this step size, and the factor on it.
    fn hindrance(&self, outcomes: &[Outcome]) -> Result<Option<(String, f64)>, ControlError> {
        let mut hindrance: Option<(String, f64)> = None;
        for Outcome { node, result } in outcomes {
            let (what, factor) = match result {
                Err(failure) if failure.retry => (failure.message.clone(), 0.5),
                Err(failure) => {
                    return Err(ControlError::Node { node: node.clone(), message: failure.message.clone() });
                }
                Ok(done) if !done.converged => {
                    let why = if done.reason.is_empty() { String::new() } else { format!(": {}", done.reason) };
                    (format!("the solver of `{node}` did not converge{why}"), done.step_factor)
                }
                Ok(_) => continue,
            };
            if hindrance.as_ref().is_none_or(|(_, smallest)| factor < *smallest) {
                hindrance = Some((what, factor));
            }
        }
        for Outcome { node, result } in outcomes.iter().filter(|_| hindrance.is_none()) {
            let Ok(done) = result else { continue };
            let untold = |field: &&String| !done.changes.iter().any(|sums| sums.field == **field);
            let mut own = self.fields.keys().filter(|(writer, _)| writer == node).map(|(_, field)| field);
            if let Some(field) = own.find(untold) {
                let message = format!("its reply does not tell how far the measured field `{field}` moved");
                return Err(ControlError::Node { node: node.clone(), message });
            }
        }
        Ok(hindrance)
    }

    /// Errors, violation Z, factor Λ and contraction rate of this iteration.
    fn measure(&mut self, outcomes: &[Outcome], decision: &mut Decision) {
        decision.factor = f64::INFINITY;
        decision.limiting = self.fields.keys().next().map(|(_, field)| field.clone()).unwrap_or_default();
        let answers = outcomes.iter().filter_map(|outcome| Some((&outcome.node, outcome.result.as_ref().ok()?)));
        for (node, sums) in answers.flat_map(|(node, done)| done.changes.iter().map(move |sums| (node, sums))) {
            let key = (node.clone(), sums.field.clone());
            let Some(&Tolerances { measure, relative: tolerance, absolute }) = self.fields.get(&key) else { continue };
            let error = relative(sums, measure);
            let first = *self.progress.first_errors.entry(key).or_insert(error);
            let mean = if sums.rows > 0 { sums.change / sums.rows as f64 } else { 0.0 };
            // Either tolerance suffices: the ratio that is smaller decides.
            let violation = absolute.map_or(error / tolerance, |absolute| (error / tolerance).min(mean / absolute));
            if violation > decision.violation || violation.is_nan() {
                (decision.violation, decision.contraction) = (violation, self.contraction(first, error));
                decision.limiting.clone_from(&sums.field);
            }
            // A field that has converged by its absolute tolerance counts as having just met the relative one; one
            // whose change vanished says nothing about the rate and does not limit the step.
            let error_met = if violation <= 1.0 { error.min(tolerance) } else { error };
            if error_met > 0.0 && first > 0.0 {
                let factor = self.factor(first, error_met, tolerance, order(measure));
                if factor < decision.factor {
                    decision.factor = factor;
                    decision.sensitive.clone_from(&sums.field);
                }
            }
            let field = sums.field.clone();
            let absolute_tolerance = absolute.unwrap_or(0.0);
            decision.errors.push(FieldError { field, error, tolerance, absolute: mean, absolute_tolerance });
        }
        let (rate, sensitive) = &mut self.progress.estimate;
        if decision.contraction > 0.0 {
            *rate = decision.contraction;
        }
        if !decision.sensitive.is_empty() {
            sensitive.clone_from(&decision.sensitive);
        }
        (decision.contraction, decision.sensitive) = (*rate, sensitive.clone());
    }

    /// Mean factor from one error of this attempt to the next, (ε^K/ε⁰)^{1/(K−1)}; 0 where it is not known.
    fn contraction(&self, first: f64, error: f64) -> f64 {
        let intervals = self.progress.version.iteration.saturating_sub(1);
        let known = intervals > 0 && first > 0.0 && first.is_finite() && error.is_finite();
        if known { math::powf(error / first, 1.0 / f64::from(intervals)) } else { 0.0 }
    }

    /// Λ_K = (TOL/ε⁰)^{1/(p K_d)} / (ε^K/ε⁰)^{1/(p K)} (Zohdi 2018, eqs. 6.31, 6.50).
    fn factor(&self, first: f64, error: f64, tolerance: f64, order: f64) -> f64 {
        let wanted = f64::from(self.settings.iterations);
        let done = f64::from(self.progress.version.iteration);
        math::powf(tolerance / first, 1.0 / (order * wanted)) / math::powf(error / first, 1.0 / (order * done))
    }

    fn accept(&mut self, decision: &mut Decision, window: Window) {
        let growth = decision.factor.min(self.settings.dt.growth);
        decision.verdict = Verdict::Accept.into();
        let last = window.t_s + window.dt_s >= self.duration_s;
        self.progress.t_s = if last { self.duration_s } else { window.t_s + window.dt_s };
        // Δt_min bounds a window that struggles, not the growth of one that does not.
        self.progress.dt_s = (growth * window.dt_s).clamp(self.settings.dt.minimum_s, self.settings.dt.limit_s);
        self.progress.committed = self.progress.version;
        self.progress.version = Version::first(self.progress.version.step + 1);
        if let Some(dt_s) = self.recorded_size(self.progress.version) {
            self.progress.dt_s = dt_s;
        }
        self.progress.first_errors.clear();
        self.progress.estimate = (0.0, String::new());
        decision.t_s = self.progress.t_s;
        self.conclude(decision);
    }

    /// Whether this step, which has converged, is one to be rejected for a test.
    fn is_to_repeat(&self) -> bool {
        let Version { step, attempt, .. } = self.progress.version;
        attempt == 1 && self.rejects_every.is_some_and(|steps| step.is_multiple_of(steps))
    }

    /// Rejects without another reason than [`Self::reject_every`]: the window stays as it is.
    fn repeat(&mut self, decision: &mut Decision) {
        decision.verdict = Verdict::Reject.into();
        decision.reason = "it is rejected as a test".into();
        decision.factor = 1.0;
        self.try_again(self.progress.dt_s);
        self.conclude(decision);
    }

    /// Begins the next attempt, with windows of this size.
    fn try_again(&mut self, dt_s: f64) {
        self.progress.dt_s = dt_s;
        self.progress.version = self.progress.version.next_attempt();
        self.progress.first_errors.clear();
        self.progress.estimate = (0.0, String::new());
    }

    fn reject(&mut self, decision: &mut Decision, factor: f64, hint: &'static str) -> Result<(), ControlError> {
        let usable = factor.is_finite() && factor > 0.0 && factor < 1.0;
        let factor = if usable { factor } else { 0.5 };
        let next = self.progress.version.next_attempt();
        let dt_s = self.recorded_size(next).unwrap_or(factor * decision.dt_s);
        if dt_s < self.settings.dt.minimum_s {
            return Err(ControlError::TooSmall {
                t_s: self.progress.t_s,
                minimum_s: self.settings.dt.minimum_s,
                what: decision.reason.clone(),
                hint,
            });
        }
        let rejections = next.attempt.saturating_sub(1);
        if rejections >= self.settings.rejections && self.recorded_size(next).is_none() {
            let (t_s, dt_s, what) = (self.progress.t_s, decision.dt_s, decision.reason.clone());
            return Err(ControlError::TooOften { t_s, rejections, dt_s, what, hint });
        }
        decision.verdict = Verdict::Reject.into();
        decision.factor = factor;
        self.try_again(dt_s);
        self.conclude(decision);
        Ok(())
    }

    fn conclude(&self, decision: &mut Decision) {
        decision.next_dt_s = if self.finished() { 0.0 } else { self.window().dt_s };
        if !decision.factor.is_finite() {
            decision.factor = 0.0;
        }
    }
}

/// How an iteration went by its contraction rate, in words; nothing where it is not known.
fn rate(contraction: f64) -> String {
    if contraction > 0.0 && contraction.is_finite() {
        let course = if contraction < 1.0 { "shrinks" } else { "grows" };
        format!(": its change {course} to {contraction:.3} of itself from one to the next")
    } else {
        String::new()
    }
}

/// Which row of the limiting field converged least, in words.
fn least(outcomes: &[Outcome], decision: &Decision) -> String {
    let mut changes = outcomes.iter().filter_map(|o| o.result.as_ref().ok()).flat_map(|done| &done.changes);
    let sums = changes.find(|sums| sums.field == decision.limiting);
    sums.map(|sums| format!(", row {} the least", sums.worst_row)).unwrap_or_default()
}

/// How far the limiting field is from its tolerance, in words.
fn far(decision: &Decision) -> String {
    let Some(FieldError { error, tolerance, absolute, absolute_tolerance, .. }) =
        decision.errors.iter().find(|error| error.field == decision.limiting)
    else {
        return String::new();
    };
    let mut words = format!(": its change is {error:.1e}, its tolerance {tolerance:.1e}");
    if *absolute_tolerance > 0.0 {
        words += &format!(" (of a row {absolute:.1e}, tolerance {absolute_tolerance:.1e})");
    }
    words
}

#[cfg(test)]
#[path = "step_control_tests.rs"]
mod tests;
