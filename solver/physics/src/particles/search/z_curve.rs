//! The order of the particles in memory: along a Z curve (Morton 1966).

use crate::common::Vec3;

/// Cell in m that the memory is sorted by: the mean diameter.
pub fn cell(radii: &[f64]) -> f64 {
    if radii.is_empty() { 1.0 } else { 2.0 * radii.iter().sum::<f64>() / radii.len() as f64 }
}

/// The order in which particles lie along a Z curve (Morton 1966) through cells of size `cell_m`; ties as they are.
///
/// Neighbours in space are then mostly neighbours in memory.
pub fn along_z_curve(positions: &[Vec3], cell_m: f64) -> Vec<u32> {
    let lower = positions.iter().fold(Vec3::repeat(f64::INFINITY), |lower, position| lower.inf(position));
    let code = |position: &Vec3| {
        // A cast saturates, and takes what is not a number for zero.
        let [x, y, z] =
            <[f64; 3]>::from((position - lower) / cell_m).map(|cells| spread(cells.clamp(0.0, CELLS) as u64));
        x | y << 1 | z << 2
    };
    let mut keys: Vec<(u64, u32)> = (0u32..).zip(positions).map(|(i, position)| (code(position), i)).collect();
    keys.sort_unstable();
    keys.into_iter().map(|(_, i)| i).collect()
}

/// The lower 21 bits of `x`, two zero bits after each.
fn spread(x: u64) -> u64 {
    let mut x = x & 0x1F_FFFF;
    for (shift, mask) in [
        (32, 0x1F_0000_0000_FFFF),
        (16, 0x1F_0000_FF00_00FF),
        (8, 0x100F_00F0_0F00_F00F),
        (4, 0x10C3_0C30_C30C_30C3),
        (2, 0x1249_2492_4924_9249),
    ] {
        x = (x | x << shift) & mask;
    }
    x
}

/// Cells an axis that a position is sorted into; farther ones share the last.
const CELLS: f64 = (1u64 << 21) as f64 - 1.0;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_visits_a_cube_octant_by_octant() {
        let corner = |i: u32| Vec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2 & 1));
        let positions: Vec<Vec3> = (0..8).rev().map(corner).collect();
        assert_eq!(along_z_curve(&positions, 1.0), [7, 6, 5, 4, 3, 2, 1, 0]);
        assert_eq!(along_z_curve(&positions, 10.0), [0, 1, 2, 3, 4, 5, 6, 7], "one cell keeps the order");
        assert_eq!(spread(0x1F_FFFF), 0x1249_2492_4924_9249);
    }
}
