//! Running the program and reading what it says.

use std::{
    path::{Path, PathBuf},
    process::{Child, Command, Output, Stdio},
    time::{Duration, Instant},
};

use tempfile::TempDir;

/// The program under test.
pub fn stagger() -> Command {
    Command::new(env!("CARGO_BIN_EXE_stagger"))
}

/// The folder of the scenes users start from.
pub fn scenes() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes")
}

/// The text of deposition-laser.toml, three nodes whose fields have up to 24 kB, with another duration.
pub fn laser_for(duration: &str) -> String {
    let text = std::fs::read_to_string(scenes().join("deposition-laser.toml")).unwrap();
    let changed = text.replace("duration = \"8 ms\"", &format!("duration = \"{duration}\""));
    assert_ne!(changed, text, "the scene's duration has another form now");
    changed
}

/// A folder of its own with a copy of `scene`, so that everything started for it can be told by its path.
pub struct Workplace {
    folder: TempDir,
    /// The copy.
    pub scene: PathBuf,
}

impl Workplace {
    /// With a scene of the repository.
    pub fn with(scene: &str) -> Self {
        Self::of(&std::fs::read_to_string(scenes().join(scene)).unwrap())
    }

    /// With a scene of the test's own.
    pub fn of(text: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let scene = folder.path().join("scene.toml");
        std::fs::write(&scene, text).unwrap();
        Self { folder, scene }
    }

    /// A path in the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Runs the scene with more arguments to its end.
    pub fn run(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().unwrap()
    }

    /// Starts the scene with more arguments.
    pub fn start(&self, arguments: &[&str]) -> Child {
        self.command(arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
    }

    fn command(&self, arguments: &[&str]) -> Command {
        // A recording under the same name is of an earlier run of the same test, and is not to be mistaken for this one's.
        if let Some(at) = arguments.iter().position(|argument| *argument == "--record")
            && std::fs::metadata(self.path(arguments[at + 1])).is_ok_and(|about| about.is_file())
        {
            std::fs::remove_file(self.path(arguments[at + 1])).unwrap();
        }
        let mut command = stagger();
        command.arg("run").arg(&self.scene).args(arguments).current_dir(self.folder.path());
        command
    }

    /// Processes that were started for this folder and are still there.
    pub fn processes(&self) -> Vec<u32> {
        let ours = self.folder.path().to_string_lossy().into_owned();
        let numbers =
            std::fs::read_dir("/proc").unwrap().filter_map(|entry| entry.ok()?.file_name().to_str()?.parse().ok());
        numbers
            .filter(|pid: &u32| {
                // A process may end while it is looked at, and a zombie has no command line.
                let line = std::fs::read(format!("/proc/{pid}/cmdline")).unwrap_or_default();
                String::from_utf8_lossy(&line).contains(&ours)
            })
            .collect()
    }

    /// The process of one node.
    pub fn node(&self, kind: &str) -> u32 {
        let is_node = |pid: &u32| {
            let line = std::fs::read(format!("/proc/{pid}/cmdline")).unwrap_or_default();
            line.split(|byte| *byte == 0).nth(2) == Some(kind.as_bytes())
        };
        wait_until("the node's process", || self.processes().into_iter().find(is_node))
    }

    /// Waits until no process is left.
    pub fn wait_until_empty(&self) {
        wait_until("all processes to be gone", || self.processes().is_empty().then_some(()));
    }

    /// Waits until a file has some size, in bytes.
    pub fn wait_for_file(&self, name: &str, bytes: u64) {
        let path = self.path(name);
        wait_until("the recording to grow", || (std::fs::metadata(&path).ok()?.len() > bytes).then_some(()));
    }
}

/// Sends a signal by its name.
pub fn signal(name: &str, pid: u32) {
    assert!(Command::new("kill").arg(format!("-{name}")).arg(pid.to_string()).status().unwrap().success());
}

/// Polls for at most 60 s, which is far longer than anything waited for takes on a loaded machine.
fn wait_until<T>(what: &str, mut probe: impl FnMut() -> Option<T>) -> T {
    let begun = Instant::now();
    loop {
        if let Some(found) = probe() {
            return found;
        }
        assert!(begun.elapsed() < Duration::from_secs(60), "waited in vain for {what}");
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// Standard error as text.
pub fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Whether two numbers are equal but for reading them from JSON, which `serde_json` does to the last bit or the next.
pub fn same(a: f64, b: f64) -> bool {
    (a - b).abs() <= 4.0 * f64::EPSILON * b.abs()
}

/// Standard output as JSON; the run must have ended well.
pub fn json(output: &Output) -> serde_json::Value {
    assert!(output.status.success(), "{}", said(output));
    serde_json::from_slice(&output.stdout).unwrap()
}
