//! The walls of a run's scene: their surfaces and edges, and where they are.

use std::collections::BTreeMap;

use stagger_config::Problems;
use stagger_messages::Done;
use stagger_physics::common::walls::{Motion, Plane, Shape, Wall, WallState};
use stagger_recordings::RunInfo;

use crate::{frame::Overview, layout::dot};

/// Cosine of the angle between two faces below which the edge between them is drawn: 20 degrees, which leaves out those
/// between the pieces that a cylinder is drawn with.
const SHARP: f64 = 0.94;

/// The walls of a run.
#[derive(Default)]
pub struct Walls {
    list: Vec<Wall>,
    /// How far those that a force moves have come, in m.
    displaced_m: BTreeMap<String, f64>,
}

/// A wall in its own frame, in the pictures' unit of length.
#[derive(Debug, PartialEq)]
pub struct Outline {
    /// Its name.
    pub name: String,
    /// Corners of its triangles, three each.
    pub corners: Vec<[f32; 3]>,
    /// Its edges.
    pub edges: Vec<[[f32; 3]; 2]>,
}

/// Where a wall's frame is, in the pictures' unit of length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Its origin.
    pub origin: [f32; 3],
    /// Its axes.
    pub axes: [[f32; 3]; 3],
}

impl Walls {
    /// Those of the scene that was recorded.
    ///
    /// # Errors
    /// Every mistake in the scene: one of another version of the program may have keys that are not known.
    pub fn of(info: &RunInfo) -> Result<Self, Problems> {
        let list = info.scene()?.walls;
        Ok(Self { list, displaced_m: BTreeMap::new() })
    }

    /// Takes what a node says of walls that a force moves.
    pub fn hear(&mut self, report: &Done) {
        for wall in self.list.iter().filter(|wall| matches!(wall.motion, Motion::Pressed(_))) {
            if let Some(displacement_m) = report.figures.get(&wall.displacement_figure()) {
                self.displaced_m.insert(wall.name.clone(), *displacement_m);
            }
        }
    }

    /// Their shapes; what is infinite is cut to about what the camera shows, and what lies behind a plane at rest, where no
    /// particle can be, is left out.
    pub fn outlines(&self, overview: &Overview) -> Vec<Outline> {
        let per_metre = overview.unit.per_metre;
        let [lower_m, upper_m] = overview.view.map(|corner| corner.map(|length| length / per_metre));
        let outline = |wall: &Wall| {
            let mut triangles = wall.shape.triangles(lower_m, upper_m);
            if wall.motion == Motion::Fixed {
                for plane in self.planes().filter(|plane| wall.shape != Shape::Plane(*plane)) {
                    triangles = triangles.iter().flat_map(|triangle| in_front(triangle, &plane)).collect();
                }
            }
            let scaled = |point: [f64; 3]| point.map(|length| (length * per_metre) as f32);
            Outline {
                name: wall.name.clone(),
                corners: triangles.iter().flatten().map(|corner| scaled(*corner)).collect(),
                edges: edges(&triangles).into_iter().map(|edge| edge.map(scaled)).collect(),
            }
        };
        self.list.iter().map(outline).collect()
    }

    fn planes(&self) -> impl Iterator<Item = Plane> {
        self.list.iter().filter(|wall| wall.motion == Motion::Fixed).filter_map(|wall| match wall.shape {
            Shape::Plane(plane) => Some(plane),
            _ => None,
        })
    }

    /// Where those that move are at a time, in s.
    pub fn places(&self, t_s: f64, per_metre: f64) -> impl Iterator<Item = (&str, Place)> {
        self.list.iter().filter(|wall| wall.motion != Motion::Fixed).map(move |wall| {
            let displacement_m = self.displaced_m.get(&wall.name).copied().unwrap_or_default();
            let (origin, axes) = wall.motion.pose(t_s, &WallState { displacement_m, speed_m_s: 0.0 }).frame();
            let origin = origin.map(|length| (length * per_metre) as f32);
            (wall.name.as_str(), Place { origin, axes: axes.map(|axis| axis.map(|component| component as f32)) })
        })
    }
}

/// What of a triangle lies on the side of a plane that its normal points to, as triangles.
fn in_front(triangle: &[[f64; 3]; 3], plane: &Plane) -> Vec<[[f64; 3]; 3]> {
    let height = |corner: &[f64; 3]| dot(std::array::from_fn(|axis| corner[axis] - plane.through[axis]), plane.normal);
    let mut corners: Vec<[f64; 3]> = Vec::new();
    for (from, to) in [(0, 1), (1, 2), (2, 0)].map(|(from, to)| (&triangle[from], &triangle[to])) {
        if height(from) >= 0.0 {
            corners.push(*from);
        }
        if (height(from) < 0.0) != (height(to) < 0.0) {
            // From the same end for both triangles of an edge, so that they meet in the same point to the last bit.
            let (below, above) = if height(from) < 0.0 { (from, to) } else { (to, from) };
            let share = height(below) / (height(below) - height(above));
            corners.push(std::array::from_fn(|axis| below[axis] + share * (above[axis] - below[axis])));
        }
    }
    (2..corners.len()).map(|last| [corners[0], corners[last - 1], corners[last]]).collect()
}

/// The edges of triangles at which the surface ends or turns sharply.
fn edges(triangles: &[[[f64; 3]; 3]]) -> Vec<[[f64; 3]; 2]> {
    // Corners that are the same point have the same bits: they come from one number.
    let mut normals: BTreeMap<[[u64; 3]; 2], Vec<[f64; 3]>> = BTreeMap::new();
    for [a, b, c] in triangles {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let mut edge = [from, to].map(|corner| corner.map(f64::to_bits));
            edge.sort_unstable();
            normals.entry(edge).or_default().push(normal(a, b, c));
        }
    }
    let drawn = normals.into_iter().filter(|(_, faces)| match faces.as_slice() {
        // Either may be wound the other way round.
        [one, other] => dot(*one, *other).abs() < SHARP,
        _ => true,
    });
    drawn.map(|(edge, _)| edge.map(|corner| corner.map(f64::from_bits))).collect()
}

fn normal(a: &[f64; 3], b: &[f64; 3], c: &[f64; 3]) -> [f64; 3] {
    let [u, v]: [[f64; 3]; 2] = [b, c].map(|corner| std::array::from_fn(|axis| corner[axis] - a[axis]));
    let across = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    let length = dot(across, across).sqrt();
    across.map(|component| component / length.max(f64::MIN_POSITIVE))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{frame::LengthUnit, layers::Layers};

    const SCENE: &str = r#"
duration = "1 ms"
[particles]
count  = 1
radius = "25 um"
start  = { kind = "lattice", box = ["0.1 mm", "0.1 mm", "0.1 mm"] }
[walls.plate]
plane = { through = [0, 0, 0], normal = [0, 0, 1] }
[walls.box]
box  = { lower = ["-1 mm", "-1 mm", "-1 mm"], upper = ["1 mm", "1 mm", "1 mm"], open = ["+z"] }
[walls.tube]
cylinder = { through = [0, 0, 0], axis = [0, 0, 1], radius = "1 mm", length = "2 mm" }
[walls.lid]
plane  = { through = [0, 0, "1 mm"], normal = [0, 0, -1] }
motion = { kind = "pressed", force = "1 N", mass = "1 kg", direction = [0, 0, -1] }
[walls.belt]
plane  = { through = [0, 0, "-1 mm"], normal = [0, 0, 1] }
motion = { kind = "constant", velocity = [0.5, 0, 0] }
[coupling]
dt = "10 us"
"#;

    fn walls() -> Walls {
        Walls::of(&RunInfo { scene_text: SCENE.into(), ..RunInfo::default() }).unwrap()
    }

    #[test]
    fn walls_have_edges_where_they_end_or_turn() {
        let overview = Overview {
            layers: Layers::default(),
            unit: LengthUnit { per_metre: 1e3, symbol: "mm" },
            view: [[-1.0; 3], [1.0; 3]],
            others: BTreeMap::new(),
            repeated_s: None,
            duration_s: None,
        };
        let outlines = walls().outlines(&overview);
        let counts: BTreeMap<_, _> = outlines
            .iter()
            .map(|outline| (outline.name.as_str(), (outline.corners.len() / 3, outline.edges.len())))
            .collect();
        assert_eq!(counts["plate"], (2, 4));
        // Two circles of 48 pieces; the lower one lies on the plate.
        assert_eq!(counts["tube"], (96, 96));
        // Four sides, without a lid; of the triangles that the plate cuts, one half each is left as two. Two of the edges at
        // the plate are in two pieces.
        let sides = outlines.iter().find(|outline| outline.name == "box").unwrap();
        assert_eq!((counts["box"].0, sides.corners.iter().flatten().all(|length| length.abs() <= 1.0)), (12, true));
        assert!(sides.corners.iter().all(|corner| corner[2] >= 0.0), "nothing is drawn below the plate");
        let upright = |edge: &&[[f32; 3]; 2]| edge[0][2] != edge[1][2];
        assert_eq!(sides.edges.iter().filter(upright).count(), 4);
    }

    #[test]
    fn moving_walls_are_where_their_motion_and_reports_say() {
        let mut walls = walls();
        let displacement = BTreeMap::from([("displacement of lid [m]".to_owned(), 2e-4)]);
        walls.hear(&Done { figures: displacement, ..Done::default() });
        let places: BTreeMap<_, _> = walls.places(1e-3, 1e3).collect();
        assert_eq!(places.keys().copied().collect::<Vec<_>>(), ["belt", "lid"]);
        let near = |a: [f32; 3], b: [f32; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6);
        assert!(near(places["belt"].origin, [0.5, 0.0, 0.0]) && near(places["lid"].origin, [0.0, 0.0, -0.2]));
        assert_eq!(places["lid"].axes, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
    }

    #[test]
    fn a_scene_that_cannot_be_read_is_told() {
        let info = RunInfo { scene_text: "duration = \"1 ms\"\n[glaze]\n".into(), ..RunInfo::default() };
        assert!(Walls::of(&info).err().unwrap().to_string().contains("glaze"));
    }
}
