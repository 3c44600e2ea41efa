//! How a contact conducts heat or current.

use serde::Serialize;

/// Conductance of a contact: in W/K from a thermal conductivity K in W/(m K), in S from an electrical one in S/m.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Conductance {
    /// K A/d, the monograph's (eq. 6.35).
    Monograph,
    /// 2 K a, the exact one of a small circular spot of radius a between half-spaces (Holm 1967), a = √(A/π).
    Constriction,
}

/// Conductance G of a contact: heat flows at G (θ_j − θ_i), current at G (V_j − V_i).
///
/// - [`Conductance::Monograph`]: K A/d (Zohdi 2018, eq. 6.35), with d between the centres, or from the centre to the
///   surface of a wall.
/// - [`Conductance::Constriction`]: 2 K a, a = √(A/π): a circular spot between half-spaces (Holm 1967, §2).
///
/// `conductivity` is K_ij = ½ (K_i + K_j) (eq. 6.37); `area_m2` is A, `distance_m` is d. A contact without area
/// conducts nothing. `None`: the monograph's form has no value at d ≤ 0.
pub(crate) fn conductance(model: Conductance, conductivity: f64, area_m2: f64, distance_m: f64) -> Option<f64> {
    if area_m2 <= 0.0 {
        return Some(0.0);
    }
    match model {
        Conductance::Monograph if distance_m > 0.0 => Some(conductivity * area_m2 / distance_m),
        Conductance::Monograph => None,
        Conductance::Constriction => Some(2.0 * conductivity * (area_m2 / std::f64::consts::PI).sqrt()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_contact_without_area_conducts_nothing_whatever_its_distance() {
        for model in [Conductance::Monograph, Conductance::Constriction] {
            for distance in [1.0, 0.0, -1.0] {
                assert_eq!(conductance(model, 20.0, 0.0, distance), Some(0.0));
            }
        }
    }

    #[test]
    fn only_the_monograph_form_needs_a_distance() {
        assert_eq!(conductance(Conductance::Monograph, 20.0, 1.0, 0.0), None);
        // π a² = A with a = 3: G = 2 K a.
        let area = std::f64::consts::PI * 9.0;
        assert!((conductance(Conductance::Constriction, 20.0, area, 0.0).unwrap() - 120.0).abs() < 1e-12);
    }
}
