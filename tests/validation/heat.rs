//! Conduction (Zohdi 2018, ch. 6.3): decay of a temperature difference, effective conductivity, linear profile,
//! order in the step size, and energy that is neither made nor lost. In the modules: phases, an ambient, properties that
//! depend on temperature, several materials, and steps far above the explicit limit.

mod ambient;
mod phases;
mod properties;
mod stefan;
mod stiff;

use std::{f64::consts::PI, sync::Arc};

use stagger_coupling::{Frozen, Physics, Reply, SolveError, Window};
use stagger_messages::{Energy, Field, Fields, Port, Values};
use stagger_physics::{
    common::{Shape, Wall},
    thermal::{Conductance, Enthalpy, Material, Overshoot, Settings, Solver, State, Table, Thermal},
};

const RADIUS_M: f64 = 25e-6;
const DENSITY_KG_M3: f64 = 7800.0;
const HEAT_CAPACITY_J_KG_K: f64 = 500.0;
const CONDUCTIVITY_W_M_K: f64 = 20.0;
const AREA_M2: f64 = 1e-10;
const DISTANCE_M: f64 = 48e-6;

/// m C of one sphere, in J/K.
const CAPACITY_J_K: f64 = DENSITY_KG_M3 * 4.0 / 3.0 * PI * RADIUS_M * RADIUS_M * RADIUS_M * HEAT_CAPACITY_J_KG_K;
/// K A/d, in W/K.
const CONDUCTANCE_W_K: f64 = CONDUCTIVITY_W_M_K * AREA_M2 / DISTANCE_M;
/// Time in which one contact carries a particle's heat, in s.
const TIME_S: f64 = CAPACITY_J_K / CONDUCTANCE_W_K;

fn settings(count: usize) -> Settings {
    Settings {
        count,
        temperature_k: 300.0,
        density_kg_m3: DENSITY_KG_M3,
        heat_capacity_j_kg_k: HEAT_CAPACITY_J_KG_K,
        conductivity_w_m_k: CONDUCTIVITY_W_M_K,
        conductance: Conductance::Monograph,
        walls: Vec::new(),
        phi: 0.5,
        solid: None,
        overshoot: Overshoot::Implicit,
        pour_temperature_k: None,
        start: None,
        enthalpy: None,
        tolerance: 1e-14,
        iterations: 1000,
    }
}

/// The same material in enthalpy form.
fn enthalpy(solver: Solver) -> Enthalpy {
    let steel = Material {
        name: "steel".into(),
        density_kg_m3: DENSITY_KG_M3,
        heat_capacity_j_kg_k: Table::constant(HEAT_CAPACITY_J_KG_K),
        conductivity_w_m_k: Table::constant(CONDUCTIVITY_W_M_K),
        phases: None,
    };
    Enthalpy { materials: vec![steel], solver, ambient: None }
}

const SOLVERS: [Solver; 2] = [Solver::FixedPoint, Solver::ConjugateGradient];

fn wall(temperature_k: Option<f64>) -> Wall {
    Wall::fixed("plate", Shape::plane([0.0; 3], [0.0, 0.0, 1.0]), temperature_k)
}

/// What the other physics say at one instant.
#[derive(Clone, Default)]
struct Contacts {
    radii_m: Vec<f64>,
    /// Particle, particle, area in m², distance in m.
    pairs: Vec<(u32, u32, f64, f64)>,
    /// Particle, wall, area in m², distance in m.
    walls: Vec<(u32, u32, f64, f64)>,
    absorbed_w: Vec<f64>,
    /// Places in the list of materials.
    materials: Vec<u32>,
    ids: Vec<u32>,
    /// Counts how often particles came or went.
    revision: u64,
}

impl Contacts {
    fn fields(&self, thermal: &Thermal) -> Fields {
        let indices =
            |of: &[(u32, u32, f64, f64)]| Values::from(of.iter().flat_map(|c| [c.0, c.1]).collect::<Vec<_>>());
        let areas = |of: &[(u32, u32, f64, f64)]| Values::from(of.iter().map(|c| c.2).collect::<Vec<_>>());
        let distances = |of: &[(u32, u32, f64, f64)]| Values::from(of.iter().map(|c| c.3).collect::<Vec<_>>());
        let values = |port: &Port| match port.field.as_str() {
            "radii" => self.radii_m.clone().into(),
            "absorbed_power" => self.absorbed_w.clone().into(),
            "material" => self.materials.clone().into(),
            "ids" => self.ids.clone().into(),
            "contact_pairs" => indices(&self.pairs),
            "contact_area" => areas(&self.pairs),
            "contact_distance" => distances(&self.pairs),
            "wall_contact_pairs" => indices(&self.walls),
            "wall_contact_area" => areas(&self.walls),
            "wall_contact_distance" => distances(&self.walls),
            other => panic!("thermal reads `{other}`, which this test does not write"),
        };
        let reads = thermal.ports().reads;
        let field =
            |p: Port| (p.field.clone(), Field::new(&Arc::new(p.clone()), 7 + self.revision, values(&p)).unwrap());
        // Of what somebody may write, what the test has.
        let is_written = |port: &Port| match port.field.as_str() {
            "absorbed_power" => !self.absorbed_w.is_empty(),
            "ids" => !self.ids.is_empty(),
            _ => !port.optional,
        };
        reads.into_iter().filter(is_written).map(field).collect()
    }
}

fn solve(
    thermal: &Thermal,
    state: &State,
    start: &Contacts,
    end: &Contacts,
    dt_s: f64,
) -> Result<(State, Reply), SolveError> {
    let frozen = Frozen { start: start.fields(thermal), end: end.fields(thermal) };
    thermal.solve(state, &frozen, Window { t_s: 0.0, dt_s })
}

fn temperatures(reply: &Reply) -> Vec<f64> {
    reply.fields["temperature"].f64().unwrap().to_vec()
}

fn joule(ledger: &[Energy], name: &str) -> f64 {
    ledger.iter().find(|energy| energy.name == name).unwrap().joule
}

/// Two spheres of 600 K and 300 K whose contact grows as A (1 + t/T); returns the difference at T = `TIME_S`.
fn difference_of_a_growing_contact(conductance: Conductance, phi: f64, windows: u32) -> f64 {
    grown(&Thermal::new(Settings { phi, conductance, ..settings(2) }).unwrap(), windows)
}

fn grown(thermal: &Thermal, windows: u32) -> f64 {
    let at = |k: u32| Contacts {
        radii_m: vec![RADIUS_M; 2],
        pairs: vec![(0, 1, AREA_M2 * (1.0 + f64::from(k) / f64::from(windows)), DISTANCE_M)],
        ..Contacts::default()
    };
    let mut state = thermal.state(vec![600.0, 300.0]).unwrap();
    let mut last = vec![600.0, 300.0];
    for k in 0..windows {
        let (next, reply) = solve(thermal, &state, &at(k), &at(k + 1), TIME_S / f64::from(windows)).unwrap();
        assert!(reply.not_converged.is_none());
        (state, last) = (next, temperatures(&reply));
    }
    last[0] - last[1]
}

/// Slope of log(error) over log(step) between two halvings.
fn observed_order(error: impl Fn(u32) -> f64) -> f64 {
    (error(64) / error(256)).log2() / 2.0
}

#[test]
fn two_spheres_approach_each_other_exponentially() {
    // d(Δθ)/dt = −2 K A/(d m C) Δθ with A growing from A to 2 A over T: the exponent is −2·3/2 T/TIME_S = −3.
    let exact = 300.0 * (-3.0_f64).exp();
    for (phi, order) in [(0.5, 2.0), (1.0, 1.0), (0.0, 1.0), (0.25, 1.0)] {
        let error = |windows| (difference_of_a_growing_contact(Conductance::Monograph, phi, windows) - exact).abs();
        let observed = observed_order(error);
        // The next term of the error is smaller by one or two powers of Δt/T = 1/64.
        assert!((observed - order).abs() < 0.06, "φ = {phi}: order {observed} instead of {order}");
    }
    // φ = ½ with 1024 windows: the error is λ³ T Δt²/12 ~ 30·10⁻⁶/12·e^{−3}·300 K.
    let difference = difference_of_a_growing_contact(Conductance::Monograph, 0.5, 1024);
    assert!((difference - exact).abs() < 1e-4, "{difference} K instead of {exact} K");
}

#[test]
fn a_constriction_conducts_by_the_radius_of_its_spot() {
    // G = 2 K √(A/π): ∫ √(1 + t/T) dt over T is ⅔ (2√2 − 1) T.
    let spot_w_k = 2.0 * CONDUCTIVITY_W_M_K * (AREA_M2 / PI).sqrt();
    let exponent = 2.0 * spot_w_k / CAPACITY_J_K * TIME_S * 2.0 / 3.0 * (8.0_f64.sqrt() - 1.0);
    let exact = 300.0 * (-exponent).exp();
    // The rate λ reaches 2 √2·5.4/TIME_S, five times the monograph's: with 1024 windows the relative error is at most
    // λ³ T Δt²/12 ≈ 15³·10⁻⁶/12.
    let difference = difference_of_a_growing_contact(Conductance::Constriction, 0.5, 1024);
    assert!((difference / exact - 1.0).abs() < 5e-4, "{difference} K instead of {exact} K");
    let error = |n| (difference_of_a_growing_contact(Conductance::Constriction, 0.5, n) - exact).abs();
    assert!((observed_order(error) - 2.0).abs() < 0.15);
}

/// A simple-cubic block of `side`² columns of `layers` spheres between wall 0 below and wall 1 above. The
/// distance to a wall is half a spacing.
fn block(side: u32, layers: u32) -> Contacts {
    let index = |x: u32, y: u32, z: u32| (z * side + y) * side + x;
    let mut block = Contacts { radii_m: vec![RADIUS_M; (side * side * layers) as usize], ..Contacts::default() };
    for z in 0..layers {
        for y in 0..side {
            for x in 0..side {
                let from = index(x, y, z);
                let mut touch = |to| block.pairs.push((from, to, AREA_M2, DISTANCE_M));
                if x + 1 < side {
                    touch(index(x + 1, y, z));
                }
                if y + 1 < side {
                    touch(index(x, y + 1, z));
                }
                if z + 1 < layers {
                    touch(index(x, y, z + 1));
                }
                if z == 0 {
                    block.walls.push((from, 0, AREA_M2, 0.5 * DISTANCE_M));
                }
                if z + 1 == layers {
                    block.walls.push((from, 1, AREA_M2, 0.5 * DISTANCE_M));
                }
            }
        }
    }
    block
}

/// The steady state, by windows of 50 TIME_S with φ = 1: the slowest mode of six layers, 0.27/TIME_S, falls by 14 in
/// each, so 15 windows leave 1e-17 of it.
fn steady(thermal: &Thermal, contacts: &Contacts) -> (State, Vec<f64>) {
    let (mut state, mut reply) = thermal.initial().unwrap();
    for _ in 0..15 {
        (state, reply) = solve(thermal, &state, contacts, contacts, 50.0 * TIME_S).unwrap();
        assert!(reply.not_converged.is_none(), "{:?}", reply.not_converged);
    }
    (state, temperatures(&reply))
}

fn between_walls(side: u32, layers: u32) -> Thermal {
    let walls = vec![wall(Some(500.0)), wall(Some(300.0)), wall(None)];
    // A window is 50 TIME_S, so that the sweeps cannot settle closer than 50 roundings.
    let stiff = Settings { walls, phi: 1.0, tolerance: 1e-13, iterations: 100_000, ..settings(0) };
    Thermal::new(Settings { count: (side * side * layers) as usize, ..stiff }).unwrap()
}

#[test]
fn a_simple_cubic_lattice_conducts_as_k_a_over_d_squared() {
    let (side, layers) = (4, 6);
    let thermal = between_walls(side, layers);
    let lattice = block(side, layers);
    let (state, _) = steady(&thermal, &lattice);

    // What the cold wall takes in the steady state: an explicit window in which the block touches that wall alone.
    let walls = vec![wall(Some(500.0)), wall(Some(300.0))];
    let probe = Thermal::new(Settings { walls, phi: 0.0, ..settings((side * side * layers) as usize) }).unwrap();
    let mut cold = lattice;
    cold.walls.retain(|contact| contact.1 == 1);
    let dt_s = 1e-3 * TIME_S;
    let (_, reply) = solve(&probe, &state, &cold, &cold, dt_s).unwrap();
    let flux_w_m2 = joule(&reply.ledger, "to_walls") / dt_s / f64::from(side * side) / DISTANCE_M.powi(2);
    let conductivity_w_m_k = flux_w_m2 * f64::from(layers) * DISTANCE_M / (500.0 - 300.0);

    let expected = CONDUCTIVITY_W_M_K * AREA_M2 / DISTANCE_M.powi(2);
    // Tolerance of the solver, 2e-13·500 K, over the 17 K between wall and last layer.
    assert!((conductivity_w_m_k / expected - 1.0).abs() < 1e-10, "{conductivity_w_m_k} instead of {expected}");
}

#[test]
fn a_chain_between_two_walls_has_a_linear_profile_and_an_insulated_wall_changes_nothing() {
    let layers = 6;
    let thermal = between_walls(1, layers);
    let mut chain = block(1, layers);
    chain.walls.push((2, 2, AREA_M2, DISTANCE_M));
    let (_, profile) = steady(&thermal, &chain);
    for (z, temperature) in profile.iter().enumerate() {
        let expected = 500.0 - 200.0 * (z as f64 + 0.5) / f64::from(layers);
        // Twice the solver's tolerance of 1e-13·500 K in each of the last windows.
        assert!((temperature - expected).abs() < 1e-9, "layer {z}: {temperature} K instead of {expected} K");
    }
}

#[test]
fn heat_is_neither_made_nor_lost() {
    let (count, dt_s) = (50, 0.7 * TIME_S);
    let mut before = Contacts {
        radii_m: (0..count).map(|k| RADIUS_M * (1.0 + 0.01 * k as f64)).collect(),
        absorbed_w: (0..count).map(|k| 1e-3 * (k % 7) as f64).collect(),
        ..Contacts::default()
    };
    for k in 0..count as u32 - 1 {
        before.pairs.push((k, k + 1, AREA_M2 * f64::from(1 + k % 3), DISTANCE_M));
        before.walls.push((k, k % 3, AREA_M2, 0.5 * DISTANCE_M));
    }
    // By the window's end every fourth contact is gone and some new ones are there.
    let mut after = before.clone();
    after.pairs.retain(|contact| contact.0 % 4 != 0);
    after.pairs.extend((0..20).map(|k| (k, k + 30, AREA_M2, DISTANCE_M)));
    let walls = vec![wall(Some(900.0)), wall(Some(100.0)), wall(None)];

    for phi in [0.0, 0.3, 0.5, 1.0] {
        for tolerance in [1e-3, 1e-12] {
            let walls = walls.clone();
            let of = Settings { walls, phi, tolerance, ..settings(count) };
            let thermal = Thermal::new(of).unwrap();
            let (mut state, reply) = thermal.initial().unwrap();
            let (mut stored_j, mut through_j) = (joule(&reply.ledger, "heat"), 0.0_f64);
            for step in 0..20 {
                let (start, end) = if step % 2 == 0 { (&before, &after) } else { (&after, &before) };
                let (next, reply) = solve(&thermal, &state, start, end, 0.1 * dt_s).unwrap();
                let (heat_j, absorbed_j) = (joule(&reply.ledger, "heat"), joule(&reply.ledger, "absorbed"));
                let to_walls_j = joule(&reply.ledger, "to_walls");
                let gap_j = heat_j - stored_j - (absorbed_j - to_walls_j);
                // Each particle rounds m C θ twice: 1.1e-16 of 3 m C times 500 K; ten times that for the sums.
                let rounding_j = count as f64 * 3.0 * CAPACITY_J_K * 500.0 * 1.1e-16 * 10.0;
                assert!(gap_j.abs() < rounding_j, "φ = {phi}, step {step}: {gap_j} J of {to_walls_j} J");
                through_j = through_j.max(to_walls_j.abs()).max(absorbed_j);
                (state, stored_j) = (next, heat_j);
            }
            assert!(through_j > 1e-6 * CAPACITY_J_K * 500.0, "the test moves no heat");
        }
    }
}

#[test]
fn absorbed_power_heats_a_lone_sphere_by_h_dt_over_m_c() {
    let thermal = Thermal::new(Settings { ..settings(1) }).unwrap();
    let alone = Contacts { radii_m: vec![RADIUS_M], absorbed_w: vec![0.02], ..Contacts::default() };
    let (state, _) = thermal.initial().unwrap();
    let (_, reply) = solve(&thermal, &state, &alone, &alone, 1e-4).unwrap();
    let expected = 300.0 + 0.02 * 1e-4 / CAPACITY_J_K;
    assert!((temperatures(&reply)[0] - expected).abs() < 1e-12, "rounding of 300 K");
    assert!((joule(&reply.ledger, "absorbed") - 2e-6).abs() < 1e-21);
}

#[test]
fn a_window_that_does_not_converge_says_so_and_a_shorter_one_does() {
    let thermal = Thermal::new(Settings { iterations: 4, tolerance: 1e-9, phi: 1.0, ..settings(2) }).unwrap();
    let pair = Contacts { radii_m: vec![RADIUS_M; 2], pairs: vec![(0, 1, AREA_M2, DISTANCE_M)], ..Contacts::default() };
    let state = thermal.state(vec![600.0, 300.0]).unwrap();
    let mut dt_s = TIME_S;
    let mut attempts = 0;
    while let Some(refused) = solve(&thermal, &state, &pair, &pair, dt_s).unwrap().1.not_converged {
        assert!((0.1..=0.9).contains(&refused.step_factor), "{}", refused.step_factor);
        dt_s *= refused.step_factor;
        attempts += 1;
    }
    // The factor is meant to hit: the contraction is s/(1+s), all but proportional to Δt once s = Δt/TIME_S is small.
    assert!((1..=4).contains(&attempts), "{attempts} attempts");
}

#[test]
fn the_biot_number_is_the_contacts_conductance_over_that_of_the_smaller_sphere() {
    let thermal = Thermal::new(settings(2)).unwrap();
    let pair = Contacts {
        radii_m: vec![RADIUS_M, 3.0 * RADIUS_M],
        pairs: vec![(0, 1, AREA_M2, DISTANCE_M)],
        ..Contacts::default()
    };
    let (state, _) = thermal.initial().unwrap();
    let biot = solve(&thermal, &state, &pair, &pair, TIME_S).unwrap().1.figures["largest Biot number"];
    assert!((biot - AREA_M2 / DISTANCE_M / RADIUS_M).abs() < 1e-15);
}

#[test]
fn fields_that_do_not_fit_are_refused_by_name_row_and_count() {
    let of = Settings { walls: vec![wall(Some(300.0))], ..settings(2) };
    let thermal = Thermal::new(of).unwrap();
    let (state, _) = thermal.initial().unwrap();
    let good = Contacts {
        radii_m: vec![RADIUS_M; 2],
        pairs: vec![(0, 1, AREA_M2, DISTANCE_M)],
        walls: vec![(1, 0, AREA_M2, RADIUS_M)],
        ..Contacts::default()
    };
    let refused = |end: &Contacts| solve(&thermal, &state, &good, end, TIME_S).unwrap_err();
    let bad = |spoil: &dyn Fn(&mut Contacts)| {
        let mut bad = good.clone();
        spoil(&mut bad);
        refused(&bad)
    };
    for (error, said) in [
        (bad(&|c| c.radii_m.truncate(1)), "`radii` has 1 rows at revision 7, but had 2"),
        (bad(&|c| c.radii_m[1] = -1.0), "`radii` is -1 m in row 1"),
        (bad(&|c| c.pairs[0].1 = 9), "`contact_pairs` names particle 9 in row 0, but there are 2"),
        (bad(&|c| c.walls[0].0 = 2), "`wall_contact_pairs` names particle 2 in row 0"),
        (bad(&|c| c.walls[0].1 = 1), "`wall_contact_pairs` names wall 1 in row 0, but there are 1"),
    ] {
        assert!(matches!(error, SolveError::Mismatch(_)) && error.to_string().contains(said), "{error}");
    }
    // A value that a smaller step may mend is not final.
    let overlapping = bad(&|c| c.pairs[0].3 = 0.0);
    assert!(overlapping.retry() && overlapping.to_string().contains("`contact_distance` is 0 in row 0"));
    assert!(bad(&|c| c.pairs[0].2 = f64::NAN).retry());

    let mut fields = good.fields(&thermal);
    let areas = Field::new(&fields["contact_area"].port, 7, vec![AREA_M2; 2]).unwrap();
    fields.insert("contact_area".into(), areas);
    let frozen = Frozen { start: good.fields(&thermal), end: fields.clone() };
    let error = thermal.solve(&state, &frozen, Window { t_s: 0.0, dt_s: TIME_S }).unwrap_err();
    assert!(error.to_string().contains("`contact_area` has 2 rows, but `contact_pairs` has 1"), "{error}");

    let areas = Field::new(&fields["contact_area"].port, 8, vec![AREA_M2]).unwrap();
    fields.insert("contact_area".into(), areas);
    let frozen = Frozen { start: good.fields(&thermal), end: fields };
    let error = thermal.solve(&state, &frozen, Window { t_s: 0.0, dt_s: TIME_S }).unwrap_err();
    assert!(error.to_string().contains("is of contact list 8, but `contact_pairs` is list 7"), "{error}");
}

#[test]
fn settings_outside_their_range_are_refused() {
    for bad in [
        Settings { phi: 1.5, ..settings(1) },
        Settings { density_kg_m3: 0.0, ..settings(1) },
        Settings { conductivity_w_m_k: f64::NAN, ..settings(1) },
        Settings { iterations: 0, ..settings(1) },
        Settings { walls: vec![wall(Some(-1.0))], ..settings(1) },
    ] {
        assert!(matches!(Thermal::new(bad).err(), Some(SolveError::Start(_))));
    }
    assert!(Thermal::new(settings(0)).unwrap().initial().is_ok());
}
