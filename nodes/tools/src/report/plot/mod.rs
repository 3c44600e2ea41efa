//! Plots as inline SVG: lines, marks, bars, histograms, spheres and planes of grids. They know nothing of runs.
//!
//! Every plot is a `<figure>` that stands in a page with the style sheet [`STYLE`], which colours it for light and dark.

#![allow(clippy::disallowed_methods, reason = "what is drawn is neither recorded nor decided upon")]

mod axis;
mod bars;
mod chart;
mod histogram;
mod quantity;
mod ramp;
mod slices;
mod spheres;
mod svg;
mod thinned;

pub use axis::{Axis, Ruler, Scale, Tick};
pub use bars::{Bar, Bars};
pub use chart::{Chart, Level, Mark, Series};
pub use histogram::{Distribution, histogram};
pub use quantity::{Scaled, count, number, power_of_ten, quantity, scaled};
pub use ramp::{Ramp, gradients};
pub use slices::Slice;
pub use spheres::{Bounds, Sphere, View, Visible, picture};
pub use svg::{Drawing, escape};
pub use thinned::Thinned;

/// The rules plots are drawn by.
pub const STYLE: &str = include_str!("style.css");

/// Colours that are told apart; a further series has the first again, with other dashes.
const COLOURS: usize = 7;
/// Width of plots, in units of their drawing; their text is 12 high.
const WIDTH: f64 = 480.0;
/// Mean width of a character.
const CHARACTER: f64 = 6.4;

/// Class of the n-th series: its colour, and its dashes where colours come again.
fn series_class(number: usize) -> String {
    format!("c{} d{}", number % COLOURS, number / COLOURS % 3)
}

/// Width of a text.
fn text_width(text: &str) -> f64 {
    text.chars().count() as f64 * CHARACTER
}

/// A figure: its title, what is drawn, and the names of its series, which wrap as text does.
fn figure(title: &str, drawing: &str, legend: &[(String, String)]) -> String {
    let mut text = format!("<figure><figcaption>{}</figcaption>\n{drawing}", escape(title));
    if !legend.is_empty() {
        text += "<ul class=\"legend\">";
        for (class, name) in legend {
            text += &format!(
                "<li><svg viewBox=\"0 0 18 8\" aria-hidden=\"true\"><path class=\"{class}\" d=\"M0 4H18\"/></svg>{}</li>",
                escape(name)
            );
        }
        text += "</ul>\n";
    }
    text + "</figure>\n"
}
