//! Each number of the scenes in `tests/extremes/scenes`, one at a time, at the ends of its range and far inside, and outside of
//! it. What was reached and what came of it is a page: `docs/extremes-keys.md`.
//!
//! `STAGGER_BLESS=1 cargo test --release -p stagger-scene --test extremes` writes it again.

use std::{
    collections::{BTreeMap, BTreeSet},
    fmt::Write as _,
    fs,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{
        Mutex,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
};

use stagger_config::Kind;

use super::{
    keys::{self, Driven},
    run::{Base, scenes},
    verdict::{Outcome, judge},
};

const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/extremes-keys.md");

const INTRODUCTION: &str = "\
# Every number of a scene, driven to its limits

Made by `STAGGER_BLESS=1 cargo test --release -p stagger-scene --test extremes one_at_a_time` from the parser's own keys; the
gate fails where a numeric key is missing here. [extremes.md](extremes.md) says how it is done.

*Scenes* of `tests/extremes/scenes` that give the key; *inside*: values inside its range, the ends among them, of which so many
*ran* to a finite and conserved end, ran *coarse* (finite, but the energy of the motion is off by more than a tenth of what was
turned over, which the run's own summary tells), were *refused* by the check, or *stopped* the run with an error that names the
cause; *outside*: values outside its range, all refused.

| key | scenes | inside | ran | coarse | refused | stopped | outside |
|---|---|---|---|---|---|---|---|
";

/// One value of one number of one scene.
struct Case<'b> {
    base: &'b Base,
    title: String,
    path: String,
    value: String,
    allowed: bool,
}

impl Case<'_> {
    fn judge(&self) -> Result<Outcome, String> {
        let sets = vec![(self.path.clone(), self.value.clone())];
        if self.allowed {
            return judge(self.base, &sets);
        }
        // Outside of its range, the check names the key itself.
        match self.base.parse(&sets) {
            Err(problems) if problems.list.iter().any(|problem| problem.key == self.path) => Ok(Outcome::Refused),
            Err(problems) => Err(format!("refused, but not for itself: {problems}")),
            Ok(_) => Err("accepted outside of its range".into()),
        }
    }
}

/// The cases of all scenes.
fn cases(bases: &[Base]) -> Vec<Case<'_>> {
    let mut cases = Vec::new();
    for base in bases {
        let scene = base.parse(&Vec::new()).unwrap_or_else(|problems| panic!("{problems}"));
        for driven in Driven::of(&scene).into_iter().filter(|driven| !driven.value.is_default) {
            for (allowed, values) in [(true, driven.allowed()), (false, driven.refused())] {
                let (title, path) = (keys::title(driven.section, driven.key), driven.value.path.clone());
                let case = |value| Case { base, title: title.clone(), path: path.clone(), value, allowed };
                cases.extend(values.into_iter().map(case));
            }
        }
    }
    cases
}

/// What came of the values of one key.
#[derive(Default)]
struct Row {
    scenes: BTreeSet<String>,
    ran: usize,
    coarse: usize,
    refused: usize,
    stopped: usize,
    outside: usize,
}

#[test]
fn every_number_ends_well_or_says_why() {
    let bases = scenes("tests/extremes/scenes");
    let cases = cases(&bases);
    let judged = judge_all(&cases);
    let mut rows: BTreeMap<&str, Row> = BTreeMap::new();
    let mut wrong = Vec::new();
    for (number, judged) in judged {
        let case = &cases[number];
        let row = rows.entry(&case.title).or_default();
        row.scenes.insert(case.base.name.clone());
        match judged {
            Ok(_) if !case.allowed => row.outside += 1,
            Ok(Outcome::Ran) => row.ran += 1,
            Ok(Outcome::Coarse) => row.coarse += 1,
            Ok(Outcome::Refused) => row.refused += 1,
            Ok(Outcome::Stopped) => row.stopped += 1,
            Err(what) => wrong.push(format!("{} with {} = {}: {what}", case.base.name, case.path, case.value)),
        }
    }
    assert!(wrong.is_empty(), "{} of {} cases:\n{}", wrong.len(), cases.len(), wrong.join("\n"));
    let coarse: usize = rows.values().map(|row| row.coarse).sum();
    assert!(100 * coarse < cases.len(), "{coarse} of {} are coarse", cases.len());
    if std::env::var_os("STAGGER_BLESS").is_some() {
        fs::write(PAGE, page(&rows)).unwrap();
    }
}

/// Judges cases on two threads of their own: those of a pool would take up another case inside of one.
fn judge_all(cases: &[Case<'_>]) -> BTreeMap<usize, Result<Outcome, String>> {
    let (next, judged) = (AtomicUsize::new(0), Mutex::new(BTreeMap::new()));
    let work = || {
        loop {
            let number = next.fetch_add(1, Ordering::Relaxed);
            let Some(case) = cases.get(number) else { return };
            let outcome = catch_unwind(AssertUnwindSafe(|| case.judge())).unwrap_or_else(|_| Err("panicked".into()));
            judged.lock().unwrap().insert(number, outcome);
        }
    };
    thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(work);
        }
    });
    judged.into_inner().unwrap()
}

fn page(rows: &BTreeMap<&str, Row>) -> String {
    let mut page = INTRODUCTION.to_owned();
    for (title, Row { scenes, ran, coarse, refused, stopped, outside }) in rows {
        let scenes = scenes.iter().cloned().collect::<Vec<_>>().join(", ");
        let inside = ran + coarse + refused + stopped;
        writeln!(page, "| `{title}` | {scenes} | {inside} | {ran} | {coarse} | {refused} | {stopped} | {outside} |")
            .unwrap();
    }
    let sum = |count: fn(&Row) -> usize| rows.values().map(count).sum::<usize>();
    let (ran, coarse, refused) = (sum(|row| row.ran), sum(|row| row.coarse), sum(|row| row.refused));
    let (stopped, outside) = (sum(|row| row.stopped), sum(|row| row.outside));
    let inside = ran + coarse + refused + stopped;
    let sums = [inside, ran, coarse, refused, stopped, outside].map(|sum| format!("**{sum}**")).join(" | ");
    writeln!(page, "| **{} keys** | | {sums} |", rows.len()).unwrap();
    page
}

#[test]
fn every_numeric_key_is_reached_and_on_the_page() {
    let bases = scenes("tests/extremes/scenes");
    let reached: BTreeSet<String> =
        cases(&bases).into_iter().filter(|case| case.allowed).map(|case| case.title).collect();
    let all: BTreeSet<String> = keys::numeric().iter().map(|(section, key)| keys::title(section, key)).collect();
    assert!(all.len() > 150, "{}", all.len());
    assert_eq!(reached, all);
    let page = fs::read_to_string(PAGE).unwrap();
    let on_page: BTreeSet<String> =
        page.lines().filter_map(|line| line.strip_prefix("| `")?.split('`').next().map(str::to_owned)).collect();
    assert_eq!(on_page, all, "docs/extremes-keys.md is stale: run the tests with STAGGER_BLESS=1");
}

#[test]
fn ends_of_ranges_are_among_the_values() {
    let bases = scenes("tests/extremes/scenes");
    for base in &bases {
        let scene = base.parse(&Vec::new()).unwrap_or_else(|problems| panic!("{problems}"));
        for driven in Driven::of(&scene) {
            let (allowed, refused) = (driven.allowed(), driven.refused());
            assert!(allowed.len() >= 3, "{}: {allowed:?}", driven.value.path);
            if let Kind::Number(_, range) = driven.key.kind {
                let has = |end: f64| allowed.iter().any(|value| value.parse() == Ok(end));
                assert!(!range.low_included || has(range.low), "{}: {allowed:?}", driven.value.path);
                assert!(!range.high.is_finite() || has(range.high), "{}: {allowed:?}", driven.value.path);
                assert!(!refused.is_empty(), "{}", driven.value.path);
            }
        }
    }
}
