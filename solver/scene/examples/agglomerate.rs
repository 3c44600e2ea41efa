//! How scenes/acoustic-pulse.toml breaks up, pulse by pulse: `cargo run --release -p stagger-scene --example agglomerate`.
#![allow(clippy::print_stdout)]

use std::{env, fs};

use nalgebra::Vector3;
use stagger_coupling::{CouplingController, InProcess, Listener, Outcome};
use stagger_messages::{Decision, Ready, Verdict};
use stagger_physics::{acoustics, common::rays::spheres};
use stagger_scene::Scene;

/// Centres nearer than this many diameters belong to one cluster.
const LINKED: f64 = 1.25;

/// Steps of a run.
#[derive(Default)]
struct Steps(u32);

impl Listener for Steps {
    fn started(&mut self, _ready: &[(String, Ready)]) {}

    fn decided(&mut self, decision: &Decision, _outcomes: &[Outcome]) -> bool {
        self.0 += u32::from(decision.verdict() == Verdict::Accept);
        true
    }
}

/// Sizes of the groups of particles that hang together, largest first.
fn clusters(centres: &[Vector3<f64>], reach_m: f64) -> Vec<usize> {
    let mut open: Vec<usize> = (0..centres.len()).collect();
    let mut sizes = Vec::new();
    while let Some(first) = open.pop() {
        let mut cluster = vec![first];
        let mut next = 0;
        while next < cluster.len() {
            let centre = centres[cluster[next]];
            let (near, far) = open.iter().partition(|&&other| (centres[other] - centre).norm() < reach_m);
            cluster.extend::<Vec<usize>>(near);
            (open, next) = (far, next + 1);
        }
        sizes.push(cluster.len());
    }
    sizes.sort_unstable_by(|a, b| b.cmp(a));
    sizes
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/acoustic-pulse.toml");
    let overrides: Vec<(String, String)> = env::args()
        .skip(1)
        .filter_map(|set| set.split_once('=').map(|(key, value)| (key.into(), value.into())))
        .collect();
    let scene = Scene::parse(&fs::read_to_string(path)?, "acoustic-pulse.toml", &overrides)?;
    let acoustics = scene.settings::<acoustics::Settings>().ok_or("the scene has no sound")?;
    let pulses = acoustics.beam.pulses.ok_or("a train of pulses")?;
    println!("after pulse | clusters | largest | single | root mean square distance from the middle, m | steps");
    for pulse in 0..=(scene.duration_s / pulses.period_s).round() as u32 {
        let mut ensemble = InProcess::new(scene.participants()?);
        let ports = ensemble.ports();
        let plan = stagger_coupling::plan(&ports, &scene.coupling)?;
        let duration_s = f64::from(pulse).max(1e-3) * pulses.period_s;
        let mut controller =
            CouplingController::new(&scene.coupling, &plan, &stagger_coupling::measured(&ports, &plan), duration_s);
        let mut steps = Steps::default();
        stagger_coupling::run_loop(&mut ensemble, &plan, &mut controller, 0, &mut steps)?;
        let fields = ensemble.fields();
        let spheres = spheres(fields["positions"].f64()?, fields["radii"].f64()?);
        let centres: Vec<_> = spheres.iter().map(|sphere| sphere.centre).collect();
        let sizes = clusters(&centres, LINKED * 2.0 * spheres[0].radius);
        let middle: Vector3<f64> = centres.iter().sum::<Vector3<f64>>() / centres.len() as f64;
        let spread =
            (centres.iter().map(|centre| (centre - middle).norm_squared()).sum::<f64>() / centres.len() as f64).sqrt();
        let single = sizes.iter().filter(|&&size| size == 1).count();
        println!("{pulse} | {} | {} | {single} | {spread:.3} | {}", sizes.len(), sizes[0], steps.0);
    }
    Ok(())
}
