//! Spheres on the sites of a crystal lattice (Ashcroft & Mermin 1976, ch. 4).

use rand_chacha::rand_core::RngCore;
use stagger_coupling::{SolveError, math};
use stagger_messages::Shown;

use super::radii::Bodies;
use crate::{
    common::{Vec3, random::uniform},
    particles::settings::{Lattice, StartRegion},
};

/// Largest region for a particle, in cubes of the neighbours' distance: all its cells may have to be looked at.
const LARGEST: f64 = 1e6;

impl Lattice {
    /// Edges of an orthogonal cell as shares of the nearest neighbours' distance, and its sites as shares of the edges.
    fn cell(self) -> ([f64; 3], &'static [[f64; 3]]) {
        match self {
            Self::SimpleCubic => ([1.0; 3], &[[0.0; 3]]),
            Self::BodyCentredCubic => ([2.0 / 3.0f64.sqrt(); 3], &[[0.0; 3], [0.5; 3]]),
            Self::FaceCentredCubic => {
                ([std::f64::consts::SQRT_2; 3], &[[0.0; 3], [0.5, 0.5, 0.0], [0.5, 0.0, 0.5], [0.0, 0.5, 0.5]])
            }
            Self::HexagonalClosePacked => (
                [1.0, 3.0f64.sqrt(), (8.0f64 / 3.0).sqrt()],
                &[[0.0; 3], [0.5, 0.5, 0.0], [0.5, 1.0 / 6.0, 0.5], [0.0, 2.0 / 3.0, 0.5]],
            ),
        }
    }

    /// Positions by row: the lowest sites of the lattice that lie in the region, moved by a random share `jitter` of what
    /// keeps neighbours apart. Particles of different sizes or materials are spread over them at random.
    ///
    /// # Errors
    /// [`SolveError::Start`] where the region has fewer sites than there are particles.
    pub(super) fn place(
        self,
        region: &StartRegion,
        bodies: &Bodies,
        spacing: f64,
        jitter: f64,
        random: &mut impl RngCore,
    ) -> Result<Vec<Vec3>, SolveError> {
        let Some(&largest) = bodies.radii.first() else { return Ok(Vec::new()) };
        let distance = 2.0 * largest * spacing;
        // Two neighbours that both move towards each other by this still do not overlap.
        let reach = jitter * 0.5 * (distance - 2.0 * largest).max(0.0);
        if region.volume_m3() > LARGEST * (bodies.radii.len() as f64) * math::powi(distance, 3) {
            return Err(SolveError::Start("particles: the start region is more than a million times larger than its particles need; use a smaller \
                 one"
                    .into(),
            ));
        }
        let mut sites = self.sites(region, distance, largest + reach, bodies.radii.len());
        if sites.len() < bodies.radii.len() {
            return Err(SolveError::Start(format!(
                "particles: the start region holds {} sites of this lattice with neighbours {:e} m apart, but {} \
                 particles are to be placed; use a larger region, a smaller spacing, or fewer particles",
                sites.len(),
                Shown(distance),
                bodies.radii.len()
            )));
        }
        let differ =
            bodies.radii.last() != bodies.radii.first() || bodies.materials.iter().any(|m| *m != bodies.materials[0]);
        if differ {
            // Fisher & Yates; the bias of the remainder is below 1e-11 for the largest scene.
            for last in (1..sites.len()).rev() {
                sites.swap(last, (random.next_u64() % (last as u64 + 1)) as usize);
            }
        }
        if reach > 0.0 {
            for site in &mut sites {
                *site += reach * in_unit_sphere(random);
            }
        }
        Ok(sites)
    }

    /// At most `count` sites at which a sphere of radius `margin` lies in the region, cell by cell from the floor up.
    fn sites(self, region: &StartRegion, distance: f64, margin: f64, count: usize) -> Vec<Vec3> {
        let (edges, basis) = self.cell();
        let edges = edges.map(|edge| edge * distance);
        let (lower, upper) = region.bounds();
        // Rounding must not lose the last layer of a region made to measure.
        let room: [f64; 3] = std::array::from_fn(|axis| upper[axis] - lower[axis] - 2.0 * margin + 1e-9 * distance);
        let cells =
            |axis: usize| (0..).map(move |cell| f64::from(cell) * edges[axis]).take_while(move |&x| x <= room[axis]);
        let mut sites = Vec::with_capacity(count);
        for (z, y, x) in cells(2).flat_map(|z| cells(1).flat_map(move |y| cells(0).map(move |x| (z, y, x)))) {
            for site in basis {
                let shift: [f64; 3] = std::array::from_fn(|axis| [x, y, z][axis] + site[axis] * edges[axis]);
                let place = Vec3::from_fn(|axis, _| lower[axis] + margin + shift[axis]);
                if (0..3).all(|axis| shift[axis] <= room[axis]) && region.holds(&place, margin) {
                    sites.push(place);
                    if sites.len() == count {
                        return sites;
                    }
                }
            }
        }
        sites
    }
}

/// Uniform in the unit sphere.
fn in_unit_sphere(random: &mut impl RngCore) -> Vec3 {
    loop {
        // Each attempt succeeds with probability π/6.
        let point = Vec3::from_fn(|_, _| 2.0 * uniform(random) - 1.0);
        if point.norm_squared() <= 1.0 {
            return point;
        }
    }
}
