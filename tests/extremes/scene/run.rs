//! Runs a scene in one process for a few steps, and judges what came of it.

use std::{
    collections::BTreeSet,
    f64::consts::FRAC_PI_3,
    fs,
    io::Write as _,
    path::Path,
    sync::{Mutex, Once},
    time::{Duration, Instant},
};

use stagger_config::Problems;
use stagger_coupling::{CouplingController, InProcess, Ledger, Listener, Outcome};
use stagger_messages::{Decision, Ready};
use stagger_physics::solid;
use stagger_scene::Scene;

/// Accepted steps that a scene is run for.
const STEPS: usize = 4;
/// Substeps of the particles after which it is run no longer: a million are allowed in one step.
const SUBSTEPS: f64 = 5e3;

/// Particles and rays that a scene may have to be run.
const LARGEST: f64 = 100_100.0;
/// Cells that a scene may have to be run: each window solves for all of them several times.
const MOST_CELLS: usize = 3000;

/// A case that takes longer than this hangs: the shortest take a millisecond, the longest of those that are known two seconds.
const HANGS: Duration = Duration::from_secs(120);

/// A scene to be driven, with the folder its files are in.
pub struct Base {
    pub name: String,
    pub text: String,
    pub folder: String,
}

/// The scenes in a folder beside `tests`, by name.
pub fn scenes(folder: &str) -> Vec<Base> {
    let folder = format!("{}/../../{folder}", env!("CARGO_MANIFEST_DIR"));
    let mut paths: Vec<_> = fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    let toml = paths.iter().filter(|path| path.extension().is_some_and(|extension| extension == "toml"));
    let base = |path: &std::path::PathBuf| Base {
        name: path.file_stem().unwrap().to_string_lossy().into_owned(),
        text: fs::read_to_string(path).unwrap(),
        folder: folder.clone(),
    };
    toml.map(base).collect()
}

/// Overrides, as `--set` takes them.
pub type Sets = Vec<(String, String)>;

/// What came of a scene.
#[derive(Debug)]
pub enum End {
    /// The check refused it.
    Refused(Problems),
    /// It stopped with an error, in words.
    Stopped { cause: String },
    /// It was read, but is too large to be run here.
    Large,
    /// It ran.
    Ran {
        /// The energy of the nodes and between them.
        ledger: Ledger,
        /// Volume of the particles at the end in m³, and the highest temperature in K.
        volume_m3: f64,
        highest_k: f64,
        /// The first value that is not finite.
        not_finite: Option<String>,
    },
}

impl Base {
    /// Whether a run of it is short enough: a particle, a ray or a cell more costs its share of time, and nothing else.
    fn is_small(scene: &Scene) -> bool {
        let counts = scene.effective.iter().filter(|value| value.path.ends_with(".count"));
        let cells = scene.settings::<solid::Settings>().map_or(0, |solid| solid.grid.len());
        counts.flat_map(|value| &value.si).sum::<f64>() <= LARGEST && cells <= MOST_CELLS
    }

    /// Reads the scene with overrides.
    pub fn parse(&self, sets: &Sets) -> Result<Scene, Problems> {
        let read = |file: &str| fs::read(Path::new(&self.folder).join(file)).map_err(|error| error.to_string());
        Scene::parse_with_files(&self.text, &format!("{}.toml", self.name), sets, &read)
    }

    /// Reads the scene with overrides and runs it for a few steps.
    pub fn run(&self, sets: &Sets) -> End {
        let _watched = Watched::new(format!("{} with {sets:?}", self.name));
        match self.parse(sets) {
            Ok(scene) if Self::is_small(&scene) => run(&scene),
            Ok(_) => End::Large,
            Err(problems) => End::Refused(problems),
        }
    }
}

/// Runs a scene for a few steps.
pub fn run(scene: &Scene) -> End {
    let members = match scene.participants() {
        Ok(members) => members,
        Err(error) => return End::Stopped { cause: error.to_string() },
    };
    let mut ensemble = InProcess::new(members);
    let ports = ensemble.ports();
    let plan = match stagger_coupling::plan(&ports, &scene.coupling) {
        Ok(plan) => plan,
        Err(error) => return End::Stopped { cause: error.to_string() },
    };
    let measured = stagger_coupling::measured(&ports, &plan);
    let mut controller = CouplingController::new(&scene.coupling, &plan, &measured, scene.duration_s);
    let mut log = Log::default();
    // With a checkpoint, so that states are encoded too.
    let driven =
        stagger_coupling::run_loop(&mut ensemble, &plan, &mut controller, scene.recovery.checkpoint_steps, &mut log);
    if let Err(error) = driven {
        return End::Stopped { cause: error.to_string() };
    }
    for field in ensemble.fields().values() {
        if field.first_not_finite().is_some() {
            log.not_finite.get_or_insert(format!("field {}", field.name()));
        }
    }
    let fields = ensemble.fields();
    let of = |name: &str| fields.get(name).and_then(|field| field.f64().ok()).unwrap_or(&[]);
    let volume_m3 = of("radii").iter().map(|radius| 4.0 * FRAC_PI_3 * radius.powi(3)).sum();
    let highest_k = of("temperature").iter().copied().fold(0.0, f64::max);
    End::Ran { ledger: log.ledger, volume_m3, highest_k, not_finite: log.not_finite }
}

/// Sums the energy, looks for what is not finite, and stops after [`STEPS`] or [`SUBSTEPS`].
#[derive(Default)]
struct Log {
    accepted: usize,
    substeps: f64,
    ledger: Ledger,
    not_finite: Option<String>,
}

impl Listener for Log {
    fn started(&mut self, ready: &[(String, Ready)]) {
        for (node, ready) in ready {
            self.ledger.start(node, &ready.ledger);
            self.look(node, ready.ledger.iter().map(|entry| (entry.name.as_str(), entry.joule)));
        }
    }

    fn decided(&mut self, decision: &Decision, outcomes: &[Outcome]) -> bool {
        let accepted = decision.verdict() == stagger_messages::Verdict::Accept;
        for Outcome { node, result } in outcomes {
            let Ok(done) = result else { continue };
            self.look(node, done.ledger.iter().map(|entry| (entry.name.as_str(), entry.joule)));
            self.look(node, done.figures.iter().map(|figure| (figure.0.as_str(), *figure.1)));
            if accepted {
                self.substeps += done.figures.get("substeps").unwrap_or(&0.0);
                self.ledger.book_until(node, &done.ledger, decision.t_s);
            }
        }
        self.look("the coordinator", [("next step", decision.next_dt_s), ("factor", decision.factor)].into_iter());
        self.accepted += usize::from(accepted);
        self.accepted < STEPS && self.substeps < SUBSTEPS
    }
}

impl Log {
    fn look<'a>(&mut self, node: &str, values: impl Iterator<Item = (&'a str, f64)>) {
        for (name, value) in values {
            if !value.is_finite() {
                self.not_finite.get_or_insert(format!("{node}: {name} is {value}"));
            }
        }
    }
}

/// Cases under way: one that hangs cannot be stopped, so it is named, and the test ends.
static UNDER_WAY: Mutex<BTreeSet<(Instant, String)>> = Mutex::new(BTreeSet::new());
static WATCH: Once = Once::new();

/// A case under way.
pub struct Watched((Instant, String));

impl Watched {
    pub fn new(case: String) -> Self {
        WATCH.call_once(|| {
            std::thread::spawn(|| {
                loop {
                    std::thread::sleep(Duration::from_secs(1));
                    let cases = UNDER_WAY.lock().unwrap();
                    if let Some((_, case)) = cases.iter().find(|(since, _)| since.elapsed() > HANGS) {
                        // Straight to the stream: what a test prints is kept until it ends.
                        let _ = writeln!(std::io::stderr(), "hangs: {case}");
                        std::process::exit(101);
                    }
                }
            });
        });
        let case = (Instant::now(), case);
        UNDER_WAY.lock().unwrap().insert(case.clone());
        Self(case)
    }
}

impl Drop for Watched {
    fn drop(&mut self) {
        UNDER_WAY.lock().unwrap().remove(&self.0);
    }
}
