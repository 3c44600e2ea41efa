use crate::math;

/// Share of the power that each particle takes where all of it is spread by mass (Zohdi 2018, eq. 6.39):
/// R_i³/Σ R³, as the density is one. Every particle heats alike, wherever it lies; nothing passes.
pub(super) fn shares(radii_m: &[f64]) -> Vec<f64> {
    let cubes: Vec<f64> = radii_m.iter().map(|radius| math::powi(*radius, 3)).collect();
    let total: f64 = cubes.iter().sum();
    cubes.into_iter().map(|cube| if total > 0.0 { cube / total } else { 0.0 }).collect()
}

#[cfg(test)]
mod tests {
    #[test]
    fn shares_go_by_mass_and_add_up_to_the_power() {
        let shares = super::shares(&[1e-5, 2e-5, 3e-5]);
        for (share, expected) in shares.iter().zip([1.0, 8.0, 27.0]) {
            assert!((share - expected / 36.0).abs() < 1e-15);
        }
        assert!(super::shares(&[]).is_empty());
    }
}
