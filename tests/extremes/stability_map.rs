//! The map of what each rule does over step and stiffness, as a picture: `docs/images/stability.svg`.

use std::{fmt::Write as _, fs};

use super::{Course, Rule, System, contracts_to, course, stable_to};

const PICTURE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/images/stability.svg");

/// Cells across and up, and decades they span: of the step in s, and of the stiffness in N/m.
const CELLS: [usize; 2] = [48, 32];
const STEPS: [f64; 2] = [-4.5, -0.5];
const STIFFNESSES: [f64; 2] = [2.0, 6.0];
/// Width and height of a panel and the room about it, in pixels.
const PANEL: [f64; 2] = [252.0, 190.0];
const ROOM: [f64; 2] = [44.0, 62.0];
const TOP: f64 = 56.0;

const RULES: [(&str, Rule); 4] = [
    ("Verlet", Rule::Verlet),
    ("trapezoidal, φ = 0", Rule::Trapezoidal { phi: 0.0, anderson: false }),
    ("trapezoidal, φ = ½", Rule::Trapezoidal { phi: 0.5, anderson: false }),
    ("trapezoidal, φ = 1", Rule::Trapezoidal { phi: 1.0, anderson: false }),
];

fn decade([from, to]: [f64; 2], cell: usize, cells: usize) -> f64 {
    from + (to - from) * (cell as f64 + 0.5) / cells as f64
}

fn colour(course: Course) -> &'static str {
    match course {
        Course::Decays => "#cfe3f5",
        Course::Grows => "#c8553d",
        Course::Refused => "#e9d8a6",
    }
}

/// A panel: cells, the theoretical borders over them, axes.
fn panel(system: System, (title, rule): (&str, Rule), [x, y]: [f64; 2]) -> String {
    let mut svg =
        format!("<g transform=\"translate({x:.0},{y:.0})\">\n<text class=\"title\" y=\"-8\">{title}</text>\n");
    let [width, height] = [PANEL[0] / CELLS[0] as f64, PANEL[1] / CELLS[1] as f64];
    for up in 0..CELLS[1] {
        let stiffness = 10f64.powf(decade(STIFFNESSES, up, CELLS[1]));
        let row: Vec<Course> = (0..CELLS[0])
            .map(|across| course(system, rule, stiffness, 10f64.powf(decade(STEPS, across, CELLS[0]))))
            .collect();
        // Cells alike are one rectangle.
        let mut from = 0;
        for cells in row.chunk_by(|a, b| a == b) {
            let (left, top) = (from as f64 * width, PANEL[1] - (up + 1) as f64 * height);
            let wide = cells.len() as f64 * width;
            writeln!(
                svg,
                "<rect x=\"{left:.2}\" y=\"{top:.2}\" width=\"{wide:.2}\" height=\"{:.2}\" fill=\"{}\"/>",
                height + 0.3,
                colour(cells[0])
            )
            .unwrap();
            from += cells.len();
        }
    }
    for (z, class) in [(stable_to(rule), "stable"), (contracts_to(rule, 1.0), "contracts")] {
        svg += &border(system, z, class);
    }
    svg + &axes(system == System::Contact) + "</g>\n"
}

/// The line ω Δt = z.
fn border(system: System, z: f64, class: &str) -> String {
    if !z.is_finite() {
        return String::new();
    }
    let per_mass: f64 = if system == System::Pair { 2.0 } else { 1.0 };
    let point = |stiffness: f64| {
        let step = z.log10() - 0.5 * (per_mass.log10() + stiffness);
        let x = PANEL[0] * (step - STEPS[0]) / (STEPS[1] - STEPS[0]);
        let y = PANEL[1] * (STIFFNESSES[1] - stiffness) / (STIFFNESSES[1] - STIFFNESSES[0]);
        format!("{x:.2},{y:.2}")
    };
    format!("<polyline class=\"{class}\" points=\"{} {}\"/>\n", point(STIFFNESSES[0]), point(STIFFNESSES[1]))
}

fn axes(named: bool) -> String {
    let mut svg = format!("<rect class=\"frame\" width=\"{}\" height=\"{}\"/>\n", PANEL[0], PANEL[1]);
    for decade in -4..=-1 {
        let x = PANEL[0] * (f64::from(decade) - STEPS[0]) / (STEPS[1] - STEPS[0]);
        writeln!(
            svg,
            "<text class=\"tick\" x=\"{x:.1}\" y=\"{:.0}\" text-anchor=\"middle\">1e{decade}</text>",
            PANEL[1] + 14.0
        )
        .unwrap();
    }
    for decade in [2, 3, 4, 5, 6] {
        let y = PANEL[1] * (STIFFNESSES[1] - f64::from(decade)) / (STIFFNESSES[1] - STIFFNESSES[0]);
        writeln!(svg, "<text class=\"tick\" x=\"-5\" y=\"{:.1}\" text-anchor=\"end\">1e{decade}</text>", y + 4.0)
            .unwrap();
    }
    if named {
        writeln!(
            svg,
            "<text class=\"tick\" x=\"{:.0}\" y=\"{:.0}\" text-anchor=\"middle\">step Δt in s</text>",
            0.5 * PANEL[0],
            PANEL[1] + 30.0
        )
        .unwrap();
    }
    svg
}

#[test]
fn the_map_is_in_the_docs() {
    if std::env::var_os("STAGGER_BLESS").is_some() {
        let [width, height] = [4.0 * (PANEL[0] + ROOM[0]) + 12.0, TOP + 2.0 * (PANEL[1] + ROOM[1]) + 34.0];
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width:.0} {height:.0}\" font-family=\"sans-serif\">\n<style>\
             .title {{ font-size: 13px; font-weight: bold }} .tick {{ font-size: 11px; fill: #444 }} .frame {{ fill: none; stroke: #666 }} \
             .stable {{ stroke: #111; stroke-width: 2; fill: none }} \
             .contracts {{ stroke: #111; stroke-width: 2; stroke-dasharray: 6 4; fill: none }}</style>\n\
             <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
        );
        for (row, (system, name)) in [
            (System::Pair, "A pair held by the near field: the rules alone. Stiffness in N/m over step"),
            (System::Contact, "A sphere pressed onto a plate: the rules as the program guards them"),
        ]
        .into_iter()
        .enumerate()
        {
            let y = TOP + row as f64 * (PANEL[1] + ROOM[1]);
            writeln!(svg, "<text x=\"{:.0}\" y=\"{:.0}\" font-size=\"14\">{name}</text>", ROOM[0], y - 28.0).unwrap();
            for (column, rule) in RULES.into_iter().enumerate() {
                svg += &panel(system, rule, [ROOM[0] + column as f64 * (PANEL[0] + ROOM[0]), y]);
            }
        }
        svg += &legend(height - 16.0);
        fs::write(PICTURE, svg + "</svg>\n").unwrap();
    }
    // One frame to each panel.
    assert_eq!(fs::read_to_string(PICTURE).unwrap().matches("class=\"frame\"").count(), 2 * RULES.len());
}

fn legend(y: f64) -> String {
    let mut svg = String::new();
    let mut x = ROOM[0];
    for (course, name) in
        [(Course::Decays, "decays"), (Course::Grows, "grows"), (Course::Refused, "a smaller step is asked for")]
    {
        writeln!(
            svg,
            "<rect x=\"{x:.0}\" y=\"{:.0}\" width=\"14\" height=\"14\" fill=\"{}\"/>",
            y - 12.0,
            colour(course)
        )
        .unwrap();
        writeln!(svg, "<text class=\"tick\" x=\"{:.0}\" y=\"{y:.0}\">{name}</text>", x + 20.0).unwrap();
        x += 50.0 + 7.0 * name.len() as f64;
    }
    for (class, name) in [
        ("stable", "theory: the rule is stable to the left"),
        ("contracts", "theory: the plain iteration contracts to the left"),
    ] {
        writeln!(svg, "<polyline class=\"{class}\" points=\"{x:.0},{:.0} {:.0},{:.0}\"/>", y - 5.0, x + 30.0, y - 5.0)
            .unwrap();
        writeln!(svg, "<text class=\"tick\" x=\"{:.0}\" y=\"{y:.0}\">{name}</text>", x + 36.0).unwrap();
        x += 66.0 + 6.4 * name.len() as f64;
    }
    svg
}
