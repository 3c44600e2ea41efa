//! Steps through a legacy file: words, lines, numbers in text or in bytes.

use super::{super::MOST_VALUES, Faults, Number, quoted};

/// Whether what follows the first two lines, wherever these end, says that the file is text.
pub(crate) fn is_text(contents: &[u8]) -> bool {
    let mut rest = contents;
    for _ in 0..2 {
        let Some(end) = rest.iter().position(|byte| [b'\n', b'\r'].contains(byte)) else { return false };
        rest = &rest[end + if rest[end..].starts_with(b"\r\n") { 2 } else { 1 }..];
    }
    rest.trim_ascii_start().get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"ASCII"))
}

/// The same lines, each with the end that Unix gives them.
pub(crate) fn with_unix_line_ends(contents: &[u8]) -> Vec<u8> {
    let mut unix = Vec::with_capacity(contents.len());
    for (at, byte) in contents.iter().enumerate() {
        match byte {
            b'\r' if contents.get(at + 1) == Some(&b'\n') => {}
            b'\r' => unix.push(b'\n'),
            byte => unix.push(*byte),
        }
    }
    unix
}

/// What an array is made of.
#[derive(Clone, Copy)]
pub(crate) enum Kind {
    Number(Number),
    /// One bit each, in binary eight to a byte.
    Bit,
    /// A text each.
    Text,
    /// A number that says a type, and a text each, in text and in binary files alike.
    Variant,
}

impl Kind {
    pub fn of(name: &str) -> Option<Self> {
        match name.to_ascii_lowercase().as_str() {
            "bit" => Some(Self::Bit),
            "string" | "utf8_string" => Some(Self::Text),
            "variant" => Some(Self::Variant),
            other => Number::legacy(other).map(Self::Number),
        }
    }
}

pub(crate) struct Cursor<'c> {
    rest: &'c [u8],
    line: usize,
    /// Whether the rest begins a line.
    line_begins: bool,
    pub binary: bool,
}

impl<'c> Cursor<'c> {
    pub fn new(contents: &'c [u8]) -> Self {
        Self { rest: contents, line: 1, line_begins: true, binary: false }
    }

    pub fn wrong(&self, message: &str) -> Faults {
        Faults::one(Some(self.line), message)
    }

    /// As [`Self::wrong`], for the line that has just been taken.
    pub fn wrong_before(&self, message: &str) -> Faults {
        Faults::one(Some(self.line - usize::from(self.line_begins && self.line > 1)), message)
    }

    fn advance(&mut self, count: usize) {
        let (taken, rest) = self.rest.split_at(count.min(self.rest.len()));
        self.line += taken.iter().filter(|byte| **byte == b'\n').count();
        self.line_begins = taken.last().map_or(self.line_begins, |byte| *byte == b'\n');
        self.rest = rest;
    }

    /// What is left of the line, without its end.
    pub fn take_line(&mut self) -> String {
        let length = self.rest.iter().position(|byte| *byte == b'\n').unwrap_or(self.rest.len());
        let line = String::from_utf8_lossy(&self.rest[..length]).into_owned();
        self.advance(length + 1);
        line
    }

    fn skip_blanks(&mut self) {
        let start = self.rest.iter().position(|byte| !byte.is_ascii_whitespace()).unwrap_or(self.rest.len());
        self.advance(start);
    }

    fn word_bytes(&mut self) -> &'c [u8] {
        self.skip_blanks();
        let length = self.rest.iter().position(u8::is_ascii_whitespace).unwrap_or(self.rest.len());
        let word = &self.rest[..length];
        self.advance(length);
        word
    }

    /// The next word, on this line or a later one; empty at the end.
    pub fn word(&mut self) -> String {
        String::from_utf8_lossy(self.word_bytes()).into_owned()
    }

    /// The next word in upper case.
    pub fn keyword(&mut self) -> String {
        self.word().to_ascii_uppercase()
    }

    /// The next word as the name of an array, in which VTK writes what is no letter as `%20`.
    pub fn name(&mut self) -> String {
        let word = self.word_bytes();
        let mut name = Vec::with_capacity(word.len());
        let mut at = 0;
        while let Some(&byte) = word.get(at) {
            let code =
                word.get(at + 1..at + 3).filter(|_| byte == b'%').and_then(|code| std::str::from_utf8(code).ok());
            let code = code.filter(|code| code.bytes().all(|byte| byte.is_ascii_hexdigit()));
            match code.and_then(|code| u8::from_str_radix(code, 16).ok()) {
                Some(decoded) => {
                    name.push(decoded);
                    at += 3;
                }
                None => {
                    name.push(byte);
                    at += 1;
                }
            }
        }
        String::from_utf8_lossy(&name).into_owned()
    }

    /// Whether the next word is a keyword; it is not taken.
    pub fn next_is(&self, keyword: &str) -> bool {
        let rest = self.rest.trim_ascii_start();
        let (word, after) = rest.split_at(keyword.len().min(rest.len()));
        word.eq_ignore_ascii_case(keyword.as_bytes()) && after.first().is_none_or(u8::is_ascii_whitespace)
    }

    /// Steps over what stands behind METADATA, to a blank line.
    pub fn skip_metadata(&mut self, components: usize) {
        self.take_line();
        loop {
            let line = self.take_line();
            match line.trim() {
                "" => return,
                // Names that may be blank.
                names if names.eq_ignore_ascii_case("COMPONENT_NAMES") => {
                    for _ in 0..components.min(self.rest.len()) {
                        self.take_line();
                    }
                }
                _ => {}
            }
        }
    }

    pub fn count(&mut self) -> Result<usize, Faults> {
        let word = self.word();
        word.parse().map_err(|_| self.wrong(&format!("expected a whole number, found {}", quoted(&word))))
    }

    /// The next numbers: words, or big-endian bytes on the line that follows.
    pub fn numbers(&mut self, count: usize, number: Number) -> Result<Vec<f64>, Faults> {
        // A number in text takes a digit and a blank.
        let length =
            if self.binary { count.saturating_mul(number.bytes()) } else { count.saturating_mul(2).saturating_sub(1) };
        if self.binary && count > 0 {
            self.end_line();
        }
        if count > MOST_VALUES || length > self.rest.len() {
            let found = self.rest.len();
            return Err(self.wrong(&format!("expected {count} numbers, found {found} bytes to the end of the file")));
        }
        if self.binary {
            let values = number.values(&self.rest[..length], false);
            self.advance(length);
            return Ok(values);
        }
        let mut values = Vec::with_capacity(count);
        for _ in 0..count {
            let word = self.word_bytes();
            if word.is_empty() {
                let found = values.len();
                return Err(self.wrong(&format!("expected {count} numbers, found {found} and the end of the file")));
            }
            let value = std::str::from_utf8(word).ok().and_then(|word| word.parse().ok());
            values.push(value.ok_or_else(|| {
                self.wrong(&format!("expected a number, found {}", quoted(&String::from_utf8_lossy(word))))
            })?);
        }
        Ok(values)
    }

    /// Steps over values that are no numbers.
    pub fn skip(&mut self, kind: Kind, count: usize) -> Result<(), String> {
        const SHORT: &str = "expected more values, found the end of the file";
        match (kind, self.binary) {
            (Kind::Bit, true) => {
                self.end_line();
                let length = count.div_ceil(8);
                if length > self.rest.len() {
                    return Err(SHORT.into());
                }
                self.advance(length);
            }
            (Kind::Text, true) => {
                self.end_line();
                for _ in 0..count {
                    let length = self.text_length().ok_or(SHORT)?;
                    if length > self.rest.len() {
                        return Err(SHORT.into());
                    }
                    self.advance(length);
                }
            }
            (Kind::Text, false) => {
                self.end_line();
                for _ in 0..count {
                    if self.rest.is_empty() {
                        return Err(SHORT.into());
                    }
                    self.take_line();
                }
            }
            _ => {
                let words = if matches!(kind, Kind::Variant) { count.saturating_mul(2) } else { count };
                for _ in 0..words {
                    if self.word_bytes().is_empty() {
                        return Err(SHORT.into());
                    }
                }
            }
        }
        Ok(())
    }

    /// Bytes of a text, which stand before it: the first two bits say how many bytes the number has.
    fn text_length(&mut self) -> Option<usize> {
        let bytes = match self.rest.first()? >> 6 {
            3 => 1,
            2 => 2,
            1 => 4,
            _ => 8,
        };
        let head = self.rest.get(..bytes)?;
        let number = head.iter().fold(0u64, |number, byte| number << 8 | u64::from(*byte));
        self.advance(bytes);
        usize::try_from(number & (u64::MAX >> (64 - 8 * bytes + 2))).ok()
    }

    /// Goes to the start of the next line, unless it is there.
    fn end_line(&mut self) {
        if !self.line_begins {
            self.take_line();
        }
    }
}
