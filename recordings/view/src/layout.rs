//! What stands where in the window, as plain data; [`crate::show`] hands it to the viewer.

use crate::{
    colour::Scale,
    layers::{self, Layer, Layers},
    plots,
};

/// A part of the window.
#[derive(Debug)]
pub enum Part {
    /// Parts beside each other, with their shares of the width.
    Beside(Vec<(f32, Part)>),
    /// Parts above each other, with their shares of the height.
    Above(Vec<(f32, Part)>),
    /// Parts of which one shows at a time.
    Tabs(Vec<Part>),
    /// The picture of a layer.
    Scene(Layer),
    /// Its colour legend.
    Legend(Layer),
    /// A text; the name is its title, the path its place among the data.
    Text(&'static str, &'static str),
    /// Curves; the first is the title, the second the place of the curves among the data.
    Curves(String, String),
}

/// The window: a large picture for each layer with its legend below, the curves beside them.
pub fn window(layers: &Layers) -> Part {
    use Part::{Above, Beside, Curves, Legend, Scene, Tabs, Text};
    let curves = |title: &str, place: &str| Curves(title.into(), format!("plots/{place}"));
    let quantities = layers.iter().map(|layer| curves(&layer.quantity.title, &layers::curves(&layer.quantity)));
    let energies = [
        curves("Numbers", plots::NUMBERS),
        curves("Heat and light", "energy/heat"),
        curves("Energy of motion", "energy/motion"),
        curves("Imbalance", "imbalance"),
    ];
    let physics = Tabs(quantities.chain(energies).collect());
    let coupling = Tabs(vec![
        curves("Convergence", "convergence"),
        curves("Iterations", "iterations"),
        curves("Window size", "window"),
        curves("Solve time", "cost"),
        Text("Scene", "scene"),
    ]);
    // Below each other: the camera fits a picture into its height.
    let share = if layers.iter().count() > 1 { 3.0 } else { 7.0 };
    let picture = |layer: &Layer| [(share, Scene(layer.clone())), (1.0, Legend(layer.clone()))];
    let pictures = Above(layers.iter().flat_map(picture).collect());
    Beside(vec![(3.0, pictures), (2.0, Above(vec![(1.0, physics), (1.0, coupling)]))])
}

/// Seconds that a run takes when it is played back, however short it was.
const PLAYBACK_S: f64 = 10.0;

/// Simulated seconds per second of playback.
pub fn playback_speed(duration_s: f64) -> f64 {
    if duration_s > 0.0 { duration_s / PLAYBACK_S } else { 1.0 }
}

/// Where the camera stands and what it looks at: obliquely from above, as close as everything to be seen fits.
pub fn camera(view: [[f64; 3]; 2]) -> [[f32; 3]; 2] {
    let [low, high] = view;
    let centre: [f64; 3] = std::array::from_fn(|axis| 0.5 * (low[axis] + high[axis]));
    let corners: [[f64; 3]; 8] =
        std::array::from_fn(|corner| std::array::from_fn(|axis| view[corner >> axis & 1][axis] - centre[axis]));
    let towards = corners.map(|corner| dot(corner, BACK));
    // For each corner the distance at which it stands on one edge of the view when the camera looks at the centre.
    // Looking aside takes from one edge what it adds to the opposite one, so that their mean is the distance needed.
    let needed = |direction: [f64; 3], tangent: f64| {
        let farthest = |sign: f64| {
            let distances = corners.iter().zip(towards).map(|(corner, z)| z + sign * dot(*corner, direction) / tangent);
            distances.fold(0.0, f64::max)
        };
        0.5 * (farthest(1.0) + farthest(-1.0))
    };
    let distance =
        EDGES.map(|(direction, tangent)| needed(direction, tangent)).into_iter().fold(0.0, f64::max) / FILLED;
    let mut target = centre;
    for (direction, _) in EDGES {
        let mut aside = 0.0;
        // As much room on one side as on the other. Never farther than the nearest corner asks for: it converges.
        for _ in 0..20 {
            let places = corners.iter().zip(towards).map(|(at, z)| (dot(*at, direction) - aside) / (distance - z));
            let (low, high) = places.fold((0.0f64, 0.0f64), |(low, high), place| (low.min(place), high.max(place)));
            aside += 0.5 * (low + high) * (distance - towards.into_iter().fold(0.0, f64::max));
        }
        target = std::array::from_fn(|axis| target[axis] + aside * direction[axis]);
    }
    let eye: [f64; 3] = std::array::from_fn(|axis| target[axis] + distance * BACK[axis]);
    [eye, target].map(|point| point.map(|length| length as f32))
}

/// Unit vectors from the scene to the camera, to the right and up in the picture.
const BACK: [f64; 3] = [0.450_473, -0.770_810, 0.450_473];
const RIGHT: [f64; 3] = [0.863_372, 0.504_568, 0.0];
const UP: [f64; 3] = [-0.227_294, 0.388_926, 0.892_790];
/// Tangent of half the viewer's angle of view, 55 degrees from the lower to the upper edge.
const TANGENT: f64 = 0.520_567;
/// Least width of the picture for its height that is reckoned with.
const ASPECT: f64 = 1.2;
/// Directions across the picture, with the tangent of half the angle seen.
const EDGES: [([f64; 3], f64); 2] = [(RIGHT, ASPECT * TANGENT), (UP, TANGENT)];
/// Share of the picture to fill: balls stand out of the corners between their centres.
const FILLED: f64 = 0.95;

pub fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Values at which the legend is labelled, with their texts.
pub fn ticks(layer: &Layer) -> Vec<(f32, String)> {
    const TICKS: u32 = 4;
    let Layer { range, scale, ref quantity, .. } = *layer;
    if range.is_empty() {
        return Vec::new();
    }
    let unit = &quantity.unit;
    let width = range.max - range.min;
    let largest = range.max.abs().max(range.min.abs());
    // As many decimals as tell neighbouring ticks apart.
    let decimals =
        if width > 0.0 { (1.0 - (width / f64::from(TICKS)).log10()).round().clamp(0.0, 9.0) as usize } else { 2 };
    let decimals = if width > 40.0 { 0 } else { decimals };
    let tick = |i: u32| {
        let fraction = f64::from(i) / f64::from(TICKS);
        let value = range.value(fraction, scale);
        let text = if scale == Scale::Decades || largest >= 2e4 || (largest > 0.0 && largest < 1e-4) {
            format!("{value:.1e} {unit}")
        } else {
            format!("{value:.decimals$} {unit}")
        };
        (fraction as f32, text)
    };
    (0..=TICKS).map(tick).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use stagger_recordings::display::quantities::Quantity;

    use crate::colour::Range;

    fn layer(min: f64, max: f64, scale: Scale) -> Layer {
        let quantity = Quantity {
            field: "temperature".into(),
            name: "temperature".into(),
            unit: "K".into(),
            title: String::new(),
            support: "particles".into(),
            decades: false,
            passing: false,
        };
        Layer { quantity: quantity.into(), path: String::new(), range: Range { min, max }, scale }
    }

    #[test]
    fn ticks_are_told_apart_by_as_few_digits_as_needed() {
        let texts =
            |min, max| ticks(&layer(min, max, Scale::Linear)).into_iter().map(|(_, text)| text).collect::<Vec<_>>();
        assert_eq!(texts(300.0, 1500.0), ["300 K", "600 K", "900 K", "1200 K", "1500 K"]);
        assert_eq!(texts(300.0, 300.4), ["300.00 K", "300.10 K", "300.20 K", "300.30 K", "300.40 K"]);
        assert_eq!(texts(300.0, 300.0)[0], "300.00 K");
        assert_eq!(texts(0.0, 4e6)[1], "1.0e6 K");
        assert!(ticks(&Layer { range: Range::EMPTY, ..layer(0.0, 0.0, Scale::Linear) }).is_empty());
        let decades: Vec<_> = ticks(&layer(0.0, 1e6, Scale::Decades)).into_iter().map(|(_, text)| text).collect();
        assert_eq!(decades, ["1.0e2 K", "1.0e3 K", "1.0e4 K", "1.0e5 K", "1.0e6 K"]);
    }

    #[test]
    fn the_camera_sees_the_whole_scene_from_above_and_no_more() {
        let view = [[-1.0, -2.0, 0.0], [1.0, 2.0, 4.0]];
        let [eye, target] = camera(view).map(|point| point.map(f64::from));
        let distance = dot(std::array::from_fn(|axis| eye[axis] - target[axis]), BACK);
        assert!(distance > 0.0 && eye[2] > target[2]);
        // Place of each corner in the picture, where the edges are at -1 and 1.
        let (mut lowest, mut highest) = ([1.0f64; 2], [-1.0f64; 2]);
        for corner in 0..8 {
            let point: [f64; 3] = std::array::from_fn(|axis| view[corner >> axis & 1][axis] - eye[axis]);
            for (edge, (direction, tangent)) in EDGES.into_iter().enumerate() {
                let place = dot(point, direction) / (-dot(point, BACK) * tangent);
                lowest[edge] = lowest[edge].min(place);
                highest[edge] = highest[edge].max(place);
            }
        }
        assert!(lowest.iter().chain(&highest).all(|place| place.abs() < 1.0), "{lowest:?} to {highest:?}");
        // In the middle, and four high and at most four wide, it fills the height.
        assert!(lowest.iter().zip(highest).all(|(low, high)| (low + high).abs() < 0.01), "{lowest:?} to {highest:?}");
        assert!(highest[1] - lowest[1] > 1.7, "{lowest:?} to {highest:?}");
    }

    #[test]
    fn the_directions_of_the_picture_are_a_right_handed_frame() {
        let [(right, _), (up, _)] = EDGES;
        let cross = |a: [f64; 3], b: [f64; 3]| {
            [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
        };
        let back = cross(right, up);
        assert!(back.iter().zip(BACK).all(|(found, expected)| (found - expected).abs() < 2e-6), "{back:?}");
    }

    #[test]
    fn playback_takes_as_long_whatever_the_run() {
        assert!((playback_speed(0.02) - 0.002).abs() < 1e-15 && playback_speed(0.0) > 0.0);
    }
}
