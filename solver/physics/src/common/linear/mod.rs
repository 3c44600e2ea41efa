//! Sparse symmetric systems, as networks of contacts make them.

pub(crate) mod conjugate_gradient;
mod csr;

pub(crate) use csr::Symmetric;
