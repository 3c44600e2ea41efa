//! The same end, to the bit, where every third step is rejected once and solved again, and where a run is stopped half-way and
//! goes on from its checkpoint in participants made anew (the restep and recover runs of MOOSE's test harness).

use std::{collections::BTreeMap, num::NonZeroU64, path::Path};

use prost::Message as _;
use stagger_coupling::{CouplingController, End, InProcess, Listener, Outcome};
use stagger_messages::{Checkpoint, Decision, Fields, Ready, Verdict};
use stagger_runtime::run::scene_files::SceneFile;
use stagger_scene::Scene;

use super::hashes::Shortened;

/// Counts decisions, and stops after some accepted steps.
#[derive(Default)]
struct Log {
    accepted: u64,
    rejected: u64,
    stop_after: Option<u64>,
}

impl Listener for Log {
    fn started(&mut self, _ready: &[(String, Ready)]) {}

    fn decided(&mut self, decision: &Decision, _outcomes: &[Outcome]) -> bool {
        match decision.verdict() {
            Verdict::Accept => self.accepted += 1,
            Verdict::Reject => self.rejected += 1,
            Verdict::Iterate | Verdict::None => {}
        }
        Some(self.accepted) != self.stop_after
    }
}

/// How a run ended: final fields by node and name with their hashes.
struct Ended {
    log: Log,
    hashes: BTreeMap<String, u64>,
    checkpoint: Option<Checkpoint>,
}

fn run(scene: &Scene, reject_every: Option<NonZeroU64>, stop_after: Option<u64>, from: Option<Checkpoint>) -> Ended {
    let mut ensemble = InProcess::new(scene.participants().unwrap());
    let ports = ensemble.ports();
    let mut plan = stagger_coupling::plan(&ports, &scene.coupling).unwrap();
    let mut controller =
        CouplingController::new(&scene.coupling, &plan, &stagger_coupling::measured(&ports, &plan), scene.duration_s);
    if let Some(checkpoint) = from {
        plan.from = checkpoint.envelope.as_ref().unwrap().version;
        controller.restore(&checkpoint.coordinator).unwrap();
        ensemble = ensemble.from_checkpoint(checkpoint);
    }
    if let Some(steps) = reject_every {
        controller.control.reject_every(steps);
    }
    let mut log = Log { stop_after, ..Log::default() };
    let end = stagger_coupling::run_loop(&mut ensemble, &plan, &mut controller, u64::MAX, &mut log).unwrap();
    assert_eq!(end == End::Interrupted, stop_after.is_some());
    let of_node = |(node, fields): (&str, &Fields)| {
        fields.values().map(|field| (format!("{node}/{}", field.name()), field.hash())).collect::<Vec<_>>()
    };
    let hashes = ensemble.committed().flat_map(of_node).collect();
    Ended { log, hashes, checkpoint: ensemble.last_checkpoint().cloned() }
}

fn check(name: &str) {
    let shortened = Shortened::of(name);
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes").join(name);
    let (key, value) = shortened.set.split_once('=').unwrap();
    let overrides = [(key.to_owned(), value.to_owned())];
    let scene = SceneFile::read(&path).unwrap().parse(&overrides, None).unwrap();

    let straight = run(&scene, None, None, None);
    let repeated = run(&scene, NonZeroU64::new(3), None, None);
    assert!(repeated.log.rejected >= straight.log.accepted / 3, "{name}: {} rejected", repeated.log.rejected);
    assert_eq!(repeated.log.accepted, straight.log.accepted, "{name}");
    assert_eq!(repeated.hashes, straight.hashes, "{name}, with every third step solved again");

    let half = straight.log.accepted / 2;
    let stopped = run(&scene, None, Some(half), None);
    assert_ne!(stopped.hashes, straight.hashes, "{name} had ended half-way");
    // Through bytes, as in a recording.
    let bytes = stopped.checkpoint.unwrap().encode_to_vec();
    let resumed = run(&scene, None, None, Some(Checkpoint::decode(bytes.as_slice()).unwrap()));
    assert_eq!(resumed.log.accepted + half, straight.log.accepted, "{name}");
    assert_eq!(resumed.hashes, straight.hashes, "{name}, resumed after {half} steps");
}

macro_rules! same_ends {
    ($($test:ident $scene:literal)*) => {
        $(#[test]
        fn $test() {
            check($scene);
        })*
    };
}
same_ends! {
    same_end_of_acoustic_pulse "acoustic-pulse.toml"
    same_end_of_deposition_laser "deposition-laser.toml"
    same_end_of_deposition "deposition.toml"
    same_end_of_electric_deposition "electric-deposition.toml"
    same_end_of_falling_powder "falling-powder.toml"
    same_end_of_laser_rays "laser-rays.toml"
    same_end_of_mixed_powder "mixed-powder.toml"
    same_end_of_pile "pile.toml"
    same_end_of_piston "piston.toml"
    same_end_of_plate_track "plate-track.toml"
    same_end_of_quick "quick.toml"
    same_end_of_sintering "sintering.toml"
    same_end_of_substrate "substrate.toml"
    same_end_of_three_lasers "three-lasers.toml"
}
