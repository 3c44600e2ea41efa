//! Free flight of growing spheres from event to event.

use std::collections::BinaryHeap;

use super::event::{Event, Kind};
use crate::common::Vec3;

/// The final radii are overshot by this share, so that rounding leaves no overlap.
pub(super) const OVERSHOOT: f64 = 1e-9;

/// Spheres between the walls of a box with a corner at the origin, in units of the mean final diameter.
pub(super) struct Flight {
    extent: Vec3,
    /// Final radii.
    radii: Vec<f64>,
    /// Positions, each at its own time.
    pub positions: Vec<Vec3>,
    velocities: Vec<Vec3>,
    times: Vec<f64>,
    courses: Vec<u32>,
    /// Share of their final radii at time zero, and how fast it grows.
    pub share: f64,
    rate: f64,
    grid: Grid,
    events: BinaryHeap<Event>,
}

impl Flight {
    pub fn new(extent: Vec3, radii: Vec<f64>, positions: Vec<Vec3>, velocities: Vec<Vec3>, share: f64) -> Self {
        let largest = radii.iter().fold(0.0f64, |largest, &radius| largest.max(radius));
        let grid = Grid::new(&extent, 2.0 * largest * (1.0 + 2.0 * OVERSHOOT), &positions);
        let count = positions.len();
        Self {
            extent,
            radii,
            positions,
            velocities,
            times: vec![0.0; count],
            courses: vec![0; count],
            share,
            rate: 0.0,
            grid,
            events: BinaryHeap::with_capacity(2 * count),
        }
    }

    /// Begins anew at time zero with unit kinetic energy per axis and a rate of growth.
    ///
    /// Growing walls and spheres push what they meet: without this, speeds would rise without bound, and time grow short of
    /// digits.
    pub fn renew(&mut self, rate: f64) {
        let count = self.positions.len();
        let square: f64 = self.velocities.iter().map(Vec3::norm_squared).sum();
        let scale = if square > 0.0 { (3.0 * count as f64 / square).sqrt() } else { 1.0 };
        self.rate = rate;
        self.events.clear();
        for i in 0..count {
            self.velocities[i] *= scale;
            (self.times[i], self.courses[i]) = (0.0, 0);
        }
        for i in 0..count {
            self.foresee(i, 0.0);
        }
    }

    /// Runs until the share is `target`, true, or for a number of collisions. All positions are then of one time.
    pub fn run(&mut self, target: f64, collisions: usize) -> bool {
        let end = ((target - self.share) / self.rate).max(0.0);
        let (mut now, mut left, mut reached) = (0.0f64, 2 * collisions, true);
        while let Some(event) = self.events.pop() {
            let i = event.particle as usize;
            if event.course != self.courses[i] {
                continue;
            }
            if event.time >= end {
                break;
            }
            now = now.max(event.time);
            match event.kind {
                Kind::Pair(j) if event.partner_course != self.courses[j as usize] => {}
                Kind::Pair(j) => {
                    left = left.saturating_sub(2);
                    self.bounce(i, j as usize, now);
                    self.foresee(j as usize, now);
                }
                Kind::Wall(axis, upper) => {
                    left = left.saturating_sub(1);
                    self.bounce_off(i, axis.into(), upper, now);
                }
                Kind::Cell(axis, upwards) => {
                    self.advance(i, now);
                    self.grid.cross(i, axis.into(), upwards);
                }
            }
            self.foresee(i, now);
            if left == 0 {
                reached = false;
                break;
            }
        }
        let now = if reached { end } else { now };
        (0..self.positions.len()).for_each(|i| self.advance(i, now));
        self.share += self.rate * now;
        reached
    }

    fn advance(&mut self, i: usize, now: f64) {
        self.positions[i] += self.velocities[i] * (now - self.times[i]);
        self.times[i] = now;
    }

    /// Elastic collision of equal masses, seen from surfaces that move apart as both grow.
    fn bounce(&mut self, i: usize, j: usize, now: f64) {
        self.advance(i, now);
        self.advance(j, now);
        let apart = self.positions[j] - self.positions[i];
        let distance = apart.norm();
        // Two at one place never meet: they would have had to overlap.
        let normal = if distance > 0.0 { apart / distance } else { Vec3::x() };
        let opening = (self.velocities[j] - self.velocities[i]).dot(&normal);
        let change = self.rate * (self.radii[i] + self.radii[j]) - opening;
        self.velocities[i] -= normal * change;
        self.velocities[j] += normal * change;
        for k in [i, j] {
            self.courses[k] = self.courses[k].wrapping_add(1);
        }
    }

    fn bounce_off(&mut self, i: usize, axis: usize, upper: bool, now: f64) {
        self.advance(i, now);
        let push = 2.0 * self.rate * self.radii[i];
        let push = if upper { -push } else { push };
        self.velocities[i][axis] = push - self.velocities[i][axis];
        self.courses[i] = self.courses[i].wrapping_add(1);
    }

    /// Finds what happens next to a particle on its course.
    fn foresee(&mut self, i: usize, now: f64) {
        let position = self.positions[i] + self.velocities[i] * (now - self.times[i]);
        let velocity = self.velocities[i];
        let share = self.share + self.rate * now;
        let (mut soonest, mut kind) = (f64::INFINITY, None);
        let mut find = |wait: f64, what: Kind| {
            if wait < soonest {
                (soonest, kind) = (wait, Some(what));
            }
        };
        let cell = self.grid.places[i];
        for axis in 0..3u8 {
            let a = usize::from(axis);
            let (x, v) = (position[a], velocity[a]);
            let (radius, growth) = (share * self.radii[i], self.rate * self.radii[i]);
            if growth > v {
                find(((x - radius) / (growth - v)).max(0.0), Kind::Wall(axis, false));
            }
            if growth > -v {
                find(((self.extent[a] - x - radius) / (growth + v)).max(0.0), Kind::Wall(axis, true));
            }
            let edge = self.grid.edges[a];
            if v > 0.0 && cell[a] + 1 < self.grid.sides[a] {
                find((((cell[a] + 1) as f64 * edge - x) / v).max(0.0), Kind::Cell(axis, true));
            } else if v < 0.0 && cell[a] > 0 {
                find(((cell[a] as f64 * edge - x) / v).max(0.0), Kind::Cell(axis, false));
            }
        }
        let mut partner_course = 0;
        self.grid.around(cell, |j| {
            if j as usize == i {
                return;
            }
            let other = j as usize;
            let apart = self.positions[other] + self.velocities[other] * (now - self.times[other]) - position;
            let opening = self.velocities[other] - velocity;
            let reach = self.radii[i] + self.radii[other];
            if let Some(wait) = meeting(&apart, &opening, share * reach, self.rate * reach)
                && wait < soonest
            {
                (soonest, kind) = (wait, Some(Kind::Pair(j)));
                partner_course = self.courses[other];
            }
        });
        if let Some(kind) = kind {
            let (particle, course) = (i as u32, self.courses[i]);
            self.events.push(Event { time: now + soonest, particle, course, partner_course, kind });
        }
    }
}

/// Time until two points that fly apart by `apart` + t `opening` come within `reach` + t `growth`; `None` is never.
#[inline]
fn meeting(apart: &Vec3, opening: &Vec3, reach: f64, growth: f64) -> Option<f64> {
    // a t² + 2 b t + c = 0, solved without cancellation (Press et al. 2007, section 5.6).
    let a = opening.norm_squared() - growth * growth;
    let b = apart.dot(opening) - reach * growth;
    let c = apart.norm_squared() - reach * reach;
    if b >= 0.0 && a >= 0.0 {
        return None;
    }
    if c <= 0.0 {
        // Touching, up to rounding: now where they close in, not where they part.
        return (b < 0.0).then_some(0.0);
    }
    let square = b * b - a * c;
    if square < 0.0 {
        return None;
    }
    let root = square.sqrt();
    let wait = if b < 0.0 { c / (root - b) } else { -(b + root) / a };
    (wait >= 0.0 && wait.is_finite()).then_some(wait)
}

/// Cells at least as wide as the largest final diameter.
struct Grid {
    edges: Vec3,
    sides: [usize; 3],
    /// Particles by cell.
    cells: Vec<Vec<u32>>,
    /// Cells by particle.
    places: Vec<[usize; 3]>,
}

impl Grid {
    fn new(extent: &Vec3, least: f64, positions: &[Vec3]) -> Self {
        // Not more cells than particles, however flat the box.
        let most = positions.len().max(1);
        let sides = [0, 1, 2].map(|axis| ((extent[axis] / least) as usize).clamp(1, most));
        let edges = Vec3::from_fn(|axis, _| extent[axis] / sides[axis] as f64);
        let mut grid = Self { edges, sides, cells: vec![Vec::new(); sides.iter().product()], places: Vec::new() };
        for (i, position) in positions.iter().enumerate() {
            let place = [0, 1, 2].map(|axis| ((position[axis] / edges[axis]) as usize).min(sides[axis] - 1));
            let index = grid.index(place);
            grid.cells[index].push(i as u32);
            grid.places.push(place);
        }
        grid
    }

    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (x * self.sides[1] + y) * self.sides[2] + z
    }

    fn cross(&mut self, i: usize, axis: usize, upwards: bool) {
        let mut place = self.places[i];
        let from = self.index(place);
        place[axis] = if upwards { place[axis] + 1 } else { place[axis].saturating_sub(1) };
        let to = self.index(place);
        self.cells[from].retain(|&other| other as usize != i);
        self.cells[to].push(i as u32);
        self.places[i] = place;
    }

    fn around(&self, place: [usize; 3], mut visit: impl FnMut(u32)) {
        let range = |axis: usize| place[axis].saturating_sub(1)..=(place[axis] + 1).min(self.sides[axis] - 1);
        for x in range(0) {
            for y in range(1) {
                for z in range(2) {
                    self.cells[self.index([x, y, z])].iter().for_each(|&other| visit(other));
                }
            }
        }
    }
}
