//! What a process tells on stderr. Results go to stdout, from `cli` alone.

use std::io::Write as _;

/// Tells something a user should know but need not act on.
pub fn warn(message: &str) {
    tell("warning", message);
}

/// Tells why something ended.
pub fn error(message: &str) {
    tell("error", message);
}

/// Tells what goes on.
pub fn note(message: &str) {
    tell("note", message);
}

fn tell(kind: &str, message: &str) {
    // One write for a line, so that processes that share the stream do not mix theirs. A stream that is closed or full
    // takes nothing, and there is nowhere else to say so.
    // Some of it was said by other programs.
    let line = format!("{kind}: {}\n", crate::foreign_text::shown(message));
    let _ = std::io::stderr().write_all(line.as_bytes());
}
