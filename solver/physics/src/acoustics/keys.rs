//! `[acoustics]`: a beam of sound that pushes the particles.

use stagger_config::{
    key::{Key, Kind, Range, Section},
    reader::Table,
    units::{DENSITY, INTENSITY, LENGTH, NUMBER, SPEED, TIME},
};

use super::{Interface, Settings, SoundBeam, advice::ADVISOR, tradeoff::TRADEOFF};
use crate::{
    PhysicsKind, Surroundings,
    common::keys::{beam, rays},
    configured,
};

static INTENSITY_KEY: Key =
    Key::new("intensity", Kind::Number(&INTENSITY, Range::POSITIVE), "Intensity I of the sound while it is on.");
static RADIUS: Key =
    Key::new("radius", Kind::Number(&LENGTH, Range::POSITIVE), "Radius of the beam, of one intensity throughout.");
static DIRECTION: Key =
    Key::new("direction", Kind::Vector(&NUMBER), "Direction of the sound; of any length but zero.").or("[0, 0, -1]");
static PATH: Key = Key::new("path", Kind::Table(&beam::PATH_SECTION), "Where the beam's axis passes.");
static STARTS: Key = Key::new("starts", Kind::Number(&TIME, Range::NOT_NEGATIVE), "When it is switched on.").or("0");
static ENDS: Key =
    Key::new("ends", Kind::Number(&TIME, Range::NOT_NEGATIVE), "When it is switched off; after it starts.")
        .or_from("never");
static PULSES: Key = Key::new("pulses", Kind::Table(&beam::PULSES_SECTION), "Pulses.").or_from("continuous");
static FLUID_DENSITY: Key =
    Key::new("fluid-density", Kind::Number(&DENSITY, Range::POSITIVE), "Density of the fluid around the particles.")
        .or("\"1000 kg/m^3\"");
static FLUID_SPEED: Key =
    Key::new("fluid-sound-speed", Kind::Number(&SPEED, Range::POSITIVE), "Speed of sound in that fluid.")
        .or("\"1500 m/s\"");
static SOUND_SPEED: Key =
    Key::new("sound-speed", Kind::Number(&SPEED, Range::POSITIVE), "Speed of sound in the particles.");
static RAYS: Key = Key::new("rays", Kind::Table(&rays::SECTION), "Rays that sample the beam.").or_from("1000 rays");

static SECTION: Section = Section {
    path: "acoustics",
    doc: "A beam of sound in a fluid that pushes the particles, ray by ray (Zohdi 2018, ch. 11).",
    example: "[acoustics]",
    shorthand: None,
    keys: &[
        &INTENSITY_KEY,
        &RADIUS,
        &DIRECTION,
        &PATH,
        &STARTS,
        &ENDS,
        &PULSES,
        &FLUID_DENSITY,
        &FLUID_SPEED,
        &SOUND_SPEED,
        &RAYS,
    ],
};

/// Sound as a physics of a scene.
pub static KIND: PhysicsKind = PhysicsKind {
    name: "acoustics",
    computes: "the sound of [acoustics]",
    doc: "Sound.",
    absent: "does not run",
    section: &SECTION,
    rank: 1,
    bodies: None,
    read: |table, surroundings| configured(read(table, surroundings)),
    advice: Some(&ADVISOR),
    tradeoff: Some(&TRADEOFF),
    pictured: &[],
};

/// Reads the table.
fn read(table: Table<'_>, surroundings: &Surroundings<'_, '_>) -> Option<Settings> {
    let Surroundings { bodies, walls, seed, .. } = *surroundings;
    let path = beam::path(&table, &PATH);
    let (starts_s, ends_s) = beam::switched(&table, &STARTS, &ENDS);
    let interface = Interface {
        fluid_density_kg_m3: table.number(&FLUID_DENSITY),
        fluid_sound_speed_m_s: table.number(&FLUID_SPEED),
        density_kg_m3: bodies.property("density", bodies.material.1.density_kg_m3),
        sound_speed_m_s: table.number(&SOUND_SPEED),
    };
    let sampling = rays::read(&table, &RAYS, seed);
    let (intensity_w_m2, radius_m) = (table.number(&INTENSITY_KEY), table.number(&RADIUS));
    let direction = table.direction(&DIRECTION);
    let pulses = beam::pulses(&table, &PULSES);
    table.finish();
    let beam = SoundBeam { intensity_w_m2, radius_m, direction, path: path?, starts_s, ends_s, pulses };
    Some(Settings { count: bodies.count, beam, interface, sampling: sampling?, walls: rays::normals(walls) })
}
