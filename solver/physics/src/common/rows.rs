//! Particles that come and go: which row of one instant is which of another.

use stagger_coupling::SolveError;

/// For each particle of `ids_now` its row among `ids_then`; `None` where it was not there yet.
///
/// O(N) where both lists rise, as ids do that are given in the order of coming; O(N log N) else.
///
/// # Errors
/// A list names a particle twice.
pub(crate) fn rows_then(ids_then: &[u32], ids_now: &[u32]) -> Result<Vec<Option<u32>>, SolveError> {
    let (then, now) = (by_id(ids_then)?, by_id(ids_now)?);
    let mut then = then.into_iter().peekable();
    let mut rows = vec![None; ids_now.len()];
    for row in now {
        let id = ids_now[row as usize];
        while then.next_if(|&row| ids_then[row as usize] < id).is_some() {}
        rows[row as usize] = then.next_if(|&row| ids_then[row as usize] == id);
    }
    Ok(rows)
}

/// Values of `ids_then`, one each, in the rows of `ids_now`; `default` for particles that were not there yet.
///
/// # Errors
/// A list names a particle twice, or there is not one value for each particle.
pub(crate) fn by_ids(values: &[f64], ids_then: &[u32], ids_now: &[u32], default: f64) -> Result<Vec<f64>, SolveError> {
    if values.len() != ids_then.len() {
        let (values, particles) = (values.len(), ids_then.len());
        return Err(SolveError::Mismatch(format!("{values} values cannot belong to {particles} particles, one each")));
    }
    let rows = rows_then(ids_then, ids_now)?;
    Ok(rows.into_iter().map(|row| row.map_or(default, |row| values[row as usize])).collect())
}

/// The rows in the order of their ids.
fn by_id(ids: &[u32]) -> Result<Vec<u32>, SolveError> {
    let mut rows: Vec<u32> = (0..).take(ids.len()).collect();
    // Stable, so that a list that rises already costs one pass.
    rows.sort_by_key(|&row| ids[row as usize]);
    match rows.windows(2).find(|pair| ids[pair[0] as usize] == ids[pair[1] as usize]) {
        None => Ok(rows),
        Some(pair) => Err(SolveError::Mismatch(format!(
            "field `ids` names particle {} in rows {} and {}, but a particle has one row",
            ids[pair[0] as usize], pair[0], pair[1]
        ))),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn values_follow_their_particles_and_new_ones_get_the_default() {
        let values = by_ids(&[1.0, 2.0, 3.0, 4.0], &[0, 1, 2, 3], &[0, 2, 3, 7, 9], 5.0).unwrap();
        assert_eq!(values, [1.0, 3.0, 4.0, 5.0, 5.0]);
        assert_eq!(by_ids(&[1.0, 2.0], &[8, 4], &[4, 6, 8], 0.0).unwrap(), [2.0, 0.0, 1.0]);
        assert!(by_ids(&[], &[], &[], 0.0).unwrap().is_empty());
        assert_eq!(by_ids(&[1.0], &[3], &[], 0.0).unwrap(), [0.0; 0]);
        assert_eq!(by_ids(&[], &[], &[3], 7.0).unwrap(), [7.0]);
    }

    #[test]
    fn a_particle_in_two_rows_and_a_value_too_few_are_refused() {
        let twice = by_ids(&[1.0, 2.0, 3.0], &[5, 4, 5], &[4], 0.0).unwrap_err().to_string();
        assert!(twice.contains("particle 5 in rows 0 and 2"), "{twice}");
        assert!(by_ids(&[0.0], &[1, 2], &[1], 0.0).unwrap_err().to_string().contains("1 values"));
    }

    proptest! {
        #[test]
        fn any_two_lists_match_as_a_search_matches_them(
            then in prop::collection::hash_set(0u32..50, 0..30),
            now in prop::collection::hash_set(0u32..50, 0..30),
        ) {
            // In the order of the sets, which is none.
            let (then, now): (Vec<u32>, Vec<u32>) = (then.into_iter().collect(), now.into_iter().collect());
            let rows = rows_then(&then, &now).unwrap();
            for (id, row) in now.iter().zip(rows) {
                prop_assert_eq!(row.map(|row| row as usize), then.iter().position(|other| other == id));
            }
        }
    }
}
