//! Heat through changes of phase: energy in equals m (C Δθ + latent heat) to rounding, for any step, in both directions.

use proptest::prelude::*;
use stagger_coupling::Ledger;
use stagger_messages::Energy;
use stagger_physics::thermal::{Enthalpy, PhaseChange, Phases, Settings, Solver, Thermal};

use super::{
    AREA_M2, CAPACITY_J_K, Contacts, DENSITY_KG_M3, DISTANCE_M, HEAT_CAPACITY_J_KG_K, RADIUS_M, SOLVERS, TIME_S,
    enthalpy, joule, settings, solve, temperatures, wall,
};

const MELTING_K: f64 = 1650.0;
const BOILING_K: f64 = 3100.0;
const MELTING_J_KG: f64 = 2.6e5;
const BOILING_J_KG: f64 = 6.1e6;
/// m of one sphere, in kg.
const MASS_KG: f64 = CAPACITY_J_K / HEAT_CAPACITY_J_KG_K;

/// Steel that melts and boils over the given widths, in K.
fn melting(solver: Solver, widths_k: [f64; 2]) -> Enthalpy {
    let mut enthalpy = enthalpy(solver);
    enthalpy.materials[0].phases = Some(Phases {
        melting: Some(PhaseChange { from_k: MELTING_K, width_k: widths_k[0], latent_j_kg: MELTING_J_KG }),
        boiling: Some(PhaseChange { from_k: BOILING_K, width_k: widths_k[1], latent_j_kg: BOILING_J_KG }),
    });
    enthalpy
}

/// Temperature and liquid share of what is not vapour, from the heat in a kilogram above 300 K: case by case, as a reader
/// would write it down.
fn by_hand(heat_j_kg: f64, widths_k: [f64; 2]) -> (f64, f64) {
    let capacity = HEAT_CAPACITY_J_KG_K;
    let to_melting = capacity * (MELTING_K - 300.0);
    let melting = MELTING_J_KG + capacity * widths_k[0];
    let to_boiling = to_melting + melting + capacity * (BOILING_K - MELTING_K - widths_k[0]);
    let boiling = BOILING_J_KG + capacity * widths_k[1];
    if heat_j_kg < to_melting {
        (300.0 + heat_j_kg / capacity, 0.0)
    } else if heat_j_kg < to_melting + melting {
        let share = (heat_j_kg - to_melting) / melting;
        (MELTING_K + share * widths_k[0], share)
    } else if heat_j_kg < to_boiling {
        (MELTING_K + widths_k[0] + (heat_j_kg - to_melting - melting) / capacity, 1.0)
    } else if heat_j_kg < to_boiling + boiling {
        (BOILING_K + (heat_j_kg - to_boiling) / boiling * widths_k[1], 1.0)
    } else {
        (BOILING_K + widths_k[1], 1.0)
    }
}

/// What a kilogram of vapour holds above 300 K, in J.
fn vapour_j_kg(widths_k: [f64; 2]) -> f64 {
    HEAT_CAPACITY_J_KG_K * (BOILING_K + widths_k[1] - 300.0) + MELTING_J_KG + BOILING_J_KG
}

fn stored(ledger: &[Energy]) -> f64 {
    joule(ledger, "heat") + joule(ledger, "latent")
}

proptest! {
    /// Steps of any length and power of either sign: from a hundredth of what melts a particle to all that boils it.
    #[test]
    fn a_particle_holds_what_it_took_whatever_the_steps_and_directions(
        heats in prop::collection::vec((-1.5e7f64..1.5e7, -9i32..2), 1..25),
        widths_k in prop_oneof![Just([0.0, 0.0]), Just([65.0, 0.0]), (0.01f64..200.0, 0.01f64..200.0).prop_map(|(m, v)| [m, v])],
        conjugate in any::<bool>(),
        phi in prop_oneof![Just(0.0), Just(0.5), Just(1.0)],
    ) {
        holds(heats, widths_k, conjugate, phi)?;
    }
}

/// A band so narrow that the rounding of its ends once changed its latent heat.
#[test]
fn a_narrow_band_takes_all_of_its_latent_heat() {
    holds(vec![(8316847.204234641, 0)], [0.01, 0.01], false, 0.0).unwrap();
}

/// Heats a particle step by step: its heats in J/kg are scaled, and its steps are in powers of ten of the time.
fn holds(heats: Vec<(f64, i32)>, widths_k: [f64; 2], conjugate: bool, phi: f64) -> Result<(), TestCaseError> {
    let enthalpy = Some(melting(SOLVERS[usize::from(conjugate)], widths_k));
    let thermal = Thermal::new(Settings { phi, enthalpy, ..settings(1) }).unwrap();
    let (mut state, reply) = super::Physics::initial(&thermal).unwrap();
    let mut through_j_kg = 0.0;
    let mut held_j_kg = stored(&reply.ledger) / MASS_KG;
    let mut sum_j_kg = 0.0;
    // The moment at which a particle is vapour is known to 1e-10 of what it takes until then.
    let (end_j_kg, moment_j_kg) = (vapour_j_kg(widths_k), 1e-10 * 1e7);
    for (scale, power_of_ten) in heats {
        // So much heat that temperature stays above 0 K: below it there is no physics to test.
        let asked = scale * 10f64.powi(power_of_ten.min(0));
        let heat_j_kg = asked.max(-sum_j_kg - 1.4e5);
        let dt_s = TIME_S * 10f64.powi(power_of_ten);
        let alone =
            Contacts { radii_m: vec![RADIUS_M], absorbed_w: vec![heat_j_kg * MASS_KG / dt_s], ..Contacts::default() };
        let (next, reply) = solve(&thermal, &state, &alone, &alone, dt_s).unwrap();
        prop_assert!(reply.not_converged.is_none());
        // Vapour takes nothing and gives nothing: it is gone.
        let taken_j_kg = if sum_j_kg < end_j_kg { heat_j_kg.min(end_j_kg - sum_j_kg) } else { 0.0 };
        sum_j_kg = if taken_j_kg < heat_j_kg { end_j_kg } else { sum_j_kg + taken_j_kg };
        through_j_kg += heat_j_kg.abs();
        // Each step rounds what is held and what enters a few times; so does the split of heat and latent heat.
        let rounding_j_kg = 4e-15 * (through_j_kg + 4e7);
        let now_j_kg = stored(&reply.ledger) / MASS_KG;
        let [entered_j_kg, missed_j_kg] = ["absorbed", "missed"].map(|name| joule(&reply.ledger, name) / MASS_KG);
        prop_assert!((now_j_kg - held_j_kg - (entered_j_kg - missed_j_kg)).abs() < rounding_j_kg);
        prop_assert!((missed_j_kg - (heat_j_kg - taken_j_kg)).abs() < rounding_j_kg + moment_j_kg);
        prop_assert!((now_j_kg - sum_j_kg).abs() < rounding_j_kg + moment_j_kg);

        let (temperature_k, liquid) = by_hand(sum_j_kg, widths_k);
        let found_k = temperatures(&reply)[0];
        prop_assert!((found_k - temperature_k).abs() < 2.0 * rounding_j_kg / HEAT_CAPACITY_J_KG_K + 1e-12 * found_k);
        let melted = reply.fields["melted"].f64().unwrap()[0];
        prop_assert!((melted - liquid).abs() < 1e-11, "{} instead of {}", melted, liquid);
        prop_assert_eq!(reply.fields["vapourised"].u8().unwrap()[0], u8::from(sum_j_kg >= end_j_kg));
        (state, held_j_kg) = (next, now_j_kg);
    }
    Ok(())
}

#[test]
fn heat_that_went_in_comes_out_and_leaves_the_particle_as_it_was() {
    for solver in SOLVERS {
        for widths_k in [[0.0, 0.0], [65.0, 10.0]] {
            let enthalpy = Some(melting(solver, widths_k));
            let thermal = Thermal::new(Settings { enthalpy, ..settings(1) }).unwrap();
            let (mut state, _) = super::Physics::initial(&thermal).unwrap();
            let mut temperature_k = 300.0;
            // Until nearly all has boiled in one step, and back to where it came from in a thousand.
            let all_j_kg = vapour_j_kg(widths_k) - 0.01 * BOILING_J_KG;
            let all_j = MASS_KG * all_j_kg;
            for (steps, heat_j) in [(1, all_j), (1000, -all_j)] {
                for step in 0..steps {
                    let alone = Contacts {
                        radii_m: vec![RADIUS_M],
                        absorbed_w: vec![heat_j / f64::from(steps) / TIME_S],
                        ..Contacts::default()
                    };
                    let (next, reply) = solve(&thermal, &state, &alone, &alone, TIME_S).unwrap();
                    (state, temperature_k) = (next, temperatures(&reply)[0]);
                    if steps == 1 {
                        let (expected_k, _) = by_hand(all_j_kg, widths_k);
                        assert!((temperature_k - expected_k).abs() < 1e-9, "{step}: {temperature_k} K");
                    }
                }
            }
            // A thousand roundings of 8.2 MJ/kg, over C.
            let rounding_k = 1000.0 * 1.1e-16 * all_j / MASS_KG / HEAT_CAPACITY_J_KG_K;
            assert!((temperature_k - 300.0).abs() < rounding_k, "{temperature_k} K, {rounding_k} K allowed");
        }
    }
}

/// A ring of particles that exchange heat, with a hot and a cold wall.
fn ring(count: u32) -> Contacts {
    Contacts {
        radii_m: (0..count).map(|k| RADIUS_M * (1.0 + 0.02 * f64::from(k % 9))).collect(),
        pairs: (0..count).map(|k| (k, (k + 1) % count, AREA_M2 * f64::from(1 + k % 3), DISTANCE_M)).collect(),
        walls: (0..count).step_by(5).map(|k| (k, k % 2, AREA_M2, 0.5 * DISTANCE_M)).collect(),
        absorbed_w: (0..count).map(|k| 5e-3 * (f64::from(k % 7) - 1.0)).collect(),
        ..Contacts::default()
    }
}

#[test]
fn the_ledger_closes_through_melting_and_boiling_at_any_step() {
    let ring = ring(40);
    for solver in SOLVERS {
        for widths_k in [[0.0, 0.0], [65.0, 20.0]] {
            for dt_s in [0.01 * TIME_S, TIME_S, 100.0 * TIME_S] {
                // What is left of the iteration is not what is lost: the tolerance is loose.
                let (walls, enthalpy) = (vec![wall(Some(6000.0)), wall(Some(300.0))], Some(melting(solver, widths_k)));
                let of = Settings { walls, enthalpy, tolerance: 1e-6, phi: 1.0, ..settings(40) };
                let thermal = Thermal::new(Settings { iterations: 20_000, ..of }).unwrap();
                let (mut state, reply) = super::Physics::initial(&thermal).unwrap();
                let mut ledger = Ledger::default();
                ledger.start("thermal", &reply.ledger);
                let mut molten = 0;
                for _ in 0..10 {
                    let (next, reply) = solve(&thermal, &state, &ring, &ring, dt_s).unwrap();
                    assert!(reply.not_converged.is_none(), "{solver:?}, {dt_s} s: {:?}", reply.figures);
                    ledger.book("thermal", &reply.ledger);
                    molten += reply.fields["melted"].f64().unwrap().iter().filter(|share| **share > 0.0).count();
                    state = next;
                }
                let account = &ledger.nodes()["thermal"];
                // 40 particles round a few numbers of the size of what is turned over in each of ten windows.
                let open = account.imbalance().abs() / account.turned_over();
                assert!(open < 1e-13, "{solver:?}, {widths_k:?}, {dt_s} s: {open:e} of {} J", account.turned_over());
                assert!(molten > 0 || dt_s < TIME_S, "nothing melts in {dt_s} s");
            }
        }
    }
}

#[test]
fn vapour_that_leaves_is_booked_with_its_mass_and_heat() {
    let enthalpy = Some(melting(Solver::FixedPoint, [0.0, 0.0]));
    let thermal = Thermal::new(Settings { enthalpy, ..settings(3) }).unwrap();
    let (state, reply) = super::Physics::initial(&thermal).unwrap();
    assert_eq!(reply.fields["vapourised"].u8().unwrap(), [0, 0, 0]);
    let heat_j = MASS_KG * 9e6;
    let all = Contacts {
        radii_m: vec![RADIUS_M; 3],
        absorbed_w: vec![0.0, heat_j / TIME_S, 0.0],
        ids: vec![0, 1, 2],
        ..Contacts::default()
    };
    let (state, reply) = solve(&thermal, &state, &all, &all, TIME_S).unwrap();
    assert_eq!(reply.fields["vapourised"].u8().unwrap(), [0, 1, 0]);
    assert_eq!(reply.figures["vapourised particles"], 0.0, "it is still there");
    assert_eq!(temperatures(&reply), [300.0, BOILING_K, 300.0]);
    let (stored_j, missed_j) = (stored(&reply.ledger), joule(&reply.ledger, "missed"));
    assert!((stored_j + missed_j - heat_j).abs() < 1e-14 * heat_j, "{stored_j} J and {missed_j} J of {heat_j} J");
    let left = Contacts {
        radii_m: vec![RADIUS_M; 2],
        absorbed_w: vec![0.0; 2],
        ids: vec![0, 2],
        revision: 1,
        ..Contacts::default()
    };
    let (_, reply) = solve(&thermal, &state, &all, &left, TIME_S).unwrap();
    let vapour_j = joule(&reply.ledger, "vapour");
    let expected_j = MASS_KG * vapour_j_kg([0.0, 0.0]);
    // A few roundings of the numbers themselves.
    assert!((vapour_j / expected_j - 1.0).abs() < 1e-14, "{vapour_j} J of {expected_j} J");
    assert_eq!((joule(&reply.ledger, "removed"), stored(&reply.ledger)), (0.0, 0.0));
    assert_eq!(reply.figures["vapourised particles"], 1.0);
    assert!((reply.figures["vapourised mass [kg]"] / MASS_KG - 1.0).abs() < 1e-14);
    assert!((MASS_KG / DENSITY_KG_M3 - 4.0 / 3.0 * std::f64::consts::PI * RADIUS_M.powi(3)).abs() < 1e-25);
}
