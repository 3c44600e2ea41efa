//! Electrical current (Zohdi 2018, ch. 8): resistances of networks known exactly, energy that is neither made nor lost, the
//! monograph's averaging, what carries nothing, order in space and time, and the same answer for every order and thread.

mod averaging;
mod determinism;
mod network;
mod potential;
mod windows;
