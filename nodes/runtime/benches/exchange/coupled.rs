//! Two trivial nodes and the coordinator, over everything a run goes through but the recording.

use std::{
    io::Read as _,
    sync::Arc,
    time::{Duration, Instant},
};

use stagger_coupling::{
    self, Acceleration, CouplingController, Frozen, Listener, Local, Order, Outcome, Physics, Reply, Settings,
    SolveError, StepSize, Window,
};
use stagger_messages::{Decision, Field, Fields, Measure, Port, Ports, Ready};
use stagger_runtime::{
    coordinator::{Remote, Supervisor, ports},
    link::{Link, Role},
    node::host::{Event, Host, Identity},
};

const RUN: &str = "bench";

/// The nodes, each of which reads the one before it; the first reads the last.
const NAMES: [&str; 5] = ["a", "b", "c", "d", "e"];

/// Takes a share of what it reads, another in each of seven sorts of rows, and adds the time: next to nothing is
/// computed, every field changes, and an iteration of a ring converges.
struct Share {
    reads: Port,
    writes: Arc<Port>,
    rows: usize,
}

impl Share {
    fn new(name: &str, nodes: usize, rows: usize) -> Self {
        let port = |name: &str| Port::f64(&format!("from-{name}"), "1", "particles", 3, Measure::Magnitude);
        let own = NAMES.iter().position(|other| *other == name).expect("one of the names");
        let before = NAMES[(own + nodes - 1) % nodes];
        Self { reads: port(before).as_read(), writes: Arc::new(port(name)), rows }
    }

    fn reply(&self, values: Vec<f64>) -> Result<Reply, SolveError> {
        let field = Field::new(&self.writes, 0, values)?;
        Ok(Reply { fields: Fields::from([(field.name().into(), field)]), ..Reply::default() })
    }
}

impl Physics for Share {
    type State = ();

    fn ports(&self) -> Ports {
        Ports::new(vec![self.reads.clone()], vec![(*self.writes).clone()])
    }

    fn initial(&self) -> Result<((), Reply), SolveError> {
        Ok(((), self.reply(vec![0.0; self.rows * 3])?))
    }

    fn solve(&self, (): &(), frozen: &Frozen, window: Window) -> Result<((), Reply), SolveError> {
        let read = frozen.at_end(&self.reads.field)?.f64()?;
        let share = |row: usize| 0.1 + 0.1 * (row % 7) as f64;
        let next = read.iter().enumerate().map(|(row, value)| share(row) * value + window.t_s + 1.0);
        Ok(((), self.reply(next.collect())?))
    }
}

/// A node of the ring: its name, the number of nodes, rows, endpoint.
pub fn node(arguments: &[String]) {
    let [name, nodes, rows, endpoint] = arguments else { panic!("expected a name, nodes, rows and an endpoint") };
    let [nodes, rows] = [nodes, rows].map(|number| number.parse().expect("a number"));
    let physics = Share::new(name, nodes, rows);
    let link = Link::open(&Role::Node { connect: endpoint.clone() }, None).expect("the hub listens");
    let identity = Identity { run: RUN.into(), node: name.clone(), scene_hash: 0 };
    let host = Host::new(&link, identity, Box::new(Local::new(name.as_str(), physics))).expect("the link is open");
    let to_host = host.sender();
    std::thread::spawn(move || {
        let _ = std::io::stdin().read(&mut [0]);
        let _ = to_host.send(Event::Abandoned);
    });
    host.run().expect("a node without physics does not fail");
}

struct Bench;

impl Supervisor for Bench {
    fn why_it_ended(&mut self, _node: &str) -> String {
        "see above".into()
    }

    fn interrupted(&self) -> bool {
        false
    }

    fn restart(&mut self, _node: &str) -> Result<(), String> {
        Err("a bench measures what does not die".into())
    }

    fn ended_early(&mut self) -> Option<String> {
        None
    }
}

/// Times of the decisions, in µs; ends the run when there are enough.
struct Stopwatch {
    since: Instant,
    times: Vec<f64>,
    enough: usize,
}

impl Listener for Stopwatch {
    fn started(&mut self, _ready: &[(String, Ready)]) {
        self.since = Instant::now();
    }

    fn decided(&mut self, _decision: &Decision, _outcomes: &[Outcome]) -> bool {
        self.times.push(self.since.elapsed().as_secs_f64() * 1e6);
        self.since = Instant::now();
        self.times.len() < self.enough
    }
}

/// Median µs of an iteration of `nodes` nodes in a ring, with `rows` × 3 f64 from each to the next.
///
/// Plain iterations are accepted whatever they changed, so that each round is one iteration and one decision; those with
/// an acceleration go on to 1e-8, some ten iterations to a step.
pub fn iterations(rows: usize, rounds: usize, nodes: usize, order: Order, acceleration: Acceleration) -> f64 {
    let (endpoint, folder) = crate::endpoint("coupled");
    let link = Link::open(&Role::Hub { listen: vec![endpoint.clone()] }, None).expect("the endpoint is free");
    let numbers = [nodes.to_string(), rows.to_string()];
    let spawn = |name: &&str| crate::spawn(&["node", name, &numbers[0], &numbers[1], &endpoint]);
    let mut children: Vec<_> = NAMES[..nodes].iter().map(spawn).collect();
    let total = rounds + rounds / 10;
    let dt = StepSize { start_s: 1.0, limit_s: 1.0, minimum_s: 1e-3, growth: 2.0 };
    let default_tolerance = if acceleration == Acceleration::None { 1e9 } else { 1e-8 };
    let settings =
        Settings { order, acceleration, default_tolerance, iterations: 100, reuse: 0.0, ..Settings::new(dt) };
    let names = NAMES[..nodes].iter().map(|name| (*name).to_owned()).collect();
    let mut supervisor = Bench;
    let mut remote = Remote::new(link.clone(), RUN, names, Duration::from_secs(60), None, &mut supervisor)
        .expect("the link is open");
    let manifests = remote.gather(0, Duration::from_secs(20)).expect("all nodes come");
    let ports = ports(&manifests);
    let plan = stagger_coupling::plan(&ports, &settings).expect("they fit");
    let mut controller = CouplingController::new(&settings, &plan, &stagger_coupling::measured(&ports, &plan), 1e9);
    let mut stopwatch = Stopwatch { since: Instant::now(), times: Vec::new(), enough: total };
    stagger_coupling::run_loop(&mut remote, &plan, &mut controller, 0, &mut stopwatch).expect("nothing can fail");
    for child in &mut children {
        drop(child.stdin.take());
        let _ = child.wait();
    }
    link.close().expect("a session closes");
    let _ = std::fs::remove_dir_all(folder);
    crate::median(stopwatch.times.split_off(rounds / 10))
}
