//! The contact laws of every pair of materials.

use std::collections::{BTreeMap, BTreeSet};

use stagger_coupling::SolveError;

use super::{damping::damping_ratio, law::Law, normal::Normal as _};
use crate::particles::settings::{ContactLaw, Friction, Settings};

/// Coefficients of the contact of two materials.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PairLaw<R = f64> {
    /// Normal damping c_cd, in N s/m³.
    pub damping_n_s_m3: R,
    /// ζ√(2q) of the restitution coefficient; 0 is none.
    pub restitution: R,
    /// Whether anything needs √(m* F/δ).
    pub has_impedance: bool,
    /// μ_s.
    pub static_friction: R,
    /// μ_d.
    pub dynamic_friction: R,
    /// K_f of the regularised law, in N/m³.
    pub friction_stiffness_n_m3: R,
    /// k_t of the tangential spring over F/δ.
    pub tangential: R,
    /// ζ√(2qκ) of the tangential damper, κ the ratio of the tangential stiffness to the normal one.
    pub tangential_damping: R,
    /// Coefficient of rolling resistance.
    pub rolling: R,
    /// Coefficient of torsion resistance.
    pub torsion: R,
}

impl<C> PairLaw<C> {
    /// Each coefficient turned into something else.
    #[inline(always)]
    pub fn map<D>(&self, turn: impl Fn(&C) -> D) -> PairLaw<D> {
        PairLaw {
            damping_n_s_m3: turn(&self.damping_n_s_m3),
            restitution: turn(&self.restitution),
            has_impedance: self.has_impedance,
            static_friction: turn(&self.static_friction),
            dynamic_friction: turn(&self.dynamic_friction),
            friction_stiffness_n_m3: turn(&self.friction_stiffness_n_m3),
            tangential: turn(&self.tangential),
            tangential_damping: turn(&self.tangential_damping),
            rolling: turn(&self.rolling),
            torsion: turn(&self.torsion),
        }
    }

    /// Every coefficient, to be changed; `has_impedance` is none.
    pub fn coefficients_mut(&mut self) -> [&mut C; 9] {
        [
            &mut self.damping_n_s_m3,
            &mut self.restitution,
            &mut self.static_friction,
            &mut self.dynamic_friction,
            &mut self.friction_stiffness_n_m3,
            &mut self.tangential,
            &mut self.tangential_damping,
            &mut self.rolling,
            &mut self.torsion,
        ]
    }
}

/// Laws by pairs of a particle's material and a material; walls are materials too, after those of the particles.
///
/// Walls that no pair names and that are of no particle's material are alike, so that many walls take no more room than one.
#[derive(Clone, Debug)]
pub struct PairTable {
    materials: usize,
    /// Whether all laws are the same.
    alike: bool,
    /// Those of the first particle material with all materials, of the second, …; then, where there are other materials, the
    /// general law without a particle's.
    laws: Vec<PairLaw>,
}

impl PairTable {
    /// The table of `settings`, which are in their ranges, with the materials of the walls after those of the particles.
    ///
    /// # Errors
    /// An override names a material or wall that is not there; more materials than 16 bits can name.
    pub fn new(settings: &Settings, law: Law) -> Result<(Self, Vec<u16>), SolveError> {
        let particles = settings.materials.len();
        let mut indices: BTreeMap<&str, usize> = BTreeMap::new();
        for (index, material) in settings.materials.iter().enumerate() {
            indices.entry(&material.name).or_insert(index);
        }
        let in_pairs: BTreeSet<&str> =
            settings.pairs.iter().flat_map(|pair| &pair.between).map(String::as_str).collect();
        let mut count = particles;
        // The index of all walls that nothing is said about.
        let mut others = None;
        let mut next = || {
            count += 1;
            count - 1
        };
        let mut walls = Vec::with_capacity(settings.walls.len());
        for wall in &settings.walls {
            let name = wall.material.as_deref().unwrap_or(&wall.name);
            let index = match indices.get(name) {
                Some(index) => *index,
                None if in_pairs.contains(name) => *indices.entry(name).or_insert_with(&mut next),
                None => *others.get_or_insert_with(&mut next),
            };
            walls.push(u16::try_from(index).map_err(|_| {
                SolveError::Mismatch(format!("particles: more than {} materials and walls have pairs", u16::MAX))
            })?);
        }
        let of = |material: usize| settings.materials.get(material).and_then(|material| material.poisson);
        let index = |name: &str| {
            indices.get(name).copied().ok_or_else(|| {
                let known: Vec<&str> = indices.keys().copied().collect();
                SolveError::Mismatch(format!(
                    "particles: no material or wall of a pair is called `{name}`; there are {}",
                    known.join(", ")
                ))
            })
        };
        let mut laws = Vec::with_capacity(particles * count + 1);
        for i in 0..particles {
            for j in 0..count {
                laws.push(general(settings, law, [of(i), of(j)]));
            }
        }
        for pair in &settings.pairs {
            let (i, j) = (index(&pair.between[0])?, index(&pair.between[1])?);
            let own = pair.applied_to(settings);
            let one = general(&own, law, [of(i), of(j)]);
            // Two walls do not meet.
            for (i, j) in [(i, j), (j, i)].into_iter().filter(|(i, _)| *i < particles) {
                laws[i * count + j] = one;
            }
        }
        if count > particles {
            laws.push(general(settings, law, [None, None]));
        }
        let alike = laws.iter().all(|law| *law == laws[0]);
        Ok((Self { materials: count, alike, laws }, walls))
    }

    /// Coefficients for a particle's material i and a material j.
    #[inline(always)]
    pub fn get(&self, i: u16, j: u16) -> &PairLaw {
        &self.laws[i as usize * self.materials + j as usize]
    }

    /// The one law of a scene whose pairs are all alike.
    #[inline]
    pub fn only(&self) -> Option<&PairLaw> {
        self.alike.then(|| &self.laws[0])
    }

    /// All laws.
    pub fn laws(&self) -> &[PairLaw] {
        &self.laws
    }
}

/// The law that the settings give two materials with Poisson's ratios of their own, where they have them.
fn general(settings: &Settings, law: Law, poissons: [Option<f64>; 2]) -> PairLaw {
    let q = law.power();
    let damping_ratio = settings.contact.restitution.map_or(0.0, damping_ratio);
    let mut pair = PairLaw {
        damping_n_s_m3: settings.contact.damping_n_s_m3,
        restitution: damping_ratio * (2.0 * q).sqrt(),
        ..PairLaw::default()
    };
    match settings.friction {
        None => {}
        Some(Friction::Regularised { stiffness_n_m3, static_coefficient, dynamic_coefficient }) => {
            pair.friction_stiffness_n_m3 = stiffness_n_m3;
            (pair.static_friction, pair.dynamic_friction) = (static_coefficient, dynamic_coefficient);
        }
        Some(Friction::Spring { stiffness_ratio, damping_ratio: own, static_coefficient, dynamic_coefficient }) => {
            let ratio = stiffness_ratio.unwrap_or_else(|| default_ratio(settings.contact.law, poissons));
            pair.tangential = ratio * (q - 1.0);
            pair.tangential_damping = own.unwrap_or(damping_ratio) * (2.0 * q * ratio).sqrt();
            (pair.static_friction, pair.dynamic_friction) = (static_coefficient, dynamic_coefficient);
        }
    }
    if let Some(rolling) = settings.rolling {
        (pair.rolling, pair.torsion) = (rolling.rolling, rolling.torsion);
    }
    pair.has_impedance = pair.restitution > 0.0 || pair.tangential_damping > 0.0;
    pair
}

/// Ratio of tangential to normal stiffness: Mindlin's 2(1−ν)/(2−ν) of Hertz's law, with the mean of both partners where
/// their ν differ; 2/7 of the others, with which a linear contact's sliding and pressing last equally long (Schäfer, Dippel
/// & Wolf 1996).
fn default_ratio(law: ContactLaw, poissons: [Option<f64>; 2]) -> f64 {
    let mindlin = |poisson: f64| 2.0 * (1.0 - poisson) / (2.0 - poisson);
    match law {
        ContactLaw::Hertz { poisson, .. } => {
            let [a, b] = poissons.map(|own| mindlin(own.unwrap_or(poisson)));
            0.5 * (a + b)
        }
        ContactLaw::Overlap { .. } | ContactLaw::Linear { .. } => 2.0 / 7.0,
    }
}
