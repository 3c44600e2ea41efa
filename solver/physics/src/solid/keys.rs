//! `[solid]`: the temperature of a solid on a grid.

use stagger_config::{
    key::{Key, Kind, Range, Section},
    problems::nearest,
    reader::Table,
    units::{HEAT_TRANSFER, INTENSITY, LENGTH, NUMBER, PER_LENGTH, TEMPERATURE, TIME},
};

use super::{Evaporation, Face, Level, Light, Settings, Track, tradeoff::TRADEOFF};
use crate::{
    PhysicsKind, Surroundings,
    common::{
        HeatMaterial, PhaseBands, Pictured, Table as Property,
        grid::{CellGrid, FaceMean},
        keys::{grids, materials},
        missing_property,
    },
    configured,
};

static GRID: Key = Key::new("grid", Kind::Text, "Its cells: the name of a table of [grids].");
static MATERIAL: Key = Key::new("material", Kind::Text, "What it is made of.").or("\"316L\"");
static START: Key =
    Key::new("temperature", Kind::Number(&TEMPERATURE, Range::NOT_NEGATIVE), "Temperature at the start.")
        .or("\"293.15 K\"");
static LEVEL: Key = Key::new(
    "level",
    Kind::Choice(&[
        ("implicit", "one step, however long it is, by Newton's method with multigrid"),
        ("explicit", "forward Euler in substeps below the explicit limit: cheap where steps are short anyway"),
    ]),
    "How a step is taken.",
)
.or("\"implicit\"");
static PHI: Key = Key::new(
    "phi",
    Kind::Number(&NUMBER, Range::above(0.0, 1.0)),
    "Weight φ of the step's end (eqs. 5.34–5.37): 1/2 is second order in time, 1 keeps every temperature within those around it.",
)
.or("1")
.when("level", &["implicit"]);
static SHARE: Key = Key::new(
    "limit-share",
    Kind::Number(&NUMBER, Range::above(0.0, 1.0)),
    "Substep over the explicit limit, the least C/ΣG of the cells.",
)
.or("1")
.when("level", &["explicit"]);
static FACES: Key = Key::new(
    "face-conductivity",
    Kind::Choice(&[
        ("harmonic", "the two half cells in series: exact where materials meet at the face, and an insulator blocks"),
        ("arithmetic", "the mean of the two (eqs. 5.19–5.28)"),
    ]),
    "Conductivity between two cells.",
)
.or("\"harmonic\"");
static MELTING: Key = Key::new("melting", Kind::Flag, "Whether it melts, by the material's data.").or("false");
static BOILING: Key = Key::new(
    "boiling",
    Kind::Flag,
    "Whether a cell that has reached the boiling point takes up the heat of boiling there. Nothing leaves; where much boils, \
     evaporation is what holds the surface.",
)
.or("false");
static EVAPORATION: Key = Key::new(
    "evaporation",
    Kind::Flag,
    "Whether the top face is cooled by evaporation (Anisimov 1968): 0.82 L p √(M/(2π R θ)) with the vapour's pressure p at θ.",
)
.or("false");
static RELAXATION: Key = Key::new(
    "relaxation-time",
    Kind::Number(&TIME, Range::NOT_NEGATIVE),
    "Time in which the heat flux follows the gradient (second sound, eqs. 5.98–5.111); 0 is Fourier's law. With the implicit level.",
)
.or("0");
static TOLERANCE: Key = Key::new(
    "tolerance",
    Kind::Number(&NUMBER, Range::above(0.0, 0.1)),
    "Tolerance of its own iteration: largest change over the largest temperature. Well below that of [coupling].",
)
.or("1e-8");
static ITERATIONS: Key =
    Key::new("iterations", Kind::Whole(1, 10_000), "Iterations after which a smaller step is asked for.").or("50");
static LIGHT: Key =
    Key::new("light", Kind::Table(&LIGHT_SECTION), "How light that arrives on the top face is absorbed.")
        .or_from("all of it, in the uppermost cells");
static TRACK: Key =
    Key::new("track", Kind::Table(&TRACK_SECTION), "What is told of the track that melts.").or_from("along x");
static WALL: Key = Key::new(
    "wall",
    Kind::Text,
    "The wall of the scene that is its top face: contacts with it then take its temperature and give it their heat.",
)
.or_from("none");
static BOTTOM: Key = face("bottom", "Its face at the lower end of z.");
static TOP: Key = face("top", "Its face at the upper end of z, on which light falls.");
static SIDES: Key = face("sides", "Its four faces across x and y, where they have no table of their own.");
static LEFT: Key = side("left", "Its face at the lower end of x.");
static RIGHT: Key = side("right", "Its face at the upper end of x.");
static FRONT: Key = side("front", "Its face at the lower end of y.");
static BACK: Key = side("back", "Its face at the upper end of y.");

const fn face(name: &'static str, doc: &'static str) -> Key {
    Key::new(name, Kind::Table(&FACE_SECTION), doc).or_from("insulated")
}

const fn side(name: &'static str, doc: &'static str) -> Key {
    Key::new(name, Kind::Table(&FACE_SECTION), doc).or_from("as `sides`")
}

static SECTION: Section = Section {
    path: "solid",
    doc: "Temperature of a solid on a grid: the plate under the powder (Zohdi 2018, ch. 5). The upper end of z is its top, on \
          which light falls and particles rest.",
    example: "{ grid = \"plate\", material = \"316L\", melting = true }",
    shorthand: None,
    keys: &[
        &GRID,
        &MATERIAL,
        &START,
        &LEVEL,
        &PHI,
        &SHARE,
        &FACES,
        &MELTING,
        &BOILING,
        &EVAPORATION,
        &RELAXATION,
        &TOLERANCE,
        &ITERATIONS,
        &LIGHT,
        &TRACK,
        &WALL,
        &TOP,
        &BOTTOM,
        &SIDES,
        &LEFT,
        &RIGHT,
        &FRONT,
        &BACK,
    ],
};

static FACE_KIND: Key = Key::new(
    "kind",
    Kind::Choice(&[
        ("insulated", "no heat passes"),
        ("held", "it has a temperature"),
        ("flux", "a flux enters"),
        ("ambient", "it exchanges heat with its surroundings"),
    ]),
    "What holds there.",
);
static FACE_TEMPERATURE: Key = Key::new(
    "temperature",
    Kind::Number(&TEMPERATURE, Range::NOT_NEGATIVE),
    "Its temperature, or that of its surroundings.",
)
.or_from("that of the start")
.when("kind", &["held", "ambient"]);
static FLUX: Key =
    Key::new("flux", Kind::Number(&INTENSITY, Range::ANY), "The flux into the solid.").when("kind", &["flux"]);
static CONVECTION: Key =
    Key::new("convection", Kind::Number(&HEAT_TRANSFER, Range::NOT_NEGATIVE), "Coefficient h of convection.")
        .or("0")
        .when("kind", &["ambient"]);
static EMISSIVITY: Key = Key::new("emissivity", Kind::Number(&NUMBER, Range::within(0.0, 1.0)), "Emissivity ε.")
    .or("0")
    .when("kind", &["ambient"]);
static FACE_SECTION: Section = Section {
    path: "solid.top",
    doc: "A face of the solid; a word in place of the table is its kind. With surroundings it loses h (θ − θ_∞) + \
          ε σ_SB (θ⁴ − θ_∞⁴) per area.",
    example: "{ kind = \"ambient\", convection = \"20 W/(m^2 K)\", emissivity = 0.3 }",
    shorthand: Some(&FACE_KIND),
    keys: &[&FACE_KIND, &FACE_TEMPERATURE, &FLUX, &CONVECTION, &EMISSIVITY],
};

static ABSORPTIVITY: Key = Key::new(
    "absorptivity",
    Kind::Number(&NUMBER, Range::within(0.0, 1.0)),
    "Share of the light that enters; the rest is reflected.",
)
.or("1");
static ABSORPTION: Key = Key::new(
    "absorption",
    Kind::Number(&PER_LENGTH, Range::NOT_NEGATIVE),
    "Absorption coefficient a inside: light falls off as e^{−a ζ} with the depth ζ (eqs. 5.90–5.92).",
)
.or_from("all is absorbed in the uppermost cells");
static LIGHT_SECTION: Section = Section {
    path: "solid.light",
    doc: "How light that arrives on the top face is absorbed.",
    example: "{ absorptivity = 0.35 }",
    shorthand: None,
    keys: &[&ABSORPTIVITY, &ABSORPTION],
};

static ALONG: Key =
    Key::new("along", Kind::Choice(&[("x", "along x"), ("y", "along y")]), "Axis along which it runs.").or("\"x\"");
static BORDER: Key = Key::new(
    "border",
    Kind::Number(&TEMPERATURE, Range::POSITIVE),
    "Temperature at its border: what was as hot counts as molten.",
)
.or_from("the middle between solidus and liquidus");
static FROM: Key =
    Key::new("from", Kind::Number(&LENGTH, Range::ANY), "Where the part begins in which width and depth are averaged.")
        .or_from("a quarter of the way through the grid");
static TO: Key =
    Key::new("to", Kind::Number(&LENGTH, Range::ANY), "Where that part ends.").or_from("three quarters of the way");
static COOLING: Key = Key::new(
    "cooling",
    Kind::Series(&TEMPERATURE, Range::POSITIVE),
    "Two temperatures, the higher one first: `surface_cooling_rate` is the rate at which each place of the surface falls from \
     the first to the second.",
)
.or_from("no rate is told");
static TRACK_SECTION: Section = Section {
    path: "solid.track",
    doc: "What is told of the track that melts: `track_width` and `track_depth`, of all that was molten, and `pool_length`, \
          `pool_width` and `pool_depth`, of what is.",
    example: "{ along = \"x\", cooling = [\"1563 K\", \"1463 K\"] }",
    shorthand: None,
    keys: &[&ALONG, &BORDER, &FROM, &TO, &COOLING],
};

/// The temperature of a solid as a physics of a scene.
pub static KIND: PhysicsKind = PhysicsKind {
    name: "solid",
    computes: "the temperature of [solid]",
    doc: "The temperature of a solid on a grid.",
    absent: "does not run",
    section: &SECTION,
    rank: 5,
    bodies: None,
    read: |table, surroundings| configured(read(table, surroundings)),
    advice: None,
    tradeoff: Some(&TRADEOFF),
    pictured: &[
        Pictured::new("solid_temperature", "temperature of the solid", "Solid"),
        Pictured {
            beside: true,
            ..Pictured::new("solid_peak_temperature", "highest temperature so far", "Highest temperature")
        },
    ],
};

/// Reads the table.
fn read(table: Table<'_>, surroundings: &Surroundings<'_, '_>) -> Option<Settings> {
    let Surroundings { walls, materials, grids, .. } = *surroundings;
    // Everything is read before anything is given up, so that every mistake is found.
    let grid = grids::choose(&table, &GRID, grids).cloned();
    let named = materials::choose(&table, &MATERIAL, materials);
    let temperature_k = table.number(&START);
    let level = match table.choice(&LEVEL) {
        "explicit" => Level::Explicit { share: table.number(&SHARE) },
        _ => Level::Implicit { phi: table.number(&PHI) },
    };
    let face_mean = match table.choice(&FACES) {
        "arithmetic" => FaceMean::Arithmetic,
        _ => FaceMean::Harmonic,
    };
    let (melting, boiling) = (table.flag(&MELTING), table.flag(&BOILING));
    if boiling && !melting {
        table.reject_with(&BOILING, "it boils but does not melt", Some("set melting = true".into()));
    }
    let number =
        |name: &str, value: Option<f64>| value.unwrap_or_else(|| missing_property(&table, &MATERIAL, &named, name));
    let property = |name: &str, value: &Option<Property>| {
        value.clone().unwrap_or_else(|| Property::constant(missing_property(&table, &MATERIAL, &named, name)))
    };
    let bands = melting.then(|| PhaseBands { melting_k: None, boiling_k: boiling.then_some(0.0) });
    let material = HeatMaterial::of(&named, bands.as_ref(), number, property);
    let evaporation = table.flag(&EVAPORATION).then(|| Evaporation {
        boiling_k: number("boiling", named.1.boiling_k),
        latent_j_kg: number("boiling-heat", named.1.boiling_heat_j_kg),
        molar_mass_kg_mol: 1e-3 * number("relative-atomic-mass", named.1.relative_atomic_mass),
    });
    let relaxation_s = table.number(&RELAXATION);
    if relaxation_s > 0.0 && matches!(level, Level::Explicit { .. }) {
        table.reject(&RELAXATION, "expected 0 with the explicit level");
    }
    let (tolerance, iterations) = (table.number(&TOLERANCE), table.whole_u32(&ITERATIONS));
    let light = light(&table);
    let track = track(&table, grid.as_ref(), &material, melting);
    let wall = table.optional_text(&WALL).and_then(|name| {
        let place = walls.iter().position(|wall| wall.name == name);
        if place.is_none() {
            let near = nearest(&name, walls.iter().map(|wall| wall.name.as_str()));
            table.reject_with(
                &WALL,
                format!("there is no [walls.{name}]"),
                near.map(|near| format!("did you mean \"{near}\"?")),
            );
        }
        place.and_then(|place| u32::try_from(place).ok())
    });
    let of = |key: &'static Key| faced(&table, key, temperature_k);
    let sides = of(&SIDES).unwrap_or(Face::Insulated);
    let [left, right, front, back] = [&LEFT, &RIGHT, &FRONT, &BACK].map(|key| of(key).unwrap_or(sides));
    let [bottom, top] = [&BOTTOM, &TOP].map(|key| of(key).unwrap_or(Face::Insulated));
    table.finish();
    Some(Settings {
        grid: grid?,
        materials: vec![material],
        kinds: Vec::new(),
        temperature_k,
        level,
        face_mean,
        faces: [left, right, front, back, bottom, top],
        evaporation,
        light,
        relaxation_s,
        tolerance,
        iterations,
        track,
        wall,
    })
}

fn light(table: &Table<'_>) -> Light {
    let Some(light) = table.optional_table(&LIGHT) else { return Light { absorptivity: 1.0, absorption_1_m: None } };
    let settings =
        Light { absorptivity: light.number(&ABSORPTIVITY), absorption_1_m: light.optional_number(&ABSORPTION) };
    light.finish();
    settings
}

fn track(table: &Table<'_>, grid: Option<&CellGrid>, material: &HeatMaterial, melting: bool) -> Track {
    let middle_k = material
        .phases
        .and_then(|phases| phases.melting)
        .map_or(f64::NAN, |melting| melting.from_k + 0.5 * melting.width_k);
    let part_m = |along: usize| {
        let ends = grid.and_then(|grid| Some((*grid.edges_m[along].first()?, *grid.edges_m[along].last()?)));
        let (lower_m, upper_m) = ends.unwrap_or_default();
        [0.25, 0.75].map(|share| lower_m + share * (upper_m - lower_m))
    };
    let Some(given) = table.optional_table(&TRACK) else {
        return Track { along: 0, border_k: middle_k, part_m: part_m(0), cooling_k: None };
    };
    if !melting {
        table.reject_with(&TRACK, "nothing melts, so there is no track", Some("set melting = true".into()));
    }
    let along = usize::from(given.choice(&ALONG) == "y");
    let border_k = given.number_or(&BORDER, || middle_k);
    let [from_m, to_m] = part_m(along);
    let part_m = [given.number_or(&FROM, || from_m), given.number_or(&TO, || to_m)];
    if part_m[1] <= part_m[0] {
        given.reject(&TO, "expected a place beyond that where the part begins");
    }
    let cooling_k = given.series(&COOLING).and_then(|between_k| match between_k[..] {
        [hot_k, cold_k] if hot_k > cold_k => Some([hot_k, cold_k]),
        _ => {
            given.reject(&COOLING, "expected two temperatures, the higher one first");
            None
        }
    });
    given.finish();
    Track { along, border_k, part_m, cooling_k }
}

fn faced(table: &Table<'_>, key: &'static Key, start_k: f64) -> Option<Face> {
    let face = table.optional_table(key)?;
    let temperature_k = || face.number_or(&FACE_TEMPERATURE, || start_k);
    let read = match face.optional_choice(&FACE_KIND)? {
        "held" => Face::Held { temperature_k: temperature_k() },
        "flux" => Face::Flux { flux_w_m2: face.number(&FLUX) },
        "ambient" => Face::Ambient {
            temperature_k: temperature_k(),
            convection_w_m2_k: face.number(&CONVECTION),
            emissivity: face.number(&EMISSIVITY),
        },
        _ => Face::Insulated,
    };
    face.finish();
    Some(read)
}
