//! Fields as Arrow files, one for each support: the only file that knows `arrow`.
//!
//! It stands here because the viewer brings the crate along anyway; the program itself is built without it.

use std::{
    collections::BTreeMap,
    fs::{self, File},
    io::{self, BufWriter},
    path::{Path, PathBuf},
    sync::Arc,
};

use arrow::{
    array::{ArrayRef, Float64Array, RecordBatch, UInt8Array, UInt32Array, UInt64Array, new_null_array},
    datatypes::{DataType, Field as ArrowField, Schema},
    error::ArrowError,
    ipc::writer::FileWriter,
};
use stagger_messages::{Field, ValueKind};
use stagger_recordings::{Recording, RecordingError, RunInfo, State, States, Step};

/// Why fields are not written.
#[derive(Debug, thiserror::Error)]
pub enum ArrowFilesError {
    /// The recording cannot be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// A file or folder cannot be made.
    #[error("cannot write {}: {source}", path.display())]
    Io {
        /// Its path.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// A file cannot be written.
    #[error("{}: {source}", path.display())]
    Arrow {
        /// Its path.
        path: PathBuf,
        /// What is wrong.
        source: ArrowError,
    },
}

/// What was written.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Written {
    /// Each file with its rows, over all states.
    pub files: Vec<(PathBuf, u64)>,
    /// Whether the recording was read to the end of its run.
    pub complete: bool,
    /// The first thing in it that cannot be read, in words.
    pub problem: Option<String>,
}

/// A field as columns, one for each component.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Column {
    unit: String,
    components: usize,
    kind: ValueKind,
}

/// Columns of the files by support, and by field.
type Supports = BTreeMap<String, BTreeMap<String, Column>>;

/// Writes the start, every n-th accepted step and the last state of a recording into a folder, which is made. The recording is
/// read twice: which fields there are is known only at its end.
///
/// # Errors
/// The recording cannot be opened again, or a file not be written.
pub fn write(recording: &Recording, folder: &Path, every: u64) -> Result<Written, ArrowFilesError> {
    fs::create_dir_all(folder).map_err(|source| ArrowFilesError::Io { path: folder.into(), source })?;
    let mut supports = Supports::new();
    read(recording, |step| {
        note(&mut supports, step);
        Ok(())
    })?;
    let mut tables = Vec::new();
    for (support, columns) in supports {
        tables.push(Table::create(folder, support, columns, &recording.info)?);
    }
    let mut put = |step: &Step| tables.iter_mut().try_for_each(|table| table.put(step));
    // The last state is written whatever its number.
    let mut last = None;
    let (complete, problem) = read(recording, |step| {
        last = None;
        if step.version.step.is_multiple_of(every) {
            put(step)
        } else {
            last = Some(step.clone());
            Ok(())
        }
    })?;
    last.as_ref().map(put).transpose()?;
    let mut files = Vec::new();
    for mut table in tables {
        table.finish()?;
        files.push((table.path, table.rows));
    }
    Ok(Written { files, complete, problem })
}

/// Hands every accepted state with fields of its own over, as far as the recording can be read; returns whether that is to
/// the end of its run, and what is wrong first.
fn read(
    recording: &Recording,
    mut put: impl FnMut(&Step) -> Result<(), ArrowFilesError>,
) -> Result<(bool, Option<String>), ArrowFilesError> {
    let mut states = States::default();
    let mut problem = None;
    let mut give = |state: Option<State>| match state {
        Some(State { step, .. }) if step.recorded => put(&step),
        _ => Ok(()),
    };
    let mut messages = recording.messages()?;
    for message in messages.by_ref() {
        match message {
            Ok(message) => give(states.take(message).state)?,
            Err(error) => {
                problem.get_or_insert_with(|| error.to_string());
            }
        }
    }
    give(states.end())?;
    Ok((messages.complete() && problem.is_none(), problem))
}

fn note(supports: &mut Supports, step: &Step) {
    for (name, field) in step.fields.iter().filter(|(_, field)| field.components() > 0) {
        let column =
            Column { unit: field.port.unit.clone(), components: field.components(), kind: field.values().kind() };
        supports.entry(field.support.name.clone()).or_default().entry(name.clone()).or_insert(column);
    }
}

/// A file under way.
struct Table {
    support: String,
    columns: BTreeMap<String, Column>,
    schema: Arc<Schema>,
    writer: FileWriter<BufWriter<File>>,
    path: PathBuf,
    rows: u64,
}

impl Table {
    fn create(
        folder: &Path,
        support: String,
        columns: BTreeMap<String, Column>,
        info: &RunInfo,
    ) -> Result<Self, ArrowFilesError> {
        // A support of a foreign node may be called anything.
        let name: String = support.chars().map(|c| if c.is_alphanumeric() || c == '-' { c } else { '_' }).collect();
        let path = folder.join(format!("{name}.arrow"));
        let with_unit =
            |field: ArrowField, unit: &str| field.with_metadata([("unit".to_owned(), unit.to_owned())].into());
        let mut fields = vec![
            with_unit(ArrowField::new("t_s", DataType::Float64, false), "s"),
            ArrowField::new("step", DataType::UInt64, false),
            ArrowField::new("row", DataType::UInt32, false),
        ];
        for (name, column) in &columns {
            let field =
                |component| ArrowField::new(component_name(name, column, component), data_type(column.kind), true);
            fields.extend((0..column.components).map(|component| with_unit(field(component), &column.unit)));
        }
        let metadata =
            [("run", &info.run), ("scene", &info.scene_file), ("program", &info.program), ("support", &support)];
        let metadata = metadata.map(|(key, value)| (key.to_owned(), value.clone()));
        let schema = Arc::new(Schema::new_with_metadata(fields, metadata.into()));
        let file = File::create(&path).map_err(|source| ArrowFilesError::Io { path: path.clone(), source })?;
        let writer = FileWriter::try_new(BufWriter::new(file), &schema)
            .map_err(|source| ArrowFilesError::Arrow { path: path.clone(), source })?;
        Ok(Self { support, columns, schema, writer, path, rows: 0 })
    }

    /// Writes the rows of one state as a batch.
    fn put(&mut self, step: &Step) -> Result<(), ArrowFilesError> {
        let batch = self.batch(step).map_err(|source| ArrowFilesError::Arrow { path: self.path.clone(), source })?;
        self.rows += batch.num_rows() as u64;
        self.writer.write(&batch).map_err(|source| ArrowFilesError::Arrow { path: self.path.clone(), source })
    }

    fn finish(&mut self) -> Result<(), ArrowFilesError> {
        let finished = self.writer.finish().and_then(|()| self.writer.flush());
        finished.map_err(|source| ArrowFilesError::Arrow { path: self.path.clone(), source })
    }

    fn batch(&self, step: &Step) -> Result<RecordBatch, ArrowError> {
        let of_this = |field: &&Field| field.support.name == self.support;
        // A slower node may have left values on rows that are no more: theirs are unknown.
        let newest =
            step.fields.values().filter(of_this).map(|field| &field.support).max_by_key(|support| support.revision);
        let rows = newest.map_or(0, |support| support.count as usize);
        let mut arrays: Vec<ArrayRef> = vec![
            Arc::new(Float64Array::from(vec![step.t_s; rows])),
            Arc::new(UInt64Array::from(vec![step.version.step; rows])),
            Arc::new(UInt32Array::from_iter_values(0..rows as u32)),
        ];
        for (name, column) in &self.columns {
            let field = step.fields.get(name).filter(|field| Some(&field.support) == newest);
            let field = field.filter(|field| field.components() == column.components);
            for component in 0..column.components {
                let array = field.and_then(|field| array(field, component));
                arrays.push(array.unwrap_or_else(|| new_null_array(&data_type(column.kind), rows)));
            }
        }
        RecordBatch::try_new(Arc::clone(&self.schema), arrays)
    }
}

/// `positions.x`, `contact_pairs.0`, or the field's own name where it has one component.
fn component_name(name: &str, column: &Column, component: usize) -> String {
    match column.components {
        1 => name.into(),
        3 => format!("{name}.{}", ["x", "y", "z"][component]),
        _ => format!("{name}.{component}"),
    }
}

fn data_type(kind: ValueKind) -> DataType {
    match kind {
        ValueKind::F64 => DataType::Float64,
        ValueKind::U32 => DataType::UInt32,
        ValueKind::U8 | ValueKind::Unspecified => DataType::UInt8,
    }
}

fn column<T: Copy>(values: &[T], component: usize, components: usize) -> impl Iterator<Item = T> {
    values.iter().skip(component).step_by(components).copied()
}

fn array(field: &Field, component: usize) -> Option<ArrayRef> {
    let components = field.components();
    let array: ArrayRef = match field.values().kind() {
        ValueKind::F64 => Arc::new(Float64Array::from_iter_values(column(field.f64().ok()?, component, components))),
        ValueKind::U32 => Arc::new(UInt32Array::from_iter_values(column(field.u32().ok()?, component, components))),
        ValueKind::U8 | ValueKind::Unspecified => {
            Arc::new(UInt8Array::from_iter_values(column(field.u8().ok()?, component, components)))
        }
    };
    Some(array)
}

#[cfg(test)]
mod tests {
    use arrow::{array::Array as _, ipc::reader::FileReader};
    use stagger_messages::{Measure, Port, Values, Version};

    use super::*;

    fn field(name: &str, components: u32, revision: u64, values: impl Into<Values>) -> (String, Field) {
        let values = values.into();
        let port = Port { kind: values.kind().into(), ..Port::f64(name, "m", "particles", components, Measure::None) };
        (name.into(), Field::new(&Arc::new(port), revision, values).unwrap())
    }

    fn step(number: u64, fields: impl IntoIterator<Item = (String, Field)>) -> Step {
        let version = Version { step: number, attempt: 1, iteration: 1 };
        Step {
            version,
            t_s: 0.25 * number as f64,
            dt_s: 0.25,
            fields: fields.into_iter().collect(),
            supports: stagger_messages::Supports::default(),
            recorded: true,
        }
    }

    #[test]
    fn what_is_read_back_is_what_the_states_held() {
        let values = [f64::MIN_POSITIVE, -0.0, 0.1, 1e300, f64::NAN, 3.0];
        let states = [
            step(0, [field("positions", 3, 0, values.to_vec()), field("radii", 1, 0, vec![1.0, 2.0])]),
            // One particle has gone; the radii are still those of two. A field that was not there before.
            step(
                7,
                [
                    field("positions", 3, 1, values[..3].to_vec()),
                    field("radii", 1, 0, vec![1.0, 2.0]),
                    field("pairs", 2, 1, vec![4u32, u32::MAX]),
                    field("flags", 1, 1, vec![1u8]),
                ],
            ),
            // Nobody is left.
            step(8, [field("positions", 3, 2, Vec::<f64>::new())]),
        ];
        let mut supports = Supports::new();
        states.iter().for_each(|step| note(&mut supports, step));
        let folder = std::env::temp_dir().join(format!("stagger-arrow-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let columns = supports.remove("particles").unwrap();
        let info = RunInfo { run: "r".into(), ..RunInfo::default() };
        let mut table = Table::create(&folder, "particles".into(), columns, &info).unwrap();
        states.iter().for_each(|step| table.put(step).unwrap());
        table.finish().unwrap();
        assert_eq!(table.rows, 3);

        let reader = FileReader::try_new(File::open(&table.path).unwrap(), None).unwrap();
        fs::remove_dir_all(&folder).unwrap();
        let schema = reader.schema();
        assert_eq!(
            (schema.metadata()["run"].as_str(), schema.field_with_name("radii").unwrap().metadata()["unit"].as_str()),
            ("r", "m")
        );
        let batches: Vec<_> = reader.map(Result::unwrap).collect();
        assert_eq!(batches.iter().map(RecordBatch::num_rows).collect::<Vec<_>>(), [2, 1, 0]);
        let f64s = |batch: usize, name: &str| {
            let column = batches[batch].column_by_name(name).unwrap();
            column.as_any().downcast_ref::<Float64Array>().unwrap().clone()
        };
        let bits = |array: &Float64Array| array.values().iter().map(|value| value.to_bits()).collect::<Vec<_>>();
        for (axis, name) in ["positions.x", "positions.y", "positions.z"].into_iter().enumerate() {
            assert_eq!(bits(&f64s(0, name)), [values[axis].to_bits(), values[axis + 3].to_bits()]);
        }
        assert_eq!(bits(&f64s(1, "t_s")), [1.75f64.to_bits()]);
        assert_eq!((f64s(0, "radii").null_count(), f64s(1, "radii").null_count()), (0, 1));
        let pair = batches[1].column_by_name("pairs.1").unwrap();
        assert_eq!(pair.as_any().downcast_ref::<UInt32Array>().unwrap().value(0), u32::MAX);
        assert_eq!(batches[0].column_by_name("flags").unwrap().null_count(), 2);
    }
}
