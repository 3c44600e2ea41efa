//! stub
use super::Acceleration;
use serde::{Deserialize, Serialize};
/// x
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Accelerator {
    method: Acceleration,
}
/// x
pub struct Iterates<'a> {
    /// x
    pub frozen: &'a [f64],
    /// x
    pub answered: &'a [f64],
}
impl Accelerator {
    /// x
    pub fn new(method: Acceleration) -> Self {
        Self { method }
    }
    /// x
    pub fn next(&mut self, fields: &[Iterates<'_>]) -> Vec<Vec<f64>> {
        fields.iter().map(|f| f.answered.to_vec()).collect()
    }
    /// x
    pub fn accepted(&mut self, _fields: &[Iterates<'_>]) {}
    /// x
    pub fn rejected(&mut self) {}
}
