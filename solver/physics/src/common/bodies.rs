//! What the physics of a scene may know of its particles before it runs.

use std::{any::Any, cell::RefCell};

use stagger_config::{key::Key, problems::quoted, reader::Table};

use super::keys::materials::Material;

/// The particles of a scene, as far as other physics depend on them.
pub struct Bodies<'d> {
    /// Their table, for messages about them and for what remains to be read of it; `None` where the scene has none.
    pub table: RefCell<Option<Table<'d>>>,
    /// The key of that table that names the material.
    pub material_key: &'static Key,
    /// What of the table was read and concerns nobody else.
    pub beginning: RefCell<Option<Box<dyn Any>>>,
    /// Number at t = 0.
    pub count: usize,
    /// Mean radius of the group with the smallest, in m.
    pub radius_m: f64,
    /// Radius that a twentieth of a group's particles are below, of the group or the dispenser where it is least, in m.
    pub small_m: f64,
    /// Material of most of them, by its name.
    pub material: (String, Material),
    /// What they are made of, in the order in which they name it.
    pub materials: Vec<(String, Material)>,
    /// Temperature at the start, in K.
    pub temperature_k: f64,
    /// Each particle as a file gives it.
    pub given: Option<Given>,
}

/// Particles one by one, as a file gives them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Given {
    /// Radii, in m.
    pub radii_m: Vec<f64>,
    /// Materials, as places in [`Bodies::materials`].
    pub materials: Vec<u16>,
    /// What they have of heat, where the file says it.
    pub heat: Option<Heat>,
}

/// What a file tells of the particles' heat.
#[derive(Clone, Debug, PartialEq)]
pub struct Heat {
    /// Temperatures, in K.
    pub temperatures_k: Vec<f64>,
    /// Liquid shares, where the file has them.
    pub melted: Option<Vec<f64>>,
}

impl Bodies<'_> {
    /// A property of the one material that a physics takes for all particles, reported where it is missing.
    #[must_use]
    pub fn property(&self, name: &str, value: Option<f64>) -> f64 {
        let table = self.table.borrow();
        let Some(table) = table.as_ref() else { return value.unwrap_or(f64::NAN) };
        if self.materials.len() > 1 {
            let names: Vec<_> = self.materials.iter().map(|(name, _)| name.as_str()).collect();
            let message = format!(
                "the particles are of {}, but the physics that need their `{name}` take one material",
                names.join(", ")
            );
            table.reject(self.material_key, message);
        }
        self.missing(table, &self.material, name, value)
    }

    /// A property of one of the materials, reported where it is missing; `stand_in` then holds its place.
    pub fn property_of<T>(&self, material: &(String, Material), name: &str, value: Option<T>, stand_in: T) -> T {
        value.unwrap_or_else(|| {
            if let Some(table) = self.table.borrow().as_ref() {
                self.missing(table, material, name, None);
            }
            stand_in
        })
    }

    fn missing(&self, table: &Table<'_>, material: &(String, Material), name: &str, value: Option<f64>) -> f64 {
        property(table, self.material_key, material, name, value)
    }
}

/// A property of a material that `key` of a table names, reported there where it is missing.
pub fn property(
    table: &Table<'_>,
    key: &'static Key,
    material: &(String, Material),
    name: &str,
    value: Option<f64>,
) -> f64 {
    value.unwrap_or_else(|| missing_property(table, key, material, name))
}

/// Reports, at the `key` of a table that names a material, that it lacks a property; returns what stands in for it.
pub fn missing_property(table: &Table<'_>, key: &'static Key, material: &(String, Material), name: &str) -> f64 {
    let message = format!("the material {} has no `{name}`", quoted(&material.0));
    table.reject_with(key, message, Some(format!("add `{name}` to [materials.{}]", material.0)));
    f64::NAN
}
