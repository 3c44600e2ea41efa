//! `stagger run` and `stagger coordinator`.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use stagger_messages::Shown;
use stagger_messages::keys;
use stagger_recordings::Recording;
use stagger_runtime::{
    coordinator::RunError,
    launch::{
        roster::{Runs, roster},
        words,
    },
    link::zenoh_config,
    node::recorded::Replays,
    run::{
        self, Failed, Options, Stopped, interrupt,
        outputs::{Inputs, Replace},
        records::Target,
        resume,
        scene_files::SceneFile,
        summary::Summary,
        view,
    },
};
use stagger_scene::Scene;
use stagger_tools::check;

use super::{
    End, FAILED, MISSING, USAGE,
    arguments::{OutputArguments, RunArguments, SceneArguments},
    failed, parse, print, print_json, read_scene,
};

/// Runs a scene.
pub(super) fn run(arguments: RunArguments, threads: Option<usize>) -> End {
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
    let view = match (arguments.view, view::bridge()) {
        (false, _) => None,
        (true, Some(bridge)) => Some(bridge),
        (true, None) => return End::Code(FAILED, view::HOW_TO_GET.into()),
    };
    let options = Options { in_process: arguments.in_process, threads, commands, view, ..Options::default() };
    ended(conduct(&arguments.scene, &arguments.output, arguments.replayed, arguments.resume.as_deref(), options))
}

/// Coordinates nodes that are started by hand, as `options` say.
pub(super) fn coordinate(
    scene: &SceneArguments,
    output: &OutputArguments,
    replayed: Vec<(String, String)>,
    options: Options,
) -> End {
    ended(conduct(scene, output, replayed, None, options))
}

fn ended(result: Result<Summary, End>) -> End {
    let summary = match result {
        Ok(summary) => summary,
        Err(end) => return end,
    };
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

/// Runs a scene and prints its summary.
fn conduct(
    arguments: &SceneArguments,
    output: &OutputArguments,
    replayed: Vec<(String, String)>,
    resume: Option<&str>,
    options: Options,
) -> Result<Summary, End> {
    let usage = |error: &dyn std::fmt::Display| End::Code(USAGE, error.to_string());
    let replayed = recorded(replayed, &options.commands)?;
    // A recording holds the files of its scene.
    let resumed = resume.map(|resume| Path::new(resume::parts(resume).0));
    let files = arguments.files.as_deref().or(resumed);
    let overrides = arguments.overrides();
    let file = read_scene(&arguments.scene)?;
    let scene = parse(&file, &overrides, files)?;
    // A scene that cannot run is told before anything is started; with commands the ports are known only later.
    if options.commands.is_empty()
        && replayed.is_empty()
        && let Err(error) = check::check(&scene)
    {
        return Err(usage(&format!("the scene cannot run: {error}")));
    }
    let mut inputs = inputs(&file, &scene, &options, &replayed);
    for (what, path) in [("--files", arguments.files.as_deref()), ("--resume", resumed)] {
        path.into_iter().for_each(|path| inputs.add(&format!("the recording of {what}"), path));
    }
    let replays = Replays::new(replayed, &scene).map_err(|error| usage(&error))?;
    let resume = resume.map(|resume| resume::resume(resume, &scene)).transpose().map_err(|error| usage(&error))?;
    let stem = file.path.file_stem().unwrap_or_default().to_string_lossy();
    // Beside the recording it goes on from, not over it.
    let default = PathBuf::from(match &resume {
        None => format!("{stem}.mcap"),
        Some((_, step)) => format!("{stem}-from-{step}.mcap"),
    });
    let record = target(output, default, &inputs)?;
    let options = Options {
        hand_over: !file.can_be_read_again(&scene),
        scene: file.path,
        overrides,
        files: files.map(Path::to_owned),
        record,
        resume: resume.map(|(checkpoint, _)| checkpoint),
        replays,
        ..options
    };
    let summary = run::run(&scene, options, &interrupt::flag()).map_err(|Stopped { why, recording }| match why {
        Failed::Run(RunError::Plan(error)) => usage(&format!("the scene cannot run: {error}")),
        Failed::Output(error) if error.is_refusal() => usage(&error),
        why => {
            let kept = recording.map(|path| {
                format!("\nhint: what was recorded until then is in {}{}", path.display(), how_to_go_on(&path))
            });
            failed(&format!("{why}{}", kept.unwrap_or_default()))
        }
    })?;
    if output.json {
        print_json(&summary)?;
    } else {
        print(&summary.to_string());
    }
    Ok(summary)
}

/// The recordings that `--replayed` names, where nothing else runs their nodes.
fn recorded(
    replayed: Vec<(String, String)>,
    commands: &BTreeMap<String, Vec<String>>,
) -> Result<BTreeMap<String, PathBuf>, End> {
    let mut files = BTreeMap::new();
    for (node, file) in replayed {
        if commands.contains_key(&node) || files.insert(node.clone(), PathBuf::from(file)).is_some() {
            return Err(End::Code(USAGE, format!("--replayed {node}: what runs `{node}` is said twice")));
        }
    }
    Ok(files)
}

/// Everything that a run reads: none of it may be its recording.
fn inputs(file: &SceneFile, scene: &Scene, options: &Options, replayed: &BTreeMap<String, PathBuf>) -> Inputs {
    let mut inputs = Inputs::default();
    for (what, path) in file.files(scene) {
        inputs.add(what, &path);
    }
    for file in replayed.values() {
        inputs.add("a recording of --replayed", file);
    }
    if let Some(config) = &options.config {
        inputs.add("the configuration of Zenoh", config);
        for file in zenoh_config::files_of(config) {
            inputs.add("a file of Zenoh's configuration", &file);
        }
    }
    let of_scene = roster(scene).into_values().filter_map(|runs| match runs {
        Runs::Command(words) => Some(words),
        Runs::Physics(_) | Runs::Recorded(_) => None,
    });
    for word in of_scene.chain(options.commands.values().cloned()).flatten() {
        inputs.add("part of a node's command", Path::new(&word));
    }
    if let Ok(program) = std::env::current_exe() {
        inputs.add("this program", &program);
    }
    inputs
}

/// Where the run is recorded: what is asked for, or the default with a number where that is taken. `None` where it is not.
fn target(output: &OutputArguments, default: PathBuf, inputs: &Inputs) -> Result<Option<Target>, End> {
    if output.no_record {
        return Ok(None);
    }
    let replace = if output.overwrite { Replace::Anything } else { Replace::Nothing };
    let numbered = output.record.is_none() && !output.overwrite;
    let path = output.record.clone().unwrap_or(default);
    if !numbered {
        let allowed = inputs.spare(&path).and_then(|()| replace.allows(&path));
        allowed.map_err(|error| End::Code(USAGE, error.to_string()))?;
    }
    Ok(Some(Target { path, replace, numbered }))
}

/// How to go on from a recording, where that is possible.
fn how_to_go_on(path: &Path) -> String {
    let checkpoint = Recording::open(path).and_then(|recording| recording.checkpoint(None));
    let Ok(Some(checkpoint)) = checkpoint else { return String::new() };
    let step = checkpoint.version().step;
    format!("; the same command with --resume {} goes on from step {step}", path.display())
}
