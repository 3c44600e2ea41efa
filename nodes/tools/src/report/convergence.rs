//! Sections about the step control: windows, iterations, errors.

use std::collections::BTreeMap;

use super::{
    gathered::Gathered,
    html::plots,
    page::{SERIES, time},
    plot::{Axis, Chart, Level, Mark, Series, Thinned},
};

/// Share of its tolerance below which an error is drawn there: less is rounding, and zero has no logarithm.
const FLOOR: f64 = 1e-8;

/// Windows and iterations over simulated time.
pub fn steps(gathered: &Gathered) -> String {
    if gathered.accepted + gathered.rejected == 0 {
        return String::new();
    }
    let curves = &gathered.curves;
    let mut windows = vec![Series::line("accepted", curves.dt_s.points()).drawn(Mark::Steps)];
    if gathered.rejected > 0 {
        windows.push(Series::line("rejected", curves.rejected_dt_s.points()).drawn(Mark::Crosses));
    }
    let sizes = Chart {
        title: "Window size Δt".into(),
        x: time(gathered),
        y: Axis::linear("Δt", "s").with(&[0.0]),
        series: windows,
        levels: Vec::new(),
    };
    let iterations = Chart {
        title: "Iterations per accepted step, rejected attempts included".into(),
        x: time(gathered),
        y: Axis::linear("iterations", "1").with(&[0.0]),
        series: vec![Series::line("iterations", curves.iterations.points()).drawn(Mark::Steps)],
        levels: Vec::new(),
    };
    plots(&[sizes.figure(), iterations.figure()])
}

/// Errors of all fields over their tolerances.
pub fn errors(gathered: &Gathered) -> String {
    let curves = &gathered.curves;
    let chart = |title: &str, errors: &BTreeMap<String, Thinned>| Chart {
        title: title.into(),
        x: time(gathered),
        y: Axis::log("error over tolerance", "1"),
        series: errors
            .iter()
            .take(SERIES)
            .map(|(field, curve)| Series::line(field.replace('_', " "), floored(curve)))
            .collect(),
        levels: vec![Level { name: "tolerance".into(), value: 1.0 }],
    };
    let mut figures = Vec::new();
    if !curves.accepted_errors.is_empty() {
        figures.push(chart("Residual of each field when accepted", &curves.accepted_errors).figure());
        figures.push(chart("Residual of each field in the first iteration", &curves.first_errors).figure());
    }
    let rates = curves.contraction.points();
    if !rates.is_empty() {
        let rates = Chart {
            title: "Contraction: mean factor from one error to the next".into(),
            x: time(gathered),
            y: Axis::log("contraction rate", "1"),
            series: vec![Series::line("contraction", rates)],
            levels: vec![Level { name: "no contraction".into(), value: 1.0 }],
        };
        figures.push(rates.figure());
    }
    let note = "<p class=\"faint\">The residual is the relative change ε of a field from one iteration to the next. \
                What is below 10⁻⁸ of its tolerance, such as an error of exactly zero, is drawn there.</p>\n";
    if figures.is_empty() { String::new() } else { plots(&figures) + note }
}

fn floored(curve: &Thinned) -> Vec<[f64; 2]> {
    curve.points().into_iter().map(|[t_s, error]| [t_s, error.max(FLOOR)]).collect()
}
