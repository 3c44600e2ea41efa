//! Particles from a file: CSV, extended XYZ, or VTK. Every reader makes columns of it; what they mean is decided here.

mod csv;
mod vtk_legacy;
mod vtk_number;
mod vtk_xml;
mod xyz;
use stagger_config::problems::{cut, nearest, quoted};

use crate::particles::settings::Start;

/// Mistakes of one file that are told; the rest are counted.
const TOLD: usize = 5;

/// Columns that must be there, and those that may be. Other columns are left alone.
const REQUIRED: [&str; 4] = ["x", "y", "z", "radius"];
const VELOCITY: [&str; 3] = ["vx", "vy", "vz"];
const SPIN: [&str; 3] = ["wx", "wy", "wz"];
const TEMPERATURE: &str = "temperature";
const MELTED: &str = "melted";
const MATERIAL: &str = "material";

/// Other names, in lower case, and the columns they stand for.
const ALIASES: [(&str, &[&str]); 12] = [
    ("pos", REQUIRED.split_at(3).0),
    ("position", REQUIRED.split_at(3).0),
    ("positions", REQUIRED.split_at(3).0),
    ("points", REQUIRED.split_at(3).0),
    ("velo", &VELOCITY),
    ("vel", &VELOCITY),
    ("velocity", &VELOCITY),
    ("velocities", &VELOCITY),
    ("spins", &SPIN),
    ("angular_velocity", &SPIN),
    ("radius", REQUIRED.split_at(3).1),
    ("radii", REQUIRED.split_at(3).1),
];

/// Values that one array may have: a file that promises more is refused before memory is asked for.
const MOST_VALUES: usize = 1 << 30;

/// What a file may tell beside places and radii, each with its columns.
pub(crate) const OPTIONAL: [(&str, &[&str]); 5] = [
    ("velocity", &VELOCITY),
    ("spin", &SPIN),
    ("temperature", &[TEMPERATURE]),
    ("melted", &[MELTED]),
    ("material", &[MATERIAL]),
];

/// Values under one name, by row.
#[derive(Debug)]
pub(crate) enum Values {
    Numbers(Vec<f64>),
    Words(Vec<String>),
}

/// What a reader makes of a file.
#[derive(Debug, Default)]
pub(crate) struct Columns {
    columns: Vec<(String, Values)>,
    /// The line of each row, where rows are lines.
    lines: Vec<usize>,
    /// States one after the other in the file, of which the first is read; 0 where the format has one only.
    pub frames: usize,
}

/// A mistake in a file.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Fault {
    /// From 1, where one line is wrong.
    line: Option<usize>,
    message: String,
    hint: Option<String>,
}

/// All mistakes of a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Faults(Vec<Fault>);

impl Faults {
    fn one(line: Option<usize>, message: impl Into<String>) -> Self {
        Self(vec![Fault { line, message: message.into(), hint: None }])
    }

    fn push(&mut self, line: Option<usize>, message: impl Into<String>, hint: Option<String>) {
        self.0.push(Fault { line, message: message.into(), hint });
    }

    /// Tells the first of them, each with the file and the line, and how many more there are.
    pub fn tell(self, path: &str, mut tell: impl FnMut(String, Option<String>)) {
        let more = self.0.len().saturating_sub(TOLD);
        for (index, Fault { line, message, hint }) in self.0.into_iter().take(TOLD).enumerate() {
            let place = line.map_or(String::new(), |line| format!(":{line}"));
            let rest =
                if index + 1 == TOLD && more > 0 { format!(" (and {more} more mistakes)") } else { String::new() };
            tell(format!("{path}{place}: {message}{rest}"), hint);
        }
    }
}

pub(crate) use crate::common::Heat;

/// What finds a material by what a file calls it: its index, or what is wrong and perhaps what to do.
pub(crate) type FindMaterial<'f> = &'f mut dyn FnMut(&str) -> Result<u16, (String, Option<String>)>;

/// Reads a file by what its name ends with.
pub(crate) fn read(path: &str, contents: &[u8]) -> Result<Columns, Faults> {
    let text = || text(contents);
    match path.rsplit_once('.').map(|(_, end)| end.to_ascii_lowercase()).as_deref() {
        Some("csv") => csv::read(text()?),
        Some("xyz" | "extxyz") => xyz::read(text()?),
        Some("vtk") => vtk_legacy::read(contents),
        Some("vtp" | "vtu") => vtk_xml::read(contents),
        _ => Err(Faults::one(None, "expected a name that ends with .csv, .xyz, .extxyz, .vtk, .vtp or .vtu")),
    }
}

/// The text of a file, without the byte order mark that some programs begin it with.
fn text(contents: &[u8]) -> Result<&str, Faults> {
    if contents.starts_with(&[0xff, 0xfe]) || contents.starts_with(&[0xfe, 0xff]) {
        return Err(Faults::one(Some(1), "expected text in UTF-8, found UTF-16: save it as UTF-8"));
    }
    let text = std::str::from_utf8(contents).map_err(|error| {
        let line = 1 + contents[..error.valid_up_to()].iter().filter(|byte| **byte == b'\n').count();
        Faults::one(Some(line), "expected text in UTF-8, found other bytes: save it as UTF-8")
    })?;
    Ok(text.strip_prefix('\u{feff}').unwrap_or(text))
}

/// The lines of a text with their numbers, from 1: they end with LF, CR LF, or CR alone.
fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let mut rest = Some(text);
    (1..).zip(std::iter::from_fn(move || {
        let text = rest.filter(|text| !text.is_empty())?;
        let Some(end) = text.find(['\n', '\r']) else { return rest.take() };
        let length = if text[end..].starts_with("\r\n") { 2 } else { 1 };
        rest = Some(&text[end + length..]);
        Some(&text[..end])
    }))
}

/// What to do about a word that should be a number, where that can be told.
fn hint_for_number(word: &str) -> Option<String> {
    let reads = |from: &[char], to: &str| word.replace(from, to).parse::<f64>().is_ok();
    if word.matches(',').count() == 1 && reads(&[','], ".") {
        return Some(format!("write a point, not a comma: {}", cut(&word.replace(',', "."))));
    }
    if reads(&['d', 'D'], "e") {
        return Some(format!(
            "write the exponent with e, not with Fortran's d: {}",
            cut(&word.replace(['d', 'D'], "e"))
        ));
    }
    None
}

/// Whether a column of this name means something to particles.
fn is_known(name: &str) -> bool {
    REQUIRED.contains(&name) || OPTIONAL.iter().any(|(_, columns)| columns.contains(&name))
}

/// The columns that a name of several components stands for; other names stand for themselves.
///
/// # Errors
/// A name that means something to particles, with another number of components.
fn columns_of(name: &str, components: usize) -> Result<Vec<String>, String> {
    let plain = name.trim().to_lowercase();
    let columns: Vec<String> = match ALIASES.iter().find(|(alias, _)| *alias == plain) {
        Some((_, columns)) => columns.iter().map(|name| (*name).to_owned()).collect(),
        None if components == 1 || is_known(&plain) => vec![plain],
        None => return Ok((0..components).map(|component| format!("{plain}.{component}")).collect()),
    };
    if columns.len() == components {
        return Ok(columns);
    }
    let (expected, found) = (columns.len(), components);
    Err(format!("`{}` stands for {}: expected {expected} components, found {found}", cut(name), columns.join(", ")))
}

impl Columns {
    /// Adds a column; two of one name, in whatever case, are a mistake. Those without a name are left out.
    fn push(&mut self, name: String, values: Values) -> Result<(), String> {
        if name.is_empty() {
            return Ok(());
        }
        if self.find(&name).is_some() {
            return Err(format!("expected one column `{}`, found two (case does not matter)", cut(&name)));
        }
        self.columns.push((name, values));
        Ok(())
    }

    /// Adds the columns of one array of points, given row by row.
    fn push_array(&mut self, name: &str, components: usize, values: &[f64]) -> Result<(), String> {
        for (component, column) in columns_of(name, components)?.into_iter().enumerate() {
            let values = values.iter().skip(component).step_by(components.max(1)).copied().collect();
            self.push(column, Values::Numbers(values))?;
        }
        Ok(())
    }

    /// Adds an array of VTK's point data. Where particles are is said by the points alone.
    fn push_point_data(&mut self, name: &str, components: usize, values: &[f64]) -> Result<(), String> {
        let is_place = columns_of(name, components)?.iter().any(|column| REQUIRED[..3].contains(&column.as_str()));
        if is_place { Ok(()) } else { self.push_array(name, components, values) }
    }

    fn find(&self, name: &str) -> Option<&Values> {
        self.columns.iter().find(|(other, _)| other == name).map(|(_, values)| values)
    }

    /// The numbers of a column; what is missing or not a number is a fault.
    fn numbers(&self, name: &str, faults: &mut Faults) -> Option<&[f64]> {
        match self.find(name)? {
            Values::Numbers(values) => Some(values),
            Values::Words(_) => {
                faults.push(None, format!("expected numbers in the column `{name}`, found texts"), None);
                None
            }
        }
    }

    /// The particles of the file: lengths times `unit_m`, `velocity_m_s` where the file has no velocities.
    ///
    /// # Errors
    /// Columns that are missing or nearly have the right name; values that are not finite; materials that nobody knows.
    pub fn given(&self, unit_m: f64, velocity_m_s: [f64; 3], find_material: FindMaterial<'_>) -> Result<Start, Faults> {
        let mut faults = Faults::default();
        self.check_names(&mut faults);
        let mut three = |names: &[&str]| -> Option<Vec<[f64; 3]>> {
            let columns: Vec<&[f64]> = names.iter().filter_map(|name| self.numbers(name, &mut faults)).collect();
            let [x, y, z] = columns.as_slice() else { return None };
            Some(x.iter().zip(*y).zip(*z).map(|((x, y), z)| [*x, *y, *z]).collect())
        };
        let (positions, velocities, spins) = (three(&REQUIRED[..3]), three(&VELOCITY), three(&SPIN));
        let radii = self.numbers(REQUIRED[3], &mut faults);
        let (Some(positions), Some(radii), true) = (positions, radii, faults.0.is_empty()) else { return Err(faults) };
        let velocities = velocities.unwrap_or_else(|| vec![velocity_m_s; positions.len()]);
        for (row, ((position, velocity), radius)) in positions.iter().zip(&velocities).zip(radii).enumerate() {
            let line = self.lines.get(row).copied();
            let place = if line.is_none() { format!(" of particle {row}") } else { String::new() };
            if position.iter().chain(velocity).any(|value| !value.is_finite()) {
                faults.push(line, format!("expected finite numbers, found {position:?} and {velocity:?}{place}"), None);
            } else if !(radius.is_finite() && *radius > 0.0) {
                faults.push(line, format!("expected a positive radius, found {radius}{place}"), None);
            }
        }
        let spins_rad_s = spins.unwrap_or_default();
        if let Some(row) = spins_rad_s.iter().position(|spin| spin.iter().any(|value| !value.is_finite())) {
            let spin = spins_rad_s[row];
            faults.push(self.lines.get(row).copied(), format!("expected a finite spin, found {spin:?}"), None);
        }
        let materials = self.materials(positions.len(), find_material, &mut faults);
        if !faults.0.is_empty() {
            return Err(faults);
        }
        Ok(Start::Given {
            positions_m: positions.into_iter().map(|position| position.map(|x| x * unit_m)).collect(),
            velocities_m_s: velocities,
            radii_m: radii.iter().map(|radius| radius * unit_m).collect(),
            materials,
            spins_rad_s,
        })
    }

    /// What the file tells of the particles' heat; `None` where it has no temperatures.
    ///
    /// # Errors
    /// A temperature is negative or not finite, a liquid share is not from 0 to 1.
    pub fn heat(&self) -> Result<Option<Heat>, Faults> {
        let mut faults = Faults::default();
        let mut column = |name: &str, expected: &str, fits: fn(f64) -> bool| {
            let values = self.numbers(name, &mut faults)?;
            if let Some(row) = values.iter().position(|value| !fits(*value)) {
                let found = values[row];
                let place = if self.lines.is_empty() { format!(" of particle {row}") } else { String::new() };
                faults.push(self.lines.get(row).copied(), format!("expected {expected}, found {found}{place}"), None);
            }
            Some(values.to_vec())
        };
        let temperatures_k = column(TEMPERATURE, "a temperature of at least 0 K", |k| k.is_finite() && k >= 0.0);
        let melted = column(MELTED, "a liquid share from 0 to 1", |share| (0.0..=1.0).contains(&share));
        if faults.0.is_empty() {
            Ok(temperatures_k.map(|temperatures_k| Heat { temperatures_k, melted }))
        } else {
            Err(faults)
        }
    }

    /// Leaves out what the file tells of these, by the names of [`OPTIONAL`].
    pub fn leave_out(&mut self, unwanted: impl Fn(&str) -> bool) {
        for (name, columns) in OPTIONAL.iter().filter(|(name, _)| unwanted(name)) {
            let of_these = |column: &(String, Values)| columns.contains(&column.0.as_str()) || column.0 == *name;
            self.columns.retain(|column| !of_these(column));
        }
    }

    /// Names of what the file tells, of [`OPTIONAL`], and of the columns that nothing reads.
    pub fn told(&self) -> (Vec<&'static str>, Vec<&str>) {
        let has = |columns: &[&str]| columns.iter().all(|name| self.find(name).is_some());
        let used = OPTIONAL.iter().filter(|(_, columns)| has(columns)).map(|(name, _)| *name).collect();
        let names = self.columns.iter().map(|(name, _)| name.as_str());
        (used, names.filter(|name| !is_known(name)).collect())
    }

    fn materials(&self, rows: usize, find: FindMaterial<'_>, faults: &mut Faults) -> Vec<u16> {
        let words: Vec<String> = match self.find(MATERIAL) {
            None => return vec![0; rows],
            Some(Values::Words(words)) => words.clone(),
            Some(Values::Numbers(numbers)) => numbers.iter().map(f64::to_string).collect(),
        };
        let mut known: Vec<(&str, u16)> = Vec::new();
        let mut materials = Vec::with_capacity(rows);
        for (row, word) in words.iter().enumerate() {
            let index = match known.iter().find(|(other, _)| other == word) {
                Some((_, index)) => *index,
                None => {
                    let index = find(word).unwrap_or_else(|(message, hint)| {
                        faults.push(self.lines.get(row).copied(), message, hint);
                        0
                    });
                    known.push((word, index));
                    index
                }
            };
            materials.push(index);
        }
        materials
    }

    /// Finds columns that are missing, and mistyped ones that would be overlooked.
    fn check_names(&self, faults: &mut Faults) {
        let names = || self.columns.iter().map(|(name, _)| name.as_str());
        let given = |wanted: &str| names().any(|name| name == wanted);
        let known = REQUIRED.into_iter().chain(OPTIONAL.iter().flat_map(|(_, columns)| columns.iter().copied()));
        let strange = || names().filter(|name| !is_known(name));
        let some = |of: &[&str; 3], wanted: &str| of.contains(&wanted) && of.iter().any(|name| given(name));
        for wanted in known.filter(|wanted| !given(wanted)) {
            // Forces and other vectors of one letter are as near to a spin's as a slip would be.
            let meant = nearest(wanted, strange()).filter(|_| !SPIN.contains(&wanted));
            let needed = REQUIRED.contains(&wanted) || some(&VELOCITY, wanted) || some(&SPIN, wanted);
            if !needed && meant.is_none() {
                continue;
            }
            let found: Vec<&str> = names().collect();
            let hint = meant.map(|meant| format!("did you mean `{wanted}` where the file has `{}`?", cut(meant)));
            faults.push(None, format!("expected a column `{wanted}`, found {}", shortened(&found)), hint);
        }
    }
}

/// Names of columns as a message lists them.
fn shortened(names: &[&str]) -> String {
    const LISTED: usize = 20;
    let listed: Vec<_> = names.iter().take(LISTED).map(|name| cut(name)).collect();
    match names.len() {
        0 => "none".into(),
        count if count > LISTED => format!("{} and {} more", listed.join(", "), count - LISTED),
        _ => listed.join(", "),
    }
}

#[cfg(test)]
mod tests;
