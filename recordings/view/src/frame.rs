//! What is drawn of one state of a run: particles, contacts, beam, rays, stress in the ground; lengths in a unit that suits
//! their size.

use stagger_messages::Fields;
use stagger_recordings::Step;

use crate::{
    grid::Grid,
    layers::{Layers, On, f64s},
};

/// Size at which particles are drawn among their contacts.
const CONTACTS_SIZE: f64 = 0.4;
/// Length of the arrow of the fastest particle of the run, in radii.
const LONGEST_ARROW: f64 = 6.0;
/// Half the width of the line of the largest contact force, in radii.
const WIDEST_LINE: f64 = 0.4;
/// Room above the powder for what still falls at the start, in widths of the powder.
const HEADROOM: f64 = 0.4;
/// Height that powder which is going to fall is given in the view, in its widths.
const FALL: f64 = 1.2;

/// Fields with paths of rays.
const RAYS: [&str; 2] = ["ray_paths", "acoustic_paths"];

/// A unit of length in which the scene measures neither thousands nor thousandths: viewers are made for metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LengthUnit {
    /// Units per metre.
    pub per_metre: f64,
    /// Its symbol.
    pub symbol: &'static str,
}

impl LengthUnit {
    /// The unit in which `extent_m` lies between 1 and 1000, where there is one.
    pub fn for_extent(extent_m: f64) -> Self {
        let (per_metre, symbol) = match extent_m {
            extent if extent >= 1.0 => (1.0, "m"),
            extent if extent >= 1e-3 => (1e3, "mm"),
            extent if extent >= 1e-6 => (1e6, "µm"),
            _ => (1e9, "nm"),
        };
        Self { per_metre, symbol }
    }
}

/// What holds for all pictures of a run.
#[derive(Clone, Debug)]
pub struct Overview {
    /// The quantities that colour, with their ranges.
    pub layers: Layers,
    /// Unit of length of the pictures.
    pub unit: LengthUnit,
    /// Smallest and largest corner of what the camera shows, in `unit`.
    pub view: [[f64; 3]; 2],
    /// The same for the stress in the ground, where it is computed.
    pub ground: Option<[[f64; 3]; 2]>,
    /// Simulated times between which what the run is about goes on, where that is over at its end, in s.
    pub repeated_s: Option<[f64; 2]>,
    /// Simulated time at the end, in s; `None` while the run goes on.
    pub duration_s: Option<f64>,
}

/// What is drawn besides.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Marks {
    /// Lines between particles in contact.
    pub contacts: bool,
    /// Velocities as arrows.
    pub velocities: bool,
}

/// One picture.
#[derive(Clone, Debug, Default)]
pub struct Frame {
    /// Centres of the particles.
    pub centres: Vec<[f32; 3]>,
    /// Their radii.
    pub radii: Vec<f32>,
    /// Colours of each layer: of the particles, or of the points in the ground.
    pub colours: Vec<Vec<[u8; 3]>>,
    /// Points in the ground where stress is computed.
    pub ground: Vec<[f32; 3]>,
    /// Size at which they are drawn.
    pub ground_radius: f32,
    /// Paths of rays of light or sound.
    pub rays: Vec<Vec<[f32; 3]>>,
    /// Lines between the centres of particles in contact.
    pub contacts: Vec<[[f32; 3]; 2]>,
    /// The same where their forces are known, and the lines' widths.
    pub forces: (Vec<[[f32; 3]; 2]>, Vec<f32>),
    /// Velocities as arrows from the centres.
    pub velocities: Vec<[f32; 3]>,
    /// The beam of each laser, where it is on.
    pub beams: Vec<Option<Beam>>,
}

/// The beam's spot.
#[derive(Clone, Debug, PartialEq)]
pub struct Beam {
    /// Centre of the spot.
    pub spot: [f32; 3],
    /// Radius of the spot.
    pub radius: f32,
    /// Height at which it meets the powder.
    pub surface: f32,
    /// Height up to which it is drawn: one radius above.
    pub top: f32,
    /// Its power with the unit.
    pub label: String,
}

/// Smallest and largest corner of the particles but for strays, in m; `None` where there are none.
///
/// In each direction, of a hundred centres the outermost may lie beyond at either end: one that was thrown up from the
/// powder should not make everything small.
pub fn bounds_m(fields: &Fields) -> Option<[[f64; 3]; 2]> {
    let (centres, _) = f64s(fields, "positions")?.as_chunks::<3>();
    let centres: Vec<_> = centres.iter().filter(|centre| centre.iter().all(|length| length.is_finite())).collect();
    let last = centres.len().checked_sub(1)?;
    let strays = last / 100;
    let radius = f64s(fields, "radii").unwrap_or_default().iter().copied().fold(0.0, f64::max);
    let mut bounds = [[-radius; 3], [radius; 3]];
    for axis in 0..3 {
        let mut lengths: Vec<f64> = centres.iter().map(|centre| centre[axis]).collect();
        // Of many thousand centres, sorting all would take most of the time of a picture.
        bounds[0][axis] += *lengths.select_nth_unstable_by(strays, f64::total_cmp).1;
        bounds[1][axis] += *lengths.select_nth_unstable_by(last - strays, f64::total_cmp).1;
    }
    Some(bounds)
}

impl Overview {
    /// Sets up pictures for a run of which `step` is shown first: the last state of a recording that starts within the
    /// corners `start_m`, or the first state of a run under way. `None` where it has no particles.
    pub fn new(step: &Step, layers: Layers, start_m: Option<[[f64; 3]; 2]>) -> Option<Self> {
        let mut view = bounds_m(&step.fields)?;
        let surface = view[1][2];
        let width = (0..2).map(|axis| view[1][axis] - view[0][axis]).fold(0.0, f64::max);
        // What is going to fall on the ground, or falls on the others at the start, is seen as far as it does not make
        // those small that lie.
        let mut top = surface;
        if let Some([_, high]) = start_m {
            top = top.max(high[2].min(surface + HEADROOM * width));
        } else {
            view[0][2] = view[0][2].min(0.0);
            top = top.min(view[0][2] + FALL * width);
        }
        let beam = f64s(&step.fields, "beam_radius").and_then(|radius| radius.first()).copied().unwrap_or_default();
        view[1][2] = top.max(top.min(surface) + beam);
        let extent = (0..3).map(|axis| view[1][axis] - view[0][axis]).fold(0.0, f64::max);
        let unit = LengthUnit::for_extent(extent);
        let view = view.map(|corner| corner.map(|length| length * unit.per_metre));
        let ground = Grid::of(&step.fields).map(|grid| {
            let mut corners = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
            for point in &grid.points_m {
                for axis in 0..3 {
                    let length = point[axis] * unit.per_metre;
                    corners[0][axis] = corners[0][axis].min(length);
                    corners[1][axis] = corners[1][axis].max(length);
                }
            }
            corners
        });
        let duration_s = start_m.map(|_| step.t_s);
        Some(Self { layers, unit, view, ground, repeated_s: None, duration_s })
    }

    /// The same, shown from its start on and then again and again between two times, in s: the camera sees the particles
    /// at the start, at `start_m`, as well.
    pub fn repeating(mut self, range_s: [f64; 2], start_m: Option<[[f64; 3]; 2]>) -> Self {
        self.repeated_s = Some(range_s);
        for (axis, low, high) in start_m.into_iter().flat_map(|[low, high]| (0..3).map(move |i| (i, low[i], high[i]))) {
            self.view[0][axis] = self.view[0][axis].min(low * self.unit.per_metre);
            self.view[1][axis] = self.view[1][axis].max(high * self.unit.per_metre);
        }
        self
    }

    /// The picture of a state.
    pub fn frame(&self, fields: &Fields, marks: Marks) -> Frame {
        let scaled = |length: &f64| (length * self.unit.per_metre) as f32;
        let (centres, _) = f64s(fields, "positions").unwrap_or_default().as_chunks::<3>();
        let centres: Vec<[f32; 3]> = centres.iter().map(|[x, y, z]| [x, y, z].map(scaled)).collect();
        // Whole particles would hide the lines between them.
        let size = if marks.contacts || marks.velocities { CONTACTS_SIZE } else { 1.0 };
        let radii = f64s(fields, "radii").unwrap_or_default().iter().map(|radius| scaled(&(radius * size))).collect();
        let contacts = if marks.contacts { lines(fields, &centres) } else { Vec::new() };
        let velocities = if marks.velocities { self.arrows(fields) } else { Vec::new() };
        let forces = self.forces(fields, &centres);
        let mut colours = self.layers.colours(fields);
        let (mut ground, mut ground_radius) = (Vec::new(), 0.0);
        if let Some(grid) = Grid::of(fields) {
            ground = grid.points_m.iter().map(|point| point.map(|length| scaled(&length))).collect();
            ground_radius = 0.5 * scaled(&grid.spacing_m);
            for (layer, colours) in self.layers.iter().zip(&mut colours) {
                if layer.quantity.on == On::Grid {
                    *colours = grid.rows.iter().filter_map(|&row| colours.get(row).copied()).collect();
                }
            }
        }
        let paths = RAYS.into_iter().flat_map(|name| writers(fields, name).map(move |node| format!("{node}{name}")));
        let rays = paths.flat_map(|name| self.rays(fields, &name)).collect();
        Frame {
            centres,
            radii,
            colours,
            ground,
            ground_radius,
            rays,
            contacts,
            forces,
            velocities,
            beams: writers(fields, "beam_power").map(|laser| self.beam(fields, laser)).collect(),
        }
    }

    /// The way of each particle in the time in which the fastest of the run goes some radii.
    fn arrows(&self, fields: &Fields) -> Vec<[f32; 3]> {
        let (velocities, _) = f64s(fields, "velocities").unwrap_or_default().as_chunks::<3>();
        let time_s = LONGEST_ARROW * mean_radius_m(fields) / self.layers.fastest_m_s.max(f64::MIN_POSITIVE);
        let way = |velocity: &[f64; 3]| velocity.map(|component| (component * time_s * self.unit.per_metre) as f32);
        velocities.iter().map(way).collect()
    }

    /// Lines between particles in contact, the wider the larger their force.
    fn forces(&self, fields: &Fields, centres: &[[f32; 3]]) -> (Vec<[[f32; 3]; 2]>, Vec<f32>) {
        let (Some(forces), Some(layer)) =
            (f64s(fields, "contact_normal_force"), self.layers.iter().find(|layer| layer.quantity.on == On::Contacts))
        else {
            return (Vec::new(), Vec::new());
        };
        let widest = WIDEST_LINE * mean_radius_m(fields) * self.unit.per_metre;
        let largest = layer.range.max.max(f64::MIN_POSITIVE);
        let width = |force: &f64| (widest * (force / largest).clamp(0.0, 1.0).sqrt()) as f32;
        (lines(fields, centres), forces.iter().map(width).collect())
    }

    /// Paths of the rays of one kind. A path that ends early repeats its last point, and one that goes nowhere is no ray.
    fn rays(&self, fields: &Fields, name: &str) -> Vec<Vec<[f32; 3]>> {
        let Some(field) = fields.get(name) else { return Vec::new() };
        let (points, _) = field.f64().unwrap_or_default().as_chunks::<3>();
        let points: Vec<[f32; 3]> =
            points.iter().map(|point| point.map(|length| (length * self.unit.per_metre) as f32)).collect();
        let of_one = field.components() / 3;
        let mut paths: Vec<Vec<_>> = points.chunks(of_one.max(1)).map(<[_]>::to_vec).collect();
        paths.iter_mut().for_each(Vec::dedup);
        paths.retain(|path| path.len() > 1);
        paths
    }

    fn beam(&self, fields: &Fields, laser: &str) -> Option<Beam> {
        let values = |name: &str| f64s(fields, &format!("{laser}{name}"));
        let power_w = *values("beam_power")?.first()?;
        let (spot, _) = values("beam_spot")?.as_chunks::<3>();
        let radius_m = *values("beam_radius")?.first()?;
        let scaled = |length: f64| (length * self.unit.per_metre) as f32;
        let spot = spot.first()?.map(scaled);
        let radius = scaled(radius_m);
        // A spot above the powder has its light drawn all the same, and one on powder above the view is still seen.
        let powder = bounds_m(fields).map_or(spot[2], |[_, high]| scaled(high[2]));
        let surface = powder.min(self.view[1][2] as f32 - radius).max(spot[2]);
        let beam = Beam { spot, radius, surface, top: surface + radius, label: watts(power_w) };
        (power_w > 0.0).then_some(beam)
    }
}

/// What stands before the name of a field of each node that writes it: nothing for the first one, `node/` for others (see
/// [`stagger_recordings::Steps`]).
fn writers<'a>(fields: &'a Fields, name: &'a str) -> impl Iterator<Item = &'a str> {
    fields.keys().filter_map(move |key| key.strip_suffix(name)).filter(|node| node.is_empty() || node.ends_with('/'))
}

fn mean_radius_m(fields: &Fields) -> f64 {
    let radii = f64s(fields, "radii").unwrap_or_default();
    radii.iter().sum::<f64>() / radii.len().max(1) as f64
}

fn lines(fields: &Fields, centres: &[[f32; 3]]) -> Vec<[[f32; 3]; 2]> {
    let pairs = fields.get("contact_pairs").and_then(|field| field.u32().ok()).unwrap_or_default();
    let (pairs, _) = pairs.as_chunks::<2>();
    let line = |[i, j]: &[u32; 2]| Some([*centres.get(*i as usize)?, *centres.get(*j as usize)?]);
    pairs.iter().filter_map(line).collect()
}

/// Power with at most three digits and its unit.
fn watts(power_w: f64) -> String {
    match power_w {
        power if power >= 1e3 => format!("{:.3} kW", power / 1e3),
        power if power >= 10.0 => format!("{power:.1} W"),
        power => format!("{power:.3} W"),
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use stagger_messages::{Field, Measure, Port, Supports, Values, Version};

    use super::*;

    const BOTH: Marks = Marks { contacts: true, velocities: true };
    use crate::colour::Scale;

    fn field(name: &str, unit: &str, support: &str, components: u32, values: impl Into<Values>) -> (String, Field) {
        let port = Arc::new(Port::f64(name, unit, support, components, Measure::None));
        (name.into(), Field::new(&port, 0, values).unwrap())
    }

    fn step() -> Step {
        let pairs = Field::new(&Arc::new(Port::u32("contact_pairs", "contacts", 2)), 0, vec![0u32, 1, 1, 7]).unwrap();
        let fields = Fields::from([
            field("positions", "m", "particles", 3, vec![0.0, 0.0, 1e-4, 2e-4, 0.0, 1e-4]),
            field("radii", "m", "particles", 1, vec![1e-5, 2e-5]),
            field("temperature", "K", "particles", 1, vec![300.0, 400.0]),
            field("beam_spot", "m", "beam", 3, vec![1e-4, 0.0, 0.0]),
            field("beam_radius", "m", "beam", 1, vec![6e-5]),
            field("beam_power", "W", "beam", 1, vec![40.0]),
            ("contact_pairs".into(), pairs),
        ]);
        Step {
            version: Version::first(1),
            t_s: 1e-3,
            dt_s: 1e-4,
            fields,
            supports: Supports::default(),
            recorded: true,
        }
    }

    fn layers() -> Layers {
        let mut layers = Layers::default();
        layers.include(&step().fields);
        layers
    }

    #[test]
    fn the_fastest_particle_has_the_longest_arrow_and_the_largest_force_the_widest_line() {
        let mut step = step();
        let pairs = Field::new(&Arc::new(Port::u32("contact_pairs", "contacts", 2)), 0, vec![0u32, 1, 1, 0]).unwrap();
        step.fields.insert("contact_pairs".into(), pairs);
        step.fields.extend([
            field("velocities", "m/s", "particles", 3, vec![0.0, 0.0, -2.0, 1.0, 0.0, 0.0]),
            field("contact_normal_force", "N", "contacts", 1, vec![4.0, 1.0]),
        ]);
        let mut layers = Layers::default();
        layers.include(&step.fields);
        let frame = Overview::new(&step, layers, None).unwrap().frame(&step.fields, BOTH);
        // Six mean radii of 15 µm for 2 m/s.
        assert_eq!(frame.velocities, [[0.0, 0.0, -90.0], [45.0, 0.0, 0.0]]);
        // As the square root of the force, the widest 0.4 radii to either side.
        assert_eq!(frame.forces.1, [6.0, 3.0]);
        assert_eq!((frame.forces.0.len(), frame.colours[1].len()), (2, 2));
    }

    #[test]
    fn a_small_scene_is_drawn_in_units_of_its_size() {
        let overview = Overview::new(&step(), layers(), bounds_m(&step().fields)).unwrap();
        assert_eq!(overview.unit.symbol, "µm");
        let frame = overview.frame(&step().fields, BOTH);
        assert_eq!(frame.radii, [4.0, 8.0]);
        assert_eq!(overview.frame(&step().fields, Marks::default()).radii, [10.0, 20.0]);
        let range = overview.layers.iter().next().unwrap().range;
        assert_eq!(frame.colours, [[300.0, 400.0].map(|kelvin| range.colour(kelvin, Scale::Linear))]);
        let spot = [100.0, 0.0, 0.0];
        let beam = Beam { spot, radius: 60.0, surface: 120.0, top: 180.0, label: "40.0 W".into() };
        assert_eq!(frame.beams, [Some(beam)]);
        // The second pair names a particle that is not there, and is left out.
        assert_eq!(frame.contacts, vec![[[0.0, 0.0, 100.0], [200.0, 0.0, 100.0]]]);
        // Up to where the beam is drawn.
        let view = overview.view.concat();
        let expected = [-20.0, -20.0, 80.0, 220.0, 20.0, 180.0];
        assert!(view.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-9), "{view:?}");
    }

    #[test]
    fn a_temperature_of_other_particles_colours_none() {
        let mut fields = step().fields;
        let port = Arc::clone(&fields["temperature"].port);
        // As many, but one has gone and another come.
        fields.insert("temperature".into(), Field::new(&port, 1, vec![300.0, 400.0]).unwrap());
        let overview = Overview::new(&step(), layers(), None).unwrap();
        let frame = overview.frame(&fields, Marks::default());
        assert_eq!((frame.centres.len(), frame.radii.len(), frame.colours[0].len()), (2, 2, 0));
        // None left: nothing is drawn, and nothing fails.
        let none = fields.into_values().map(|field| {
            let support = stagger_messages::Support { count: 0, revision: 2, ..field.support.clone() };
            let values = Values::from_bytes(field.port.kind(), Vec::new().into());
            (field.name().to_owned(), Field::with_support(field.port, support, values).unwrap())
        });
        let none: Fields = none.collect();
        assert!(bounds_m(&none).is_none());
        let frame = overview.frame(&none, BOTH);
        assert!(frame.centres.is_empty() && frame.colours[0].is_empty() && frame.contacts.is_empty());
    }

    #[test]
    fn the_view_leaves_strays_out_and_some_room_above() {
        let mut step = step();
        let lying = (0..200).flat_map(|i| [f64::from(i) * 1e-5, 0.0, 0.0]);
        let thrown_up = [1e-3, 0.0, 1.0];
        step.fields.extend([
            field("positions", "m", "particles", 3, lying.chain(thrown_up).collect::<Vec<_>>()),
            field("radii", "m", "particles", 1, vec![1e-5; 201]),
        ]);
        let [low, high] = bounds_m(&step.fields).unwrap();
        assert!((high[2] - 1e-5).abs() < 1e-12 && (low[2] + 1e-5).abs() < 1e-12, "{low:?} to {high:?}");
        let width = high[0] - low[0];
        let room = |start| {
            let overview = Overview::new(&step, Layers::default(), start).unwrap();
            overview.view[1][2] / overview.unit.per_metre - high[2]
        };
        // What falls from 0.5 m starts out of view.
        let start = Some([[0.0; 3], [0.0, 0.0, 0.5]]);
        assert!((room(start) - HEADROOM * width).abs() < 1e-12, "{} above {width}", room(start));
        // It lies already; the beam is drawn one radius, 60 µm, above.
        assert!((room(None) - 6e-5).abs() < 1e-12, "{}", room(None));
    }

    #[test]
    fn a_beam_without_power_is_hidden() {
        let mut fields = step().fields;
        fields.extend([field("beam_power", "W", "beam", 1, vec![0.0])]);
        let overview = Overview::new(&step(), layers(), None).unwrap();
        assert_eq!(overview.frame(&fields, Marks::default()).beams, [None]);
        // A second laser, which is on.
        for (name, unit, components, value) in [
            ("beam_spot", "m", 3, vec![0.0; 3]),
            ("beam_radius", "m", 1, vec![6e-5]),
            ("beam_power", "W", 1, vec![5.0]),
        ] {
            fields.insert(format!("second/{name}"), field(name, unit, "beam", components, value).1);
        }
        let beams = overview.frame(&fields, Marks::default()).beams;
        let labels: Vec<_> = beams.iter().map(|beam| beam.as_ref().map(|beam| beam.label.as_str())).collect();
        assert_eq!(labels, [None, Some("5.000 W")]);
    }

    #[test]
    fn rays_and_stress_are_drawn_in_the_unit_of_the_picture() {
        let mut step = step();
        step.fields.extend([
            // One ray down and aside, which ends early; one that was not sent.
            field("ray_paths", "m", "rays", 9, [[0.0, 0.0, 1e-3, 0.0, 0.0, 2e-4, 1e-4, 0.0, 2e-4], [0.0; 9]].concat()),
            field("stress_position", "m", "grid", 3, vec![0.0, 0.0, -1e-4, 2e-4, 0.0, -1e-4]),
            field("stress_deviator_norm", "Pa", "grid", 1, vec![1e3, 1e5]),
        ]);
        let mut layers = Layers::default();
        layers.include(&step.fields);
        let overview = Overview::new(&step, layers, bounds_m(&step.fields)).unwrap();
        let frame = overview.frame(&step.fields, Marks::default());
        assert_eq!(frame.rays, [vec![[0.0, 0.0, 1000.0], [0.0, 0.0, 200.0], [100.0, 0.0, 200.0]]]);
        assert_eq!((frame.ground.len(), frame.colours[1].len()), (2, 2));
        assert!((frame.ground_radius - 100.0).abs() < 1e-3);
        let ground = overview.ground.unwrap().concat();
        let expected = [0.0, 0.0, -100.0, 200.0, 0.0, -100.0];
        assert!(ground.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-9), "{ground:?}");
    }
}
