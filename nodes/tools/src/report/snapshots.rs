//! The pictures of a run: its start, its middle and its end, picked while it is read.

use stagger_coupling::math;
use stagger_messages::Fields;
use stagger_recordings::{Step, display::colour_scale::Range};

use super::plot::Sphere;

/// Snapshots that are kept while a run is read, of which one will be its middle. At 20 bytes a particle they are what the
/// reading needs beside the newest state.
const KEPT: usize = 12;

/// What particles are coloured by.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Colouring {
    /// The field, or what is computed from one.
    pub name: String,
    /// Its SI unit.
    pub unit: String,
}

/// Particles at one time.
#[derive(Clone, Debug, PartialEq)]
pub struct Snapshot {
    /// Simulated time, in s.
    pub t_s: f64,
    /// Number of the step.
    pub step: u64,
    /// The particles.
    pub spheres: Vec<Sphere>,
}

/// Takes the states of a run and keeps what pictures of its start, middle and end need.
#[derive(Clone, Debug)]
pub struct Snapshots {
    colouring: Option<Colouring>,
    kept: Vec<Snapshot>,
    /// Every so many states one is kept.
    every: u64,
    seen: u64,
    last: Option<Step>,
}

impl Default for Snapshots {
    fn default() -> Self {
        Self { colouring: None, kept: Vec::new(), every: 1, seen: 0, last: None }
    }
}

impl Snapshots {
    /// Takes the next state; one without fields of its own, or without particles, is left out.
    pub fn take(&mut self, step: &Step) {
        if !step.recorded || !step.fields.contains_key("positions") {
            return;
        }
        if self.seen.is_multiple_of(self.every) {
            if self.kept.len() == KEPT {
                let mut number = 0;
                self.kept.retain(|_| {
                    number += 1;
                    number % 2 == 1
                });
                self.every *= 2;
            }
            // The stride may just have grown beyond this one.
            if self.seen.is_multiple_of(self.every) {
                self.keep(step);
            }
        }
        self.seen += 1;
        self.last = Some(step.clone());
    }

    fn keep(&mut self, step: &Step) {
        let colouring = self.colouring.get_or_insert_with(|| colouring(&step.fields));
        self.kept.push(Snapshot { t_s: step.t_s, step: step.version.step, spheres: spheres(&step.fields, colouring) });
    }

    /// Start, middle and end, or fewer where there are not as many, and what colours them; `None` without particles.
    #[must_use]
    pub fn finish(mut self) -> Option<(Colouring, Vec<Snapshot>)> {
        let last = self.last.take()?;
        let newest = self.kept.last().is_some_and(|kept| kept.step == last.version.step);
        if !newest {
            self.keep(&last);
        }
        let colouring = self.colouring?;
        let (first, end) = (self.kept.first()?.t_s, self.kept.last()?.t_s);
        let (halfway, count) = (0.5 * (first + end), self.kept.len());
        let inner = 1..count.saturating_sub(1);
        let middle = inner.min_by(|&a, &b| {
            let away = |number: usize| (self.kept[number].t_s - halfway).abs();
            away(a).total_cmp(&away(b))
        });
        let mut number = 0;
        self.kept.retain(|_| {
            number += 1;
            number == 1 || number == count || Some(number - 1) == middle
        });
        Some((colouring, self.kept))
    }
}

/// The range of what colours some snapshots.
#[must_use]
pub fn range(snapshots: &[Snapshot]) -> Range {
    let mut range = Range::EMPTY;
    for sphere in snapshots.iter().flat_map(|snapshot| &snapshot.spheres) {
        range.include(&[f64::from(sphere.value)]);
    }
    range
}

/// Temperature, or the first scalar on particles, or their speed where there is none but their size.
fn colouring(fields: &Fields) -> Colouring {
    let scalar = |name: &str| {
        let field = fields.get(name)?;
        let fits = field.port.support == "particles" && field.components() == 1 && field.f64().is_ok();
        fits.then(|| Colouring { name: name.into(), unit: field.port.unit.clone() })
    };
    let others = fields.keys().filter(|name| *name != "radii");
    let first = scalar("temperature").or_else(|| others.filter_map(|name| scalar(name)).next());
    first.unwrap_or_else(|| Colouring { name: "speed".into(), unit: "m/s".into() })
}

fn spheres(fields: &Fields, colouring: &Colouring) -> Vec<Sphere> {
    let numbers = |name: &str| fields.get(name).and_then(|field| field.f64().ok());
    let (centres, _) = numbers("positions").unwrap_or_default().as_chunks::<3>();
    let radii = numbers("radii").unwrap_or_default();
    // Values on other rows, which a slower node may have left, are those of other particles.
    let support = fields.get("positions").map(|field| &field.support);
    let own = fields.get(&colouring.name).filter(|field| Some(&field.support) == support);
    let own = own.and_then(|field| field.f64().ok());
    let (velocities, _) = numbers("velocities").unwrap_or_default().as_chunks::<3>();
    let value = |row: usize| match own {
        Some(values) => values.get(row).copied(),
        None if colouring.name == "speed" => velocities.get(row).map(|[x, y, z]| math::hypot(math::hypot(*x, *y), *z)),
        None => None,
    };
    let sphere = |(row, centre): (usize, &[f64; 3])| Sphere {
        centre_m: centre.map(|length| length as f32),
        radius_m: radii.get(row).copied().unwrap_or_default() as f32,
        value: value(row).unwrap_or(f64::NAN) as f32,
    };
    centres.iter().enumerate().map(sphere).collect()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use stagger_messages::{Field, Measure, Port, Version};

    use super::*;

    fn step(number: u64, t_s: f64, fields: &[(&str, &str, u32, Vec<f64>)]) -> Step {
        let field = |(name, unit, components, values): &(&str, &str, u32, Vec<f64>)| {
            let port = Arc::new(Port::f64(name, unit, "particles", *components, Measure::None));
            ((*name).to_owned(), Field::new(&port, 0, values.clone()).unwrap())
        };
        let version = Version { step: number, attempt: 1, iteration: 1 };
        Step { version, t_s, dt_s: 0.0, fields: fields.iter().map(field).collect(), recorded: true }
    }

    fn falling(number: u64, t_s: f64) -> Step {
        step(number, t_s, &[("positions", "m", 3, vec![0.0, 0.0, -t_s]), ("radii", "m", 1, vec![0.5])])
    }

    #[test]
    fn start_middle_and_end_are_found_in_one_pass_whatever_the_length() {
        for steps in [1, 2, 3, 11, 12, 13, 100, 10_000] {
            let mut snapshots = Snapshots::default();
            (0..steps).for_each(|number| snapshots.take(&falling(number, number as f64)));
            assert!(snapshots.kept.len() <= KEPT);
            let (_, found) = snapshots.finish().unwrap();
            assert_eq!(found.len() as u64, steps.min(3), "{steps}");
            let (first, last) = (&found[0], &found[found.len() - 1]);
            assert_eq!((first.step, last.step), (0, steps - 1));
            if steps > 2 {
                // At least 6 are kept, evenly: the nearest is at most a twelfth of the run from its middle.
                let away = (found[1].t_s - 0.5 * last.t_s).abs() / last.t_s;
                assert!(away <= 1.0 / 12.0, "{steps}: {away}");
            }
        }
        assert!(Snapshots::default().finish().is_none());
    }

    #[test]
    fn particles_are_coloured_by_temperature_or_the_first_scalar_or_their_speed() {
        let positions = ("positions", "m", 3, vec![1.0, 2.0, 3.0]);
        let radii = ("radii", "m", 1, vec![0.5]);
        let velocities = ("velocities", "m/s", 3, vec![3.0, 0.0, -4.0]);
        let power = ("absorbed_power", "W", 1, vec![7.0]);
        let kelvin = ("temperature", "K", 1, vec![300.0]);
        let fields = [positions, radii, velocities, power, kelvin];
        for (count, name, value) in [(3, "speed", 5.0), (4, "absorbed_power", 7.0), (5, "temperature", 300.0)] {
            let mut snapshots = Snapshots::default();
            snapshots.take(&step(1, 0.0, &fields[..count]));
            let (colouring, found) = snapshots.finish().unwrap();
            assert_eq!(colouring.name, name);
            let [sphere] = found[0].spheres.as_slice() else { panic!("one particle") };
            assert_eq!((sphere.value, sphere.radius_m, sphere.centre_m), (value, 0.5, [1.0, 2.0, 3.0]));
            assert_eq!(range(&found), Range { min: f64::from(value), max: f64::from(value) });
        }
    }

    #[test]
    fn a_value_on_other_rows_colours_nobody() {
        let mut state = falling(1, 0.0);
        let port = Arc::new(Port::f64("temperature", "K", "particles", 1, Measure::None));
        state.fields.insert("temperature".into(), Field::new(&port, 1, vec![300.0]).unwrap());
        let mut snapshots = Snapshots::default();
        snapshots.take(&state);
        assert!(snapshots.finish().unwrap().1[0].spheres[0].value.is_nan());
    }
}
