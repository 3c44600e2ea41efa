//! Rows that come and go during a run.
//!
//! - Two nodes, one of which removes and inserts rows at the start of windows: whatever the order and the acceleration,
//!   every row that is there at the end has the value of a computation of its own, and windows in which rows came or
//!   went take hardly more iterations than others.
//! - Heat that particles bring and take is booked: the balance closes to rounding.

mod heat;
mod motion;

use std::{collections::BTreeMap, sync::Arc};

use serde::{Deserialize, Serialize};
use stagger_coupling::{Acceleration, Frozen, Local, Order, Participant, Physics, Reply, Settings, SolveError, Window};
use stagger_messages::{Decision, Field, Fields, Measure, Port, Ports, Verdict};

use crate::{
    coupling::settings,
    staggering::{self, AITKEN, IQN_ILS},
};

const DT_S: f64 = 1.0;
const WINDOWS: u32 = 12;

/// Ids at the start of a window and, of those, the ones that came then. Every third window one row comes as one goes, so
/// that there are as many as before; in one all go.
fn scheduled(window: u32, ids: &[u32]) -> (Vec<u32>, u32) {
    let next = |more: u32| 100 * (window + 1)..100 * (window + 1) + more;
    let (gone, more) = match window {
        7 => (ids.len(), 0),
        8 => (0, 3),
        _ if window % 3 == 1 => (1, 1),
        _ if window % 4 == 2 => (0, 2),
        _ => (0, 0),
    };
    (ids[gone..].iter().copied().chain(next(more)).collect(), more)
}

/// Motion: x(t+Δt) = x(t) + Δt (1 + gain y(t+Δt)) in each row; rows come with x = their id.
struct Rows {
    /// `None`: y does not act on it, and is not read.
    gain_1_s: Option<f64>,
    /// Whether it says where rows stood at the window's start.
    tells: bool,
}

#[derive(Clone, Serialize, Deserialize)]
struct Stock {
    window: u32,
    revision: u64,
    ids: Vec<u32>,
    x: Vec<f64>,
}

impl Stock {
    /// At the window's start, after rows have come and gone.
    fn begun(&self) -> Self {
        let (ids, _) = scheduled(self.window, &self.ids);
        let revision = self.revision + u64::from(ids != self.ids);
        let x = by_ids(&self.x, &self.ids, &ids, f64::from);
        Self { window: self.window + 1, revision, ids, x }
    }

    fn fields(&self) -> Result<Fields, SolveError> {
        let written = [
            Field::new(&Arc::new(ids()), self.revision, self.ids.clone())?,
            Field::new(&Arc::new(x()), self.revision, self.x.clone())?,
        ];
        Ok(written.into_iter().map(|field| (field.name().to_owned(), field)).collect())
    }
}

fn by_ids(values: &[f64], then: &[u32], now: &[u32], default: impl Fn(u32) -> f64) -> Vec<f64> {
    let known: BTreeMap<u32, f64> = then.iter().copied().zip(values.iter().copied()).collect();
    now.iter().map(|id| known.get(id).copied().unwrap_or_else(|| default(*id))).collect()
}

fn ids() -> Port {
    Port::u32("ids", "rows", 1)
}

fn x() -> Port {
    Port::f64("x", "m", "rows", 1, Measure::Increment)
}

fn y() -> Port {
    Port::f64("y", "1", "rows", 1, Measure::Magnitude)
}

impl Physics for Rows {
    type State = Stock;

    fn ports(&self) -> Ports {
        Ports::new(self.gain_1_s.iter().map(|_| y().as_read()).collect(), vec![ids(), x()])
    }

    fn initial(&self) -> Result<(Stock, Reply), SolveError> {
        let stock = Stock { window: 0, revision: 0, ids: vec![0, 1, 2], x: vec![0.0, 1.0, 2.0] };
        let fields = stock.fields()?;
        Ok((stock, Reply { fields, ..Reply::default() }))
    }

    fn solve(&self, stock: &Stock, frozen: &Frozen, window: Window) -> Result<(Stock, Reply), SolveError> {
        let begun = stock.begun();
        let mut end = begun.clone();
        if let Some(gain_1_s) = self.gain_1_s {
            let y = frozen.at_end("y")?;
            // It is on the rows of this window or, where its writer has not seen them yet, on those of the one before.
            let of = if y.support.revision == begun.revision { &begun.ids } else { &stock.ids };
            assert_eq!(of.len(), y.rows(), "y is on rows of revision {}", y.support.revision);
            let y = by_ids(y.f64()?, of, &begun.ids, |_| 0.0);
            end.x.iter_mut().zip(y).for_each(|(x, y)| *x += window.dt_s * gain_1_s * y);
        }
        end.x.iter_mut().for_each(|x| *x += window.dt_s);
        let start = if self.tells { begun.fields()? } else { Fields::new() };
        let fields = end.fields()?;
        Ok((end, Reply { fields, start, ..Reply::default() }))
    }
}

/// y = 1 + slope x on the rows of x.
struct Follower {
    slope_1_m: f64,
}

impl Follower {
    fn reply(&self, x: &Field) -> Result<Reply, SolveError> {
        let values: Vec<f64> = x.f64()?.iter().map(|x| 1.0 + self.slope_1_m * x).collect();
        let field = Field::new(&Arc::new(y()), x.support.revision, values)?;
        Ok(Reply { fields: Fields::from([("y".into(), field)]), ..Reply::default() })
    }
}

impl Physics for Follower {
    type State = ();

    fn ports(&self) -> Ports {
        Ports::new(vec![x().as_read()], vec![y()])
    }

    fn initial(&self) -> Result<((), Reply), SolveError> {
        Ok(((), self.reply(&Field::new(&Arc::new(x()), 0, vec![0.0, 1.0, 2.0])?)?))
    }

    fn solve(&self, (): &(), frozen: &Frozen, _: Window) -> Result<((), Reply), SolveError> {
        Ok(((), self.reply(frozen.at_end("x")?)?))
    }
}

const GAIN_1_S: f64 = -0.4;
const SLOPE_1_M: f64 = 0.7;

fn members(tells: bool) -> BTreeMap<String, Box<dyn Participant>> {
    let rows = Local::new("rows", Rows { gain_1_s: Some(GAIN_1_S), tells });
    let follower = Local::new("follower", Follower { slope_1_m: SLOPE_1_M });
    BTreeMap::from([("rows".into(), Box::new(rows) as Box<dyn Participant>), ("follower".into(), Box::new(follower))])
}

/// x of every row at the end of all windows: x = x₀ + Δt (1 + g (1 + s x)) solved for x in each window.
fn expected() -> (Vec<u32>, Vec<f64>) {
    let mut stock = Stock { window: 0, revision: 0, ids: vec![0, 1, 2], x: vec![0.0, 1.0, 2.0] };
    for _ in 0..WINDOWS {
        stock = stock.begun();
        for x in &mut stock.x {
            *x = (*x + DT_S * (1.0 + GAIN_1_S)) / (1.0 - DT_S * GAIN_1_S * SLOPE_1_M);
        }
    }
    (stock.ids, stock.x)
}

/// Iterations of each accepted window; fails where one was rejected.
fn iterations(decisions: &[Decision]) -> Vec<u32> {
    assert!(decisions.iter().all(|decision| decision.verdict() != Verdict::Reject), "a window was rejected");
    let accepted = decisions.iter().filter(|decision| decision.verdict() == Verdict::Accept);
    accepted.map(|decision| decision.version.unwrap().iteration).collect()
}

fn every_method() -> impl Iterator<Item = (Order, Acceleration, bool)> {
    let methods = [Acceleration::None, Acceleration::Constant { relaxation: 0.8 }, AITKEN, IQN_ILS];
    let orders = [Order::GaussSeidel, Order::Jacobi];
    orders.into_iter().flat_map(move |order| {
        methods.into_iter().flat_map(move |method| [false, true].map(|tells| (order, method, tells)))
    })
}

fn of(order: Order, acceleration: Acceleration) -> Settings {
    // `rows` first: in Gauss–Seidel order the rows are then those of the window in the first iteration already.
    let sequence = vec!["rows".to_owned()];
    let mut settings = Settings { order, acceleration, sequence, ..settings(DT_S, 1e-12, 80) };
    // No window may be shorter: the rows go by their number.
    settings.dt.minimum_s = DT_S;
    settings
}

#[test]
fn every_row_has_the_value_of_its_own_whatever_the_order_and_the_acceleration() {
    let (ids, expected) = expected();
    let duration_s = f64::from(WINDOWS) * DT_S;
    for (order, method, tells) in every_method() {
        let (fields, decisions, _) = staggering::run(members(tells), &of(order, method), duration_s, 0, None).unwrap();
        assert_eq!(fields["ids"].u32().unwrap(), ids);
        assert_eq!(fields["y"].support, fields["x"].support);
        for (found, expected) in fields["x"].f64().unwrap().iter().zip(&expected) {
            // The last change is 1e-12 of an increment or of a value, at most some 1e3; with a contraction of 0.53
            // (Jacobi) the error is at most twice that, and each window passes on what it has.
            assert!((found - expected).abs() < 1e-8, "{order:?} {method:?}: {found}, expected {expected}");
        }
        let iterations = iterations(&decisions);
        let changed = |window: u32| scheduled(window, &[1, 2, 3]).0 != [1, 2, 3];
        let most = |changes: bool| {
            let windows = (0..WINDOWS).zip(&iterations).filter(|(window, _)| changed(*window) == changes);
            windows.map(|(_, iterations)| *iterations).max().unwrap()
        };
        // What is measured anew in the first iteration, and in Jacobi order in the second, is lost; and a window
        // without older ones to learn from is like a run's first.
        let learning = u32::from(method == IQN_ILS) * 4;
        assert!(most(true) <= most(false).max(iterations[0]) + 2 + learning, "{order:?} {method:?}: {iterations:?}");
    }
}

#[test]
fn a_run_split_where_rows_come_and_go_goes_on_with_the_same_bits() {
    let duration_s = f64::from(WINDOWS) * DT_S;
    for (order, method, tells) in every_method() {
        let settings = of(order, method);
        let (whole, decisions, _) = staggering::run(members(tells), &settings, duration_s, 0, None).unwrap();
        // The last checkpoint of a run that takes one after so many steps and none after that: before and behind windows
        // that change rows, and before and behind the one in which all go.
        for split in [6, 7, 8, 9, 10] {
            let (_, _, checkpoint) = staggering::run(members(tells), &settings, duration_s, split, None).unwrap();
            let (fields, rest, _) = staggering::run(members(tells), &settings, duration_s, 0, checkpoint).unwrap();
            assert_eq!(fields, whole, "{order:?} {method:?}, split at {split}");
            assert_eq!(rest, decisions[decisions.len() - rest.len()..]);
        }
    }
}

#[test]
fn a_node_alone_takes_as_many_iterations_where_rows_come_and_go() {
    for order in [Order::GaussSeidel, Order::Jacobi] {
        let alone = Local::new("rows", Rows { gain_1_s: None, tells: true });
        let members = BTreeMap::from([("rows".to_owned(), Box::new(alone) as Box<dyn Participant>)]);
        let duration_s = f64::from(WINDOWS) * DT_S;
        let (_, decisions, _) = staggering::run(members, &of(order, Acceleration::None), duration_s, 0, None).unwrap();
        // The second is the first one's answer once more: what nothing acts on does not change. Where nothing is there,
        // nothing changes in the first.
        let mut expected = vec![2; WINDOWS as usize];
        expected[7] = 1;
        assert_eq!(iterations(&decisions), expected, "{order:?}");
    }
}
