//! Text of SVG and XHTML.

use std::fmt::Write as _;

/// A text with everything replaced that would be markup, and without characters that XML does not allow.
#[must_use]
pub fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for symbol in text.chars() {
        match symbol {
            '&' => escaped += "&amp;",
            '<' => escaped += "&lt;",
            '>' => escaped += "&gt;",
            '"' => escaped += "&quot;",
            '\n' | '\t' => escaped.push(symbol),
            control if control.is_control() || matches!(control, '\u{fffe}' | '\u{ffff}') => escaped.push('\u{fffd}'),
            other => escaped.push(other),
        }
    }
    escaped
}

/// A place or length in a drawing, with a tenth of a unit.
#[must_use]
pub fn place(length: f64) -> String {
    let text = format!("{length:.1}");
    match text.strip_suffix(".0") {
        Some("-0") => "0".into(),
        Some(whole) => whole.into(),
        None => text,
    }
}

/// A drawing of some width and height that fills the width it is given.
#[derive(Clone, Debug)]
pub struct Drawing {
    text: String,
}

impl Drawing {
    /// An empty drawing; `name` is what screen readers say.
    #[must_use]
    pub fn new(width: f64, height: f64, name: &str) -> Self {
        let (width, height) = (place(width), place(height));
        let name = escape(name);
        Self {
            text: format!(
                "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{name}\">\n"
            ),
        }
    }

    /// A line.
    pub fn line(&mut self, class: &str, from: [f64; 2], to: [f64; 2]) {
        let [x1, y1, x2, y2] = [from[0], from[1], to[0], to[1]].map(place);
        self.put(format_args!("<line class=\"{class}\" x1=\"{x1}\" y1=\"{y1}\" x2=\"{x2}\" y2=\"{y2}\"/>"));
    }

    /// A rectangle with a note that is shown where the pointer rests on it.
    pub fn rectangle(&mut self, class: &str, [x, y]: [f64; 2], [width, height]: [f64; 2], note: &str) {
        let [x, y, width, height] = [x, y, width.max(0.0), height.max(0.0)].map(place);
        let note = escape(note);
        self.put(format_args!(
            "<rect class=\"{class}\" x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\"><title>{note}</title></rect>"
        ));
    }

    /// A path.
    pub fn path(&mut self, class: &str, path: &str) {
        self.put(format_args!("<path class=\"{class}\" d=\"{path}\"/>"));
    }

    /// A text that begins, has its middle or ends at a place, as the class says.
    pub fn text(&mut self, class: &str, [x, y]: [f64; 2], text: &str) {
        let ([x, y], text) = ([x, y].map(place), escape(text));
        self.put(format_args!("<text class=\"{class}\" x=\"{x}\" y=\"{y}\">{text}</text>"));
    }

    /// A text that runs upwards with its middle at a place.
    pub fn text_upwards(&mut self, class: &str, [x, y]: [f64; 2], text: &str) {
        let ([x, y], text) = ([x, y].map(place), escape(text));
        self.put(format_args!("<text class=\"{class}\" transform=\"translate({x} {y}) rotate(-90)\">{text}</text>"));
    }

    /// Markup of one's own.
    pub fn raw(&mut self, markup: &str) {
        self.text.push_str(markup);
        self.text.push('\n');
    }

    /// The whole drawing.
    #[must_use]
    pub fn finish(mut self) -> String {
        self.text.push_str("</svg>\n");
        self.text
    }

    fn put(&mut self, element: std::fmt::Arguments<'_>) {
        // Writing to a text cannot fail.
        let _ = writeln!(self.text, "{element}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_cannot_become_markup() {
        assert_eq!(escape("a<b & \"c\">\u{0}\n"), "a&lt;b &amp; &quot;c&quot;&gt;\u{fffd}\n");
        let mut drawing = Drawing::new(10.0, 5.5, "</svg>");
        drawing.rectangle("bar", [0.0, -0.04], [-1.0, 2.25], "<script>");
        let text = drawing.finish();
        assert_eq!(text.matches("</svg>").count(), 1);
        assert!(!text.contains("<script") && text.contains("y=\"0\" width=\"0\" height=\"2.2\""), "{text}");
    }
}
