//! Colours of a value in its range: K. Moreland's map of 2009.

use crate::display::colour_scale::{Range, Scale};

/// Blue, grey, red: three colours of K. Moreland's "smooth cool to warm" map (2009), whose middle is the lightest.
const MAP: [[f64; 3]; 3] = [[59.0, 76.0, 192.0], [221.0, 221.0, 221.0], [180.0, 4.0, 38.0]];

/// Red, green, blue and alpha of a value in the range of what was met so far in a run, as what comes is not known while it goes
/// on; the middle of the map where all values are equal.
pub(super) fn colour(range: &Range, value: f64) -> [u8; 4] {
    let share = if range.max > range.min && value.is_finite() { range.fraction(value, Scale::Linear) } else { 0.5 };
    let place = 2.0 * share;
    let (from, to, weight) = if place < 1.0 { (MAP[0], MAP[1], place) } else { (MAP[1], MAP[2], place - 1.0) };
    let channel = |i: usize| (from[i] + weight * (to[i] - from[i])).round() as u8;
    [channel(0), channel(1), channel(2), u8::MAX]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_and_middle_of_what_was_met_have_the_ends_and_the_middle_of_the_map() {
        let mut range = Range::EMPTY;
        assert_eq!(colour(&range, 3.0), [221, 221, 221, 255]);
        range.include(&[300.0, f64::NAN, 500.0]);
        range.include(&[]);
        assert_eq!(colour(&range, 300.0), [59, 76, 192, 255]);
        assert_eq!(colour(&range, 400.0), [221, 221, 221, 255]);
        assert_eq!(colour(&range, 500.0), [180, 4, 38, 255]);
        assert_eq!(colour(&range, 1e9), [180, 4, 38, 255]);
    }
}
