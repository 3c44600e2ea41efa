//! Enthalpy of matter as a function of temperature, and back: heat capacity, melting and boiling.

use serde::Serialize;
use stagger_coupling::SolveError;

use super::Table;

/// Changes of phase of a material.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Phases {
    /// Melting; `None` is never.
    pub melting: Option<PhaseChange>,
    /// Boiling, above the end of melting; `None` is never.
    pub boiling: Option<PhaseChange>,
}

/// A change of phase on heating, and back on cooling.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PhaseChange {
    /// Where it begins: θ_m or θ_v in K.
    pub from_k: f64,
    /// Bandwidth δθ in K over which the latent heat is spread; 0 changes phase at one temperature.
    pub width_k: f64,
    /// Latent heat in J/kg.
    pub latent_j_kg: f64,
}

/// Specific enthalpy h(θ) of a material above that of the start, in J/kg: the integral of its heat capacity, and the
/// latent heats in their bands.
///
/// Over a band of width δθ the heat capacity is C + L/δθ (Zohdi 2018, eqs. 6.60–6.64); over one of width 0 enthalpy rises by
/// L at one temperature. Either way h rises strictly, so that it tells the temperature and the share of each phase whatever
/// the path that led there: to book heat is to add to h, and no step can jump a band.
///
/// Between two nodes C is linear, so that h is quadratic: exact integrals, and exact inverses.
///
/// Where there is boiling the curve ends with it: what is vapour leaves, and is not followed to higher temperatures.
/// More heat than that leaves the temperature where boiling ends; [`Curve::vapour`] tells it.
#[derive(Clone, Debug)]
pub(crate) struct Curve {
    nodes: Vec<Node>,
    /// C below the first node, in J/(kg K).
    below_j_kg_k: f64,
    /// Least C without latent heat, in J/(kg K).
    least_j_kg_k: f64,
    melting: Option<Band>,
    boiling: Option<Band>,
    /// Whether nothing gets hotter than the last node, where boiling ends.
    ends: bool,
}

/// Where the heat capacity bends or jumps.
#[derive(Clone, Copy, Debug)]
struct Node {
    temperature_k: f64,
    /// h where this temperature is reached, in J/kg.
    reached_j_kg: f64,
    /// h where it is left upwards; more where a phase changes at this temperature.
    left_j_kg: f64,
    /// C right above, with latent heat, in J/(kg K).
    capacity_j_kg_k: f64,
    /// dC/dθ up to the next node, in J/(kg K²).
    slope_j_kg_k2: f64,
}

/// A change of phase: where it begins and ends.
#[derive(Clone, Copy, Debug)]
struct Band {
    from_k: f64,
    to_k: f64,
    from_j_kg: f64,
    to_j_kg: f64,
    latent_j_kg: f64,
}

/// Where a body is on its curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Place {
    pub(crate) temperature_k: f64,
    /// dθ/dh in K kg/J; 0 while a phase changes at one temperature.
    pub(crate) slope: f64,
}

impl Curve {
    /// The curve of a heat capacity in J/(kg K) with what changes of phase add, from h = 0 at `start_k`; `node` is who asks.
    ///
    /// # Errors
    /// The capacity is not positive, or melting ends above the temperature at which boiling begins.
    pub(crate) fn new(node: &str, capacity: &Table, phases: Option<&Phases>, start_k: f64) -> Result<Self, SolveError> {
        capacity.check(node, "heat capacity", |value| value > 0.0, "positive and finite")?;
        let changes: Vec<_> =
            phases.into_iter().flat_map(|phases| [phases.melting, phases.boiling]).flatten().collect();
        for change in &changes {
            let [from_k, width_k, latent_j_kg] = [change.from_k, change.width_k, change.latent_j_kg];
            if !(from_k > 0.0 && width_k >= 0.0 && latent_j_kg >= 0.0 && (from_k + width_k + latent_j_kg).is_finite()) {
                return Err(SolveError::Start(format!(
                    "{node}: a change of phase needs a positive temperature, a width and a latent heat of at least 0, \
                     but has {from_k} K, {width_k} K and {latent_j_kg} J/kg"
                )));
            }
        }
        if let [melting, boiling] = changes[..]
            && melting.from_k + melting.width_k >= boiling.from_k
        {
            return Err(SolveError::Start(format!(
                "{node}: melting ends at {} K, but must end below the boiling point, {} K",
                melting.from_k + melting.width_k,
                boiling.from_k
            )));
        }
        let mut at_k: Vec<f64> = capacity.points.iter().map(|point| point[0]).chain([start_k]).collect();
        at_k.extend(changes.iter().flat_map(|change| [change.from_k, change.from_k + change.width_k]));
        at_k.sort_by(f64::total_cmp);
        at_k.dedup();

        let mut curve = Self {
            nodes: Vec::with_capacity(at_k.len()),
            below_j_kg_k: capacity.at(at_k[0]),
            least_j_kg_k: capacity.points.iter().fold(f64::INFINITY, |least, point| least.min(point[1])),
            melting: None,
            boiling: None,
            ends: false,
        };
        // As wide as its rounded ends lie apart: over a narrow band at a high temperature, the width asked for would miss a
        // share of the latent heat.
        let end_k = |change: &PhaseChange| change.from_k + change.width_k;
        let mut reached_j_kg = 0.0;
        for (place, &temperature_k) in at_k.iter().enumerate() {
            let is_plateau = |change: &&PhaseChange| end_k(change) == change.from_k && change.from_k == temperature_k;
            let jump_j_kg: f64 = changes.iter().filter(is_plateau).map(|change| change.latent_j_kg).sum();
            let until_k = at_k.get(place + 1).copied();
            let is_over = |change: &&PhaseChange| (change.from_k..end_k(change)).contains(&temperature_k);
            let apparent: f64 = (changes.iter().filter(is_over))
                .map(|change| change.latent_j_kg / (end_k(change) - change.from_k))
                .sum();
            let capacity_j_kg_k = capacity.at(temperature_k) + apparent;
            let slope_j_kg_k2 = until_k
                .map_or(0.0, |until_k| (capacity.at(until_k) - capacity.at(temperature_k)) / (until_k - temperature_k));
            let left_j_kg = reached_j_kg + jump_j_kg;
            let node = Node { temperature_k, reached_j_kg, left_j_kg, capacity_j_kg_k, slope_j_kg_k2 };
            reached_j_kg = until_k.map_or(left_j_kg, |until_k| node.enthalpy(until_k));
            curve.nodes.push(node);
        }
        let phases = phases.copied().unwrap_or_default();
        let last_k = phases.boiling.as_ref().map_or(f64::INFINITY, end_k);
        curve.nodes.retain(|node| node.temperature_k <= last_k);
        curve.ends = phases.boiling.is_some();
        // From the start, where h is exactly 0.
        let start_j_kg = curve.enthalpy(start_k);
        for node in &mut curve.nodes {
            node.reached_j_kg -= start_j_kg;
            node.left_j_kg -= start_j_kg;
        }
        let band = |change: &PhaseChange| {
            let (from_k, to_k) = (change.from_k, end_k(change));
            let left =
                curve.nodes.iter().find(|node| node.temperature_k == to_k).map_or(f64::NAN, |node| node.left_j_kg);
            let to_j_kg = if to_k > from_k { curve.enthalpy(to_k) } else { left };
            Band { from_k, to_k, from_j_kg: curve.enthalpy(from_k), to_j_kg, latent_j_kg: change.latent_j_kg }
        };
        (curve.melting, curve.boiling) = (phases.melting.as_ref().map(band), phases.boiling.as_ref().map(band));
        Ok(curve)
    }

    /// h at a temperature in K; where a phase changes at just this one, before it does. Above the end of boiling it is that of
    /// vapour.
    pub(crate) fn enthalpy(&self, temperature_k: f64) -> f64 {
        match self.nodes.partition_point(|node| node.temperature_k < temperature_k) {
            0 => self.nodes[0].reached_j_kg + self.below_j_kg_k * (temperature_k - self.nodes[0].temperature_k),
            after => match self.nodes.get(after).filter(|node| node.temperature_k <= temperature_k) {
                Some(node) => node.reached_j_kg,
                None if self.ends && after == self.nodes.len() => self.nodes[after - 1].left_j_kg,
                None => self.nodes[after - 1].enthalpy(temperature_k),
            },
        }
    }

    /// h at a temperature in K, where a share of the mass has melted: that share tells how far a body is that melts at just
    /// this one temperature, within rounding; anywhere else temperature alone does.
    pub(crate) fn enthalpy_of(&self, temperature_k: f64, melted: f64) -> f64 {
        match &self.melting {
            Some(band) if band.from_k == band.to_k && (temperature_k / band.from_k - 1.0).abs() < 1e-12 => {
                band.from_j_kg + melted * (band.to_j_kg - band.from_j_kg)
            }
            _ => self.enthalpy(temperature_k),
        }
    }

    /// Where h + k θ equals `total_j_kg`: with k = 0 the inverse of h, with k ≥ 0 in J/(kg K) the balance of a body
    /// whose heat flows out with its own temperature.
    pub(crate) fn balance(&self, total_j_kg: f64, outflow_j_kg_k: f64) -> Place {
        let reached = |node: &Node| node.reached_j_kg + outflow_j_kg_k * node.temperature_k;
        let after = self.nodes.partition_point(|node| reached(node) <= total_j_kg);
        let Some(node) = after.checked_sub(1).map(|place| &self.nodes[place]) else {
            let first = &self.nodes[0];
            let missing_k = (total_j_kg - reached(first)) / (self.below_j_kg_k + outflow_j_kg_k);
            return Place { temperature_k: first.temperature_k + missing_k, slope: self.below_j_kg_k.recip() };
        };
        let beyond_j_kg = total_j_kg - (node.left_j_kg + outflow_j_kg_k * node.temperature_k);
        if beyond_j_kg < 0.0 {
            return Place { temperature_k: node.temperature_k, slope: 0.0 };
        }
        if self.ends && after == self.nodes.len() {
            return Place { temperature_k: node.temperature_k, slope: 0.0 };
        }
        // The root of C x + ½ C′ x² = d that stays exact as C′ goes to 0.
        let linear = node.capacity_j_kg_k + outflow_j_kg_k;
        let root = (linear * linear + 2.0 * node.slope_j_kg_k2 * beyond_j_kg).max(0.0).sqrt();
        let above_k = 2.0 * beyond_j_kg / (linear + root);
        let next_k = self.nodes.get(after).map_or(f64::INFINITY, |next| next.temperature_k);
        let slope = (node.capacity_j_kg_k + node.slope_j_kg_k2 * above_k).recip();
        Place { temperature_k: (node.temperature_k + above_k).min(next_k), slope }
    }

    /// Where h is `enthalpy_j_kg`.
    pub(crate) fn place(&self, enthalpy_j_kg: f64) -> Place {
        self.balance(enthalpy_j_kg, 0.0)
    }

    /// Least C without latent heat at any temperature, in J/(kg K).
    pub(crate) fn least_j_kg_k(&self) -> f64 {
        self.least_j_kg_k
    }

    /// h from which on all is vapour, in J/kg; `None` where nothing boils.
    pub(crate) fn vapour(&self) -> Option<f64> {
        self.boiling.as_ref().map(|band| band.to_j_kg)
    }

    /// Shares of the mass that are molten or were, and vapour; each from 0 to 1.
    pub(crate) fn molten_and_vapour(&self, enthalpy_j_kg: f64) -> [f64; 2] {
        let share = |band: &Option<Band>| {
            band.as_ref().map_or(0.0, |band| {
                if enthalpy_j_kg >= band.to_j_kg {
                    1.0
                } else if enthalpy_j_kg <= band.from_j_kg {
                    0.0
                } else if band.to_k > band.from_k {
                    let reached_k = self.place(enthalpy_j_kg).temperature_k;
                    ((reached_k - band.from_k) / (band.to_k - band.from_k)).clamp(0.0, 1.0)
                } else {
                    (enthalpy_j_kg - band.from_j_kg) / band.latent_j_kg
                }
            })
        };
        [share(&self.melting), share(&self.boiling)]
    }

    /// The part of h that is latent, in J/kg; 0 while all is solid.
    pub(crate) fn latent(&self, [molten, vapour]: [f64; 2]) -> f64 {
        let of = |band: &Option<Band>, share: f64| band.as_ref().map_or(0.0, |band| share * band.latent_j_kg);
        of(&self.melting, molten) + of(&self.boiling, vapour)
    }
}

impl Node {
    /// h at a temperature from this node's to the next's.
    fn enthalpy(&self, temperature_k: f64) -> f64 {
        let above_k = temperature_k - self.temperature_k;
        self.left_j_kg + above_k * (self.capacity_j_kg_k + 0.5 * self.slope_j_kg_k2 * above_k)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn phases(melting_k: f64, boiling_k: f64) -> Phases {
        Phases {
            melting: Some(PhaseChange { from_k: 1600.0, width_k: melting_k, latent_j_kg: 2.6e5 }),
            boiling: Some(PhaseChange { from_k: 3000.0, width_k: boiling_k, latent_j_kg: 6e6 }),
        }
    }

    #[test]
    fn enthalpy_is_the_integral_of_the_heat_capacity_and_the_latent_heats() {
        let capacity = Table { points: vec![[300.0, 500.0], [1300.0, 700.0]] };
        for (melting_k, boiling_k) in [(0.0, 0.0), (60.0, 0.0), (60.0, 20.0)] {
            let curve = Curve::new("heat", &capacity, Some(&phases(melting_k, boiling_k)), 300.0).unwrap();
            assert_eq!(curve.enthalpy(300.0), 0.0);
            assert_eq!(curve.enthalpy(200.0), -500.0 * 100.0);
            // ½ (500 + 700) over 1000 K, 700 from there on: exact in these numbers to a few roundings.
            for (at_k, expected) in [
                (800.0, 550.0 * 500.0),
                (1300.0, 6e5),
                (1600.0, 6e5 + 700.0 * 300.0),
                (2000.0, 6e5 + 700.0 * 700.0 + 2.6e5),
            ] {
                let found = curve.enthalpy(at_k);
                assert!((found - expected).abs() < 1e-12 * expected, "{at_k} K: {found} instead of {expected}");
                assert!((curve.place(found).temperature_k - at_k).abs() < 1e-11 * at_k, "{at_k} K and back");
            }
            let [molten, vapour] = curve.molten_and_vapour(curve.enthalpy(1600.0) + 1.3e5 + 0.5 * 700.0 * melting_k);
            assert!((molten - 0.5).abs() < 1e-12 && vapour == 0.0, "{molten}, {vapour}");
            // Boiling ends it: vapour gets no hotter.
            let (end_k, end_j_kg) = (3000.0 + boiling_k, 6e5 + 700.0 * (1700.0 + boiling_k) + 2.6e5 + 6e6);
            let vapour_j_kg = curve.vapour().unwrap();
            assert!((vapour_j_kg - end_j_kg).abs() < 1e-12 * end_j_kg, "{vapour_j_kg} instead of {end_j_kg}");
            assert_eq!(curve.enthalpy(4000.0), vapour_j_kg);
            for more_j_kg in [0.0, 1.0, 1e9] {
                assert_eq!(curve.place(vapour_j_kg + more_j_kg), Place { temperature_k: end_k, slope: 0.0 });
                assert_eq!(curve.molten_and_vapour(vapour_j_kg + more_j_kg), [1.0, 1.0]);
            }
            assert_eq!(curve.latent([1.0, 1.0]), 6.26e6);
        }
    }

    #[test]
    fn a_phase_that_changes_at_one_temperature_holds_it() {
        let curve = Curve::new("heat", &Table::constant(500.0), Some(&phases(0.0, 0.0)), 300.0).unwrap();
        let melting_j_kg = 500.0 * 1300.0;
        for latent_j_kg in [1.0, 1e5, 2.59e5] {
            let place = curve.place(melting_j_kg + latent_j_kg);
            assert_eq!(place, Place { temperature_k: 1600.0, slope: 0.0 });
            let [molten, _] = curve.molten_and_vapour(melting_j_kg + latent_j_kg);
            assert!((molten - latent_j_kg / 2.6e5).abs() < 1e-12);
        }
        assert_eq!(curve.place(melting_j_kg + 2.6e5 + 5e4), Place { temperature_k: 1700.0, slope: 1.0 / 500.0 });
    }

    #[test]
    fn what_cannot_be_is_refused() {
        let constant = Table::constant(500.0);
        let refused = |capacity: &Table, phases: Phases| {
            Curve::new("heat", capacity, Some(&phases), 300.0).unwrap_err().to_string()
        };
        assert!(refused(&constant, phases(1500.0, 0.0)).contains("must end below the boiling point, 3000 K"));
        assert!(refused(&constant, phases(-1.0, 0.0)).contains("a width and a latent heat of at least 0"));
        let falling = Table { points: vec![[400.0, 1.0], [300.0, 1.0]] };
        assert!(refused(&falling, phases(0.0, 0.0)).contains("must rise, but 300 K follows 400 K"));
        assert!(refused(&Table::constant(0.0), phases(0.0, 0.0)).contains("heat capacity is 0"));
        assert!(refused(&Table { points: Vec::new() }, phases(0.0, 0.0)).contains("no values"));
    }

    proptest! {
        #[test]
        fn a_balance_holds_what_it_is_given(
            total in -2e5f64..2e7,
            outflow in prop_oneof![Just(0.0), 1e-3f64..1e7],
            bands in prop_oneof![Just((0.0, 0.0)), (1.0f64..100.0, 1.0f64..100.0)],
        ) {
            let capacity = Table { points: vec![[300.0, 500.0], [1300.0, 700.0], [1650.0, 450.0], [2500.0, 800.0]] };
            let curve = Curve::new("heat", &capacity, Some(&phases(bands.0, bands.1)), 300.0).unwrap();
            let found_k = curve.balance(total, outflow).temperature_k;
            // A rounding of θ, times what h + k θ rises with it: at most 6·10⁶ J/(kg K) in a band of 1 K. In a plateau h is
            // between its ends.
            let [less_k, more_k] = [found_k - 1e-12 * found_k.abs(), found_k + 1e-12 * found_k.abs()];
            let rounding = 2e-12 * found_k.abs() * (7e6 + outflow) + 1e-6;
            prop_assert!(curve.enthalpy(less_k) + outflow * found_k <= total + rounding);
            let end_k = 3000.0 + bands.1;
            if total > curve.vapour().unwrap() + outflow * end_k {
                prop_assert_eq!(found_k, end_k);
                return Ok(());
            }
            let left = curve.nodes.iter().find(|node| node.temperature_k == found_k).map(|node| node.left_j_kg);
            prop_assert!(left.unwrap_or_else(|| curve.enthalpy(more_k)) + outflow * found_k >= total - rounding);
        }
    }
}
