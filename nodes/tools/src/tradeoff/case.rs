//! One run of the scene with some settings changed: run as a user would, kept on disk, and not run again.

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    sync::atomic::{AtomicBool, Ordering},
    time::{Duration, Instant},
};

use serde::{Deserialize, Serialize};
use serde_json::Value;
use stagger_messages::codec;
use stagger_runtime::run::scene_files::SceneFile;

use super::{Failed, axis::Set};

/// How often a run is looked at.
const LOOK: Duration = Duration::from_millis(20);

/// Where and how runs are made.
#[derive(Clone, Debug)]
pub struct Workshop {
    /// The scene.
    pub scene: PathBuf,
    /// What all runs set.
    pub overrides: Set,
    /// Recording that holds the files the scene names.
    pub files: Option<PathBuf>,
    /// Folder of the results.
    pub folder: PathBuf,
    /// Nodes as threads of one process.
    pub in_process: bool,
    /// Threads of each node.
    pub threads: Option<usize>,
    /// Runs of each case, whose median times are told.
    pub repeat: usize,
}

/// What a case took and came to.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// What it set beside what all runs set.
    pub set: Set,
    /// Wall time of each run, in s.
    pub wall_s: Vec<f64>,
    /// Processor time of each run, over all its processes, in s; empty where the system does not tell.
    pub cpu_s: Vec<f64>,
    /// Accepted steps.
    pub steps: u64,
    /// Rejected attempts.
    pub rejected: u64,
    /// Iterations.
    pub iterations: u64,
    /// Fields published.
    pub exchanges: u64,
    /// Bytes of their values.
    pub bytes: u64,
    /// Substep of the particles in the last step, in s, where they have substeps.
    pub substep_s: Option<f64>,
    /// Why there is no result.
    pub failed: Option<String>,
}

impl Outcome {
    /// Median wall time, in s; infinite where no run ended.
    #[must_use]
    pub fn wall(&self) -> f64 {
        median(&self.wall_s)
    }

    /// Median processor time, in s; infinite where it is not known.
    #[must_use]
    pub fn cpu(&self) -> f64 {
        median(&self.cpu_s)
    }
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    match sorted.len() {
        0 => f64::INFINITY,
        odd if odd % 2 == 1 => sorted[odd / 2],
        even => 0.5 * (sorted[even / 2 - 1] + sorted[even / 2]),
    }
}

/// What one run brought.
enum Ran {
    Summary(Box<Value>, f64),
    Failed(String),
}

impl Workshop {
    /// The result of a case and where its run was recorded: from disk where it was run before, else by running it. A run is
    /// ended after `longest`. There is no recording where it failed.
    ///
    /// # Errors
    /// The program cannot be started, a file not be written, or the user interrupts.
    pub fn outcome(
        &self,
        set: &Set,
        longest: Option<Duration>,
        interrupted: &AtomicBool,
    ) -> Result<(Outcome, Option<PathBuf>), Failed> {
        let file = SceneFile::read(&self.scene).map_err(|source| Failed::io(&self.scene, source))?;
        let all: Set = self.overrides.iter().chain(set).cloned().collect();
        let scene = match file.parse(&all, self.files.as_deref()) {
            Ok(scene) => scene,
            Err(problems) => {
                let failed = problems.list.first().map(|problem| format!("{}: {}", problem.key, problem.message));
                return Ok((Outcome { set: set.clone(), failed, ..Outcome::default() }, None));
            }
        };
        let stem = self.stem(scene.hash);
        let (kept, recording) = (stem.with_extension("json"), stem.with_extension("mcap"));
        let mut outcome: Outcome = fs::read(&kept)
            .ok()
            .filter(|_| recording.is_file())
            .and_then(|bytes| serde_json::from_slice(&bytes).ok())
            .unwrap_or_default();
        // What failed would fail again; what took too long may be given longer now.
        outcome.failed = None;
        outcome.set.clone_from(set);
        while outcome.wall_s.len() < self.repeat {
            let cpu_before = processor_time_s();
            match self.run(&all, &recording, longest, interrupted)? {
                Ran::Summary(summary, wall_s) => {
                    outcome.take(&summary, wall_s);
                    outcome.cpu_s.extend(processor_time_s().zip(cpu_before).map(|(after, before)| after - before));
                }
                Ran::Failed(why) => {
                    outcome.failed = Some(why);
                    return Ok((outcome, None));
                }
            }
            let text = serde_json::to_vec_pretty(&outcome).map_err(|error| Failed::io(&kept, error.into()))?;
            // Under another name first: half a result is none.
            let partial = kept.with_extension("partial");
            fs::write(&partial, text)
                .and_then(|()| fs::rename(&partial, &kept))
                .map_err(|source| Failed::io(&kept, source))?;
        }
        Ok((outcome, Some(recording)))
    }

    /// A case is what the scene, its settings and this program make it; whether it runs in one process changes its time alone.
    fn stem(&self, scene_hash: u64) -> PathBuf {
        let how = format!("{scene_hash:016x} {} {} {:?}", env!("CARGO_PKG_VERSION"), self.in_process, self.threads);
        self.folder.join("cases").join(format!("{:016x}", codec::hash(how.as_bytes())))
    }

    fn run(
        &self,
        all: &Set,
        recording: &Path,
        longest: Option<Duration>,
        interrupted: &AtomicBool,
    ) -> Result<Ran, Failed> {
        let program = std::env::current_exe().map_err(|source| Failed::io(Path::new("this program"), source))?;
        let folder = self.folder.join("cases");
        fs::create_dir_all(&folder).map_err(|source| Failed::io(&folder, source))?;
        // Named after the case: nothing of the same name in the folder is anybody else's.
        let (out, log) = (recording.with_extension("summary"), recording.with_extension("messages"));
        let file = |path: &Path| fs::File::create(path).map_err(|source| Failed::io(path, source));
        let mut command = Command::new(&program);
        // A case that is measured again replaces its own recording.
        command.args(["run", "--json", "--overwrite", "--record"]).arg(recording);
        command.args(all.iter().map(|(key, value)| format!("--set={key}={value}")));
        command.args(self.files.iter().flat_map(|files| [Path::new("--files"), files.as_path()]));
        command.args(self.in_process.then_some("--in-process"));
        command.args(self.threads.map(|threads| format!("--threads={threads}")));
        command.arg("--").arg(&self.scene);
        command.stdin(Stdio::null()).stdout(file(&out)?).stderr(file(&log)?);
        let mut child = command.spawn().map_err(|source| Failed::io(&program, source))?;
        let started = Instant::now();
        let status = loop {
            if let Some(status) = child.try_wait().map_err(|source| Failed::io(&program, source))? {
                break status;
            }
            if interrupted.load(Ordering::Relaxed) {
                // A terminal's Ctrl-C reached it too; it ends after its step.
                end(&mut child);
                return Err(Failed::Interrupted);
            }
            if longest.is_some_and(|longest| started.elapsed() > longest) {
                end(&mut child);
                return Ok(Ran::Failed(format!("ended after {:.0} s", started.elapsed().as_secs_f64())));
            }
            std::thread::sleep(LOOK);
        };
        if interrupted.load(Ordering::Relaxed) {
            return Err(Failed::Interrupted);
        }
        if !status.success() {
            let log = fs::read_to_string(&log).unwrap_or_default();
            let why = log.lines().find_map(|line| line.strip_prefix("error: ")).unwrap_or("it ended with an error");
            return Ok(Ran::Failed(why.to_owned()));
        }
        let summary: Value = fs::read(&out)
            .and_then(|bytes| serde_json::from_slice(&bytes).map_err(Into::into))
            .map_err(|source| Failed::io(&out, source))?;
        let wall_s = summary["wall_s"].as_f64().unwrap_or_else(|| started.elapsed().as_secs_f64());
        Ok(Ran::Summary(Box::new(summary), wall_s))
    }
}

impl Outcome {
    fn take(&mut self, summary: &Value, wall_s: f64) {
        let count = |value: &Value| value.as_u64().unwrap_or_default();
        let steps = &summary["steps"];
        self.wall_s.push(wall_s);
        (self.steps, self.rejected) = (count(&steps["accepted"]), count(&steps["rejected"]));
        self.iterations = count(&steps["iterations"]);
        (self.exchanges, self.bytes) = (count(&summary["exchanges"]), count(&summary["bytes"]));
        let nodes = summary["nodes"].as_object().into_iter().flat_map(serde_json::Map::values);
        self.substep_s = nodes.filter_map(|node| node["figures"]["substep [s]"].as_f64()).reduce(f64::min);
    }
}

/// Ends a run; its nodes end with it.
fn end(child: &mut Child) {
    // It may have ended by itself just now.
    let _ = child.kill();
    let _ = child.wait();
}

/// Processor time of all processes that this one started and saw end, and theirs in turn, in s.
#[cfg(unix)]
fn processor_time_s() -> Option<f64> {
    use nix::sys::{
        resource::{UsageWho, getrusage},
        time::TimeValLike as _,
    };
    let usage = getrusage(UsageWho::RUSAGE_CHILDREN).ok()?;
    Some((usage.user_time() + usage.system_time()).num_microseconds() as f64 * 1e-6)
}

#[cfg(not(unix))]
fn processor_time_s() -> Option<f64> {
    None
}
