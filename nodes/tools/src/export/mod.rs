//! `stagger export`: the accepted states of a recording as files of other programs.

mod scalars;

use stagger_runtime::run::outputs::{self, Inputs, Output, OutputError, Replace};
use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    io::BufWriter,
    path::{Path, PathBuf},
};

use stagger_messages::geometry::Shape;
use stagger_recordings::{
    Recording, RecordingError, State, States, Step,
    export::{VtkError, vti, vtp, vtr},
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
        source: VtkError,
    },
    /// There is nothing that ParaView could show.
    #[error(
        "the recording holds nothing with a place, neither points nor a grid: its numbers go into a table with --csv"
    )]
    NoPlace,
    /// Pairs are asked for, and there are none.
    #[error("the recording holds no pairs of points, such as contacts between particles: leave --contacts out")]
    NoPairs,
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
    /// The series to be opened in ParaView: one for each support with a place, by its name.
    pub series: Vec<PathBuf>,
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
/// VTK files: points and paths as PolyData, grids as ImageData, and with `contacts` pairs of points as lines.
///
/// # Errors
/// The recording cannot be read or has nothing with a place; a file cannot be written.
pub fn paraview(
    recording: &Recording,
    folder: &Folder<'_>,
    every: u64,
    contacts: bool,
) -> Result<Exported, ExportError> {
    folder.make()?;
    let mut all = AllSeries { folder, pairs: contacts, series: BTreeMap::new(), files: BTreeSet::new() };
    let mut states = 0;
    let mut put = |step: &Step| {
        states += 1;
        all.put(step)
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
    if states > 0 && all.series.values().all(|series| series.is_pairs) {
        return Err(ExportError::NoPlace);
    }
    if states > 0 && contacts && !all.series.values().any(|series| series.is_pairs) {
        return Err(ExportError::NoPairs);
    }
    let series = all.series.into_values().map(|series| series.finish(folder)).collect::<Result<_, _>>()?;
    Ok(Exported { states, series, reading })
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

/// A series for each support with a place.
struct AllSeries<'f> {
    folder: &'f Folder<'f>,
    /// Whether pairs are written.
    pairs: bool,
    /// By the name of the support.
    series: BTreeMap<String, Series>,
    /// What the files are called so far.
    files: BTreeSet<String>,
}

impl AllSeries<'_> {
    fn put(&mut self, step: &Step) -> Result<(), ExportError> {
        for (support, shape) in step.supports.shapes(&step.fields) {
            let written = match &shape {
                Shape::Points(points) => points.places(&step.fields).is_ok(),
                Shape::Pairs(pairs) => self.pairs && vtp::has_lines(step, pairs),
                Shape::Grid(_) => true,
                Shape::Global(_) => false,
            };
            if written {
                let files = &mut self.files;
                let is_pairs = matches!(shape, Shape::Pairs(_));
                let new = || Series { name: file_name(&support, files), is_pairs, files: Vec::new() };
                self.series.entry(support.clone()).or_insert_with(new).put(self.folder, step, &support, &shape)?;
            }
        }
        Ok(())
    }
}

/// What the files of a support are called: nodes name their supports, and a name is no path.
fn file_name(support: &str, taken: &mut BTreeSet<String>) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() || c == '-' || c == '_' { c } else { '_' };
    let mut name: String = support.chars().take(LONGEST_NAME).map(plain).collect();
    while !taken.insert(name.clone()) {
        name.push('_');
    }
    name
}

/// Characters of a support's name that are part of a file's name.
const LONGEST_NAME: usize = 60;

/// Files of one support, by time.
struct Series {
    name: String,
    is_pairs: bool,
    files: Vec<(f64, String)>,
}

impl Series {
    fn put(&mut self, folder: &Folder<'_>, step: &Step, support: &str, shape: &Shape) -> Result<(), ExportError> {
        let (extension, begin) = match shape {
            Shape::Grid(grid) if grid.is_graded() => ("vtr", vtr::BEGIN),
            Shape::Grid(_) => ("vti", vti::BEGIN),
            _ => ("vtp", vtp::BEGIN),
        };
        let name = format!("{}-{:06}.{extension}", self.name, step.version.step);
        let path = folder.path.join(&name);
        let mut file = folder.create(&path, begin)?;
        let output = BufWriter::new(&mut file);
        let written = match shape {
            Shape::Points(points) => vtp::points(step, points, output),
            Shape::Pairs(pairs) => vtp::pairs(step, pairs, output),
            Shape::Grid(grid) if grid.is_graded() => vtr::grid(step, support, grid, output),
            Shape::Grid(grid) => vti::grid(step, support, grid, output),
            Shape::Global(_) => {
                drop(output);
                Ok(())
            }
        };
        written.map_err(|source| ExportError::State { path, source })?;
        file.place()?;
        self.files.push((step.t_s, name));
        Ok(())
    }

    fn finish(self, folder: &Folder<'_>) -> Result<PathBuf, ExportError> {
        let path = folder.path.join(format!("{}.pvd", self.name));
        let mut file = folder.create(&path, vtp::SERIES_BEGIN)?;
        let written = std::io::Write::write_all(&mut file, vtp::series(&self.files).as_bytes());
        written.map_err(|source| ExportError::Io { path: path.clone(), source })?;
        file.place()?;
        Ok(path)
    }
}
