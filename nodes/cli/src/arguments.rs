//! The command line as typed.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};
use stagger_messages::keys;
use stagger_runtime::run::scene_files::key_value;

/// Particle-based additive manufacturing as a co-simulation: one process per physics, every exchange recorded.
///
/// Exit codes: 0 done, 1 failed, 2 usage or bad scene, 3 finished with something missing.
#[derive(Debug, Parser)]
#[command(name = "stagger", version, arg_required_else_help = true)]
pub(super) struct Arguments {
    #[command(subcommand)]
    pub(super) command: Command,
}

#[derive(Debug, Subcommand)]
pub(super) enum Command {
    /// Run a scene: starts a process for each physics it names, couples them, records every exchange
    Run(RunArguments),
    /// Validate a scene; show its settings and who reads what from whom
    Check {
        #[command(flatten)]
        scene: SceneArguments,
        /// Print the exchange of fields alone
        #[arg(long, value_enum, conflicts_with = "json")]
        graph: Option<stagger_tools::check::graph::Format>,
        /// Say which physics could be left out or is missing, and which fidelity suffices, with the numbers (docs/advice.md)
        #[arg(long, conflicts_with = "graph")]
        advise: bool,
        /// Relative change of a result that counts as none
        #[arg(long, default_value_t = 0.01, requires = "advise", value_parser = share)]
        within: f64,
        /// Print every value in SI units, and what each physics is set up with, as JSON (docs/check.md)
        #[arg(long)]
        json: bool,
    },
    /// Run one physics of a scene as a node of a run started elsewhere
    Node(NodeArguments),
    /// Coordinate a scene whose nodes are started by hand
    Coordinator {
        #[command(flatten)]
        scene: SceneArguments,
        #[command(flatten)]
        meeting: MeetingArguments,
        /// Name of the run, which the nodes must be told; by default the scene's name and the time
        #[arg(long, value_parser = name)]
        run: Option<String>,
        /// Let a node of a recording answer as it did instead of waiting for it; may be given several times
        #[arg(long, value_name = "NODE=FILE", value_parser = key_value)]
        replayed: Vec<(String, String)>,
        #[command(flatten)]
        output: OutputArguments,
        /// Zenoh configuration file (docs/several-hosts.md)
        #[arg(long)]
        config: Option<PathBuf>,
    },
    /// Check that a node keeps the protocol: exit 0 when it breaks no rule, 1 when it does
    Conformance(ConformanceArguments),
    /// Write a crate to begin a node of your own with
    NewNode {
        /// Its name, which is also that of its folder
        name: String,
        /// Folder of stagger's sources; by default those this program was built from
        #[arg(long, value_name = "FOLDER")]
        stagger: Option<PathBuf>,
    },
    /// Pass messages on between a coordinator and nodes that all connect here
    Router {
        /// Endpoint to listen on; may be given several times
        #[arg(long, required = true)]
        listen: Vec<String>,
        /// Zenoh configuration file (docs/several-hosts.md)
        #[arg(long)]
        config: Option<PathBuf>,
        /// End when the standard input closes
        #[arg(long, hide = true)]
        child: bool,
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
        /// Solve it by a program of your own, which is given the recorded fields over Zenoh as in a run
        #[arg(long, value_name = "COMMAND", requires = "node")]
        with: Option<String>,
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
    /// Write a page about a recording that needs nothing beside itself; exit 3 when the recording is cut off or damaged
    Report {
        /// The recording
        file: PathBuf,
        /// The page; by default the recording's name with .html in the working directory
        #[arg(long, value_name = "FILE")]
        out: Option<PathBuf>,
        /// Replace a file of that name that is no such page
        #[arg(long)]
        overwrite: bool,
    },
    /// Write a recording as files for ParaView, CSV or Arrow (docs/exports.md); exit 3 when it is cut off or damaged
    Export(ExportArguments),
    /// Measure what each approximation of a scene costs and gains (docs/tradeoff.md)
    Tradeoff(TradeoffArguments),
    /// Show a recording, or a run that is going on, in Rerun
    View {
        /// A recording, or the name of a run on this host
        what: String,
        /// Save a Rerun recording instead of opening a viewer
        #[arg(long)]
        save: Option<PathBuf>,
        /// Replace a file of that name that is no Rerun recording
        #[arg(long, requires = "save")]
        overwrite: bool,
        /// Connect to a viewer that runs already, such as rerun+http://127.0.0.1:9876/proxy
        #[arg(long)]
        connect: Option<String>,
        /// Serve the viewer to browsers of this host until Ctrl-C, and print the page's address
        #[arg(long, conflicts_with_all = ["save", "connect"])]
        web: bool,
        /// Draw the contacts too
        #[arg(long)]
        contacts: bool,
        /// Draw velocities as arrows
        #[arg(long)]
        velocities: bool,
    },
}

#[derive(Debug, Args)]
pub(super) struct SceneArguments {
    /// The scene, a TOML file; `-` is standard input
    pub(super) scene: PathBuf,
    /// Set a key of the scene: coupling.iterations=6
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = key_value)]
    set: Vec<(String, String)>,
    /// Choose a preset of the scene, such as draft; --set goes over it
    #[arg(long, value_name = "NAME")]
    preset: Option<String>,
    /// Recording of the scene that holds the files it names, where they are not beside it; --resume gives its own
    #[arg(long, value_name = "RECORDING")]
    pub(super) files: Option<PathBuf>,
}

impl SceneArguments {
    /// What the command line sets: a preset first.
    pub(super) fn overrides(&self) -> Vec<(String, String)> {
        let preset = self.preset.iter().map(|name| ("preset".into(), format!("{name:?}")));
        preset.chain(self.set.iter().cloned()).collect()
    }
}

/// Where a coordinator meets its nodes.
#[derive(Debug, Args)]
#[group(required = true, multiple = false)]
pub(super) struct MeetingArguments {
    /// Endpoint to listen on: tcp/10.0.0.1:7447, quic/lab1.example:7447 (built with `--features quic`); may be given several times
    #[arg(long)]
    pub(super) listen: Vec<String>,
    /// Endpoint of a router to connect to, as the nodes do
    #[arg(long)]
    pub(super) connect: Option<String>,
}

#[derive(Debug, Args)]
pub(super) struct OutputArguments {
    /// Recording to write; by default the scene's name with .mcap in the working directory
    #[arg(long, value_name = "FILE", conflicts_with = "no_record")]
    pub(super) record: Option<PathBuf>,
    /// Write no recording
    #[arg(long)]
    pub(super) no_record: bool,
    /// Replace what the recording's name belongs to. By default nothing is replaced: a number is added to the default
    /// name, and another one that is taken is refused
    #[arg(long, conflicts_with = "no_record")]
    pub(super) overwrite: bool,
    /// Print the summary as JSON (docs/summary.md)
    #[arg(long)]
    pub(super) json: bool,
}

#[derive(Debug, Args)]
pub(super) struct RunArguments {
    #[command(flatten)]
    pub(super) scene: SceneArguments,
    #[command(flatten)]
    pub(super) output: OutputArguments,
    /// Run the nodes as threads of one process
    #[arg(long)]
    pub(super) in_process: bool,
    /// Threads of each node; by default one per core, which is also the most. The results do not depend on it
    #[arg(long, value_parser = count)]
    pub(super) threads: Option<usize>,
    /// Run a node by a command of your own
    #[arg(long = "node", value_name = "NODE=COMMAND", value_parser = key_value)]
    pub(super) nodes: Vec<(String, String)>,
    /// Let a node of a recording answer as it did instead of running it; may be given several times
    #[arg(long, value_name = "NODE=FILE", value_parser = key_value)]
    pub(super) replayed: Vec<(String, String)>,
    /// Go on from the last checkpoint of a recording of this scene, or from its last one at or before a step
    #[arg(long, value_name = "FILE[@STEP]")]
    pub(super) resume: Option<String>,
    /// Show the run in Rerun while it goes on
    #[arg(long)]
    pub(super) view: bool,
}

#[derive(Debug, Args)]
pub(super) struct NodeArguments {
    /// The physics: particles, thermal, optics, current, substrate, acoustics
    pub(super) kind: String,
    /// Its name in the run; by default that of the physics
    #[arg(long)]
    pub(super) name: Option<String>,
    /// The scene; `-` is standard input
    #[arg(long)]
    pub(super) scene: PathBuf,
    /// Set a key of the scene, as the coordinator was told
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = key_value)]
    pub(super) overrides: Vec<(String, String)>,
    /// Recording of the scene that holds the files it names, where they are not beside it
    #[arg(long, value_name = "RECORDING")]
    pub(super) files: Option<PathBuf>,
    /// The endpoint of the coordinator, or of the router it connects to
    #[arg(long)]
    pub(super) connect: String,
    /// Name of the run, as the coordinator says
    #[arg(long, value_parser = name)]
    pub(super) run: String,
    /// Threads; by default one per core, which is also the most
    #[arg(long, value_parser = count)]
    pub(super) threads: Option<usize>,
    /// Zenoh configuration file (docs/several-hosts.md)
    #[arg(long)]
    pub(super) config: Option<PathBuf>,
    /// Answer as the node of this name in a recording did
    #[arg(long, hide = true)]
    pub(super) replayed: Option<PathBuf>,
    /// End when the standard input closes, and leave Ctrl-C to the parent
    #[arg(long, hide = true)]
    pub(super) child: bool,
}

#[derive(Debug, Args)]
pub(super) struct ConformanceArguments {
    /// The scene whose other nodes surround it; by default a small one of its own, with every physics
    #[arg(long)]
    pub(super) scene: Option<PathBuf>,
    /// Set a key of the scene
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = key_value)]
    pub(super) overrides: Vec<(String, String)>,
    /// The node; by default the one of the scene whose fields the command writes
    #[arg(long, value_name = "NAME", required_unless_present = "command")]
    pub(super) node: Option<String>,
    /// How long the node may take for one answer, in s
    #[arg(long, default_value_t = 20, value_parser = clap::value_parser!(u16).range(1..))]
    pub(super) patience: u16,
    /// Print the verdicts as JSON
    #[arg(long)]
    pub(super) json: bool,
    /// Program and arguments; by default what the scene runs under that name
    #[arg(last = true, value_name = "COMMAND")]
    pub(super) command: Vec<String>,
}

#[derive(Debug, Args)]
pub(super) struct ReplayArguments {
    /// The recording
    pub(super) file: PathBuf,
    /// Times faster than it was recorded; `inf` waits for nothing
    #[arg(long, default_value_t = 1.0, value_parser = positive)]
    pub(super) speed: f64,
    /// Wait for Enter before each step
    #[arg(long)]
    pub(super) step: bool,
    /// Start at once instead of waiting for a first subscriber
    #[arg(long)]
    pub(super) now: bool,
    /// Simulated time to start from, in s
    #[arg(long, default_value_t = 0.0)]
    pub(super) from: f64,
    /// Simulated time to end at, in s
    #[arg(long, default_value_t = f64::INFINITY)]
    pub(super) to: f64,
    /// Endpoint to listen on; by default a socket that is printed
    #[arg(long)]
    pub(super) listen: Option<String>,
}

#[derive(Debug, Args)]
pub(super) struct TradeoffArguments {
    #[command(flatten)]
    pub(super) scene: SceneArguments,
    /// Try only this setting; may be given several times, `presets` for the scene's presets alone. By default all that mean
    /// something for the scene
    #[arg(long, value_name = "NAME")]
    pub(super) axis: Vec<String>,
    /// Try values of any key: --vary "particles.count=500;1000;2000"
    #[arg(long, value_name = "KEY=VALUE;VALUE", value_parser = key_value)]
    pub(super) vary: Vec<(String, String)>,
    /// Set a key for the reference, beside far tighter steps, tolerances and sampling
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    pub(super) reference: Vec<(String, String)>,
    /// Measure errors by this, such as "peak temperature"; by default what `[tradeoff]` in the scene names
    #[arg(long, value_name = "QUANTITY", value_parser = str::parse::<stagger_tools::tradeoff::Quantity>)]
    pub(super) quantity: Vec<stagger_tools::tradeoff::Quantity>,
    /// Largest error of the setting that is recommended: 1% or 0.01
    #[arg(long, value_name = "SHARE", default_value = "1%", value_parser = share)]
    pub(super) error: f64,
    /// Runs of each setting, whose median time counts
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..))]
    pub(super) repeat: u16,
    /// A run that takes this many times as long as the scene as it stands is ended
    #[arg(long, value_name = "FACTOR", default_value_t = 20.0, value_parser = positive)]
    pub(super) longest: f64,
    /// Measure the order of accuracy over the step instead
    #[arg(long)]
    pub(super) orders: bool,
    /// First step of the orders, in s; by default the largest step of the scene
    #[arg(long, requires = "orders", value_parser = positive)]
    pub(super) dt: Option<f64>,
    /// Runs of the orders, each with half the step of the one before
    #[arg(long, requires = "orders", default_value_t = 5, value_parser = clap::value_parser!(u32).range(2..=20))]
    pub(super) levels: u32,
    /// Run the nodes as threads of one process
    #[arg(long)]
    pub(super) in_process: bool,
    /// Threads of each node; by default one per core, which is also the most
    #[arg(long, value_parser = count)]
    pub(super) threads: Option<usize>,
    /// Folder for the page, the table and the runs, which are not made again; by default tradeoff-SCENE
    #[arg(long, value_name = "FOLDER")]
    pub(super) out: Option<PathBuf>,
    /// Replace a page or a table in the folder that no earlier study has written
    #[arg(long)]
    pub(super) overwrite: bool,
    /// Print the result as JSON
    #[arg(long)]
    pub(super) json: bool,
}

#[derive(Debug, Args)]
pub(super) struct ExportArguments {
    /// The recording
    pub(super) file: PathBuf,
    /// Folder for the files, which is made
    #[arg(long, value_name = "FOLDER")]
    pub(super) out: PathBuf,
    /// Write series of VTK files for ParaView, one for each support of points or of a grid; this is the default
    #[arg(long)]
    pub(super) vtp: bool,
    /// Write a table of scalars with a row for each accepted step
    #[arg(long)]
    pub(super) csv: bool,
    /// Write the fields as Arrow files, one for each support; needs stagger-view
    #[arg(long)]
    pub(super) arrow: bool,
    /// Steps from one state to the next of VTK and Arrow files; the start and the last state are always written
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..))]
    pub(super) every: u64,
    /// Write VTK files of pairs too, such as the contacts between particles
    #[arg(long)]
    pub(super) contacts: bool,
    /// Replace files in the folder that no earlier export has written
    #[arg(long)]
    pub(super) overwrite: bool,
}

fn name(text: &str) -> Result<String, String> {
    keys::check_name(text).map(str::to_owned).map_err(|error| error.to_string())
}

fn count(text: &str) -> Result<usize, String> {
    text.parse()
        .ok()
        .filter(|count| *count > 0)
        .ok_or_else(|| format!("expected a whole number above 0, found `{text}`"))
}

fn positive(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|value| *value > 0.0).ok_or_else(|| format!("expected a number above 0, found `{text}`"))
}

fn share(text: &str) -> Result<f64, String> {
    let (number, divisor) = text.strip_suffix('%').map_or((text, 1.0), |percent| (percent.trim_end(), 100.0));
    positive(number)
        .map(|number| number / divisor)
        .map_err(|_| format!("expected a share such as 1% or 0.01, found `{text}`"))
}

fn not_negative(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|value| *value >= 0.0).ok_or_else(|| format!("expected 0 or more, found `{text}`"))
}
