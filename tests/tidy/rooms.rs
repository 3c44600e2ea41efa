//! The folders of the physics: no physics takes from another one or is named outside its folder, and those of the particles stand upon one another.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::Path,
};

use super::{BESIDE, ORDER, code, files, root, shown};

const PHYSICS: &str = "solver/physics/src";

/// The paths that begin with `crate`, `super` or `self` in code, use trees spread out.
fn paths(code: &str) -> Vec<Vec<String>> {
    let lines = code.lines().filter(|line| !line.trim_start().starts_with("//"));
    let code: String = lines.flat_map(|line| [line, "\n"]).collect();
    let mut found = Vec::new();
    for word in ["crate::", "super::", "self::"] {
        for (at, _) in code.match_indices(word) {
            let before = code[..at].chars().next_back();
            if before.is_none_or(|before| !before.is_alphanumeric() && before != '_' && before != ':') {
                spread(&code[at..], &[], &mut found);
            }
        }
    }
    found
}

/// Adds the paths of the tree that `text` begins with, after `prefix`; returns what follows the tree.
fn spread<'t>(text: &'t str, prefix: &[String], found: &mut Vec<Vec<String>>) -> &'t str {
    let text = text.trim_start();
    if let Some(mut rest) = text.strip_prefix('{') {
        loop {
            rest = rest.trim_start().trim_start_matches(',').trim_start();
            if let Some(rest) = rest.strip_prefix('}') {
                return rest;
            }
            let before = rest.len();
            rest = spread(rest, prefix, found);
            // An alias, or a glob: nothing to follow.
            let next = rest.find([',', '}']).unwrap_or(rest.len());
            rest = &rest[next..];
            assert!(rest.len() < before, "not a use tree: {rest}");
        }
    }
    let end = text.find(|next: char| !next.is_alphanumeric() && next != '_').unwrap_or(text.len());
    let path: Vec<String> = prefix.iter().cloned().chain([text[..end].to_owned()]).collect();
    match text[end..].strip_prefix("::") {
        Some(rest) if !rest.starts_with('<') => spread(rest, &path, found),
        _ => {
            found.push(path);
            &text[end..]
        }
    }
}

/// The module that a file under `src` is.
fn module(src: &Path, file: &Path) -> Vec<String> {
    let file = file.strip_prefix(src).unwrap_or(file).with_extension("");
    let mut module: Vec<String> = file.iter().map(|part| part.to_string_lossy().into_owned()).collect();
    module.pop_if(|last| *last == "mod" || *last == "lib");
    module
}

/// Absolute paths, without `crate`, of what the code of a file names in its crate.
fn named(src: &Path, file: &Path) -> BTreeSet<Vec<String>> {
    let absolute = |path: Vec<String>| {
        let up = path.iter().take_while(|part| *part == "super").count();
        let module = match path[0].as_str() {
            "crate" => Vec::new(),
            _ => module(src, file),
        };
        let from = path.iter().take_while(|part| ["crate", "super", "self"].contains(&part.as_str())).count();
        module[..module.len().saturating_sub(up)].iter().chain(&path[from..]).cloned().collect()
    };
    paths(&code(file)).into_iter().map(absolute).collect()
}

#[test]
fn a_use_tree_is_spread_out() {
    let code = "use crate::{a::{b, C as D}, e};\n// use crate::no;\nlet x = super::super::f::g(1) + mycrate::h;\nuse super::*; self::i();";
    let shown: Vec<String> = paths(code).iter().map(|path| path.join(" ")).collect();
    assert_eq!(shown, ["crate a b", "crate a C", "crate e", "super super f g", "super ", "self i"]);
}

#[test]
fn no_physics_takes_from_another() {
    let src = root().join(PHYSICS);
    let folders = std::fs::read_dir(&src).unwrap().map(|entry| entry.unwrap().path()).filter(|path| path.is_dir());
    let names: BTreeSet<String> =
        folders.map(|path| path.file_name().unwrap().to_string_lossy().into_owned()).collect();
    assert!(names.contains("particles") && names.contains("thermal") && names.contains("common"));
    for name in &names {
        for file in files(&src.join(name), &[".rs"]) {
            for path in named(&src, &file) {
                let of_another = path[0] != *name && path[0] != "common" && names.contains(&path[0]);
                assert!(!of_another, "{} takes {}", shown(&file), path.join("::"));
            }
        }
    }
}

/// Files that may say the name of a physics outside its folder, and why.
const NAMES_ALLOWED: [(&str, &str); 9] = [
    ("solver/physics/src/common/mod.rs", "the support that several physics share is called particles"),
    ("solver/physics/src/common/keys/walls.rs", "a wall has a key `current`"),
    ("solver/physics/src/common/keys/walls/shape.rs", "a cylinder has a key `particles`: inside or outside"),
    (
        "solver/physics/src/common/keys/beam.rs",
        "the pages describe keys that beams share under the first table with a beam",
    ),
    ("solver/physics/src/common/keys/rays.rs", "so it is with rays"),
    ("solver/config/src/units.rs", "a quantity is called current"),
    ("solver/physics/src/common/walls/stl.rs", "STL files begin with the word solid"),
    ("nodes/tools/src/check/graph.rs", "a line of a graph may be solid"),
    ("messages/src/support.rs", "recordings of before supports were described are read by the names of then"),
];

/// Whether a line of code has a literal that is the name, or begins with the name as the table of a key.
fn says(line: &str, name: &str) -> bool {
    let opened = format!("\"{name}");
    line.match_indices(&opened).any(|(at, _)| {
        let after = line[at + opened.len()..].chars().next();
        !line[..at].ends_with('\\') && after.is_some_and(|after| after == '"' || after == '.')
    })
}

#[test]
fn no_physics_is_named_outside_its_folder() {
    assert!(says("x(\"heat\")", "heat") && says("\"heat.phi\"", "heat"));
    assert!(!says("\"heating\"", "heat") && !says("say(\"\\\"heat\\\"\")", "heat"));
    let src = root().join(PHYSICS);
    let entries = std::fs::read_dir(&src).unwrap().map(|entry| entry.unwrap().path()).filter(|path| path.is_dir());
    let names: BTreeSet<String> = entries
        .map(|path| path.file_name().unwrap().to_string_lossy().into_owned())
        .filter(|name| name != "common")
        .collect();
    let mut found = BTreeSet::new();
    for folder in ORDER.into_iter().chain([BESIDE]) {
        for file in files(&root().join(folder).join("src"), &[".rs"]) {
            let own = module(&src, &file).first().cloned().filter(|_| file.starts_with(&src));
            let code = code(&file);
            let lines = code.lines().filter(|line| !line.trim_start().starts_with("//"));
            let mut named = lines.flat_map(|line| names.iter().filter(move |name| says(line, name)));
            if named.any(|name| Some(name) != own.as_ref()) {
                found.insert(shown(&file));
            }
        }
    }
    let exempt: BTreeSet<String> = NAMES_ALLOWED.iter().map(|(file, _)| (*file).to_owned()).collect();
    // One that names none any more goes from the lists, too.
    assert_eq!(found, exempt);
}

#[test]
fn the_rooms_of_the_particles_stand_upon_one_another() {
    let src = root().join(PHYSICS);
    let folder = src.join("particles");
    let head = std::fs::read_to_string(folder.join("mod.rs")).unwrap();
    // Lines such as "//! 1. `settings`: …".
    let room = |line: &str| {
        let (number, rest) = line.strip_prefix("//! ")?.split_once(". `")?;
        number.parse::<u32>().ok()?;
        Some(rest.split_once('`')?.0.to_owned())
    };
    let order: Vec<String> = head.lines().filter_map(room).collect();
    let mut there: Vec<String> = std::fs::read_dir(&folder)
        .unwrap()
        .map(|entry| entry.unwrap().path().file_stem().unwrap().to_string_lossy().into_owned())
        .filter(|name| name != "mod")
        .collect();
    there.sort();
    let mut listed = order.clone();
    listed.sort();
    assert_eq!(listed, there, "the head of particles/mod.rs lists other rooms than there are");
    for file in files(&folder, &[".rs"]) {
        let [_, own, ..] = &module(&src, &file)[..] else { continue };
        let place = order.iter().position(|room| room == own).unwrap();
        for path in named(&src, &file).iter().filter(|path| path[0] == "particles") {
            let taken = path.get(1).map_or("", String::as_str);
            let below = order[..=place].iter().any(|room| room == taken);
            assert!(below, "{} takes {}, which is not below {own}", shown(&file), path.join("::"));
        }
    }
}

#[test]
fn no_files_of_the_particles_go_in_a_circle() {
    let src = root().join(PHYSICS);
    let files: BTreeMap<Vec<String>, _> =
        files(&src.join("particles"), &[".rs"]).into_iter().map(|file| (module(&src, &file), file)).collect();
    // The files that each file takes from: those of the longest module its paths begin with.
    let mut takes: BTreeMap<&Vec<String>, BTreeSet<&Vec<String>>> = BTreeMap::new();
    for (module, file) in &files {
        let paths = named(&src, file);
        let of = paths.iter().filter_map(|path| {
            (1..=path.len()).rev().find_map(|length| files.get_key_value(&path[..length])).map(|(module, _)| module)
        });
        takes.insert(module, of.filter(|taken| *taken != module).collect());
    }
    // Those that take from none are taken away again and again; a circle stays.
    loop {
        let done: Vec<&Vec<String>> =
            takes.iter().filter(|(_, from)| from.is_empty()).map(|(module, _)| *module).collect();
        if done.is_empty() {
            break;
        }
        takes.retain(|module, _| !done.contains(module));
        for from in takes.values_mut() {
            from.retain(|module| !done.contains(module));
        }
    }
    assert!(takes.is_empty(), "in a circle, or above one: {:?}", takes.keys());
}
