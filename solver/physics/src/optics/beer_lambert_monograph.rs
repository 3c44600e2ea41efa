//! The laser by the monograph's form of Beer and Lambert's law (Zohdi 2018, eqs. 6.38, 6.42 and 6.43).

use std::f64::consts::PI;

use rayon::prelude::*;
use stagger_coupling::math;

use super::Profile;

/// Bins on one side of the search grid at most.
const LARGEST_SIDE: f64 = 1024.0;

/// Particles handed to a thread at a time; results do not depend on it.
const PARTICLES_PER_TASK: usize = 256;

/// Share of the beam's power that each particle takes in the monograph's form (Zohdi 2018, eqs. 6.38, 6.42, 6.43):
///
/// H_i = a I_i V_i,  I_i = I(d_i) e^{−a ζ*_i},  ζ*_i = Σ_j chord of the line through centre i in particle j
///
/// over the particles j whose centres the light reaches before that of i. `centres_m` are in the beam's frame;
/// `absorption_1_m` is a. Beyond the profile's cut a particle takes nothing.
///
/// Valid for a R ≪ 1 and particles small against the beam: it takes the irradiance at the centre for that of the whole
/// particle and does not weaken it inside, so the shares can add up to more than 1.
pub(super) fn absorbed(profile: &Profile, absorption_1_m: f64, centres_m: &[[f64; 3]], radii_m: &[f64]) -> Vec<f64> {
    let largest_m = radii_m.iter().copied().fold(0.0, f64::max);
    let bins = Bins::new(centres_m, profile.cut_m() + largest_m, largest_m);
    let share = |i: usize| {
        let [u, v, depth] = centres_m[i];
        let d_m = math::hypot(u, v);
        if d_m > profile.cut_m() {
            return 0.0;
        }
        let mut above_m = 0.0;
        for j in bins.near(u, v) {
            let [u_j, v_j, depth_j] = centres_m[j];
            let half_chord_squared = radii_m[j] * radii_m[j] - math::powi(u_j - u, 2) - math::powi(v_j - v, 2);
            if depth_j < depth && half_chord_squared > 0.0 {
                above_m += 2.0 * half_chord_squared.sqrt();
            }
        }
        let volume_m3 = 4.0 / 3.0 * PI * math::powi(radii_m[i], 3);
        absorption_1_m * profile.irradiance_1_m2(d_m) * math::exp(-absorption_1_m * above_m) * volume_m3
    };
    (0..radii_m.len()).into_par_iter().with_min_len(PARTICLES_PER_TASK).map(share).collect()
}

/// Particles by square bins of the plane across the beam, at least one reach wide.
struct Bins {
    half_m: f64,
    width_m: f64,
    side: usize,
    /// Where each bin begins in `particles`, and the end of the last one.
    begins: Vec<usize>,
    /// Indices, ascending within a bin.
    particles: Vec<usize>,
}

impl Bins {
    /// Bins of the particles within the square of half side `half_m`; `reach_m` is what [`Bins::near`] must find.
    fn new(centres_m: &[[f64; 3]], half_m: f64, reach_m: f64) -> Self {
        let width_m = reach_m.max(2.0 * half_m / LARGEST_SIDE);
        let side = (2.0 * half_m / width_m).ceil().max(1.0) as usize;
        let mut bins = Self { half_m, width_m, side, begins: vec![0; side * side + 1], particles: Vec::new() };
        let within = |&(_, &[u, v, _]): &(usize, &[f64; 3])| u.abs() <= half_m && v.abs() <= half_m;
        let mut binned: Vec<(usize, usize)> = centres_m
            .iter()
            .enumerate()
            .filter(within)
            .map(|(particle, &[u, v, _])| (bins.index(v) * side + bins.index(u), particle))
            .collect();
        binned.sort_unstable();
        for &(bin, _) in &binned {
            bins.begins[bin + 1] += 1;
        }
        for bin in 0..side * side {
            bins.begins[bin + 1] += bins.begins[bin];
        }
        bins.particles = binned.into_iter().map(|(_, particle)| particle).collect();
        bins
    }

    fn index(&self, at_m: f64) -> usize {
        (((at_m + self.half_m) / self.width_m) as usize).min(self.side - 1)
    }

    /// Particles within one bin's width of a point, and some more, in a fixed order.
    fn near(&self, u: f64, v: f64) -> impl Iterator<Item = usize> + '_ {
        let around = |at: usize| at.saturating_sub(1)..=(at + 1).min(self.side - 1);
        let columns = around(self.index(u));
        around(self.index(v)).flat_map(move |row| {
            let (first, last) = (row * self.side + columns.start(), row * self.side + columns.end());
            self.particles[self.begins[first]..self.begins[last + 1]].iter().copied()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shadows_found_through_bins_are_those_of_all_pairs() {
        // 400 spheres of three sizes strewn over a beam by Weyl's sequence, some outside it.
        let weyl = |k: usize, step: f64| (k as f64 * step).fract() - 0.5;
        let centres: Vec<[f64; 3]> = (1..=400)
            .map(|k| [3.0 * weyl(k, 2f64.sqrt()), 3.0 * weyl(k, 3f64.sqrt()), 9.0 * weyl(k, 5f64.sqrt())])
            .collect();
        let radii: Vec<f64> = (0..400).map(|k| 0.05 * (1 + k % 3) as f64).collect();
        let (profile, a) = (Profile::TopHat { radius_m: 1.0 }, 2.0);
        let shares = absorbed(&profile, a, &centres, &radii);
        let mut shadowed = 0;
        for i in 0..400 {
            let [u, v, depth] = centres[i];
            let chord = |j: usize| {
                let squared = radii[j].powi(2) - (centres[j][0] - u).powi(2) - (centres[j][1] - v).powi(2);
                if centres[j][2] < depth { 2.0 * squared.max(0.0).sqrt() } else { 0.0 }
            };
            let above: f64 = (0..400).map(chord).sum();
            shadowed += usize::from(above > 0.0 && u.hypot(v) < 1.0);
            let irradiance = if u.hypot(v) <= 1.0 { 1.0 / PI } else { 0.0 };
            let expected = a * irradiance * (-a * above).exp() * 4.0 / 3.0 * PI * radii[i].powi(3);
            // Rounding: the chords add up in another order.
            assert!((shares[i] - expected).abs() <= 1e-13 * expected, "particle {i}: {} for {expected}", shares[i]);
        }
        assert!(shadowed > 50, "only {shadowed} particles lie in a shadow");
    }
}
