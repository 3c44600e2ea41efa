//! What stands where in the window, as plain data; [`crate::show`] hands it to the viewer.

use crate::frame::Overview;

/// A part of the window.
#[derive(Debug)]
pub enum Part {
    /// Parts beside each other, with their shares of the width.
    Beside(Vec<(f32, Part)>),
    /// Parts above each other, with their shares of the height.
    Above(Vec<(f32, Part)>),
    /// Parts of which one shows at a time.
    Tabs(Vec<Part>),
    /// The picture.
    Scene,
    /// The colour legend.
    Legend,
    /// A text; the name is its title, the path its place among the data.
    Text(&'static str, &'static str),
    /// Curves; the first is the title, the second the place of the curves among the data.
    Curves(&'static str, &'static str),
}

/// The window: the picture large with the legend below, the curves beside it.
pub fn window() -> Part {
    use Part::{Above, Beside, Curves, Legend, Scene, Tabs, Text};
    let physics = Tabs(vec![
        Curves("Particles", "plots/particles"),
        Curves("Heat and light", "plots/energy/heat"),
        Curves("Energy of motion", "plots/energy/motion"),
        Curves("Imbalance", "plots/imbalance"),
    ]);
    let coupling = Tabs(vec![
        Curves("Convergence", "plots/convergence"),
        Curves("Iterations", "plots/iterations"),
        Curves("Window size", "plots/window"),
        Curves("Solve time", "plots/cost"),
        Text("Scene", "scene"),
    ]);
    let picture = Above(vec![(7.0, Scene), (1.0, Legend)]);
    Beside(vec![(3.0, picture), (2.0, Above(vec![(1.0, physics), (1.0, coupling)]))])
}

/// Seconds that a run takes when it is played back, however short it was.
const PLAYBACK_S: f64 = 10.0;

/// Simulated seconds per second of playback.
pub fn playback_speed(duration_s: f64) -> f64 {
    if duration_s > 0.0 { duration_s / PLAYBACK_S } else { 1.0 }
}

/// Where the camera stands and what it looks at: obliquely from above, everything in view.
pub fn camera(overview: &Overview) -> [[f32; 3]; 2] {
    // Unit vector from the scene to the camera, and the distance at which a ball just fits a view of 55 degrees.
    const DIRECTION: [f64; 3] = [0.45, -0.77, 0.45];
    const DISTANCE_PER_RADIUS: f64 = 2.2;
    let [low, high] = overview.bounds;
    let target: [f64; 3] = std::array::from_fn(|axis| 0.5 * (low[axis] + high[axis]));
    let radius = 0.5 * (0..3).map(|axis| (high[axis] - low[axis]).powi(2)).sum::<f64>().sqrt();
    let eye: [f64; 3] = std::array::from_fn(|axis| target[axis] + DIRECTION[axis] * DISTANCE_PER_RADIUS * radius);
    [eye, target].map(|point| point.map(|length| length as f32))
}

/// Values at which the legend is labelled, with their texts.
pub fn ticks(overview: &Overview) -> Vec<(f32, String)> {
    const TICKS: u32 = 4;
    let range = overview.range;
    let width = range.max - range.min;
    if range.is_empty() {
        return Vec::new();
    }
    // As many decimals as tell neighbouring ticks apart.
    let decimals =
        if width > 0.0 { (1.0 - (width / f64::from(TICKS)).log10()).round().clamp(0.0, 9.0) as usize } else { 2 };
    let decimals = if width > 40.0 { 0 } else { decimals };
    let unit = overview.quantity.map_or("", |quantity| quantity.unit);
    let tick = |i: u32| {
        let fraction = f64::from(i) / f64::from(TICKS);
        (fraction as f32, format!("{:.decimals$} {unit}", range.min + fraction * width))
    };
    (0..=TICKS).map(tick).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        colour::Range,
        frame::{LengthUnit, Quantity},
    };

    fn overview(min: f64, max: f64) -> Overview {
        Overview {
            quantity: Some(Quantity { name: "temperature", unit: "K" }),
            range: Range { min, max },
            unit: LengthUnit::for_extent(1e-3),
            bounds: [[-1.0, -2.0, 0.0], [1.0, 2.0, 4.0]],
            duration_s: None,
        }
    }

    #[test]
    fn ticks_are_told_apart_by_as_few_digits_as_needed() {
        let texts = |min, max| ticks(&overview(min, max)).into_iter().map(|(_, text)| text).collect::<Vec<_>>();
        assert_eq!(texts(300.0, 1500.0), ["300 K", "600 K", "900 K", "1200 K", "1500 K"]);
        assert_eq!(texts(300.0, 300.4), ["300.00 K", "300.10 K", "300.20 K", "300.30 K", "300.40 K"]);
        assert_eq!(texts(300.0, 300.0)[0], "300.00 K");
        assert!(ticks(&Overview { range: Range::EMPTY, ..overview(0.0, 0.0) }).is_empty());
    }

    #[test]
    fn the_camera_sees_the_whole_scene_from_above() {
        let [eye, target] = camera(&overview(0.0, 1.0));
        assert_eq!(target.to_vec(), [0.0, 0.0, 2.0]);
        let distance = eye.iter().zip(target).map(|(eye, target)| (eye - target).powi(2)).sum::<f32>().sqrt();
        // A ball around the box has radius sqrt(1 + 4 + 4) = 3 and must fit into half of 55 degrees.
        assert!(distance > 3.0 / 27.5f32.to_radians().sin() && eye[2] > target[2], "{distance}");
    }

    #[test]
    fn playback_takes_as_long_whatever_the_run() {
        assert!((playback_speed(0.02) - 0.002).abs() < 1e-15 && playback_speed(0.0) > 0.0);
    }
}
