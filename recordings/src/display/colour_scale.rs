//! Numbers as colours.

use stagger_coupling::math;

/// The colour map "inferno" by N. Smith and S. van der Walt (matplotlib 1.5, public domain) at nine equal steps: its
/// lightness grows evenly, so that equal differences look equal, in grey as well.
const INFERNO: [[u8; 3]; 9] = [
    [0x00, 0x00, 0x04],
    [0x21, 0x0c, 0x4a],
    [0x56, 0x10, 0x6e],
    [0x89, 0x22, 0x6a],
    [0xbb, 0x37, 0x54],
    [0xe3, 0x59, 0x32],
    [0xf9, 0x8c, 0x0a],
    [0xf9, 0xc9, 0x32],
    [0xfc, 0xff, 0xa4],
];
/// Share of the map that is left out at its dark end, where a ball is a black spot and shows no shape.
const DARK: f64 = 0.16;

/// Colour of what has no value: a neutral grey.
pub const NO_VALUE: [u8; 3] = [0x9a, 0x9a, 0x9a];

/// How values are laid over the colour map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Evenly.
    Linear,
    /// By their logarithm, over four decades below the largest, or from the smallest where that is nearer.
    Decades,
}

/// Decades that are told apart: what is smaller is as good as nothing beside the largest.
const DECADES: i32 = 4;

/// A range of values laid over the colour map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Value of the darkest colour.
    pub min: f64,
    /// Value of the lightest colour.
    pub max: f64,
}

impl Range {
    /// A range that holds nothing yet.
    pub const EMPTY: Self = Self { min: f64::INFINITY, max: f64::NEG_INFINITY };

    /// Widens the range by the finite ones of `values`.
    pub fn include(&mut self, values: &[f64]) {
        for value in values.iter().filter(|value| value.is_finite()) {
            self.min = self.min.min(*value);
            self.max = self.max.max(*value);
        }
    }

    /// Widens the range so that `other` fits, and by a quarter beyond, so that a range that follows a run grows in few
    /// strides; returns whether it had to.
    pub fn grow(&mut self, other: Self) -> bool {
        if other.is_empty() || (other.min >= self.min && other.max <= self.max) {
            return false;
        }
        let (min, max) = (self.min.min(other.min), self.max.max(other.max));
        let margin = 0.25 * (max - min);
        let grown = Self {
            min: if other.min < self.min && !self.is_empty() { min - margin } else { min },
            max: if other.max > self.max && !self.is_empty() { max + margin } else { max },
        };
        *self = grown;
        true
    }

    /// Whether nothing was included.
    pub fn is_empty(&self) -> bool {
        self.min > self.max
    }

    /// Value at the dark end of the colours.
    pub fn low(&self, scale: Scale) -> f64 {
        match scale {
            Scale::Linear => self.min,
            Scale::Decades => self.min.max(self.max * math::powi(0.1, DECADES)),
        }
    }

    /// Place of a value in the range, from 0 to 1; 0 where all values are equal.
    pub fn fraction(&self, value: f64, scale: Scale) -> f64 {
        let low = self.low(scale);
        let (above, width) = match scale {
            Scale::Linear => (value - low, self.max - low),
            Scale::Decades if low > 0.0 => (math::ln((value / low).max(f64::MIN_POSITIVE)), math::ln(self.max / low)),
            Scale::Decades => (0.0, 0.0),
        };
        if width > 0.0 { (above / width).clamp(0.0, 1.0) } else { 0.0 }
    }

    /// Value at a place in the range: the other way round.
    pub fn value(&self, fraction: f64, scale: Scale) -> f64 {
        let low = self.low(scale);
        match scale {
            Scale::Decades if low > 0.0 => low * math::powf(self.max / low, fraction),
            _ => low + fraction * (self.max - low),
        }
    }

    /// Colour of a value; grey where it is no number.
    pub fn colour(&self, value: f64, scale: Scale) -> [u8; 3] {
        if value.is_nan() { NO_VALUE } else { colour(self.fraction(value, scale)) }
    }
}

/// Colour at `fraction` of the map, from 0 (dark) to 1 (light).
pub fn colour(fraction: f64) -> [u8; 3] {
    let place = (DARK + (1.0 - DARK) * fraction.clamp(0.0, 1.0)) * (INFERNO.len() - 1) as f64;
    let below = (place.floor() as usize).min(INFERNO.len() - 2);
    let share = place - below as f64;
    let [low, high] = [INFERNO[below], INFERNO[below + 1]];
    std::array::from_fn(|channel| {
        let [low, high] = [low, high].map(|colour| f64::from(colour[channel]));
        (low + share * (high - low)).round() as u8
    })
}

/// The map from dark to light as rows of RGB pixels.
pub fn bar(width: u32, height: u32) -> Vec<u8> {
    let row: Vec<u8> = (0..width).flat_map(|x| colour(f64::from(x) / f64::from(width.max(2) - 1))).collect();
    row.repeat(height as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Relative luminance (ITU-R BT.709 weights), enough to tell lighter from darker.
    fn lightness([red, green, blue]: [u8; 3]) -> f64 {
        0.2126 * f64::from(red) + 0.7152 * f64::from(green) + 0.0722 * f64::from(blue)
    }

    #[test]
    fn higher_values_are_always_lighter() {
        let steps: Vec<f64> = (0..=200).map(|i| lightness(colour(f64::from(i) / 200.0))).collect();
        assert!(steps.is_sorted());
        assert_eq!(colour(1.0), INFERNO[8]);
    }

    #[test]
    fn values_that_are_all_equal_or_no_numbers_have_a_colour() {
        let range = Range { min: 300.0, max: 300.0 };
        assert_eq!(range.colour(300.0, Scale::Linear), colour(0.0));
        assert_eq!(range.colour(f64::NAN, Scale::Linear), NO_VALUE);
        assert_eq!(Range { min: 0.0, max: 1.0 }.colour(f64::INFINITY, Scale::Linear), colour(1.0));
        let nothing = Range { min: 0.0, max: 0.0 };
        assert_eq!(nothing.colour(0.0, Scale::Decades), colour(0.0));
    }

    #[test]
    fn decades_are_laid_evenly_and_what_is_below_them_is_dark() {
        let range = Range { min: 0.0, max: 1e6 };
        for (value, fraction) in [(0.0, 0.0), (1.0, 0.0), (1e3, 0.25), (1e4, 0.5), (1e6, 1.0)] {
            assert!((range.fraction(value, Scale::Decades) - fraction).abs() < 1e-12, "{value}");
        }
        assert!((range.value(0.5, Scale::Decades) / 1e4 - 1.0).abs() < 1e-12);
        assert!((range.value(0.5, Scale::Linear) - 5e5).abs() < 1e-6);
    }

    #[test]
    fn a_range_that_follows_a_run_grows_in_few_strides() {
        let mut range = Range::EMPTY;
        let mut strides = 0;
        for kelvin in 300..3000 {
            let mut now = Range::EMPTY;
            now.include(&[300.0, f64::from(kelvin), f64::NAN]);
            strides += i32::from(range.grow(now));
        }
        assert!(range.min <= 300.0 && range.max >= 2999.0);
        // Each stride widens by a quarter: from 1 K to 2700 K in ln(2700)/ln(1.25) = 35.4 strides, and the first two.
        assert!(strides <= 38, "{strides} strides");
    }
}
