//! How a contact conducts heat or current.

use serde::Serialize;

/// Conductance of a contact: in W/K from a thermal conductivity K in W/(m K), in S from an electrical one in S/m.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Conductance {
    /// K A/d, the monograph's (eq. 6.35).
    Monograph,
    /// 2 K a, the exact one of a small circular spot of radius a between half-spaces (Holm 1967), a = √(A/π); 4 K a to a wall.
    Constriction,
}

/// What a particle touches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Partner {
    /// Another particle.
    Particle,
    /// A wall held at a temperature or a potential, which so conducts perfectly.
    Wall,
}

impl Conductance {
    /// Conductivity K_ij of a contact between particles of conductivities K_i and K_j; each at least 0.
    ///
    /// - [`Conductance::Monograph`]: the arithmetic mean ½ (K_i + K_j) (Zohdi 2018, eq. 6.37). An insulator so conducts by
    ///   half of what its partner does.
    /// - [`Conductance::Constriction`]: the harmonic mean 2 K_i K_j/(K_i + K_j), as the two half-spaces are in series:
    ///   1/G = 1/(4 K_i a) + 1/(4 K_j a) (Holm 1967, §2). An insulator blocks.
    pub fn between(self, one: f64, other: f64) -> f64 {
        match self {
            Self::Monograph => 0.5 * (one + other),
            // To the bit, so that particles of one conductivity conduct alike however many materials there are.
            Self::Constriction if one == other => one,
            Self::Constriction if one <= 0.0 || other <= 0.0 => 0.0,
            Self::Constriction => 2.0 / (one.recip() + other.recip()),
        }
    }
}

/// Conductance G of a contact: heat flows at G (θ_j − θ_i), current at G (V_j − V_i).
///
/// - [`Conductance::Monograph`]: K A/d (Zohdi 2018, eq. 6.35), with d between the centres, or from the centre to the
///   surface of a wall.
/// - [`Conductance::Constriction`]: 2 K a, a = √(A/π): a circular spot between two half-spaces; to a wall 4 K a, as the spot
///   itself is held at the wall's temperature or potential (Holm 1967, §2).
///
/// `conductivity` is K_ij of [`Conductance::between`], or the particle's own at a wall; `area_m2` is A, `distance_m` is d.
/// A contact without area conducts nothing. `None`: the monograph's form has no value at d ≤ 0.
pub fn conductance(
    model: Conductance,
    partner: Partner,
    conductivity: f64,
    area_m2: f64,
    distance_m: f64,
) -> Option<f64> {
    if area_m2 <= 0.0 {
        return Some(0.0);
    }
    let half_spaces = match partner {
        Partner::Particle => 2.0,
        Partner::Wall => 4.0,
    };
    match model {
        Conductance::Monograph if distance_m > 0.0 => Some(conductivity * area_m2 / distance_m),
        Conductance::Monograph => None,
        Conductance::Constriction => Some(half_spaces * conductivity * (area_m2 / std::f64::consts::PI).sqrt()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_contact_without_area_conducts_nothing_whatever_its_distance() {
        for model in [Conductance::Monograph, Conductance::Constriction] {
            for distance in [1.0, 0.0, -1.0] {
                assert_eq!(conductance(model, Partner::Particle, 20.0, 0.0, distance), Some(0.0));
            }
        }
    }

    #[test]
    fn only_the_monograph_form_needs_a_distance() {
        assert_eq!(conductance(Conductance::Monograph, Partner::Particle, 20.0, 1.0, 0.0), None);
        // π a² = A with a = 3: G = 2 K a between particles, 4 K a to a wall.
        let area = std::f64::consts::PI * 9.0;
        for (partner, expected) in [(Partner::Particle, 120.0), (Partner::Wall, 240.0)] {
            let found = conductance(Conductance::Constriction, partner, 20.0, area, 0.0).unwrap();
            assert!((found - expected).abs() < 1e-12, "{partner:?}: {found}");
        }
    }

    #[test]
    fn half_spaces_conduct_in_series_and_the_monograph_takes_the_mean() {
        let [arithmetic, harmonic] = [Conductance::Monograph, Conductance::Constriction].map(|model| {
            move |one: f64, other: f64| {
                let found = model.between(one, other);
                assert_eq!(found, model.between(other, one));
                found
            }
        });
        assert_eq!(arithmetic(40.0, 0.0), 20.0);
        assert_eq!(harmonic(40.0, 0.0), 0.0);
        assert_eq!(harmonic(0.0, 0.0), 0.0);
        assert_eq!(harmonic(0.1, 0.1), 0.1);
        // 1/G of two half-spaces of 4 K a each, with a = ½: G = 2 K_ij a = K_ij.
        let (one, other) = (40.0, 1.0);
        let series = 1.0 / (1.0 / (2.0 * one) + 1.0 / (2.0 * other));
        assert!((harmonic(one, other) - series).abs() < 1e-15 * series * 4.0);
        // No overflow, and less than twice the worse one.
        assert!((harmonic(1e300, 1e-300) - 2e-300).abs() < 1e-315);
    }
}
