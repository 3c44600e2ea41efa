//! The one way to standard output: it never panics, and remembers what went wrong until the command ends.

use std::{
    io::{self, ErrorKind, Write},
    sync::OnceLock,
    time::Duration,
};

/// Why nothing more is printed, once something could not be.
static FAILURE: OnceLock<io::Error> = OnceLock::new();
/// How long a reader is left alone that is not waited for by the system and takes nothing just now.
const RETRY: Duration = Duration::from_millis(5);

/// Prints a result and a line break. After a failure nothing is printed any more, and [`failure`] tells why.
pub(super) fn print(result: &str) {
    if FAILURE.get().is_none()
        && let Err(error) = put(&mut io::stdout().lock(), format!("{result}\n").as_bytes())
    {
        note_failure(error);
    }
}

/// Writes everything, and flushes: what waits in the buffer would be lost without a word where the process ends.
fn put(output: &mut impl Write, mut bytes: &[u8]) -> io::Result<()> {
    loop {
        let done = if bytes.is_empty() { output.flush().map(|()| 0) } else { output.write(bytes) };
        match done {
            Ok(0) if bytes.is_empty() => return Ok(()),
            Ok(0) => return Err(ErrorKind::WriteZero.into()),
            Ok(written) => bytes = bytes.get(written..).unwrap_or_default(),
            // A pipe that somebody else has made non-blocking.
            Err(error) if error.kind() == ErrorKind::WouldBlock => std::thread::sleep(RETRY),
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
}

/// Remembers what printing ended with, where somebody else printed.
pub(super) fn note_failure(error: io::Error) {
    // The first is told; later ones follow from it.
    let _ = FAILURE.set(error);
}

/// Why standard output could not be written. A reader that has gone has read what it wanted: that is no failure.
pub(super) fn failure() -> Option<String> {
    let error = FAILURE.get().filter(|error| error.kind() != ErrorKind::BrokenPipe)?;
    Some(format!("cannot write to standard output: {error}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Takes three bytes at a time, and every second time nothing.
    #[derive(Default)]
    struct Slow {
        taken: Vec<u8>,
        calls: usize,
    }

    impl Write for Slow {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.calls += 1;
            if self.calls.is_multiple_of(2) {
                return Err(ErrorKind::WouldBlock.into());
            }
            let length = bytes.len().min(3);
            self.taken.extend(&bytes[..length]);
            Ok(length)
        }

        fn flush(&mut self) -> io::Result<()> {
            self.calls += 1;
            if self.calls.is_multiple_of(2) { Err(ErrorKind::WouldBlock.into()) } else { Ok(()) }
        }
    }

    #[test]
    fn an_output_that_does_not_wait_gets_everything_and_a_full_one_is_an_error() {
        let mut slow = Slow::default();
        put(&mut slow, b"some longer text").unwrap();
        assert_eq!(slow.taken, b"some longer text");
        let mut full: &mut [u8] = &mut [0; 4];
        assert_eq!(put(&mut full, b"12345").unwrap_err().kind(), ErrorKind::WriteZero);
    }
}
