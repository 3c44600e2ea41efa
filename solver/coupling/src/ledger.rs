//! The energy balance of a run: an account for each node, and what crosses between them.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use stagger_messages::{
    Energy,
    energy::Kind::{self, Gained, Lost, Stored},
};

use super::on_the_way::OnTheWay;

/// Share of the energies in a balance that counts as turned over where less is: sums of as many terms as a bed has particles
/// are not known to more digits, and what they are rounded by is no fault.
const RESOLVED: f64 = 1e-12;

/// The energy of a run, summed over accepted windows, in J.
///
/// A node's stored energy changes by what it gains less what it loses; what is left over is its imbalance. An amount
/// that one node loses and another gains under the same name crosses between them; the difference of the two sums is
/// that exchange's imbalance, less what is on its way between nodes that solve at rates of their own.
#[derive(Clone, Debug, Default, Serialize, Deserialize, PartialEq)]
pub struct Ledger {
    nodes: BTreeMap<String, Account>,
    on_the_way: OnTheWay,
}

/// One node's part of the ledger, in J.
#[derive(Clone, Debug, Default, Serialize, Deserialize, PartialEq)]
pub struct Account {
    /// Held at t = 0, by name.
    pub initial: BTreeMap<String, f64>,
    /// Held now, by name.
    pub stored: BTreeMap<String, f64>,
    /// Entered since t = 0, by name.
    pub gained: BTreeMap<String, f64>,
    /// Left since t = 0, by name.
    pub lost: BTreeMap<String, f64>,
    /// How far each of these has moved.
    pub ranges: Ranges,
}

/// Smallest and largest value that each energy of an account had at t = 0 or at the end of an accepted window, in J.
#[derive(Clone, Debug, Default, Serialize, Deserialize, PartialEq)]
pub struct Ranges {
    /// Of what was held; with 0 where that is counted from nothing ([`Energy::from_nothing`]).
    pub stored: BTreeMap<String, [f64; 2]>,
    /// Of what had entered, from 0 at the start.
    pub gained: BTreeMap<String, [f64; 2]>,
    /// Of what had left, from 0 at the start.
    pub lost: BTreeMap<String, [f64; 2]>,
}

impl Account {
    /// Change of what is held, less what entered, plus what left: zero in an exact computation.
    #[must_use]
    pub fn imbalance(&self) -> f64 {
        total(&self.stored) - total(&self.initial) - total(&self.gained) + total(&self.lost)
    }

    /// The energy turned over during the run, in J: what an imbalance is to be compared with.
    ///
    /// The largest of three: what entered and what left, each by the width of the range over which its sum has moved, and
    /// the widest range of one stored energy. Ranges are followed from window to window, so that an energy that is at the
    /// end what it was at the start counts as turned over; unlike sums of changes they do not grow with the number
    /// of windows, in which a fault would fade as a run goes on. At least 1e-12 of all energies in the balance.
    #[must_use]
    pub fn turned_over(&self) -> f64 {
        let converted = self.ranges.stored.values().map(width).fold(0.0, f64::max);
        let sides = [&self.initial, &self.stored, &self.gained, &self.lost];
        let all: f64 = sides.into_iter().flat_map(BTreeMap::values).map(|joule| joule.abs()).sum();
        moved(&self.ranges.gained).max(moved(&self.ranges.lost)).max(converted).max(RESOLVED * all)
    }

    fn hold(&mut self, entry: &Energy) {
        self.stored.insert(entry.name.clone(), entry.joule);
        // What was not told of at the start was not there.
        let range = self.ranges.stored.entry(entry.name.clone()).or_default();
        widen(range, entry.joule);
        if entry.from_nothing {
            widen(range, 0.0);
        }
    }
}

fn total(entries: &BTreeMap<String, f64>) -> f64 {
    entries.values().sum()
}

fn width([low, high]: &[f64; 2]) -> f64 {
    high - low
}

fn moved(ranges: &BTreeMap<String, [f64; 2]>) -> f64 {
    ranges.values().map(width).sum()
}

fn widen([low, high]: &mut [f64; 2], joule: f64) {
    (*low, *high) = (low.min(joule), high.max(joule));
}

/// Adds a window's amount to a sum since t = 0.
fn add(sums: &mut BTreeMap<String, f64>, ranges: &mut BTreeMap<String, [f64; 2]>, entry: &Energy) {
    let sum = sums.entry(entry.name.clone()).or_default();
    *sum += entry.joule;
    widen(ranges.entry(entry.name.clone()).or_default(), *sum);
}

impl Ledger {
    /// Books what a node holds at t = 0.
    pub fn start(&mut self, node: &str, entries: &[Energy]) {
        let account = self.nodes.entry(node.into()).or_default();
        for entry in entries.iter().filter(|entry| entry.kind() == Stored) {
            account.initial.insert(entry.name.clone(), entry.joule);
            account.ranges.stored.insert(entry.name.clone(), [entry.joule; 2]);
            account.hold(entry);
        }
    }

    /// Books one accepted window of a node that is one of several; the window ends at `t_s`, in s.
    pub fn book_until(&mut self, node: &str, entries: &[Energy], t_s: f64) {
        self.on_the_way.book(node, entries, t_s);
        self.book(node, entries);
    }

    /// Books one accepted window of a node.
    pub fn book(&mut self, node: &str, entries: &[Energy]) {
        let account = self.nodes.entry(node.into()).or_default();
        for entry in entries {
            match entry.kind() {
                Stored => account.hold(entry),
                Gained => add(&mut account.gained, &mut account.ranges.gained, entry),
                Lost => add(&mut account.lost, &mut account.ranges.lost, entry),
                Kind::Unspecified => {}
            }
        }
    }

    /// Accounts by node.
    #[must_use]
    pub fn nodes(&self) -> &BTreeMap<String, Account> {
        &self.nodes
    }

    /// Imbalance of each node, and of each exchange as `"name: givers to takers"`, over the energy turned over:
    /// [`Account::turned_over`], or what crossed between the nodes by the range of its sum.
    #[must_use]
    pub fn imbalances(&self) -> BTreeMap<String, f64> {
        let relative = |imbalance: f64, turned_over: f64| {
            if turned_over > 0.0 { imbalance / turned_over } else { imbalance }
        };
        let mut result: BTreeMap<String, f64> = self
            .nodes
            .iter()
            .map(|(node, account)| (node.clone(), relative(account.imbalance(), account.turned_over())))
            .collect();
        let on_the_way = self.on_the_way.joules();
        for (between, name, [givers, takers]) in self.exchanges() {
            let sum = |sides: &[Side<'_>]| sides.iter().map(|side| side.joule).sum::<f64>();
            let moved = |sides: &[Side<'_>]| sides.iter().map(|side| side.moved).sum::<f64>();
            let imbalance = sum(&takers) - sum(&givers) + on_the_way.get(name).unwrap_or(&0.0);
            result.insert(between, relative(imbalance, moved(&givers).max(moved(&takers))));
        }
        result
    }

    /// Energy that its writer has given and its reader has not taken yet, as `"name: givers to takers"`, in J: only between nodes
    /// of which one solves in every n-th step. It may be negative, where a reader went on with a power that has fallen since.
    #[must_use]
    pub fn on_the_way(&self) -> BTreeMap<String, f64> {
        let joules = self.on_the_way.joules();
        let of = |(between, name, _): (String, &str, _)| Some((between, *joules.get(name)?));
        self.exchanges().into_iter().filter_map(of).filter(|(_, joule)| *joule != 0.0).collect()
    }

    /// What one side loses and another gains: `"name: givers to takers"`, its name, givers and takers.
    fn exchanges(&self) -> Vec<(String, &str, [Vec<Side<'_>>; 2])> {
        let mut exchanges: BTreeMap<&str, [Vec<Side<'_>>; 2]> = BTreeMap::new();
        for (node, account) in &self.nodes {
            let sides = [(&account.lost, &account.ranges.lost), (&account.gained, &account.ranges.gained)];
            for (side, (sums, ranges)) in sides.into_iter().enumerate() {
                for (name, joule) in sums {
                    let moved = ranges.get(name).map_or(joule.abs(), width);
                    exchanges.entry(name).or_default()[side].push(Side { node, joule: *joule, moved });
                }
            }
        }
        let names = |sides: &[Side<'_>]| sides.iter().map(|side| side.node).collect::<Vec<_>>().join(" and ");
        let both = exchanges.into_iter().filter(|(_, sides)| sides.iter().all(|side| !side.is_empty()));
        both.map(|(name, sides)| (format!("{name}: {} to {}", names(&sides[0]), names(&sides[1])), name, sides))
            .collect()
    }
}

/// What one node gave or took of an exchange, in J.
struct Side<'l> {
    node: &'l str,
    joule: f64,
    moved: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One node and its windows: the share of the imbalance at the end.
    fn share(start: &[Energy], windows: &[Vec<Energy>]) -> f64 {
        let mut ledger = Ledger::default();
        ledger.start("particles", start);
        windows.iter().for_each(|window| ledger.book("particles", window));
        ledger.imbalances()["particles"]
    }

    #[test]
    fn what_came_back_is_what_an_error_is_compared_with() {
        // A sphere between walls: what it has at a window's end is what it had, less an error of 1 in 1024.
        let moving = |joule| vec![Energy::of_motion("kinetic", joule)];
        assert_eq!(share(&moving(1024.0), &[moving(1024.0), moving(1023.0)]), -1.0 / 1024.0);
        // One that fell and came back up, in another node's potential without a zero of its own.
        let held =
            |kinetic, potential| vec![Energy::of_motion("kinetic", kinetic), Energy::stored("potential", potential)];
        let windows = [held(2.0, 6.0), held(4.0, 4.0), held(0.0, 7.0)];
        assert_eq!(share(&held(0.0, 8.0), &windows), -1.0 / 4.0);
        // What a wall put in and took out again.
        let worked = |heat, work| vec![Energy::stored("heat", heat), Energy::gained("walls", work)];
        let windows = [worked(103.0, 3.0), worked(101.0, -3.0)];
        assert_eq!(share(&[Energy::stored("heat", 100.0)], &windows), 1.0 / 3.0);
        // More windows of the same do not hide an error.
        let windows: Vec<_> = (0..1000).map(|k| moving([1024.0, 512.0][k % 2])).chain([moving(1023.0)]).collect();
        assert_eq!(share(&moving(1024.0), &windows), -1.0 / 1024.0);
    }

    #[test]
    fn the_rounding_of_what_rests_is_no_fault() {
        let held = |joule: f64| vec![Energy::stored("potential", joule)];
        // One unit in the last place of 1 J, over a millionth of a millionth of the three energies it is the difference of.
        let ulp = f64::EPSILON;
        assert!((share(&held(1.0), &[held(1.0 + ulp)]) - ulp / 2e-12).abs() < 1e-10);
    }

    #[test]
    fn a_balanced_exchange_closes_and_a_leak_shows_with_its_share() {
        let mut ledger = Ledger::default();
        ledger.start("thermal", &[Energy::stored("heat", 10.0)]);
        ledger.book(
            "optics",
            &[Energy::gained("laser", 4.0), Energy::lost("absorbed", 3.0), Energy::lost("passed", 1.0)],
        );
        ledger.book(
            "thermal",
            &[Energy::stored("heat", 12.0), Energy::gained("absorbed", 3.0), Energy::lost("to_walls", 1.0)],
        );
        let imbalances = ledger.imbalances();
        // Small integers: exact.
        assert_eq!(imbalances["optics"], 0.0);
        assert_eq!(imbalances["thermal"], 0.0);
        assert_eq!(imbalances["absorbed: optics to thermal"], 0.0);
        ledger.book("thermal", &[Energy::stored("heat", 14.0), Energy::gained("absorbed", 1.0)]);
        assert_eq!(ledger.imbalances()["thermal"], 1.0 / 4.0);
        assert_eq!(ledger.imbalances()["absorbed: optics to thermal"], 1.0 / 4.0);
        ledger.book("second", &[Energy::gained("laser", 1.0), Energy::lost("absorbed", 1.0)]);
        assert_eq!(ledger.imbalances()["absorbed: optics and second to thermal"], 0.0);
    }

    #[test]
    fn what_a_reader_has_not_taken_yet_is_on_its_way_and_no_imbalance() {
        let given = |joule| [Energy::lost("absorbed", joule)];
        let taken = |joule| [Energy::gained("absorbed", joule)];
        let mut ledger = Ledger::default();
        // A laser that solves in every third step: 2 W for 3 s, then 4 W for 3 s. Heat takes 0, 0, 2, 2, 2, 4 W.
        for (t_s, watt) in [(1.0, 0.0), (2.0, 0.0), (3.0, 2.0), (4.0, 2.0), (5.0, 2.0), (6.0, 4.0)] {
            ledger.book_until("thermal", &taken(watt), t_s);
            if t_s == 3.0 || t_s == 6.0 {
                ledger.book_until("optics", &given(3.0 * watt), t_s);
            }
        }
        assert_eq!(ledger.imbalances()["absorbed: optics to thermal"], 0.0);
        assert_eq!(ledger.on_the_way()["absorbed: optics to thermal"], 18.0 - 10.0);
        // What is lost between them still shows.
        ledger.book_until("thermal", &taken(1.0), 7.0);
        assert!(ledger.imbalances()["absorbed: optics to thermal"] < -0.1);
        // A reader that solves seldom takes what it finds for the whole of its window.
        let mut ledger = Ledger::default();
        for (t_s, watt) in [(1.0, 1.0), (2.0, 5.0)] {
            ledger.book_until("optics", &given(watt), t_s);
        }
        ledger.book_until("thermal", &taken(10.0), 2.0);
        assert_eq!(ledger.imbalances()["absorbed: optics to thermal"], 0.0);
        assert_eq!(ledger.on_the_way()["absorbed: optics to thermal"], 6.0 - 10.0);
    }
}
