//! What other programs wrote, made fit to be shown on a terminal: nothing of it moves the cursor or is of any length.

use std::io::{BufRead, ErrorKind};

/// Bytes of a line that are kept; the rest of a longer line is left out, and told.
const LONGEST_LINE_BYTES: usize = 4096;

/// The text with control characters as escapes (`\u{1b}`); line ends and tabs stay.
#[must_use]
pub fn shown(text: &str) -> String {
    let mut shown = String::with_capacity(text.len());
    for c in text.chars() {
        if c.is_control() && c != '\n' && c != '\t' {
            shown.extend(c.escape_default());
        } else {
            shown.push(c);
        }
    }
    shown
}

/// Gives `hear` each line of `input` until it ends, whatever its bytes are: those that are no UTF-8 as U+FFFD, control
/// characters as escapes, and of a line without an end its beginning. What is held is bounded.
pub fn each_line(mut input: impl BufRead, mut hear: impl FnMut(String)) {
    let (mut line, mut left_out) = (Vec::new(), 0_usize);
    loop {
        let read = match input.fill_buf() {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == ErrorKind::Interrupted => continue,
            // As good as its end.
            Err(_) => &[],
        };
        let end = read.iter().position(|byte| *byte == b'\n');
        let piece = &read[..end.unwrap_or(read.len())];
        let kept = piece.len().min(LONGEST_LINE_BYTES - line.len());
        line.extend_from_slice(&piece[..kept]);
        left_out += piece.len() - kept;
        let (used, over) = (piece.len() + usize::from(end.is_some()), read.is_empty());
        input.consume(used);
        if end.is_some() || (over && !line.is_empty()) {
            hear(told(&line, left_out));
            line.clear();
            left_out = 0;
        }
        if over {
            return;
        }
    }
}

fn told(line: &[u8], left_out: usize) -> String {
    let text = String::from_utf8_lossy(line);
    let text = shown(text.strip_suffix('\r').unwrap_or(&text));
    if left_out > 0 { format!("{text} … ({left_out} bytes more)") } else { text }
}

#[cfg(test)]
mod tests {
    use std::io::BufReader;

    use super::*;

    fn lines(bytes: &[u8]) -> Vec<String> {
        let mut lines = Vec::new();
        each_line(BufReader::with_capacity(7, bytes), |line| lines.push(line));
        lines
    }

    #[test]
    fn lines_of_any_bytes_and_any_length_are_heard() {
        assert_eq!(lines(b"W\xe4rme\r\n\nlast"), ["W\u{fffd}rme", "", "last"]);
        assert_eq!(lines(b"\x1b[2J\ta\x07b\n"), ["\\u{1b}[2J\ta\\u{7}b"]);
        assert_eq!(lines(b""), Vec::<String>::new());
        let long = [vec![b'x'; 100_000], b"\nafter\n".to_vec()].concat();
        let heard = lines(&long);
        assert_eq!((heard.len(), heard[1].as_str()), (2, "after"));
        assert!(heard[0].len() < 5000 && heard[0].ends_with("(95904 bytes more)"), "{}", &heard[0][4090..]);
    }
}
