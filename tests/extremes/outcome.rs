//! What comes of a scene, and what every outcome must be.

use stagger_coupling::{Frozen, Physics, Reply, SolveError, Window};
use stagger_messages::energy::Kind;
use stagger_physics::particles::{ContactLaw, Friction, Integrator, Particles, Rolling, Settings, State};

use crate::bed::*;

pub const TRAPEZOIDAL: Integrator =
    Integrator::Trapezoidal { phi: 0.5, tolerance: 1e-6, iterations: 20, anderson_depth: 0 };
pub const INTEGRATORS: [Integrator; 2] = [VERLET, TRAPEZOIDAL];

pub const SPRING: Friction =
    Friction::Spring { stiffness_ratio: None, damping_ratio: None, static_coefficient: 0.5, dynamic_coefficient: 0.4 };

/// Times in a row that a window may be cut, and times in all.
const CUTS: u32 = 100;
const ALL_CUTS: u32 = 5000;
/// Substeps that a run may take in all.
const SUBSTEPS: f64 = 2e5;

/// What came of a run.
#[derive(Debug)]
pub enum Outcome {
    /// It came to its end.
    Ran(Box<Ran>),
    /// It stopped with an error, or still asked for smaller windows.
    Refused(String),
}

/// A run that came to its end.
#[derive(Debug)]
pub struct Ran {
    pub reply: Reply,
    /// Change of the stored energy that the ledger does not explain, over what was stored and turned over.
    pub imbalance: f64,
    /// Change of the momentum over the sum of the momenta's sizes, the largest on the way.
    pub drift: f64,
    /// Windows that were asked for again, smaller.
    pub cuts: u32,
}

impl Outcome {
    #[track_caller]
    pub fn ran(self) -> Ran {
        match self {
            Self::Ran(ran) => *ran,
            Self::Refused(cause) => panic!("refused: {cause}"),
        }
    }

    #[track_caller]
    pub fn refused(self) -> String {
        match self {
            Self::Ran(ran) => panic!("ran: {:?}", ran.reply.figures),
            Self::Refused(cause) => cause,
        }
    }
}

/// Whatever is said is finite, and a smaller step is asked for by a factor below 1.
#[track_caller]
pub fn check(reply: &Reply) {
    for field in reply.fields.values() {
        assert!(field.first_not_finite().is_none(), "{}", field.name());
    }
    for entry in &reply.ledger {
        assert!(entry.joule.is_finite(), "{}: {} J", entry.name, entry.joule);
    }
    for (name, value) in &reply.figures {
        assert!(value.is_finite(), "{name}: {value}");
    }
    if let Some(reason) = reply.not_converged {
        assert!(reason.step_factor > 0.0 && reason.step_factor < 1.0, "{}", reason.step_factor);
    }
}

/// Σ m v by axis, and Σ m ‖v‖.
fn momentum(particles: &[Sphere], density_kg_m3: f64, reply: &Reply) -> ([f64; 3], f64) {
    let velocities = field(reply, "velocities").as_chunks::<3>().0;
    let (mut sum, mut size) = ([0.0; 3], 0.0);
    for (sphere, velocity) in particles.iter().zip(velocities) {
        let mass = mass(sphere.2, density_kg_m3);
        sum = std::array::from_fn(|axis| sum[axis] + mass * velocity[axis]);
        size += mass * velocity.iter().map(|v| v * v).sum::<f64>().sqrt();
    }
    (sum, size)
}

/// Solves windows of `dt_s` until `end_s`, as the coordinator does: one that does not converge is cut, and the next may be
/// longer again. `spheres` are those of the settings.
pub fn outcome(settings: &Settings, spheres: &[Sphere], dt_s: f64, end_s: f64) -> Outcome {
    match advance(settings, spheres, dt_s, end_s) {
        Ok(ran) => Outcome::Ran(Box::new(ran)),
        Err(error) => Outcome::Refused(error.to_string()),
    }
}

fn advance(settings: &Settings, spheres: &[Sphere], dt_s: f64, end_s: f64) -> Result<Ran, SolveError> {
    let particles = Particles::new(settings.clone())?;
    let (mut state, mut reply) = particles.initial()?;
    check(&reply);
    let density = settings.materials[0].density_kg_m3;
    let (start, mut largest) = momentum(spheres, density, &reply);
    let before = energy(&reply, Kind::Stored);
    let (mut t_s, mut step_s, mut cuts, mut in_a_row, mut substeps) = (0.0, dt_s, 0, 0, 0.0);
    let (mut lost, mut turned, mut drift) = (0.0, 0.0, 0.0f64);
    let mut stored = before;
    while t_s < end_s {
        let window = Window { t_s, dt_s: step_s.min(end_s - t_s) };
        let solved: Result<(State, Reply), SolveError> = particles.solve(&state, &Frozen::default(), window);
        let factor = match solved {
            Ok((next, said)) => {
                check(&said);
                if let Some(reason) = said.not_converged {
                    reason.step_factor
                } else {
                    let sums = |kind| said.ledger.iter().filter(move |entry| entry.kind() == kind);
                    lost += energy(&said, Kind::Lost) - energy(&said, Kind::Gained);
                    turned += sums(Kind::Lost).chain(sums(Kind::Gained)).map(|entry| entry.joule.abs()).sum::<f64>();
                    let now = energy(&said, Kind::Stored);
                    turned += (now - stored).abs();
                    stored = now;
                    substeps += said.figures.get("substeps").copied().unwrap_or(0.0);
                    let (now, size) = momentum(spheres, density, &said);
                    largest = largest.max(size);
                    drift = (0..3).map(|axis| (now[axis] - start[axis]).abs()).fold(drift, f64::max);
                    (state, reply) = (next, said);
                    in_a_row = 0;
                    if substeps > SUBSTEPS {
                        return Err(SolveError::Mismatch(format!("more than {SUBSTEPS:e} substeps")));
                    }
                    t_s += window.dt_s;
                    step_s = (2.0 * window.dt_s).min(dt_s);
                    continue;
                }
            }
            Err(error) if error.retry() => 0.5,
            Err(error) => return Err(error),
        };
        (cuts, in_a_row) = (cuts + 1, in_a_row + 1);
        if in_a_row > CUTS || cuts > ALL_CUTS {
            return Err(SolveError::Mismatch(format!("asks for less than {} s", window.dt_s)));
        }
        step_s = window.dt_s * factor;
    }
    let scale = before.abs().max(turned);
    let share = |value: f64, of: f64| if value > 0.0 { value / of } else { 0.0 };
    Ok(Ran { imbalance: share((stored - before + lost).abs(), scale), drift: share(drift, largest), cuts, reply })
}

/// The laws at a stiffness in Pa, or N/m where the spring is linear.
pub fn laws(stiffness: f64) -> [ContactLaw; 4] {
    [
        ContactLaw::Overlap { stiffness_pa: stiffness, exponent: 2.0 },
        ContactLaw::Overlap { stiffness_pa: stiffness, exponent: 0.5 },
        ContactLaw::Hertz { young_pa: stiffness, poisson: 0.3 },
        ContactLaw::Linear { stiffness_n_m: stiffness },
    ]
}

/// Damping, friction, rolling and spin at once.
pub fn rich(law: ContactLaw, density_kg_m3: f64, spheres: &[Sphere]) -> Settings {
    let mut settings = settings(law, density_kg_m3, spheres);
    settings.contact.restitution = Some(0.7);
    settings.friction = Some(SPRING);
    settings.rolling = Some(Rolling { rolling: 0.1, torsion: 0.1 });
    settings.spin = true;
    settings
}

/// Two equal spheres that meet at 2 `speed`, a little aside, with a gap of `gap`.
pub fn collision(radius: f64, speed: f64, gap: f64) -> Vec<Sphere> {
    vec![
        ([-radius - 0.5 * gap, 0.0, 0.0], [speed, 0.1 * speed, 0.0], radius),
        ([radius + 0.5 * gap, 0.0, 0.0], [-speed, 0.0, 0.0], radius),
    ]
}

/// The shortest contact that the automatic substep expects, in s; `None` where nothing moves.
pub fn contact_s(settings: &Settings) -> Option<f64> {
    // Friction may have time scales of its own, shorter than can be resolved.
    let settings = Settings { integrator: VERLET, friction: None, ..settings.clone() };
    let particles = Particles::new(settings).unwrap();
    let (state, _) = particles.initial().unwrap();
    let (_, reply) = particles.solve(&state, &Frozen::default(), Window { t_s: 0.0, dt_s: 1e-12 }).unwrap();
    let shortest = reply.figures.get("shortest contact time over substep");
    shortest.map(|share| share * reply.figures["substep [s]"])
}

/// The outcome after so many contact times and `way_s`, in windows that resolve a contact: the trapezoidal rule has no step of
/// its own to do that.
pub fn resolved(settings: &Settings, spheres: &[Sphere], contacts: f64, way_s: f64) -> Outcome {
    let contact_s = contact_s(settings).unwrap();
    outcome(settings, spheres, contact_s / 40.0, contacts * contact_s + way_s)
}
