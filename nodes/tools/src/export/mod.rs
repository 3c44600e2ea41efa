//! `stagger export`: the accepted states of a recording as files of other programs.

mod scalars;

use stagger_runtime::run::outputs::{self, Inputs, Output, OutputError, Replace};
use std::{
    fs,
    io::BufWriter,
    path::{Path, PathBuf},
};

pub(crate) use scalars::quoted;
use stagger_recordings::{
    Recording, RecordingError, State, States, Step,
    export::vtp::{self, VtpError},
};

/// What tables of scalars begin with.
const TABLE: &str = scalars::HEAD;

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
    /// A file may not be replaced, or cannot be made.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// A state cannot be written.
    #[error("{}: {source}", path.display())]
    State {
        /// The file it should have gone to.
        path: PathBuf,
        /// What is wrong.
        source: VtpError,
    },
}

/// Where a recording is exported to.
#[derive(Clone, Debug)]
pub struct Folder<'f> {
    /// The folder, which is made.
    pub path: &'f Path,
    /// Whether files that no earlier export has written may be replaced.
    pub overwrite: bool,
    /// What may not.
    pub inputs: Inputs,
}

impl Folder<'_> {
    /// Whether a file may be written, in the place of what begins like `own`.
    ///
    /// # Errors
    /// It may not.
    pub fn allows(&self, path: &Path, own: &'static str) -> Result<(), OutputError> {
        self.inputs.spare(path)?;
        Replace::own(own, self.overwrite).allows(path)
    }

    fn create(&self, path: &Path, own: &'static str) -> Result<Output, OutputError> {
        self.inputs.spare(path)?;
        Output::create(path, Replace::own(own, self.overwrite))
    }

    fn make(&self) -> Result<(), ExportError> {
        fs::create_dir_all(self.path).map_err(|source| ExportError::Io { path: self.path.into(), source })?;
        outputs::sweep(&self.path.join(TABLE));
        Ok(())
    }
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
pub fn paraview(
    recording: &Recording,
    folder: &Folder<'_>,
    every: u64,
    contacts: bool,
) -> Result<Exported, ExportError> {
    folder.make()?;
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
pub fn scalars(recording: &Recording, folder: &Folder<'_>) -> Result<Scalars, ExportError> {
    folder.make()?;
    let path = folder.path.join("scalars.csv");
    let output = folder.create(&path, TABLE)?;
    let (rows, reading) = scalars::write(recording, &path, output)?;
    Ok(Scalars { rows, path, reading })
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
    folder: &'f Folder<'f>,
    name: &'static str,
    write: fn(&Step, BufWriter<&mut Output>) -> Result<(), VtpError>,
    files: Vec<(f64, String)>,
}

impl Series<'_> {
    fn put(&mut self, step: &Step) -> Result<(), ExportError> {
        let name = format!("{}-{:06}.vtp", self.name, step.version.step);
        let path = self.folder.path.join(&name);
        let mut file = self.folder.create(&path, vtp::BEGIN)?;
        (self.write)(step, BufWriter::new(&mut file)).map_err(|source| ExportError::State { path, source })?;
        file.place()?;
        self.files.push((step.t_s, name));
        Ok(())
    }

    fn finish(self) -> Result<PathBuf, ExportError> {
        let path = self.folder.path.join(format!("{}.pvd", self.name));
        let mut file = self.folder.create(&path, vtp::SERIES_BEGIN)?;
        let written = std::io::Write::write_all(&mut file, vtp::series(&self.files).as_bytes());
        written.map_err(|source| ExportError::Io { path: path.clone(), source })?;
        file.place()?;
        Ok(path)
    }
}
