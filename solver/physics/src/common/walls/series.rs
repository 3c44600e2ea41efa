//! Values at given times, linear between them.

use serde::Serialize;
use stagger_coupling::SolveError;
use stagger_messages::Shown;

use super::finite;
use crate::common::checks;

/// Values at given times: linear between them, held before the first and after the last.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Series<T> {
    /// Times in s, rising; as many as values, and at least one.
    pub times_s: Vec<f64>,
    /// The values.
    pub values: Vec<T>,
}

/// Where an instant lies in a series.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece<T> {
    pub from: T,
    pub to: T,
    /// Share of the way from `from` to `to`.
    pub share: f64,
    /// How long the way takes, in s; infinite where the value is held.
    pub duration_s: f64,
}

impl<T: Copy> Series<T> {
    /// A value held for ever.
    #[must_use]
    pub fn constant(value: T) -> Self {
        Self { times_s: vec![0.0], values: vec![value] }
    }

    /// The piece an instant lies in; at a time of the series the one that begins there.
    ///
    /// A series that [`Self::check`] refuses may panic.
    pub(super) fn piece(&self, t_s: f64) -> Piece<T> {
        let next = self.times_s.partition_point(|&time_s| time_s <= t_s);
        if next == 0 || next == self.times_s.len() {
            let held = self.values[next.saturating_sub(1)];
            return Piece { from: held, to: held, share: 0.0, duration_s: f64::INFINITY };
        }
        let [from_s, to_s] = [self.times_s[next - 1], self.times_s[next]];
        let duration_s = to_s - from_s;
        Piece { from: self.values[next - 1], to: self.values[next], share: (t_s - from_s) / duration_s, duration_s }
    }

    /// Checks that the times rise and have a value each; `what` says what they are the times of.
    pub(super) fn check(&self, wall: &str, what: &str) -> Result<(), SolveError> {
        finite(wall, &format!("a time of its {what}"), &self.times_s)?;
        let (times, values) = (self.times_s.len(), self.values.len());
        let number = format!("the number of times of its {what}");
        let fits = times == values && times > 0;
        checks::setting(wall, &number, times as f64, fits, &format!("that of its values, {values}, and not 0"))?;
        let falls = self.times_s.windows(2).find(|pair| pair[0] >= pair[1]);
        falls.map_or(Ok(()), |pair| {
            let expected = format!("later than the one before it, {} s", Shown(pair[0]));
            checks::setting(wall, &format!("a time of its {what}"), pair[1], false, &expected)
        })
    }
}

impl Series<f64> {
    /// The value at an instant.
    pub(super) fn at(&self, t_s: f64) -> f64 {
        let Piece { from, to, share, .. } = self.piece(t_s);
        from + (to - from) * share
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_linear_between_times_and_held_beyond() {
        let series = Series { times_s: vec![1.0, 2.0, 4.0], values: vec![10.0, 20.0, 0.0] };
        for (t_s, value) in [(0.0, 10.0), (1.0, 10.0), (1.5, 15.0), (2.0, 20.0), (3.0, 10.0), (4.0, 0.0), (9.0, 0.0)] {
            assert!((series.at(t_s) - value).abs() < 1e-15, "{t_s}");
        }
        assert!((Series::constant(7.0).at(-3.0) - 7.0).abs() < 1e-15);
        // The slope at a corner is that of what follows.
        assert!((series.piece(2.0).duration_s - 2.0).abs() < 1e-15 && series.piece(4.0).duration_s.is_infinite());
    }

    #[test]
    fn times_that_do_not_rise_and_missing_values_are_named() {
        let wrong = |times_s: &[f64], values: &[f64]| {
            let series = Series { times_s: times_s.into(), values: values.into() };
            series.check("wall `lid`", "force").unwrap_err().to_string()
        };
        assert_eq!(
            wrong(&[0.0, 2.0, 1.0], &[0.0; 3]),
            "wall `lid`: a time of its force is 1, but must be later than the one before it, 2 s"
        );
        assert_eq!(
            wrong(&[0.0, 1.0], &[0.0]),
            "wall `lid`: the number of times of its force is 2, but must be that of its values, 1, and not 0"
        );
        assert!(wrong(&[], &[]).contains("and not 0"));
        assert_eq!(wrong(&[f64::NAN], &[0.0]), "wall `lid`: a time of its force is NaN, but must be finite");
    }
}
