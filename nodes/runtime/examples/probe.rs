//! A node that only looks on: how high the powder lies, and how hot it has ever been.
//!
//! It is all that a node needs: the fields it reads and writes, its values at t = 0, and one function.

use std::{collections::BTreeMap, error::Error, process::ExitCode, sync::Arc};

use serde::{Deserialize, Serialize};
use stagger_coupling::{Frozen, Physics, Reply, SolveError, Window};
use stagger_messages::{Field, Fields, Geometry, Measure, Port, Ports};
use stagger_runtime::node::plug_in::{self, Setup};

/// Takes part in the run it was started for, until that ends.
pub fn main() -> ExitCode {
    plug_in::main(Probe::new)
}

/// The ports, made once. Settings of a physics would stand here too.
struct Probe {
    positions: Port,
    radii: Port,
    temperature: Option<Port>,
    mean_height: Arc<Port>,
    peak_temperature: Arc<Port>,
}

/// What the next window depends on, beside the frozen fields: the hottest so far, in K; 0 before anything was read.
#[derive(Clone, Serialize, Deserialize)]
struct State {
    peak_k: f64,
}

impl Probe {
    fn new(setup: &Setup) -> Result<Self, Box<dyn Error>> {
        // The scene says which physics run; one that is not there writes nothing to read. `setup.arguments` holds
        // what follows the command's name.
        let scene = setup.scene()?;
        // A field has a name, a unit, the support its rows stand on, and a number of values in each row. The measure
        // says how the iteration judges its convergence: nothing depends on these two, so they are not judged.
        let scalar = |name, unit, support| Port::f64(name, unit, support, 1, Measure::None);
        Ok(Self {
            positions: Port::f64("positions", "m", "particles", 3, Measure::None),
            radii: scalar("radii", "m", "particles"),
            temperature: scene.physics.contains_key("thermal").then(|| scalar("temperature", "K", "particles")),
            mean_height: Arc::new(scalar("mean_height", "m", "probe")),
            peak_temperature: Arc::new(scalar("peak_temperature", "K", "probe")),
        })
    }

    /// Both fields: one row each, with one value.
    fn fields(&self, mean_height_m: f64, peak_k: f64) -> Result<Fields, SolveError> {
        let mean_height = Field::new(&self.mean_height, 0, vec![mean_height_m])?;
        let peak_temperature = Field::new(&self.peak_temperature, 0, vec![peak_k])?;
        Ok([mean_height, peak_temperature].map(|field| (field.name().to_owned(), field)).into())
    }
}

impl Physics for Probe {
    type State = State;

    fn ports(&self) -> Ports {
        let reads = [&self.positions, &self.radii].into_iter().chain(&self.temperature);
        // Both numbers are of the whole: the support `probe` has no place in space.
        let writes = vec![(*self.mean_height).clone(), (*self.peak_temperature).clone()];
        Ports::new(reads.cloned().collect(), writes).with(Geometry::global("probe"))
    }

    /// At t = 0 nothing has been read yet: both are 0 until the first window.
    fn initial(&self) -> Result<(State, Reply), SolveError> {
        let reply = Reply { fields: self.fields(0.0, 0.0)?, ..Reply::default() };
        Ok((State { peak_k: 0.0 }, reply))
    }

    /// A trial: the same inputs give the same bits, and `state` is only read. The new state counts from the next
    /// window on if the coordinator accepts this one, and is dropped if it does not.
    fn solve(&self, state: &State, frozen: &Frozen, _window: Window) -> Result<(State, Reply), SolveError> {
        // `at_end` is the newest iterate at the window's end, `at_start` the value the window began with.
        let positions_m = frozen.at_end("positions")?.f64()?;
        let radii_m = frozen.at_end("radii")?.f64()?;
        let temperature_k = match &self.temperature {
            Some(port) => frozen.at_end(&port.field)?.f64()?,
            None => &[],
        };

        // The mean weighed by volume; the sums run in the order of the rows, so that they are the same bits each time.
        let (mut moment, mut volume) = (0.0, 0.0);
        for (position_m, radius_m) in positions_m.as_chunks::<3>().0.iter().zip(radii_m) {
            moment += position_m[2] * radius_m.powi(3);
            volume += radius_m.powi(3);
        }
        let mean_height_m = if volume == 0.0 { 0.0 } else { moment / volume };
        // `f64::max` would let a value that is no number pass unseen; this way it reaches the reply, which refuses it.
        let hotter = |peak: f64, now: f64| if now.is_nan() || now > peak { now } else { peak };
        let peak_k = temperature_k.iter().fold(state.peak_k, |peak, now| hotter(peak, *now));

        // What a user should see at the end of a run, by name and unit; energy would go into the `ledger`.
        let figures = BTreeMap::from([("mean height [m]".to_owned(), mean_height_m)]);
        let reply = Reply { fields: self.fields(mean_height_m, peak_k)?, figures, ..Reply::default() };
        Ok((State { peak_k }, reply))
    }
}
