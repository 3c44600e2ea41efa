//! A scalar that decays on a grid, dw/dt = −k w: the physics that `tests/new_physics/run.py` adds to see what an addition takes.

pub mod keys;

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use stagger_coupling::{Frozen, Physics, Reply, SolveError, Window, math};
use stagger_messages::{Energy, Field, Fields, Geometry, Grid, Measure, Port, Ports};

use crate::common::checks::positive;

const NODE: &str = "decay";

/// Everything the decay depends on. SI units.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Settings {
    /// Rate k, in 1/s.
    pub rate_1_s: f64,
    /// Cells along each axis.
    pub cells: [u32; 3],
    /// Side of a cell, in m.
    pub spacing_m: f64,
}

impl crate::Settings for Settings {
    type Physics = Decay;

    fn ports(&self) -> Ports {
        let concentration = Port::f64("concentration", "1", "cells", 1, Measure::Magnitude);
        let mean = Port::f64("mean_concentration", "1", "whole", 1, Measure::None);
        let grid = Grid::of_cells([0.0; 3], [self.spacing_m; 3], self.cells);
        let ports = Ports::new(Vec::new(), vec![concentration, mean]);
        ports.with(Geometry::grid("cells", grid)).with(Geometry::global("whole"))
    }

    fn build(self) -> Result<Decay, SolveError> {
        positive(NODE, "rate", self.rate_1_s)?;
        let [concentration, mean] = crate::Settings::ports(&self).writes.try_into().unwrap_or_default();
        Ok(Decay { settings: self, concentration: Arc::new(concentration), mean: Arc::new(mean) })
    }
}

/// The exact solution of each window, w e^{−k Δt}.
pub struct Decay {
    settings: Settings,
    concentration: Arc<Port>,
    mean: Arc<Port>,
}

/// The concentration of each cell, x running fastest.
#[derive(Clone, Serialize, Deserialize)]
pub struct State(Vec<f64>);

impl Decay {
    fn reply(&self, state: &State) -> Result<Reply, SolveError> {
        let sum: f64 = state.0.iter().sum();
        let fields = [
            Field::new(&self.concentration, 0, state.0.clone())?,
            Field::new(&self.mean, 0, vec![sum / state.0.len().max(1) as f64])?,
        ];
        let fields: Fields = fields.into_iter().map(|field| (field.name().to_owned(), field)).collect();
        Ok(Reply { fields, ledger: vec![Energy::stored("content", sum)], ..Reply::default() })
    }
}

impl Physics for Decay {
    type State = State;

    fn ports(&self) -> Ports {
        crate::Settings::ports(&self.settings)
    }

    fn initial(&self) -> Result<(State, Reply), SolveError> {
        let [nx, ny, nz] = self.settings.cells;
        let state = State((0..nx * ny * nz).map(|cell| 1.0 + f64::from(cell)).collect());
        let reply = self.reply(&state)?;
        Ok((state, reply))
    }

    fn solve(&self, state: &State, _: &Frozen, window: Window) -> Result<(State, Reply), SolveError> {
        let share = math::exp(-self.settings.rate_1_s * window.dt_s);
        let next = State(state.0.iter().map(|value| value * share).collect());
        let mut reply = self.reply(&next)?;
        let gone: f64 = state.0.iter().map(|value| value * (1.0 - share)).sum();
        reply.ledger.push(Energy::lost("decayed", gone));
        Ok((next, reply))
    }
}
