//! The quantities that a run is coloured by, each with a picture and a legend of its own.

use std::{collections::BTreeSet, sync::Arc};

use stagger_recordings::{
    RunInfo, Step,
    display::quantities::{Quantity, Spheres, quantities},
};

use crate::colour::{Range, Scale};

/// Share of the largest speed of a run below which the mean speed is near none.
const AT_REST: f64 = 0.05;
/// Unit of speeds.
const SPEED: &str = "m/s";
/// Where the first picture stands among the data, and what is drawn in it beside: walls, beams, rays.
pub const WORLD: &str = "world";

/// A quantity with its range.
#[derive(Clone, Debug)]
pub struct Layer {
    /// The quantity.
    pub quantity: Arc<Quantity>,
    /// Where its picture stands among the data.
    pub path: String,
    /// Its range.
    pub range: Range,
    /// How its values are laid over the colours.
    pub scale: Scale,
}

/// What of a state colours, with a value for each row.
pub type Coloured = Vec<(Quantity, Vec<f64>)>;

/// Group of the curves of a quantity.
pub fn curves(quantity: &Quantity) -> String {
    format!("fields/{}", quantity.field)
}

/// The layers of a run, as far as its states have shown them; what colours spheres comes first.
#[derive(Clone, Debug, Default)]
pub struct Layers {
    list: Vec<Layer>,
    /// Largest speed of a particle, in m/s.
    pub fastest_m_s: f64,
    /// Fields that built-in physics of the scene write.
    known: BTreeSet<String>,
}

impl Layers {
    /// Those of a run, of which no state has been seen.
    pub fn of(info: &RunInfo) -> Self {
        // The fields of a scene that cannot be read count as those of others: more is shown.
        let known = info.scene().map(|scene| scene.written()).unwrap_or_default();
        Self { known, ..Self::default() }
    }

    /// What of a state colours, with a value for each row.
    pub fn coloured(&self, step: &Step) -> Coloured {
        quantities(step, &self.known)
    }

    /// Widens the ranges so that a state fits.
    pub fn include(&mut self, step: &Step, coloured: &Coloured) {
        self.meet(step);
        for (quantity, values) in coloured {
            self.layer(quantity).range.include(values);
        }
    }

    /// Widens the ranges by strides so that a state fits (see [`Range::grow`]); returns whether one had to.
    pub fn grow(&mut self, step: &Step, coloured: &Coloured) -> bool {
        self.meet(step);
        let mut grown = false;
        for (quantity, values) in coloured {
            let mut seen = Range::EMPTY;
            seen.include(values);
            grown |= self.layer(quantity).range.grow(seen);
        }
        grown
    }

    /// Lays speeds over the colours by their logarithm where a run ends almost at rest: that who still moves, and who
    /// rests, is seen as well as who fell.
    pub fn end(&mut self, last: &Step) {
        let Some(spheres) = Spheres::of(last) else { return };
        let mean = spheres.speeds_m_s().sum::<f64>() / spheres.velocities_m_s.len().max(1) as f64;
        for layer in self.list.iter_mut().filter(|layer| layer.quantity.unit == SPEED) {
            if mean < AT_REST * layer.range.max {
                layer.scale = Scale::Decades;
            }
        }
    }

    fn meet(&mut self, step: &Step) {
        let fastest = Spheres::of(step).map_or(0.0, |spheres| spheres.speeds_m_s().fold(0.0, f64::max));
        self.fastest_m_s = self.fastest_m_s.max(fastest);
    }

    fn layer(&mut self, quantity: &Quantity) -> &mut Layer {
        let place = self.list.iter().position(|layer| *layer.quantity == *quantity).unwrap_or_else(|| {
            let path = if self.list.is_empty() { WORLD.to_owned() } else { format!("pictures/{}", quantity.field) };
            let scale = if quantity.decades { Scale::Decades } else { Scale::Linear };
            self.list.push(Layer { quantity: quantity.clone().into(), path, range: Range::EMPTY, scale });
            self.list.len() - 1
        });
        &mut self.list[place]
    }

    /// Each layer.
    pub fn iter(&self) -> impl Iterator<Item = &Layer> {
        self.list.iter()
    }
}

/// The largest value of what a run may be about for some time only, where there is such a quantity.
pub fn passing(coloured: &Coloured) -> Option<f64> {
    let (_, values) = coloured.iter().find(|(quantity, _)| quantity.passing)?;
    Some(values.iter().copied().fold(0.0, f64::max))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{field, step};

    fn include(layers: &mut Layers, step: &Step) {
        layers.include(step, &layers.coloured(step));
    }

    #[test]
    fn a_run_has_a_layer_for_each_quantity_and_what_colours_spheres_comes_first() {
        let mut step = step([
            field("stress_position", "m", "grid", 3, vec![0.0; 9]),
            field("stress_deviator_norm", "Pa", "grid", 1, vec![1.0, 10.0, 100.0]),
            field("positions", "m", "particles", 3, vec![0.0; 6]),
            field("radii", "m", "particles", 1, vec![1.0; 2]),
            field("velocities", "m/s", "particles", 3, vec![0.0, 3.0, 4.0, 0.0, 0.0, 0.0]),
            field("current_density", "A/m^2", "particles", 1, vec![5.0, 7.0]),
        ]);
        let mut layers = Layers::default();
        include(&mut layers, &step);
        let names: Vec<_> = layers.iter().map(|layer| layer.quantity.name.as_str()).collect();
        assert_eq!(names, ["speed", "current density", "norm of the stress deviator"]);
        let paths: Vec<_> = layers.iter().map(|layer| layer.path.as_str()).collect();
        assert_eq!(paths, [WORLD, "pictures/current_density", "pictures/stress_deviator_norm"]);
        let ranges: Vec<_> = layers.iter().map(|layer| (layer.range.min, layer.range.max)).collect();
        assert_eq!(ranges, [(0.0, 5.0), (5.0, 7.0), (1.0, 100.0)]);
        assert_eq!((layers.fastest_m_s, passing(&layers.coloured(&step))), (5.0, Some(7.0)));
        let rows = |step: &Step| layers.coloured(step).iter().map(|(_, values)| values.len()).collect::<Vec<_>>();
        assert_eq!(rows(&step), [2, 2, 3]);
        step.fields.remove("current_density");
        assert_eq!(rows(&step), [2, 3], "a state without a quantity");
    }

    #[test]
    fn of_a_run_that_ends_at_rest_slow_speeds_are_told_apart() {
        let place =
            || [field("positions", "m", "particles", 3, vec![0.0; 3]), field("radii", "m", "particles", 1, vec![1.0])];
        let speed = |value: f64| {
            let speed = field("velocities", "m/s", "particles", 3, vec![0.0, 0.0, value]);
            step(place().into_iter().chain([speed]))
        };
        for (last, expected) in [(0.049, Scale::Decades), (0.051, Scale::Linear)] {
            let mut layers = Layers::default();
            include(&mut layers, &speed(1.0));
            layers.end(&speed(last));
            assert_eq!(layers.list[0].scale, expected, "{last}");
        }
        let warm = step(place().into_iter().chain([field("temperature", "K", "particles", 1, vec![300.0])]));
        let mut layers = Layers::default();
        include(&mut layers, &warm);
        layers.end(&warm);
        assert_eq!(layers.list[0].scale, Scale::Linear);
        assert!(!layers.grow(&warm, &layers.coloured(&warm)), "what fits does not grow a range");
    }
}
