//! What a process tells on stderr. Results go to stdout, from `cli` alone.

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

#[expect(clippy::print_stderr, reason = "the one place diagnostics are printed")]
fn tell(kind: &str, message: &str) {
    // Some of it was said by other programs.
    eprintln!("{kind}: {}", crate::foreign_text::shown(message));
}
