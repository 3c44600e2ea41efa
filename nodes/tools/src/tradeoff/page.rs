//! The page: error against time with the front, the recommended setting, every axis, and the whole table.

use super::{
    Case, Study,
    table::{share, time, typed},
};
use crate::report::{
    html::{self, plots, section, table},
    plot::{Axis, Chart, Level, Mark, Series, count, escape, number},
};

/// Error at which a run stands that has none: zero has no logarithm.
const LEAST: f64 = 1e-7;

/// The whole page.
#[must_use]
pub fn page(study: &Study) -> String {
    let title = format!("Speed against accuracy: {}", study.title);
    let sections = [
        head(study, &title),
        section("Error against time", &overview(study)),
        section("Each setting by itself", &axes(study)),
        section("Each quantity", &quantities(study)),
        section("All runs", &runs(study)),
        format!("<footer><p>Written by stagger {}.</p></footer>\n", env!("CARGO_PKG_VERSION")),
    ];
    html::document(&title, &sections.concat())
}

fn head(study: &Study, title: &str) -> String {
    let standing = &study.cases[0];
    let mut text = format!("<header>\n<h1>{}</h1>\n", escape(title));
    if !study.overrides.is_empty() {
        text += &format!("<p>All runs with <code>{}</code></p>\n", escape(&typed(&study.overrides)));
    }
    text += "<p>Each run changes the settings named and is compared with a reference whose steps, tolerances and sampling are \
             far tighter. Errors are shares of how far a quantity came from its start to the end of the reference run; what is \
             shown for a run is the largest of them.</p>\n</header>\n";
    match study.recommended.map(|index| &study.cases[index]) {
        Some(case) => {
            let faster = standing.outcome.wall() / case.outcome.wall();
            text += &format!(
                "<p class=\"notice\">Recommended within an error of {}: <strong>{}</strong>, {} times as fast as the scene as it \
                 stands, error {}. {}</p>\n",
                share(study.bound),
                escape(&case.label),
                number(faster),
                share(case.error()),
                if case.outcome.set.is_empty() {
                    String::new()
                } else {
                    format!("<br/><code>{}</code>", escape(&typed(&case.outcome.set)))
                }
            );
        }
        None => text += &format!("<p class=\"notice\">No run is within an error of {}.</p>\n", share(study.bound)),
    }
    text
}

fn at(case: &Case, error: f64) -> [f64; 2] {
    [case.outcome.wall(), error.max(LEAST)]
}

/// Cases with a result that are no reference.
fn shown(study: &Study) -> impl Iterator<Item = &Case> {
    study
        .cases
        .iter()
        .filter(|case| case.axis != "reference" && case.outcome.failed.is_none() && !case.errors.is_empty())
}

/// Those of them in which one setting is changed.
fn single(study: &Study) -> impl Iterator<Item = &Case> {
    shown(study).filter(|case| !matches!(case.axis.as_str(), "" | "preset" | "combined"))
}

fn levels(study: &Study) -> Vec<Level> {
    let known = study.known_to.iter().map(|error| error.unwrap_or(0.0)).fold(0.0, f64::max);
    let known = (known > LEAST).then(|| Level { name: "the reference is known to this".into(), value: known });
    [Level { name: "asked for".into(), value: study.bound }].into_iter().chain(known).collect()
}

fn overview(study: &Study) -> String {
    let mut all: Vec<[f64; 2]> = single(study).map(|case| at(case, case.error())).collect();
    all.retain(|point| point.iter().all(|value| value.is_finite()));
    let of = |axis: &str| shown(study).filter(|case| case.axis == axis).map(|case| at(case, case.error())).collect();
    let front = study.front.iter().map(|index| &study.cases[*index]).map(|case| at(case, case.error())).collect();
    let mut series = vec![
        Series::line("Pareto front", front),
        Series::line("one setting changed", all).drawn(Mark::Dots),
        Series::line("as it stands", vec![at(&study.cases[0], study.cases[0].error())]).drawn(Mark::Crosses),
        Series::line("presets", of("preset")).drawn(Mark::Dots),
        Series::line("combined", of("combined")).drawn(Mark::Dots),
    ];
    if let Some(case) = study.recommended.map(|index| &study.cases[index]) {
        series.push(Series::line("recommended", vec![at(case, case.error())]).drawn(Mark::Crosses));
    }
    series.retain(|series| !series.points.is_empty());
    let chart = Chart {
        title: "Largest error against wall time".into(),
        x: Axis::log("wall time", "s"),
        y: Axis::log("error", "1"),
        series,
        levels: levels(study),
    };
    let rows: Vec<Vec<String>> = study.front.iter().map(|index| cells(study, &study.cases[*index])).collect();
    format!(
        "{}<p>No other run is both faster and at least as exact as one of the Pareto front:</p>\n{}",
        plots(&[chart.figure()]),
        table(&HEAD, 1, &rows)
    )
}

fn axes(study: &Study) -> String {
    let mut names: Vec<&str> = Vec::new();
    for case in single(study) {
        if !names.contains(&case.axis.as_str()) {
            names.push(&case.axis);
        }
    }
    let standing = &study.cases[0];
    let figures: Vec<String> = names
        .into_iter()
        .map(|name| {
            let mut series =
                vec![Series::line("as it stands", vec![at(standing, standing.error())]).drawn(Mark::Crosses)];
            for case in shown(study).filter(|case| case.axis == name) {
                series.push(Series::line(&case.label, vec![at(case, case.error())]).drawn(Mark::Dots));
            }
            Chart {
                title: name.into(),
                x: Axis::log("wall time", "s"),
                y: Axis::log("error", "1"),
                series,
                levels: levels(study),
            }
            .figure()
        })
        .collect();
    plots(&figures)
}

fn quantities(study: &Study) -> String {
    let figures: Vec<String> = study
        .quantities
        .iter()
        .enumerate()
        .map(|(place, quantity)| {
            let points = shown(study).filter_map(|case| Some(at(case, case.errors.get(place).copied()??)));
            let standing = study.cases[0].errors.get(place).copied().flatten();
            let standing = standing.map(|error| at(&study.cases[0], error));
            let mut series = vec![Series::line("all runs", points.collect()).drawn(Mark::Dots)];
            series.push(Series::line("as it stands", standing.into_iter().collect()).drawn(Mark::Crosses));
            Chart {
                title: quantity.replace('_', " "),
                x: Axis::log("wall time", "s"),
                y: Axis::log("error", "1"),
                series,
                levels: vec![Level { name: "asked for".into(), value: study.bound }],
            }
            .figure()
        })
        .collect();
    plots(&figures)
}

const HEAD: [&str; 7] = ["run", "wall time", "faster", "processor time", "exchanges", "iterations", "error"];

fn cells(study: &Study, case: &Case) -> Vec<String> {
    let outcome = &case.outcome;
    vec![
        escape(&case.label),
        time(outcome.wall()),
        format!("{:.2}×", study.cases[0].outcome.wall() / outcome.wall()),
        time(outcome.cpu()),
        count(outcome.exchanges),
        count(outcome.iterations),
        share(case.error()),
    ]
}

fn runs(study: &Study) -> String {
    let quantities: Vec<String> = study.quantities.iter().map(|quantity| quantity.replace('_', " ")).collect();
    let head: Vec<&str> = HEAD.into_iter().chain(quantities.iter().map(String::as_str)).collect();
    let rows: Vec<Vec<String>> = study
        .cases
        .iter()
        .filter(|case| case.outcome.failed.is_none())
        .map(|case| {
            let errors = case.errors.iter().map(|error| share(error.unwrap_or(f64::INFINITY)));
            cells(study, case).into_iter().chain(errors).collect()
        })
        .collect();
    let mut text = table(&head, 1, &rows);
    let failed: Vec<Vec<String>> = study
        .cases
        .iter()
        .filter_map(|case| Some(vec![escape(&case.label), escape(case.outcome.failed.as_deref()?)]))
        .collect();
    if !failed.is_empty() {
        text += &table(&["not possible", "why"], 2, &failed);
    }
    text
}
