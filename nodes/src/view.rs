//! `stagger view`: hands a recording or a live run to the Rerun bridge, which is a program of its own.

use std::{
    path::{Path, PathBuf},
    process::Command,
};

/// How to get the bridge, in one line.
pub const HOW_TO_GET: &str = "the viewer bridge `stagger-view` is not built yet (it takes some minutes, once): \
     cargo build --release --manifest-path recordings/view/Cargo.toml";

/// The bridge: beside this program, in the workspace it was built in, or on the PATH.
#[must_use]
pub fn bridge() -> Option<PathBuf> {
    let own = std::env::current_exe().ok();
    let folder = own.as_deref().and_then(Path::parent);
    let beside = folder.map(|folder| folder.join("stagger-view"));
    let workspace = folder
        .and_then(|folder| folder.ancestors().find(|at| at.join("recordings/view/Cargo.toml").is_file()))
        .map(|root| root.join("recordings/view/target/release/stagger-view"));
    let paths = std::env::var_os("PATH").unwrap_or_default();
    let on_path = std::env::split_paths(&paths).map(|folder| folder.join("stagger-view"));
    beside.into_iter().chain(workspace).chain(on_path).find(|path| path.is_file())
}

/// The command that shows `input`: a file, or `-` for a stream.
#[must_use]
pub fn command(bridge: &Path, input: &str, arguments: &[String]) -> Command {
    let mut command = Command::new(bridge);
    command.arg(input).args(arguments);
    command
}
