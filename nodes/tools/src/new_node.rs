//! `stagger new-node`: a crate to begin a node of one's own with.

use std::path::{Path, PathBuf};

/// The example the crate begins as, the same text that the tests run.
const EXAMPLE: &str = include_str!("../../runtime/examples/probe.rs");

/// Why the crate was not written.
#[derive(Debug, thiserror::Error)]
pub enum NewNodeError {
    /// A name that is none for a crate.
    #[error("`{0}` cannot name a node: expected a letter, then letters, digits, `-` and `_`")]
    Name(String),
    /// Something of that name is there.
    #[error("{} is there already: choose another name, or remove it", .0.display())]
    Exists(PathBuf),
    /// The folder of stagger's sources is none.
    #[error("{} does not hold the sources of stagger: give their folder with --stagger", .0.display())]
    Sources(PathBuf),
    /// A file or folder cannot be written.
    #[error("cannot write {}: {source}", .path.display())]
    Write {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
}

/// The folder of stagger's sources this program was built from.
#[must_use]
pub fn sources() -> PathBuf {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR"));
    // This crate lies two folders below them.
    manifest.ancestors().nth(2).unwrap_or(manifest).to_owned()
}

/// Writes the crate `name` into a new folder of that name in `parent`; `stagger` is the folder of stagger's sources.
///
/// # Errors
/// The name is not legal, something of that name is there, or a file cannot be written.
pub fn write(parent: &Path, name: &str, stagger: &Path) -> Result<PathBuf, NewNodeError> {
    let legal = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if !name.starts_with(|c: char| c.is_ascii_alphabetic()) || !name.chars().all(legal) {
        return Err(NewNodeError::Name(name.into()));
    }
    let no_sources = || NewNodeError::Sources(stagger.into());
    if !stagger.join("nodes/runtime/Cargo.toml").is_file() {
        return Err(no_sources());
    }
    let stagger = stagger.canonicalize().map_err(|_| no_sources())?;
    let folder = parent.join(name);
    let failed = |path: &Path| {
        let path = path.to_owned();
        move |source| NewNodeError::Write { path, source }
    };
    match std::fs::create_dir(&folder) {
        Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => return Err(NewNodeError::Exists(folder)),
        made => made.map_err(failed(&folder))?,
    }
    let source = folder.join("src");
    std::fs::create_dir(&source).map_err(failed(&source))?;
    for (path, text) in [
        (folder.join("Cargo.toml"), manifest(name, &stagger)),
        (source.join("main.rs"), EXAMPLE.replace("\"probe\"", &format!("{name:?}"))),
        (folder.join("README.md"), readme(name, &stagger)),
        (folder.join(".gitignore"), "/target\n".into()),
    ] {
        std::fs::write(&path, text).map_err(failed(&path))?;
    }
    Ok(folder)
}

fn manifest(name: &str, stagger: &Path) -> String {
    // A JSON string is a TOML string.
    let path = |part: &str| serde_json::json!(stagger.join(part).display().to_string());
    let (messages, coupling, runtime) = (path("messages"), path("solver/coupling"), path("nodes/runtime"));
    format!(
        r#"[package]
name = "{name}"
version = "0.1.0"
edition = "2024"
publish = false

[dependencies]
serde = {{ version = "1", features = ["derive"] }}
stagger-coupling = {{ path = {coupling} }}
stagger-messages = {{ path = {messages} }}
stagger-runtime = {{ path = {runtime} }}

# A crate of its own, whatever workspace lies above it.
[workspace]
"#
    )
}

fn readme(name: &str, stagger: &Path) -> String {
    let scene = stagger.join("scenes/quick.toml");
    let scene = scene.display();
    format!(
        r#"# {name}

A node for stagger. It begins as the probe of its examples: `src/main.rs` is all there is to change.

    cargo build --release

Run a scene with it, and check that it keeps the protocol:

    stagger run {scene} --node {name}=target/release/{name}
    stagger conformance --node {name} -- target/release/{name}

In a scene of your own it is

    [nodes.{name}]
    command = ["target/release/{name}"]
"#
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_crate_is_the_example_under_another_name_and_names_what_it_needs() {
        let place = tempfile::tempdir().unwrap();
        let folder = write(place.path(), "strain-gauge", &sources()).unwrap();
        let main = std::fs::read_to_string(folder.join("src/main.rs")).unwrap();
        assert!(main.contains("\"mean_height\", \"m\", \"strain-gauge\""));
        assert_eq!(main.replace("\"strain-gauge\"", "\"probe\""), EXAMPLE);
        let manifest: toml::Table = std::fs::read_to_string(folder.join("Cargo.toml")).unwrap().parse().unwrap();
        assert_eq!(manifest["package"]["name"].as_str(), Some("strain-gauge"));
        // Every crate the source imports is there, and each path is one.
        let dependencies = manifest["dependencies"].as_table().unwrap();
        for line in main.lines().filter_map(|line| line.strip_prefix("use ")) {
            let krate = line.split([':', ';']).next().unwrap().replace('_', "-");
            assert!(krate == "std" || dependencies.contains_key(&krate), "{krate}");
        }
        for dependency in dependencies.values().filter_map(|value| value.get("path")) {
            assert!(Path::new(dependency.as_str().unwrap()).join("Cargo.toml").is_file(), "{dependency}");
        }
        let readme = std::fs::read_to_string(folder.join("README.md")).unwrap();
        assert!(readme.contains("--node strain-gauge=target/release/strain-gauge"));
    }

    #[test]
    fn nothing_is_overwritten_and_bad_names_are_refused() {
        let place = tempfile::tempdir().unwrap();
        std::fs::create_dir(place.path().join("mine")).unwrap();
        assert!(matches!(write(place.path(), "mine", &sources()), Err(NewNodeError::Exists(_))));
        assert_eq!(std::fs::read_dir(place.path().join("mine")).unwrap().count(), 0);
        for name in ["", "1st", "a b", "../up", "a/b"] {
            assert!(matches!(write(place.path(), name, &sources()), Err(NewNodeError::Name(_))), "{name}");
        }
        assert!(matches!(write(place.path(), "other", place.path()), Err(NewNodeError::Sources(_))));
    }
}
