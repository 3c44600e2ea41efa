//! The section about energy.

use std::collections::BTreeMap;

use super::{
    gathered::Gathered,
    html::{data, plots, table},
    page::{SERIES, time},
    plot::{Axis, Chart, Series, Thinned, escape, number, quantity},
};

/// Nodes whose energies are plotted at most; the table has all.
const PLOTS: usize = 8;

/// The ledger as a table, its imbalances, and each node's energies over simulated time.
pub fn energy(gathered: &Gathered) -> String {
    let mut rows = Vec::new();
    for (node, account) in gathered.ledger.nodes() {
        let joules = |kind: &str, name: &str, joule: f64| {
            data(&format!("nodes.{node}.ledger.{kind}.{name}"), joule, &quantity(joule, "J"))
        };
        for (name, joule) in &account.stored {
            let initial = account.initial.get(name).copied().unwrap_or_default();
            let cells = [quantity(initial, "J"), joules("stored", name, *joule), quantity(joule - initial, "J")];
            rows.push([vec![escape(node), shown(name), "held".into()], cells.into()].concat());
        }
        for (kind, map) in [("gained", &account.gained), ("lost", &account.lost)] {
            for (name, joule) in map {
                let cells = [String::new(), joules(kind, name, *joule), String::new()];
                rows.push([vec![escape(node), shown(name), kind.into()], cells.into()].concat());
            }
        }
    }
    if rows.is_empty() {
        return String::new();
    }
    let mut text = table(&["node", "energy", "kind", "at the start", "at the end, or in all", "change"], 3, &rows);
    let imbalances = gathered.ledger.imbalances();
    let row =
        |(what, share): (&String, &f64)| vec![escape(what), data(&format!("imbalance.{what}"), share, &number(*share))];
    text += &table(
        &["imbalance of", "share of the energy turned over"],
        1,
        &imbalances.iter().map(row).collect::<Vec<_>>(),
    );
    let on_the_way = gathered.ledger.on_the_way();
    if !on_the_way.is_empty() {
        let row = |(what, joule): (&String, &f64)| {
            vec![escape(what), data(&format!("on_the_way.{what}"), joule, &quantity(*joule, "J"))]
        };
        text += &table(&["given and not yet taken", "energy"], 1, &on_the_way.iter().map(row).collect::<Vec<_>>());
    }
    let chart = |(node, curves): (&String, &BTreeMap<String, Thinned>)| {
        let moving = curves.iter().map(|(name, curve)| (name.replace('_', " "), curve.points()));
        // What stays zero throughout would only crowd the legend.
        let series = moving.filter(|(_, points)| points.iter().any(|[_, joule]| *joule != 0.0)).take(SERIES);
        let series: Vec<_> = series.map(|(name, points)| Series::line(name, points)).collect();
        let chart = Chart {
            title: format!("Energy of {node}, since the start"),
            x: time(gathered),
            y: Axis::linear("energy", "J"),
            series,
            levels: Vec::new(),
        };
        (!chart.series.is_empty()).then(|| chart.figure())
    };
    text + &plots(&gathered.curves.energies_j.iter().filter_map(chart).take(PLOTS).collect::<Vec<_>>())
}

fn shown(name: &str) -> String {
    escape(&name.replace('_', " "))
}
