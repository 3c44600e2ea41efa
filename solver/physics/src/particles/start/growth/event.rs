//! What happens next, in the order of time.

use std::cmp::Ordering;

/// Something that happens to a particle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// It meets another one.
    Pair(u32),
    /// It meets a wall: the axis, and whether the upper one.
    Wall(u8, bool),
    /// It leaves its cell: the axis, and whether upwards.
    Cell(u8, bool),
}

/// An event foreseen for a particle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Event {
    pub time: f64,
    pub particle: u32,
    /// Courses that it and its partner had taken when this was foreseen: with a newer one it does not happen.
    pub course: u32,
    pub partner_course: u32,
    pub kind: Kind,
}

impl Ord for Event {
    /// The earliest is the greatest, for a heap; events at one time come in the order of their particles.
    fn cmp(&self, other: &Self) -> Ordering {
        other.time.total_cmp(&self.time).then(other.particle.cmp(&self.particle))
    }
}

impl PartialOrd for Event {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Event {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Event {}
