/// Blue, grey, red: three colours of K. Moreland's "smooth cool to warm" map (2009), whose middle is the lightest.
const MAP: [[f64; 3]; 3] = [[59.0, 76.0, 192.0], [221.0, 221.0, 221.0], [180.0, 4.0, 38.0]];

/// The values met so far in a run. Colours follow it, as what comes is not known while a run goes on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Range {
    low: f64,
    high: f64,
}

impl Range {
    /// Holds nothing.
    pub(super) const EMPTY: Self = Self { low: f64::INFINITY, high: f64::NEG_INFINITY };

    /// Widens the range by the finite ones of `values`.
    pub(super) fn include(&mut self, values: &[f64]) {
        for value in values.iter().filter(|value| value.is_finite()) {
            self.low = self.low.min(*value);
            self.high = self.high.max(*value);
        }
    }

    /// Red, green, blue and alpha of a value; the middle of the map where all values are equal.
    pub(super) fn colour(&self, value: f64) -> [u8; 4] {
        let width = self.high - self.low;
        let share = if width > 0.0 && value.is_finite() { ((value - self.low) / width).clamp(0.0, 1.0) } else { 0.5 };
        let place = 2.0 * share;
        let (from, to, weight) = if place < 1.0 { (MAP[0], MAP[1], place) } else { (MAP[1], MAP[2], place - 1.0) };
        let channel = |i: usize| (from[i] + weight * (to[i] - from[i])).round() as u8;
        [channel(0), channel(1), channel(2), u8::MAX]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_and_middle_of_what_was_met_have_the_ends_and_the_middle_of_the_map() {
        let mut range = Range::EMPTY;
        assert_eq!(range.colour(3.0), [221, 221, 221, 255]);
        range.include(&[300.0, f64::NAN, 500.0]);
        range.include(&[]);
        assert_eq!(range.colour(300.0), [59, 76, 192, 255]);
        assert_eq!(range.colour(400.0), [221, 221, 221, 255]);
        assert_eq!(range.colour(500.0), [180, 4, 38, 255]);
        assert_eq!(range.colour(1e9), [180, 4, 38, 255]);
    }
}
