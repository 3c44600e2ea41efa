//! Curves of bounded length.

/// Groups of neighbours that a curve is kept in; each is two points at most.
const GROUPS: usize = 500;

/// A curve that is taken point by point and kept with at most some 1000 points: where there are more, neighbours are
/// put together, and of each group its lowest and its highest point stay, so that no peak is lost.
#[derive(Clone, Debug)]
pub struct Thinned {
    groups: Vec<Group>,
    /// Points put together in each group but the last.
    each: u64,
    /// Points in the last group.
    filled: u64,
    ends: Option<[[f64; 2]; 2]>,
}

impl Default for Thinned {
    fn default() -> Self {
        Self { groups: Vec::new(), each: 1, filled: 0, ends: None }
    }
}

#[derive(Clone, Copy, Debug)]
struct Group {
    low: [f64; 2],
    high: [f64; 2],
}

impl Group {
    fn with(self, other: Self) -> Self {
        Self {
            low: if other.low[1] < self.low[1] { other.low } else { self.low },
            high: if other.high[1] > self.high[1] { other.high } else { self.high },
        }
    }
}

impl Thinned {
    /// Takes the next point; one that is not finite is left out. Abscissas are expected not to decrease.
    pub fn push(&mut self, x: f64, y: f64) {
        if !(x.is_finite() && y.is_finite()) {
            return;
        }
        let point = [x, y];
        self.ends = Some([self.ends.map_or(point, |[first, _]| first), point]);
        let new = Group { low: point, high: point };
        if self.filled < self.each
            && let Some(last) = self.groups.last_mut()
        {
            *last = last.with(new);
            self.filled += 1;
            return;
        }
        if self.groups.len() == GROUPS {
            self.groups =
                self.groups.chunks(2).map(|pair| pair.iter().copied().reduce(Group::with).unwrap_or(new)).collect();
            self.each *= 2;
        }
        self.groups.push(new);
        self.filled = 1;
    }

    /// The points that are kept, in the order they came.
    #[must_use]
    pub fn points(&self) -> Vec<[f64; 2]> {
        let mut points = Vec::with_capacity(2 * self.groups.len() + 2);
        let Some([first, last]) = self.ends else { return points };
        points.push(first);
        for Group { low, high } in &self.groups {
            points.extend(if low[0] <= high[0] { [*low, *high] } else { [*high, *low] });
        }
        points.push(last);
        points.dedup();
        points
    }

    /// Whether points were left out.
    #[must_use]
    pub fn is_thinned(&self) -> bool {
        self.each > 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(count: u32, y: impl Fn(u32) -> f64) -> Thinned {
        let mut curve = Thinned::default();
        (0..count).for_each(|i| curve.push(f64::from(i), y(i)));
        curve
    }

    #[test]
    fn a_short_curve_is_kept_as_it_is() {
        let y = |i: u32| f64::from(i * 7 % 13);
        let kept = curve(500, y);
        assert!(!kept.is_thinned());
        assert_eq!(kept.points(), (0..500).map(|i| [f64::from(i), y(i)]).collect::<Vec<_>>());
        assert!(Thinned::default().points().is_empty());
    }

    #[test]
    fn a_long_curve_keeps_its_ends_and_each_peak() {
        // A peak of a single point up and one down, in a curve of a million.
        let y = |i: u32| if i == 654_321 { 5.0 } else { f64::from(i % 2) - if i == 123_457 { 9.0 } else { 0.0 } };
        let points = curve(1_000_000, y).points();
        assert!(points.len() <= 2 * GROUPS + 2, "{}", points.len());
        assert!(points.len() > GROUPS, "{}", points.len());
        assert!(points.contains(&[654_321.0, 5.0]) && points.contains(&[123_457.0, -8.0]));
        assert_eq!((points[0], points[points.len() - 1]), ([0.0, 0.0], [999_999.0, 1.0]));
        assert!(points.is_sorted_by(|a, b| a[0] <= b[0]));
    }

    #[test]
    fn what_is_not_finite_is_left_out() {
        assert_eq!(curve(3, |i| if i == 1 { f64::NAN } else { 1.0 }).points(), [[0.0, 1.0], [2.0, 1.0]]);
    }
}
