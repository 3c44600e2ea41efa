//! The physics against closed forms and published figures: one file for each, every tolerance argued where it stands.

// Helpers of tests are not tests to clippy's `allow-unwrap-in-tests`.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod coming_and_going;
mod contact;
mod coupling;
mod current;
mod heat;
mod light;
mod settling;
mod solid;
mod sound;
mod staggering;
mod substrate;
