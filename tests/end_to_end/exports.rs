//! What other programs read: the table of scalars holds what the run said of itself.

use std::collections::BTreeMap;

use super::program::{Workplace, json, said, same, stagger};

/// Rows of a table by the names of its columns.
fn table(text: &str) -> Vec<BTreeMap<String, f64>> {
    let mut lines = text.lines();
    let names = cells(lines.next().unwrap());
    let row = |line: &str| {
        let values = cells(line);
        assert_eq!(values.len(), names.len(), "{line}");
        let known = names.iter().cloned().zip(values).filter(|(_, value)| !value.is_empty());
        known.map(|(name, value)| (name, value.parse().unwrap())).collect()
    };
    lines.map(row).collect()
}

/// Cells of a line of CSV, with or without quotes.
fn cells(line: &str) -> Vec<String> {
    let (mut cells, mut quoted) = (vec![String::new()], false);
    for symbol in line.chars() {
        match symbol {
            '"' => quoted = !quoted,
            ',' if !quoted => cells.push(String::new()),
            other => cells.last_mut().unwrap().push(other),
        }
    }
    cells
}

#[test]
fn the_table_of_scalars_ends_with_what_the_run_said() {
    let place = Workplace::with("quick.toml");
    let run = json(&place.run(&["--record", "run.mcap", "--json"]));
    let mut export = stagger();
    export.arg("export").arg(place.path("run.mcap")).arg("--csv").arg("--out").arg(place.path("out"));
    let output = export.output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
    assert!(!place.path("out/particles.pvd").exists(), "VTK files were not asked for");
    let rows = table(&std::fs::read_to_string(place.path("out/scalars.csv")).unwrap());
    // The start and every accepted step.
    assert_eq!(rows.len() as u64, 1 + run["steps"]["accepted"].as_u64().unwrap());
    let (first, last) = (&rows[0], &rows[rows.len() - 1]);
    assert_eq!((first["step"], first["t_s"]), (0.0, 0.0));
    assert!(same(last["t_s"], run["steps"]["time_s"].as_f64().unwrap()));
    let iterations: f64 = rows.iter().map(|row| row["iterations"]).sum();
    assert_eq!(Some(iterations), run["steps"]["iterations"].as_f64());
    let holds = |column: String, value: &serde_json::Value| {
        assert!(
            same(last[&column], value.as_f64().unwrap()),
            "{column}: {} in the table, {value} by the run",
            last[&column]
        );
    };
    for (node, account) in run["ledger"].as_object().unwrap() {
        for kind in ["stored", "gained", "lost"] {
            for (name, joule) in account[kind].as_object().unwrap() {
                holds(format!("energy {node}: {name}, {kind} [J]"), joule);
            }
        }
        for (name, value) in run["nodes"][node]["figures"].as_object().unwrap() {
            holds(format!("figure {node}: {name}"), value);
        }
    }
    let fields = run["fields"].as_array().unwrap();
    let temperature = fields.iter().find(|field| field["field"] == "temperature").unwrap();
    for what in ["min", "mean", "max"] {
        holds(format!("field temperature: {what} [K]"), &temperature[what]);
    }
    assert_eq!(first["field positions z: min [m]"].signum(), 1.0);
    assert_eq!(last["field positions: rows"], 100.0);
}

#[test]
fn a_recording_that_is_cut_off_is_exported_as_far_as_it_goes() {
    let place = Workplace::with("quick.toml");
    json(&place.run(&["--record", "run.mcap", "--json"]));
    let whole = std::fs::read(place.path("run.mcap")).unwrap();
    std::fs::write(place.path("cut.mcap"), &whole[..whole.len() - 40]).unwrap();
    let mut export = stagger();
    export.arg("export").arg(place.path("cut.mcap")).args(["--csv", "--vtp"]).arg("--out").arg(place.path("out"));
    let output = export.output().unwrap();
    assert_eq!(output.status.code(), Some(3), "{}", said(&output));
    let text = std::fs::read_to_string(place.path("out/scalars.csv")).unwrap();
    let series = std::fs::read_to_string(place.path("out/particles.pvd")).unwrap();
    // A row for each state, below one line of names.
    assert_eq!(text.lines().count() - 1, series.matches("<DataSet").count());
}
