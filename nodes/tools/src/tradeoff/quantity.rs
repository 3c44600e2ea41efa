//! What errors are measured by: numbers and fields of a run's last state, compared with those of the reference.

use std::{fmt, path::Path, str::FromStr};

use stagger_coupling::{Ledger, math};
use stagger_messages::{Field, Fields};
use stagger_recordings::{Body, Message, Recording, RecordingError, State, States};

use super::axis;

/// Share of the solid volume, from the lowest particle up, that the porosity is taken over: what lies loose on top is no bed.
const BED: f64 = 0.9;

/// A quantity of a run's end. Its error is a share of how far it came during the reference run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Mean over all values of a field.
    Mean(String),
    /// Largest value of a field.
    Peak(String),
    /// Root mean square of a field's values.
    Rms(String),
    /// A field row by row: root mean square of the differences.
    Each(String),
    /// Energy that nodes gained or lost under a name: where a node lost it what was lost, else what was gained.
    Energy(String),
    /// Height of the centre of mass.
    Height,
    /// Share of the bed's box that is empty.
    Porosity,
}

impl FromStr for Quantity {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let text = text.trim();
        let mut words = axis::contributions().flat_map(|own| own.words);
        let text = words.find(|(word, _)| *word == text).map_or(text, |(_, meaning)| meaning);
        match text.split_once(' ').map(|(kind, name)| (kind, name.trim().to_owned())) {
            None if text == "height" => Ok(Self::Height),
            None if text == "porosity" => Ok(Self::Porosity),
            Some(("mean", field)) => Ok(Self::Mean(field)),
            Some(("peak", field)) => Ok(Self::Peak(field)),
            Some(("rms", field)) => Ok(Self::Rms(field)),
            Some(("each", field)) => Ok(Self::Each(field)),
            Some(("energy", name)) => Ok(Self::Energy(name)),
            _ => Err(format!(
                "expected a quantity such as \"mean temperature\", \"peak temperature\", \"rms FIELD\", \"each FIELD\", \
                 \"energy NAME\", \"height\" or \"porosity\", found {text:?}"
            )),
        }
    }
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text = match self {
            Self::Mean(field) => format!("mean {field}"),
            Self::Peak(field) => format!("peak {field}"),
            Self::Rms(field) => format!("rms {field}"),
            Self::Each(field) => format!("each {field}"),
            Self::Energy(name) => format!("energy {name}"),
            Self::Height => "height".into(),
            Self::Porosity => "porosity".into(),
        };
        f.write_str(&text)
    }
}

/// First and last state of a run.
pub struct Ends {
    first: State,
    last: State,
}

impl Ends {
    /// Reads them from a recording; `None` where it holds no state.
    ///
    /// # Errors
    /// The recording cannot be read.
    pub fn of(recording: &Path) -> Result<Option<Self>, RecordingError> {
        let recording = Recording::open(recording)?;
        let mut states = States::default();
        let (mut first, mut last): (Option<State>, Option<State>) = (None, None);
        let mut keep = |state: State| {
            if first.is_none() {
                first = Some(state.clone());
            }
            last = Some(state);
        };
        for message in recording.messages()? {
            let message: Message = message?;
            // What plug-ins keep in checkpoints may be large, and is nothing that is compared.
            if matches!(message.body, Body::Checkpoint(_)) {
                continue;
            }
            states.take(message).state.into_iter().for_each(&mut keep);
        }
        states.end().into_iter().for_each(keep);
        Ok(first.zip(last).map(|(first, last)| Self { first, last }))
    }

    /// The quantities that mean something for this run, where nobody named any.
    #[must_use]
    pub fn usual(&self) -> Vec<Quantity> {
        let usual = axis::contributions().flat_map(|own| own.usual);
        let quantities = usual.filter_map(|text| text.parse().ok());
        quantities.filter(|quantity| self.error(quantity, self).is_some()).collect()
    }

    /// Value of a quantity at the end, in its SI unit; `None` where the run has no such thing, or where it is a whole field.
    #[must_use]
    pub fn value(&self, quantity: &Quantity) -> Option<f64> {
        value(quantity, &self.last).filter(|value| value.is_finite())
    }

    /// Error of a quantity against the reference, as a share of how far it came there from its start; of its value where it
    /// did not move. `None` where the two cannot be compared.
    #[must_use]
    pub fn error(&self, quantity: &Quantity, reference: &Self) -> Option<f64> {
        let (difference, moved, size) = if let Quantity::Each(name) = quantity {
            let (here, there) = (rows(&self.last.step.fields, name)?, rows(&reference.last.step.fields, name)?);
            let start = rows(&reference.first.step.fields, name)?;
            let difference = rms_of_difference(&here, &there)?;
            (difference, rms_of_difference(&there, &start).unwrap_or(0.0), rms(&there.values))
        } else {
            let (here, there) = (value(quantity, &self.last)?, value(quantity, &reference.last)?);
            // Where it started says nothing of what a bed's porosity is good for.
            let start =
                if *quantity == Quantity::Porosity { there } else { value(quantity, &reference.first).unwrap_or(0.0) };
            ((here - there).abs(), (there - start).abs(), there.abs())
        };
        // Rounding of something that stood still is no distance.
        let scale = if moved > 1e-9 * size { moved } else { size };
        let error = if difference == 0.0 { 0.0 } else { difference / scale };
        error.is_finite().then_some(error)
    }
}

fn value(quantity: &Quantity, state: &State) -> Option<f64> {
    let fields = &state.step.fields;
    let all = |name: &String| fields.get(name)?.f64().ok().filter(|values| !values.is_empty());
    match quantity {
        Quantity::Mean(name) => all(name).map(|values| values.iter().sum::<f64>() / values.len() as f64),
        Quantity::Peak(name) => all(name).map(|values| values.iter().copied().fold(f64::NEG_INFINITY, f64::max)),
        Quantity::Rms(name) => all(name).map(rms),
        Quantity::Each(_) => None,
        Quantity::Energy(name) => energy(&state.ledger, name),
        Quantity::Height => {
            let (volumes, heights) = spheres(fields)?;
            let moment: f64 = volumes.iter().zip(&heights).map(|(volume, height)| volume * height).sum();
            Some(moment / volumes.iter().sum::<f64>())
        }
        Quantity::Porosity => porosity(fields),
    }
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

fn energy(ledger: &Ledger, name: &str) -> Option<f64> {
    let accounts = || ledger.nodes().values();
    let sum = |parts: Vec<f64>| (!parts.is_empty()).then(|| parts.iter().sum());
    sum(accounts().filter_map(|account| account.lost.get(name).copied()).collect())
        .or_else(|| sum(accounts().filter_map(|account| account.gained.get(name).copied()).collect()))
}

/// Volumes over 4π/3, and heights of the centres.
fn spheres(fields: &Fields) -> Option<(Vec<f64>, Vec<f64>)> {
    let (positions, radii) = (fields.get("positions")?.f64().ok()?, fields.get("radii")?.f64().ok()?);
    if radii.is_empty() || positions.len() != 3 * radii.len() {
        return None;
    }
    let volumes = radii.iter().map(|radius| math::powi(*radius, 3)).collect();
    Some((volumes, positions.chunks_exact(3).map(|position| position[2]).collect()))
}

/// One minus the volume of the lowest [`BED`] of the particles over that of the box from the bed's floor to the height below
/// which they lie, as wide as the whole bed.
fn porosity(fields: &Fields) -> Option<f64> {
    let (volumes, heights) = spheres(fields)?;
    let (positions, radii) = (fields.get("positions")?.f64().ok()?, fields.get("radii")?.f64().ok()?);
    let span = |axis: usize| {
        let ends = positions
            .chunks_exact(3)
            .zip(radii)
            .map(|(position, radius)| [position[axis] - radius, position[axis] + radius]);
        ends.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], [from, to]| [low.min(from), high.max(to)])
    };
    let ([x, y], floor) = ([0, 1].map(span), span(2)[0]);
    let mut order: Vec<usize> = (0..heights.len()).collect();
    order.sort_by(|&left, &right| heights[left].total_cmp(&heights[right]));
    let (wanted, mut below, mut top) = (BED * volumes.iter().sum::<f64>(), 0.0, floor);
    for index in order {
        if below >= wanted {
            break;
        }
        (below, top) = (below + volumes[index], heights[index]);
    }
    let solid = below * 4.0 / 3.0 * std::f64::consts::PI;
    let room = (x[1] - x[0]) * (y[1] - y[0]) * (top - floor);
    (room > 0.0).then(|| 1.0 - solid / room)
}

/// The rows of a field, by the particles' ids where they come and go.
struct Rows<'f> {
    values: Vec<f64>,
    components: usize,
    ids: Option<&'f [u32]>,
}

fn rows<'f>(fields: &'f Fields, name: &str) -> Option<Rows<'f>> {
    let field = fields.get(name)?;
    let ids = fields.get("ids").filter(|ids| ids.rows() == field.rows()).and_then(|ids: &Field| ids.u32().ok());
    Some(Rows { values: field.f64().ok()?.to_vec(), components: field.components(), ids })
}

/// Root mean square of the difference of the rows both have; `None` where they are not the same rows, or none.
fn rms_of_difference(left: &Rows<'_>, right: &Rows<'_>) -> Option<f64> {
    let width = left.components;
    if width == 0 || width != right.components {
        return None;
    }
    let pairs: Vec<(usize, usize)> = match (left.ids, right.ids) {
        (Some(here), Some(there)) => {
            let known: std::collections::BTreeMap<u32, usize> = there.iter().copied().zip(0..).collect();
            here.iter().enumerate().filter_map(|(row, id)| Some((row, *known.get(id)?))).collect()
        }
        _ if left.values.len() == right.values.len() => (0..left.values.len() / width).map(|row| (row, row)).collect(),
        _ => return None,
    };
    let differences: Vec<f64> = pairs
        .iter()
        .flat_map(|&(here, there)| (0..width).map(move |c| (here * width + c, there * width + c)))
        .map(|(here, there)| left.values[here] - right.values[there])
        .collect();
    (!differences.is_empty()).then(|| rms(&differences))
}

#[cfg(test)]
mod tests {
    use std::{collections::BTreeMap, sync::Arc};

    use stagger_messages::{Energy, Measure, Port, Supports, Version};
    use stagger_recordings::{Step, Work};

    use super::*;

    fn state(fields: &[(&str, usize, &[f64])], absorbed: f64) -> State {
        let field = |(name, components, values): &(&str, usize, &[f64])| {
            let port = Arc::new(Port::f64(name, "1", "particles", *components as u32, Measure::None));
            ((*name).to_owned(), Field::new(&port, 0, values.to_vec()).unwrap())
        };
        let mut ledger = Ledger::default();
        ledger.book("optics", &[Energy::lost("absorbed", absorbed)]);
        ledger.book("thermal", &[Energy::gained("absorbed", 7.0)]);
        let fields = fields.iter().map(field).collect();
        let step = Step {
            version: Version::INITIAL,
            t_s: 0.0,
            dt_s: 0.0,
            fields,
            supports: Supports::default(),
            recorded: true,
        };
        State { step, decision: None, work: Work::default(), replies: BTreeMap::new(), ledger }
    }

    fn ends(temperature: &[f64], absorbed: f64) -> Ends {
        let first = state(&[("temperature", 1, &[300.0, 300.0])], 0.0);
        Ends { first, last: state(&[("temperature", 1, temperature)], absorbed) }
    }

    #[test]
    fn words_are_read_and_written_alike() {
        for text in ["mean temperature", "peak a", "rms a", "each positions", "energy absorbed", "height", "porosity"] {
            assert_eq!(text.parse::<Quantity>().unwrap().to_string(), text);
        }
        assert_eq!("absorbed energy".parse::<Quantity>().unwrap(), Quantity::Energy("absorbed".into()));
        assert!("temperature".parse::<Quantity>().unwrap_err().contains("found \"temperature\""));
    }

    #[test]
    fn errors_are_shares_of_what_happened() {
        let (reference, other) = (ends(&[310.0, 330.0], 5.0), ends(&[311.0, 327.0], 6.0));
        let error = |text: &str| other.error(&text.parse().unwrap(), &reference);
        // Means 320 and 319 after a rise by 20; peaks 330 and 327 after one by 30.
        assert_eq!(error("mean temperature"), Some(1.0 / 20.0));
        assert_eq!(error("peak temperature"), Some(0.1));
        // √((1² + 3²)/2) over √((10² + 30²)/2).
        assert!((error("each temperature").unwrap() - 0.1).abs() < 1e-15);
        assert_eq!(error("energy absorbed"), Some(0.2));
        assert_eq!(error("mean velocities"), None);
        assert_eq!(reference.usual().len(), 3);
        assert_eq!(reference.error(&Quantity::Mean("temperature".into()), &reference), Some(0.0));
    }

    #[test]
    fn a_lattice_has_its_porosity_and_height() {
        // A cube of 10³ touching spheres of radius 1: 9 of 10 layers are taken, up to the centres of the ninth.
        let mut positions = Vec::new();
        for index in 0..1000 {
            positions.extend([index % 10, index / 10 % 10, index / 100].map(|place| 2.0 * f64::from(place) + 1.0));
        }
        let radii = vec![1.0; 1000];
        let bed = state(&[("positions", 3, &positions), ("radii", 1, &radii)], 0.0);
        let solid = 900.0 * 4.0 / 3.0 * std::f64::consts::PI / (20.0 * 20.0 * 17.0);
        assert!((value(&Quantity::Porosity, &bed).unwrap() - (1.0 - solid)).abs() < 1e-12);
        assert!((value(&Quantity::Height, &bed).unwrap() - 10.0).abs() < 1e-12);
    }
}
