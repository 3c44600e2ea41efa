//! What the particles are, in the order they have in memory.

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};
use stagger_coupling::math;

/// Properties that do not change while a particle exists.
///
/// Particles near each other in space are near each other in memory; `rows` leads back to the order of the fields.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Bodies {
    /// Row of each particle in the fields.
    pub rows: Vec<u32>,
    /// Number of each particle, which it keeps as rows come and go.
    pub ids: Vec<u32>,
    /// R in m.
    pub radii: Vec<f64>,
    /// m in kg.
    pub masses: Vec<f64>,
    /// 2/5 m R², in kg m².
    pub inertias: Vec<f64>,
    /// Index into the scene's materials.
    pub materials: Vec<u16>,
}

impl Bodies {
    /// The particles in another order: place k takes what was at `order[k]`.
    pub fn reordered(&self, order: &[u32]) -> Self {
        Self {
            rows: reordered(&self.rows, order),
            ids: reordered(&self.ids, order),
            radii: reordered(&self.radii, order),
            masses: reordered(&self.masses, order),
            inertias: reordered(&self.inertias, order),
            materials: reordered(&self.materials, order),
        }
    }

    /// Place in memory of each number up to the highest; `u32::MAX` where the particle is gone.
    pub fn places_by_id(&self) -> Vec<u32> {
        let mut places = vec![u32::MAX; self.ids.iter().max().map_or(0, |&highest| highest as usize + 1)];
        for (place, &id) in (0u32..).zip(&self.ids) {
            places[id as usize] = place;
        }
        places
    }

    /// Whether all have one radius and mass.
    pub fn alike(&self) -> bool {
        one(&self.radii) && one(&self.masses)
    }

    /// Number of particles.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Values in memory order, put into the rows of a field.
    pub fn in_rows<T: Copy + Default>(&self, values: &[T]) -> Vec<T> {
        let mut rows = vec![T::default(); values.len()];
        for (&row, &value) in self.rows.iter().zip(values) {
            rows[row as usize] = value;
        }
        rows
    }

    /// Values of a field's rows in memory order.
    pub fn in_memory<T: Copy>(&self, rows: &[T]) -> Vec<T> {
        self.rows.iter().map(|&row| rows[row as usize]).collect()
    }
}

/// Mass of a sphere, 4/3 π R³ ρ, in kg.
pub fn sphere_mass(radius_m: f64, density_kg_m3: f64) -> f64 {
    4.0 / 3.0 * PI * math::powi(radius_m, 3) * density_kg_m3
}

/// Moment of inertia of a sphere, 2/5 m R², in kg m².
#[inline(always)]
pub fn sphere_inertia(mass_kg: f64, radius_m: f64) -> f64 {
    0.4 * mass_kg * radius_m * radius_m
}

/// Whether all values are the same.
pub fn one(values: &[f64]) -> bool {
    values.array_windows().all(|[a, b]| a.to_bits() == b.to_bits())
}

/// `values` with `values[order[k]]` in place k.
pub fn reordered<T: Copy>(values: &[T], order: &[u32]) -> Vec<T> {
    order.iter().map(|&from| values[from as usize]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_and_back() {
        let rows: Vec<u32> = vec![0, 1, 2];
        let bodies = Bodies {
            ids: rows.clone(),
            rows,
            radii: vec![1.0, 2.0, 3.0],
            masses: vec![1.0; 3],
            inertias: vec![1.0; 3],
            materials: vec![0; 3],
        };
        let moved = bodies.reordered(&[2, 0, 1]);
        assert_eq!(moved.radii, [3.0, 1.0, 2.0]);
        assert_eq!(moved.in_rows(&moved.radii), [1.0, 2.0, 3.0]);
        assert_eq!(moved.in_memory(&[1.0, 2.0, 3.0]), moved.radii);
    }
}
