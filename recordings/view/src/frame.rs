//! What is drawn of one state of a run: spheres, contacts, grids, points, beams, rays; lengths in a unit that suits their
//! size.

use std::{collections::BTreeMap, sync::Arc};

use stagger_messages::{Fields, geometry::Shape};
use stagger_recordings::{Step, display::quantities::Spheres};

use crate::{
    bounds::{Corners, bounds_m, others_m},
    faces::Faces,
    layers::{Coloured, Layer, Layers},
    sections::Sections,
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
    pub view: Corners,
    /// The same for each grid and for points without radii, by the name of their support.
    pub others: BTreeMap<String, Corners>,
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

/// What the picture of a layer shows beside its colours.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Body {
    /// Nothing: the state has no such rows.
    #[default]
    Nothing,
    /// Spheres, with one radius or one for each.
    Spheres(Arc<Vec<[f32; 3]>>, Arc<Vec<f32>>),
    /// Lines between spheres, and half their widths.
    Lines(Vec<[[f32; 3]; 2]>, Vec<f32>),
    /// Triangles between corners.
    Faces(Vec<[f32; 3]>, Vec<[u32; 3]>),
}

/// One picture.
#[derive(Clone, Debug, Default)]
pub struct Frame {
    /// Centres of the particles.
    pub centres: Arc<Vec<[f32; 3]>>,
    /// Their radii.
    pub radii: Arc<Vec<f32>>,
    /// What each layer shows, and the colours of its rows.
    pub layers: Vec<(Body, Vec<[u8; 3]>)>,
    /// Paths of rays of light or sound.
    pub rays: Vec<Vec<[f32; 3]>>,
    /// Lines between the centres of particles in contact.
    pub contacts: Vec<[[f32; 3]; 2]>,
    /// Velocities as arrows from the centres.
    pub velocities: Vec<[f32; 3]>,
    /// The beam of each laser, where it is on.
    pub beams: Vec<Option<Beam>>,
}

impl Frame {
    /// Length beside which marks are drawn: the radius of the first particle.
    pub fn scale(&self) -> f32 {
        self.radii.first().copied().unwrap_or(1.0)
    }
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

impl Overview {
    /// Sets up pictures for a run of which `step` is shown first: the last state of a recording that starts within the
    /// corners `start_m`, or the first state of a run under way. `None` where it shows nothing.
    pub fn new(step: &Step, layers: Layers, start_m: Option<Corners>) -> Option<Self> {
        let mut view = bounds_m(step)?;
        if Spheres::of(step).is_some() {
            make_room(&mut view, step, start_m);
        }
        let extent = (0..3).map(|axis| view[1][axis] - view[0][axis]).fold(0.0, f64::max);
        let unit = LengthUnit::for_extent(extent);
        let scaled = |corners: Corners| corners.map(|corner| corner.map(|length| length * unit.per_metre));
        let others = others_m(step).into_iter().map(|(support, corners)| (support, scaled(corners))).collect();
        let duration_s = start_m.map(|_| step.t_s);
        Some(Self { layers, unit, view: scaled(view), others, repeated_s: None, duration_s })
    }

    /// The same, shown from its start on and then again and again between two times, in s: the camera sees the particles
    /// at the start, at `start_m`, as well.
    pub fn repeating(mut self, range_s: [f64; 2], start_m: Option<Corners>) -> Self {
        self.repeated_s = Some(range_s);
        for (axis, low, high) in start_m.into_iter().flat_map(|[low, high]| (0..3).map(move |i| (i, low[i], high[i]))) {
            self.view[0][axis] = self.view[0][axis].min(low * self.unit.per_metre);
            self.view[1][axis] = self.view[1][axis].max(high * self.unit.per_metre);
        }
        self
    }

    /// The picture of a state of which `coloured` colours.
    pub fn frame(&self, step: &Step, coloured: &Coloured, marks: Marks) -> Frame {
        let spheres = Spheres::of(step);
        // Whole particles would hide the lines between them.
        let size = if marks.contacts || marks.velocities { CONTACTS_SIZE } else { 1.0 };
        let mut frame = Frame::default();
        if let Some(spheres) = &spheres {
            frame.centres = Arc::new(self.scaled(spheres.centres_m));
            frame.radii = Arc::new(spheres.radii_m.iter().map(|radius| self.length(radius * size)).collect());
            if marks.velocities {
                frame.velocities = self.arrows(spheres);
            }
        }
        let shapes = step.supports.shapes(&step.fields);
        let between = |shape: &Shape| lines(step, shape, &frame.centres);
        if marks.contacts {
            frame.contacts = shapes.values().filter_map(between).flatten().collect();
        }
        frame.layers = self
            .layers
            .iter()
            .map(|layer| {
                let values = coloured.iter().find(|(quantity, _)| *quantity == *layer.quantity);
                let values = values.map(|(_, values)| values.as_slice()).unwrap_or_default();
                match shapes.get(&layer.quantity.support) {
                    Some(shape) => self.layer(step, layer, shape, values, &frame),
                    None => (Body::Nothing, Vec::new()),
                }
            })
            .collect();
        frame.rays = shapes.values().flat_map(|shape| self.rays(step, shape)).collect();
        frame.beams = writers(&step.fields, "beam_power").map(|laser| self.beam(step, laser)).collect();
        frame
    }

    fn length(&self, metres: f64) -> f32 {
        (metres * self.unit.per_metre) as f32
    }

    fn scaled(&self, places_m: &[[f64; 3]]) -> Vec<[f32; 3]> {
        places_m.iter().map(|place_m| place_m.map(|metres| self.length(metres))).collect()
    }

    /// What a layer's picture shows of a state, and the colours of it.
    fn layer(&self, step: &Step, layer: &Layer, shape: &Shape, values: &[f64], frame: &Frame) -> (Body, Vec<[u8; 3]>) {
        let colour = |value: &f64| layer.range.colour(*value, layer.scale);
        let of_rows = |rows: &[usize]| rows.iter().filter_map(|row| values.get(*row).map(colour)).collect();
        match shape {
            Shape::Points(points) if !points.radii.is_empty() => (
                Body::Spheres(Arc::clone(&frame.centres), Arc::clone(&frame.radii)),
                values.iter().map(colour).collect(),
            ),
            Shape::Points(points) => {
                let positions = points.places(&step.fields).ok().and_then(|(positions, _)| positions.f64().ok());
                let seen = Sections::of(positions.unwrap_or_default().as_chunks::<3>().0);
                let radius = self.length(0.5 * seen.spacing_m);
                (Body::Spheres(self.scaled(&seen.points_m).into(), vec![radius].into()), of_rows(&seen.rows))
            }
            Shape::Grid(grid) => {
                let faces = Faces::of(grid);
                (Body::Faces(self.scaled(&faces.corners_m), faces.triangles), of_rows(&faces.rows))
            }
            Shape::Pairs(_) => {
                let lines = lines(step, shape, &frame.centres).unwrap_or_default();
                let widest = WIDEST_LINE * Spheres::of(step).map_or(0.0, |spheres| spheres.mean_radius_m());
                let largest = layer.range.max.max(f64::MIN_POSITIVE);
                // The wider the larger their value.
                let width = |value: &f64| self.length(widest * (value / largest).clamp(0.0, 1.0).sqrt());
                (Body::Lines(lines, values.iter().map(width).collect()), values.iter().map(colour).collect())
            }
            Shape::Global(_) => (Body::Nothing, Vec::new()),
        }
    }

    /// The way of each particle in the time in which the fastest of the run goes some radii.
    fn arrows(&self, spheres: &Spheres<'_>) -> Vec<[f32; 3]> {
        let time_s = LONGEST_ARROW * spheres.mean_radius_m() / self.layers.fastest_m_s.max(f64::MIN_POSITIVE);
        let way = |velocity: &[f64; 3]| velocity.map(|component| self.length(component * time_s));
        spheres.velocities_m_s.iter().map(way).collect()
    }

    /// Paths of the rays of one kind: points of which each row has several. A path that ends early repeats its last point,
    /// and one that goes nowhere is no ray.
    fn rays(&self, step: &Step, shape: &Shape) -> Vec<Vec<[f32; 3]>> {
        let Shape::Points(points) = shape else { return Vec::new() };
        // Each laser has rays of its own.
        let fields = writers(&step.fields, &points.positions).map(|node| format!("{node}{}", points.positions));
        let fields = fields.filter_map(|name| step.fields.get(&name));
        let fields = fields.filter(|field| field.components() > 3 && field.components().is_multiple_of(3));
        let of_field = |field: &stagger_messages::Field| {
            let points = self.scaled(field.f64().unwrap_or_default().as_chunks::<3>().0);
            points.chunks(field.components() / 3).map(<[_]>::to_vec).collect::<Vec<_>>()
        };
        let mut paths: Vec<Vec<_>> = fields.flat_map(of_field).collect();
        paths.iter_mut().for_each(Vec::dedup);
        paths.retain(|path| path.len() > 1);
        paths
    }

    fn beam(&self, step: &Step, laser: &str) -> Option<Beam> {
        let values = |name: &str| f64s(&step.fields, &format!("{laser}{name}"));
        let power_w = *values("beam_power")?.first()?;
        let (spot, _) = values("beam_spot")?.as_chunks::<3>();
        let radius_m = *values("beam_radius")?.first()?;
        let spot = spot.first()?.map(|length| self.length(length));
        let radius = self.length(radius_m);
        // A spot above the powder has its light drawn all the same, and one on powder above the view is still seen.
        let powder = bounds_m(step).map_or(spot[2], |[_, high]| self.length(high[2]));
        let surface = powder.min(self.view[1][2] as f32 - radius).max(spot[2]);
        let beam = Beam { spot, radius, surface, top: surface + radius, label: watts(power_w) };
        (power_w > 0.0).then_some(beam)
    }
}

/// Makes room above spheres, for what falls and for the beam.
fn make_room(view: &mut Corners, step: &Step, start_m: Option<Corners>) {
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
}

/// What stands before the name of a field of each node that writes it: nothing for the first one, `node/` for others (see
/// [`stagger_recordings::Steps`]).
fn writers<'a>(fields: &'a Fields, name: &'a str) -> impl Iterator<Item = &'a str> {
    fields.keys().filter_map(move |key| key.strip_suffix(name)).filter(|node| node.is_empty() || node.ends_with('/'))
}

/// Values of a field of numbers.
fn f64s<'a>(fields: &'a Fields, name: &str) -> Option<&'a [f64]> {
    fields.get(name).and_then(|field| field.f64().ok())
}

/// Lines between the centres of pairs of spheres; `None` where the rows are no such pairs. A pair with a sphere that is not
/// there is left out.
fn lines(step: &Step, shape: &Shape, centres: &[[f32; 3]]) -> Option<Vec<[[f32; 3]; 2]>> {
    let Shape::Pairs(pairs) = shape else { return None };
    // The partner in the other kind of pair, such as a wall, has no centre.
    if !pairs.others.is_empty() && pairs.others != pairs.of {
        return None;
    }
    let (indices, _) = step.fields.get(&pairs.indices)?.u32().ok()?.as_chunks::<2>();
    let line = |[i, j]: &[u32; 2]| Some([*centres.get(*i as usize)?, *centres.get(*j as usize)?]);
    Some(indices.iter().filter_map(line).collect())
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
    use stagger_messages::{Field, Geometry, Grid, Port, Ports, Supports, Values};

    use super::*;
    use crate::{
        bounds::of_spheres_m,
        colour::Scale,
        testing::{self, field},
    };

    const BOTH: Marks = Marks { contacts: true, velocities: true };

    fn step() -> Step {
        let pairs = Field::new(&Arc::new(Port::u32("contact_pairs", "contacts", 2)), 0, vec![0u32, 1, 1, 7]).unwrap();
        testing::step([
            field("positions", "m", "particles", 3, vec![0.0, 0.0, 1e-4, 2e-4, 0.0, 1e-4]),
            field("radii", "m", "particles", 1, vec![1e-5, 2e-5]),
            field("temperature", "K", "particles", 1, vec![300.0, 400.0]),
            field("beam_spot", "m", "beam", 3, vec![1e-4, 0.0, 0.0]),
            field("beam_radius", "m", "beam", 1, vec![6e-5]),
            field("beam_power", "W", "beam", 1, vec![40.0]),
            ("contact_pairs".into(), pairs),
        ])
    }

    fn drawn(overview: &Overview, step: &Step, marks: Marks) -> Frame {
        overview.frame(step, &overview.layers.coloured(step), marks)
    }

    fn layers() -> Layers {
        let mut layers = Layers::default();
        layers.include(&step(), &layers.coloured(&step()));
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
        layers.include(&step, &layers.coloured(&step));
        let frame = drawn(&Overview::new(&step, layers, None).unwrap(), &step, BOTH);
        // Six mean radii of 15 µm for 2 m/s.
        assert_eq!(frame.velocities, [[0.0, 0.0, -90.0], [45.0, 0.0, 0.0]]);
        // As the square root of the force, the widest 0.4 radii to either side.
        let (Body::Lines(lines, widths), colours) = &frame.layers[1] else { panic!("{:?}", frame.layers[1]) };
        assert_eq!((widths.as_slice(), lines.len(), colours.len()), (&[6.0, 3.0][..], 2, 2));
    }

    #[test]
    fn a_small_scene_is_drawn_in_units_of_its_size() {
        let overview = Overview::new(&step(), layers(), bounds_m(&step())).unwrap();
        assert_eq!(overview.unit.symbol, "µm");
        let frame = drawn(&overview, &step(), BOTH);
        assert_eq!(*frame.radii, [4.0, 8.0]);
        assert_eq!(*drawn(&overview, &step(), Marks::default()).radii, [10.0, 20.0]);
        let range = overview.layers.iter().next().unwrap().range;
        let colours = [300.0, 400.0].map(|kelvin| range.colour(kelvin, Scale::Linear)).to_vec();
        assert_eq!(frame.layers, [(Body::Spheres(frame.centres.clone(), frame.radii.clone()), colours)]);
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
        let mut other = step();
        let port = Arc::clone(&other.fields["temperature"].port);
        // As many, but one has gone and another come.
        other.fields.insert("temperature".into(), Field::new(&port, 1, vec![300.0, 400.0]).unwrap());
        let overview = Overview::new(&step(), layers(), None).unwrap();
        let frame = drawn(&overview, &other, Marks::default());
        assert_eq!((frame.centres.len(), frame.radii.len(), frame.layers[0].1.len()), (2, 2, 0));
        // None left: nothing is drawn, and nothing fails.
        let none = other.fields.into_values().map(|field| {
            let support = stagger_messages::Support { count: 0, revision: 2, ..field.support.clone() };
            let values = Values::from_bytes(field.port.kind(), Vec::new().into());
            (field.name().to_owned(), Field::with_support(field.port, support, values).unwrap())
        });
        let none = testing::step(none);
        assert!(bounds_m(&none).is_none());
        let frame = drawn(&overview, &none, BOTH);
        assert!(frame.centres.is_empty() && frame.layers[0].1.is_empty() && frame.contacts.is_empty());
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
        let [low, high] = of_spheres_m(&Spheres::of(&step).unwrap()).unwrap();
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
        let mut step = step();
        step.fields.extend([field("beam_power", "W", "beam", 1, vec![0.0])]);
        let overview = Overview::new(&step, layers(), None).unwrap();
        assert_eq!(drawn(&overview, &step, Marks::default()).beams, [None]);
        // A second laser, which is on.
        for (name, unit, components, value) in [
            ("beam_spot", "m", 3, vec![0.0; 3]),
            ("beam_radius", "m", 1, vec![6e-5]),
            ("beam_power", "W", 1, vec![5.0]),
        ] {
            step.fields.insert(format!("second/{name}"), field(name, unit, "beam", components, value).1);
        }
        let beams = drawn(&overview, &step, Marks::default()).beams;
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
        layers.include(&step, &layers.coloured(&step));
        let overview = Overview::new(&step, layers, bounds_m(&step)).unwrap();
        let frame = drawn(&overview, &step, Marks::default());
        assert_eq!(frame.rays, [vec![[0.0, 0.0, 1000.0], [0.0, 0.0, 200.0], [100.0, 0.0, 200.0]]]);
        let (Body::Spheres(centres, radii), colours) = &frame.layers[1] else { panic!("{:?}", frame.layers[1]) };
        assert_eq!((centres.len(), colours.len()), (2, 2));
        assert!((radii[0] - 100.0).abs() < 1e-3 && radii.len() == 1);
        let ground = overview.others["grid"].concat();
        let expected = [0.0, 0.0, -100.0, 200.0, 0.0, -100.0];
        assert!(ground.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-9), "{ground:?}");
    }

    #[test]
    fn a_run_without_particles_shows_its_grid() {
        let mut step = testing::step([field("w", "K", "cells", 1, vec![1.0, 2.0, 3.0, 4.0])]);
        let cells = Geometry::grid("cells", Grid::of_cells([0.0; 3], [1e-3; 3], [2, 2, 1]));
        step.supports = Supports::of([&Ports::new(Vec::new(), Vec::new()).with(cells)]);
        let mut layers = Layers::default();
        layers.include(&step, &layers.coloured(&step));
        let overview = Overview::new(&step, layers, None).unwrap();
        assert_eq!((overview.unit.symbol, overview.view), ("mm", [[0.0, 1.0, 0.0], [2.0, 2.0, 1.0]]));
        let frame = drawn(&overview, &step, BOTH);
        let (Body::Faces(corners, triangles), colours) = &frame.layers[0] else { panic!("{:?}", frame.layers[0]) };
        // Two cells of the section, one of the right side, two of the upper one.
        assert_eq!((corners.len(), triangles.len(), colours.len()), (20, 10, 20));
        let range = overview.layers.iter().next().unwrap().range;
        assert_eq!((colours[0], colours[19]), (range.colour(3.0, Scale::Linear), range.colour(4.0, Scale::Linear)));
    }
}
