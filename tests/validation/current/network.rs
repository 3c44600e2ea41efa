//! Networks of contacts, as the particles' motion would tell them.

use std::{f64::consts::PI, sync::Arc};

use stagger_coupling::{Frozen, Physics, Reply, SolveError, Window};
use stagger_messages::{Energy, Field, Fields, Values};
use stagger_physics::{
    common::{Conductance, Shape, Wall, walls::Electrode},
    current::{Conductivity, Current, Method, Model, Settings, Solver, State},
};

pub const POTENTIAL: Model = Model::Potential { conductance: Conductance::Monograph };
pub const AVERAGING: Model = Model::Averaging { heat_share: 0.5 };

/// The particles and contacts of one instant. A contact of area A and distance d = 1 m conducts σ A.
#[derive(Clone, Debug, Default)]
pub struct Network {
    pub radii_m: Vec<f64>,
    /// Particle, particle, area in m², distance in m.
    pub pairs: Vec<(u32, u32, f64, f64)>,
    /// Particle, wall, area in m², distance in m.
    pub walls: Vec<(u32, u32, f64, f64)>,
    pub temperatures_k: Vec<f64>,
    pub ids: Vec<u32>,
    /// Revision of the particles' rows, and that of those the temperatures stand on.
    pub revisions: [u64; 2],
}

impl Network {
    /// `count` particles of volume 1 m³, not in contact.
    pub fn of(count: usize) -> Self {
        Self {
            radii_m: vec![(0.75 / PI).cbrt(); count],
            temperatures_k: vec![300.0; count],
            ids: (0..).take(count).collect(),
            ..Self::default()
        }
    }

    /// `contacts` unit contacts in a row, the first with wall 0 and the last with wall 1.
    pub fn chain(contacts: u32) -> Self {
        let count = contacts - 1;
        Self {
            pairs: (1..count).map(|i| (i - 1, i, 1.0, 1.0)).collect(),
            walls: vec![(0, 0, 1.0, 1.0), (count - 1, 1, 1.0, 1.0)],
            ..Self::of(count as usize)
        }
    }

    /// A bed of `count` particles at random, each in contact with some seven others of its surroundings by areas that differ
    /// by a factor of up to a hundred; the first and the last tenth touch walls 0 and 1.
    pub fn random(count: u32) -> Self {
        let mut state = 88_172_645_463_325_252_u64;
        let mut uniform = || {
            // xorshift64 (Marsaglia 2003).
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        let reach = f64::from(count).powf(2.0 / 3.0);
        let mut network = Self::of(count as usize);
        for i in 1..count {
            for _ in 0..4 {
                let back = 1 + (uniform() * reach) as u32;
                let area_m2 = 10f64.powf(-2.0 * uniform());
                network.pairs.extend(i.checked_sub(back).map(|j| (j, i, area_m2, 1.0)));
            }
        }
        let end = count / 10;
        network.walls = (0..end).flat_map(|i| [(i, 0, 1.0, 0.5), (count - 1 - i, 1, 1.0, 0.5)]).collect();
        network
    }
}

pub fn settings(model: Model, electrodes: &[Electrode], count: usize) -> Settings {
    let wall = |(index, electrode): (usize, &Electrode)| Wall {
        electrode: *electrode,
        ..Wall::fixed(&format!("wall-{index}"), Shape::plane([0.0; 3], [0.0, 0.0, 1.0]), None)
    };
    Settings {
        count,
        model,
        conductivity: Conductivity::constant(1.0),
        temperature_k: 300.0,
        walls: electrodes.iter().enumerate().map(wall).collect(),
        starts_s: 0.0,
        ends_s: f64::INFINITY,
        solver: Solver { method: Method::ConjugateGradient, tolerance: 1e-12, iterations: 10_000 },
    }
}

pub fn volt(potential: f64) -> Electrode {
    Electrode { potential_v: Some(potential), ..Electrode::default() }
}

pub fn ampere(current: f64) -> Electrode {
    Electrode { current_a: Some(current), ..Electrode::default() }
}

pub fn density(current_density: f64) -> Electrode {
    Electrode { current_density_a_m2: Some(current_density), ..Electrode::default() }
}

pub fn fields(current: &Current, network: &Network) -> Fields {
    let indices = |of: &[(u32, u32, f64, f64)]| Values::from(of.iter().flat_map(|c| [c.0, c.1]).collect::<Vec<_>>());
    let areas = |of: &[(u32, u32, f64, f64)]| Values::from(of.iter().map(|c| c.2).collect::<Vec<_>>());
    let distances = |of: &[(u32, u32, f64, f64)]| Values::from(of.iter().map(|c| c.3).collect::<Vec<_>>());
    let [rows, heated] = network.revisions;
    let field = |port: stagger_messages::Port| {
        let (revision, values): (_, Values) = match port.field.as_str() {
            "radii" => (rows, network.radii_m.clone().into()),
            "ids" => (rows, network.ids.clone().into()),
            "temperature" => (heated, network.temperatures_k.clone().into()),
            "contact_pairs" => (7, indices(&network.pairs)),
            "contact_area" => (7, areas(&network.pairs)),
            "contact_distance" => (7, distances(&network.pairs)),
            "wall_contact_pairs" => (7, indices(&network.walls)),
            "wall_contact_area" => (7, areas(&network.walls)),
            "wall_contact_distance" => (7, distances(&network.walls)),
            other => panic!("current reads `{other}`, which this test does not write"),
        };
        (port.field.clone(), Field::new(&Arc::new(port), revision, values).unwrap())
    };
    current.ports().reads.into_iter().map(field).collect()
}

pub const WINDOW: Window = Window { t_s: 0.0, dt_s: 1.0 };

/// One window of 1 s over which the contacts stay.
pub fn step(current: &Current, state: &State, network: &Network) -> Result<(State, Reply), SolveError> {
    let end = fields(current, network);
    current.solve(state, &Frozen { start: end.clone(), end }, WINDOW)
}

/// The first window over which the contacts stay.
pub fn solve(settings: &Settings, network: &Network) -> Reply {
    step(&Current::new(settings.clone()).unwrap(), &State::default(), network).unwrap().1
}

/// The values of a written field.
pub fn of(reply: &Reply, field: &str) -> Vec<f64> {
    reply.fields[field].f64().unwrap().to_vec()
}

/// `electrical` and `joule` of the ledger, in J.
pub fn books(reply: &Reply) -> [f64; 2] {
    ["electrical", "joule"].map(|name| {
        let entries: Vec<&Energy> = reply.ledger.iter().filter(|energy| energy.name == name).collect();
        assert_eq!(entries.len(), 1);
        entries[0].joule
    })
}

/// Whether `value` is `exact` within `tolerance` of it.
pub fn near(value: f64, exact: f64, tolerance: f64) -> bool {
    (value - exact).abs() <= tolerance * exact.abs()
}
