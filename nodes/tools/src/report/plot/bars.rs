//! Bars that lie beside their names, in parts.

use super::{
    WIDTH,
    axis::{Axis, Ruler},
    figure,
    quantity::quantity,
    series_class,
    svg::Drawing,
    text_width,
};

/// Height of a bar with the room around it.
const ROW: f64 = 20.0;
/// Height of a bar.
const BAR: f64 = 12.0;
/// Room for the marks and the title of the axis.
const BOTTOM: f64 = 40.0;
/// Room at the top.
const TOP: f64 = 4.0;
/// Largest share of the width that names take.
const NAMES: f64 = 0.42;

/// One bar.
#[derive(Clone, Debug, PartialEq)]
pub struct Bar {
    /// Its name, written beside it.
    pub name: String,
    /// Its parts in the axis's SI unit, each 0 or more.
    pub values: Vec<f64>,
}

/// Bars over one axis that begins at zero.
#[derive(Clone, Debug, Default)]
pub struct Bars {
    /// What they show.
    pub title: String,
    /// The axis.
    pub axis: Axis,
    /// Names of the parts of each bar.
    pub parts: Vec<String>,
    /// The bars from top to bottom.
    pub bars: Vec<Bar>,
}

impl Bars {
    /// The bars as a figure, each with its sum at its end. One part needs no legend.
    #[must_use]
    pub fn figure(&self) -> String {
        let total = |bar: &Bar| bar.values.iter().filter(|value| value.is_finite()).sum::<f64>();
        let axis = self.axis.clone().with(&[0.0]);
        let ruler = axis.over(self.bars.iter().map(total), 4);
        let widest = self.bars.iter().map(|bar| text_width(&bar.name)).fold(0.0, f64::max);
        let left = widest.min(NAMES * WIDTH) + 10.0;
        let sums: Vec<String> = self.bars.iter().map(|bar| quantity(total(bar), &self.axis.unit)).collect();
        let right = sums.iter().map(|sum| text_width(sum)).fold(16.0, f64::max) + 8.0;
        let width = WIDTH - left - right;
        let bottom = TOP + ROW * self.bars.len() as f64;
        let mut drawing = Drawing::new(WIDTH, bottom + BOTTOM, &self.title);
        let at = |value: f64| left + ruler.place(value).unwrap_or_default() * width;
        scale(&mut drawing, &ruler, [left, left + width, bottom], at);
        for (number, (bar, sum)) in self.bars.iter().zip(&sums).enumerate() {
            let middle = TOP + ROW * (number as f64 + 0.5);
            drawing.text("end", [left - 6.0, middle + 4.0], &shortened(&bar.name, NAMES * WIDTH));
            let mut start = 0.0;
            for (part, value) in bar.values.iter().enumerate().filter(|(_, value)| value.is_finite()) {
                let end = start + value;
                let named = self.parts.get(part).map(|part| format!(", {part}")).unwrap_or_default();
                let note = format!("{}{named}: {}", bar.name, quantity(*value, &self.axis.unit));
                let class = format!("{} fill", series_class(part));
                drawing.rectangle(&class, [at(start), middle - 0.5 * BAR], [at(end) - at(start), BAR], &note);
                start = end;
            }
            drawing.text("faint", [at(start) + 5.0, middle + 4.0], sum);
        }
        let legend: Vec<_> = if self.parts.len() > 1 {
            let entry = |(part, name): (usize, &String)| (format!("{} block", series_class(part)), name.clone());
            self.parts.iter().enumerate().map(entry).collect()
        } else {
            Vec::new()
        };
        figure(&self.title, &drawing.finish(), &legend)
    }
}

fn scale(drawing: &mut Drawing, ruler: &Ruler, [left, right, bottom]: [f64; 3], at: impl Fn(f64) -> f64) {
    for tick in &ruler.ticks {
        drawing.line("grid", [at(tick.at), TOP], [at(tick.at), bottom]);
        drawing.text("middle", [at(tick.at), bottom + 16.0], &tick.label);
    }
    drawing.line("axis", [left, TOP], [left, bottom]);
    drawing.text("middle", [0.5 * (left + right), bottom + 33.0], &ruler.title);
}

/// The end of a name that is too long: it tells more than its beginning.
fn shortened(name: &str, width: f64) -> String {
    if text_width(name) <= width {
        return name.into();
    }
    let count = name.chars().count();
    let kept = ((width / super::CHARACTER) as usize).saturating_sub(1);
    let end: String = name.chars().skip(count.saturating_sub(kept)).collect();
    format!("…{end}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_put_together_and_summed() {
        let bars = Bars {
            title: "time".into(),
            axis: Axis::linear("time", "s"),
            parts: vec!["solve".into(), "wait".into()],
            bars: vec![
                Bar { name: "particles".into(), values: vec![3e-3, 1e-3] },
                Bar {
                    name: "a name that is so long that it takes more than its share".into(),
                    values: vec![0.0, f64::NAN],
                },
            ],
        };
        let text = bars.figure();
        let page = roxmltree::Document::parse(&text).unwrap();
        let rectangles: Vec<_> =
            page.descendants().filter(|node| node.has_tag_name(("http://www.w3.org/2000/svg", "rect"))).collect();
        let number = |node: &roxmltree::Node<'_, '_>, name: &str| node.attribute(name).unwrap().parse::<f64>().unwrap();
        let [solve, wait, nothing] = rectangles.as_slice() else { panic!("{text}") };
        // Places are written with a tenth.
        assert!((number(solve, "width") - 3.0 * number(wait, "width")).abs() < 0.5, "{text}");
        assert!((number(solve, "x") + number(solve, "width") - number(wait, "x")).abs() < 0.2);
        assert_eq!(number(nothing, "width"), 0.0);
        for expected in ["4.000 ms", "particles, wait: 1.000 ms", "…", "its share<"] {
            assert!(text.contains(expected), "{expected} in {text}");
        }
    }
}
