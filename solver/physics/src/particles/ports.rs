//! Fields that the particles' motion reads and writes, from its settings alone.

use stagger_messages::{Measure, Port, Ports};

use super::{Settings, contact_list::ContactPorts, on_substrate::WallLoadPorts};

/// The ports of particles with these settings.
pub(super) fn ports(settings: &Settings) -> Ports {
    let of = |name, unit, components, measure| Port::f64(name, unit, "particles", components, measure);
    let loads = WallLoadPorts::new();

    let mut reads = Vec::new();
    reads.extend(settings.reads_temperature.then(|| of("temperature", "K", 1, Measure::None)));
    let deflects = settings.substrate.is_some_and(|under| under.deflects);
    reads.extend(deflects.then(|| (*loads.deflection).clone()));
    let push = || of("acoustic_force", "N", 3, Measure::None).as_sum();
    reads.extend(settings.fields.reads_acoustic_force.then(push));
    reads.extend(settings.reads_vapourised.then(|| Port::u8("vapourised", "particles", 1)));

    let mut writes = vec![
        of("positions", "m", 3, Measure::Increment),
        of("velocities", "m/s", 3, Measure::None),
        of("radii", "m", 1, Measure::None),
    ];
    for (prefix, support) in [("contact", "contacts"), ("wall_contact", "wall-contacts")] {
        let lists = ContactPorts::new(prefix, support, settings.writes_contact_forces);
        writes.extend(lists.all().map(|port| (**port).clone()));
    }
    if settings.substrate.is_some() {
        writes.extend(loads.written().map(|port| (**port).clone()));
    }
    writes.extend(settings.come_and_go().then(|| Port::u32("ids", "particles", 1)));
    writes.extend(settings.writes_material.then(|| Port::u32("material", "particles", 1)));
    Ports { reads, writes }
}
