//! Stress in the substrate (Zohdi 2018, ch. 9): point loads and loads spread over discs against closed forms and against each
//! other, equilibrium, sums over many loads, and what the node reads, writes and gives back to the particles.

mod deflection;
mod disc;
mod many;
mod node;
mod point;

use stagger_physics::substrate::{Load, stress_at};

type Tensor = [f64; 6];

/// A radius so small that everywhere is far: a point load.
const POINT_M: f64 = 1e-6;

fn load(normal_n: f64, tangential_n: [f64; 2], radius_m: f64) -> Load {
    Load { x_m: 0.0, y_m: 0.0, normal_n, tangential_n, radius_m }
}

fn norm([xx, yy, zz, xy, yz, zx]: Tensor) -> f64 {
    (xx * xx + yy * yy + zz * zz + 2.0 * (xy * xy + yz * yz + zx * zx)).sqrt()
}

fn difference(a: Tensor, b: Tensor) -> f64 {
    norm(std::array::from_fn(|k| a[k] - b[k]))
}

/// Divergence of the stress by central differences of step h, over ‖σ‖.
fn divergence(poisson: f64, loads: &[Load], at: [f64; 3], h: f64) -> f64 {
    let shifted = |axis: usize, step: f64| {
        let mut point = at;
        point[axis] += step;
        stress_at(poisson, loads, point)
    };
    let slope: [Tensor; 3] = std::array::from_fn(|axis| {
        let (upper, lower) = (shifted(axis, h), shifted(axis, -h));
        std::array::from_fn(|k| (upper[k] - lower[k]) / (2.0 * h))
    });
    let x = slope[0][0] + slope[1][3] + slope[2][5];
    let y = slope[0][3] + slope[1][1] + slope[2][4];
    let z = slope[0][5] + slope[1][4] + slope[2][2];
    (x * x + y * y + z * z).sqrt() / norm(stress_at(poisson, loads, at))
}

/// ∫ of the stress over the plane at depth z, in N: sums over angles, which are exact for the harmonics of one load, and the
/// midpoint rule in θ with ρ = z tan θ.
fn plane_integral(poisson: f64, loads: &[Load], z: f64) -> Tensor {
    let (turns, rings) = (8, 20_000);
    let mut sum = [0.0; 6];
    for ring in 0..rings {
        let theta = (f64::from(ring) + 0.5) / f64::from(rings) * std::f64::consts::FRAC_PI_2;
        let rho = z * theta.tan();
        let area = rho * z / theta.cos().powi(2) * std::f64::consts::FRAC_PI_2 / f64::from(rings);
        for turn in 0..turns {
            let angle = std::f64::consts::TAU * (f64::from(turn) + 0.5) / f64::from(turns);
            let stress = stress_at(poisson, loads, [rho * angle.cos(), rho * angle.sin(), z]);
            let share = area * std::f64::consts::TAU / f64::from(turns);
            sum.iter_mut().zip(stress).for_each(|(sum, value)| *sum += share * value);
        }
    }
    sum
}
