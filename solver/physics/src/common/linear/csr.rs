//! A symmetric matrix in compressed rows, and its product with a vector.

use rayon::prelude::*;

/// Rows that one thread takes at a time, and entries that one partial sum adds up: fixed, so that no sum depends on the
/// number of threads.
pub(super) const CHUNK: usize = 4096;

/// A symmetric matrix: its diagonal, and what is off it in compressed rows (CSR).
///
/// The diagonal is apart because it is what changes from one solve of a network to the next.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Symmetric {
    /// The diagonal.
    pub(crate) diagonal: Vec<f64>,
    /// First entry of each row, and one past the last.
    starts: Vec<usize>,
    columns: Vec<u32>,
    values: Vec<f64>,
}

impl Symmetric {
    /// The matrix with `diagonal` and, for each coupling (i, j, a) with i ≠ j, a added at (i, j) and at (j, i).
    ///
    /// Entries of a row stand in the order of the couplings, and its sums are taken in that order. The indices are below
    /// the number of rows.
    pub(crate) fn new<I>(diagonal: Vec<f64>, couplings: I) -> Self
    where
        I: Iterator<Item = (u32, u32, f64)> + Clone,
    {
        let mut starts = vec![0; diagonal.len() + 1];
        for (i, j, _) in couplings.clone() {
            starts[i as usize + 1] += 1;
            starts[j as usize + 1] += 1;
        }
        for row in 0..diagonal.len() {
            starts[row + 1] += starts[row];
        }
        let entries = starts[diagonal.len()];
        let (mut columns, mut values) = (vec![0; entries], vec![0.0; entries]);
        let mut next = starts.clone();
        for (i, j, value) in couplings {
            for (row, column) in [(i as usize, j), (j as usize, i)] {
                (columns[next[row]], values[next[row]]) = (column, value);
                next[row] += 1;
            }
        }
        Self { diagonal, starts, columns, values }
    }

    /// Number of rows.
    pub(crate) fn rows(&self) -> usize {
        self.diagonal.len()
    }

    /// `product` becomes A `vector`.
    pub(crate) fn multiply(&self, vector: &[f64], product: &mut [f64]) {
        self.multiply_dot(vector, product);
    }

    /// `product` becomes A `vector`; returns `vector`·A `vector`, from the sums of fixed chunks in their order.
    pub(crate) fn multiply_dot(&self, vector: &[f64], product: &mut [f64]) -> f64 {
        let chunk = |(chunk, product): (usize, &mut [f64])| {
            let mut sum = 0.0;
            for (row, product) in (chunk * CHUNK..).zip(product) {
                let entries = self.starts[row]..self.starts[row + 1];
                let row_entries = self.columns[entries.clone()].iter().zip(&self.values[entries]);
                let off = row_entries.fold(0.0, |sum, (&column, value)| sum + value * vector[column as usize]);
                *product = self.diagonal[row] * vector[row] + off;
                sum += vector[row] * *product;
            }
            sum
        };
        let partials: Vec<f64> = product.par_chunks_mut(CHUNK).enumerate().map(chunk).collect();
        partials.into_iter().sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn couplings_stand_on_both_sides_of_the_diagonal_and_add_up() {
        let couplings = [(0, 2, 5.0), (1, 0, -1.0), (2, 0, 0.5)];
        let matrix = Symmetric::new(vec![1.0, 2.0, 3.0, 4.0], couplings.into_iter());
        assert_eq!(matrix.rows(), 4);
        let mut product = vec![f64::NAN; 4];
        matrix.multiply(&[1.0, 10.0, 100.0, 1000.0], &mut product);
        // [1 −1 5.5 0; −1 2 0 0; 5.5 0 3 0; 0 0 0 4] times the vector: exact.
        assert_eq!(product, [541.0, 19.0, 305.5, 4000.0]);
    }
}
