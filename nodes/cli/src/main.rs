//! The command line: raw arguments, then a validated scene, then the work. Results on stdout, diagnostics on stderr.

mod arguments;
mod author;
mod out;
mod run;
mod stdout;
mod tradeoff;

use stagger_runtime::{
    diagnostics,
    launch::{environment, watchdog, words},
    link::{Link, Role, endpoint::Endpoint, router},
    node,
    run::{
        Options, interrupt,
        outputs::{Inputs, Replace},
        scene_files::SceneFile,
        view,
    },
};
use stagger_tools::{
    check::{self, advise, graph::Format},
    replay::{self, Pace, ReplayError},
    verify,
};
use std::{ffi::OsString, io::Write as _, path::Path, process::ExitCode, sync::atomic::Ordering};

use arguments::{Arguments, Command, NodeArguments, ReplayArguments, SceneArguments};
use clap::Parser as _;
use stagger_messages::keys;
use stagger_recordings::{Recording, RecordingError, Summary as RecordingSummary};
use stagger_scene::Scene;
use stdout::print;

/// Exit codes beside 0, done: 1 failed, 2 usage or bad scene, 3 finished with something missing.
const FAILED: u8 = 1;
const USAGE: u8 = 2;
const MISSING: u8 = 3;
/// What files of Rerun begin with, whatever their version.
const RERUN: &str = "RRF";

/// What a command ends with.
enum End {
    Done,
    Code(u8, String),
    Silent(u8),
}

/// Runs the command that this process was started with.
fn main() -> ExitCode {
    let end = match Arguments::try_parse() {
        Ok(arguments) => obey(arguments),
        Err(answer) => told_by_clap(&answer),
    };
    let (code, message) = match end {
        End::Done => (0, None),
        End::Silent(code) => (code, None),
        End::Code(code, message) => (code, Some(message)),
    };
    // What was asked for was done, but nobody can read it.
    let unread = stdout::failure();
    let code = if unread.is_some() { FAILED } else { code };
    for message in message.into_iter().chain(unread) {
        diagnostics::error(&message);
    }
    ExitCode::from(code)
}

/// Help and versions go to standard output, what is wrong with the arguments to standard error.
fn told_by_clap(answer: &clap::Error) -> End {
    let printed = answer.print().and_then(|()| std::io::stdout().flush());
    if answer.use_stderr() {
        // There is nowhere else to say it.
        return End::Silent(USAGE);
    }
    if let Err(error) = printed {
        stdout::note_failure(error);
    }
    End::Done
}

fn obey(arguments: Arguments) -> End {
    if let Err(error) = environment::check().map_err(|error| error.to_string()).and_then(|()| set_width()) {
        return End::Code(USAGE, error);
    }
    let threads = environment::set_threads(match &arguments.command {
        Command::Run(arguments) => arguments.threads,
        Command::Node(arguments) => arguments.threads,
        Command::Tradeoff(arguments) => arguments.threads,
        _ => None,
    });
    match arguments.command {
        Command::Run(arguments) => run::run(arguments, threads),
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
            run::coordinate(
                &scene,
                &output,
                replayed,
                Options { by_hand: Some(role), name: run, config, ..Options::default() },
            )
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
        Command::Report { file, out, overwrite } => out::report(&file, out, overwrite),
        Command::Export(arguments) => out::export(&arguments),
        Command::Tradeoff(arguments) => tradeoff::tradeoff(arguments, threads),
        Command::View { what, save, overwrite, connect, web, contacts, velocities } => {
            let mut arguments: Vec<OsString> = Vec::new();
            if let Some(save) = save {
                let replace = Replace::own(RERUN, overwrite);
                let inputs = Inputs::new().with("the recording", Path::new(&what));
                if let Err(error) = inputs.spare(&save).and_then(|()| replace.allows(&save)) {
                    return End::Code(USAGE, error.to_string());
                }
                arguments.extend(["--save".into(), save.into()]);
            }
            if let Some(connect) = connect {
                arguments.extend(["--connect".into(), connect.into()]);
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
    }
}

fn failed(error: &dyn std::fmt::Display) -> End {
    End::Code(FAILED, error.to_string())
}

fn about(file: &Path, error: &dyn std::fmt::Display) -> End {
    End::Code(FAILED, format!("{}: {error}", file.display()))
}

/// Reads a scene once; what is made of it is parsed from that.
fn read_scene(path: &Path) -> Result<SceneFile, End> {
    SceneFile::read(path).map_err(|error| {
        let hint = "expected the path of a scene, such as scenes/quick.toml, or - for standard input";
        End::Code(USAGE, format!("cannot read the scene {}: {error}\nhint: {hint}", path.display()))
    })
}

fn parse(file: &SceneFile, overrides: &[(String, String)], files: Option<&Path>) -> Result<Scene, End> {
    file.parse(overrides, files).map_err(|problems| End::Code(USAGE, format!("the scene is not valid\n{problems}")))
}

/// Takes the width of the kernels from the environment, which a run's nodes inherit.
fn set_width() -> Result<(), String> {
    match std::env::var("STAGGER_SIMD") {
        Ok(name) => stagger_physics::common::width::set(&name).map_err(|error| format!("STAGGER_SIMD: {error}")),
        Err(std::env::VarError::NotPresent) => Ok(()),
        Err(error) => Err(format!("STAGGER_SIMD: {error}")),
    }
}

fn check_scene(arguments: &SceneArguments, graph: Option<Format>, within: Option<f64>, json: bool) -> End {
    let overrides = arguments.overrides();
    let files = arguments.files.as_deref();
    let read = read_scene(&arguments.scene).and_then(|file| Ok((parse(&file, &overrides, files)?, file)));
    let (scene, file) = match read {
        Ok(read) => read,
        Err(end) => return end,
    };
    // What a preset sets is read where it applies.
    for preset in &scene.presets {
        let chosen: Vec<_> = overrides.iter().cloned().chain([("preset".into(), format!("{preset:?}"))]).collect();
        if let Err(end) = parse(&file, &chosen, files) {
            diagnostics::note(&format!("with the preset {preset}:"));
            return end;
        }
    }
    if json {
        let report = check::json::report(&scene, within);
        if let Err(end) = print_json(&report) {
            return end;
        }
        return report.problem.map_or(End::Done, |problem| End::Code(USAGE, problem));
    }
    match check::check_whole(&scene, &file, files) {
        Ok(checked) => {
            stagger_coupling::out_of_reach(&checked.plan, &scene.coupling)
                .iter()
                .for_each(|warning| diagnostics::warn(warning));
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
    let read =
        read_scene(&arguments.scene).and_then(|file| parse(&file, &arguments.overrides, arguments.files.as_deref()));
    let scene = match read {
        Ok(scene) => scene,
        Err(end) => return end,
    };
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
    let endpoint = named.and_then(|name| match &arguments.listen {
        Some(listen) => Ok(Endpoint::elsewhere(listen)),
        None => Endpoint::new(name).map_err(|error| failed(&error)),
    });
    let endpoint = match endpoint {
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
            // Who replays a part, or stops, does not ask for the end.
            let to_the_end = pace.to_s == f64::INFINITY && !going.load(Ordering::Relaxed);
            if recording.complete || !to_the_end {
                return End::Done;
            }
            let how = recording.shortfall();
            End::Code(MISSING, format!("{} {how}; what it holds was replayed", arguments.file.display()))
        }
        Err(ReplayError::Recording(error @ RecordingError::Damaged(_))) => {
            End::Code(MISSING, format!("{}: {error}", arguments.file.display()))
        }
        Err(error) => about(&arguments.file, &error),
    }
}

fn verify_file(file: &Path, node: Option<&str>, with: Option<&str>, tolerance: f64, json: bool) -> End {
    let with = match with.map(words::split).transpose() {
        Ok(with) => with,
        Err(error) => return End::Code(USAGE, format!("--with: {error}")),
    };
    let recording = match Recording::open(file) {
        Ok(recording) => recording,
        Err(error) => return about(file, &error),
    };
    let verified = match (node, with) {
        (Some(node), Some(command)) => verify::verify_with(&recording, node, command, tolerance),
        _ => verify::verify(&recording, node, tolerance),
    };
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
            let how = verified.damage.map_or(recording.shortfall().into(), |why| format!("is damaged ({why})"));
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
    let read = Recording::open(file).and_then(|recording| Ok((RecordingSummary::of(&recording)?, recording)));
    let (summary, recording) = match read {
        Ok(read) => read,
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
        None if !summary.complete => End::Code(MISSING, format!("{} {}", file.display(), recording.shortfall())),
        None => End::Done,
    }
}

fn show(what: &str, arguments: &[OsString]) -> End {
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
