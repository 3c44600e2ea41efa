//! The command line: raw arguments, then a validated scene, then the work. Results on stdout, diagnostics on stderr.

use std::{
    path::{Path, PathBuf},
    process::ExitCode,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
};

use clap::{Args, Parser, Subcommand};
use stagger_messages::keys;
use stagger_recordings::{Recording, Summary as RecordingSummary};
use stagger_solver::scene::Scene;

use crate::{
    check,
    coordinator::RunError,
    diagnostics,
    host::NodeEnd,
    link::{Link, Role},
    node,
    replay::{self, Pace},
    run::{self, Failed, Options},
    verify, view,
};

/// Exit codes beside 0, done: 1 failed, 2 usage or bad scene, 3 finished with something missing.
const FAILED: u8 = 1;
const USAGE: u8 = 2;
const MISSING: u8 = 3;

/// Particle-based additive manufacturing as a co-simulation: one process per physics, every exchange recorded.
///
/// Exit codes: 0 done, 1 failed, 2 usage or bad scene, 3 finished with something missing.
#[derive(Debug, Parser)]
#[command(name = "stagger", version, arg_required_else_help = true)]
pub struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Run a scene: starts a process for each physics it names, couples them, records every exchange
    Run(RunArguments),
    /// Validate a scene; show its settings and who reads what from whom
    Check {
        #[command(flatten)]
        scene: SceneArguments,
    },
    /// Run one physics of a scene as a node of a run started elsewhere
    Node(NodeArguments),
    /// Coordinate a scene whose nodes are started by hand
    Coordinator {
        #[command(flatten)]
        scene: SceneArguments,
        /// Endpoint to listen on: tcp/127.0.0.1:7447, unixsock-stream//tmp/hub.sock
        #[arg(long)]
        listen: String,
        #[command(flatten)]
        output: OutputArguments,
        /// Zenoh configuration file
        #[arg(long)]
        config: Option<PathBuf>,
    },
    /// Publish a recording as the live run did
    Replay(ReplayArguments),
    /// Solve the nodes again from the recorded frozen fields and compare bit for bit
    Verify {
        /// The recording
        file: PathBuf,
        /// Only this node
        #[arg(long)]
        node: Option<String>,
        /// Largest difference as a share of the field's largest value; 0 asks for equal bits
        #[arg(long, default_value_t = 0.0, value_parser = not_negative)]
        tolerance: f64,
        /// Print the result as JSON
        #[arg(long)]
        json: bool,
    },
    /// Tell what is in a recording; exit 3 when it is cut off
    Info {
        /// The recording
        file: PathBuf,
        /// Print as JSON
        #[arg(long)]
        json: bool,
    },
    /// Show a recording, or a run that is going on, in Rerun
    View {
        /// A recording, or the name of a run on this host
        what: String,
        /// Save a Rerun recording instead of opening a viewer
        #[arg(long)]
        save: Option<PathBuf>,
        /// Connect to a viewer that runs already, such as rerun+http://127.0.0.1:9876/proxy
        #[arg(long)]
        connect: Option<String>,
        /// Draw the contacts too
        #[arg(long)]
        contacts: bool,
    },
}

#[derive(Debug, Args)]
struct SceneArguments {
    /// The scene, a TOML file
    scene: PathBuf,
    /// Set a key of the scene: coupling.iterations=6
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = key_value)]
    overrides: Vec<(String, String)>,
}

#[derive(Debug, Args)]
struct OutputArguments {
    /// Recording to write; by default the scene's name with .mcap in the working directory
    #[arg(long, value_name = "FILE", conflicts_with = "no_record")]
    record: Option<PathBuf>,
    /// Write no recording
    #[arg(long)]
    no_record: bool,
    /// Print the summary as JSON (docs/summary.md)
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Args)]
struct RunArguments {
    #[command(flatten)]
    scene: SceneArguments,
    #[command(flatten)]
    output: OutputArguments,
    /// Run the nodes as threads of one process
    #[arg(long)]
    in_process: bool,
    /// Threads of each node; by default one per core. The results do not depend on it
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
    /// Run a node by a command of your own
    #[arg(long = "node", value_name = "NODE=COMMAND", value_parser = key_value)]
    nodes: Vec<(String, String)>,
    /// Show the run in Rerun while it goes on
    #[arg(long)]
    view: bool,
}

#[derive(Debug, Args)]
struct NodeArguments {
    /// The physics: particles, thermal, optics
    kind: String,
    /// Its name in the run; by default that of the physics
    #[arg(long)]
    name: Option<String>,
    /// The scene
    #[arg(long)]
    scene: PathBuf,
    /// Set a key of the scene, as the coordinator was told
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = key_value)]
    overrides: Vec<(String, String)>,
    /// The coordinator's endpoint
    #[arg(long)]
    connect: String,
    /// Name of the run, as the coordinator says
    #[arg(long)]
    run: String,
    /// Threads
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
    /// Zenoh configuration file
    #[arg(long)]
    config: Option<PathBuf>,
    /// End when the standard input closes, and leave Ctrl-C to the parent
    #[arg(long, hide = true)]
    child: bool,
}

#[derive(Debug, Args)]
struct ReplayArguments {
    /// The recording
    file: PathBuf,
    /// Times faster than it was recorded; `inf` waits for nothing
    #[arg(long, default_value_t = 1.0, value_parser = positive)]
    speed: f64,
    /// Wait for Enter before each step
    #[arg(long)]
    step: bool,
    /// Start at once instead of waiting for a first subscriber
    #[arg(long)]
    now: bool,
    /// Simulated time to start from, in s
    #[arg(long, default_value_t = 0.0)]
    from: f64,
    /// Simulated time to end at, in s
    #[arg(long, default_value_t = f64::INFINITY)]
    to: f64,
    /// Endpoint to listen on; by default a socket that is printed
    #[arg(long)]
    listen: Option<String>,
}

fn key_value(text: &str) -> Result<(String, String), String> {
    let (key, value) = text.split_once('=').ok_or_else(|| format!("expected KEY=VALUE, found `{text}`"))?;
    Ok((key.trim().into(), value.trim().into()))
}

fn positive(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|value| *value > 0.0).ok_or_else(|| format!("expected a number above 0, found `{text}`"))
}

fn not_negative(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|value| *value >= 0.0).ok_or_else(|| format!("expected 0 or more, found `{text}`"))
}

/// What a command ends with.
enum End {
    Done,
    Code(u8, String),
    Silent(u8),
}

/// Runs a command.
#[must_use]
pub fn main(arguments: Arguments) -> ExitCode {
    let end = match arguments.command {
        Command::Run(arguments) => run_scene(arguments),
        Command::Check { scene } => check_scene(&scene),
        Command::Node(arguments) => run_node(arguments),
        Command::Coordinator { scene, listen, output, config } => {
            let options = Options { listen: Some(listen), config, ..Options::default() };
            coordinate(&scene, &output, options)
        }
        Command::Replay(arguments) => replay_file(arguments),
        Command::Verify { file, node, tolerance, json } => verify_file(&file, node.as_deref(), tolerance, json),
        Command::Info { file, json } => info(&file, json),
        Command::View { what, save, connect, contacts } => {
            let mut arguments = Vec::new();
            if let Some(save) = save {
                arguments.extend(["--save".into(), save.display().to_string()]);
            }
            if let Some(connect) = connect {
                arguments.extend(["--connect".into(), connect]);
            }
            if contacts {
                arguments.push("--contacts".into());
            }
            show(&what, &arguments)
        }
    };
    match end {
        End::Done => ExitCode::SUCCESS,
        End::Silent(code) => ExitCode::from(code),
        End::Code(code, message) => {
            diagnostics::error(&message);
            ExitCode::from(code)
        }
    }
}

#[expect(clippy::print_stdout, reason = "the one place results are printed")]
fn print(result: &str) {
    println!("{result}");
}

fn failed(error: &dyn std::fmt::Display) -> End {
    End::Code(FAILED, error.to_string())
}

fn about(file: &Path, error: &dyn std::fmt::Display) -> End {
    End::Code(FAILED, format!("{}: {error}", file.display()))
}

fn read_scene(path: &Path, overrides: &[(String, String)]) -> Result<Scene, End> {
    let text = std::fs::read_to_string(path).map_err(|error| {
        let hint = "expected the path of a scene, such as scenes/quick.toml";
        End::Code(USAGE, format!("cannot read the scene {}: {error}\nhint: {hint}", path.display()))
    })?;
    Scene::parse(&text, &path.display().to_string(), overrides)
        .map_err(|problems| End::Code(USAGE, format!("the scene is not valid\n{problems}")))
}

/// A flag that Ctrl-C, or the system's request to end, sets.
fn interrupt() -> Arc<AtomicBool> {
    let flag = Arc::new(AtomicBool::new(false));
    let set = Arc::clone(&flag);
    if let Err(error) = ctrlc::set_handler(move || set.store(true, Ordering::Relaxed)) {
        diagnostics::warn(&format!("Ctrl-C will end the run at once: {error}"));
    }
    flag
}

fn set_threads(threads: Option<u16>) {
    let Some(threads) = threads else { return };
    if let Err(error) = rayon::ThreadPoolBuilder::new().num_threads(threads.into()).build_global() {
        diagnostics::warn(&format!("cannot set the number of threads: {error}"));
    }
}

fn run_scene(arguments: RunArguments) -> End {
    let mut commands = std::collections::BTreeMap::new();
    for (node, command) in arguments.nodes {
        if let Err(error) = keys::check_name(&node) {
            return End::Code(USAGE, format!("--node {node}: {error}"));
        }
        commands.insert(node, command.split_whitespace().map(str::to_owned).collect());
    }
    let view = match (arguments.view, view::bridge()) {
        (false, _) => None,
        (true, Some(bridge)) => Some(bridge),
        (true, None) => return End::Code(FAILED, view::HOW_TO_GET.into()),
    };
    if arguments.in_process {
        set_threads(arguments.threads);
    }
    let options = Options {
        in_process: arguments.in_process,
        threads: arguments.threads.map(usize::from),
        commands,
        view,
        ..Options::default()
    };
    coordinate(&arguments.scene, &arguments.output, options)
}

fn coordinate(arguments: &SceneArguments, output: &OutputArguments, options: Options) -> End {
    let scene = match read_scene(&arguments.scene, &arguments.overrides) {
        Ok(scene) => scene,
        Err(end) => return end,
    };
    // A scene that cannot run is told before anything is started; with commands the ports are known only later.
    if options.commands.is_empty()
        && let Err(error) = check::check(&scene)
    {
        return End::Code(USAGE, format!("the scene cannot run: {error}"));
    }
    let default =
        || PathBuf::from(format!("{}.mcap", arguments.scene.file_stem().unwrap_or_default().to_string_lossy()));
    let record = if output.no_record { None } else { Some(output.record.clone().unwrap_or_else(default)) };
    let options = Options {
        scene: arguments.scene.clone(),
        overrides: arguments.overrides.clone(),
        record: record.clone(),
        ..options
    };
    let summary = match run::run(&scene, options, &interrupt()) {
        Ok(summary) => summary,
        Err(Failed::Run(RunError::Plan(error))) => return End::Code(USAGE, format!("the scene cannot run: {error}")),
        Err(error) => {
            let kept = record
                .filter(|path| path.is_file())
                .map(|path| format!("\nhint: what was recorded until then is in {}", path.display()));
            return failed(&format!("{error}{}", kept.unwrap_or_default()));
        }
    };
    if output.json {
        if let Err(end) = print_json(&summary) {
            return end;
        }
    } else {
        print(&summary.to_string());
    }
    let lost = summary.recording.as_ref().map_or(0, |recording| recording.lost);
    if !summary.completed {
        End::Code(MISSING, format!("stopped at t = {:e} s on request", summary.steps.time_s))
    } else if !summary.missing.is_empty() {
        End::Code(MISSING, format!("{} ended without saying what their fields held", summary.missing.join(", ")))
    } else if lost > 0 {
        End::Code(MISSING, format!("{lost} messages are missing from the recording"))
    } else {
        End::Done
    }
}

fn check_scene(arguments: &SceneArguments) -> End {
    let scene = match read_scene(&arguments.scene, &arguments.overrides) {
        Ok(scene) => scene,
        Err(end) => return end,
    };
    match check::describe(&scene) {
        Ok(text) => {
            print(text.trim_end());
            End::Done
        }
        Err(error) => End::Code(USAGE, format!("the scene cannot run: {error}")),
    }
}

fn run_node(arguments: NodeArguments) -> End {
    let scene = match read_scene(&arguments.scene, &arguments.overrides) {
        Ok(scene) => scene,
        Err(end) => return end,
    };
    set_threads(arguments.threads);
    let options = node::Options {
        name: arguments.name.unwrap_or_else(|| arguments.kind.clone()),
        kind: arguments.kind,
        run: arguments.run,
        connect: arguments.connect,
        child: arguments.child,
        config: arguments.config,
    };
    match node::run(&scene, &options) {
        Ok(NodeEnd::Stopped { completed: true, .. }) => End::Done,
        // The parent tells why.
        Ok(NodeEnd::Stopped { .. }) if options.child => End::Silent(FAILED),
        Ok(NodeEnd::Stopped { reason, .. }) => End::Code(FAILED, format!("the run ended early: {reason}")),
        Ok(NodeEnd::Abandoned) => End::Code(FAILED, format!("`{}`: the coordinator is gone", options.name)),
        Err(error) => failed(&error),
    }
}

fn replay_file(arguments: ReplayArguments) -> End {
    let recording = match Recording::open(&arguments.file) {
        Ok(recording) => recording,
        Err(error) => return about(&arguments.file, &error),
    };
    let going = interrupt();
    // Beside the run itself and beside other replays of it.
    let name = format!("{}-replay-{}", recording.info.run, std::process::id());
    let named = keys::check_name(&name).map_err(|error| failed(&error));
    let endpoint = match named
        .and_then(|name| run::Endpoint::new(name, arguments.listen.as_deref()).map_err(|error| failed(&error)))
    {
        Ok(endpoint) => endpoint,
        Err(end) => return end,
    };
    let pace = Pace {
        speed: arguments.speed,
        step: arguments.step,
        at_once: arguments.now,
        from_s: arguments.from,
        to_s: arguments.to,
    };
    let result = Link::open(&Role::Hub { listen: endpoint.name.clone() }, None).map_err(Into::into).and_then(|link| {
        let waits = if pace.at_once { "" } else { ", as soon as somebody subscribes" };
        diagnostics::note(&format!("replaying run {} on {}{waits}", recording.info.run, endpoint.name));
        replay::replay(&recording, &link, &pace, &|| !going.load(Ordering::Relaxed))
    });
    match result {
        Ok(sent) => {
            print(&format!("replayed {sent} messages"));
            End::Done
        }
        Err(error) => about(&arguments.file, &error),
    }
}

fn verify_file(file: &Path, node: Option<&str>, tolerance: f64, json: bool) -> End {
    let verified =
        Recording::open(file).map_err(Into::into).and_then(|recording| verify::verify(&recording, node, tolerance));
    let verified = match verified {
        Ok(verified) => verified,
        Err(error) => return about(file, &error),
    };
    if json {
        if let Err(end) = print_json(&verified) {
            return end;
        }
    } else {
        print(&verified.to_string());
    }
    match verified.difference {
        Some(_) => End::Code(FAILED, "the recording and the solution differ".into()),
        None if !verified.complete => End::Code(MISSING, "the recording is cut off; what it holds is verified".into()),
        None => End::Done,
    }
}

/// Prints a result as JSON.
fn print_json(result: &impl serde::Serialize) -> Result<(), End> {
    serde_json::to_string_pretty(result).map(|json| print(&json)).map_err(|error| failed(&error))
}

fn info(file: &Path, json: bool) -> End {
    let summary = Recording::open(file).and_then(|recording| RecordingSummary::of(&recording));
    let summary = match summary {
        Ok(summary) => summary,
        Err(error) => return about(file, &error),
    };
    if json {
        if let Err(end) = print_json(&summary) {
            return end;
        }
    } else {
        print(summary.to_string().trim_end());
    }
    if summary.complete { End::Done } else { End::Code(MISSING, format!("{} is cut off", file.display())) }
}

fn show(what: &str, arguments: &[String]) -> End {
    let Some(bridge) = view::bridge() else { return End::Code(FAILED, view::HOW_TO_GET.into()) };
    let status = if Path::new(what).is_file() {
        view::file(&bridge, what, arguments).map_err(|error| error.to_string())
    } else {
        view::live(&bridge, what, arguments).map_err(|error| error.to_string())
    };
    match status {
        Ok(status) if status.success() => End::Done,
        Ok(status) => End::Code(FAILED, format!("stagger-view ended with {status}")),
        Err(error) => End::Code(FAILED, format!("cannot show {what}: {error}")),
    }
}
