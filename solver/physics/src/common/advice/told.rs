//! What physics tell of a scene, in words that all share.

use std::f64::consts::PI;

use stagger_coupling::math;

use crate::common::{
    Conductance,
    beam::{Path, Pulses},
};

/// Share of a plane that circles of one size can cover: hexagonal packing.
const PLANE_COVER: f64 = 0.9069;

/// Bodies of one size.
#[derive(Clone, Copy, Debug)]
pub struct Body {
    /// Radius R, in m.
    pub radius_m: f64,
    /// Mass of one of them, in kg.
    pub mass_kg: f64,
    /// How many; more than one for those that are poured.
    pub number: f64,
}

/// The room that walls leave the bodies, in m.
#[derive(Clone, Copy, Debug)]
pub struct Room {
    /// Its lower corner.
    pub lower_m: [f64; 3],
    /// Its upper corner.
    pub upper_m: [f64; 3],
    /// Whether walls keep the bodies in it across gravity.
    pub confined: bool,
}

/// The contact of one of the largest bodies with a wall, where so many contacts share what presses the bodies, at a temperature
/// in K: its overlap in m and its area in m²; `None` where the press is not known before the run.
pub type Pressed = dyn Fn(f64, f64) -> Option<(f64, f64)>;

/// The bodies of a scene: where they start, and what is to be expected of their motion.
pub struct BodyFacts {
    /// All of them; empty where the scene has none.
    pub each: Vec<Body>,
    /// Where they are.
    pub room: Room,
    /// Temperature at the start, in K.
    pub temperature_k: f64,
    /// Gravity g, in m/s².
    pub gravity_m_s2: [f64; 3],
    /// Names of their materials.
    pub materials: Vec<String>,
    /// Speed that nothing exceeds under gravity, the electric field and the walls' motion, in m/s.
    pub speed_m_s: f64,
    /// Largest acceleration by gravity and the electric field, in m/s².
    pub acceleration_m_s2: f64,
    /// Duration of the shortest contact at that speed, in s; infinite where nothing moves.
    pub contact_s: f64,
    /// Step that resolves contact, damping, friction and drag, in s.
    pub substep_s: f64,
    /// How hard they are pressed.
    pub pressed: Box<Pressed>,
}

impl BodyFacts {
    /// No bodies.
    #[must_use]
    pub fn none() -> Self {
        Self {
            each: Vec::new(),
            room: Room { lower_m: [0.0; 3], upper_m: [0.0; 3], confined: false },
            temperature_k: f64::NAN,
            gravity_m_s2: [0.0; 3],
            materials: Vec::new(),
            speed_m_s: 0.0,
            acceleration_m_s2: 0.0,
            contact_s: f64::INFINITY,
            substep_s: f64::INFINITY,
            pressed: Box::new(|_, _| None),
        }
    }

    /// How many there are.
    #[must_use]
    pub fn number(&self) -> f64 {
        self.each.iter().map(|body| body.number).sum()
    }

    /// Mass of all, in kg.
    #[must_use]
    pub fn mass_kg(&self) -> f64 {
        self.each.iter().map(|body| body.number * body.mass_kg).sum()
    }

    /// Mass of the lightest, in kg.
    #[must_use]
    pub fn lightest_kg(&self) -> f64 {
        self.each.iter().map(|body| body.mass_kg).fold(f64::INFINITY, f64::min)
    }

    /// Least radius, in m.
    #[must_use]
    pub fn smallest_m(&self) -> f64 {
        self.each.iter().map(|body| body.radius_m).fold(f64::INFINITY, f64::min)
    }

    /// Largest radius, in m.
    #[must_use]
    pub fn largest_m(&self) -> f64 {
        self.each.iter().map(|body| body.radius_m).fold(0.0, f64::max)
    }

    /// Most bodies that can lie on a plane with this normal.
    #[must_use]
    pub fn on_plane(&self, normal: [f64; 3]) -> f64 {
        let area_m2: f64 = {
            let [a, b, c] = [0, 1, 2].map(|axis| self.room.upper_m[axis] - self.room.lower_m[axis]);
            normal[0].abs() * b * c + normal[1].abs() * a * c + normal[2].abs() * a * b
        };
        if !self.room.confined {
            return self.number();
        }
        (PLANE_COVER * area_m2 / (PI * math::powi(self.smallest_m(), 2))).max(1.0).min(self.number())
    }

    /// Most bodies that can lie on the floor.
    #[must_use]
    pub fn on_floor(&self) -> f64 {
        self.on_plane(self.gravity_m_s2.map(|g| f64::from(g != 0.0)))
    }

    /// What the mean position is uncertain by once bodies have met, in m: the least change grows until each lies elsewhere
    /// by about a diameter, at random, which for the mean of N is 2 R/√N. Zero for one body.
    #[must_use]
    pub fn scatter_m(&self) -> f64 {
        let number = self.number();
        let diameter_m = self.each.iter().map(|body| 2.0 * body.radius_m * body.number).sum::<f64>() / number;
        if number > 1.0 { diameter_m / number.sqrt() } else { 0.0 }
    }
}

/// What holds the heat of the bodies.
#[derive(Clone, Copy, Debug)]
pub struct HeatFacts {
    /// Temperature at the start, in K.
    pub start_k: f64,
    /// Highest temperature of a body at the start, in K.
    pub warmest_k: f64,
    /// Least heat capacity C of a material where bodies start, in J/(kg K).
    pub capacity_j_kg_k: f64,
    /// Least and greatest conductivity of a material, in W/(m K).
    pub conductivity_w_m_k: [f64; 2],
    /// How a contact conducts.
    pub conductance: Conductance,
    /// Temperature above which a body boils away, in K; infinite where none does.
    pub boiled_k: f64,
    /// Least heat from the start to vapour of a material that boils, in J/kg.
    pub to_vapour_j_kg: Option<f64>,
}

/// Light that falls on the bodies.
#[derive(Clone, Debug)]
pub struct LightFacts {
    /// Table that it is of.
    pub table: String,
    /// What it sends over the run, in J.
    pub energy_j: f64,
    /// Bound of the heat of the body that gets most, in J/kg.
    pub peak_j_kg: f64,
    /// When it comes on, in s.
    pub starts_s: f64,
    /// When it goes off, in s.
    pub ends_s: f64,
    /// How long it lights a place it passes, in s.
    pub dwell_s: f64,
    /// Length of a pulse, in s; infinite without pulses.
    pub pulse_s: f64,
    /// Irradiance in its middle, in W/m².
    pub middle_w_m2: f64,
    /// Bounds of the share of the light meeting its cross-section that a body takes, in the order of the bodies.
    pub shares: Vec<f64>,
}

/// A beam that may move or pulse, of light or of sound.
#[derive(Clone, Debug)]
pub struct BeamFacts<'s> {
    /// Table that it is of.
    pub table: String,
    /// Radius within which half of its power lies, in m.
    pub radius_m: f64,
    /// Where its axis passes.
    pub path: &'s Path,
    /// When it comes on, in s.
    pub starts_s: f64,
    /// When it goes off, in s.
    pub ends_s: f64,
    /// Its pulses.
    pub pulses: Option<Pulses>,
}
