//! How the surface of a wall on an elastic substrate gives way under the particles.

/// How far the surface of a wall has given way under each particle, in m, in memory order.
#[derive(Clone, Copy)]
pub struct Sinking<'a> {
    pub wall: usize,
    /// At the window's start.
    pub start_m: &'a [f64],
    /// At its end, and the window's length in s; it sinks evenly in between. `None` where it stays.
    pub end_m: Option<(&'a [f64], f64)>,
    /// Share of the window that has passed.
    pub fraction: f64,
}

impl Sinking<'_> {
    /// Depth in m and its rate in m/s under a particle.
    #[inline]
    pub fn under(&self, particle: usize, wall: usize) -> (f64, f64) {
        if wall != self.wall {
            return (0.0, 0.0);
        }
        let start = self.start_m[particle];
        self.end_m.map_or((start, 0.0), |(end_m, window_s)| {
            let change = end_m[particle] - start;
            (start + self.fraction * change, change / window_s)
        })
    }
}
