//! Commands that make other files of a recording.

use std::path::{Path, PathBuf};

use stagger_recordings::Recording;

use super::{End, FAILED, MISSING, about, arguments::ExportArguments, print};
use crate::{
    export::{self, Reading},
    report, view,
};

/// Writes a page about a recording.
pub(super) fn report(file: &Path, out: Option<PathBuf>) -> End {
    let out = out.unwrap_or_else(|| PathBuf::from(file.file_stem().unwrap_or_default()).with_extension("html"));
    let reported = Recording::open(file).map_err(Into::into).and_then(|recording| report::report(&recording, &out));
    match reported {
        Ok(reported) => {
            print(&format!("wrote {} ({} kB)", out.display(), reported.bytes.div_ceil(1000)));
            if reported.complete {
                End::Done
            } else {
                End::Code(
                    MISSING,
                    format!("{} is cut off or damaged; the page shows what could be read", file.display()),
                )
            }
        }
        Err(error) => about(file, &error),
    }
}

/// Writes a recording in the formats asked for.
pub(super) fn export(arguments: &ExportArguments) -> End {
    let ExportArguments { file, out, .. } = arguments;
    let recording = match Recording::open(file) {
        Ok(recording) => recording,
        Err(error) => return about(file, &error),
    };
    let mut readings = Vec::new();
    if arguments.vtp || !(arguments.csv || arguments.arrow) {
        match export::paraview(&recording, out, arguments.every, arguments.contacts) {
            Ok(done) => {
                let contacts = done.contacts.map_or(String::new(), |path| format!(" and {}", path.display()));
                print(&format!("{} states: open {}{contacts} in ParaView", done.states, done.particles.display()));
                readings.push(done.reading);
            }
            Err(error) => return about(file, &error),
        }
    }
    if arguments.csv {
        match export::scalars(&recording, out) {
            Ok(done) => {
                print(&format!("{} rows in {}", done.rows, done.path.display()));
                readings.push(done.reading);
            }
            Err(error) => return about(file, &error),
        }
    }
    if arguments.arrow
        && let Some(end) = arrow(arguments)
    {
        return end;
    }
    match readings.into_iter().find(|reading| !reading.complete) {
        None => End::Done,
        Some(Reading { problem: Some(problem), .. }) => End::Code(MISSING, format!("{}: {problem}", file.display())),
        Some(_) => End::Code(MISSING, format!("{} is cut off", file.display())),
    }
}

/// Has the bridge write Arrow files: it is built with the heavy crates. `None` where all went well.
fn arrow(arguments: &ExportArguments) -> Option<End> {
    let Some(bridge) = view::bridge() else { return Some(End::Code(FAILED, view::HOW_TO_GET.into())) };
    let options =
        ["--arrow".into(), arguments.out.display().to_string(), "--every".into(), arguments.every.to_string()];
    // It says itself what went wrong, and ends with the codes of this program.
    match view::file(&bridge, &arguments.file.display().to_string(), &options) {
        Ok(status) if status.success() => None,
        Ok(status) => Some(End::Silent(status.code().and_then(|code| code.try_into().ok()).unwrap_or(FAILED))),
        Err(error) => Some(End::Code(FAILED, format!("cannot start {}: {error}", bridge.display()))),
    }
}
