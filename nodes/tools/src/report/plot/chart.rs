//! Lines and marks over two axes.

use std::fmt::Write as _;

use super::{
    WIDTH,
    axis::{Axis, Ruler},
    figure, series_class,
    svg::{Drawing, place},
    text_width,
};

/// Height of the drawing.
const HEIGHT: f64 = 250.0;
/// Room above the axes.
const TOP: f64 = 10.0;
/// Room below for the marks and the title of the lower axis.
const BOTTOM: f64 = 40.0;
/// Room at the right, for half of the last mark.
const RIGHT: f64 = 16.0;
/// Half the size of a mark.
const MARK: f64 = 2.6;

/// How a series is drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mark {
    /// As a line from point to point.
    #[default]
    Line,
    /// As steps: a value holds from the point before up to its own.
    Steps,
    /// As dots.
    Dots,
    /// As crosses.
    Crosses,
}

/// Points that belong together.
#[derive(Clone, Debug, Default)]
pub struct Series {
    /// Its name in the legend.
    pub name: String,
    /// Its points in the axes' SI units, in the order in which they are joined.
    pub points: Vec<[f64; 2]>,
    /// How it is drawn.
    pub mark: Mark,
}

impl Series {
    /// A line.
    #[must_use]
    pub fn line(name: impl Into<String>, points: Vec<[f64; 2]>) -> Self {
        Self { name: name.into(), points, mark: Mark::Line }
    }

    /// The same points drawn otherwise.
    #[must_use]
    pub fn drawn(self, mark: Mark) -> Self {
        Self { mark, ..self }
    }
}

/// A value that is drawn across, such as a tolerance.
#[derive(Clone, Debug)]
pub struct Level {
    /// Its name, written beside the line.
    pub name: String,
    /// Its value on the upright axis.
    pub value: f64,
}

/// A plot over two axes, each linear or logarithmic.
#[derive(Clone, Debug, Default)]
pub struct Chart {
    /// What it shows.
    pub title: String,
    /// The level axis.
    pub x: Axis,
    /// The upright axis.
    pub y: Axis,
    /// What is drawn.
    pub series: Vec<Series>,
    /// Values drawn across; the upright axis reaches them.
    pub levels: Vec<Level>,
}

impl Chart {
    /// The plot as a figure. Points without a place on an axis are left out, and the line is broken there. One series
    /// needs no legend.
    #[must_use]
    pub fn figure(&self) -> String {
        let shown = |point: &&[f64; 2]| self.x.shows(point[0]) && self.y.shows(point[1]);
        let points = || self.series.iter().flat_map(|series| &series.points).filter(shown);
        let x = self.x.over(points().map(|point| point[0]), 5);
        let levels = self.levels.iter().map(|level| level.value);
        let y = self.y.over(points().map(|point| point[1]).chain(levels), 6);
        let frame = Frame::new(x, y, HEIGHT);
        let mut drawing = Drawing::new(WIDTH, HEIGHT, &self.title);
        frame.draw(&mut drawing);
        if points().next().is_none() {
            drawing.text("middle faint", [frame.left + 0.5 * frame.width, TOP + 0.5 * frame.height], "nothing to show");
        }
        for Level { name, value } in &self.levels {
            if let Some([_, at]) = frame.at([frame.x.low, *value]) {
                drawing.line("level", [frame.left, at], [frame.left + frame.width, at]);
                // Below the line where there is no room above.
                let text = if at - 16.0 < TOP { at + 13.0 } else { at - 4.0 };
                drawing.text("end faint", [frame.left + frame.width - 2.0, text], name);
            }
        }
        for (number, series) in self.series.iter().enumerate() {
            let class = format!("{} {}", series_class(number), style(series.mark));
            drawing.path(&class, &frame.path(series));
        }
        let legend = if self.series.len() > 1 {
            let entry =
                |(number, series): (usize, &Series)| (format!("{} line", series_class(number)), series.name.clone());
            self.series.iter().enumerate().map(entry).collect()
        } else {
            Vec::new()
        };
        figure(&self.title, &drawing.finish(), &legend)
    }
}

fn style(mark: Mark) -> &'static str {
    match mark {
        Mark::Line | Mark::Steps => "line",
        Mark::Dots => "dots",
        Mark::Crosses => "crosses",
    }
}

/// Two axes and the room between them.
pub(super) struct Frame {
    x: Ruler,
    y: Ruler,
    pub(super) left: f64,
    pub(super) width: f64,
    pub(super) height: f64,
}

impl Frame {
    pub(super) fn new(x: Ruler, y: Ruler, height: f64) -> Self {
        let widest = y.ticks.iter().map(|tick| text_width(&tick.label)).fold(0.0, f64::max);
        let left = widest + 28.0;
        Self { x, y, left, width: WIDTH - left - RIGHT, height: height - TOP - BOTTOM }
    }

    /// Where a point is drawn; `None` where an axis has no place for it.
    pub(super) fn at(&self, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
        let (x, y) = (self.x.place(x)?, self.y.place(y)?);
        Some([self.left + x * self.width, TOP + (1.0 - y) * self.height])
    }

    pub(super) fn draw(&self, drawing: &mut Drawing) {
        let (right, bottom) = (self.left + self.width, TOP + self.height);
        for tick in &self.y.ticks {
            if let Some([_, at]) = self.at([self.x.low, tick.at]) {
                drawing.line("grid", [self.left, at], [right, at]);
                drawing.text("end", [self.left - 6.0, at + 4.0], &tick.label);
            }
        }
        for tick in &self.x.ticks {
            if let Some([at, _]) = self.at([tick.at, self.y.low]) {
                drawing.line("axis", [at, bottom], [at, bottom + 4.0]);
                drawing.text("middle", [at, bottom + 17.0], &tick.label);
            }
        }
        drawing.line("axis", [self.left, bottom], [right, bottom]);
        drawing.text("middle", [self.left + 0.5 * self.width, bottom + 34.0], &self.x.title);
        drawing.text_upwards("middle", [12.0, TOP + 0.5 * self.height], &self.y.title);
    }

    fn path(&self, series: &Series) -> String {
        let mut path = String::new();
        let mut joined = false;
        for at in series.points.iter().map(|point| self.at(*point)) {
            let Some([x, y]) = at else {
                joined = false;
                continue;
            };
            let [px, py] = [x, y].map(place);
            // Writing to a text cannot fail.
            let _ = match series.mark {
                Mark::Line | Mark::Steps if !joined => write!(path, "M{px} {py}"),
                Mark::Line => write!(path, "L{px} {py}"),
                Mark::Steps => write!(path, "V{py}H{px}"),
                // A line without length and with round ends is a dot.
                Mark::Dots => write!(path, "M{px} {py}h0"),
                Mark::Crosses => {
                    let [left, up, size] = [x - MARK, y - MARK, 2.0 * MARK].map(place);
                    write!(path, "M{left} {up}l{size} {size}m0 -{size}l-{size} {size}")
                }
            };
            joined = true;
        }
        path
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_stand_where_the_axes_say() {
        let chart = Chart {
            title: "errors & steps".into(),
            x: Axis::log("N", "1"),
            y: Axis::log("error", "1"),
            series: vec![
                Series::line("a", vec![[1.0, 1e-2], [100.0, 1.0], [10.0, 0.0], [1.0, 1.0]]),
                Series { name: "b<".into(), points: vec![[10.0, 0.1]], mark: Mark::Crosses },
            ],
            levels: vec![Level { name: "tolerance".into(), value: 0.1 }],
        };
        let text = chart.figure();
        let page = roxmltree::Document::parse(&text).unwrap();
        let drawn = |class: &str| {
            let found = page.descendants().filter(|node| node.attribute("class") == Some(class));
            found.filter_map(|node| node.attribute("d")).map(str::to_owned).collect::<Vec<_>>()
        };
        // Labels of the upright axis are at most 8 characters, "5·10⁻²": the corners follow.
        let ruler = chart.y.over([1e-2, 1.0].into_iter(), 6);
        let left = ruler.ticks.iter().map(|tick| text_width(&tick.label)).fold(0.0, f64::max) + 28.0;
        let [low, right, bottom] = [left, WIDTH - RIGHT, HEIGHT - BOTTOM].map(place);
        // A point without a logarithm breaks the line.
        assert_eq!(drawn("c0 d0 line")[0], format!("M{low} {bottom}L{right} {TOP}M{low} {TOP}"), "{text}");
        assert_eq!(drawn("c1 d0 crosses").len(), 1);
        let names: Vec<_> = page
            .descendants()
            .filter(|node| node.has_tag_name("li"))
            .filter_map(|li| li.last_child()?.text())
            .collect();
        assert_eq!(names, ["a", "b<"]);
    }

    #[test]
    fn steps_hold_a_value_up_to_its_point_and_nothing_is_said_to_be_so() {
        let series = Series::line("dt", vec![[0.0, 1.0], [1.0, 2.0], [3.0, 4.0]]).drawn(Mark::Steps);
        let mut chart =
            Chart { x: Axis::linear("t", "s"), y: Axis::linear("dt", "s"), series: vec![series], ..Chart::default() };
        let text = chart.figure();
        let path = text.split("line\" d=\"").nth(1).unwrap();
        assert!(
            path[..path.find('"').unwrap()].chars().filter(|letter| letter.is_alphabetic()).eq("MVHVH".chars()),
            "{text}"
        );
        assert!(!text.contains("legend"));
        chart.series[0].points.clear();
        assert!(chart.figure().contains("nothing to show"));
    }
}
