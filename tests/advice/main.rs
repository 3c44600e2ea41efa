//! Advice of `stagger check --advise` against the truth: what it says can be left out is left out, and the named quantities
//! change by less than it said; where it does not say so, leaving it out changes them by more.

// Helpers of tests are not tests to clippy's `allow-unwrap-in-tests`.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod costs;
mod heat;
mod light;
mod motion;
mod truth;
