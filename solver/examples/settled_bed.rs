//! A settled bed of equal spheres, for the benchmark beside other programs (`tests/peers/dem.sh`).
//!
//! `settled_bed FILE WIDTH HEIGHT STEPS THREADS [heat]`: FILE has x y z vx vy vz a line, in SI units. Hertz contact, restitution 0.5,
//! friction 0.5 with a tangential spring (Mindlin), d = 1 mm, 2500 kg/m³, E = 10 MPa, ν = 0.3, Δt = 5 µs, gravity, floor and
//! four side walls. With `heat`, contacts conduct: 100 W/(m K), 500 J/(kg K), solved at the end of every window.

use std::{error::Error, io::Write as _, process::ExitCode};

use stagger_messages::Fields;
use stagger_solver::{
    coupling::{Frozen, Physics, Window},
    physics::{
        Shape, Wall,
        particles::{Contact, ContactLaw, FieldForces, Friction, Integrator, Material, Particles, Settings, Start},
        thermal::{self, Conductance, Thermal},
    },
};

const STEP_S: f64 = 5e-6;
/// Steps a window: what the particles keep to themselves before anybody else may look.
const STEPS_PER_WINDOW: u64 = 100;
const RADIUS_M: f64 = 0.5e-3;

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

fn run() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [file, width, height, steps, threads, rest @ ..] = arguments.as_slice() else {
        return Err("expected FILE WIDTH HEIGHT STEPS THREADS [heat]".into());
    };
    let (width, _height): (f64, f64) = (width.parse()?, height.parse()?);
    let (steps, threads): (u64, usize) = (steps.parse()?, threads.parse()?);
    let heat = rest.first().is_some_and(|word| word == "heat");
    let text = std::fs::read_to_string(file).map_err(|error| format!("{file}: {error}"))?;
    let mut rows = Vec::new();
    for line in text.lines() {
        let row: Vec<f64> = line.split_whitespace().map(str::parse).collect::<Result<_, _>>()?;
        rows.push(<[f64; 6]>::try_from(row.as_slice()).map_err(|_| format!("{file}: expected six numbers: {line}"))?);
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
    pool.install(|| simulate(&rows, width, steps, heat)).map_err(|error| error as Box<dyn Error>)
}

fn simulate(rows: &[[f64; 6]], width_m: f64, steps: u64, heat: bool) -> Result<(), Box<dyn Error + Send + Sync>> {
    let walls = walls(width_m);
    let particles = Particles::new(bed(rows, walls.clone()))?;
    let (mut state, mut reply) = particles.initial()?;
    let thermal = Thermal::new(thermal::Settings {
        count: rows.len(),
        density_kg_m3: 2500.0,
        heat_capacity_j_kg_k: 500.0,
        conductivity_w_m_k: 100.0,
        temperature_k: 300.0,
        walls,
        conductance: Conductance::Constriction,
        phi: 0.5,
        tolerance: 1e-8,
        iterations: 100,
        reads_absorbed_power: false,
        pour_temperature_k: None,
        reads_ids: false,
    })?;
    // As in the peers' case: the lowest 3 mm are hot.
    let hot = rows.iter().map(|row| if row[2] < 0.003 { 1000.0 } else { 300.0 }).collect();
    let mut temperatures = thermal.state(hot)?;
    let mut done = 0;
    while done < steps {
        let now = STEPS_PER_WINDOW.min(steps - done);
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
    let mass_kg = 4.0 / 3.0 * std::f64::consts::PI * RADIUS_M.powi(3) * 2500.0;
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

fn bed(rows: &[[f64; 6]], walls: Vec<Wall>) -> Settings {
    Settings {
        groups: Vec::new(),
        materials: vec![Material { name: "glass".into(), density_kg_m3: 2500.0, stiffness: None, poisson: None }],
        start: Start::Given {
            positions_m: rows.iter().map(|row| [row[0], row[1], row[2]]).collect(),
            velocities_m_s: rows.iter().map(|row| [row[3], row[4], row[5]]).collect(),
            radii_m: vec![RADIUS_M; rows.len()],
            materials: vec![0; rows.len()],
        },
        seed: 1,
        temperature_k: 300.0,
        reads_temperature: false,
        contact: Contact {
            law: ContactLaw::Hertz { young_pa: 1e7, poisson: 0.3 },
            softening_rate: 0.0,
            softening_reference_k: 300.0,
            softening_floor_pa: 0.0,
            damping_n_s_m3: 0.0,
            restitution: Some(0.5),
        },
        friction: Some(Friction::Spring {
            stiffness_ratio: None,
            damping_ratio: None,
            static_coefficient: 0.5,
            dynamic_coefficient: 0.5,
        }),
        rolling: None,
        pairs: Vec::new(),
        bond: None,
        bonds: None,
        fields: FieldForces::default(),
        drag: None,
        gravity_m_s2: [0.0, 0.0, -9.81],
        walls,
        spin: true,
        integrator: Integrator::Verlet { substep_s: Some(STEP_S) },
        skin: 0.3,
        pours: Vec::new(),
        domain: None,
    }
}

fn walls(width_m: f64) -> Vec<Wall> {
    let plane = |name: &str, through, normal| Wall::fixed(name, Shape::plane(through, normal), None);
    vec![
        plane("floor", [0.0; 3], [0.0, 0.0, 1.0]),
        plane("left", [0.0; 3], [1.0, 0.0, 0.0]),
        plane("right", [width_m, 0.0, 0.0], [-1.0, 0.0, 0.0]),
        plane("front", [0.0; 3], [0.0, 1.0, 0.0]),
        plane("back", [0.0, width_m, 0.0], [0.0, -1.0, 0.0]),
    ]
}
