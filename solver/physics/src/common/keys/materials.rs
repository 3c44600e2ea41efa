//! Materials: a built-in table of room-temperature values, and those a scene defines.

use stagger_config::{
    key::{Key, Kind, Range, Section},
    problems::{nearest, quoted},
    reader::Table,
    units::{
        CONDUCTIVITY, DENSITY, ELECTRICAL_CONDUCTIVITY, HEAT_CAPACITY, LATENT_HEAT, NUMBER, PER_LENGTH, PRESSURE,
        TEMPERATURE,
    },
};
use std::collections::BTreeMap;

use stagger_messages::Shown;

use crate::common::Table as Property;

/// Materials by name.
pub type Materials = BTreeMap<String, Material>;

/// Properties of a material; those a scene does not give stay open until something needs them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Material {
    /// Density, in kg/m³.
    pub density_kg_m3: Option<f64>,
    /// Heat capacity, in J/(kg K).
    pub heat_capacity_j_kg_k: Option<Property>,
    /// Thermal conductivity, in W/(m K).
    pub conductivity_w_m_k: Option<Property>,
    /// Where melting begins, in K.
    pub solidus_k: Option<f64>,
    /// Where melting ends, in K.
    pub liquidus_k: Option<f64>,
    /// Latent heat of melting, in J/kg.
    pub melting_heat_j_kg: Option<f64>,
    /// Boiling point, in K.
    pub boiling_k: Option<f64>,
    /// Latent heat of boiling, in J/kg.
    pub boiling_heat_j_kg: Option<f64>,
    /// Relative atomic mass of what evaporates: the mass of a mole in g.
    pub relative_atomic_mass: Option<f64>,
    /// Young's modulus, in Pa.
    pub young_pa: Option<f64>,
    /// Poisson's ratio.
    pub poisson: Option<f64>,
    /// Absorption coefficient of light a = 4πk/λ at λ = 1.06 µm, in 1/m.
    pub absorption_1_m: Option<f64>,
    /// Electrical conductivity, in S/m.
    pub electrical_conductivity_s_m: Option<f64>,
    /// Refractive index n of light.
    pub refractive_index: Option<f64>,
    /// Extinction k of light.
    pub extinction: Option<f64>,
}

pub(crate) static DENSITY_KEY: Key =
    Key::new("density", Kind::Number(&DENSITY, Range::POSITIVE), "Density ρ.").or_from("the built-in material's");
pub(crate) static HEAT_CAPACITY_KEY: Key =
    Key::new("heat-capacity", Kind::OverTemperature(&HEAT_CAPACITY, Range::POSITIVE), "Heat capacity C.")
        .or_from("the built-in material's");
pub(crate) static CONDUCTIVITY_KEY: Key =
    Key::new("conductivity", Kind::OverTemperature(&CONDUCTIVITY, Range::NOT_NEGATIVE), "Thermal conductivity K.")
        .or_from("the built-in material's");
static SOLIDUS_KEY: Key = Key::new("solidus", Kind::Number(&TEMPERATURE, Range::POSITIVE), "Where melting begins.")
    .or_from("the built-in material's");
static LIQUIDUS_KEY: Key =
    Key::new("liquidus", Kind::Number(&TEMPERATURE, Range::POSITIVE), "Where melting ends; at least the solidus.")
        .or_from("the built-in material's");
static MELTING_HEAT_KEY: Key =
    Key::new("melting-heat", Kind::Number(&LATENT_HEAT, Range::NOT_NEGATIVE), "Latent heat of melting.")
        .or_from("the built-in material's");
static BOILING_KEY: Key =
    Key::new("boiling", Kind::Number(&TEMPERATURE, Range::POSITIVE), "Boiling point; above the liquidus.")
        .or_from("the built-in material's");
static BOILING_HEAT_KEY: Key =
    Key::new("boiling-heat", Kind::Number(&LATENT_HEAT, Range::NOT_NEGATIVE), "Latent heat of boiling.")
        .or_from("the built-in material's");
pub(crate) static YOUNG_KEY: Key =
    Key::new("young", Kind::Number(&PRESSURE, Range::POSITIVE), "Young's modulus E, for Hertz contact.")
        .or_from("the built-in material's");
pub(crate) static POISSON_KEY: Key =
    Key::new("poisson", Kind::Number(&NUMBER, Range::within(0.0, 0.5)), "Poisson's ratio ν, for Hertz contact.")
        .or_from("the built-in material's");
pub(crate) static ABSORPTION_KEY: Key =
    Key::new("absorption", Kind::Number(&PER_LENGTH, Range::NOT_NEGATIVE), "Absorption coefficient a of light.")
        .or_from("the built-in material's");
pub(crate) static ELECTRICAL_CONDUCTIVITY_KEY: Key = Key::new(
    "electrical-conductivity",
    Kind::Number(&ELECTRICAL_CONDUCTIVITY, Range::POSITIVE),
    "Electrical conductivity σ.",
)
.or_from("the built-in material's");

pub(crate) static REFRACTIVE_INDEX_KEY: Key =
    Key::new("refractive-index", Kind::Number(&NUMBER, Range::POSITIVE), "Refractive index n of light.")
        .or_from("none is known");
pub(crate) static EXTINCTION_KEY: Key =
    Key::new("extinction", Kind::Number(&NUMBER, Range::NOT_NEGATIVE), "Extinction k of light; 0 is a dielectric.")
        .or_from("none is known");

static ATOMIC_MASS_KEY: Key = Key::new(
    "relative-atomic-mass",
    Kind::Number(&NUMBER, Range::POSITIVE),
    "Relative atomic mass of what evaporates: the mass of a mole in g.",
)
.or_from("the built-in material's");

/// Keys of a material.
pub static SECTION: Section = Section {
    path: "materials.NAME",
    doc: "A material of your own, or other values for a built-in one (`316L`, `Ti-6Al-4V`, `AlSi10Mg`). \
          Give what the scene uses; what is missing is asked for where it is needed.",
    example: "{ density = \"7950 kg/m^3\", heat-capacity = \"500 J/(kg K)\", conductivity = \"15 W/(m K)\" }",
    shorthand: None,
    keys: &[
        &DENSITY_KEY,
        &HEAT_CAPACITY_KEY,
        &CONDUCTIVITY_KEY,
        &SOLIDUS_KEY,
        &LIQUIDUS_KEY,
        &MELTING_HEAT_KEY,
        &BOILING_KEY,
        &BOILING_HEAT_KEY,
        &YOUNG_KEY,
        &POISSON_KEY,
        &ABSORPTION_KEY,
        &REFRACTIVE_INDEX_KEY,
        &EXTINCTION_KEY,
        &ELECTRICAL_CONDUCTIVITY_KEY,
        &ATOMIC_MASS_KEY,
    ],
};

/// The materials of every scene, at room temperature: rounded, typical values of the kind the handbooks named here give.
/// A study that rests on one of them should set its own.
///
/// Absorption is that of the base metal (iron, titanium, aluminium) from its extinction coefficient k at 1.06 µm,
/// Weaver and Frederikse, "Optical properties of selected elements", CRC Handbook of Chemistry and Physics, to one
/// digit: light goes a few tens of nanometres deep, so a particle of any digit is opaque.
///
/// Solidus, liquidus and heat of melting stand with the densities' sources. Boiling is that of the base metal at 1 bar:
/// boiling point and heat of vaporisation of the elements, CRC Handbook of Chemistry and Physics (340, 425 and
/// 294 kJ/mol), to two digits; an alloy loses its volatile parts first. The relative atomic mass is that of the base metal, too.
pub(crate) fn built_in() -> BTreeMap<String, Material> {
    let material =
        |[density, heat_capacity, conductivity, young, poisson, absorption, electrical]: [f64; 7],
         [solidus, liquidus, melting_heat, boiling, boiling_heat, atomic_mass]: [f64; 6]| Material {
            density_kg_m3: Some(density),
            heat_capacity_j_kg_k: Some(Property::constant(heat_capacity)),
            conductivity_w_m_k: Some(Property::constant(conductivity)),
            solidus_k: Some(solidus),
            liquidus_k: Some(liquidus),
            melting_heat_j_kg: Some(melting_heat),
            boiling_k: Some(boiling),
            boiling_heat_j_kg: Some(boiling_heat),
            young_pa: Some(young),
            poisson: Some(poisson),
            absorption_1_m: Some(absorption),
            electrical_conductivity_s_m: Some(electrical),
            relative_atomic_mass: Some(atomic_mass),
            ..Material::default()
        };
    BTreeMap::from([
        // Density: K. C. Mills, Recommended Values of Thermophysical Properties for Selected Commercial Alloys
        // (Woodhead 2002). Heat capacity and both conductivities: EN 10088-1, steel 1.4404. Moduli: Metals Handbook, Desk
        // Edition (ASM International 1998).
        (
            "316L".into(),
            material([7950.0, 500.0, 15.0, 193e9, 0.3, 5e7, 1.33e6], [1658.0, 1723.0, 260e3, 3134.0, 6.1e6, 55.85]),
        ),
        // Density, heat capacity and conductivity: Mills 2002. Moduli and electrical conductivity: Boyer, Welsch
        // and Collings, Materials Properties Handbook: Titanium Alloys (ASM International 1994).
        (
            "Ti-6Al-4V".into(),
            material([4420.0, 546.0, 7.0, 113.8e9, 0.342, 5e7, 5.8e5], [1878.0, 1923.0, 286e3, 3560.0, 8.9e6, 47.87]),
        ),
        // The casting alloy of the same composition, A360.0: ASM Handbook vol. 2 (ASM International 1990).
        (
            "AlSi10Mg".into(),
            material([2630.0, 963.0, 113.0, 71e9, 0.33, 1e8, 1.7e7], [830.0, 868.0, 389e3, 2792.0, 10.9e6, 26.98]),
        ),
    ])
}

/// The built-in materials with those of the scene.
pub fn read(root: &Table<'_>, key: &'static Key) -> BTreeMap<String, Material> {
    let mut materials = built_in();
    for (name, table) in root.named(key) {
        let base = materials.get(&name).cloned().unwrap_or_default();
        let own = |key, base: Option<f64>| table.optional_number(key).or(base);
        let over_temperature =
            |key, base: Option<Property>| table.over_temperature(key).map(|points| Property { points }).or(base);
        let material = Material {
            density_kg_m3: own(&DENSITY_KEY, base.density_kg_m3),
            heat_capacity_j_kg_k: over_temperature(&HEAT_CAPACITY_KEY, base.heat_capacity_j_kg_k),
            conductivity_w_m_k: over_temperature(&CONDUCTIVITY_KEY, base.conductivity_w_m_k),
            solidus_k: own(&SOLIDUS_KEY, base.solidus_k),
            liquidus_k: own(&LIQUIDUS_KEY, base.liquidus_k),
            melting_heat_j_kg: own(&MELTING_HEAT_KEY, base.melting_heat_j_kg),
            boiling_k: own(&BOILING_KEY, base.boiling_k),
            boiling_heat_j_kg: own(&BOILING_HEAT_KEY, base.boiling_heat_j_kg),
            young_pa: own(&YOUNG_KEY, base.young_pa),
            poisson: own(&POISSON_KEY, base.poisson),
            absorption_1_m: own(&ABSORPTION_KEY, base.absorption_1_m),
            electrical_conductivity_s_m: own(&ELECTRICAL_CONDUCTIVITY_KEY, base.electrical_conductivity_s_m),
            refractive_index: own(&REFRACTIVE_INDEX_KEY, base.refractive_index),
            extinction: own(&EXTINCTION_KEY, base.extinction),
            relative_atomic_mass: own(&ATOMIC_MASS_KEY, base.relative_atomic_mass),
        };
        if let (Some(solidus_k), Some(liquidus_k)) = (material.solidus_k, material.liquidus_k)
            && liquidus_k < solidus_k
        {
            table.reject(
                &LIQUIDUS_KEY,
                format!("expected at least the solidus, {} K, found {} K", Shown(solidus_k), Shown(liquidus_k)),
            );
        }
        if let (Some(liquidus_k), Some(boiling_k)) = (material.liquidus_k.or(material.solidus_k), material.boiling_k)
            && boiling_k <= liquidus_k
        {
            table.reject(
                &BOILING_KEY,
                format!("expected above the end of melting, {} K, found {} K", Shown(liquidus_k), Shown(boiling_k)),
            );
        }
        materials.insert(name, material);
        table.finish();
    }
    materials
}

/// The material a key names; an unknown one is reported and stands in as one without properties.
pub(crate) fn choose(
    table: &Table<'_>,
    key: &'static Key,
    materials: &BTreeMap<String, Material>,
) -> (String, Material) {
    let name = table.text(key);
    let material = materials.get(&name).cloned().unwrap_or_else(|| {
        table.reject_with(key, format!("no material is called {}", quoted(&name)), known(&name, materials));
        // All properties are there, so that nothing else is reported missing.
        let unknown = Some(f64::NAN);
        Material {
            density_kg_m3: unknown,
            heat_capacity_j_kg_k: Some(Property::constant(f64::NAN)),
            conductivity_w_m_k: Some(Property::constant(f64::NAN)),
            solidus_k: unknown,
            liquidus_k: unknown,
            melting_heat_j_kg: unknown,
            boiling_k: unknown,
            boiling_heat_j_kg: unknown,
            young_pa: unknown,
            poisson: unknown,
            absorption_1_m: unknown,
            electrical_conductivity_s_m: unknown,
            refractive_index: unknown,
            extinction: unknown,
            relative_atomic_mass: unknown,
        }
    });
    (name, material)
}

/// What to do about a name that no material has.
pub(crate) fn known(name: &str, materials: &BTreeMap<String, Material>) -> Option<String> {
    let names = || materials.keys().map(String::as_str);
    Some(match nearest(name, names()) {
        Some(near) => format!("did you mean \"{near}\"?"),
        None => format!("known are {}; others are defined in [materials.NAME]", names().collect::<Vec<_>>().join(", ")),
    })
}
