//! Two trivial nodes and the coordinator, over everything a run goes through but the recording.

use std::{
    collections::BTreeSet,
    io::Read as _,
    sync::Arc,
    time::{Duration, Instant},
};

use stagger_messages::{Decision, Field, Fields, Measure, Port, Ports, Ready};
use stagger_nodes::{
    coordinator::{Keeper, Remote, ports},
    host::{Event, Host, Identity},
    link::{Link, Role},
};
use stagger_solver::{
    SolveError,
    coupling::{
        self, Frozen, Local, Observer, Order, Outcome, Physics, Reply, Settings, StepControl, StepSize, Window,
    },
};

const RUN: &str = "bench";

/// Adds one to what it reads: nothing is computed, and every field changes.
struct AddOne {
    reads: Port,
    writes: Arc<Port>,
    rows: usize,
}

impl AddOne {
    fn new(name: &str, rows: usize) -> Self {
        let port = |field| Port::f64(field, "1", "particles", 3, Measure::Magnitude);
        let (reads, writes) = if name == "a" { ("from-b", "from-a") } else { ("from-a", "from-b") };
        Self { reads: port(reads).as_read(), writes: Arc::new(port(writes)), rows }
    }

    fn reply(&self, values: Vec<f64>) -> Result<Reply, SolveError> {
        let field = Field::new(&self.writes, 0, values)?;
        Ok(Reply { fields: Fields::from([(field.name().into(), field)]), ..Reply::default() })
    }
}

impl Physics for AddOne {
    type State = ();

    fn ports(&self) -> Ports {
        Ports { reads: vec![self.reads.clone()], writes: vec![(*self.writes).clone()] }
    }

    fn initial(&self) -> Result<((), Reply), SolveError> {
        Ok(((), self.reply(vec![0.0; self.rows * 3])?))
    }

    fn solve(&self, (): &(), frozen: &Frozen, _window: Window) -> Result<((), Reply), SolveError> {
        let read = frozen.at_end(&self.reads.field)?.f64()?;
        Ok(((), self.reply(read.iter().map(|value| value + 1.0).collect())?))
    }
}

/// A node of the pair: `a` or `b`, rows, endpoint.
pub fn node(arguments: &[String]) {
    let [name, rows, endpoint] = arguments else { panic!("expected a name, rows and an endpoint") };
    let physics = AddOne::new(name, rows.parse().expect("a number of rows"));
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

impl Keeper for Bench {
    fn last_words(&mut self, _node: &str) -> String {
        "see above".into()
    }

    fn interrupted(&self) -> bool {
        false
    }

    fn ended_early(&mut self) -> Option<String> {
        None
    }
}

struct Stopwatch(Instant, Vec<f64>);

impl Observer for Stopwatch {
    fn started(&mut self, _ready: &[(String, Ready)]) {
        self.0 = Instant::now();
    }

    fn decided(&mut self, _decision: &Decision, _outcomes: &[Outcome]) -> bool {
        self.1.push(self.0.elapsed().as_secs_f64() * 1e6);
        self.0 = Instant::now();
        true
    }
}

/// Median µs of an iteration with `rows` × 3 f64 each way.
pub fn iterations(rows: usize, rounds: usize, order: Order) -> f64 {
    let (endpoint, folder) = crate::endpoint("coupled");
    let link = Link::open(&Role::Hub { listen: vec![endpoint.clone()] }, None).expect("the endpoint is free");
    let mut children: Vec<_> =
        ["a", "b"].into_iter().map(|name| crate::spawn(&["node", name, &rows.to_string(), &endpoint])).collect();
    let total = rounds + rounds / 10;
    let dt = StepSize { start_s: 1.0, limit_s: 1.0, minimum_s: 1e-3, growth: 2.0 };
    // Every iteration is accepted, so that each round is one iteration and one decision.
    let settings = Settings { order, default_tolerance: 1e9, iterations: 5, reuse: 0.0, ..Settings::new(dt) };
    let names = BTreeSet::from(["a".to_owned(), "b".to_owned()]);
    let mut keeper = Bench;
    let mut remote = Remote::new(link.clone(), RUN, names, &mut keeper).expect("the link is open");
    let manifests = remote.gather(0, Duration::from_secs(20)).expect("both nodes come");
    let ports = ports(&manifests);
    let plan = coupling::plan(&ports, &settings).expect("the two fit");
    let mut control = StepControl::new(&settings, &coupling::measured(&ports), total as f64);
    let mut stopwatch = Stopwatch(Instant::now(), Vec::new());
    coupling::drive(&mut remote, &plan, &mut control, &mut stopwatch).expect("nothing can fail");
    for child in &mut children {
        drop(child.stdin.take());
        let _ = child.wait();
    }
    link.close().expect("a session closes");
    let _ = std::fs::remove_dir_all(folder);
    crate::median(stopwatch.1.split_off(rounds / 10))
}
