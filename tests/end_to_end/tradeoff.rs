//! `stagger tradeoff`: its table is that of its own runs, it goes on where it stopped, and orders are those of the methods.

use std::{collections::BTreeMap, process::Output, time::SystemTime};

use super::program::{Workplace, json, said, stagger};

fn tradeoff(place: &Workplace, arguments: &[&str]) -> Output {
    let mut command = stagger();
    command.arg("tradeoff").arg(&place.scene).args(arguments).arg("--in-process");
    command.arg("--out").arg(place.path("out")).output().unwrap()
}

/// When each result was written, by file.
fn written(place: &Workplace) -> BTreeMap<String, SystemTime> {
    let entries = std::fs::read_dir(place.path("out/cases")).unwrap().map(|entry| entry.unwrap());
    let results = entries.filter(|entry| entry.path().extension().is_some_and(|extension| extension == "json"));
    results
        .map(|entry| (entry.file_name().into_string().unwrap(), entry.metadata().unwrap().modified().unwrap()))
        .collect()
}

/// Beds that cool by radiation and convection under a laser: smooth, so that methods show their order.
const SMOOTH: &str = r#"
duration = "1 ms"
[particles]
count      = 27
radius     = "25 um"
material   = "316L"
start      = { kind = "lattice", box = ["0.2 mm", "0.2 mm", "0.2 mm"] }
integrator = "held"
[thermal]
ambient = { temperature = "300 K", convection = 2e5, emissivity = 0.5 }
[optics]
fidelity   = "energy-balance"
power      = "1 W"
profile    = { kind = "top-hat", radius = "0.2 mm" }
path       = { kind = "fixed", at = [0, 0, 0] }
[coupling]
dt = "100 us"
[presets.draft]
coupling.dt = "200 us"
"#;

#[test]
fn the_table_is_that_of_its_runs_and_what_is_there_is_not_run_again() {
    let place = Workplace::of(SMOOTH);
    let axes = ["--axis", "dt", "--axis", "phi", "--error", "2%"];
    let output = tradeoff(&place, &axes);
    assert!(output.status.success(), "{}", said(&output));
    let told = String::from_utf8_lossy(&output.stdout).into_owned();
    for row in
        ["the scene as it stands", "half as tight", "preset draft", "dt x 2", "phi 1", "recommended within 2.00 %"]
    {
        assert!(told.contains(row), "{row} in\n{told}");
    }
    let before = written(&place);
    // The scene, two references, the preset, five steps, two weights, and what was combined of them; the preset's step is one
    // of the axis.
    assert!(before.len() >= 11, "{before:?}");
    let page = std::fs::read_to_string(place.path("out/tradeoff.html")).unwrap();
    let options = roxmltree::ParsingOptions { allow_dtd: true, ..Default::default() };
    let page = roxmltree::Document::parse_with_options(&page, options).unwrap();
    assert!(page.descendants().any(|node| node.has_tag_name("svg")));

    // One result is lost: it alone is made again, and all errors are the same to the last bit. It is a reference's, as the
    // time of any other, which is another the second time, may change what is combined.
    let mut again = [axes.as_slice(), &["--json"]].concat();
    let first = json(&tradeoff(&place, &again));
    assert_eq!(written(&place), before);
    let of_reference = |name: &&String| {
        let kept = std::fs::read(place.path("out/cases").join(name)).unwrap();
        serde_json::from_slice::<serde_json::Value>(&kept).unwrap()["set"] == first["cases"][2]["outcome"]["set"]
    };
    let lost = before.keys().find(of_reference).unwrap();
    std::fs::remove_file(place.path("out/cases").join(lost)).unwrap();
    let second = json(&tradeoff(&place, &again));
    let after = written(&place);
    assert_eq!(after.keys().collect::<Vec<_>>(), before.keys().collect::<Vec<_>>());
    assert_eq!(
        after.iter().filter(|(name, time)| before[*name] != **time).map(|(name, _)| name).collect::<Vec<_>>(),
        [lost]
    );
    let cases = |study: &serde_json::Value| study["cases"].as_array().unwrap().clone();
    for (first, second) in cases(&first).iter().zip(&cases(&second)) {
        assert_eq!((&first["label"], &first["errors"]), (&second["label"], &second["errors"]));
    }
    // Nothing is faster and as exact as one of the front; the recommended run is within the bound.
    let rated: Vec<(f64, f64)> = cases(&second)
        .iter()
        .map(|case| {
            let errors = case["errors"].as_array().unwrap().iter().map(|error| error.as_f64().unwrap());
            (case["outcome"]["wall_s"][0].as_f64().unwrap(), errors.fold(0.0, f64::max))
        })
        .collect();
    let known = second["known_to"].as_array().unwrap().iter().map(|error| error.as_f64().unwrap()).fold(0.0, f64::max);
    for index in second["front"].as_array().unwrap().iter().map(|index| index.as_u64().unwrap() as usize) {
        let (wall, error) = rated[index];
        let beats = |case: &(f64, f64)| case.0 < wall && case.1.max(known) <= error.max(known);
        let others = rated.iter().enumerate().filter(|(other, _)| ![1, 2, index].contains(other));
        assert_eq!(others.filter(|(_, case)| beats(case)).count(), 0, "{index} of {rated:?}");
    }
    assert!(rated[second["recommended"].as_u64().unwrap() as usize].1 <= 0.02);

    // What would be asked in vain is said before anything runs.
    again = vec!["--axis", "current"];
    let output = tradeoff(&place, &again);
    assert_eq!(output.status.code(), Some(2));
    assert!(said(&output).contains("is no axis of this scene\nhint: axes are dt, tolerance"), "{}", said(&output));
    let output = tradeoff(&place, &["--quantity", "peak pressure"]);
    assert!(
        output.status.code() == Some(2) && said(&output).contains("the scene has no peak pressure"),
        "{}",
        said(&output)
    );
}

#[test]
fn a_named_quantity_of_the_scene_is_what_counts_and_a_setting_that_fails_has_its_reason() {
    let text = SMOOTH.replace("[presets.draft]", "[tradeoff]\nquantities = [\"peak temperature\"]\n[presets.draft]");
    let place = Workplace::of(&text);
    let output = tradeoff(&place, &["--vary", "thermal.ambient.emissivity=0;2", "--json"]);
    let study = json(&output);
    assert_eq!(study["quantities"], serde_json::json!(["peak temperature"]));
    let of = |label: &str| {
        let cases = study["cases"].as_array().unwrap();
        cases.iter().find(|case| case["label"] == format!("thermal.ambient.emissivity {label}")).unwrap()["outcome"]
            .clone()
    };
    assert!(of("0")["failed"].is_null());
    let why = of("2")["failed"].as_str().unwrap().to_owned();
    assert!(why.starts_with("thermal.ambient.emissivity: expected a number from 0 to 1"), "{why}");
}

#[test]
fn orders_are_those_of_the_weights() {
    // Halved from 20 us: three differences, two orders; a tenth is what the next term of the error changes.
    for (phi, order) in [("0.5", 2.0), ("1", 1.0), ("0", 1.0)] {
        let place = Workplace::of(SMOOTH);
        let phi = format!("thermal.phi={phi}");
        let told = json(&tradeoff(
            &place,
            &["--orders", "--set", &phi, "--quantity", "each temperature", "--dt", "2e-5", "--levels", "4", "--json"],
        ));
        assert_eq!(told["expected"], order);
        let measured: Vec<f64> =
            told["rows"][0]["orders"].as_array().unwrap().iter().map(|order| order.as_f64().unwrap()).collect();
        assert!(
            measured.len() == 2 && measured.iter().all(|measured| (measured - order).abs() < 0.15),
            "{phi}: {measured:?}"
        );
    }
}

#[test]
fn interrupted_it_says_how_to_go_on_and_leaves_the_files_of_others() {
    let place = Workplace::with("quick.toml");
    // As another program may have put them there.
    std::fs::create_dir_all(place.path("out/cases")).unwrap();
    let others = ["summary.json", "messages.txt"].map(|name| place.path(&format!("out/cases/{name}")));
    others.iter().for_each(|path| std::fs::write(path, "{}").unwrap());
    let mut command = stagger();
    command.arg("tradeoff").arg(&place.scene).arg("--out").arg(place.path("out"));
    let child = command.stdout(std::process::Stdio::null()).stderr(std::process::Stdio::piped()).spawn().unwrap();
    let started = std::time::Instant::now();
    while written(&place).len() < 2 {
        assert!(started.elapsed().as_secs() < 60, "nothing was run");
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    let signal = std::process::Command::new("kill").arg("-INT").arg(child.id().to_string()).status().unwrap();
    assert!(signal.success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(3), "{}", said(&output));
    assert!(said(&output).contains("interrupted; the same command goes on where it stopped"), "{}", said(&output));
    others.iter().for_each(|path| assert_eq!(std::fs::read_to_string(path).unwrap(), "{}", "{}", path.display()));
}
