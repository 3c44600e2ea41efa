//! Values as colours: the ramp beside pictures, and the shades spheres are drawn with.

use std::fmt::Write as _;

use stagger_recordings::display::colour_scale::{self, NO_VALUE, Range};

use super::{WIDTH, axis::Axis, svg::Drawing};

/// Colours that spheres are drawn in; neighbours are too close to be told apart.
const SHADES: usize = 32;
/// Height of the ramp.
const HEIGHT: f64 = 14.0;
/// Colours between which the ramp is drawn evenly; the map itself has nine.
const STOPS: usize = 33;

/// What colours mean.
#[derive(Clone, Debug)]
pub struct Ramp {
    /// The quantity and its unit.
    pub axis: Axis,
    /// The values of the darkest and the lightest colour.
    pub range: Range,
}

impl Ramp {
    /// Name of the shade for a value (see [`gradients`]).
    #[must_use]
    pub fn shade(&self, value: f64) -> String {
        if value.is_nan() {
            return "sx".into();
        }
        let fraction = self.range.fraction(value, colour_scale::Scale::Linear);
        format!("s{}", (fraction * (SHADES - 1) as f64).round() as usize)
    }

    /// The plain colour of that shade, as a style sheet has it.
    #[must_use]
    pub fn colour(&self, value: f64) -> String {
        if value.is_nan() {
            return hex(NO_VALUE);
        }
        let fraction = self.range.fraction(value, colour_scale::Scale::Linear);
        hex(colour_scale::colour((fraction * (SHADES - 1) as f64).round() / (SHADES - 1) as f64))
    }

    /// The ramp with its numbers.
    #[must_use]
    pub fn drawing(&self) -> String {
        let range = if self.range.is_empty() { Range { min: 0.0, max: 0.0 } } else { self.range };
        let ruler = self.axis.over([range.min, range.max].into_iter(), 6);
        let (left, width) = (30.0, WIDTH - 60.0);
        let mut drawing = Drawing::new(WIDTH, HEIGHT + 36.0, &ruler.title);
        drawing.raw(&format!("<rect x=\"{left}\" y=\"0\" width=\"{width}\" height=\"{HEIGHT}\" fill=\"url(#ramp)\"/>"));
        // The colours end where the values do, not at the outer marks.
        let span = range.max - range.min;
        for tick in ruler.ticks.iter().filter(|tick| span > 0.0 && tick.at >= range.min && tick.at <= range.max) {
            let at = left + width * (tick.at - range.min) / span;
            drawing.line("axis", [at, HEIGHT], [at, HEIGHT + 4.0]);
            drawing.text("middle", [at, HEIGHT + 16.0], &tick.label);
        }
        let title = if span > 0.0 {
            ruler.title
        } else {
            format!("{}: {} everywhere", self.axis.label, super::quantity(range.min, &self.axis.unit))
        };
        drawing.text("middle", [0.5 * WIDTH, HEIGHT + 32.0], &title);
        drawing.finish()
    }
}

/// The shades of all spheres on a page, lit from the upper left, and the colours of its ramps; they stand in it once.
#[must_use]
pub fn gradients() -> String {
    let mut text = String::from("<svg class=\"shades\" width=\"0\" height=\"0\" aria-hidden=\"true\"><defs>\n");
    let shades =
        (0..SHADES).map(|shade| (format!("s{shade}"), colour_scale::colour(shade as f64 / (SHADES - 1) as f64)));
    for (name, colour) in shades.chain([("sx".to_owned(), NO_VALUE)]) {
        let [light, plain, dark] = [mixed(colour, 255.0, 0.4), hex(colour), mixed(colour, 0.0, 0.45)];
        // Writing to a text cannot fail.
        let _ = writeln!(
            text,
            "<radialGradient id=\"{name}\" cx=\".35\" cy=\".32\" r=\".75\"><stop offset=\"0\" stop-color=\"{light}\"/>\
             <stop offset=\".5\" stop-color=\"{plain}\"/><stop offset=\"1\" stop-color=\"{dark}\"/></radialGradient>"
        );
    }
    text += "<linearGradient id=\"ramp\">";
    for stop in 0..STOPS {
        let fraction = stop as f64 / (STOPS - 1) as f64;
        let _ = write!(text, "<stop offset=\"{fraction:.4}\" stop-color=\"{}\"/>", hex(colour_scale::colour(fraction)));
    }
    text + "</linearGradient>\n</defs></svg>\n"
}

fn hex([red, green, blue]: [u8; 3]) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

fn mixed(colour: [u8; 3], with: f64, share: f64) -> String {
    hex(colour.map(|channel| (f64::from(channel) * (1.0 - share) + with * share).round() as u8))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value_has_a_shade_that_is_defined() {
        let ramp = Ramp { axis: Axis::linear("temperature", "K"), range: Range { min: 300.0, max: 400.0 } };
        let defined = gradients();
        for value in [300.0, 350.0, 400.0, -1.0, 1e9, f64::NAN, f64::INFINITY] {
            assert!(defined.contains(&format!("id=\"{}\"", ramp.shade(value))), "{value}");
        }
        assert_eq!((ramp.shade(300.0).as_str(), ramp.shade(400.0).as_str()), ("s0", "s31"));
        roxmltree::Document::parse(&defined).unwrap();
        assert!(ramp.drawing().contains("temperature [K]"));
        let flat = Ramp { range: Range { min: 300.0, max: 300.0 }, ..ramp.clone() };
        assert!(flat.drawing().contains("temperature: 300.0 K everywhere"), "{}", flat.drawing());
        let empty = Ramp { range: Range::EMPTY, ..ramp };
        roxmltree::Document::parse(&empty.drawing()).unwrap();
    }
}
