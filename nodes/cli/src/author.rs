//! Commands for authors of nodes.

use std::{
    path::{Path, PathBuf},
    time::Duration,
};

use stagger_messages::keys;
use stagger_scene::Scene;
use stagger_tools::{
    conformance::{Bench, SCENE},
    new_node,
};

use super::{End, FAILED, USAGE, arguments::ConformanceArguments, failed, parse, print, print_json, read_scene};

/// Drives a node through the protocol and prints a verdict for each rule.
pub(super) fn conformance(arguments: ConformanceArguments) -> End {
    let ConformanceArguments { scene, overrides, node, json, patience, command } = arguments;
    if let Some(Err(error)) = node.as_ref().map(|node| keys::check_name(node)) {
        return End::Code(USAGE, format!("--node: {error}"));
    }
    let read = match &scene {
        Some(path) => read_scene(path).and_then(|file| {
            let scene = parse(&file, &overrides, None)?;
            // What cannot be read again is made of its text.
            let path = file.can_be_read_again(&scene).then_some(file.path);
            Ok((scene, path))
        }),
        None => Scene::parse(SCENE, "the scene of conformance", &overrides)
            .map(|scene| (scene, None))
            .map_err(|problems| End::Code(USAGE, format!("the scene is not valid\n{problems}"))),
    };
    let (read, scene) = match read {
        Ok(read) => read,
        Err(end) => return end,
    };
    let bench = match Bench::new(read, scene, node, command, Duration::from_secs(patience.into())) {
        Ok(bench) => bench,
        Err(error) => return End::Code(USAGE, error.to_string()),
    };
    // A line as soon as it is known: a node that answers slowly takes its time.
    let findings = bench.check(|finding| {
        if !json {
            print(&finding.to_string());
        }
    });
    let findings = match findings {
        Ok(findings) => findings,
        Err(error) => return failed(&error),
    };
    if json {
        if let Err(end) = print_json(&findings) {
            return end;
        }
    } else {
        print(&findings.total());
    }
    match findings.broken() {
        0 => End::Done,
        broken => End::Code(FAILED, format!("node `{}` breaks {broken} rules of the protocol", bench.node)),
    }
}

/// Writes a crate to begin a node with, and says what to type next.
pub(super) fn new_node(name: &str, stagger: Option<PathBuf>) -> End {
    match new_node::write(Path::new("."), name, &stagger.unwrap_or_else(new_node::sources)) {
        Ok(folder) => {
            print(&format!("wrote {}: its README.md says how to build, run and check it", folder.display()));
            End::Done
        }
        Err(error) => End::Code(USAGE, error.to_string()),
    }
}
