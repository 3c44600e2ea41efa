//! Sizes of a run's windows, in bounded memory.

use crate::WindowSizes;

/// Parts kept at most.
const PARTS: usize = 4096;

/// Sizes of accepted windows in their order, in bounded memory: where there are more than it keeps, as means of equally
/// many neighbours.
#[derive(Clone, Debug)]
pub(crate) struct WindowHistory {
    /// Mean of each part; the last one may be of fewer steps than the others.
    parts: Vec<f64>,
    steps_in_part: u64,
    steps_in_last: u64,
    min_s: f64,
    max_s: f64,
}

impl Default for WindowHistory {
    fn default() -> Self {
        Self { parts: Vec::new(), steps_in_part: 1, steps_in_last: 1, min_s: f64::INFINITY, max_s: 0.0 }
    }
}

impl WindowHistory {
    /// Takes the next window, in s.
    pub(crate) fn push(&mut self, dt_s: f64) {
        (self.min_s, self.max_s) = (self.min_s.min(dt_s), self.max_s.max(dt_s));
        if let Some(last) = self.parts.last_mut().filter(|_| self.steps_in_last < self.steps_in_part) {
            self.steps_in_last += 1;
            *last += (dt_s - *last) / self.steps_in_last as f64;
            return;
        }
        if self.parts.len() == PARTS {
            self.parts = self.parts.chunks(2).map(|pair| pair.iter().sum::<f64>() / pair.len() as f64).collect();
            self.steps_in_part *= 2;
        }
        self.parts.push(dt_s);
        self.steps_in_last = 1;
    }

    /// Smallest, median and largest; `None` where there are none.
    pub(crate) fn sizes(&self) -> Option<WindowSizes> {
        let mut sorted = self.parts.clone();
        sorted.sort_by(f64::total_cmp);
        let median_s = *sorted.get(sorted.len() / 2)?;
        Some(WindowSizes { min_s: self.min_s, median_s, max_s: self.max_s })
    }

    /// Means over at most so many equal parts, in their order.
    pub(crate) fn parts(&self, most: usize) -> Vec<f64> {
        let (have, wanted) = (self.parts.len(), self.parts.len().min(most));
        let part = |at: usize| &self.parts[at * have / wanted..(at + 1) * have / wanted];
        (0..wanted).map(|at| part(at).iter().sum::<f64>() / part(at).len() as f64).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn history(sizes: impl IntoIterator<Item = f64>) -> WindowHistory {
        let mut history = WindowHistory::default();
        sizes.into_iter().for_each(|size| history.push(size));
        history
    }

    #[test]
    fn sizes_do_not_depend_on_their_order() {
        let expected = WindowSizes { min_s: 1.0, median_s: 2.0, max_s: 9.0 };
        assert_eq!(history([9.0, 1.0, 2.0]).sizes(), Some(expected));
        assert_eq!(history([]).sizes(), None);
        assert_eq!(history([]).parts(60), Vec::<f64>::new());
    }

    #[test]
    fn few_windows_are_kept_and_many_are_means_of_neighbours_in_bounded_memory() {
        assert_eq!(history([9.0, 1.0, 2.0]).parts(60), [9.0, 1.0, 2.0]);
        assert_eq!(history([9.0, 1.0, 2.0, 4.0]).parts(2), [5.0, 3.0]);
        // The means of a ramp are its middles.
        let ramp = history((0..100_000).map(f64::from));
        assert!(ramp.parts.len() <= PARTS);
        let parts = ramp.parts(60);
        assert_eq!(parts.len(), 60);
        for (at, part) in parts.iter().enumerate() {
            // 3125 parts of 32 steps do not divide by 60: both ends of what is taken together lie up to 32 steps off.
            let middle = (at as f64 + 0.5) * 100_000.0 / 60.0;
            assert!((part - middle).abs() < 33.0, "{at}: {part} for {middle}");
        }
        assert_eq!(ramp.sizes().map(|sizes| (sizes.min_s, sizes.max_s)), Some((0.0, 99_999.0)));
    }
}
