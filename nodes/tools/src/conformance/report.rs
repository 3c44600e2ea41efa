//! The verdicts, for people and for programs.

use serde::Serialize;
use stagger_runtime::launch::roster::Runs;

use super::{Bench, Kept, heard::Fault};

/// Version of the JSON form.
const FORMAT: u32 = 1;

/// What was found about one rule.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(tag = "verdict", rename_all = "kebab-case")]
pub enum Ruling {
    /// The node keeps it.
    Pass,
    /// The node breaks it.
    Fail {
        /// What was expected.
        expected: String,
        /// What was found instead.
        found: String,
    },
    /// It could not be checked, or says nothing about this node.
    NotApplicable {
        /// Why.
        because: String,
    },
}

impl From<Result<Kept, Fault>> for Ruling {
    fn from(kept: Result<Kept, Fault>) -> Self {
        match kept {
            Ok(Kept::Yes) => Self::Pass,
            Ok(Kept::NotApplicable(because)) => Self::NotApplicable { because: because.into() },
            Err(Fault { expected, found }) => Self::Fail { expected, found },
        }
    }
}

/// A rule and what was found about it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// Name of the rule.
    pub rule: &'static str,
    /// What a node does that keeps it.
    pub sentence: &'static str,
    /// The verdict.
    #[serde(flatten)]
    pub ruling: Ruling,
}

/// The verdicts about one node.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Findings {
    /// Version of this form.
    pub format: u32,
    /// The node.
    pub node: String,
    /// What runs it.
    pub command: String,
    /// Title of the scene.
    pub scene: String,
    /// Rule by rule, in the order they were checked.
    pub rules: Vec<Finding>,
}

impl Findings {
    pub(super) fn new(bench: &Bench) -> Self {
        let command = match &bench.runs {
            Runs::Physics(kind) => format!("stagger node {kind}"),
            Runs::Command(words) => words.join(" "),
            Runs::Recorded(file) => file.display().to_string(),
        };
        Self { format: FORMAT, node: bench.node.clone(), command, scene: bench.scene.title.clone(), rules: Vec::new() }
    }

    /// Whether a rule that was checked is not broken.
    pub(super) fn holds(&self, rule: &str) -> bool {
        self.rules.iter().any(|finding| finding.rule == rule && finding.ruling == Ruling::Pass)
    }

    /// Number of rules broken.
    #[must_use]
    pub fn broken(&self) -> usize {
        self.rules.iter().filter(|finding| matches!(finding.ruling, Ruling::Fail { .. })).count()
    }

    /// The sum of it in one line.
    #[must_use]
    pub fn total(&self) -> String {
        let passed = self.rules.iter().filter(|finding| finding.ruling == Ruling::Pass).count();
        let broken = self.broken();
        format!(
            "node `{}` ({}): {passed} rules kept, {broken} broken, {} not applicable",
            self.node,
            self.command,
            self.rules.len() - passed - broken
        )
    }
}

impl std::fmt::Display for Finding {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { rule, sentence, ruling } = self;
        match ruling {
            Ruling::Pass => write!(f, "pass  {rule:<14} {sentence}"),
            Ruling::Fail { expected, found } => {
                write!(f, "FAIL  {rule:<14} {sentence}\n        expected {expected}\n        found    {found}")
            }
            Ruling::NotApplicable { because } => write!(f, "n/a   {rule:<14} {sentence}\n        {because}"),
        }
    }
}
