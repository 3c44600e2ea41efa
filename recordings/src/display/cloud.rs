//! The particles of a step as Foxglove's PointCloud.

use stagger_messages::Field;

use super::{
    colour::colour,
    schema::foxglove::{PackedElementField, PointCloud, Pose, Quaternion, Vector3, packed_element_field::NumericType},
    timestamp,
};
use crate::{Step, display::colour_scale::Range};

/// Support of the particles' fields.
const PARTICLES: &str = "particles";
/// The frame's name tells the unit: viewers' cameras are made for bodies of about 1, and particles lie within millimetres.
const FRAME: &str = "millimetres";
const MM_PER_M: f64 = 1e3;
/// Bytes of a binary32 number.
const FLOAT_BYTES: usize = 4;

/// One number of each particle.
struct Column {
    name: String,
    values: Vec<f64>,
}

/// The particles at the end of a step: places in mm, radius, speed, and every scalar field on them; coloured by
/// temperature, or else by speed, over the range met so far. `None` where the step has no particles' positions.
pub(super) fn point_cloud(step: &Step, range: &mut Range) -> Option<PointCloud> {
    let positions = step.fields.get("positions").filter(|field| field.support.name == PARTICLES)?;
    let columns = columns(step, positions)?;
    let coloured = ["temperature [K]", "speed [m/s]"]
        .iter()
        .find_map(|name| columns.iter().find(|column| column.name == *name))
        .map(|column| column.values.as_slice());
    if let Some(values) = coloured {
        range.include(values);
    }
    let mut fields: Vec<PackedElementField> = Vec::new();
    let numbers = columns.iter().map(|column| (column.name.as_str(), NumericType::Float32, FLOAT_BYTES));
    let channels = ["red", "green", "blue", "alpha"].map(|name| (name, NumericType::Uint8, 1));
    let mut stride = 0;
    for (name, kind, bytes) in numbers.chain(channels.into_iter().filter(|_| coloured.is_some())) {
        fields.push(PackedElementField { name: name.into(), offset: stride as u32, r#type: kind.into() });
        stride += bytes;
    }
    let mut data = Vec::with_capacity(positions.rows() * stride);
    for row in 0..positions.rows() {
        for column in &columns {
            data.extend_from_slice(&(column.values[row] as f32).to_le_bytes());
        }
        if let Some(values) = coloured {
            data.extend_from_slice(&colour(range, values[row]));
        }
    }
    let upright = Quaternion { w: 1.0, ..Quaternion::default() };
    Some(PointCloud {
        timestamp: Some(timestamp(step.t_s)),
        frame_id: FRAME.into(),
        pose: Some(Pose { position: Some(Vector3::default()), orientation: Some(upright) }),
        point_stride: stride as u32,
        fields,
        data,
    })
}

/// Numbers of the particles, each as long as there are particles.
fn columns(step: &Step, positions: &Field) -> Option<Vec<Column>> {
    let places = positions.f64().ok().filter(|_| positions.components() == 3)?;
    let mut columns: Vec<Column> = ["x", "y", "z"]
        .iter()
        .enumerate()
        .map(|(axis, name)| Column {
            name: (*name).into(),
            values: places.iter().skip(axis).step_by(3).map(|metres| MM_PER_M * metres).collect(),
        })
        .collect();
    // A field that stands on other rows says nothing about these particles.
    for (name, field) in step.fields.iter().filter(|(_, field)| field.support == positions.support) {
        let Ok(values) = field.f64() else { continue };
        match (name.as_str(), field.components()) {
            ("radii", 1) => {
                let values = values.iter().map(|metres| MM_PER_M * metres).collect();
                columns.push(Column { name: "radius [mm]".into(), values });
            }
            ("velocities", 3) => {
                let speed = |v: &[f64]| v.iter().map(|component| component * component).sum::<f64>().sqrt();
                columns
                    .push(Column { name: "speed [m/s]".into(), values: values.chunks_exact(3).map(speed).collect() });
            }
            (_, 1) => {
                let name = format!("{name} [{}]", field.port.unit);
                columns.push(Column { name, values: values.to_vec() });
            }
            _ => {}
        }
    }
    Some(columns)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use stagger_messages::{Measure, Port, Version};

    use super::*;

    fn field(name: &str, components: u32, revision: u64, values: &[f64]) -> (String, Field) {
        let port = Arc::new(Port::f64(name, "K", PARTICLES, components, Measure::None));
        (name.into(), Field::new(&port, revision, values.to_vec()).unwrap())
    }

    #[test]
    fn points_hold_millimetres_and_every_scalar_on_the_same_rows() {
        let fields = [
            field("positions", 3, 4, &[1e-3, -2e-3, 3e-3, 0.0, 0.0, 5e-3]),
            field("temperature", 1, 4, &[300.0, 400.0]),
            field("velocities", 3, 4, &[3.0, 0.0, 4.0, 0.0, 0.0, 0.0]),
            // Another revision: these are not the same particles.
            field("absorbed_power", 1, 3, &[1.0, 2.0]),
        ];
        let step = Step { version: Version::first(1), t_s: 1.25, dt_s: 1e-6, fields: fields.into(), recorded: true };
        let cloud = point_cloud(&step, &mut Range::EMPTY.clone()).unwrap();
        let names: Vec<&str> = cloud.fields.iter().map(|field| field.name.as_str()).collect();
        assert_eq!(names, ["x", "y", "z", "temperature [K]", "speed [m/s]", "red", "green", "blue", "alpha"]);
        assert_eq!(
            cloud.fields.iter().map(|field| field.offset).collect::<Vec<_>>(),
            [0, 4, 8, 12, 16, 20, 21, 22, 23]
        );
        assert_eq!((cloud.point_stride, cloud.data.len()), (24, 48));
        let numbers = |row: usize| -> Vec<f32> {
            let point = &cloud.data[24 * row..24 * row + 20];
            point.chunks_exact(4).map(|bytes| f32::from_le_bytes(bytes.try_into().unwrap())).collect()
        };
        assert_eq!(numbers(0), [1.0, -2.0, 3.0, 300.0, 5.0]);
        assert_eq!(numbers(1), [0.0, 0.0, 5.0, 400.0, 0.0]);
        assert_eq!(cloud.data[20..24], [59, 76, 192, 255], "the coldest is blue");
        assert_eq!(cloud.data[44..48], [180, 4, 38, 255], "the hottest is red");
        let time = cloud.timestamp.unwrap();
        assert_eq!((time.seconds, time.nanos), (1, 250_000_000));
    }

    #[test]
    fn without_particles_there_is_no_cloud() {
        let step = Step { version: Version::INITIAL, t_s: 0.0, dt_s: 0.0, fields: [].into(), recorded: true };
        assert!(point_cloud(&step, &mut Range::EMPTY.clone()).is_none());
    }
}
