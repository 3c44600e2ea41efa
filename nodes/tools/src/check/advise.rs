//! `stagger check --advise`: which physics a scene could do without, which it lacks, which fidelity suffices.

use stagger_runtime::launch::words::quote;
use std::fmt::Write as _;

use stagger_coupling::SolveError;
use stagger_scene::{
    Scene,
    advice::{self, Advice, Edit, Effect, Verdict},
};

/// Advice on a scene as text: what asks for a change first.
///
/// # Errors
/// The particles of the scene cannot be placed.
pub fn describe(scene: &Scene, within: f64) -> Result<String, SolveError> {
    let advice = advice::advise(scene, within)?;
    let mut text = format!("{}\n", scene.title);
    if advice.is_empty() {
        text.push_str("\nThe scene has no particles: there is nothing to advise on.\n");
        return Ok(text);
    }
    let (changes, rest): (Vec<_>, Vec<_>) = advice.iter().partition(|own| !own.edits.is_empty());
    // Writing to a string cannot fail.
    let _ = writeln!(text, "\nwhat to change, where a change of {} counts as none", percent(within));
    if changes.is_empty() {
        text.push_str("  nothing\n");
    }
    changes.iter().for_each(|own| write(&mut text, own));
    text.push_str("\nwhat is right as it is, or cannot be changed\n");
    rest.iter().for_each(|own| write(&mut text, own));
    Ok(text)
}

fn write(text: &mut String, advice: &Advice) {
    let Advice { about, number, value, unit, meaning, verdict, says, effects, edits } = advice;
    let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
    let _ = writeln!(text, "  {:<8} {about}: {number} {}{unit}", word(*verdict), significant(*value));
    let _ = writeln!(text, "           {meaning}");
    let _ = writeln!(text, "           {says}");
    if !effects.is_empty() {
        let (what, how) = match verdict {
            Verdict::Keep => ("without it", "at most"),
            Verdict::Suffices if edits.is_empty() => ("error:", "less than"),
            _ => ("changes", "less than"),
        };
        let bounds: Vec<String> = effects.iter().map(|effect| bound(effect, how)).collect();
        let _ = writeln!(text, "           {what} {}", bounds.join(", and "));
    }
    for edit in edits {
        let _ = match edit {
            Edit::Set { key, value } => writeln!(text, "           --set {key}={}", quote(value)),
            Edit::Delete { key } if key.starts_with("coupling.") => {
                writeln!(text, "           take `{key}` out of the scene, too")
            }
            Edit::Delete { key } => writeln!(text, "           take [{key}] out of the scene"),
        };
    }
}

fn bound(effect: &Effect, how: &str) -> String {
    let Effect { quantity, at_most, share } = effect;
    let (name, share) = (quantity.name(), percent(*share));
    if at_most.is_finite() {
        format!("the {name} by {how} {} {} ({share})", significant(*at_most), quantity.unit())
    } else {
        format!("the {name} by {how} {share}")
    }
}

fn word(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Drop => "drop",
        Verdict::Keep => "keep",
        Verdict::Add => "add",
        Verdict::Suffices => "suffices",
        Verdict::Refine => "refine",
        Verdict::Beyond => "beyond",
    }
}

fn percent(share: f64) -> String {
    format!("{} %", significant(100.0 * share))
}

/// Three digits.
fn significant(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 || (1e-3..1e4).contains(&size) {
        let decimals = if size >= 100.0 || value == 0.0 {
            0
        } else if size >= 10.0 {
            1
        } else if size >= 1.0 {
            2
        } else {
            4
        };
        format!("{value:.decimals$}")
    } else if size.is_finite() {
        format!("{value:.1e}")
    } else {
        "unbounded".into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_values_are_safe_in_a_shell() {
        for (value, shown) in [(0.0, "0"), (0.01234, "0.0123"), (2.7555, "2.76"), (27.555, "27.6"), (275.55, "276")] {
            assert_eq!(significant(value), shown);
        }
        assert_eq!((significant(1.5e-7), significant(f64::INFINITY)), ("1.5e-7".into(), "unbounded".into()));
        assert_eq!((quote("none"), quote("{ emissivity = 0.3 }")), ("none".into(), "'{ emissivity = 0.3 }'".into()));
    }
}
