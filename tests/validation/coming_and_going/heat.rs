//! Heat of particles that come and go.

use std::sync::Arc;

use stagger_coupling::{Frozen, Ledger, Physics, Reply, SolveError, Window};
use stagger_messages::{Energy, Field, Fields, Port, Values};
use stagger_physics::{
    common::{Shape, Wall},
    thermal::{Conductance, Overshoot, Settings, State, Thermal},
};

const DT_S: f64 = 1e-3;

fn thermal() -> Thermal {
    let wall = Wall::fixed("plate", Shape::plane([0.0; 3], [0.0, 0.0, 1.0]), Some(350.0));
    Thermal::new(Settings {
        count: 4,
        temperature_k: 300.0,
        pour_temperature_k: Some(420.0),
        density_kg_m3: 8000.0,
        heat_capacity_j_kg_k: 500.0,
        conductivity_w_m_k: 20.0,
        conductance: Conductance::Monograph,
        walls: vec![wall],
        phi: 0.5,
        solid: None,
        overshoot: Overshoot::Implicit,
        start: None,
        enthalpy: None,
        tolerance: 1e-12,
        iterations: 1000,
    })
    .unwrap()
}

/// Particles of one instant: a chain in the order of the rows, on a plate.
#[derive(Clone)]
struct Chain {
    revision: u64,
    ids: Vec<u32>,
    /// Whether a field says whose they are.
    tells_ids: bool,
    /// Revision of the rows on which the absorbed power stands, and the power in W.
    absorbed: (u64, Vec<f64>),
}

impl Chain {
    fn new(revision: u64, ids: &[u32]) -> Self {
        let power_w = ids.iter().map(|id| 1e-3 * f64::from(*id)).collect();
        Self { revision, ids: ids.to_vec(), tells_ids: true, absorbed: (revision, power_w) }
    }

    fn fields(&self, thermal: &Thermal) -> Fields {
        let links = self.ids.len().saturating_sub(1);
        let on_plate = self.ids.len().min(1);
        let values = |port: &Port| -> Values {
            match port.field.as_str() {
                "ids" => self.ids.clone().into(),
                // Each particle keeps its radius.
                "radii" => self.ids.iter().map(|id| 2e-5 + 1e-6 * f64::from(*id)).collect::<Vec<_>>().into(),
                "absorbed_power" => self.absorbed.1.clone().into(),
                "contact_pairs" => (0..links as u32).flat_map(|i| [i, i + 1]).collect::<Vec<_>>().into(),
                "contact_area" => vec![1e-10; links].into(),
                "contact_distance" => vec![4e-5; links].into(),
                "wall_contact_pairs" => vec![0u32; 2 * on_plate].into(),
                "wall_contact_area" => vec![1e-10; on_plate].into(),
                "wall_contact_distance" => vec![2e-5; on_plate].into(),
                other => panic!("thermal reads `{other}`, which this test does not write"),
            }
        };
        let field = |port: Port| {
            let revision = if port.field == "absorbed_power" { self.absorbed.0 } else { self.revision };
            (port.field.clone(), Field::new(&Arc::new(port.clone()), revision, values(&port)).unwrap())
        };
        let is_written = |port: &Port| match port.field.as_str() {
            "absorbed_power" => true,
            "ids" => self.tells_ids,
            _ => !port.optional,
        };
        thermal.ports().reads.into_iter().filter(is_written).map(field).collect()
    }
}

fn solve(thermal: &Thermal, state: &State, start: &Chain, end: &Chain) -> Result<(State, Reply), SolveError> {
    let frozen = Frozen { start: start.fields(thermal), end: end.fields(thermal) };
    thermal.solve(state, &frozen, Window { t_s: 0.0, dt_s: DT_S })
}

fn joule(ledger: &[Energy], name: &str) -> f64 {
    ledger.iter().find(|energy| energy.name == name).unwrap().joule
}

fn temperatures(reply: &Reply) -> &[f64] {
    reply.fields["temperature"].f64().unwrap()
}

#[test]
fn the_balance_closes_to_rounding_while_particles_come_and_go() {
    let thermal = thermal();
    let chains = [
        Chain::new(0, &[0, 1, 2, 3]),
        // One in the middle gone; one gone and one come; rows in another order with two more; all gone; new ones.
        Chain::new(1, &[0, 1, 3]),
        Chain::new(2, &[1, 3, 4]),
        Chain::new(3, &[5, 4, 3, 6, 1]),
        Chain::new(4, &[]),
        Chain::new(5, &[7, 8]),
        Chain::new(5, &[7, 8]),
    ];
    let (mut state, reply) = thermal.initial().unwrap();
    let mut ledger = Ledger::default();
    ledger.start("thermal", &reply.ledger);
    let mut moved = [0.0; 2];
    for pair in chains.windows(2) {
        let (next, reply) = solve(&thermal, &state, &pair[0], &pair[1]).unwrap();
        assert!(reply.not_converged.is_none());
        let field = &reply.fields["temperature"];
        assert_eq!((field.rows(), field.support.revision), (pair[1].ids.len(), pair[1].revision));
        ledger.book("thermal", &reply.ledger);
        for (sum, name) in moved.iter_mut().zip(["poured", "removed"]) {
            *sum += joule(&reply.ledger, name).abs();
        }
        state = next;
    }
    let account = &ledger.nodes()["thermal"];
    assert!(moved.iter().all(|moved| *moved > 1e-6), "{moved:?} J must be more than rounding");
    // Six windows of some ten numbers of about a micro- to a millijoule each.
    let closed = account.imbalance().abs() / account.turned_over();
    assert!(closed < 1e-14, "{closed:e} of {} J", account.turned_over());
}

#[test]
fn temperatures_stay_with_their_particles_and_those_poured_bring_theirs() {
    let thermal = thermal();
    let dark =
        |revision, ids: &[u32]| Chain { absorbed: (revision, vec![0.0; ids.len()]), ..Chain::new(revision, ids) };
    // So short that nothing flows: 1e-12 of the time a contact needs.
    let solve = |state: &State, start: &Chain, end: &Chain| {
        let frozen = Frozen { start: start.fields(&thermal), end: end.fields(&thermal) };
        thermal.solve(state, &frozen, Window { t_s: 0.0, dt_s: 1e-15 }).unwrap()
    };
    let hot = thermal.state(vec![310.0, 320.0, 330.0, 340.0]).unwrap();
    let (state, reply) = solve(&hot, &dark(0, &[0, 1, 2, 3]), &dark(1, &[3, 9, 1]));
    for (found, expected) in temperatures(&reply).iter().zip([340.0, 420.0, 320.0]) {
        assert!((found - expected).abs() < 1e-6, "{found}, expected {expected}");
    }
    // Measured from where these three particles were, not from the four there were.
    let start = &reply.start["temperature"];
    assert_eq!(start.support, reply.fields["temperature"].support);
    assert_eq!(start.f64().unwrap(), [340.0, 420.0, 320.0]);
    // A trial from the old rows again, in which nobody has come or gone yet: Jacobi order.
    let (_, first) = solve(&hot, &dark(0, &[0, 1, 2, 3]), &dark(0, &[0, 1, 2, 3]));
    assert_eq!(temperatures(&first).len(), 4);
    assert!(first.start.is_empty());
    let (_, next) = solve(&state, &dark(1, &[3, 9, 1]), &dark(1, &[3, 9, 1]));
    assert!(next.start.is_empty());
}

#[test]
fn power_that_was_written_before_goes_to_those_it_was_written_for() {
    let thermal = thermal();
    let (state, _) = thermal.initial().unwrap();
    let before = Chain::new(0, &[0, 1, 2, 3]);
    let now = Chain { absorbed: before.absorbed.clone(), ..Chain::new(1, &[3, 9, 1]) };
    let (state, reply) = solve(&thermal, &state, &before, &now).unwrap();
    // Particles 3 and 1 have 3 mW and 1 mW; 9 is new, and 0 and 2 are gone, with nothing and 2 mW.
    let books = |ledger: &[Energy], missed_w: f64| {
        assert!((joule(ledger, "absorbed") - 6e-3 * DT_S).abs() < 1e-18);
        assert!((joule(ledger, "missed") - missed_w * DT_S).abs() < 1e-18);
    };
    books(&reply.ledger, 2e-3);
    // Two revisions later it is still known whose it is.
    let later = Chain { absorbed: before.absorbed.clone(), ..Chain::new(2, &[3, 9]) };
    let (_, reply) = solve(&thermal, &state, &now, &later).unwrap();
    books(&reply.ledger, 3e-3);
    let unknown = Chain { absorbed: (17, vec![0.0; 4]), ..later.clone() };
    let error = solve(&thermal, &state, &now, &unknown).unwrap_err().to_string();
    assert!(
        error.contains("`absorbed_power` is of 4 particles at revision 17, but there are 2 at revision 2"),
        "{error}"
    );
}

#[test]
fn without_ids_particles_that_come_or_go_are_refused_even_where_as_many_are_there() {
    let thermal = thermal();
    let (state, _) = thermal.initial().unwrap();
    let silent = |revision, ids: &[u32]| Chain { tells_ids: false, ..Chain::new(revision, ids) };
    let start = silent(0, &[0, 1, 2, 3]);
    for end in [silent(1, &[0, 1, 2]), silent(1, &[0, 1, 2, 4])] {
        let error = solve(&thermal, &state, &start, &end).unwrap_err();
        assert!(!error.retry() && error.to_string().contains("no field `ids` is read"), "{error}");
    }
    assert!(solve(&thermal, &state, &start, &start).is_ok());
}
