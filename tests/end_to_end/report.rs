//! The page about a recording: its numbers are those of `info`, and a browser lays it out without fault.

use std::{
    path::{Path, PathBuf},
    process::{Command, Output},
};

use serde_json::Value;

use super::program::{Workplace, json, said, same, stagger};

fn report(place: &Workplace, recording: &str, page: &str) -> Output {
    let mut command = stagger();
    command.arg("report").arg(place.path(recording)).arg("--out").arg(place.path(page));
    command.output().unwrap()
}

fn info(place: &Workplace, recording: &str) -> Value {
    let output = stagger().arg("info").arg(place.path(recording)).arg("--json").output().unwrap();
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Keys and values of a page for programs.
fn data(page: &str) -> Vec<(String, f64)> {
    let options = roxmltree::ParsingOptions { allow_dtd: true, ..Default::default() };
    let page = roxmltree::Document::parse_with_options(page, options).unwrap();
    let entries = page.descendants().filter(|node| node.has_tag_name("data"));
    entries
        .map(|node| (node.attribute("data-key").unwrap().to_owned(), node.attribute("value").unwrap().parse().unwrap()))
        .collect()
}

/// The value of a key in the JSON of `info`: names between points, of which the last may be a number of entries.
fn told(info: &Value, key: &str) -> Option<f64> {
    let mut at = info;
    for name in key.split('.') {
        at = at.get(name)?;
    }
    at.as_array().map(|list| list.len() as f64).or_else(|| at.as_f64())
}

/// Compares every number of a page with what `info` says; those of fields, which `info` does not know, are returned.
fn compare(page: &str, info: &Value) -> Vec<(String, f64)> {
    let (fields, others): (Vec<_>, Vec<_>) = data(page).into_iter().partition(|(key, _)| key.starts_with("fields."));
    for (key, value) in &others {
        let told = told(info, key).unwrap_or_else(|| panic!("{key}"));
        assert!(same(*value, told), "{key}: {value} on the page, {told} by info");
    }
    fields
}

/// Whether a page of quick.toml tells what it should.
fn is_whole(page: &str) {
    let entries = data(page);
    let has = |key: &str| entries.iter().any(|(other, _)| other == key);
    for key in [
        "steps_accepted",
        "iterations",
        "simulated_time_s",
        "dt.min_s",
        "nodes.thermal.solve_s",
        "nodes.thermal.ledger.stored.heat",
        "topics.field/particles/positions.bytes",
    ] {
        assert!(has(key), "{key}");
    }
}

#[test]
fn its_numbers_are_those_of_info_and_it_needs_nothing_beside_itself() {
    let place = Workplace::with("quick.toml");
    let run = json(&place.run(&["--record", "run.mcap", "--json"]));
    let output = report(&place, "run.mcap", "report.html");
    assert!(output.status.success(), "{}", said(&output));
    let page = std::fs::read_to_string(place.path("report.html")).unwrap();
    assert!(page.len() < 5_000_000, "{} bytes", page.len());
    is_whole(&page);
    let fields = compare(&page, &info(&place, "run.mcap"));
    let mut compared = 0;
    for field in run["fields"].as_array().unwrap() {
        for what in ["rows", "min", "mean", "max"] {
            let key = format!("fields.{}.{what}", field["field"].as_str().unwrap());
            let value = fields.iter().find(|(other, _)| *other == key).unwrap_or_else(|| panic!("{key}")).1;
            assert!(same(value, field[what].as_f64().unwrap()), "{key}: {value}, {}", field[what]);
            compared += 1;
        }
    }
    assert_eq!(compared, fields.len());
    for expected in [
        "100 particles, a warm plate and a laser",
        "temperature [K]",
        "Residual of each field",
        "Energy of thermal",
        "<pre>",
    ] {
        assert!(page.contains(expected), "{expected}");
    }
    // The name of SVG is an address that nobody asks for.
    let page = page.replace("http://www.w3.org/2000/svg", "");
    for foreign in ["http:", "https:", "<script", "<link", "<img", "src=", "@import", "url(/", "NaN", "Infinity"] {
        assert!(!page.contains(foreign), "{foreign}");
    }
}

#[test]
fn of_a_file_that_is_cut_off_or_damaged_it_shows_what_can_be_read() {
    let place = Workplace::with("quick.toml");
    json(&place.run(&["--record", "run.mcap", "--json"]));
    let whole = std::fs::read(place.path("run.mcap")).unwrap();
    // The last cut takes the end mark alone.
    for end in (1..10).map(|tenth| tenth * whole.len() / 10).chain([whole.len() - 40]) {
        std::fs::write(place.path("cut.mcap"), &whole[..end]).unwrap();
        let output = report(&place, "cut.mcap", "cut.html");
        assert_eq!(output.status.code(), Some(3), "{end}: {}", said(&output));
        let page = std::fs::read_to_string(place.path("cut.html")).unwrap();
        assert!(page.contains("cut off or damaged"));
        compare(&page, &info(&place, "cut.mcap"));
        if end == whole.len() - 40 {
            is_whole(&page);
        }
    }

    let mut flipped = whole.clone();
    let middle = flipped.len() / 2;
    flipped[middle] ^= 1;
    std::fs::write(place.path("flipped.mcap"), flipped).unwrap();
    let output = report(&place, "flipped.mcap", "flipped.html");
    assert_eq!(output.status.code(), Some(3), "{}", said(&output));
    let page = std::fs::read_to_string(place.path("flipped.html")).unwrap();
    assert!(page.contains("what precedes this point is sound") && !data(&page).is_empty(), "{page}");

    std::fs::write(place.path("no.mcap"), b"not a recording").unwrap();
    assert_eq!(report(&place, "no.mcap", "no.html").status.code(), Some(1));
}

/// Chromium: that which `STAGGER_BROWSER` names and which then must be there, or one on the PATH.
fn browser() -> Option<PathBuf> {
    if let Some(named) = std::env::var_os("STAGGER_BROWSER") {
        return Some(named.into());
    }
    let names = ["chromium", "chromium-headless-shell", "chromium-browser", "google-chrome"];
    let paths = std::env::var_os("PATH").unwrap_or_default();
    let mut candidates = std::env::split_paths(&paths).flat_map(|folder| names.map(|name| folder.join(name)));
    candidates.find(|path| path.is_file())
}

/// What the page measures of itself in a window of some width.
fn measured(browser: &Path, place: &Workplace, page: &Path, width: u32, dark: bool) -> Value {
    let output = Command::new(browser)
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync"])
        .args(["--disable-background-networking", "--disable-component-update", "--disable-extensions", "--dump-dom"])
        .arg(format!("--user-data-dir={}", place.path("browser").display()))
        .arg(format!("--window-size={width},1000"))
        // In Blink's settings 0 is dark and 1 is light.
        .arg(format!("--blink-settings=preferredColorScheme={}", u8::from(!dark)))
        .arg(format!("file://{}", page.display()))
        .output()
        .unwrap_or_else(|error| panic!("{}: {error}", browser.display()));
    let dom = String::from_utf8_lossy(&output.stdout).into_owned();
    let text = dom.split("<pre id=\"measured\">").nth(1).unwrap_or_else(|| panic!("not laid out: {}", said(&output)));
    let text = text.split("</pre>").next().unwrap().replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&");
    serde_json::from_str(&text).unwrap()
}

#[test]
fn a_browser_lays_it_out_wide_and_narrow_light_and_dark() {
    let Some(browser) = browser() else {
        println!(
            "NO BROWSER: there is no Chromium on the PATH, and the page was not opened; its text is tested by the others"
        );
        return;
    };
    let place = Workplace::with("quick.toml");
    json(&place.run(&["--record", "run.mcap", "--json"]));
    assert!(report(&place, "run.mcap", "report.html").status.success());
    let page = std::fs::read_to_string(place.path("report.html")).unwrap();
    // The page forbids itself scripts; the copy that is measured has this one.
    let policy = "default-src 'none'; style-src 'unsafe-inline'";
    assert_eq!(page.matches(policy).count(), 1);
    let page = page.replace(policy, &format!("{policy}; script-src 'unsafe-inline'"));
    let script = format!("<script>{}</script>\n</head>", include_str!("measure.js"));
    let copy = place.path("measured.html");
    std::fs::write(&copy, page.replacen("</head>", &script, 1)).unwrap();
    for (width, dark) in [(1280, false), (1280, true), (500, false)] {
        let found = measured(&browser, &place, &copy, width, dark);
        assert_eq!((found["dark"].as_bool(), found["width"].as_u64()), (Some(dark), Some(u64::from(width))), "{found}");
        for empty in ["beyond", "overlapping", "flat", "refused"] {
            assert_eq!(found[empty], Value::Array(Vec::new()), "{empty} at {width}");
        }
        assert_eq!((found["fetched"].as_u64(), found["too_wide"].as_f64()), (Some(0), Some(0.0)), "{found}");
        assert!(found["drawings"].as_u64() > Some(30), "{found}");
        // WCAG 2.2: 4.5 for text, 3 for what is drawn.
        assert!(
            found["text_contrast"].as_f64() >= Some(4.5) && found["line_contrast"].as_f64() >= Some(3.0),
            "{found}"
        );
        assert!(found["smallest_text"].as_f64() >= Some(9.0), "{found}");
    }
}
