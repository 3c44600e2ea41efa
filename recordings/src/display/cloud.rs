//! The points of a support at the end of a step as Foxglove's PointCloud.

use stagger_messages::{Field, Grid, Points, geometry::Shape};
use stagger_scene::built_in::Pictured;

use super::{
    colour::colour,
    quantities::{norms, shared},
    schema::foxglove::{PackedElementField, PointCloud, Pose, Quaternion, Vector3, packed_element_field::NumericType},
    timestamp,
};
use crate::{Step, display::colour_scale::Range};

/// Values of a grid that are shown, at most; of more, those of its three middle planes.
const GRID_POINTS: usize = 50_000;
/// The frame's name tells the unit: viewers' cameras are made for bodies of about 1, and particles lie within millimetres.
const FRAME: &str = "millimetres";
const MM_PER_M: f64 = 1e3;
const AXES: [&str; 3] = ["x", "y", "z"];
const RADIUS: &str = "radius [mm]";
const SPEED: &str = "speed [m/s]";
/// Bytes of a binary32 number.
const FLOAT_BYTES: usize = 4;

/// One number of each point.
struct Column {
    name: String,
    values: Vec<f64>,
}

/// The points of a support at the end of a step: places in mm, radius, speed, and every scalar field on them; coloured by what
/// the physics name first, or else by the first scalar, over the range met so far. `None` where the rows have no places.
pub(super) fn point_cloud(step: &Step, support: &str, shape: &Shape, range: &mut Range) -> Option<PointCloud> {
    let columns = match shape {
        Shape::Points(points) => points_columns(step, points)?,
        Shape::Grid(grid) => grid_columns(step, support, grid)?,
        Shape::Pairs(_) | Shape::Global(_) => return None,
    };
    let rows = columns.first().map_or(0, |column| column.values.len());
    let of_field = |pictured: &Pictured| {
        let field = &step.fields[pictured.field];
        let name = if field.components() == 1 { scalar(pictured.field, field) } else { SPEED.into() };
        columns.iter().find(|column| column.name == name)
    };
    let named = shared(|name| step.fields.get(name).is_some_and(|field| field.port.support == support));
    let first = || columns.iter().skip(AXES.len()).find(|column| column.name != RADIUS);
    let coloured = named.and_then(of_field).or_else(first);
    let coloured = coloured.map(|column| column.values.as_slice());
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
    let mut data = Vec::with_capacity(rows * stride);
    for row in 0..rows {
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

/// Name of the column of a scalar field.
fn scalar(name: &str, field: &Field) -> String {
    format!("{name} [{}]", field.port.unit)
}

/// Columns of places, in mm.
fn places(at: impl Fn(usize) -> Vec<f64>) -> Vec<Column> {
    AXES.iter().enumerate().map(|(axis, name)| Column { name: (*name).into(), values: at(axis) }).collect()
}

/// Numbers of the points, each as long as there are points; `None` where the rows are no single points.
fn points_columns(step: &Step, points: &Points) -> Option<Vec<Column>> {
    let (positions, of_one) = points.places(&step.fields).ok()?;
    let metres = positions.f64().ok().filter(|_| of_one == 1)?;
    let mut columns = places(|axis| metres.iter().skip(axis).step_by(3).map(|metres| MM_PER_M * metres).collect());
    // A field that stands on other rows says nothing about these points.
    for (name, field) in step.fields.iter().filter(|(_, field)| field.support == positions.support) {
        let Ok(values) = field.f64() else { continue };
        match (field.components(), field.port.unit.as_str()) {
            (1, _) if *name == points.radii => {
                let values = values.iter().map(|metres| MM_PER_M * metres).collect();
                columns.push(Column { name: RADIUS.into(), values });
            }
            (3, "m/s") => {
                columns.push(Column { name: SPEED.into(), values: norms(values.as_chunks::<3>().0).collect() });
            }
            (1, _) => columns.push(Column { name: scalar(name, field), values: values.to_vec() }),
            _ => {}
        }
    }
    Some(columns)
}

/// Numbers of a grid's values, or of those in its middle planes where there are too many; `None` where it has no layout.
fn grid_columns(step: &Step, support: &str, grid: &Grid) -> Option<Vec<Column>> {
    let (.., dims) = grid.layout()?;
    let rows = grid.rows();
    let index = |row: usize| [row % dims[0], row / dims[0] % dims[1], row / (dims[0] * dims[1])];
    let in_a_middle = |row: &usize| (0..AXES.len()).any(|axis| index(*row)[axis] == dims[axis] / 2);
    let kept: Vec<usize> = (0..rows).filter(|row| rows <= GRID_POINTS || in_a_middle(row)).collect();
    let at = |axis: usize, row: usize| grid.point_m(index(row)).map_or(f64::NAN, |point| MM_PER_M * point[axis]);
    let mut columns = places(|axis| kept.iter().map(|row| at(axis, *row)).collect());
    for (name, field) in step.fields.iter().filter(|(_, field)| field.port.support == support) {
        if let (Ok(values), 1) = (field.f64(), field.components()) {
            let values = kept.iter().filter_map(|row| values.get(*row).copied()).collect();
            columns.push(Column { name: scalar(name, field), values });
        }
    }
    Some(columns)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use stagger_messages::{Field, Fields, Geometry, Measure, Port, Ports, Supports, Version};

    use super::*;

    fn field(name: &str, components: u32, revision: u64, values: &[f64]) -> (String, Field) {
        let port = Arc::new(Port::f64(
            name,
            if name == "velocities" { "m/s" } else { "K" },
            "particles",
            components,
            Measure::None,
        ));
        (name.into(), Field::new(&port, revision, values.to_vec()).unwrap())
    }

    fn step(fields: Fields, supports: Supports) -> Step {
        Step { version: Version::first(1), t_s: 1.25, dt_s: 1e-6, fields, supports, recorded: true }
    }

    fn of(step: &Step, support: &str) -> Option<PointCloud> {
        point_cloud(step, support, &step.supports.shape(support, &step.fields), &mut Range::EMPTY.clone())
    }

    #[test]
    fn a_grid_is_shown_at_its_values_or_in_its_middle_planes() {
        for (dims, shown) in [([4, 3, 2], 24), ([100, 100, 10], 100 * 100 + 2 * 1000 - 2 * 100 - 10 + 1)] {
            let grid = Grid::of_cells([0.0; 3], [1e-3, 2e-3, 4e-3], dims);
            let port = Arc::new(Port::f64("w", "K", "cells", 1, Measure::None));
            let values: Vec<f64> = (0..grid.rows()).map(|row| row as f64).collect();
            let fields = Fields::from([("w".to_owned(), Field::new(&port, 0, values).unwrap())]);
            let ports = Ports::new(Vec::new(), Vec::new()).with(Geometry::grid("cells", grid));
            let cloud = of(&step(fields, Supports::of([&ports])), "cells").unwrap();
            assert_eq!(cloud.data.len() / cloud.point_stride as usize, shown);
            if dims[0] == 4 {
                let last = &cloud.data[23 * 20..24 * 20 - 4];
                let numbers = last.chunks_exact(4).map(|bytes| f32::from_le_bytes(bytes.try_into().unwrap()));
                assert_eq!(numbers.collect::<Vec<_>>(), [3.5, 5.0, 6.0, 23.0]);
            }
        }
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
        let cloud = of(&step(fields.into(), Supports::default()), "particles").unwrap();
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
        assert!(of(&step(Fields::new(), Supports::default()), "particles").is_none());
    }
}
