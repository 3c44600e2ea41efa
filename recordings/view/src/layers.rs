//! The quantities that a run is coloured by, each with a picture and a legend of its own.

use stagger_messages::{Field, Fields};

use crate::colour::{Range, Scale};

/// A quantity that colours.
#[derive(Debug, PartialEq, Eq)]
pub struct Quantity {
    /// Its name.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Where its picture stands among the data.
    pub path: &'static str,
    /// Title of its curves.
    pub title: &'static str,
    /// Where they stand among the data.
    pub curves: &'static str,
    /// What it colours.
    pub on: On,
    /// How its values are laid over the colours, unless the run calls for another way.
    pub scale: Scale,
}

/// What a quantity colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum On {
    /// The particles.
    Particles,
    /// The points of a grid.
    Grid,
    /// Lines between particles in contact.
    Contacts,
}

const TEMPERATURE: Quantity = Quantity {
    name: "temperature",
    unit: "K",
    path: "world",
    title: "Particles",
    curves: "plots/particles",
    on: On::Particles,
    scale: Scale::Linear,
};
const SPEED: Quantity = Quantity { name: "speed", unit: "m/s", ..TEMPERATURE };
const CURRENT: Quantity = Quantity {
    name: "current density",
    unit: "A/m²",
    path: "current",
    title: "Current",
    curves: "plots/current",
    on: On::Particles,
    scale: Scale::Linear,
};
const STRESS: Quantity = Quantity {
    name: "norm of the stress deviator",
    unit: "Pa",
    path: "stress",
    title: "Stress",
    curves: "plots/stress",
    on: On::Grid,
    scale: Scale::Decades,
};

const FORCE: Quantity = Quantity {
    name: "normal force of contacts",
    unit: "N",
    path: "forces",
    title: "Contact forces",
    curves: "plots/forces",
    on: On::Contacts,
    scale: Scale::Linear,
};

/// Share of the largest speed of a run below which the mean speed is near none.
const AT_REST: f64 = 0.05;

/// A quantity with its range.
#[derive(Clone, Copy, Debug)]
pub struct Layer {
    /// The quantity.
    pub quantity: &'static Quantity,
    /// Its range.
    pub range: Range,
    /// How its values are laid over the colours.
    pub scale: Scale,
}

/// The layers of a run, as far as its states have shown them; the particles' own comes first.
#[derive(Clone, Debug, Default)]
pub struct Layers {
    list: Vec<Layer>,
    /// Largest speed of a particle, in m/s.
    pub fastest_m_s: f64,
}

impl Layers {
    /// Widens the ranges so that a state fits.
    pub fn include(&mut self, fields: &Fields) {
        self.meet(fields);
        for (quantity, values) in values(fields) {
            self.of(quantity).range.include(&values);
        }
    }

    /// Widens the ranges by strides so that a state fits (see [`Range::grow`]); returns whether one had to.
    pub fn grow(&mut self, fields: &Fields) -> bool {
        self.meet(fields);
        let mut grown = false;
        for (quantity, values) in values(fields) {
            let mut seen = Range::EMPTY;
            seen.include(&values);
            grown |= self.of(quantity).range.grow(seen);
        }
        grown
    }

    /// Lays speeds over the colours by their logarithm where a run ends almost at rest: that who still moves, and who
    /// rests, is seen as well as who fell.
    pub fn end(&mut self, last: &Fields) {
        let speeds = speeds(last).unwrap_or_default();
        let mean = speeds.iter().sum::<f64>() / speeds.len().max(1) as f64;
        for layer in self.list.iter_mut().filter(|layer| layer.quantity == &SPEED) {
            if mean < AT_REST * layer.range.max {
                layer.scale = Scale::Decades;
            }
        }
    }

    fn meet(&mut self, fields: &Fields) {
        let fastest = speeds(fields).unwrap_or_default().into_iter().fold(0.0, f64::max);
        self.fastest_m_s = self.fastest_m_s.max(fastest);
    }

    fn of(&mut self, quantity: &'static Quantity) -> &mut Layer {
        let place = self.list.iter().position(|layer| layer.quantity == quantity).unwrap_or_else(|| {
            self.list.push(Layer { quantity, range: Range::EMPTY, scale: quantity.scale });
            self.list.len() - 1
        });
        &mut self.list[place]
    }

    /// Each layer.
    pub fn iter(&self) -> impl Iterator<Item = &Layer> {
        self.list.iter()
    }

    /// Colours of a state, by layer. A layer the state knows nothing of has none.
    pub fn colours(&self, fields: &Fields) -> Vec<Vec<[u8; 3]>> {
        let values = values(fields);
        let of = |layer: &Layer| {
            let found = values.iter().find(|(quantity, _)| *quantity == layer.quantity);
            let colour = |value: &f64| layer.range.colour(*value, layer.scale);
            found.map(|(_, values)| values.iter().map(colour).collect()).unwrap_or_default()
        };
        self.iter().map(of).collect()
    }
}

/// The values that colour: the particles' temperature, or their speed where no physics computes a temperature; and what
/// else there is.
///
/// Values from before particles came or went, which a slower node may have left, belong to others: they colour none.
pub fn values(fields: &Fields) -> Vec<(&'static Quantity, Vec<f64>)> {
    let of_particles = |name: &str| {
        let values = f64s(fields, name).filter(|_| stands_on(fields, name, "particles"))?;
        let of_others = fields.get("positions").is_some_and(|field| field.support != fields[name].support);
        Some(if of_others { Vec::new() } else { values.to_vec() })
    };
    let own = of_particles("temperature").map(|values| (&TEMPERATURE, values));
    let own = own.or_else(|| speeds(fields).map(|values| (&SPEED, values)));
    let current = of_particles("current_density").map(|values| (&CURRENT, values));
    let stress = f64s(fields, "stress_deviator_norm").map(|values| (&STRESS, values.to_vec()));
    let forces = f64s(fields, "contact_normal_force").map(|values| (&FORCE, values.to_vec()));
    own.into_iter().chain(current).chain(stress).chain(forces).collect()
}

fn speeds(fields: &Fields) -> Option<Vec<f64>> {
    let (velocities, _) = f64s(fields, "velocities")?.as_chunks::<3>();
    Some(velocities.iter().map(|[x, y, z]| x.hypot(*y).hypot(*z)).collect())
}

/// The largest current density among the particles, in A/m², where one is computed.
pub fn largest_current(fields: &Fields) -> Option<f64> {
    let of_current = |(quantity, values): (&Quantity, Vec<f64>)| (quantity == &CURRENT).then_some(values);
    Some(values(fields).into_iter().find_map(of_current)?.into_iter().fold(0.0, f64::max))
}

/// Values of a field of numbers.
pub fn f64s<'a>(fields: &'a Fields, name: &str) -> Option<&'a [f64]> {
    fields.get(name).and_then(|field| field.f64().ok())
}

fn stands_on(fields: &Fields, name: &str, support: &str) -> bool {
    fields.get(name).is_some_and(|field: &Field| field.support.name == support)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use stagger_messages::{Measure, Port, Values};

    use super::*;

    fn field(name: &str, support: &str, components: u32, values: impl Into<Values>) -> (String, Field) {
        let port = Arc::new(Port::f64(name, "1", support, components, Measure::None));
        (name.into(), Field::new(&port, 0, values).unwrap())
    }

    #[test]
    fn a_run_has_a_layer_for_each_quantity_and_the_particles_own_comes_first() {
        let mut fields = Fields::from([
            field("stress_deviator_norm", "grid", 1, vec![1.0, 10.0, 100.0]),
            field("velocities", "particles", 3, vec![0.0, 3.0, 4.0, 0.0, 0.0, 0.0]),
            field("current_density", "particles", 1, vec![5.0, 7.0]),
        ]);
        let mut layers = Layers::default();
        layers.include(&fields);
        let names: Vec<_> = layers.iter().map(|layer| layer.quantity.name).collect();
        assert_eq!(names, ["speed", "current density", "norm of the stress deviator"]);
        let ranges: Vec<_> = layers.iter().map(|layer| (layer.range.min, layer.range.max)).collect();
        assert_eq!(ranges, [(0.0, 5.0), (5.0, 7.0), (1.0, 100.0)]);
        let colours = layers.colours(&fields);
        assert_eq!(colours.iter().map(Vec::len).collect::<Vec<_>>(), [2, 2, 3]);
        fields.remove("current_density");
        assert!(layers.colours(&fields)[1].is_empty(), "a state without a quantity");
    }

    #[test]
    fn of_a_run_that_ends_at_rest_slow_speeds_are_told_apart() {
        let speed = |value: f64| Fields::from([field("velocities", "particles", 3, vec![0.0, 0.0, value])]);
        for (last, expected) in [(0.049, Scale::Decades), (0.051, Scale::Linear)] {
            let mut layers = Layers::default();
            layers.include(&speed(1.0));
            layers.end(&speed(last));
            assert_eq!(layers.list[0].scale, expected, "{last}");
        }
        let warm = Fields::from([field("temperature", "particles", 1, vec![300.0])]);
        let mut layers = Layers::default();
        layers.include(&warm);
        layers.end(&warm);
        assert_eq!(layers.list[0].scale, Scale::Linear);
    }

    #[test]
    fn with_a_temperature_it_and_not_the_speed_colours() {
        let fields = Fields::from([
            field("temperature", "particles", 1, vec![300.0]),
            field("velocities", "particles", 3, vec![0.0, 3.0, 4.0]),
        ]);
        let mut layers = Layers::default();
        assert!(layers.grow(&fields) && !layers.grow(&fields));
        let [layer] = layers.list.as_slice() else { panic!("one layer, not {layers:?}") };
        assert_eq!((layer.quantity.name, layer.range.min), ("temperature", 300.0));
    }
}
