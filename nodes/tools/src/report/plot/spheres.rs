//! Particles seen along an axis: circles drawn back to front, without those that others hide.

use std::fmt::Write as _;

use super::{
    axis::round_step,
    quantity::scaled,
    ramp::Ramp,
    svg::{Drawing, place},
};

/// Largest width and height of a picture, in units of its drawing.
const SIZE: f64 = 320.0;
/// Room below for the bar that shows the scale.
const FOOT: f64 = 24.0;
/// Pixels per unit at which it is decided what is hidden.
const FINENESS: f64 = 2.0;
/// Circles in a picture at most.
const CIRCLES: usize = 5000;

/// A particle with the value that colours it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Its centre, in m.
    pub centre_m: [f32; 3],
    /// Its radius, in m.
    pub radius_m: f32,
    /// What colours it, in the ramp's unit; not a number where it has no value.
    pub value: f32,
}

/// Where one looks from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum View {
    /// From the front: x to the right, z up.
    Front,
    /// From above: x to the right, y up.
    Above,
}

impl View {
    /// Level and upright direction of the picture, and the one towards the viewer with its sign.
    fn axes(self) -> (usize, usize, usize, f64) {
        match self {
            Self::Front => (0, 2, 1, -1.0),
            Self::Above => (0, 1, 2, 1.0),
        }
    }
}

/// The box that pictures show, so that several can show the same.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Its lowest corner, in m.
    pub low_m: [f64; 3],
    /// Its highest corner, in m.
    pub high_m: [f64; 3],
}

impl Bounds {
    /// The box around spheres but for strays: in each direction, of a hundred centres the outermost may lie beyond at
    /// either end. `None` where there are none.
    #[must_use]
    pub fn around(spheres: &[Sphere]) -> Option<Self> {
        let known = || spheres.iter().filter(|sphere| sphere.centre_m.iter().all(|length| length.is_finite()));
        let last = known().count().checked_sub(1)?;
        let radius = f64::from(known().map(|sphere| sphere.radius_m).fold(0.0, f32::max));
        let mut bounds = Self { low_m: [0.0; 3], high_m: [0.0; 3] };
        for axis in 0..3 {
            let mut lengths: Vec<f32> = known().map(|sphere| sphere.centre_m[axis]).collect();
            lengths.sort_by(f32::total_cmp);
            bounds.low_m[axis] = f64::from(lengths[last / 100]) - radius;
            bounds.high_m[axis] = f64::from(lengths[last - last / 100]) + radius;
        }
        Some(bounds)
    }

    /// The box around two.
    #[must_use]
    pub fn with(self, other: Self) -> Self {
        let corner =
            |pick: fn(f64, f64) -> f64, a: [f64; 3], b: [f64; 3]| std::array::from_fn(|axis| pick(a[axis], b[axis]));
        Self { low_m: corner(f64::min, self.low_m, other.low_m), high_m: corner(f64::max, self.high_m, other.high_m) }
    }
}

/// What a picture shows of its spheres.
#[derive(Clone, Debug, PartialEq)]
pub struct Visible {
    /// The drawing.
    pub drawing: String,
    /// Circles drawn.
    pub drawn: usize,
    /// Spheres of which something can be seen.
    pub visible: usize,
    /// Spheres beyond the box.
    pub outside: usize,
}

/// Draws spheres as seen from far away. Where more than 5000 are visible, every n-th of them is drawn.
#[must_use]
pub fn picture(name: &str, spheres: &[Sphere], bounds: &Bounds, view: View, ramp: &Ramp) -> Visible {
    let (level, upright, depth, towards) = view.axes();
    let extent = |axis: usize| (bounds.high_m[axis] - bounds.low_m[axis]).max(f64::MIN_POSITIVE);
    let per_metre = (SIZE / extent(level)).min(SIZE / extent(upright));
    let (width, height) = (SIZE, (per_metre * extent(upright)).max(4.0));
    let left = 0.5 * (SIZE - per_metre * extent(level));
    let mut circles: Vec<Circle> = spheres
        .iter()
        .filter(|sphere| sphere.centre_m.iter().all(|length| length.is_finite()))
        .map(|sphere| {
            let centre = sphere.centre_m.map(f64::from);
            Circle {
                x: left + per_metre * (centre[level] - bounds.low_m[level]),
                y: height - per_metre * (centre[upright] - bounds.low_m[upright]),
                radius: per_metre * f64::from(sphere.radius_m),
                nearness: towards * centre[depth] + f64::from(sphere.radius_m),
                value: f64::from(sphere.value),
            }
        })
        .collect();
    let known = circles.len();
    circles.retain(|circle| {
        let reach = circle.radius;
        circle.x + reach >= 0.0 && circle.x - reach <= width && circle.y + reach >= 0.0 && circle.y - reach <= height
    });
    let outside = spheres.len() - known + known - circles.len();
    // Equal places keep the order of rows: the same picture from the same recording.
    circles.sort_by(|a, b| b.nearness.total_cmp(&a.nearness));
    let mut canvas = Canvas::new(width, height);
    circles.retain(|circle| canvas.cover(circle));
    let visible = circles.len();
    let every = visible.div_ceil(CIRCLES).max(1);
    let mut drawing = Drawing::new(width, height + FOOT, name);
    let mut drawn = 0;
    let mut text = String::from("<g class=\"spheres\">");
    for circle in circles.iter().step_by(every).rev() {
        let [x, y] = [circle.x, circle.y].map(place);
        // Writing to a text cannot fail.
        let _ = write!(
            text,
            "<circle cx=\"{x}\" cy=\"{y}\" r=\"{:.2}\" fill=\"url(#{})\"/>",
            circle.radius.max(0.4),
            ramp.shade(circle.value)
        );
        drawn += 1;
    }
    drawing.raw(&(text + "</g>"));
    let length_m = round_step(0.2 * SIZE / per_metre);
    let (from, to) = (4.0, 4.0 + per_metre * length_m);
    let foot = height + 10.0;
    // The foot is the page's colour again, whatever reaches into it.
    drawing.rectangle("page", [0.0, height], [width, FOOT], "scale");
    drawing.line("bar", [from, foot], [to, foot]);
    let length = scaled("m", length_m);
    drawing.text("start", [to + 6.0, foot + 4.0], &format!("{:.0} {}", length_m / length.divisor, length.unit));
    Visible { drawing: drawing.finish(), drawn, visible, outside }
}

struct Circle {
    x: f64,
    y: f64,
    radius: f64,
    nearness: f64,
    value: f64,
}

/// Which pixels are covered by circles nearer to the viewer.
struct Canvas {
    columns: usize,
    rows: usize,
    covered: Vec<bool>,
}

impl Canvas {
    fn new(width: f64, height: f64) -> Self {
        let (columns, rows) = ((FINENESS * width).ceil() as usize, (FINENESS * height).ceil() as usize);
        Self { columns, rows, covered: vec![false; columns * rows] }
    }

    /// Covers a circle; returns whether something of it was still to be seen.
    fn cover(&mut self, circle: &Circle) -> bool {
        // A circle smaller than a pixel is seen all the same.
        let (x, y, radius) = (FINENESS * circle.x, FINENESS * circle.y, (FINENESS * circle.radius).max(0.71));
        let pixels = |from: f64, to: f64, limit: usize| {
            (from.floor().max(0.0) as usize)..(to.ceil().max(0.0) as usize).min(limit)
        };
        let mut seen = false;
        for row in pixels(y - radius, y + radius, self.rows) {
            for column in pixels(x - radius, x + radius, self.columns) {
                let [dx, dy] = [column as f64 + 0.5 - x, row as f64 + 0.5 - y];
                if dx * dx + dy * dy <= radius * radius {
                    let covered = &mut self.covered[row * self.columns + column];
                    seen |= !*covered;
                    *covered = true;
                }
            }
        }
        seen
    }
}

#[cfg(test)]
mod tests {
    use stagger_recordings::display::colour_scale::Range;

    use super::*;
    use crate::report::plot::Axis;

    fn sphere(centre_m: [f32; 3], radius_m: f32, value: f32) -> Sphere {
        Sphere { centre_m, radius_m, value }
    }

    fn ramp() -> Ramp {
        Ramp { axis: Axis::linear("temperature", "K"), range: Range { min: 0.0, max: 1.0 } }
    }

    fn seen(spheres: &[Sphere], view: View) -> Visible {
        let found = picture("particles", spheres, &Bounds::around(spheres).unwrap(), view, &ramp());
        roxmltree::Document::parse(&found.drawing).unwrap();
        found
    }

    #[test]
    fn what_is_behind_is_drawn_first_and_what_is_hidden_not_at_all() {
        // From the front the second (y = −1) is nearer than the first; a small one is behind both.
        let spheres =
            [sphere([0.0, 0.0, 0.0], 1.0, 0.0), sphere([0.5, -1.0, 0.0], 1.0, 1.0), sphere([0.3, 5.0, 0.0], 0.1, 1.0)];
        let front = seen(&spheres, View::Front);
        assert_eq!((front.visible, front.drawn, front.outside), (2, 2, 0));
        assert!(front.drawing.find("#s0)") < front.drawing.find("#s31)"), "{}", front.drawing);
        // From above the small one lies aside of the others.
        assert_eq!(seen(&spheres, View::Above).visible, 3);
    }

    #[test]
    fn many_are_thinned_strays_are_left_out_and_the_picture_stays_small() {
        let mut spheres: Vec<Sphere> =
            (0..40_000).map(|i| sphere([(i % 200) as f32, (i / 200) as f32, 0.0], 0.5, f32::NAN)).collect();
        spheres.extend([
            sphere([100.0, 100.0, 1e6], 0.5, 0.0),
            sphere([1e6, 0.0, 0.0], 0.5, 0.0),
            sphere([f32::NAN; 3], 0.5, 0.0),
        ]);
        let above = seen(&spheres, View::Above);
        // Nothing hides anything but for the stray right above one of them. The outermost rows are beyond the box by its 1 %.
        assert!(
            above.visible > 38_000 && above.drawn <= CIRCLES && above.drawn > CIRCLES / 2,
            "{} {}",
            above.visible,
            above.drawn
        );
        assert!(above.outside >= 2, "{}", above.outside);
        assert!(above.drawing.len() < 400_000, "{} bytes", above.drawing.len());
        assert!(
            above.drawing.contains("#sx)") && above.drawing.contains("50 m<"),
            "{}",
            &above.drawing[above.drawing.len() - 300..]
        );
    }

    #[test]
    fn a_box_is_around_all_but_strays_and_grows_by_another() {
        let line: Vec<Sphere> = (0..200).map(|i| sphere([i as f32, 0.0, 0.0], 0.25, 0.0)).collect();
        let found = Bounds::around(&line).unwrap();
        assert_eq!((found.low_m[0], found.high_m[0], found.high_m[1]), (0.75, 198.25, 0.25));
        let other = Bounds { low_m: [5.0, -9.0, 0.0], high_m: [500.0, 0.0, 0.0] };
        assert_eq!(found.with(other), Bounds { low_m: [0.75, -9.0, -0.25], high_m: [500.0, 0.25, 0.25] });
        assert_eq!(Bounds::around(&[]), None);
        assert_eq!(Bounds::around(&[sphere([f32::NAN; 3], 1.0, 0.0)]), None);
    }
}
