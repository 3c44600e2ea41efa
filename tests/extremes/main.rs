//! Extreme input: what comes of it is finite and conserved, or refused with its cause.

// Helpers of tests are not tests to clippy's `allow-unwrap-in-tests`.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[path = "../validation/contact/bed.rs"]
#[expect(dead_code, reason = "shared with the validation tests, which need more of it")]
mod bed;
mod crowds;
mod laws;
mod motion;
mod outcome;
mod properties;
mod scene;
mod stability;
