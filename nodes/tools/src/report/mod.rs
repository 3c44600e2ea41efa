//! `stagger report`: a recording as one page that needs nothing beside itself.

mod convergence;
mod energy;
mod fields;
mod gathered;
pub(crate) mod html;
mod page;
mod pictures;
pub mod plot;
mod snapshots;

use stagger_runtime::run::outputs::{self, OutputError, Replace};
use std::path::Path;

use stagger_recordings::{Recording, RecordingError};

use gathered::Gathered;
pub use html::BEGIN;

/// Why there is no report.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// The recording cannot be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The page cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
}

/// What was reported.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Reported {
    /// Size of the page, in bytes.
    pub bytes: usize,
    /// False where the recording is cut off or damaged, and the page shows what could be read.
    pub complete: bool,
}

/// Reads a recording once and writes a page about it, in the place of what it may replace.
///
/// # Errors
/// The recording cannot be opened again, or the page not be written.
pub fn report(recording: &Recording, out: &Path, replace: Replace) -> Result<Reported, ReportError> {
    let gathered = Gathered::from(recording)?;
    // A scene of an older program may not be valid here; the page then has the file's name.
    let title = recording.info.scene().map(|scene| scene.title).unwrap_or_default();
    let title = if title.is_empty() { &recording.info.scene_file } else { &title };
    let page = page::page(&gathered, title);
    outputs::sweep(out);
    outputs::write(out, replace, page.as_bytes())?;
    Ok(Reported { bytes: page.len(), complete: gathered.complete })
}
