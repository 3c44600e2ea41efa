//! Every bad scene is a fixture with the whole message it must cause written in it.
//!
//! `# set: key=value` is an override given with the scene; `# expect: line` is one line of the message, in order.

use std::{fs, path::Path};

use stagger_scene::Scene;

fn marked<'t>(text: &'t str, mark: &'t str) -> impl Iterator<Item = &'t str> {
    text.lines().filter_map(move |line| line.strip_prefix("# ")?.strip_prefix(mark)?.strip_prefix(": "))
}

/// The difference between the message a fixture causes and the one written in it.
fn check(path: &Path) -> Result<(), String> {
    let text = fs::read_to_string(path).map_err(|error| error.to_string())?;
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let overrides: Vec<(String, String)> = marked(&text, "set")
        .filter_map(|set| set.split_once('='))
        .map(|(key, value)| (key.to_owned(), value.to_owned()))
        .collect();
    let expected: Vec<&str> = marked(&text, "expect").collect();
    let read = |file: &str| fs::read(path.with_file_name(file)).map_err(|error| error.to_string());
    let message = match Scene::parse_with_files(&text, &name, &overrides, &read) {
        Ok(_) => return Err(format!("{name}: the scene was accepted")),
        Err(problems) => problems.to_string(),
    };
    let found: Vec<&str> = message.lines().map(str::trim_start).collect();
    if found == expected && !expected.is_empty() {
        return Ok(());
    }
    Err(format!("{name}: expected\n  {}\nfound\n  {}", expected.join("\n  "), found.join("\n  ")))
}

#[test]
fn every_bad_scene_says_what_is_wrong_and_nothing_else() {
    let mut fixtures: Vec<_> = fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/bad_scenes"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "toml"))
        .collect();
    fixtures.sort();
    assert!(fixtures.len() >= 11, "only {} fixtures found", fixtures.len());
    let wrong: Vec<String> = fixtures.iter().filter_map(|path| check(path).err()).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n\n"));
}
