//! Which settings are worth having: the Pareto front, and the cheapest within an error.

/// Cost and error of a case.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rated {
    /// What it costs: wall time in s.
    pub cost: f64,
    /// Its largest error.
    pub error: f64,
}

/// Indices of the cases that no other beats: none is both cheaper and at least as exact, or as cheap and more exact. In the order
/// of cost. Errors up to `floor` count as equal: they are within what is known of the reference.
#[must_use]
pub fn front(cases: &[Rated], floor: f64) -> Vec<usize> {
    let error = |index: usize| cases[index].error.max(floor);
    let mut order: Vec<usize> =
        (0..cases.len()).filter(|&index| cases[index].cost.is_finite() && cases[index].error.is_finite()).collect();
    order.sort_by(|&left, &right| {
        cases[left].cost.total_cmp(&cases[right].cost).then(error(left).total_cmp(&error(right)))
    });
    let mut best = f64::INFINITY;
    order.retain(|&index| {
        let better = error(index) < best;
        best = best.min(error(index));
        better
    });
    order
}

/// Index of the cheapest case with an error of at most `bound`.
#[must_use]
pub fn cheapest(cases: &[Rated], bound: f64) -> Option<usize> {
    let within = (0..cases.len()).filter(|&index| cases[index].error <= bound && cases[index].cost.is_finite());
    within.min_by(|&left, &right| cases[left].cost.total_cmp(&cases[right].cost))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_front_holds_what_nothing_beats() {
        let cases = [(4.0, 1e-3), (1.0, 0.1), (2.0, 0.2), (2.0, 0.01), (3.0, 0.01), (0.5, f64::INFINITY), (9.0, 1e-4)];
        let cases = cases.map(|(cost, error)| Rated { cost, error });
        assert_eq!(front(&cases, 0.0), [1, 3, 0, 6]);
        // What is below what is known of the reference is no gain.
        assert_eq!(front(&cases, 1e-3), [1, 3, 0]);
        assert_eq!(cheapest(&cases, 0.05), Some(3));
        assert_eq!(cheapest(&cases, 1e-5), None);
    }
}
