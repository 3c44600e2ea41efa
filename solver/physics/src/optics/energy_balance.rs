//! The laser's power spread evenly over the particles (Zohdi 2018, eq. 6.39).

use super::NODE;
use stagger_coupling::{SolveError, math};

/// Share of the power that each particle takes where all of it is spread evenly (Zohdi 2018, eq. 6.39): by its heat capacity
/// m C, so that every particle heats alike, Δθ = W/Σ m C, wherever it lies; nothing passes.
///
/// `capacities_j_m3_k` are ρ C of the materials, which `kinds` name particle by particle; where there is one, shares are
/// R³/Σ R³ whatever it is.
///
/// # Errors
/// A particle's material is not one of them.
pub(super) fn shares(
    radii_m: &[f64],
    kinds: Option<&[u32]>,
    capacities_j_m3_k: &[f64],
) -> Result<Vec<f64>, SolveError> {
    let mut weights: Vec<f64> = radii_m.iter().map(|radius| math::powi(*radius, 3)).collect();
    if let Some(kinds) = kinds {
        for (row, (weight, &kind)) in weights.iter_mut().zip(kinds).enumerate() {
            let Some(capacity_j_m3_k) = capacities_j_m3_k.get(kind as usize) else {
                let there = capacities_j_m3_k.len();
                return Err(SolveError::Mismatch(format!(
                    "{NODE}: field `material` names material {kind} in row {row}, but there are {there}, counted from 0"
                )));
            };
            *weight *= capacity_j_m3_k;
        }
    }
    let total: f64 = weights.iter().sum();
    Ok(weights.into_iter().map(|weight| if total > 0.0 { weight / total } else { 0.0 }).collect())
}

#[cfg(test)]
mod tests {
    use super::shares;

    #[test]
    fn shares_go_by_mass_and_add_up_to_the_power() {
        let shares_of_one = shares(&[1e-5, 2e-5, 3e-5], None, &[]).unwrap();
        for (share, expected) in shares_of_one.iter().zip([1.0, 8.0, 27.0]) {
            assert!((share - expected / 36.0).abs() < 1e-15);
        }
        assert!(shares(&[], None, &[]).unwrap().is_empty());
    }

    #[test]
    fn particles_of_several_materials_heat_alike() {
        let (radii, kinds, capacities) = ([1e-5, 2e-5, 1e-5], [0, 1, 1], [2e6, 5e5]);
        let found = shares(&radii, Some(&kinds), &capacities).unwrap();
        // V ρ C are as 2, 8 · ½ and ½.
        for (share, expected) in found.iter().zip([2.0, 4.0, 0.5]) {
            assert!((share - expected / 6.5).abs() < 1e-15, "{found:?}");
        }
        let wrong = shares(&radii, Some(&[0, 2, 1]), &capacities).unwrap_err().to_string();
        assert!(wrong.contains("names material 2 in row 1, but there are 2"), "{wrong}");
    }
}
