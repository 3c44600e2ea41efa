//! Scenes whose numbers and whose texts are driven to their limits, through the parser and a run in one process.

mod found;
mod keys;
mod one_at_a_time;
mod run;
mod text;
mod together;
mod verdict;
