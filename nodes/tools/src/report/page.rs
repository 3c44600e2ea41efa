//! The page: sections of facts, plots and tables. It is HTML that is well-formed XML too, and asks for nothing beside itself.

use super::{
    convergence, energy, fields,
    gathered::{Gathered, Global, NodeWork},
    html::{data, date, document, fact, plots, section, table},
    pictures,
    plot::{Axis, Bar, Bars, Chart, Series, Thinned, count, escape, number, quantity},
};

/// Series in one plot at most: more cannot be told apart.
pub const SERIES: usize = 14;
/// Fields without a place that are plotted at most.
const GLOBALS: usize = 24;
/// Length of the scene's text that is shown, in bytes.
const SCENE: usize = 100_000;

/// The whole page.
pub fn page(gathered: &Gathered, title: &str) -> String {
    let sections = [
        head(gathered, title),
        pictures::pictures(&gathered.pictures),
        section("Steps", &convergence::steps(gathered)),
        section("Convergence", &convergence::errors(gathered)),
        section("Nodes", &nodes(gathered)),
        section("Energy", &energy::energy(gathered)),
        section("Over time", &globals(gathered)),
        section("Fields", &fields::fields(gathered)),
        section("Scene", &scene(gathered)),
        foot(gathered),
    ];
    document(title, &sections.concat())
}

fn head(gathered: &Gathered, title: &str) -> String {
    let info = &gathered.info;
    let outcome = match &gathered.end {
        Some((true, _)) => "completed".to_owned(),
        Some((false, reason)) => format!("stopped: {reason}"),
        None if gathered.being_written => "it goes on".to_owned(),
        None => "not closed: the recording ends before its run did".to_owned(),
    };
    let mut text = format!(
        "<header>\n<h1>{}</h1>\n<p class=\"faint\">Run {}, {}</p>\n",
        escape(title),
        escape(&info.run),
        escape(&outcome)
    );
    if gathered.being_written && gathered.problem_count == 0 {
        text += "<p class=\"notice\">The recording is still being written. This page shows what there was.</p>\n";
    } else if !gathered.complete {
        text += "<p class=\"notice\">The recording is cut off or damaged. This page shows what could be read.</p>\n";
    }
    for problem in &gathered.problems {
        text += &format!("<p class=\"notice\">{}</p>\n", escape(problem));
    }
    let untold = gathered.problem_count - gathered.problems.len() as u64;
    if untold > 0 {
        text += &format!("<p class=\"notice\">{} more such problems.</p>\n", count(untold));
    }
    text += "</header>\n<dl class=\"facts\">\n";
    let counted = |key: &str, value: u64| data(key, value, &count(value));
    let seconds = |key: &str, value: f64| data(key, value, &quantity(value, "s"));
    let (accepted, rejected) =
        (counted("steps_accepted", gathered.accepted), counted("steps_rejected", gathered.rejected));
    text += &fact("simulated", &seconds("simulated_time_s", gathered.t_s));
    text += &fact("steps", &format!("{accepted} accepted, {rejected} rejected"));
    let each = gathered.iterations as f64 / gathered.accepted.max(1) as f64;
    text += &fact("iterations", &format!("{}, {} per step", counted("iterations", gathered.iterations), number(each)));
    if let Some([low, high]) = gathered.dt_s {
        text += &fact("Δt", &format!("{} to {}", seconds("dt.min_s", low), seconds("dt.max_s", high)));
    }
    text += &fact("checkpoints", &counted("checkpoints", gathered.checkpoints));
    let bytes = gathered.topics.values().map(|[_, bytes]| *bytes as f64).sum::<f64>();
    text += &fact(
        "messages",
        &format!("{}, {}", count(gathered.topics.values().map(|[count, _]| count).sum()), quantity(bytes, "B")),
    );
    text += &fact("scene file", &escape(&info.scene_file));
    text += &fact("seed", &escape(&info.seed.to_string()));
    text += &fact("started", &date(info.started_unix_ns));
    text += &fact("program", &escape(&info.program));
    for (name, value) in &info.machine {
        text += &fact(name, &escape(value));
    }
    text + "</dl>\n"
}

fn nodes(gathered: &Gathered) -> String {
    if gathered.nodes.is_empty() {
        return String::new();
    }
    let row = |(name, work): (&String, &NodeWork)| {
        let key = |what: &str| format!("nodes.{name}.{what}");
        let counted = |what: &str, value: u64| data(&key(what), value, &count(value));
        let seconds = |what: &str, value: f64| data(&key(what), value, &quantity(value, "s"));
        vec![
            escape(name),
            counted("solves", work.solves),
            counted("reused", work.reused),
            counted("failures", work.failures),
            seconds("solve_s", work.solve_s),
            seconds("wait_s", work.wait_s),
        ]
    };
    let rows: Vec<_> = gathered.nodes.iter().map(row).collect();
    let mut text = table(&["node", "solved", "reused", "failed", "time in solve", "time waiting"], 1, &rows);
    let bars = Bars {
        title: "Time of each node".into(),
        axis: Axis::linear("time", "s"),
        parts: vec!["solve".into(), "waiting for frozen fields".into()],
        bars: gathered
            .nodes
            .iter()
            .map(|(name, work)| Bar { name: name.clone(), values: vec![work.solve_s, work.wait_s] })
            .collect(),
    };
    let series = gathered.curves.solve_s.iter().take(SERIES);
    let each_step = Chart {
        title: "Time in solve, per accepted step".into(),
        x: time(gathered),
        y: Axis::linear("time in solve", "s").with(&[0.0]),
        series: series.map(|(node, curve)| Series::line(node, curve.points())).collect(),
        levels: Vec::new(),
    };
    text += &plots(&[bars.figure(), each_step.figure()]);
    let figures: Vec<_> = gathered
        .nodes
        .iter()
        .flat_map(|(node, work)| {
            work.figures.iter().map(move |(name, value)| vec![escape(node), escape(name), number(*value)])
        })
        .collect();
    if !figures.is_empty() {
        text += &table(&["node", "in its last accepted window", "value"], 2, &figures);
    }
    text
}

/// Fields without a place as curves.
fn globals(gathered: &Gathered) -> String {
    let chart = |(name, global): (&String, &Global)| {
        let series = |(number, curve): (usize, &Thinned)| {
            let (row, component) = (number / global.components.max(1), number % global.components.max(1));
            let row = if global.curves.len() > global.components { row.to_string() } else { String::new() };
            let component = match global.components {
                0 | 1 => String::new(),
                3 => ["x", "y", "z"][component].to_owned(),
                _ => format!("component {component}"),
            };
            Series::line(format!("{row} {component}").trim(), curve.points())
        };
        let label = name.replace('_', " ");
        let y = Axis::linear(&label, &global.unit);
        let series = global.curves.iter().enumerate().map(series).collect();
        Chart { title: label, x: time(gathered), y, series, levels: Vec::new() }.figure()
    };
    let figures: Vec<_> = gathered.curves.globals.iter().take(GLOBALS).map(chart).collect();
    let more = gathered.curves.globals.len().saturating_sub(GLOBALS);
    let left_out = if more > 0 { format!("<p class=\"faint\">And {more} more fields.</p>\n") } else { String::new() };
    plots(&figures) + &left_out
}

/// The axis of simulated time, the same for all plots.
pub fn time(gathered: &Gathered) -> Axis {
    Axis::linear("simulated time", "s").with(&[gathered.start_s, gathered.t_s])
}

fn scene(gathered: &Gathered) -> String {
    let info = &gathered.info;
    let mut end = info.scene_text.len().min(SCENE);
    while !info.scene_text.is_char_boundary(end) {
        end -= 1;
    }
    let mut text = String::new();
    if !info.overrides.is_empty() {
        let keys = info.overrides.iter().map(|(key, value)| format!("<code>{}={}</code>", escape(key), escape(value)));
        text += &format!("<p>Set on the command line: {}</p>\n", keys.collect::<Vec<_>>().join(", "));
    }
    for (path, contents) in &info.files {
        text += &format!("<p>With the file {}, {}.</p>\n", escape(path), quantity(contents.len() as f64, "B"));
    }
    text += &format!(
        "<details><summary>{}</summary>\n<pre>{}</pre>\n",
        escape(&info.scene_file),
        escape(&info.scene_text[..end])
    );
    if end < info.scene_text.len() {
        text += &format!(
            "<p class=\"faint\">The first {} of {}.</p>\n",
            quantity(end as f64, "B"),
            quantity(info.scene_text.len() as f64, "B")
        );
    }
    text + "</details>\n"
}

fn foot(gathered: &Gathered) -> String {
    let thinned = if gathered.curves.thinned() {
        " Curves have at most some 1000 points: where there are more, the lowest and the highest of neighbours are drawn."
    } else {
        ""
    };
    format!(
        "<footer><p>Written by stagger {} from the recording alone.{thinned}</p></footer>\n",
        env!("CARGO_PKG_VERSION")
    )
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use stagger_messages::{Energy, Field, Grid, Measure, Port};
    use stagger_recordings::RunInfo;

    use super::*;
    use crate::report::{
        plot::{Slice, Sphere},
        snapshots::{Cloud, Colouring, Cut, Pictures, Sliced, Snapshot},
    };

    fn noise(number: u32) -> f64 {
        (f64::from(number) * 0.618_034).fract()
    }

    fn curve() -> Thinned {
        let mut curve = Thinned::default();
        (0..20_000).for_each(|number| curve.push(f64::from(number) * 1e-6, noise(number)));
        curve
    }

    /// More of everything than a run has: nodes, fields, energies, steps, particles that all can be seen, text.
    fn large() -> Gathered {
        let mut gathered = Gathered { accepted: 20_000, rejected: 1, t_s: 0.02, ..Gathered::default() };
        gathered.info = RunInfo { scene_text: "<&µ>\n".repeat(40_000), ..RunInfo::default() };
        let named = |number: usize| (format!("a field with a name {number}"), curve());
        gathered.curves.dt_s = curve();
        gathered.curves.iterations = curve();
        gathered.curves.accepted_errors = (0..40).map(named).collect();
        gathered.curves.first_errors = (0..40).map(named).collect();
        gathered.curves.solve_s = (0..40).map(named).collect();
        for number in 0..40 {
            let node = format!("node{number}");
            gathered.curves.energies_j.insert(node.clone(), (0..40).map(named).collect());
            gathered.ledger.book(&node, &(0..40).map(|name| Energy::lost(&name.to_string(), 1.0)).collect::<Vec<_>>());
            gathered.nodes.insert(node, NodeWork::default());
        }
        for number in 0..100 {
            let port = Arc::new(Port::f64(&format!("f{number}"), "m", "particles", 3, Measure::None));
            let values: Vec<f64> = (0..30_000).map(noise).collect();
            gathered.fields.insert(format!("f{number}"), Field::new(&port, 0, values).unwrap());
            gathered.topics.insert(format!("field/node/f{number}"), [1, 2]);
        }
        // A plane that is seen from both sides, as it is oblique.
        let sphere = |number: u32| {
            let (x, y) = ((number % 150) as f32, (number / 150) as f32);
            Sphere { centre_m: [x, y, y], radius_m: 0.4, value: noise(number) as f32 }
        };
        let snapshot = |step| Snapshot { t_s: 0.01, step, spheres: (0..22_500).map(sphere).collect() };
        let colouring = Colouring { name: "temperature".into(), unit: "K".into() };
        let shown = (0..3).map(snapshot).collect();
        let clouds = vec![Cloud { support: "particles".into(), colouring: colouring.clone(), shown }];
        let grid = Grid::of_cells([0.0; 3], [1.0; 3], [100, 90, 80]);
        let values: Vec<f64> = (0..720_000).map(noise).collect();
        let cut = |step| Cut { t_s: 0.01, step, planes: Slice::middles(&grid, &values) };
        let shown: Vec<_> = (0..3).map(cut).collect();
        let sliced = Sliced { support: "cells".into(), colouring, shown };
        gathered.pictures = Pictures { clouds, grids: vec![sliced; 6] };
        for number in 0..40 {
            let global = Global { unit: "W".into(), components: 1, curves: vec![curve(); 2] };
            gathered.curves.globals.insert(format!("g{number}"), global);
        }
        gathered
    }

    #[test]
    fn a_page_of_anything_stays_below_5_mb_and_says_what_it_leaves_out() {
        let page = page(&large(), "<large>");
        assert!(page.len() < 5_000_000, "{} bytes", page.len());
        let options = roxmltree::ParsingOptions { allow_dtd: true, ..Default::default() };
        roxmltree::Document::parse_with_options(&page, options).unwrap();
        for expected in [
            "every n-th is drawn",
            "some 1000 points",
            "The first 100.0 kB of",
            "The first 48 of 100 fields",
            "And 16 more fields",
        ] {
            assert!(page.contains(expected), "{expected}");
        }
    }

    #[test]
    fn of_a_recording_without_anything_there_is_a_page_too() {
        let page = page(&Gathered::default(), "nothing");
        let options = roxmltree::ParsingOptions { allow_dtd: true, ..Default::default() };
        roxmltree::Document::parse_with_options(&page, options).unwrap();
        assert!(page.contains("not closed") && page.contains("cut off or damaged"));
    }
}
