//! Commands that make other files of a recording.

use std::path::{Path, PathBuf};

use stagger_recordings::Recording;
use stagger_runtime::run::{
    outputs::{Inputs, Replace},
    view,
};
use stagger_tools::{
    export::{self, ExportError, Folder, Reading},
    report,
};

use super::{End, FAILED, MISSING, USAGE, about, arguments::ExportArguments, print};

/// What Arrow's files begin with.
const ARROW: &str = "ARROW1";

/// Writes a page about a recording.
pub(super) fn report(file: &Path, out: Option<PathBuf>, overwrite: bool) -> End {
    let out = out.unwrap_or_else(|| PathBuf::from(file.file_stem().unwrap_or_default()).with_extension("html"));
    let replace = Replace::own(report::BEGIN, overwrite);
    let inputs = Inputs::new().with("the recording", file);
    if let Err(error) = inputs.spare(&out).and_then(|()| replace.allows(&out)) {
        return End::Code(USAGE, error.to_string());
    }
    let recording = match Recording::open(file) {
        Ok(recording) => recording,
        Err(error) => return about(file, &error),
    };
    match report::report(&recording, &out, replace) {
        Ok(reported) => {
            print(&format!("wrote {} ({} kB)", out.display(), reported.bytes.div_ceil(1000)));
            if reported.complete {
                End::Done
            } else {
                let how = if recording.being_written { recording.shortfall() } else { "is cut off or damaged" };
                End::Code(MISSING, format!("{} {how}; the page shows what could be read", file.display()))
            }
        }
        Err(error) => about(file, &error),
    }
}

/// Writes a recording in the formats asked for.
pub(super) fn export(arguments: &ExportArguments) -> End {
    let ExportArguments { file, out, overwrite, .. } = arguments;
    let recording = match Recording::open(file) {
        Ok(recording) => recording,
        Err(error) => return about(file, &error),
    };
    let folder = Folder { path: out, overwrite: *overwrite, inputs: Inputs::new().with("the recording", file) };
    let mut readings = Vec::new();
    if arguments.vtp || !(arguments.csv || arguments.arrow) {
        match export::paraview(&recording, &folder, arguments.every, arguments.contacts) {
            Ok(done) => {
                let series: Vec<_> = done.series.iter().map(|path| path.display().to_string()).collect();
                print(&format!("{} states: open {} in ParaView", done.states, series.join(", ")));
                readings.push(done.reading);
            }
            Err(error) => return not_exported(file, &error),
        }
    }
    if arguments.csv {
        match export::scalars(&recording, &folder) {
            Ok(done) => {
                print(&format!("{} rows in {}", done.rows, done.path.display()));
                readings.push(done.reading);
            }
            Err(error) => return not_exported(file, &error),
        }
    }
    if arguments.arrow
        && let Some(end) = arrow(arguments, &folder)
    {
        return end;
    }
    match readings.into_iter().find(|reading| !reading.complete) {
        None => End::Done,
        Some(Reading { problem: Some(problem), .. }) => End::Code(MISSING, format!("{}: {problem}", file.display())),
        Some(_) => End::Code(MISSING, format!("{} {}", file.display(), recording.shortfall())),
    }
}

fn not_exported(file: &Path, error: &ExportError) -> End {
    match error {
        ExportError::Output(error) if error.is_refusal() => End::Code(USAGE, error.to_string()),
        error => about(file, error),
    }
}

/// Has the bridge write Arrow files: it is built with the heavy crates. `None` where all went well.
fn arrow(arguments: &ExportArguments, folder: &Folder<'_>) -> Option<End> {
    // The bridge names them by their supports: none of those there may be anything else than such a file.
    for there in std::fs::read_dir(&arguments.out).into_iter().flatten().filter_map(Result::ok) {
        let path = there.path();
        if path.extension().is_some_and(|extension| extension == "arrow")
            && let Err(error) = folder.allows(&path, ARROW)
        {
            return Some(End::Code(USAGE, error.to_string()));
        }
    }
    let Some(bridge) = view::bridge() else { return Some(End::Code(FAILED, view::HOW_TO_GET.into())) };
    let options =
        ["--arrow".into(), arguments.out.clone().into(), "--every".into(), arguments.every.to_string().into()];
    // It says itself what went wrong, and ends with the codes of this program.
    match view::file(&bridge, &arguments.file.display().to_string(), &options) {
        Ok(status) if status.success() => None,
        Ok(status) => Some(End::Silent(status.code().and_then(|code| code.try_into().ok()).unwrap_or(FAILED))),
        Err(error) => Some(End::Code(FAILED, format!("cannot start {}: {error}", bridge.display()))),
    }
}
