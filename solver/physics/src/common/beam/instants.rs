//! What a beam does at a window's start and end, of which the window's mean is made.

use stagger_coupling::{Frozen, SolveError, Window};
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use stagger_messages::Fields;

/// What a beam of unit strength does to the particles at one instant.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct AtInstant<T> {
    /// Revision of the particles it belongs to.
    revision: u64,
    pub(crate) values: Arc<T>,
}

/// What `at` finds at the start and at the end of `window`.
///
/// `kept` is what it found at the last window's end: a window then costs one evaluation. Where particles came or went at
/// the window's start, its geometry is that of others, and the end stands for both.
pub(crate) fn ends<T: Clone>(
    kept: Option<AtInstant<T>>,
    frozen: &Frozen,
    window: Window,
    at: impl Fn(&Fields, f64) -> Result<T, SolveError>,
) -> Result<[AtInstant<T>; 2], SolveError> {
    // Where there are no particles at all, there is nothing that could come or go.
    let particles = |fields: &Fields| fields.get("radii").map(|radii| radii.support.clone());
    let now = particles(&frozen.end);
    let revision = now.as_ref().map_or(0, |support| support.revision);
    let evaluate = |fields, t_s| {
        let values = Arc::new(at(fields, t_s)?);
        Ok::<_, SolveError>(AtInstant { revision, values })
    };
    let end = evaluate(&frozen.end, window.t_s + window.dt_s)?;
    let start = match kept.filter(|kept| kept.revision == revision) {
        Some(kept) => kept,
        None if particles(&frozen.start) == now => evaluate(&frozen.start, window.t_s)?,
        None => end.clone(),
    };
    Ok([start, end])
}
