//! The command line: raw arguments, then a validated scene, then the work. Results on stdout, diagnostics on stderr.

mod arguments;
mod author;
mod out;
mod tradeoff;

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    process::ExitCode,
    sync::atomic::Ordering,
};

pub use arguments::Arguments;
pub(crate) use arguments::key_value;
use arguments::{Command, NodeArguments, OutputArguments, ReplayArguments, RunArguments, SceneArguments};
use stagger_messages::keys;
use stagger_recordings::{Recording, Summary as RecordingSummary};
use stagger_solver::{Shown, scene::Scene};

use crate::{
    advise, check, check_json,
    coordinator::RunError,
    diagnostics,
    graph::Format,
    interrupt,
    link::{Link, Role},
    node,
    replay::{self, Pace},
    replayed::Replays,
    resume, router,
    run::{self, Failed, Options},
    scene_files, verify, view, watchdog, words,
};

/// Exit codes beside 0, done: 1 failed, 2 usage or bad scene, 3 finished with something missing.
const FAILED: u8 = 1;
const USAGE: u8 = 2;
const MISSING: u8 = 3;

/// What a command ends with.
enum End {
    Done,
    Code(u8, String),
    Silent(u8),
}

/// Runs a command.
#[must_use]
pub fn main(arguments: Arguments) -> ExitCode {
    if let Err(error) = set_width() {
        diagnostics::error(&error);
        return ExitCode::from(USAGE);
    }
    let end = match arguments.command {
        Command::Run(arguments) => run_scene(arguments),
        Command::Check { scene, graph, advise, within, json } => {
            check_scene(&scene, graph, advise.then_some(within), json)
        }
        Command::Node(arguments) => run_node(arguments),
        Command::Conformance(arguments) => author::conformance(arguments),
        Command::NewNode { name, stagger } => author::new_node(&name, stagger),
        Command::Coordinator { scene, meeting, run, replayed, output, config } => {
            let role = match meeting.connect {
                Some(connect) => Role::Node { connect },
                None => Role::Hub { listen: meeting.listen },
            };
            match recorded(replayed, &BTreeMap::new()) {
                Ok(replays) => {
                    let options = Options { by_hand: Some(role), name: run, config, replays, ..Options::default() };
                    coordinate(&scene, &output, None, options)
                }
                Err(end) => end,
            }
        }
        Command::Router { listen, config, child } => {
            let options = router::Options { listen, config, child };
            router::run(options, &interrupt::flag()).map_or_else(|error| failed(&error), |()| End::Done)
        }
        Command::Replay(arguments) => replay_file(arguments),
        Command::Verify { file, node, with, tolerance, json } => {
            verify_file(&file, node.as_deref(), with.as_deref(), tolerance, json)
        }
        Command::Info { file, json } => info(&file, json),
        Command::Report { file, out } => out::report(&file, out),
        Command::Export(arguments) => out::export(&arguments),
        Command::Tradeoff(arguments) => tradeoff::tradeoff(arguments),
        Command::View { what, save, connect, web, contacts, velocities } => {
            let mut arguments = Vec::new();
            if let Some(save) = save {
                arguments.extend(["--save".into(), save.display().to_string()]);
            }
            if let Some(connect) = connect {
                arguments.extend(["--connect".into(), connect]);
            }
            if web {
                arguments.push(view::WEB.into());
            }
            if contacts {
                arguments.push("--contacts".into());
            }
            if velocities {
                arguments.push("--velocities".into());
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

fn read_scene(path: &Path, overrides: &[(String, String)], files: Option<&Path>) -> Result<Scene, End> {
    let text = std::fs::read_to_string(path).map_err(|error| {
        let hint = "expected the path of a scene, such as scenes/quick.toml";
        End::Code(USAGE, format!("cannot read the scene {}: {error}\nhint: {hint}", path.display()))
    })?;
    scene_files::parse(&text, path, overrides, files)
        .map_err(|problems| End::Code(USAGE, format!("the scene is not valid\n{problems}")))
}

/// Takes the width of the kernels from the environment, which a run's nodes inherit.
fn set_width() -> Result<(), String> {
    match std::env::var("STAGGER_SIMD") {
        Ok(name) => stagger_solver::width::set(&name).map_err(|error| format!("STAGGER_SIMD: {error}")),
        Err(std::env::VarError::NotPresent) => Ok(()),
        Err(error) => Err(format!("STAGGER_SIMD: {error}")),
    }
}

fn set_threads(threads: Option<u16>) {
    let Some(threads) = threads else { return };
    if let Err(error) = rayon::ThreadPoolBuilder::new().num_threads(threads.into()).build_global() {
        diagnostics::warn(&format!("cannot set the number of threads: {error}"));
    }
}

fn run_scene(arguments: RunArguments) -> End {
    let mut commands = BTreeMap::new();
    for (node, command) in arguments.nodes {
        if let Err(error) = keys::check_name(&node) {
            return End::Code(USAGE, format!("--node {node}: {error}"));
        }
        match words::split(&command) {
            Ok(words) => commands.insert(node, words),
            Err(error) => return End::Code(USAGE, format!("--node {node}={command}: {error}")),
        };
    }
    let replays = match recorded(arguments.replayed, &commands) {
        Ok(replays) => replays,
        Err(end) => return end,
    };
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
        replays,
        view,
        ..Options::default()
    };
    coordinate(&arguments.scene, &arguments.output, arguments.resume.as_deref(), options)
}

/// The recordings that `--replayed` names, where nothing else runs their nodes.
fn recorded(replayed: Vec<(String, String)>, commands: &BTreeMap<String, Vec<String>>) -> Result<Replays, End> {
    let mut files = BTreeMap::new();
    for (node, file) in replayed {
        if commands.contains_key(&node) || files.insert(node.clone(), PathBuf::from(file)).is_some() {
            return Err(End::Code(USAGE, format!("--replayed {node}: what runs `{node}` is said twice")));
        }
    }
    Ok(Replays { files, ..Replays::default() })
}

fn coordinate(arguments: &SceneArguments, output: &OutputArguments, resume: Option<&str>, options: Options) -> End {
    // A recording holds the files of its scene.
    let files = arguments.files.clone().or_else(|| resume.map(|resume| resume::parts(resume).0.into()));
    let overrides = arguments.overrides();
    let scene = match read_scene(&arguments.scene, &overrides, files.as_deref()) {
        Ok(scene) => scene,
        Err(end) => return end,
    };
    // A scene that cannot run is told before anything is started; with commands the ports are known only later.
    if options.commands.is_empty()
        && options.replays.files.is_empty()
        && let Err(error) = check::check(&scene)
    {
        return End::Code(USAGE, format!("the scene cannot run: {error}"));
    }
    let replays = match Replays::new(options.replays.files, &scene) {
        Ok(replays) => replays,
        Err(error) => return End::Code(USAGE, error.to_string()),
    };
    let resume = match resume.map(|resume| resume::resume(resume, &scene)).transpose() {
        Ok(resume) => resume,
        Err(error) => return End::Code(USAGE, error.to_string()),
    };
    let stem = arguments.scene.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    // Beside the recording it goes on from, not over it.
    let default = || match &resume {
        None => PathBuf::from(format!("{stem}.mcap")),
        Some((_, step)) => PathBuf::from(format!("{stem}-from-{step}.mcap")),
    };
    let record = if output.no_record { None } else { Some(output.record.clone().unwrap_or_else(default)) };
    let options = Options {
        scene: arguments.scene.clone(),
        overrides,
        files,
        record: record.clone(),
        resume: resume.map(|(checkpoint, _)| checkpoint),
        replays,
        ..options
    };
    let summary = match run::run(&scene, options, &interrupt::flag()) {
        Ok(summary) => summary,
        Err(Failed::Run(RunError::Plan(error))) => return End::Code(USAGE, format!("the scene cannot run: {error}")),
        Err(error) => {
            let kept = record.filter(|path| path.is_file()).map(|path| {
                format!("\nhint: what was recorded until then is in {}{}", path.display(), how_to_go_on(&path))
            });
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
        End::Code(MISSING, format!("stopped at t = {:e} s on request", Shown(summary.steps.time_s)))
    } else if !summary.missing.is_empty() {
        End::Code(MISSING, format!("{} ended without saying what their fields held", summary.missing.join(", ")))
    } else if lost > 0 {
        End::Code(MISSING, format!("{lost} messages are missing from the recording"))
    } else {
        End::Done
    }
}

/// How to go on from a recording, where that is possible.
fn how_to_go_on(path: &Path) -> String {
    let checkpoint = Recording::open(path).and_then(|recording| recording.checkpoint(None));
    let Ok(Some(checkpoint)) = checkpoint else { return String::new() };
    let step = checkpoint.version().step;
    format!("; the same command with --resume {} goes on from step {step}", path.display())
}

fn check_scene(arguments: &SceneArguments, graph: Option<Format>, within: Option<f64>, json: bool) -> End {
    let overrides = arguments.overrides();
    let scene = match read_scene(&arguments.scene, &overrides, arguments.files.as_deref()) {
        Ok(scene) => scene,
        Err(end) => return end,
    };
    // What a preset sets is read where it applies.
    for preset in &scene.presets {
        let chosen: Vec<_> = overrides.iter().cloned().chain([("preset".into(), format!("{preset:?}"))]).collect();
        if let Err(end) = read_scene(&arguments.scene, &chosen, arguments.files.as_deref()) {
            diagnostics::note(&format!("with the preset {preset}:"));
            return end;
        }
    }
    if json {
        let report = check_json::report(&scene, within);
        if let Err(end) = print_json(&report) {
            return end;
        }
        return report.problem.map_or(End::Done, |problem| End::Code(USAGE, problem));
    }
    match check::check_whole(&scene, &arguments.scene) {
        Ok(checked) => {
            check::warnings(&scene, &checked.plan).iter().for_each(|warning| diagnostics::warn(warning));
            let text = match (graph, within) {
                (Some(format), _) => check::graph(&scene, &checked, format),
                (None, Some(within)) => match advise::describe(&scene, within) {
                    Ok(text) => text,
                    Err(error) => return End::Code(USAGE, format!("the scene cannot run: {error}")),
                },
                (None, None) => check::describe(&scene, &checked),
            };
            print(text.trim_end());
            End::Done
        }
        Err(error) => End::Code(USAGE, format!("the scene cannot run: {error}")),
    }
}

fn run_node(arguments: NodeArguments) -> End {
    // Before anything that may take its time, and needs to be ended with the run.
    if let Err(error) = watchdog::start(arguments.child) {
        return failed(&format!("cannot watch for the end of the run: {error}"));
    }
    let scene = match read_scene(&arguments.scene, &arguments.overrides, arguments.files.as_deref()) {
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
        replayed: arguments.replayed,
    };
    match node::told(node::run(&scene, &options), &options.name, options.child) {
        Ok(()) => End::Done,
        Err(None) => End::Silent(FAILED),
        Err(Some(why)) => End::Code(FAILED, why),
    }
}

fn replay_file(arguments: ReplayArguments) -> End {
    let recording = match Recording::open(&arguments.file) {
        Ok(recording) => recording,
        Err(error) => return about(&arguments.file, &error),
    };
    let going = interrupt::flag();
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
    let result =
        Link::open(&Role::Hub { listen: vec![endpoint.name.clone()] }, None).map_err(Into::into).and_then(|link| {
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

fn verify_file(file: &Path, node: Option<&str>, with: Option<&str>, tolerance: f64, json: bool) -> End {
    let with = match with.map(words::split).transpose() {
        Ok(with) => with,
        Err(error) => return End::Code(USAGE, format!("--with: {error}")),
    };
    let verified = Recording::open(file).map_err(Into::into).and_then(|recording| match (node, with) {
        (Some(node), Some(command)) => verify::verify_with(&recording, node, command, tolerance),
        _ => verify::verify(&recording, node, tolerance),
    });
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
        None if verified.trials.is_empty() && verified.complete && !verified.unchecked.is_empty() => {
            End::Code(MISSING, "no node of the recording was solved again".into())
        }
        None if !verified.complete => {
            let how = verified.damage.map_or("is cut off".into(), |why| format!("is damaged ({why})"));
            End::Code(MISSING, format!("the recording {how}; what it holds before that is verified"))
        }
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
    match summary.damage {
        Some(damage) => End::Code(MISSING, format!("{}: {damage}", file.display())),
        None if !summary.complete => End::Code(MISSING, format!("{} is cut off", file.display())),
        None => End::Done,
    }
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
