//! Fault: a node of one's own wrote seven rows, or nine, on `particles`, of which there are eight, and the run completed.
//!
//! Also what else a foreign reply may hold that was booked and printed: an energy that is no number, a name with
//! characters that control a terminal.

use std::{collections::BTreeMap, error::Error, path::Path, process::Output, sync::Arc};

use stagger_coupling::{Frozen, Physics, Reply, SolveError, Window};
use stagger_messages::{Energy, Field, Fields, Measure, Port, Ports};
use stagger_runtime::node::plug_in::{self, Setup};

use super::program;

const SCENE: &str = r#"
duration = "20 us"
[particles]
count = 8
radius = "25 um"
start = { kind = "lattice", box = ["0.1 mm", "0.1 mm", "0.1 mm"] }
gravity = [0, 0, 0]
integrator = "held"
[thermal]
[optics]
power = "10 W"
absorption = "1e4 1/m"
profile = { kind = "gaussian", radius = "100 um" }
path = { kind = "fixed", at = [0, 0, 0] }
[coupling]
dt = "5 us"
[recovery]
restarts = 0
start = "10 s"
"#;

/// What the node does wrong, told by the environment.
const WRONG: &str = "STAGGER_TEST_WRONG";

/// A temperature that stays what it was, wrong in one way: `rows=N`, `blind=N` (it reads nothing), `energy`, `figure`, `name`.
struct Own {
    wrong: (String, usize),
    temperature: Arc<Port>,
}

impl Own {
    fn new(_: &Setup) -> Result<Self, Box<dyn Error>> {
        let wrong = std::env::var(WRONG)?;
        let (kind, rows) =
            wrong.split_once('=').map_or((wrong.as_str(), 8), |(kind, rows)| (kind, rows.parse().unwrap()));
        let temperature = Arc::new(Port::f64("temperature", "K", "particles", 1, Measure::Magnitude));
        Ok(Self { wrong: (kind.into(), rows), temperature })
    }

    fn reply(&self, later: bool) -> Result<Reply, SolveError> {
        let (kind, rows) = &self.wrong;
        let field = Field::new(&self.temperature, 0, vec![300.0; *rows])?;
        let joule = if kind == "energy" && later { f64::NAN } else { 0.0 };
        let figures = match kind.as_str() {
            "figure" => BTreeMap::from([("heat flux".to_owned(), f64::NAN)]),
            "name" => BTreeMap::from([("\u{1b}[31mred\u{7}".to_owned(), 1.0), ("x".repeat(100_000), 2.0)]),
            _ => BTreeMap::new(),
        };
        let ledger = vec![Energy::stored("heat", joule)];
        Ok(Reply { fields: Fields::from([("temperature".into(), field)]), ledger, figures, ..Reply::default() })
    }
}

impl Physics for Own {
    type State = ();

    fn ports(&self) -> Ports {
        let reads = vec![Port::f64("radii", "m", "particles", 1, Measure::None)];
        let reads = if self.wrong.0 == "blind" { Vec::new() } else { reads };
        Ports::new(reads, vec![(*self.temperature).clone()])
    }

    fn initial(&self) -> Result<((), Reply), SolveError> {
        Ok(((), self.reply(false)?))
    }

    fn solve(&self, (): &(), _: &Frozen, _: Window) -> Result<((), Reply), SolveError> {
        Ok(((), self.reply(true)?))
    }
}

/// Not a test but the node, where a launcher started it as one.
#[test]
fn as_a_node() {
    if std::env::var_os(WRONG).is_some() && std::env::var_os("STAGGER_RUN").is_some() {
        let code = plug_in::main(Own::new);
        std::process::exit(i32::from(code != std::process::ExitCode::SUCCESS));
    }
}

fn run(folder: &Path, wrong: &str) -> Output {
    let own = std::env::current_exe().unwrap();
    let node = format!("thermal={} --exact rows_not_checked::as_a_node --nocapture", own.display());
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_stagger"));
    command.args(["run", "scene.toml", "--overwrite", "--record", "run.mcap", "--node", &node]).current_dir(folder);
    command.env(WRONG, wrong).output().unwrap()
}

#[test]
fn other_rows_than_there_are_end_the_run_whether_the_node_reads_them_or_not() {
    let folder = program::folder(&[("scene.toml", SCENE)]);
    for (wrong, rows) in [("rows=7", "7"), ("rows=9", "9"), ("blind=7", "7"), ("blind=9", "9")] {
        let output = run(folder.path(), wrong);
        let said = program::stderr(&output);
        assert_eq!(output.status.code(), Some(1), "{wrong}: {said}");
        for word in ["thermal", "`temperature`", rows, "8", "`particles`"] {
            assert!(said.contains(word), "{wrong}: {word} is not in: {said}");
        }
    }
    let output = run(folder.path(), "rows=8");
    assert!(output.status.success(), "{}", program::stderr(&output));
}

#[test]
fn what_is_no_number_is_refused_and_names_do_not_reach_the_terminal_raw() {
    let folder = program::folder(&[("scene.toml", SCENE)]);
    for (wrong, word) in [("energy", "`heat`"), ("figure", "`heat flux`")] {
        let output = run(folder.path(), wrong);
        let said = program::stderr(&output);
        assert_eq!(output.status.code(), Some(1), "{wrong}: {said}");
        assert!(said.contains(word) && said.contains("NaN") && said.contains("thermal"), "{wrong}: {said}");
    }
    let output = run(folder.path(), "name");
    assert!(output.status.success(), "{}", program::stderr(&output));
    let info = program::stagger(folder.path(), &["info", "run.mcap"]);
    for text in [program::stdout(&output), program::stderr(&output), program::stdout(&info)] {
        assert!(!text.contains(['\u{1b}', '\u{7}']) && text.len() < 20_000, "{text}");
    }
    assert!(program::stdout(&output).contains("[31mred"), "{}", program::stdout(&output));
}

#[test]
fn verify_says_who_answered_and_whom_it_did_not_check() {
    let folder = program::folder(&[("scene.toml", SCENE)]);
    assert!(run(folder.path(), "rows=8").status.success());
    // A program that read less than the physics in whose place it answered: that cannot be solved from what it read.
    let output = program::stagger(folder.path(), &["verify", "run.mcap"]);
    let text = program::stdout(&output);
    assert_eq!(output.status.code(), Some(0), "{text}{}", program::stderr(&output));
    assert!(text.contains("thermal      not checked: `") && text.contains("answered when it was recorded"), "{text}");
    assert!(text.contains("as_a_node") && text.contains("no difference in what was solved again"), "{text}");
    // One that is the physics itself, in a process of its own: it is said who answered.
    let stagger = env!("CARGO_BIN_EXE_stagger");
    let shell = "exec \"$0\" node thermal --name thermal --run \"$STAGGER_RUN\" --connect \"$STAGGER_CONNECT\" --scene scene.toml";
    std::fs::write(folder.path().join("thermal.sh"), shell.replace("$0", stagger)).unwrap();
    let run = ["run", "scene.toml", "--record", "itself.mcap", "--node", "thermal=sh thermal.sh"];
    let output = program::stagger(folder.path(), &run);
    assert!(output.status.success(), "{}", program::stderr(&output));
    let output = program::stagger(folder.path(), &["verify", "itself.mcap"]);
    let text = program::stdout(&output);
    assert!(output.status.success(), "{text}{}", program::stderr(&output));
    assert!(
        text.contains("when it was recorded `sh thermal.sh` answered") && text.contains("no difference\n"),
        "{text}"
    );
    // A node of one's own is not solved again, and that is no `no difference`.
    let own = std::env::current_exe().unwrap();
    let command = format!("[{own:?}, \"--exact\", \"rows_not_checked::as_a_node\", \"--nocapture\"]");
    let scene = format!("{}\n[nodes.thermal]\ncommand = {command}\n", SCENE.replace("[thermal]\n", ""));
    std::fs::write(folder.path().join("own.toml"), scene).unwrap();
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_stagger"));
    let output = command.args(["run", "own.toml"]).env(WRONG, "rows=8").current_dir(folder.path()).output().unwrap();
    assert!(output.status.success(), "{}", program::stderr(&output));
    let output = program::stagger(folder.path(), &["verify", "own.mcap"]);
    let text = program::stdout(&output);
    assert_eq!(output.status.code(), Some(0), "{text}");
    assert!(text.contains("thermal      not checked: a program of your own"), "{text}");
    assert!(text.contains("no difference in what was solved again") && !text.contains("hash"), "{text}");
    let json = program::stagger(folder.path(), &["verify", "own.mcap", "--json"]);
    let json: serde_json::Value = serde_json::from_slice(&json.stdout).unwrap();
    assert!(json["unchecked"]["thermal"].as_str().unwrap().contains("as_a_node"), "{json}");
}
