//! `stagger export`: the accepted states of a recording as files of other programs.

mod scalars;

use std::{
    fs::{self, File},
    io::BufWriter,
    path::{Path, PathBuf},
};

pub(crate) use scalars::quoted;
use stagger_recordings::{
    Recording, RecordingError, State, States, Step,
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

/// What was exported for ParaView.
#[derive(Clone, Debug, PartialEq)]
pub struct Exported {
    /// States written.
    pub states: usize,
    /// The series of particles, to be opened in ParaView.
    pub particles: PathBuf,
    /// The series of contacts, where it was asked for.
    pub contacts: Option<PathBuf>,
    /// How far the recording could be read.
    pub reading: Reading,
}

/// What was exported as a table of scalars.
#[derive(Clone, Debug, PartialEq)]
pub struct Scalars {
    /// Rows: the start and each accepted step.
    pub rows: usize,
    /// The table.
    pub path: PathBuf,
    /// How far the recording could be read.
    pub reading: Reading,
}

/// How far a recording could be read.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Reading {
    /// Whether it reaches the end of its run.
    pub complete: bool,
    /// The first thing in it that cannot be read, in words.
    pub problem: Option<String>,
}

/// Writes the start, every n-th accepted step and the last state of a recording into a folder, which is made, as series of
/// VTK files.
///
/// # Errors
/// The recording cannot be read or has no particles; a file cannot be written.
pub fn paraview(recording: &Recording, folder: &Path, every: u64, contacts: bool) -> Result<Exported, ExportError> {
    make(folder)?;
    let mut particles =
        Series { folder, name: "particles", write: |step, file| vtp::particles(step, file), files: Vec::new() };
    let mut lines =
        Series { folder, name: "contacts", write: |step, file| vtp::contacts(step, file), files: Vec::new() };
    let mut put = |step: &Step| {
        particles.put(step)?;
        if contacts { lines.put(step) } else { Ok(()) }
    };
    // The last state is written whatever its number.
    let mut last = None;
    let reading = read(recording, |State { step, .. }| {
        if !step.recorded {
            return Ok(());
        }
        last = None;
        if step.version.step.is_multiple_of(every) {
            put(&step)?;
        } else {
            last = Some(step);
        }
        Ok(())
    })?;
    last.as_ref().map(put).transpose()?;
    let states = particles.files.len();
    let particles = particles.finish()?;
    let contacts = contacts.then(|| lines.finish()).transpose()?;
    Ok(Exported { states, particles, contacts, reading })
}

/// Writes the scalars of a recording into `scalars.csv` in a folder, which is made.
///
/// # Errors
/// The recording cannot be opened again, or the file not be written.
pub fn scalars(recording: &Recording, folder: &Path) -> Result<Scalars, ExportError> {
    make(folder)?;
    let path = folder.join("scalars.csv");
    let (rows, reading) = scalars::write(recording, &path)?;
    Ok(Scalars { rows, path, reading })
}

fn make(folder: &Path) -> Result<(), ExportError> {
    fs::create_dir_all(folder).map_err(|source| ExportError::Io { path: folder.into(), source })
}

/// Hands every accepted state of a recording over, as far as it can be read.
fn read(recording: &Recording, mut put: impl FnMut(State) -> Result<(), ExportError>) -> Result<Reading, ExportError> {
    let mut states = States::default();
    let mut problem = None;
    let mut messages = recording.messages()?;
    for message in messages.by_ref() {
        match message {
            Ok(message) => states.take(message).state.map(&mut put).transpose()?,
            Err(error) => {
                problem.get_or_insert_with(|| error.to_string());
                None
            }
        };
    }
    states.end().map(put).transpose()?;
    Ok(Reading { complete: messages.complete() && problem.is_none(), problem })
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
        self.files.push((step.t_s, name));
        Ok(())
    }

    fn finish(self) -> Result<PathBuf, ExportError> {
        let path = self.folder.join(format!("{}.pvd", self.name));
        fs::write(&path, vtp::series(&self.files)).map_err(|source| ExportError::Io { path: path.clone(), source })?;
        Ok(path)
    }
}
