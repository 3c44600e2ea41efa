//! `stagger check`: whether a scene can run, and who reads what from whom.

pub mod advise;
pub mod graph;
pub mod json;

use stagger_runtime::{
    coordinator::{self, Remote},
    launch::{
        Common, Launcher,
        roster::{Runs, roster},
    },
    link::{Link, Role, endpoint::Endpoint},
    run::{Failed, scene_files::SceneFile},
};
use std::{
    collections::BTreeMap,
    fmt::Write as _,
    path::Path,
    sync::{Arc, Mutex},
    time::Duration,
};

use stagger_coupling::{Ensemble as _, PlanError};
use stagger_messages::{Plan, Ports};
use stagger_scene::{ParticipantError, Scene};

use crate::check::graph::{Format, Graph};

/// How long a command has to say what its ports are.
const PATIENCE: Duration = Duration::from_secs(30);

/// Why a scene cannot run.
#[derive(Debug, thiserror::Error)]
pub enum CheckError {
    /// A node cannot be built.
    #[error(transparent)]
    Participant(#[from] ParticipantError),
    /// The nodes do not fit together.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// A command that does not tell its ports.
    #[error(transparent)]
    Ask(Box<Failed>),
}

impl From<Failed> for CheckError {
    fn from(error: Failed) -> Self {
        Self::Ask(Box::new(error))
    }
}

/// Ports of the nodes that can be asked without starting them, and the names of those that cannot.
///
/// # Errors
/// A node cannot be built.
pub fn ports(scene: &Scene) -> Result<(BTreeMap<String, Ports>, Vec<String>), ParticipantError> {
    let mut ports = BTreeMap::new();
    let mut commands = Vec::new();
    for (node, runs) in roster(scene) {
        let Runs::Physics(kind) = runs else {
            commands.push(node);
            continue;
        };
        // A physics that nobody set up is found by the one who starts it.
        let Some(settings) = scene.settings_of(&node, &kind) else { continue };
        settings.check().map_err(|source| ParticipantError::Settings { node: node.clone(), source })?;
        ports.insert(node, settings.ports());
    }
    Ok((ports, commands))
}

/// Checks a scene before anything is started. Where a command takes part, its ports are known only when it runs, and
/// the fit is checked then.
///
/// # Errors
/// A node cannot be built, or the nodes do not fit together.
pub fn check(scene: &Scene) -> Result<Option<Plan>, CheckError> {
    let (ports, commands) = ports(scene)?;
    Ok(commands.is_empty().then(|| stagger_coupling::plan(&ports, &scene.coupling)).transpose()?)
}

/// A scene that can run, and its exchange of fields.
pub struct Checked {
    /// Ports by node.
    pub ports: BTreeMap<String, Ports>,
    /// Who reads from whom.
    pub plan: Plan,
}

/// Checks a scene, read from `file`, to the end: a command that takes part is started, asked for its ports, and ended. The
/// recording `files` holds the files the scene names, where they are not beside it.
///
/// # Errors
/// A node cannot be built or started, or the nodes do not fit together.
pub fn check_whole(scene: &Scene, file: &SceneFile, files: Option<&Path>) -> Result<Checked, CheckError> {
    let (mut ports, commands) = ports(scene)?;
    if !commands.is_empty() {
        ports.extend(ask(scene, file, files, &commands)?);
    }
    let plan = stagger_coupling::plan(&ports, &scene.coupling)?;
    Ok(Checked { ports, plan })
}

/// Ports of the nodes that only the commands themselves know.
fn ask(
    scene: &Scene,
    file: &SceneFile,
    files: Option<&Path>,
    commands: &[String],
) -> Result<BTreeMap<String, Ports>, Failed> {
    let run = format!("check-{}", std::process::id());
    let mut endpoint = Endpoint::new(&run)?;
    let link = Link::open(&Role::Hub { listen: vec![endpoint.name.clone()] }, None)?;
    let handed_over = if file.can_be_read_again(scene) { None } else { endpoint.hand_over(scene)? };
    let common = Common {
        run: run.clone(),
        connect: endpoint.name.clone(),
        scene: handed_over.as_ref().map_or(&file.path, |handed| &handed.scene).clone(),
        overrides: scene.overrides.clone(),
        files: handed_over.and_then(|handed| handed.files).or(files.map(Path::to_owned)),
        scene_hash: scene.hash,
        threads: None,
    };
    let nodes: BTreeMap<_, _> = roster(scene).into_iter().filter(|(name, _)| commands.contains(name)).collect();
    let names = nodes.keys().cloned().collect();
    let mut launcher = Launcher::start(&nodes, common, Arc::new(Mutex::new(endpoint)), Arc::default())
        .map_err(|source| Failed::Io { what: "cannot start the nodes".into(), source })?;
    let mut remote = Remote::new(link.clone(), &run, names, PATIENCE, None, &mut launcher)?;
    let manifests = remote.gather(scene.hash, PATIENCE);
    // Whatever they answered, they are to end; the answer is the news.
    let _ = remote.finish(None, false, "only the ports were asked for");
    drop(remote);
    drop(launcher);
    let closed = link.close();
    let manifests = manifests?;
    closed?;
    Ok(coordinator::ports(&manifests))
}

/// The settings in force and the exchange of fields, as text.
#[must_use]
pub fn describe(scene: &Scene, checked: &Checked) -> String {
    let mut text = format!("{}\n\nsettings in force (* from the scene)\n", scene.title);
    for value in &scene.effective {
        let mark = if value.is_default { ' ' } else { '*' };
        // Writing to a string cannot fail.
        let _ = writeln!(text, "  {mark} {:<40} {}", value.path, value.value);
    }
    text.push_str("\nwho reads what, in the order of solving\n");
    text.push_str(&graph(scene, checked, Format::Text));
    text
}

/// The exchange of fields alone.
#[must_use]
pub fn graph(scene: &Scene, checked: &Checked, format: Format) -> String {
    Graph::new(&checked.plan, &checked.ports, &scene.coupling).write(format)
}
