//! `stagger export`: the accepted states of a recording as files that ParaView reads.

use std::{
    fs::{self, File},
    io::BufWriter,
    path::{Path, PathBuf},
};

use stagger_recordings::{
    Recording, RecordingError, Step, Steps,
    vtp::{self, VtpError},
};

/// Why a recording is not exported.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// The recording cannot be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// A file or folder cannot be made.
    #[error("cannot write {}: {source}", path.display())]
    Io {
        /// Its path.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A state cannot be written.
    #[error("{}: {source}", path.display())]
    State {
        /// The file it should have gone to.
        path: PathBuf,
        /// What is wrong.
        source: VtpError,
    },
}

/// What was exported.
#[derive(Clone, Debug, PartialEq)]
pub struct Exported {
    /// States written.
    pub states: usize,
    /// The series of particles, to be opened in ParaView.
    pub particles: PathBuf,
    /// The series of contacts, where it was asked for.
    pub contacts: Option<PathBuf>,
    /// Whether the recording reaches the end of its run.
    pub complete: bool,
}

/// Writes the start, every n-th accepted step and the last state of a recording into a folder, which is made.
///
/// # Errors
/// The recording cannot be read or has no particles; a file cannot be written.
pub fn export(recording: &Recording, folder: &Path, every: u64, contacts: bool) -> Result<Exported, ExportError> {
    fs::create_dir_all(folder).map_err(|source| ExportError::Io { path: folder.into(), source })?;
    let mut particles =
        Series { folder, name: "particles", write: |step, file| vtp::particles(step, file), files: Vec::new() };
    let mut lines =
        Series { folder, name: "contacts", write: |step, file| vtp::contacts(step, file), files: Vec::new() };
    let mut put = |step: &Step| {
        particles.put(step)?;
        if contacts { lines.put(step) } else { Ok(()) }
    };
    let mut steps = Steps::default();
    // The last state is written whatever its number.
    let mut last = None;
    let mut messages = recording.messages()?;
    for message in messages.by_ref() {
        let Some(step) = steps.take(message?).step.filter(|step| step.recorded) else { continue };
        last = None;
        if step.version.step.is_multiple_of(every) {
            put(&step)?;
        } else {
            last = Some(step);
        }
    }
    if let Some(step) = steps.end().or(last) {
        put(&step)?;
    }
    let states = particles.files.len();
    let particles = particles.finish()?;
    let contacts = contacts.then(|| lines.finish()).transpose()?;
    Ok(Exported { states, particles, contacts, complete: messages.complete() })
}

/// Files of one kind, by time.
struct Series<'f> {
    folder: &'f Path,
    name: &'static str,
    write: fn(&Step, BufWriter<File>) -> Result<(), VtpError>,
    files: Vec<(f64, String)>,
}

impl Series<'_> {
    fn put(&mut self, step: &Step) -> Result<(), ExportError> {
        let name = format!("{}-{:06}.vtp", self.name, step.version.step);
        let path = self.folder.join(&name);
        let file = File::create(&path).map_err(|source| ExportError::Io { path: path.clone(), source })?;
        (self.write)(step, BufWriter::new(file)).map_err(|source| ExportError::State { path, source })?;
        // The last state comes again where fields of it came late.
        if self.files.last().is_none_or(|(_, last)| *last != name) {
            self.files.push((step.t_s, name));
        }
        Ok(())
    }

    fn finish(self) -> Result<PathBuf, ExportError> {
        let path = self.folder.join(format!("{}.pvd", self.name));
        fs::write(&path, vtp::series(&self.files)).map_err(|source| ExportError::Io { path: path.clone(), source })?;
        Ok(path)
    }
}
