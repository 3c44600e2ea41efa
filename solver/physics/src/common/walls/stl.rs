//! STL, binary and ASCII: triangles, as three corners each.

use super::MeshError;

/// Corners of the triangles of a file, in its own unit.
type Corners = Vec<[[f64; 3]; 3]>;

/// Bytes before the first triangle of a binary file: a header of 80, then the count.
const HEAD: usize = 84;
/// Bytes of a triangle: normal and three corners in binary32, and two bytes that are not used.
const TRIANGLE: usize = 50;

/// Reads either form. A binary file is told by its length, or by bytes that no text has, as its header may begin with
/// `solid` too. What is left over behind the triangles it counts is no triangle: less than one, or zeros that fill a block.
pub(super) fn read(bytes: &[u8]) -> Result<Corners, MeshError> {
    let count = bytes.get(80..HEAD).and_then(|count| count.try_into().ok()).map_or(0, u32::from_le_bytes);
    let expected = HEAD as u64 + TRIANGLE as u64 * u64::from(count);
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
    let is_text = text.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid")) && !text.contains(&0);
    let length = bytes.len() as u64;
    if is_text && length != expected {
        return ascii(bytes);
    }
    let Some((triangles, rest)) = usize::try_from(expected).ok().and_then(|end| bytes.split_at_checked(end)) else {
        return Err(MeshError::NotStl { count, expected, found: bytes.len() });
    };
    if rest.len() >= TRIANGLE && rest.iter().any(|byte| *byte != 0) {
        return Err(MeshError::MoreThanCounted { count, more: rest.len() });
    }
    Ok(triangles[HEAD..].as_chunks::<TRIANGLE>().0.iter().map(triangle).collect())
}

fn triangle(bytes: &[u8; TRIANGLE]) -> [[f64; 3]; 3] {
    let numbers = bytes.as_chunks::<4>().0;
    let number = |index: usize| f64::from(f32::from_le_bytes(numbers[index]));
    // The first three are the normal.
    std::array::from_fn(|corner| std::array::from_fn(|axis| number(3 + 3 * corner + axis)))
}

/// Reads text: any number of solids, keywords in any case, `endsolid` in one word or in two.
fn ascii(bytes: &[u8]) -> Result<Corners, MeshError> {
    let mut corners = Corners::new();
    let mut words = Words::new(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes));
    let mut is_open = false;
    while let Some(word) = words.next() {
        match (words.keyword(word).as_str(), is_open) {
            // The solid's name is free text to the end of its line, in whatever encoding.
            ("solid", false) | ("endsolid", true) => {
                words.end_line();
                is_open = !is_open;
            }
            ("facet", true) => corners.push(words.facet()?),
            (_, true) => return Err(words.unexpected("`facet` or `endsolid`", Some(word))),
            (_, false) => return Err(words.unexpected("`solid` or the end of the file", Some(word))),
        }
    }
    if is_open { Err(words.unexpected("`facet` or `endsolid`", None)) } else { Ok(corners) }
}

/// The words of an ASCII file and the lines they stand in; lines end with LF, CR LF, or CR alone.
struct Words<'b> {
    rest: &'b [u8],
    /// Line of the last word.
    line: usize,
}

impl<'b> Words<'b> {
    fn new(bytes: &'b [u8]) -> Self {
        Self { rest: bytes, line: 1 }
    }

    fn next(&mut self) -> Option<&'b [u8]> {
        while let Some(byte) = self.rest.first().filter(|byte| byte.is_ascii_whitespace()) {
            self.line += usize::from(*byte == b'\n' || (*byte == b'\r' && self.rest.get(1) != Some(&b'\n')));
            self.rest = &self.rest[1..];
        }
        let length = self.rest.iter().position(u8::is_ascii_whitespace).unwrap_or(self.rest.len());
        let (word, rest) = self.rest.split_at(length);
        self.rest = rest;
        (!word.is_empty()).then_some(word)
    }

    /// A keyword in lower case; `end` and what it ends are one.
    fn keyword(&mut self, word: &[u8]) -> String {
        let lower = |word: &[u8]| String::from_utf8_lossy(word).to_ascii_lowercase();
        let word = lower(word);
        if word != "end" {
            return word;
        }
        let (rest, line) = (self.rest, self.line);
        match self.next().map(lower) {
            Some(ended) if ["solid", "facet", "loop"].contains(&ended.as_str()) => word + &ended,
            _ => {
                (self.rest, self.line) = (rest, line);
                word
            }
        }
    }

    fn end_line(&mut self) {
        let end = self.rest.iter().position(|byte| [b'\n', b'\r'].contains(byte)).unwrap_or(self.rest.len());
        self.rest = &self.rest[end..];
    }

    fn unexpected(&self, expected: &'static str, found: Option<&[u8]>) -> MeshError {
        let shown = |word: &[u8]| format!("`{}`", String::from_utf8_lossy(&word[..word.len().min(60)]).escape_debug());
        MeshError::Unexpected { line: self.line, expected, found: found.map_or("the end of the file".into(), shown) }
    }

    /// Steps over words that must come next.
    fn expect(&mut self, expected: &[&str], shown: &'static str) -> Result<(), MeshError> {
        for &keyword in expected {
            let found = self.next();
            if found.map(|word| self.keyword(word)).as_deref() != Some(keyword) {
                return Err(self.unexpected(shown, found));
            }
        }
        Ok(())
    }

    fn vector(&mut self) -> Result<[f64; 3], MeshError> {
        let mut vector = [0.0; 3];
        for component in &mut vector {
            let word = self.next();
            let number = word.and_then(|word| std::str::from_utf8(word).ok()).and_then(|word| word.parse().ok());
            *component = number.ok_or_else(|| self.unexpected("a number such as 1.5e-3", word))?;
        }
        Ok(vector)
    }

    /// A triangle behind its word `facet`.
    fn facet(&mut self) -> Result<[[f64; 3]; 3], MeshError> {
        self.expect(&["normal"], "`normal`")?;
        // Not used, and where a triangle has no area often no numbers: `-nan(ind)`.
        for _ in 0..3 {
            let word = self.next();
            if word.is_none_or(|word| word.eq_ignore_ascii_case(b"outer")) {
                return Err(self.unexpected("a normal of three numbers", word));
            }
        }
        self.expect(&["outer", "loop"], "`outer loop`")?;
        let mut corners = [[0.0; 3]; 3];
        for corner in &mut corners {
            self.expect(&["vertex"], "`vertex`, three to a facet")?;
            *corner = self.vector()?;
        }
        self.expect(&["endloop", "endfacet"], "`endloop` and `endfacet` behind three vertices")?;
        Ok(corners)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ONE: &str = "solid a part of mine\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1e0 0 0\n   \
                       vertex 0 +2.5 0\n  endloop\n endfacet\nendsolid a part of mine\n";

    fn binary(header: &[u8], corners: &[[[f32; 3]; 3]]) -> Vec<u8> {
        let mut bytes = header.to_vec();
        bytes.resize(80, b' ');
        bytes.extend((corners.len() as u32).to_le_bytes());
        for triangle in corners {
            bytes.extend([[0f32; 3]].as_flattened().iter().flat_map(|number| number.to_le_bytes()));
            bytes.extend(triangle.as_flattened().iter().flat_map(|number| number.to_le_bytes()));
            bytes.extend([0; 2]);
        }
        bytes
    }

    #[test]
    fn both_forms_hold_the_same() {
        let corners = vec![[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.5, 0.0]]];
        assert_eq!(read(ONE.as_bytes()), Ok(corners.clone()));
        assert_eq!(read(ONE.replace('\n', "\r\n").as_bytes()), Ok(corners.clone()));
        // Many programs begin the header of a binary file with `solid`.
        let single = [[[0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.5, 0.0]]];
        for header in ["solid by a program", ""] {
            assert_eq!(read(&binary(header.as_bytes(), &single)), Ok(corners.clone()));
        }
    }

    #[test]
    fn what_is_no_stl_says_what_is_wrong() {
        let wrong = |bytes: &[u8]| read(bytes).unwrap_err().to_string();
        let cut = binary(b"", &[[[0f32; 3]; 3]; 2]);
        assert_eq!(
            wrong(&cut[..cut.len() - 1]),
            "not an STL file: binary STL of 2 triangles has 184 bytes, not 183, and ASCII STL begins with `solid`"
        );
        assert!(wrong(b"").contains("binary STL of 0 triangles has 84 bytes, not 0"));
        assert!(wrong(b"o cube\nv 0 0 0\n").starts_with("not an STL file"));
        for (from, to, message) in [
            ("vertex 1e0", "vertex one", "line 5 of ASCII STL: expected a number such as 1.5e-3, found `one`"),
            ("vertex 1e0", "vertex 1.0D0", "line 5 of ASCII STL: expected a number such as 1.5e-3, found `1.0D0`"),
            ("outer loop", "outer", "line 4 of ASCII STL: expected `outer loop`, found `vertex`"),
            ("0 0 1\n", "0 0\n", "line 3 of ASCII STL: expected a normal of three numbers, found `outer`"),
            (
                "  endloop",
                "  vertex 0 0 1",
                "line 7 of ASCII STL: expected `endloop` and `endfacet` behind three vertices, found `vertex`",
            ),
            ("   vertex 1e0 0 0\n", "", "line 6 of ASCII STL: expected `vertex`, three to a facet, found `endloop`"),
            ("endsolid", "end", "line 9 of ASCII STL: expected `facet` or `endsolid`, found `end`"),
            ("endsolid", "solid", "line 9 of ASCII STL: expected `facet` or `endsolid`, found `solid`"),
            (
                "endsolid a part of mine\n",
                "",
                "line 9 of ASCII STL: expected `facet` or `endsolid`, found the end of the file",
            ),
            (
                " endfacet\nendsolid a part of mine\n",
                "",
                "line 8 of ASCII STL: expected `endloop` and `endfacet` behind three vertices, found the end of the file",
            ),
        ] {
            assert_eq!(wrong(ONE.replacen(from, to, 1).as_bytes()), message);
        }
    }

    #[test]
    fn dialects_that_others_read_are_read() {
        let corners = read(ONE.as_bytes()).unwrap();
        let mut named = ONE.as_bytes().to_vec();
        // A name in another encoding, as Windows writes it.
        named[8] = 0xe9;
        for text in [
            ONE.to_ascii_uppercase().into_bytes(),
            ONE.replace('\n', "\r").into_bytes(),
            ONE.replace("end", "end ").into_bytes(),
            ONE.replace("normal 0 0 1", "normal -nan(ind) 1.#QNAN inf").into_bytes(),
            format!("\u{feff}\n {ONE}").into_bytes(),
            named,
        ] {
            assert_eq!(read(&text).as_ref(), Ok(&corners), "{}", String::from_utf8_lossy(&text));
        }
        let two = read(format!("{ONE}\n{ONE}").as_bytes()).unwrap();
        assert_eq!(two, [corners.clone(), corners.clone()].concat());
        let single = [[[0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.5, 0.0]]];
        for header in ["solid by a program", "SOLID", "\u{e9}"] {
            let file = binary(header.as_bytes(), &single);
            for more in [vec![0; 3], b"\n".to_vec(), vec![7; 49], vec![0; 1000]] {
                assert_eq!(read(&[file.clone(), more].concat()).as_ref(), Ok(&corners), "{header}");
            }
            // What may hold a triangle that the count has forgotten is not left away.
            let more = [file, vec![7; 50]].concat();
            assert_eq!(read(&more), Err(MeshError::MoreThanCounted { count: 1, more: 50 }));
        }
    }
}
