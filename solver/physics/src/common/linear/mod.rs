//! Symmetric systems: sparse ones, as networks of contacts make them, and operators that are not stored.

pub(crate) mod conjugate_gradient;
mod csr;
pub(crate) mod preconditioned;

pub(crate) use csr::Symmetric;
