//! A physics of one's own on a grid, in a scene without particles: it is recorded, told, exported and reported as what it is.

use std::{error::Error, path::Path, process::Output, sync::Arc};

use serde_json::Value;
use stagger_coupling::{Frozen, Physics, Reply, SolveError, Window};
use stagger_messages::{Field, Geometry, Grid, Measure, Port, Ports};
use stagger_runtime::node::plug_in::{self, Setup};

use super::program::{Workplace, said, stagger};

/// Tells the test binary to be the node, and which centring its grid has.
const CENTRING: &str = "STAGGER_TEST_CENTRING";
const DIMS: [u32; 3] = [4, 3, 2];
const ORIGIN_M: [f64; 3] = [-1e-3, 0.5e-3, 2e-3];
const SPACING_M: [f64; 3] = [0.5e-3, 1e-3, 2e-3];
const RATE_1_S: f64 = 100.0;

/// du/dt = -RATE u on a grid, exactly for each window by its linear function, and its sum.
struct Decay {
    value: Arc<Port>,
    total: Arc<Port>,
    grid: Grid,
}

impl Decay {
    fn new(_: &Setup) -> Result<Self, Box<dyn Error>> {
        let of = match std::env::var(CENTRING)?.as_str() {
            "node" => Grid::of_nodes,
            _ => Grid::of_cells,
        };
        Ok(Self {
            value: Arc::new(Port::f64("dye", "kg/m^3", "tank", 1, Measure::Magnitude)),
            total: Arc::new(Port::f64("total_dye", "kg", "whole", 1, Measure::None)),
            grid: of(ORIGIN_M, SPACING_M, DIMS),
        })
    }

    fn reply(&self, values: &[f64]) -> Result<Reply, SolveError> {
        let total = values.iter().sum::<f64>() * SPACING_M.iter().product::<f64>();
        let fields = [Field::new(&self.value, 0, values.to_vec())?, Field::new(&self.total, 0, vec![total])?];
        let fields = fields.into_iter().map(|field| (field.name().to_owned(), field)).collect();
        Ok(Reply { fields, ..Reply::default() })
    }
}

impl Physics for Decay {
    type State = Vec<f64>;

    fn ports(&self) -> Ports {
        Ports::new(Vec::new(), vec![(*self.value).clone(), (*self.total).clone()])
            .with(Geometry::grid("tank", self.grid.clone()))
            .with(Geometry::global("whole"))
    }

    fn initial(&self) -> Result<(Vec<f64>, Reply), SolveError> {
        let start: Vec<f64> = (0..self.grid.rows()).map(|row| 1.0 + row as f64).collect();
        let reply = self.reply(&start)?;
        Ok((start, reply))
    }

    fn solve(&self, state: &Vec<f64>, _: &Frozen, window: Window) -> Result<(Vec<f64>, Reply), SolveError> {
        let end: Vec<f64> = state.iter().map(|value| value * (1.0 - RATE_1_S * window.dt_s)).collect();
        let reply = self.reply(&end)?;
        Ok((end, reply))
    }
}

/// Not a test but the node, where a launcher started it as one.
#[test]
fn as_a_node() {
    if std::env::var_os(CENTRING).is_some() && std::env::var_os("STAGGER_RUN").is_some() {
        let code = plug_in::main(Decay::new);
        std::process::exit(i32::from(code != std::process::ExitCode::SUCCESS));
    }
}

/// A run of the grid alone, recorded.
fn recorded(centring: &str) -> Workplace {
    let own = std::env::current_exe().unwrap();
    let command = format!("[{own:?}, \"--exact\", \"supports::as_a_node\", \"--nocapture\"]");
    let place =
        Workplace::of(&format!("duration = \"5 ms\"\n[coupling]\ndt = \"1 ms\"\n[nodes.dye]\ncommand = {command}\n"));
    let mut run = stagger();
    run.arg("run").arg(&place.scene).arg("--record").arg(place.path("run.mcap")).env(CENTRING, centring);
    let output = run.output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
    place
}

fn asked(place: &Workplace, arguments: &[&str]) -> Output {
    let mut command = stagger();
    command.arg(arguments[0]).arg(place.path("run.mcap")).args(&arguments[1..]).current_dir(place.path("."));
    let output = command.output().unwrap();
    assert!(output.status.success(), "{arguments:?}: {}", said(&output));
    output
}

/// The values of the one array of numbers in a VTK file, read as its XML says.
fn values(contents: &[u8], name: &str) -> (roxmltree::Document<'static>, Vec<f64>) {
    let mark = b"<AppendedData encoding=\"raw\">\n_";
    let at = contents.windows(mark.len()).position(|window| window == mark).unwrap() + mark.len();
    let head = String::from_utf8(contents[..at].to_vec()).unwrap() + "</AppendedData></VTKFile>";
    let xml = roxmltree::Document::parse(String::leak(head)).unwrap();
    let offset = xml.descendants().find(|node| node.attribute("Name") == Some(name)).unwrap();
    let from = at + offset.attribute("offset").unwrap().parse::<usize>().unwrap();
    let bytes = u64::from_le_bytes(contents[from..from + 8].try_into().unwrap()) as usize;
    let numbers = contents[from + 8..from + 8 + bytes].chunks_exact(8);
    let numbers = numbers.map(|number| f64::from_le_bytes(number.try_into().unwrap())).collect();
    (xml, numbers)
}

/// What the recording holds at the end of step `step`.
fn expected(step: i32) -> Vec<f64> {
    (0..24).map(|row| (0..step).fold(1.0 + f64::from(row), |value, _| value * (1.0 - RATE_1_S * 1e-3))).collect()
}

fn is_close(found: &[f64], expected: &[f64]) -> bool {
    found.len() == expected.len() && found.iter().zip(expected).all(|(a, b)| (a - b).abs() <= 1e-12 * b.abs())
}

#[test]
fn a_grid_alone_is_told_exported_and_reported() {
    let place = recorded("cell");
    let info: Value = serde_json::from_slice(&asked(&place, &["info", "--json"]).stdout).unwrap();
    let (tank, whole) = (&info["supports"]["tank"], &info["supports"]["whole"]);
    assert_eq!((&tank["kind"], &tank["centring"], &whole["kind"]), (&"grid".into(), &"cell".into(), &"global".into()));
    assert_eq!((&tank["dims"], &tank["fields"]), (&serde_json::json!(DIMS), &serde_json::json!(["dye"])));
    assert_eq!((&tank["origin_m"], &tank["spacing_m"]), (&serde_json::json!(ORIGIN_M), &serde_json::json!(SPACING_M)));
    let text = String::from_utf8(asked(&place, &["info"]).stdout).unwrap();
    assert!(text.contains("grid of 4 x 3 x 2 cells"), "{text}");

    let said = String::from_utf8(asked(&place, &["export", "--out", "out", "--vtp", "--csv"]).stdout).unwrap();
    assert!(said.contains("6 states: open out/tank.pvd in ParaView"), "{said}");
    let list = std::fs::read_to_string(place.path("out/tank.pvd")).unwrap();
    assert_eq!(list.matches("<DataSet").count(), 6);
    for step in [0, 5] {
        let contents = std::fs::read(place.path(&format!("out/tank-{step:06}.vti"))).unwrap();
        let (xml, found) = values(&contents, "dye");
        assert!(is_close(&found, &expected(step)), "{found:?}");
        let image = xml.descendants().find(|node| node.has_tag_name("ImageData")).unwrap();
        let numbers = |name: &str| -> Vec<f64> {
            image.attribute(name).unwrap().split(' ').map(|number| number.parse().unwrap()).collect()
        };
        assert_eq!((numbers("Origin"), numbers("Spacing")), (ORIGIN_M.into(), SPACING_M.into()));
        // Points are one more than cells.
        assert_eq!(numbers("WholeExtent"), [0.0, 4.0, 0.0, 3.0, 0.0, 2.0]);
        let dye = xml.descendants().find(|node| node.attribute("Name") == Some("dye")).unwrap();
        assert!(dye.parent().unwrap().has_tag_name("CellData"));
        let time = values(&contents, "TimeValue").1;
        assert!(is_close(&time, &[f64::from(step) * 1e-3]), "{time:?}");
    }
    let table = std::fs::read_to_string(place.path("out/scalars.csv")).unwrap();
    let mut lines = table.lines();
    let column = lines.next().unwrap().split(',').position(|name| name == "field total_dye: max [kg]").unwrap();
    let last: f64 = lines.last().unwrap().split(',').nth(column).unwrap().parse().unwrap();
    assert!(is_close(&[last], &[expected(5).iter().sum::<f64>() * 1e-9]), "{last}");

    asked(&place, &["report", "--out", "page.html"]);
    page(&std::fs::read_to_string(place.path("page.html")).unwrap());
    shown(&place.path("run.mcap"));
}

/// The page has the planes of the grid at three times, and a curve of the number without a place.
fn page(page: &str) {
    let options = roxmltree::ParsingOptions { allow_dtd: true, ..Default::default() };
    let page = roxmltree::Document::parse_with_options(page, options).unwrap();
    let labels: Vec<_> = page.descendants().filter_map(|node| node.attribute("aria-label")).collect();
    for plane in ["x-y plane at z", "x-z plane at y", "y-z plane at x"] {
        let found = labels.iter().filter(|label| label.starts_with("dye on tank") && label.contains(plane)).count();
        assert_eq!(found, 3, "{plane}: {labels:?}");
    }
    let picture = page.descendants().find(|node| node.attribute("aria-label").is_some_and(|it| it.contains("x-y")));
    // The lowest value of the plane is the lower left one, and no two neighbours in it are equal.
    assert!(picture.unwrap().descendants().filter(|node| node.has_tag_name("rect")).count() >= 6);
    let captions = page.descendants().filter(|node| node.has_tag_name("figcaption"));
    let curve = captions.filter_map(|node| node.text().map(|text| (text, node))).find(|(text, _)| *text == "total dye");
    let figure = curve.unwrap().1.parent().unwrap();
    assert!(figure.descendants().any(|node| node.has_tag_name("path")), "no curve");
}

/// Other programs are shown the grid's values as points, and the number as a scalar.
fn shown(recording: &Path) {
    let contents = std::fs::read(recording).unwrap();
    for topic in ["display/tank", "display/scalars/dye/mean", "display/scalars/total_dye/value"] {
        assert!(contents.windows(topic.len()).any(|window| window == topic.as_bytes()), "{topic}");
    }
}

#[test]
fn values_at_nodes_are_point_data() {
    let place = recorded("node");
    asked(&place, &["export", "--out", "out", "--every", "5"]);
    let contents = std::fs::read(place.path("out/tank-000005.vti")).unwrap();
    let (xml, found) = values(&contents, "dye");
    assert!(is_close(&found, &expected(5)), "{found:?}");
    let piece = xml.descendants().find(|node| node.has_tag_name("Piece")).unwrap();
    assert_eq!(piece.attribute("Extent"), Some("0 3 0 2 0 1"));
    let dye = xml.descendants().find(|node| node.attribute("Name") == Some("dye")).unwrap();
    assert!(dye.parent().unwrap().has_tag_name("PointData"));
    // It has no pairs of points.
    let mut contacts = stagger();
    contacts.arg("export").arg(place.path("run.mcap")).arg("--out").arg(place.path("lines")).arg("--contacts");
    let output = contacts.output().unwrap();
    assert!(!output.status.success() && said(&output).contains("no pairs of points"), "{}", said(&output));
}
