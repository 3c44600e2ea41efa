//! What other physics do to the particles during a window: their frozen fields, in memory order.

use stagger_coupling::{Frozen, SolveError, Window};
use stagger_messages::Field;

use crate::{
    common::{Vec3, rows::by_ids},
    particles::model::{
        Model,
        ports::{PUSH, TEMPERATURE},
        state::State,
    },
};

/// What other physics do during a window.
#[derive(Default)]
pub struct ExternalFields {
    /// Temperatures; `None` where they change nothing, or nobody writes them.
    pub heat: Option<Heat>,
    /// The push of sound on each particle, in N; `None` where nobody writes one.
    pub push: Option<Vec<Vec3>>,
    /// How far the surface of the wall that gives way has sunk under each at the window's end, in m, and the window's
    /// length in s.
    pub sunk_m: Option<(Vec<f64>, f64)>,
}

/// Frozen temperatures of the particles at the window's start and end, in K.
pub struct Heat {
    pub start_k: Vec<f64>,
    pub end_k: Vec<f64>,
}

/// The frozen fields on the particles of `now`.
///
/// The push is the mean over the window that its writer gives: it acts unchanged from the window's start to its end.
pub fn external_fields(
    model: &Model,
    (frozen, window): (&Frozen, Window),
    now: &State,
) -> Result<ExternalFields, SolveError> {
    let mut external = ExternalFields::default();
    if model.settings.contact.softening_rate > 0.0
        && let (Some(start), Some(end)) = (frozen.start.get(TEMPERATURE), frozen.end.get(TEMPERATURE))
    {
        let read = |field: &Field| {
            let [temperatures_k] = carried(field, now, [model.settings.temperature_k])?;
            Ok::<_, SolveError>(temperatures_k)
        };
        external.heat = Some(Heat { start_k: read(start)?, end_k: read(end)? });
    }
    if let Some(push) = frozen.end.get(PUSH) {
        let [x, y, z] = carried(push, now, [0.0; 3])?;
        external.push = Some((0..x.len()).map(|i| Vec3::new(x[i], y[i], z[i])).collect());
    }
    if model.sinking_wall().is_some() {
        let [sunk_m] = carried(frozen.at_end("wall_deflection")?, now, [0.0])?;
        external.sunk_m = Some((sunk_m, window.dt_s));
    }
    Ok(external)
}

/// The components of a field that another physics writes, each in memory order.
///
/// What was written before particles came or went follows them by their numbers; new ones take `default`.
fn carried<const N: usize>(field: &Field, now: &State, default: [f64; N]) -> Result<[Vec<f64>; N], SolveError> {
    let values = field.f64()?;
    if let Some(at) = field.first_not_finite() {
        let (node, name) = ("particles".into(), field.name().into());
        return Err(SolveError::NotFinite { node, field: name, row: at / N, value: values[at] });
    }
    let support = &field.support;
    let ids = now.bodies.in_rows(&now.bodies.ids);
    let known = now.id_map.ids_at(support.revision, &ids);
    let then: Option<Vec<u32>> = known.filter(|then| then.len() as u64 == support.count);
    let Some(then) = then else {
        return Err(SolveError::Mismatch(format!(
            "particles: field `{}` has {} rows at revision {}, but there are {} particles at revision {}",
            field.name(),
            support.count,
            support.revision,
            now.bodies.len(),
            now.id_map.revision
        )));
    };
    let mut components = [(); N].map(|()| Vec::new());
    for (axis, component) in components.iter_mut().enumerate() {
        let values: Vec<f64> = values.chunks_exact(N).map(|row| row[axis]).collect();
        *component = now.bodies.in_memory(&if support.revision == now.id_map.revision {
            values
        } else {
            by_ids(&values, &then, &ids, default[axis])?
        });
    }
    Ok(components)
}

/// Moduli at the share `fraction` of the window, the temperature running linearly.
pub fn soften(model: &Model, heat: &Heat, materials: &[u16], fraction: f64, moduli: &mut [f64]) {
    let temperatures = heat.start_k.iter().zip(&heat.end_k);
    for ((modulus, &material), (start, end)) in moduli.iter_mut().zip(materials).zip(temperatures) {
        *modulus = model.modulus(material, start + fraction * (end - start));
    }
}
