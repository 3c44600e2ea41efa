//! What a physics contributes to `stagger tradeoff`: the settings that trade speed for accuracy, and how errors are measured.

use std::fmt;

use stagger_config::Value;

use super::Tables;

/// Overrides `--set key=value`.
pub type Set = Vec<(String, String)>;

/// What a physics contributes to trade-offs.
pub struct Tradeoff {
    /// Its axes, in the order in which they are tried.
    pub axes: &'static [Axis],
    /// Whether it takes steps of its own within a step, whose length its figure `substep [s]` tells.
    pub has_substeps: fn(&Setup<'_>) -> bool,
    /// Settings so many times tighter than the scene's, as far as the step within the step and sampling go: those of the
    /// reference that errors are measured against.
    pub tighter: fn(&Setup<'_>, f64) -> Set,
    /// Settings of one run of a series whose order of accuracy is measured, with steps within the step so many times as long;
    /// what is iterated is iterated far below the differences.
    pub in_series: fn(&Setup<'_>, f64) -> Set,
    /// Why a method is of first order only, in words that follow on a colon; `None` where all are of second order.
    pub first_order: fn(&Setup<'_>) -> Option<&'static str>,
    /// Fields that it advances in time, whose order of accuracy is measured.
    pub advances: &'static [&'static str],
    /// What errors are measured by where nobody says so, in the words of `[tradeoff]`.
    pub usual: &'static [&'static str],
    /// Short words for quantities, with what they stand for.
    pub words: &'static [(&'static str, &'static str)],
}

impl Tradeoff {
    /// Nothing of all that.
    pub const NONE: Self = Self {
        axes: &[],
        has_substeps: |_| false,
        tighter: |_, _| Set::new(),
        in_series: |_, _| Set::new(),
        first_order: |_| None,
        advances: &[],
        usual: &[],
        words: &[],
    };
}

impl fmt::Debug for Tradeoff {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let axes: Vec<&str> = self.axes.iter().map(|axis| axis.name).collect();
        f.debug_struct("Tradeoff").field("axes", &axes).finish_non_exhaustive()
    }
}

/// A setting that trades speed for accuracy.
pub struct Axis {
    /// Its name on the command line.
    pub name: &'static str,
    /// Values around what the scene has; none where it means nothing for the scene.
    pub points: fn(&Setup<'_>) -> Vec<Point>,
}

/// A value of an axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// What it is called in tables.
    pub label: String,
    /// What it sets.
    pub set: Set,
}

impl Point {
    /// A value that sets one key.
    #[must_use]
    pub fn of(label: String, key: &str, value: impl ToString) -> Self {
        Self { label, set: vec![set(key, value)] }
    }
}

/// A scene as its trade-offs see it.
pub struct Setup<'s> {
    /// Every value in effect.
    pub values: &'s [Value],
    /// Settings of each physics.
    pub tables: Tables<'s>,
    /// The step within the step that the scene took when it ran as it stands, in s, where it did and has one.
    pub substep_s: Option<f64>,
}

impl Setup<'_> {
    /// Values of a key that takes words, but for those that the scene has already.
    #[must_use]
    pub fn words(&self, key: &str, words: &[&str]) -> Vec<Point> {
        let name = key.rsplit('.').next().unwrap_or(key);
        let points = words.iter().map(|word| Point::of(format!("{name} {word}"), key, format!("\"{word}\"")));
        points.filter(|point| !self.has(&point.set)).collect()
    }

    /// Values of a key that takes numbers, but for those that the scene has already.
    #[must_use]
    pub fn numbers(&self, key: &str, name: &str, values: &[f64]) -> Vec<Point> {
        let points = values.iter().map(|value| Point::of(format!("{name} {value}"), key, value));
        points.filter(|point| !self.has(&point.set)).collect()
    }

    /// Whether the scene has these values already.
    fn has(&self, set: &Set) -> bool {
        set.iter().all(|(key, value)| {
            let bare = value.trim_matches('"');
            self.values.iter().any(|own| {
                let of_key = own.path == *key
                    || own.path.strip_prefix(key.as_str()).is_some_and(|rest| matches!(rest, ".method" | ".kind"));
                of_key
                    && (own.value == bare
                        || (!own.si.is_empty() && bare.parse().is_ok_and(|number: f64| own.si == [number])))
            })
        })
    }
}

/// Values that are so many times what the scene has, but for those that set nothing.
pub fn scaled(factors: &[f64], name: &str, set: impl Fn(f64) -> Set) -> Vec<Point> {
    let points = factors.iter().map(|&factor| Point { label: format!("{name} {}", times(factor)), set: set(factor) });
    points.filter(|point| !point.set.is_empty()).collect()
}

/// An override.
pub fn set(key: &str, value: impl ToString) -> (String, String) {
    (key.into(), value.to_string())
}

/// A number without the last digits, where scaling has left rounding.
#[must_use]
pub fn plain(value: f64) -> String {
    let rounded: f64 = format!("{value:.11e}").parse().unwrap_or(value);
    format!("{rounded:e}")
}

/// A factor in a label.
#[must_use]
pub fn times(factor: f64) -> String {
    if factor >= 1.0 { format!("x {factor}") } else { format!("/ {}", (1.0 / factor).round()) }
}

/// Whether a weight φ of a window's end makes a method of first order.
#[must_use]
pub fn is_first_order(phi: f64) -> bool {
    (phi - 0.5).abs() > 1e-12
}
