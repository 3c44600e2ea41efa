//! `stagger tradeoff`: what each approximation of a scene costs and gains, measured against a run that makes hardly any.

pub mod axis;
mod case;
mod front;
mod orders;
mod page;
mod quantity;
mod table;

use stagger_runtime::run::outputs::{self, Inputs, OutputError, Replace};
use std::{
    path::{Path, PathBuf},
    rc::Rc,
    sync::atomic::AtomicBool,
    time::Duration,
};

use serde::Serialize;
use stagger_config::STANDARD;
use stagger_recordings::RecordingError;
use stagger_scene::Scene;

use crate::report;
use axis::{Axis, Point, Set};
pub use case::{Outcome, Workshop};
pub use front::{Rated, cheapest, front};
pub use orders::{Orders, orders};
pub use quantity::{Ends, Quantity};

/// How many times smaller the reference's steps are than the scene's; those of the run that tells what is known of it, half.
const TIGHTER: f64 = 4.0;
/// What is asked for where the presets alone are to be run, which always are.
const PRESETS: &str = "presets";
/// Share of the time by which a setting must be faster to be taken: less is noise.
const FASTER: f64 = 0.97;

/// What is asked for beside the scene.
#[derive(Clone, Debug)]
pub struct Options {
    /// Where and how runs are made.
    pub workshop: Workshop,
    /// Where the page and the table go.
    pub results: Results,
    /// Built-in axes to try; empty tries all that mean something for the scene, `presets` none: those of the scene are always
    /// run.
    pub axes: Vec<String>,
    /// Axes of the user's own: a key and its values.
    pub vary: Vec<(String, Vec<String>)>,
    /// Settings of the reference, over those it has anyway.
    pub reference: Set,
    /// What errors are measured by; empty takes the scene's own or the usual ones.
    pub quantities: Vec<Quantity>,
    /// Largest error of the setting that is recommended, as a share.
    pub bound: f64,
    /// A run is ended that takes this many times as long as the scene as it stands.
    pub longest: f64,
}

/// The page and the table of a study, and what they may replace.
#[derive(Clone, Debug)]
pub struct Results {
    table: (PathBuf, Replace),
    page: (PathBuf, Replace),
}

impl Results {
    /// Those in a folder; what no earlier study has written is replaced only where `overwrite` says so.
    #[must_use]
    pub fn new(folder: &Path, overwrite: bool) -> Self {
        Self {
            table: (folder.join("tradeoff.csv"), Replace::own(table::BEGIN, overwrite)),
            page: (folder.join("tradeoff.html"), Replace::own(report::BEGIN, overwrite)),
        }
    }

    /// Whether they may be written, and are none of the `inputs`.
    ///
    /// # Errors
    /// They may not.
    pub fn allowed(&self, inputs: &Inputs) -> Result<(), OutputError> {
        [&self.table, &self.page].into_iter().try_for_each(|(path, replace)| {
            inputs.spare(path)?;
            replace.allows(path)
        })
    }

    fn write(&self, study: &Study) -> Result<(), OutputError> {
        let (path, replace) = &self.table;
        let table = table::csv(study).map_err(|source| OutputError::Io { path: path.clone(), source })?;
        outputs::write(path, *replace, &table)?;
        outputs::write(&self.page.0, self.page.1, page::page(study).as_bytes())
    }
}

/// Why there is no table.
#[derive(Debug, thiserror::Error)]
pub enum Failed {
    /// The runs that everything is compared with.
    #[error("{what} has no result: {why}\nhint: {hint}")]
    Base {
        /// Which run.
        what: &'static str,
        /// Why.
        why: String,
        /// What to do.
        hint: &'static str,
    },
    /// A quantity the scene has not.
    #[error(
        "the scene has no {0}\nhint: its quantities are made of the fields and energies that `stagger run` lists at its end"
    )]
    Quantity(String),
    /// An axis that is none.
    #[error("{name:?} is no axis of this scene\nhint: axes are {known}; --vary KEY=VALUE;VALUE makes one of any key")]
    Axis {
        /// What was asked for.
        name: String,
        /// What there is.
        known: String,
    },
    /// A recording cannot be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The page or the table.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// A file or a program.
    #[error("{}: {source}", path.display())]
    Io {
        /// Which one.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// Ctrl-C.
    #[error("interrupted; the same command goes on where it stopped")]
    Interrupted,
}

impl Failed {
    fn io(path: &Path, source: std::io::Error) -> Self {
        Self::Io { path: path.into(), source }
    }
}

/// A run and how it compares.
#[derive(Clone, Debug, Serialize)]
pub struct Case {
    /// What it is called.
    pub label: String,
    /// The axis it belongs to; empty for those that stand alone.
    pub axis: String,
    /// What it took.
    pub outcome: Outcome,
    /// Value of each quantity at the end, in its SI unit; `None` for whole fields.
    pub values: Vec<Option<f64>>,
    /// Error of each quantity against the reference; `None` where it cannot be compared.
    pub errors: Vec<Option<f64>>,
}

impl Case {
    /// The largest of its errors; infinite where one cannot be told.
    #[must_use]
    pub fn error(&self) -> f64 {
        self.errors.iter().map(|error| error.unwrap_or(f64::INFINITY)).fold(0.0, f64::max)
    }

    fn rated(&self) -> Rated {
        let failed = self.outcome.failed.is_some() || self.errors.is_empty();
        Rated { cost: self.outcome.wall(), error: if failed { f64::INFINITY } else { self.error() } }
    }
}

/// All runs and what follows from them.
#[derive(Clone, Debug, Serialize)]
pub struct Study {
    /// Name and version of this format.
    pub format: &'static str,
    /// Title of the scene.
    pub title: String,
    /// What errors are measured by.
    pub quantities: Vec<String>,
    /// What all runs set.
    pub overrides: Set,
    /// Largest error of the recommended setting, as asked for.
    pub bound: f64,
    /// Error of a run about half as tight as the reference: what is known of the reference itself, by quantity.
    pub known_to: Vec<Option<f64>>,
    /// The runs: the scene as it stands first, then the reference, then the others in their order.
    pub cases: Vec<Case>,
    /// Indices of the runs that no other beats, by their time.
    pub front: Vec<usize>,
    /// Index of the recommended run; `None` where none is within the bound.
    pub recommended: Option<usize>,
}

/// Version of the JSON.
pub const FORMAT: &str = "stagger-tradeoff/1";

/// A study under way.
struct Bench<'a> {
    options: &'a Options,
    interrupted: &'a AtomicBool,
    tell: &'a mut dyn FnMut(&str),
    reference: Option<Rc<Ends>>,
    quantities: Vec<Quantity>,
    longest: Option<Duration>,
    cases: Vec<Case>,
}

impl Bench<'_> {
    /// Runs a case, compares it and tells its row where there is a reference; returns where it stands and its ends.
    fn case(&mut self, label: &str, axis: &str, set: &Set) -> Result<(usize, Option<Ends>), Failed> {
        let (outcome, recording) = self.options.workshop.outcome(set, self.longest, self.interrupted)?;
        let ends = recording.map(|path| Ends::of(&path)).transpose()?.flatten();
        let index = self.cases.len();
        self.cases.push(Case {
            label: label.into(),
            axis: axis.into(),
            outcome,
            values: Vec::new(),
            errors: Vec::new(),
        });
        if self.reference.is_some() {
            self.compare(index, ends.as_ref());
        }
        Ok((index, ends))
    }

    /// Compares a case with the reference, and tells its row.
    fn compare(&mut self, index: usize, ends: Option<&Ends>) {
        if let (Some(ends), Some(reference)) = (ends, &self.reference) {
            let case = &mut self.cases[index];
            case.values = self.quantities.iter().map(|quantity| ends.value(quantity)).collect();
            case.errors = self.quantities.iter().map(|quantity| ends.error(quantity, reference)).collect();
        }
        let row = table::row(&self.cases[index], &self.cases[0], &self.quantities);
        (self.tell)(&row);
    }

    fn must(&mut self, what: &'static str, set: &Set, hint: &'static str) -> Result<(usize, Ends), Failed> {
        let (index, ends) = self.case(what, "", set)?;
        if let Some(why) = self.cases[index].outcome.failed.clone() {
            return Err(Failed::Base { what, why, hint });
        }
        let empty = || Failed::Base { what, why: "its recording holds no state".into(), hint };
        Ok((index, ends.ok_or_else(empty)?))
    }

    fn rated(&self) -> Vec<Rated> {
        // The reference and what tells of it are no settings to choose.
        self.cases
            .iter()
            .map(|case| {
                if case.axis == "reference" {
                    Rated { cost: f64::INFINITY, error: f64::INFINITY }
                } else {
                    case.rated()
                }
            })
            .collect()
    }

    /// The cheapest run within the bound, made cheaper axis by axis for as long as it stays within.
    fn recommend(&mut self, axes: &[Axis]) -> Result<Option<usize>, Failed> {
        let bound = self.options.bound;
        let Some(mut best) = cheapest(&self.rated(), bound) else { return Ok(None) };
        // The best value of each axis by itself, from the largest gain down.
        let standing = self.cases[0].outcome.wall();
        let mut gains: Vec<(f64, String, Set)> = Vec::new();
        for axis in axes.iter().filter(|axis| axis.name != axis::RECORDING) {
            let of_axis = self.cases.iter().filter(|case| case.axis == axis.name && case.rated().error <= bound);
            let fastest = of_axis.min_by(|left, right| left.outcome.wall().total_cmp(&right.outcome.wall()));
            if let Some(case) = fastest.filter(|case| case.outcome.wall() < FASTER * standing) {
                gains.push((case.outcome.wall(), case.label.clone(), case.outcome.set.clone()));
            }
        }
        gains.sort_by(|left, right| left.0.total_cmp(&right.0));
        for (_, label, set) in gains {
            let now = &self.cases[best];
            if set.iter().all(|(key, _)| now.outcome.set.iter().any(|(own, _)| own == key)) {
                continue;
            }
            let merged = merged(&now.outcome.set, &set);
            let (label, wall) = (format!("{} + {label}", now.label), now.outcome.wall());
            let (tried, _) = self.case(&label, "combined", &merged)?;
            let rated = self.cases[tried].rated();
            if rated.error <= bound && rated.cost < FASTER * wall {
                best = tried;
            }
        }
        Ok(Some(best))
    }
}

/// The settings of one with those of another over them.
fn merged(under: &Set, over: &Set) -> Set {
    let kept = under.iter().filter(|(key, _)| !over.iter().any(|(other, _)| other == key));
    kept.chain(over).cloned().collect()
}

/// Runs a scene over its axes. `tell` is given each row when it is there.
///
/// # Errors
/// The scene as it stands or the reference has no result, an option does not fit the scene, a file cannot be read or written, or
/// the user interrupts. What was run is kept, and not run again.
pub fn study(
    scene: &Scene,
    options: &Options,
    interrupted: &AtomicBool,
    tell: &mut dyn FnMut(&str),
) -> Result<Study, Failed> {
    let mut known: Vec<String> = axis::all(scene, Some(1.0)).into_iter().map(|axis| axis.name).collect();
    known.push(PRESETS.into());
    if let Some(name) = options.axes.iter().find(|name| !known.contains(name)) {
        return Err(Failed::Axis { name: name.clone(), known: known.join(", ") });
    }
    let mut bench = Bench {
        options,
        interrupted,
        tell,
        reference: None,
        quantities: options.quantities.clone(),
        longest: None,
        cases: Vec::new(),
    };
    let (_, standing) = bench.must("the scene as it stands", &Set::new(), "stagger run tells more")?;
    let base = bench.cases[0].outcome.clone();
    let mut axes = axis::all(scene, base.substep_s);
    axes.retain(|axis| options.axes.is_empty() && options.vary.is_empty() || options.axes.contains(&axis.name));
    for (key, values) in &options.vary {
        let point = |value: &String| Point { label: format!("{key} {value}"), set: vec![(key.clone(), value.clone())] };
        axes.push(Axis { name: key.clone(), points: values.iter().map(point).collect() });
    }
    if bench.quantities.is_empty() {
        bench.quantities = standing.usual();
    }
    if let Some(missing) = bench.quantities.iter().find(|quantity| standing.error(quantity, &standing).is_none()) {
        return Err(Failed::Quantity(missing.to_string()));
    }
    let hint = "--reference KEY=VALUE changes it; steps that are too small for the machine are one cause";
    let tight = merged(&axis::tight(scene, base.substep_s, TIGHTER), &options.reference);
    let (reference, ends) = bench.must("reference", &tight, hint)?;
    bench.cases[reference].axis = "reference".into();
    let ends = Rc::new(ends);
    bench.reference = Some(Rc::clone(&ends));
    (bench.tell)(&table::head(&bench.quantities));
    bench.compare(0, Some(&standing));
    bench.compare(reference, Some(&ends));
    let half = merged(&axis::tight(scene, base.substep_s, TIGHTER / 2.0), &options.reference);
    let (known_to, _) = bench.case("half as tight", "reference", &half)?;
    let known_to = bench.cases[known_to].errors.clone();
    bench.longest = Some(Duration::from_secs_f64((options.longest * base.wall()).clamp(5.0, 1e9)));
    for preset in scene.presets.iter().filter(|preset| *preset != STANDARD) {
        bench.case(&format!("preset {preset}"), "preset", &vec![("preset".into(), format!("\"{preset}\""))])?;
    }
    for Axis { name, points } in &axes {
        for Point { label, set } in points {
            bench.case(label, name, set)?;
        }
    }
    let recommended = bench.recommend(&axes)?;
    let floor = known_to.iter().map(|error| error.unwrap_or(0.0)).fold(0.0, f64::max);
    let study = Study {
        format: FORMAT,
        title: scene.title.clone(),
        quantities: bench.quantities.iter().map(ToString::to_string).collect(),
        overrides: scene.overrides.clone(),
        bound: options.bound,
        known_to,
        front: front(&bench.rated(), floor),
        recommended,
        cases: bench.cases,
    };
    options.results.write(&study)?;
    (bench.tell)(&table::verdict(&study));
    Ok(study)
}
