//! Data behind the XML, which may be bytes that are no text.

use super::Faults;

/// The XML with an empty element where its appended data stood, and what follows their underscore.
pub(crate) fn split(contents: &[u8]) -> Result<(String, Option<&[u8]>), Faults> {
    let text = |bytes: &[u8]| super::super::text(bytes).map(str::to_owned);
    let Some(start) = find_element(contents) else { return Ok((text(contents)?, None)) };
    let line = 1 + contents[..start].iter().filter(|byte| **byte == b'\n').count();
    let wrong = |message: &str| Faults::one(Some(line), message);
    let open = end_of_tag(contents, start).ok_or_else(|| wrong("expected `>` behind AppendedData"))?;
    let tag = &contents[start..open];
    let is_empty = tag.ends_with(b"/");
    let mut xml = text(&contents[..start])?;
    xml += text(tag)?.trim_end_matches('/');
    xml += "/></VTKFile>";
    if is_empty {
        return Ok((xml, None));
    }
    let mark = open + 1 + contents[open + 1..].iter().take_while(|byte| byte.is_ascii_whitespace()).count();
    match contents.get(mark) {
        Some(b'_') => Ok((xml, Some(&contents[mark + 1..]))),
        _ => Err(wrong("expected AppendedData to begin with `_`")),
    }
}

/// Where the element begins, but for comments, instructions and texts that mention it.
fn find_element(contents: &[u8]) -> Option<usize> {
    let find = |from: usize, wanted: &[u8]| {
        contents[from..].windows(wanted.len()).position(|window| window == wanted).map(|at| from + at)
    };
    const SKIPPED: [(&[u8], &[u8]); 3] = [(b"<!--", b"-->"), (b"<![CDATA[", b"]]>"), (b"<?", b"?>")];
    const NAME: &[u8] = b"<AppendedData";
    let mut at = 0;
    loop {
        at += contents[at..].iter().position(|byte| *byte == b'<')?;
        let rest = &contents[at..];
        if let Some((open, close)) = SKIPPED.iter().find(|(open, _)| rest.starts_with(open)) {
            at = find(at + open.len(), close)? + close.len();
        } else if rest.starts_with(NAME) && rest.get(NAME.len()).is_some_and(|byte| !byte.is_ascii_alphanumeric()) {
            return Some(at);
        } else {
            at = end_of_tag(contents, at)?;
        }
    }
}

/// Where the `>` of a tag stands; those in its quotes are not it.
fn end_of_tag(contents: &[u8], start: usize) -> Option<usize> {
    let mut quote = None;
    contents[start..]
        .iter()
        .position(|&byte| match (quote, byte) {
            (None, b'>') => true,
            (None, b'"' | b'\'') => {
                quote = Some(byte);
                false
            }
            (Some(open), _) if open == byte => {
                quote = None;
                false
            }
            _ => false,
        })
        .map(|at| start + at)
}
