//! Accept, iterate and reject as Zohdi 2018, section 6.4, states them, on iterations with a known contraction.

use std::collections::BTreeMap;

use stagger_messages::Change;

use super::*;
use crate::StepSize;

fn settings(iterations: u32) -> Settings {
    let dt = StepSize { start_s: 1.0, limit_s: 4.0, minimum_s: 1e-3, growth: 2.0 };
    Settings { iterations, reuse: 0.0, ..Settings::new(dt) }
}

fn control(iterations: u32, measure: Measure) -> StepControl {
    StepControl::new(&settings(iterations), &BTreeMap::from([(("a".into(), "w".into()), measure)]), 100.0)
}

fn outcome(error: f64) -> Vec<Outcome> {
    let sums = Change {
        field: "w".into(),
        change: error,
        increment: 1.0,
        magnitude: 1.0,
        worst_row: 7,
        rows: 8,
        other_rows: false,
    };
    vec![Outcome { node: "a".into(), result: Ok(Done { changes: vec![sums], converged: true, ..Done::default() }) }]
}

#[test]
fn an_iteration_that_meets_the_tolerance_in_exactly_k_d_keeps_its_step() {
    // ε^K = ρ^{K−1} with ρ chosen so that ε at K_d = 5 is the tolerance: Λ = 1 (eq. 6.31 at its fixed point).
    let rate = 1e-6f64.powf(0.25);
    let mut control = control(5, Measure::Magnitude);
    for k in 0..4 {
        let decision = control.judge(&outcome(rate.powi(k))).unwrap();
        assert_eq!(decision.verdict(), Verdict::Iterate, "iteration {}", k + 1);
    }
    let decision = control.judge(&outcome(rate.powi(4) * (1.0 - 1e-12))).unwrap();
    assert_eq!(decision.verdict(), Verdict::Accept);
    // The last error is 1e-12 under the tolerance; the fifth root makes that 2e-13.
    assert!((decision.factor - 1.0).abs() < 1e-12, "{}", decision.factor);
}

#[test]
fn rejection_shrinks_by_lambda_and_motion_by_its_square_root() {
    for (measure, order) in [(Measure::Magnitude, 1.0), (Measure::Increment, 2.0)] {
        let mut control = control(2, measure);
        control.judge(&outcome(1.0)).unwrap();
        let decision = control.judge(&outcome(1e-2)).unwrap();
        assert_eq!(decision.verdict(), Verdict::Reject);
        // Λ = (1e-6/1)^{1/(2p)} / (1e-2)^{1/(2p)} = (1e-4)^{1/(2p)}.
        let expected = 1e-4f64.powf(1.0 / (2.0 * order));
        assert!((decision.next_dt_s / expected - 1.0).abs() < 1e-12);
        assert_eq!(control.version(), Version { step: 1, attempt: 2, iteration: 1 });
        assert!(decision.reason.contains("row 7"), "{}", decision.reason);
    }
}

#[test]
fn growth_is_capped_and_the_limit_holds() {
    let mut control = control(5, Measure::Magnitude);
    assert_eq!(control.judge(&outcome(1e-9)).unwrap().next_dt_s, 2.0);
    assert_eq!(control.judge(&outcome(1e-9)).unwrap().next_dt_s, 4.0);
    assert_eq!(control.judge(&outcome(1e-9)).unwrap().next_dt_s, 4.0);
    // A field that does not move at all does not limit the step either.
    assert_eq!(control.judge(&outcome(0.0)).unwrap().next_dt_s, 4.0);
}

#[test]
fn the_last_window_ends_with_the_run() {
    let mut control =
        StepControl::new(&settings(5), &BTreeMap::from([(("a".into(), "w".into()), Measure::Magnitude)]), 2.5);
    control.judge(&outcome(0.0)).unwrap();
    assert_eq!(control.window(), Window { t_s: 1.0, dt_s: 1.5 });
    assert_eq!(control.judge(&outcome(0.0)).unwrap().t_s, 2.5);
    assert!(control.finished());
}

#[test]
fn what_is_not_finite_halves_the_step_until_the_minimum_names_the_field() {
    let mut control = control(3, Measure::Magnitude);
    let decision = control.judge(&outcome(f64::NAN)).unwrap();
    assert_eq!((decision.verdict(), decision.next_dt_s), (Verdict::Reject, 0.5));
    let error = (0..20).find_map(|_| control.judge(&outcome(f64::NAN)).err()).unwrap();
    assert!(error.to_string().contains("`w`") && error.to_string().contains("coupling.dt.minimum"), "{error}");
}

#[test]
fn a_node_that_did_not_converge_rejects_at_once_with_its_own_factor() {
    let mut control = control(5, Measure::Magnitude);
    let done = Done { converged: false, step_factor: 0.25, ..Done::default() };
    let decision = control.judge(&[Outcome { node: "a".into(), result: Ok(done) }]).unwrap();
    assert_eq!((decision.verdict(), decision.next_dt_s), (Verdict::Reject, 0.25));
}

#[test]
fn a_node_that_did_not_converge_says_why_and_the_end_says_what_to_do() {
    let mut control = control(5, Measure::Magnitude);
    let done = Done { converged: false, step_factor: 0.25, reason: "too stiff".into(), ..Done::default() };
    let outcomes = [Outcome { node: "a".into(), result: Ok(done) }];
    let error = (0..20).find_map(|_| control.judge(&outcomes).err()).unwrap().to_string();
    assert!(error.contains("the solver of `a` did not converge: too stiff. Look at the settings"), "{error}");
}

#[test]
fn a_failure_that_no_step_mends_stops_the_run() {
    let failure = Failure { message: "pair 3 out of range".into(), retry: false };
    let outcomes = [Outcome { node: "thermal".into(), result: Err(failure) }];
    let error = control(5, Measure::Magnitude).judge(&outcomes).unwrap_err();
    assert_eq!(error.to_string(), "node `thermal` failed: pair 3 out of range");
}

#[test]
fn a_window_waits_for_those_who_have_not_seen_its_rows_but_not_past_its_last_iteration() {
    let mut control = control(5, Measure::Magnitude);
    let answer = |other_rows| {
        let mut outcome = outcome(0.0);
        outcome[0].result.as_mut().unwrap().changes[0].other_rows = other_rows;
        outcome
    };
    assert_eq!(control.judge(&answer(true)).unwrap().verdict(), Verdict::Iterate);
    assert_eq!(control.judge(&answer(false)).unwrap().verdict(), Verdict::Accept);
    let verdicts = [0; 5].map(|_| control.judge(&answer(true)).unwrap().verdict());
    let waits = Verdict::Iterate;
    assert_eq!(verdicts, [waits, waits, waits, waits, Verdict::Accept]);
}

/// Two steps: the second took an attempt that was given up in its second iteration.
fn followed() -> Arc<RecordedSchedule> {
    let mut schedule = RecordedSchedule::default();
    let at = |step, attempt, iteration| Some(Version { step, attempt, iteration });
    for (version, verdict, dt_s) in [
        (at(1, 1, 3), Verdict::Accept, 0.7),
        (at(2, 1, 1), Verdict::Iterate, 3.0),
        (at(2, 1, 2), Verdict::Reject, 3.0),
        (at(2, 2, 1), Verdict::Accept, 1.1),
    ] {
        schedule.take(&Decision { version, verdict: verdict.into(), dt_s, ..Decision::default() });
    }
    Arc::new(schedule)
}

#[test]
fn the_windows_iterations_and_rejections_of_an_earlier_run_are_followed() {
    let mut control = control(5, Measure::Magnitude);
    control.follow(followed());
    let mut versions = Vec::new();
    // It converges at once and would go on with larger steps, but the others can only give what they gave.
    for _ in 0..6 {
        let (version, dt_s) = (control.version(), control.window().dt_s);
        versions.push((version.step, version.attempt, version.iteration, dt_s));
        control.judge(&outcome(0.0)).unwrap();
    }
    assert_eq!(
        versions,
        [(1, 1, 1, 0.7), (1, 1, 2, 0.7), (1, 1, 3, 0.7), (2, 1, 1, 3.0), (2, 1, 2, 3.0), (2, 2, 1, 1.1)]
    );
    assert_eq!(control.window().t_s, 0.7 + 1.1);
}

#[test]
fn what_an_earlier_run_did_not_ask_for_is_told_with_the_field_and_the_trial() {
    let mut slow = control(5, Measure::Magnitude);
    slow.follow(followed());
    for _ in 0..2 {
        slow.judge(&outcome(0.5)).unwrap();
    }
    let error = slow.judge(&outcome(1e-3)).unwrap_err().to_string();
    assert!(
        error.starts_with("step 1, attempt 1, iteration 4 is needed, but was never recorded: `w` has not"),
        "{error}"
    );
    assert!(error.contains("error 1.0e-3, tolerance 1.0e-6"), "{error}");

    let mut failing = control(5, Measure::Magnitude);
    failing.follow(followed());
    let failure = Failure { message: "`w` is NaN".into(), retry: true };
    let error = failing.judge(&[Outcome { node: "a".into(), result: Err(failure) }]).unwrap_err().to_string();
    assert!(
        error.starts_with("step 1, attempt 2, iteration 1 is needed, but was never recorded: `w` is NaN"),
        "{error}"
    );
}

#[test]
fn a_step_that_is_only_rejected_ends_the_run_and_says_how_far_it_was() {
    let dt = StepSize { start_s: 1.0, limit_s: 4.0, minimum_s: 1e-300, growth: 2.0 };
    let settings = Settings { iterations: 2, rejections: 3, ..Settings::new(dt) };
    let measured = BTreeMap::from([(("a".into(), "w".into()), Measure::Magnitude)]);
    let mut control = StepControl::new(&settings, &measured, 100.0);
    let mut reject = || {
        control.judge(&outcome(1.0)).unwrap();
        control.judge(&outcome(0.5))
    };
    for _ in 0..2 {
        assert_eq!(reject().unwrap().verdict(), Verdict::Reject);
    }
    let error = reject().unwrap_err();
    assert!(matches!(error, ControlError::TooOften { rejections: 3, .. }), "{error}");
    let said = error.to_string();
    for word in
        ["rejected 3 times", "`w` did not converge in 2 iterations", "row 7", "5.0e-1", "1.0e-6", "0.500 of itself"]
    {
        assert!(said.contains(word), "{word}: {said}");
    }
    // A step that gets through in between begins the count anew, and a node's own wish counts too.
    let mut control = StepControl::new(&settings, &measured, 100.0);
    let done = Done { converged: false, step_factor: 0.25, reason: "too stiff".into(), ..Done::default() };
    let wish = vec![Outcome { node: "a".into(), result: Ok(done) }];
    for _ in 0..4 {
        control.judge(&wish).unwrap();
        control.judge(&wish).unwrap();
        assert_eq!(control.judge(&outcome(0.0)).unwrap().verdict(), Verdict::Accept);
    }
    control.judge(&wish).unwrap();
    control.judge(&wish).unwrap();
    assert!(control.judge(&wish).unwrap_err().to_string().contains("too stiff"));
}
