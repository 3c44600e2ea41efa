//! Keeps a run from making more than the disk takes.

use std::time::Duration;

use stagger_recordings::RecorderSender;

use crate::diagnostics;

/// Waiting for the disk is told once it adds up to this.
const TELL: Duration = Duration::from_secs(1);

/// Waits between iterations until the recording has caught up. Transport threads hand messages over without waiting; what
/// is held stays bounded, as the nodes are asked for nothing more meanwhile.
pub struct Backpressure {
    recording: RecorderSender,
    /// How long the run has waited.
    pub waited: Duration,
    told: bool,
    lost: bool,
}

impl Backpressure {
    /// For a recording under way.
    #[must_use]
    pub fn of(recording: RecorderSender) -> Self {
        Self { recording, waited: Duration::ZERO, told: false, lost: false }
    }

    /// Waits; returns false where the recording has ended, and the run is to end with it.
    pub fn wait(&mut self) -> bool {
        if self.lost {
            return false;
        }
        match self.recording.catch_up() {
            Ok(waited) => self.waited += waited,
            Err(error) => {
                self.lost = true;
                diagnostics::error(&format!("{error}: the run ends with this step"));
            }
        }
        if self.waited >= TELL && !self.told {
            self.told = true;
            diagnostics::warn(
                "the disk is slower than the run, which waits for it; `record` in the scene (level, every, fields) makes less",
            );
        }
        !self.lost
    }
}
