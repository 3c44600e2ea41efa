//! The records of an MCAP file as its specification lays them out, read without the crate that wrote them.

use std::ops::Range;

/// Opcode and body of a record.
pub struct Record {
    /// What it is: 1 header, 2 footer, 3 schema, 4 channel, 5 message, 6 chunk, 7 message index, 8 chunk index,
    /// 9 attachment, 10 attachment index, 11 statistics, 12 metadata, 13 metadata index, 14 summary offset, 15 data end.
    pub opcode: u8,
    /// Where its body stands; its opcode and length stand in the nine bytes before.
    pub body: Range<usize>,
}

/// The records in `range`, which begins with one; as many as are whole.
pub fn records(bytes: &[u8], range: Range<usize>) -> Vec<Record> {
    let mut at = range.start;
    let mut found = Vec::new();
    while at + 9 <= range.end {
        let length = u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap()) as usize;
        let body = at + 9..at + 9 + length;
        if body.end > range.end {
            break;
        }
        at = body.end;
        found.push(Record { opcode: bytes[body.start - 9], body });
    }
    found
}
