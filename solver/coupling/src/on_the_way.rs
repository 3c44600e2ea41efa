//! Energy between a writer and a reader that solve at rates of their own.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use stagger_messages::{Energy, energy::Kind};

/// What crosses between nodes, in the order in which they solve.
///
/// A power is a mean over its writer's window, and its reader takes what it finds for the whole of its own. Where one of the two
/// solves in every n-th step only ([`Settings::every`](super::Settings::every)), an amount J given in a window of length T_w is taken
/// as J/T_w for as long as it stands: before the writer has solved again, a reader took the value before. What was given and is not
/// taken in this sense is on its way; it is no error of either node.
#[derive(Clone, Debug, Default, Serialize, Deserialize, PartialEq)]
pub(super) struct OnTheWay {
    /// When each node solved last, in s.
    solved_s: BTreeMap<String, f64>,
    /// What each writer gave last under each name, in J, and its window's length, in s.
    given: BTreeMap<String, BTreeMap<String, (f64, f64)>>,
    /// Given and not taken, by name, in J.
    joule: BTreeMap<String, f64>,
    /// Windows that ended at `pending_s`: whoever reads takes what is given in the same step.
    pending: Vec<Solved>,
    pending_s: f64,
}

/// One node's part of a step.
#[derive(Clone, Debug, Default, Serialize, Deserialize, PartialEq)]
struct Solved {
    node: String,
    dt_s: f64,
    gained: Vec<String>,
    lost: Vec<(String, f64)>,
}

impl OnTheWay {
    /// A node's accepted window that ends at `t_s`.
    pub(super) fn book(&mut self, node: &str, entries: &[Energy], t_s: f64) {
        if t_s > self.pending_s {
            self.settle();
            self.pending_s = t_s;
        }
        let dt_s = t_s - self.solved_s.insert(node.into(), t_s).unwrap_or(0.0);
        let of = |kind| entries.iter().filter(move |entry| entry.kind() == kind);
        let gained = of(Kind::Gained).map(|entry| entry.name.clone()).collect();
        let lost = of(Kind::Lost).map(|entry| (entry.name.clone(), entry.joule)).collect();
        self.pending.push(Solved { node: node.into(), dt_s, gained, lost });
    }

    /// What is on its way after all that is booked, by name, in J.
    pub(super) fn joules(&self) -> BTreeMap<String, f64> {
        let mut settled = self.clone();
        settled.settle();
        settled.joule
    }

    fn settle(&mut self) {
        let solved = std::mem::take(&mut self.pending);
        for Solved { node, dt_s, lost, .. } in &solved {
            for (name, joule) in lost {
                self.given.entry(name.clone()).or_default().insert(node.clone(), (*joule, *dt_s));
                *self.joule.entry(name.clone()).or_default() += joule;
            }
        }
        for Solved { dt_s, gained, .. } in &solved {
            for name in gained {
                for &(joule, given_s) in self.given.get(name).into_iter().flat_map(BTreeMap::values) {
                    // Nodes that solve together take exactly what was given.
                    let taken = if *dt_s == given_s || given_s <= 0.0 { joule } else { joule / given_s * dt_s };
                    *self.joule.entry(name.clone()).or_default() -= taken;
                }
            }
        }
    }
}
