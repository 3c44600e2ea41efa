//! The course of an earlier run, which a run with recorded nodes follows.

use std::collections::BTreeMap;

use stagger_messages::{Decision, Verdict, Version};

/// The course of an earlier run, which a run follows in which recorded nodes take part: they can answer only what they
/// were asked then. It holds some 40 bytes for each attempt.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Precedent {
    attempts: BTreeMap<(u64, u32), Attempt>,
}

/// One attempt at a step, with how it ended.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Attempt {
    dt_s: f64,
    iterations: u32,
    accepted: bool,
}

impl Precedent {
    /// Takes a decision of that run; one that is repeated counts once.
    pub fn take(&mut self, decision: &Decision) {
        let accepted = match decision.verdict() {
            Verdict::Accept => true,
            Verdict::Reject => false,
            Verdict::Iterate | Verdict::None => return,
        };
        let Some(Version { step, attempt, iteration }) = decision.version else { return };
        self.attempts.insert((step, attempt), Attempt { dt_s: decision.dt_s, iterations: iteration, accepted });
    }

    /// Length of the window of that attempt, in s; `None` where it never came to its end.
    #[must_use]
    pub fn dt_s(&self, version: Version) -> Option<f64> {
        self.attempt(version).map(|attempt| attempt.dt_s)
    }

    /// What was decided about that iteration; `None` where nothing was.
    #[must_use]
    pub fn verdict(&self, version: Version) -> Option<Verdict> {
        let Attempt { iterations, accepted, .. } = *self.attempt(version)?;
        match version.iteration.cmp(&iterations) {
            std::cmp::Ordering::Less => Some(Verdict::Iterate),
            std::cmp::Ordering::Equal => Some(if accepted { Verdict::Accept } else { Verdict::Reject }),
            std::cmp::Ordering::Greater => None,
        }
    }

    fn attempt(&self, version: Version) -> Option<&Attempt> {
        self.attempts.get(&(version.step, version.attempt))
    }
}
