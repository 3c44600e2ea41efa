use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use stagger_messages::{
    Energy,
    energy::Kind::{self, Gained, Lost, Stored},
};

/// The energy of a run, summed over accepted windows, in J.
///
/// A node's stored energy changes by what it gains less what it loses; what is left over is its imbalance. An amount
/// that one node loses and another gains under the same name crosses between them; the difference of the two sums is
/// that exchange's imbalance.
#[derive(Clone, Debug, Default, Serialize, Deserialize, PartialEq)]
pub struct Ledger {
    nodes: BTreeMap<String, Account>,
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
}

impl Account {
    /// Change of what is held, less what entered, plus what left: zero in an exact computation.
    #[must_use]
    pub fn imbalance(&self) -> f64 {
        total(&self.stored) - total(&self.initial) - total(&self.gained) + total(&self.lost)
    }

    /// The largest energy that moved: what an imbalance is to be compared with.
    #[must_use]
    pub fn throughput(&self) -> f64 {
        let moved = |now: &BTreeMap<String, f64>| now.values().map(|joule| joule.abs()).sum::<f64>();
        let converted: f64 =
            self.stored.iter().map(|(name, joule)| (joule - self.initial.get(name).unwrap_or(&0.0)).abs()).sum();
        moved(&self.gained).max(moved(&self.lost)).max(converted)
    }
}

fn total(entries: &BTreeMap<String, f64>) -> f64 {
    entries.values().sum()
}

impl Ledger {
    /// Books what a node holds at t = 0.
    pub fn start(&mut self, node: &str, entries: &[Energy]) {
        let account = self.nodes.entry(node.into()).or_default();
        for entry in entries.iter().filter(|entry| entry.kind() == Stored) {
            account.initial.insert(entry.name.clone(), entry.joule);
            account.stored.insert(entry.name.clone(), entry.joule);
        }
    }

    /// Books one accepted window of a node.
    pub fn book(&mut self, node: &str, entries: &[Energy]) {
        let account = self.nodes.entry(node.into()).or_default();
        for entry in entries {
            match entry.kind() {
                Stored => {
                    account.stored.insert(entry.name.clone(), entry.joule);
                }
                Gained => *account.gained.entry(entry.name.clone()).or_default() += entry.joule,
                Lost => *account.lost.entry(entry.name.clone()).or_default() += entry.joule,
                Kind::Unspecified => {}
            }
        }
    }

    /// Accounts by node.
    #[must_use]
    pub fn nodes(&self) -> &BTreeMap<String, Account> {
        &self.nodes
    }

    /// Imbalance of each node, and of each exchange as `"name: givers to takers"`, over its throughput.
    #[must_use]
    pub fn imbalances(&self) -> BTreeMap<String, f64> {
        let relative = |imbalance: f64, throughput: f64| {
            if throughput > 0.0 { imbalance / throughput } else { imbalance }
        };
        let mut result: BTreeMap<String, f64> = self
            .nodes
            .iter()
            .map(|(node, account)| (node.clone(), relative(account.imbalance(), account.throughput())))
            .collect();
        let mut exchanges: BTreeMap<&str, [Vec<(&str, f64)>; 2]> = BTreeMap::new();
        for (node, account) in &self.nodes {
            for (side, entries) in [&account.lost, &account.gained].into_iter().enumerate() {
                for (name, joule) in entries {
                    exchanges.entry(name).or_default()[side].push((node, *joule));
                }
            }
        }
        for (name, [givers, takers]) in exchanges {
            if givers.is_empty() || takers.is_empty() {
                continue;
            }
            let names = |side: &[(&str, f64)]| side.iter().map(|(node, _)| *node).collect::<Vec<_>>().join(" and ");
            let sum = |side: &[(&str, f64)]| side.iter().map(|(_, joule)| joule).sum::<f64>();
            let (lost, gained) = (sum(&givers), sum(&takers));
            let between = format!("{name}: {} to {}", names(&givers), names(&takers));
            result.insert(between, relative(gained - lost, lost.abs()));
        }
        result
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        assert_eq!(ledger.imbalances()["absorbed: optics to thermal"], 1.0 / 3.0);
        ledger.book("second", &[Energy::gained("laser", 1.0), Energy::lost("absorbed", 1.0)]);
        assert_eq!(ledger.imbalances()["absorbed: optics and second to thermal"], 0.0);
    }
}
