//! Trade-offs of the current: its heat is what errors are measured by.

use crate::common::tradeoff::Tradeoff;

/// What the current contributes to trade-offs.
pub static TRADEOFF: Tradeoff =
    Tradeoff { usual: &["energy joule"], words: &[("joule heat", "energy joule")], ..Tradeoff::NONE };
