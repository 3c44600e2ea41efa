//! The sections with pictures: points as spheres, grids as planes through their middle.

use super::{
    html::section,
    plot::{self, Axis, Bounds, Ramp, View, count, escape, quantity},
    snapshots::{self, Cloud, Cut, Pictures, Sliced, Snapshot},
};

/// Coloured rectangles in all pictures of grids together, about: beyond, planes are drawn more coarsely.
const CELLS: f64 = 16_000.0;

/// A section for each support of points and each grid.
pub fn pictures(pictures: &Pictures) -> String {
    let clouds = pictures.clouds.iter().map(|cloud| (&cloud.support, points(cloud)));
    let planes: usize = pictures.grids.iter().flat_map(|sliced| &sliced.shown).map(|cut| cut.planes.len()).sum();
    let side = (CELLS / planes.max(1) as f64).sqrt() as usize;
    let grids = pictures.grids.iter().map(|sliced| (&sliced.support, slices(sliced, side)));
    let mut text = String::new();
    let mut before = None;
    for (support, markup) in clouds.chain(grids).filter(|(_, markup)| !markup.is_empty()) {
        // The fields on one grid stand under one heading; the colours stand on the page once.
        let shades = if before.is_none() { plot::gradients() } else { String::new() };
        text += &if before == Some(support) { markup } else { section(&capital(support), &(shades + &markup)) };
        before = Some(support);
    }
    text
}

fn points(cloud: &Cloud) -> String {
    let Cloud { support, colouring, shown } = cloud;
    let bounds = shown.iter().filter_map(|snapshot| Bounds::around(&snapshot.spheres)).reduce(Bounds::with);
    let Some(bounds) = bounds else { return String::new() };
    let axis = Axis::linear(&colouring.name.replace('_', " "), &colouring.unit);
    let ramp = Ramp { axis, range: snapshots::range(shown) };
    let mut text = String::new();
    let (mut thinned, mut outside) = (false, false);
    for (view, from) in
        [(View::Front, "from the front (x to the right, z up)"), (View::Above, "from above (x to the right, y up)")]
    {
        text += &format!("<p class=\"faint\">Seen {from}:</p>\n<div class=\"pictures\">\n");
        for Snapshot { t_s, step, spheres } in shown {
            let name = format!("t = {}", quantity(*t_s, "s"));
            let picture = plot::picture(&format!("{support} at {name}, {from}"), spheres, &bounds, view, &ramp);
            let drawn = if picture.drawn < picture.visible {
                format!(", {} of {} drawn", count(picture.drawn as u64), count(picture.visible as u64))
            } else {
                String::new()
            };
            thinned |= picture.drawn < picture.visible;
            outside |= picture.outside > 0;
            text += &format!(
                "<figure><figcaption>{name} <span class=\"faint\">step {step}, {} {}{drawn}</span></figcaption>\n{}</figure>\n",
                count(spheres.len() as u64),
                escape(support),
                picture.drawing
            );
        }
        text += "</div>\n";
    }
    text += &format!(
        "<figure class=\"ramp\">{}</figure>\n<p class=\"faint\">All pictures have the same scale and colours.",
        ramp.drawing()
    );
    if thinned {
        text += &format!(" Where more than 5000 {} can be seen, every n-th is drawn.", escape(support));
    }
    if outside {
        text += " Strays, of each direction's outermost 1 % at either end, may be beyond the pictures.";
    }
    text + "</p>\n"
}

fn slices(sliced: &Sliced, side: usize) -> String {
    let Sliced { support, colouring, shown } = sliced;
    let label = colouring.name.replace('_', " ");
    let ramp = Ramp { axis: Axis::linear(&label, &colouring.unit), range: snapshots::range_of_cuts(shown) };
    let planes = shown.first().map_or(0, |cut| cut.planes.len());
    let mut text = String::new();
    for plane in 0..planes {
        let cuts = shown.iter().filter_map(|cut| Some((cut, cut.planes.get(plane)?)));
        let mut figures = String::new();
        let mut heading = String::new();
        for (Cut { t_s, step, .. }, slice) in cuts {
            let [width, height] = slice.size_m.map(|length| quantity(length, "m"));
            heading = format!("{label} in the {} = {}, {width} by {height}", slice.plane(), quantity(slice.at_m, "m"));
            let time = format!("t = {}", quantity(*t_s, "s"));
            let drawing = slice.drawing(&format!("{label} on {support} at {time}, {}", slice.plane()), &ramp, side);
            figures += &format!(
                "<figure><figcaption>{time} <span class=\"faint\">step {step}</span></figcaption>\n{drawing}</figure>\n"
            );
        }
        text += &format!("<p class=\"faint\">{}:</p>\n<div class=\"pictures\">\n{figures}</div>\n", escape(&heading));
    }
    text + &format!(
        "<figure class=\"ramp\">{}</figure>\n<p class=\"faint\">All these pictures have the same scale and colours. A plane \
         with more than {side} values along a side shows every n-th.</p>\n",
        ramp.drawing()
    )
}

/// A name at the beginning of a heading.
fn capital(name: &str) -> String {
    let mut letters = name.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}
