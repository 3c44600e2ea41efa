//! Spins, which no field carries: read from the state as it is stored.

use serde_json::{from_value, to_value};
use stagger_physics::particles::State;

/// Spins in rad/s by row.
pub fn spins(state: &State) -> Vec<[f64; 3]> {
    let state = to_value(state).unwrap();
    let rows: Vec<usize> = from_value(state["bodies"]["rows"].clone()).unwrap();
    let memory: Vec<[f64; 3]> = from_value(state["motion"]["spins"].clone()).unwrap();
    let mut spins = vec![[0.0; 3]; rows.len()];
    for (row, spin) in rows.into_iter().zip(memory) {
        spins[row] = spin;
    }
    spins
}
