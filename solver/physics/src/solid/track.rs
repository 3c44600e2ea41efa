//! What an engineer asks of a melt track: its width and depth, the pool's length, width and depth, how fast it cooled.

use serde::{Deserialize, Serialize};
use stagger_coupling::Window;

use super::settings::Track;
use crate::common::grid::CellGrid;

/// Lengths of the part of a solid that is hotter than a border, in m.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Extent {
    /// Longest line along the track at the surface.
    pub(super) length_m: f64,
    /// Longest line across it at the surface.
    pub(super) width_m: f64,
    /// Deepest column.
    pub(super) depth_m: f64,
}

/// How the surface cools, cell by cell.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Cooling {
    /// When each cell fell below the higher temperature, in s; negative where it has not since it was above.
    fell_s: Vec<f64>,
    /// Rate between the two temperatures the last time, in K/s; 0 where it has not fallen through both.
    pub(super) rates_k_s: Vec<f64>,
}

/// Reads extents out of fields on a grid.
pub(super) struct Sections<'g> {
    grid: &'g CellGrid,
    track: Track,
    middles_m: [Vec<f64>; 3],
}

impl<'g> Sections<'g> {
    pub(super) fn new(grid: &'g CellGrid, track: Track) -> Self {
        Self { grid, track, middles_m: [0, 1, 2].map(|axis| grid.middles_m(axis)) }
    }

    /// Extent of what is at least as hot as the border, where borders are found by linear interpolation between middles of cells.
    pub(super) fn extent(&self, temperatures_k: &[f64]) -> Extent {
        let along = self.track.along;
        let across = 1 - along;
        let counts = self.grid.counts();
        let longest = |axis: usize, lines: usize| {
            (0..lines).map(|line| self.line_m(axis, line, temperatures_k)).fold(0.0, f64::max)
        };
        let depths = (0..counts[along]).map(|place| self.section(place, temperatures_k)[1]);
        Extent {
            length_m: longest(along, counts[across]),
            width_m: longest(across, counts[along]),
            depth_m: depths.fold(0.0, f64::max),
        }
    }

    /// Mean width and depth, in m, of the sections across the track within its part; weighted by the widths of their cells.
    pub(super) fn mean(&self, peaks_k: &[f64]) -> [f64; 2] {
        let along = self.track.along;
        let widths_m = self.grid.widths_m(along);
        let [from_m, to_m] = self.track.part_m;
        let (mut sums, mut length_m) = ([0.0; 2], 0.0);
        for (place, middle_m) in self.middles_m[along].iter().enumerate() {
            if (from_m..=to_m).contains(middle_m) {
                let section = self.section(place, peaks_k);
                sums = [0, 1].map(|of| sums[of] + widths_m[place] * section[of]);
                length_m += widths_m[place];
            }
        }
        sums.map(|sum| if length_m > 0.0 { sum / length_m } else { 0.0 })
    }

    /// Width at the surface and depth of one section across the track, in m.
    fn section(&self, place: usize, temperatures_k: &[f64]) -> [f64; 2] {
        let along = self.track.along;
        let across = 1 - along;
        let counts = self.grid.counts();
        let depth = |line: usize| {
            let mut cell = [0; 3];
            (cell[along], cell[across]) = (place, line);
            self.depth_m(cell, temperatures_k)
        };
        let depth_m = (0..counts[across]).map(depth).fold(0.0, f64::max);
        [self.line_m(across, place, temperatures_k), depth_m]
    }

    /// Length of the hot part of a line at the surface along an axis, between its outermost borders, in m.
    fn line_m(&self, axis: usize, line: usize, temperatures_k: &[f64]) -> f64 {
        let counts = self.grid.counts();
        let at = |place: usize| {
            let mut cell = [line, line, counts[2] - 1];
            cell[axis] = place;
            temperatures_k[self.grid.row(cell)]
        };
        let is_hot = |place: &usize| at(*place) >= self.track.border_k;
        let mut places = 0..counts[axis];
        let Some(first) = places.clone().find(is_hot) else { return 0.0 };
        let Some(last) = places.rfind(is_hot) else { return 0.0 };
        let edges_m = &self.grid.edges_m[axis];
        let from_m =
            if first == 0 { edges_m[0] } else { self.border_m(axis, first, first - 1, [at(first), at(first - 1)]) };
        let to_m = if last + 1 == counts[axis] {
            edges_m[last + 1]
        } else {
            self.border_m(axis, last, last + 1, [at(last), at(last + 1)])
        };
        to_m - from_m
    }

    /// Depth to which a column is hot from the surface on, in m; `cell` is any of the column.
    fn depth_m(&self, cell: [usize; 3], temperatures_k: &[f64]) -> f64 {
        let layers = self.grid.counts()[2];
        let at = |layer: usize| temperatures_k[self.grid.row([cell[0], cell[1], layer])];
        let edges_m = &self.grid.edges_m[2];
        let cold = (0..layers).rfind(|layer| at(*layer) < self.track.border_k);
        match cold {
            None => edges_m[layers] - edges_m[0],
            Some(cold) if cold + 1 == layers => 0.0,
            Some(cold) => edges_m[layers] - self.border_m(2, cold + 1, cold, [at(cold + 1), at(cold)]),
        }
    }

    /// Where the border lies between the middles of a hot cell and of its cold neighbour, in m.
    fn border_m(&self, axis: usize, hot: usize, cold: usize, [hot_k, cold_k]: [f64; 2]) -> f64 {
        let middles_m = &self.middles_m[axis];
        let share = if hot_k > cold_k { (hot_k - self.track.border_k) / (hot_k - cold_k) } else { 0.0 };
        middles_m[hot] + share * (middles_m[cold] - middles_m[hot])
    }
}

impl Cooling {
    pub(super) fn new(cells: usize) -> Self {
        Self { fell_s: vec![-1.0; cells], rates_k_s: vec![0.0; cells] }
    }

    /// Follows the surface over a window, between whose ends temperatures are taken as linear in time.
    pub(super) fn follow(&mut self, [hot_k, cold_k]: [f64; 2], start_k: &[f64], end_k: &[f64], window: Window) {
        let ends = start_k.iter().zip(end_k);
        for ((fell_s, rate_k_s), (&start_k, &end_k)) in self.fell_s.iter_mut().zip(&mut self.rates_k_s).zip(ends) {
            let falls_through = |at_k: f64| {
                (start_k >= at_k && end_k < at_k)
                    .then(|| window.t_s + window.dt_s * (start_k - at_k) / (start_k - end_k))
            };
            if end_k >= hot_k {
                *fell_s = -1.0;
            }
            if let Some(at_s) = falls_through(hot_k) {
                *fell_s = at_s;
            }
            if let Some(at_s) = falls_through(cold_k).filter(|at_s| *fell_s >= 0.0 && at_s > fell_s) {
                *rate_k_s = (hot_k - cold_k) / (at_s - *fell_s);
                *fell_s = -1.0;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRACK: Track = Track { along: 0, border_k: 10.0, part_m: [1.0, 3.0], cooling_k: None };

    /// A ridge along x: temperature falls by 1 K per metre away from y = 5 and below z = 4, and is 12 K there.
    fn ridge(grid: &CellGrid) -> Vec<f64> {
        let [x, y, z] = [0, 1, 2].map(|axis| grid.middles_m(axis));
        let mut values = Vec::new();
        for z in &z {
            for y in &y {
                values.extend(x.iter().map(|_| 12.0 - (y - 5.0).abs() - (4.0 - z)));
            }
        }
        values
    }

    #[test]
    fn borders_lie_between_the_middles_of_cells() {
        let grid = CellGrid::regular("plate", [0.0; 3], [4.0, 10.0, 4.0], [4, 40, 16]);
        let sections = Sections::new(&grid, TRACK);
        // The uppermost middles are an eighth below the surface, so there the ridge is 2 − 1/8 wide to each side; the middles
        // nearest to its crest are an eighth beside it.
        let [width_m, depth_m] = sections.mean(&ridge(&grid));
        assert!((width_m - 3.75).abs() < 1e-12 && (depth_m - 1.875).abs() < 1e-12, "{width_m}, {depth_m}");
        let extent = sections.extent(&ridge(&grid));
        let expected = Extent { length_m: 4.0, width_m, depth_m };
        assert_eq!(extent, expected);
        assert_eq!(sections.extent(&vec![9.0; grid.len()]), Extent::default());
        assert_eq!(sections.extent(&vec![11.0; grid.len()]), Extent { length_m: 4.0, width_m: 10.0, depth_m: 4.0 });
    }

    #[test]
    fn the_cooling_rate_is_that_between_the_two_temperatures() {
        let mut cooling = Cooling::new(2);
        // The first cell falls by 100 K/s from 1000 K on, through 800 and 600; the second is heated again before 600.
        let first = |t_s: f64| 1000.0 - 100.0 * t_s;
        let second = |t_s: f64| if t_s <= 3.0 { first(t_s) } else { first(3.0) + 200.0 * (t_s - 3.0) };
        for step in 0..16 {
            let window = Window { t_s: 0.3 * f64::from(step), dt_s: 0.3 };
            let at = |t_s: f64| [first(t_s), second(t_s)];
            cooling.follow([800.0, 600.0], &at(window.t_s), &at(window.t_s + window.dt_s), window);
        }
        assert!((cooling.rates_k_s[0] - 100.0).abs() < 1e-9, "{:?}", cooling.rates_k_s);
        assert_eq!(cooling.rates_k_s[1], 0.0);
    }
}
