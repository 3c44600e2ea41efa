//! The squeezed pair as one system of ordinary differential equations, written down anew.

/// Radius, in m.
pub const RADIUS: f64 = 1.0;
/// Distance of the walls, in m: less than two diameters, so that every contact stays closed.
pub const GAP: f64 = 3.9;
/// Density, in kg/m³.
pub const DENSITY: f64 = 0.25;
/// Stiffness K_p0, in Pa.
pub const STIFFNESS: f64 = 400.0;
/// Softening rate a_θ and reference temperature, in K.
pub const SOFTENING: (f64, f64) = (3.0, 300.0);
/// Conductivity, in W/(m K), and heat capacity, in J/(kg K).
pub const HEAT: (f64, f64) = (2.0, 1.0);
/// Temperature of the lower and the upper wall, in K.
pub const WALLS: [f64; 2] = [280.0, 420.0];
/// Positions and velocities along the axis and temperatures at t = 0.
pub const START: State = [0.92, 2.9, 0.0, 0.15, 300.0, 300.0];

/// x1, x2, v1, v2, θ1, θ2.
pub type State = [f64; 6];

fn stiffness(temperature: f64) -> f64 {
    STIFFNESS * (-SOFTENING.0 * (temperature / SOFTENING.1 - 1.0)).exp()
}

/// Area of the lens between two spheres at distance d, and of the cap a plane cuts at depth δ.
fn areas(d: f64, depth: [f64; 2]) -> (f64, [f64; 2]) {
    let pi = std::f64::consts::PI;
    (pi * (RADIUS * RADIUS - d * d / 4.0), depth.map(|depth| pi * (RADIUS * RADIUS - (RADIUS - depth).powi(2))))
}

/// The right-hand side.
pub fn rate(state: &State) -> State {
    let [x1, x2, v1, v2, t1, t2] = *state;
    let mass = DENSITY * 4.0 / 3.0 * std::f64::consts::PI * RADIUS.powi(3);
    let d = x2 - x1;
    let to_wall = [x1, GAP - x2];
    let depth = to_wall.map(|distance| RADIUS - distance);
    let (lens, caps) = areas(d, depth);
    let pair = 0.5 * (stiffness(t1) + stiffness(t2)) * ((2.0 * RADIUS - d) / (2.0 * RADIUS)).powi(2) * lens;
    let wall = |index: usize, temperature| stiffness(temperature) * (depth[index] / RADIUS).powi(2) * caps[index];
    let flow = HEAT.0 * lens / d * (t2 - t1);
    let in_flow = |index: usize, t: f64| HEAT.0 * caps[index] / to_wall[index] * (WALLS[index] - t);
    [
        v1,
        v2,
        (wall(0, t1) - pair) / mass,
        (pair - wall(1, t2)) / mass,
        (flow + in_flow(0, t1)) / (mass * HEAT.1),
        (in_flow(1, t2) - flow) / (mass * HEAT.1),
    ]
}

/// The trapezoidal rule with weight `phi` for all unknowns at once, iterated until nothing changes, in `steps` windows.
///
/// Position follows Zohdi 2018, eq. 6.24, which is the trapezoidal rule for position with the new velocity in it.
pub fn trapezoidal(phi: f64, duration_s: f64, steps: usize) -> State {
    let dt = duration_s / steps as f64;
    let mut state = START;
    for _ in 0..steps {
        let old = rate(&state);
        let mut next = state;
        for _ in 0..10_000 {
            let new = rate(&next);
            let improved: State = std::array::from_fn(|i| state[i] + dt * (phi * new[i] + (1.0 - phi) * old[i]));
            let change = (0..6).map(|i| (improved[i] - next[i]).abs() / improved[i].abs().max(1.0)).fold(0.0, f64::max);
            next = improved;
            // A few units in the last place: the iteration cannot do better.
            if change < 1e-15 {
                break;
            }
        }
        state = next;
    }
    state
}

/// Runge and Kutta's fourth-order rule: the solution the orders are measured against.
pub fn reference(duration_s: f64, steps: usize) -> State {
    let dt = duration_s / steps as f64;
    let mut state = START;
    for _ in 0..steps {
        let ahead = |slope: &State, share: f64| -> State { std::array::from_fn(|i| state[i] + share * dt * slope[i]) };
        let k1 = rate(&state);
        let k2 = rate(&ahead(&k1, 0.5));
        let k3 = rate(&ahead(&k2, 0.5));
        let k4 = rate(&ahead(&k3, 1.0));
        state = std::array::from_fn(|i| state[i] + dt / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]));
    }
    state
}
