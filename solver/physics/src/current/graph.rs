//! Laplace's equation on a graph.

use super::{
    NODE,
    jacobi::jacobi,
    settings::{Method, Solver},
};
use stagger_coupling::SolveError;

use crate::common::linear::{Symmetric, conjugate_gradient};

/// Times that the residual of a solution is formed anew, as the one a method carries along drifts by rounding.
const RESTARTS: u32 = 8;

/// Nodes with an unknown value x each, such that at every node i
///
///   Σ_j w_ij (x_j − x_i) + Σ_k w_ik (v_k − x_i) + s_i = 0
///
/// over its edges to other nodes j, its links to known values v_k, and its source s_i. Weights are positive.
pub(super) struct Graph {
    pub(super) nodes: usize,
    /// Two nodes and the weight.
    pub(super) edges: Vec<(u32, u32, f64)>,
    /// A node, the value it is linked to, and the weight.
    pub(super) links: Vec<(u32, f64, f64)>,
    /// A node and its source.
    pub(super) sources: Vec<(u32, f64)>,
}

/// The values, and what it took to find them.
pub(super) struct Solved {
    pub(super) values: Vec<f64>,
    pub(super) iterations: u32,
    /// ‖b − A x‖₂/‖b‖₂, at most the tolerance.
    pub(super) residual: f64,
    /// Nodes from which no known value can be reached, by number.
    pub(super) floats: Vec<bool>,
}

/// What is known of a connected part of the graph before anything is solved.
#[derive(Clone, Copy)]
struct Part {
    /// Least and greatest value it is linked to.
    low: f64,
    high: f64,
    driven: bool,
}

impl Part {
    fn floats(self) -> bool {
        self.low > self.high
    }

    /// Its value, where it is everywhere the same: that of its only links, 0 where it has none. What drives a part that
    /// nothing leads out of drives nothing.
    fn constant(self) -> Option<f64> {
        if self.floats() { Some(0.0) } else { (self.low == self.high && !self.driven).then_some(self.low) }
    }
}

impl Graph {
    pub(super) fn new(nodes: usize) -> Self {
        Self { nodes, edges: Vec::new(), links: Vec::new(), sources: Vec::new() }
    }

    /// Solves it; `start` are values to start from, where they are as many.
    ///
    /// Parts that have one value everywhere get it exactly, and only the others are solved: their matrix is positive
    /// definite. The result does not depend on the number of threads.
    pub(super) fn solve(&self, solver: &Solver, start: &[f64]) -> Result<Solved, SolveError> {
        let (roots, parts) = self.parts();
        let part = |node: usize| parts[roots[node] as usize];
        let mut values: Vec<f64> = (0..self.nodes).map(|node| part(node).constant().unwrap_or(0.0)).collect();
        let floats = (0..self.nodes).map(|node| part(node).floats()).collect();

        // Unknowns are numbered as the contacts name them: the motion lists those along a curve through space, so that
        // neighbours lie close in memory.
        let mut open: Vec<usize> = Vec::new();
        let mut index = vec![u32::MAX; self.nodes];
        let named = self.edges.iter().flat_map(|&(i, j, _)| [i, j]).chain(self.links.iter().map(|link| link.0));
        for node in named.map(|node| node as usize) {
            if index[node] == u32::MAX && part(node).constant().is_none() {
                index[node] = open.len() as u32;
                open.push(node);
            }
        }
        let index = |node: u32| index[node as usize];
        let is_open = |node: u32| index(node) != u32::MAX;

        // Values are taken from the least one known: large and nearly equal ones would cost digits.
        let base = open.iter().map(|&node| part(node).low).fold(f64::INFINITY, f64::min);
        let (mut diagonal, mut right) = (vec![0.0; open.len()], vec![0.0; open.len()]);
        let edges = self.edges.iter().filter(|(i, j, _)| is_open(*i) && i != j);
        for &(i, j, weight) in edges.clone() {
            diagonal[index(i) as usize] += weight;
            diagonal[index(j) as usize] += weight;
        }
        for &(node, value, weight) in self.links.iter().filter(|link| is_open(link.0)) {
            diagonal[index(node) as usize] += weight;
            right[index(node) as usize] += weight * (value - base);
        }
        for &(node, source) in self.sources.iter().filter(|source| is_open(source.0)) {
            right[index(node) as usize] += source;
        }
        let matrix = Symmetric::new(diagonal, edges.map(|&(i, j, weight)| (index(i), index(j), -weight)));
        let mut solution = vec![0.0; open.len()];
        if start.len() == self.nodes {
            solution.iter_mut().zip(&open).for_each(|(value, &node)| *value = start[node] - base);
        }
        let (iterations, residual) = solve(solver, &matrix, &right, &mut solution)?;
        solution.iter().zip(&open).for_each(|(value, &node)| values[node] = base + value);
        Ok(Solved { values, iterations, residual, floats })
    }

    /// The root of each node's part, and at each root what is known of it.
    fn parts(&self) -> (Vec<u32>, Vec<Part>) {
        let mut roots: Vec<u32> = (0..).take(self.nodes).collect();
        for &(i, j, _) in &self.edges {
            let (i, j) = (root(&mut roots, i), root(&mut roots, j));
            roots[i.max(j) as usize] = i.min(j);
        }
        for node in (0..).take(self.nodes) {
            roots[node as usize] = root(&mut roots, node);
        }
        let unknown = Part { low: f64::INFINITY, high: f64::NEG_INFINITY, driven: false };
        let mut parts = vec![unknown; self.nodes];
        for &(node, value, _) in &self.links {
            let part = &mut parts[roots[node as usize] as usize];
            (part.low, part.high) = (part.low.min(value), part.high.max(value));
        }
        for &(node, source) in &self.sources {
            parts[roots[node as usize] as usize].driven |= source != 0.0;
        }
        (roots, parts)
    }
}

/// The root of a node's tree, which is left shorter.
fn root(roots: &mut [u32], mut node: u32) -> u32 {
    while roots[node as usize] != node {
        let above = roots[node as usize];
        roots[node as usize] = roots[above as usize];
        node = above;
    }
    node
}

fn solve(solver: &Solver, matrix: &Symmetric, right: &[f64], solution: &mut [f64]) -> Result<(u32, f64), SolveError> {
    let &Solver { method, tolerance, iterations: limit } = solver;
    let mut iterations = 0;
    let mut residual = f64::INFINITY;
    for _ in 0..=RESTARTS {
        let outcome = match method {
            Method::ConjugateGradient => {
                conjugate_gradient::solve(matrix, right, solution, tolerance, limit - iterations)
            }
            Method::Jacobi => jacobi(matrix, right, solution, tolerance, limit - iterations),
        };
        iterations += outcome.iterations;
        residual = outcome.residual;
        // A start that needs no iteration has a residual that was formed from the values themselves.
        if outcome.converged(tolerance) && outcome.iterations == 0 {
            return Ok((iterations, residual));
        }
        if !outcome.converged(tolerance) {
            break;
        }
    }
    if !residual.is_finite() {
        return Err(SolveError::Unsolved(format!(
            "{NODE}: the equations of {} unknowns overflow (residual {residual}): a `potential`, a `current` or an \
             `electrical-conductivity` is too large or too small to compute with",
            right.len()
        )));
    }
    Err(SolveError::Unsolved(format!(
        "{NODE}: the equations of {} unknowns are solved to a residual of {residual:.1e} after {iterations} iterations, but \
         expected at most {tolerance:.1e} after {limit}: give [current] a larger `tolerance` or more `iterations`",
        right.len()
    )))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SOLVER: Solver = Solver { method: Method::ConjugateGradient, tolerance: 1e-13, iterations: 1000 };

    /// 0 – 1 – 2 in a row between two known values, 3 – 4 linked to one value, 5 – 6 to none.
    fn graph() -> Graph {
        Graph {
            nodes: 7,
            edges: vec![(0, 1, 1.0), (2, 1, 1.0), (3, 4, 2.0), (6, 5, 1.0)],
            links: vec![(0, 1000.0, 1.0), (2, 1004.0, 1.0), (4, 7.0, 3.0)],
            sources: Vec::new(),
        }
    }

    #[test]
    fn parts_with_one_value_have_it_exactly_and_those_without_any_are_zero() {
        let solved = graph().solve(&SOLVER, &[]).unwrap();
        assert_eq!(solved.values[3..], [7.0, 7.0, 0.0, 0.0]);
        assert_eq!(solved.floats, [false, false, false, false, false, true, true]);
        // Four equal steps of 1, to the tolerance times the condition of a row of three, 6.
        for (value, exact) in solved.values.iter().zip([1001.0, 1002.0, 1003.0]) {
            assert!((value - exact).abs() < 1e-12 * 1000.0, "{value}");
        }
        let again = graph().solve(&SOLVER, &solved.values).unwrap();
        assert_eq!(again.iterations, 0, "the solution is its own start");
    }

    #[test]
    fn a_source_flows_out_through_the_links_and_nowhere_else() {
        let sources = vec![(1, 6.0), (5, 9.0)];
        let solved = Graph { sources, links: vec![(0, 0.0, 2.0)], ..graph() }.solve(&SOLVER, &[]).unwrap();
        // 6 over the link of weight 2, then over the edge of weight 1; node 2 hangs on without a flow. Node 5 floats.
        for (value, exact) in solved.values.iter().zip([3.0, 9.0, 9.0, 0.0, 0.0, 0.0, 0.0]) {
            assert!((value - exact).abs() < 1e-11, "{:?}", solved.values);
        }
    }

    #[test]
    fn too_few_iterations_are_an_error_that_says_what_to_do() {
        for method in [Method::ConjugateGradient, Method::Jacobi] {
            let error = graph().solve(&Solver { method, iterations: 1, ..SOLVER }, &[]).err().unwrap().to_string();
            assert!(error.contains("3 unknowns") && error.contains("after 1 iterations"), "{error}");
        }
        let jacobi = graph().solve(&Solver { method: Method::Jacobi, ..SOLVER }, &[]).unwrap();
        assert!((jacobi.values[1] - 1002.0).abs() < 1e-9 && jacobi.iterations > 50);
    }
}
