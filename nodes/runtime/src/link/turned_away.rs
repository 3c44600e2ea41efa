//! Whom the process that listens turned away: Zenoh tells it to its log alone.

use std::{
    fmt::Debug,
    sync::{Mutex, PoisonError},
    time::{Duration, Instant},
};

use tracing::{
    Event, Level, Metadata, Subscriber,
    field::{Field, Visit},
    level_filters::LevelFilter,
    span::{Attributes, Id, Record},
};

use crate::{diagnostics, link::words::without_places};

/// What the log says of a connection with certificates that did not come about, at the beginning.
const FAILED: &str = "QUIC acceptor failed: ";
/// A process that is turned away tries again every second: the same reason is told once in this time.
const REPEAT: Duration = Duration::from_secs(30);
/// What it adds.
const HINT: &str = " Hint: increase the system open file limit.";

/// Tells, from now on, of each connection that is turned away because of its certificate.
pub fn tell() {
    // Another log of this process, where there is one, tells it too.
    let _ = tracing::subscriber::set_global_default(TurnedAway::default());
}

/// Listens to what Zenoh's links warn of.
#[derive(Default)]
struct TurnedAway {
    /// The reason told last, and when.
    told: Mutex<Option<(String, Instant)>>,
}

impl Subscriber for TurnedAway {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        metadata.is_event() && *metadata.level() <= Level::WARN && metadata.target().starts_with("zenoh_link")
    }

    fn max_level_hint(&self) -> Option<LevelFilter> {
        Some(LevelFilter::WARN)
    }

    fn new_span(&self, _: &Attributes<'_>) -> Id {
        Id::from_u64(1)
    }

    fn record(&self, _: &Id, _: &Record<'_>) {}

    fn record_follows_from(&self, _: &Id, _: &Id) {}

    fn event(&self, event: &Event<'_>) {
        let mut message = Message(String::new());
        event.record(&mut message);
        let Some(why) = why(&message.0) else { return };
        let mut told = self.told.lock().unwrap_or_else(PoisonError::into_inner);
        if told.as_ref().is_none_or(|(last, at)| *last != why || at.elapsed() >= REPEAT) {
            diagnostics::warn(&format!("a connection was turned away: {why}"));
            *told = Some((why, Instant::now()));
        }
    }

    fn enter(&self, _: &Id) {}

    fn exit(&self, _: &Id) {}
}

struct Message(String);

impl Visit for Message {
    fn record_debug(&mut self, field: &Field, value: &dyn Debug) {
        if field.name() == "message" {
            self.0 = format!("{value:?}");
        }
    }
}

/// Why a connection was turned away, where the log says that one was.
fn why(message: &str) -> Option<String> {
    let said = without_places(message.strip_suffix(HINT).unwrap_or(message));
    let said = said.strip_prefix(FAILED)?.to_owned();
    // `… reason: "invalid peer certificate: Expired" …` within the rest.
    let reason = said.split_once("reason: \"").and_then(|(_, rest)| rest.split_once('"')).map(|(reason, _)| reason);
    Some(reason.filter(|reason| !reason.is_empty()).map_or(said.clone(), str::to_owned))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reason_is_found_in_what_zenoh_logs() {
        let logged = "QUIC acceptor failed: TransportError(Error { code: Code::crypto(2e), frame: None, reason: \"invalid peer \
                      certificate: UnknownIssuer\" }) at /x/quic/unicast.rs:686. Hint: increase the system open file limit.";
        assert_eq!(why(logged).unwrap(), "invalid peer certificate: UnknownIssuer");
        assert_eq!(why("QUIC acceptor failed: TimedOut at /x/unicast.rs:686.").unwrap(), "TimedOut");
        assert_eq!(why("something else"), None);
    }
}
