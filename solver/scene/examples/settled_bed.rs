//! A bed of equal spheres, for the benchmark beside other programs (`tests/peers/dem.sh`) and for many particles alone.
//!
//! `settled_bed FILE|lattice:COUNT WIDTH HEIGHT STEPS THREADS [heat [EVERY]]`: FILE has x y z vx vy vz a line, in SI units;
//! `lattice:COUNT` lets that many drop from a loose lattice instead, in a box of its own width. Hertz contact, restitution 0.5,
//! friction 0.5 with a tangential spring (Mindlin), d = 1 mm, 2500 kg/m³, E = 10 MPa, ν = 0.3, Δt = 5 µs, gravity, floor and
//! four side walls. With `heat`, contacts conduct: 100 W/(m K), 500 J/(kg K), solved at the end of every window of EVERY steps.

use std::{error::Error, io::Write as _, process::ExitCode};

use bed::{DENSITY_KG_M3, HERTZ, RADIUS_M, SPRING};
use stagger_coupling::{Frozen, Physics, Window, math};
use stagger_messages::Fields;
use stagger_physics::{
    particles::{Group, Particles, Radius, Start},
    thermal::{self, Conductance, Overshoot, Thermal},
};

#[path = "../../physics/benches/bed/mod.rs"]
mod bed;

const STEP_S: f64 = 5e-6;
/// Steps a window where the command does not say: what the particles keep to themselves before anybody else may look.
const STEPS_PER_WINDOW: u64 = 100;

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            // Nothing is left to be told where standard error is closed.
            let _ = writeln!(std::io::stderr(), "error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// What the command asks for.
struct Case {
    start: Start,
    width_m: f64,
    /// Heights of the particles at the start, in m; empty where a lattice makes them.
    heights_m: Vec<f64>,
    steps: u64,
    steps_per_window: u64,
    heat: bool,
}

fn run() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [from, width, height, steps, threads, rest @ ..] = arguments.as_slice() else {
        return Err("expected FILE|lattice:COUNT WIDTH HEIGHT STEPS THREADS [heat [EVERY]]".into());
    };
    let (width_m, _height): (f64, f64) = (width.parse()?, height.parse()?);
    let (steps, threads): (u64, usize) = (steps.parse()?, threads.parse()?);
    let heat = rest.first().is_some_and(|word| word == "heat");
    let steps_per_window = rest.get(1).map_or(Ok(STEPS_PER_WINDOW), |every| every.parse())?;
    if steps_per_window == 0 {
        return Err("EVERY: expected at least 1 step, found 0".into());
    }
    let case = match from.strip_prefix("lattice:") {
        Some(_) if heat => return Err("heat needs a FILE, whose lowest 3 mm are hot".into()),
        Some(count) => {
            let count: usize = count.parse()?;
            let (start, width_m) = bed::loose(count);
            Case { start, width_m, heights_m: vec![f64::INFINITY; count], steps, steps_per_window, heat }
        }
        None => {
            let rows = rows(from)?;
            let part = |k: usize| rows.iter().map(|row| [row[k], row[k + 1], row[k + 2]]).collect();
            let heights_m = rows.iter().map(|row| row[2]).collect();
            Case { start: bed::given(part(0), part(3)), width_m, heights_m, steps, steps_per_window, heat }
        }
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
    pool.install(|| simulate(case)).map_err(|error| error as Box<dyn Error>)
}

fn rows(file: &str) -> Result<Vec<[f64; 6]>, Box<dyn Error>> {
    let text = std::fs::read_to_string(file).map_err(|error| format!("{file}: {error}"))?;
    let mut rows = Vec::new();
    for line in text.lines() {
        let row: Vec<f64> = line.split_whitespace().map(str::parse).collect::<Result<_, _>>()?;
        rows.push(<[f64; 6]>::try_from(row.as_slice()).map_err(|_| format!("{file}: expected six numbers: {line}"))?);
    }
    Ok(rows)
}

fn simulate(case: Case) -> Result<(), Box<dyn Error + Send + Sync>> {
    let Case { start, width_m, heights_m, steps, steps_per_window, heat } = case;
    let count = heights_m.len();
    let mut settings = bed::settings(start, width_m, HERTZ, Some(SPRING), STEP_S);
    if !matches!(settings.start, Start::Given { .. }) {
        let radius = Radius::Uniform { mean_m: RADIUS_M, spread_m: 0.0 };
        settings.groups = vec![Group { name: "particles".into(), count, radius, material: 0 }];
    }
    let particles = Particles::new(settings)?;
    let (mut state, mut reply) = particles.initial()?;
    let thermal = Thermal::new(thermal::Settings {
        count,
        density_kg_m3: DENSITY_KG_M3,
        heat_capacity_j_kg_k: 500.0,
        conductivity_w_m_k: 100.0,
        temperature_k: 300.0,
        walls: bed::walls(width_m),
        conductance: Conductance::Constriction,
        phi: 0.5,
        solid: None,
        overshoot: Overshoot::Implicit,
        start: None,
        tolerance: 1e-8,
        iterations: 100,
        enthalpy: None,
        pour_temperature_k: None,
    })?;
    // As in the peers' case: the lowest 3 mm are hot.
    let hot = heights_m.iter().map(|&height_m| if height_m < 0.003 { 1000.0 } else { 300.0 }).collect();
    let mut temperatures = thermal.state(hot)?;
    let mut done = 0;
    while done < steps {
        let now = steps_per_window.min(steps - done);
        let window = Window { t_s: done as f64 * STEP_S, dt_s: now as f64 * STEP_S };
        let (next, answer) = particles.solve(&state, &Frozen::default(), window)?;
        if answer.not_converged.is_some() {
            return Err(format!("step {done} did not converge").into());
        }
        if heat {
            let frozen = Frozen { start: reply.fields, end: answer.fields.clone() };
            let (warmer, answer) = thermal.solve(&temperatures, &frozen, window)?;
            if answer.not_converged.is_some() {
                return Err(format!("the heat of step {done} did not converge").into());
            }
            temperatures = warmer;
        }
        (state, reply) = (next, answer);
        done += now;
    }
    report(&reply.fields)
}

/// Results, so that what was computed can be compared.
fn report(fields: &Fields) -> Result<(), Box<dyn Error + Send + Sync>> {
    let (positions, velocities) = (fields["positions"].f64()?, fields["velocities"].f64()?);
    let mass_kg = 4.0 / 3.0 * std::f64::consts::PI * math::powi(RADIUS_M, 3) * DENSITY_KG_M3;
    let kinetic_j: f64 = velocities.iter().map(|v| 0.5 * mass_kg * v * v).sum();
    let height_m: f64 = positions.iter().skip(2).step_by(3).sum::<f64>() / (positions.len() / 3) as f64;
    let contacts = fields["contact_pairs"].rows();
    writeln!(
        std::io::stdout(),
        "kinetic energy {kinetic_j:.6e} J, mean height {height_m:.9} m, {contacts} contacts, hash {:016x}",
        stagger_messages::codec::hash(fields["positions"].values().bytes())
    )?;
    Ok(())
}
