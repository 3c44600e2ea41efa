//! STL, binary and ASCII: triangles, as three corners each.

use super::MeshError;

/// Corners of the triangles of a file, in its own unit.
type Corners = Vec<[[f64; 3]; 3]>;

/// Bytes before the first triangle of a binary file: a header of 80, then the count.
const HEAD: usize = 84;
/// Bytes of a triangle: normal and three corners in binary32, and two bytes that are not used.
const TRIANGLE: usize = 50;

/// Reads either form. A binary file is told by its length, as its header may begin with `solid` too.
pub(super) fn read(bytes: &[u8]) -> Result<Corners, MeshError> {
    let count = bytes.get(80..HEAD).and_then(|count| count.try_into().ok()).map_or(0, u32::from_le_bytes);
    let expected = HEAD as u64 + TRIANGLE as u64 * u64::from(count);
    if bytes.len() as u64 == expected {
        return Ok(bytes[HEAD..].as_chunks::<TRIANGLE>().0.iter().map(triangle).collect());
    }
    if bytes.trim_ascii_start().starts_with(b"solid") {
        return ascii(bytes);
    }
    Err(MeshError::NotStl { count, expected, found: bytes.len() })
}

fn triangle(bytes: &[u8; TRIANGLE]) -> [[f64; 3]; 3] {
    let numbers = bytes.as_chunks::<4>().0;
    let number = |index: usize| f64::from(f32::from_le_bytes(numbers[index]));
    // The first three are the normal.
    std::array::from_fn(|corner| std::array::from_fn(|axis| number(3 + 3 * corner + axis)))
}

fn ascii(bytes: &[u8]) -> Result<Corners, MeshError> {
    let mut corners = Corners::new();
    let mut words = Words::new(bytes);
    while let Some(word) = words.next()? {
        match word {
            // The solid's name is free text to the end of its line.
            "solid" | "endsolid" => words.end_line(),
            "facet" => corners.push(words.facet()?),
            other => return Err(words.unexpected("`solid`, `facet` or `endsolid`", Some(other))),
        }
    }
    Ok(corners)
}

type Lines<'b> = std::iter::Enumerate<std::slice::Split<'b, u8, fn(&u8) -> bool>>;

/// The words of an ASCII file and the lines they stand in.
struct Words<'b> {
    lines: Lines<'b>,
    line: usize,
    words: std::str::SplitAsciiWhitespace<'b>,
}

impl<'b> Words<'b> {
    fn new(bytes: &'b [u8]) -> Self {
        let is_end: fn(&u8) -> bool = |&byte| byte == b'\n';
        Self { lines: bytes.split(is_end).enumerate(), line: 0, words: "".split_ascii_whitespace() }
    }

    fn next(&mut self) -> Result<Option<&'b str>, MeshError> {
        loop {
            if let Some(word) = self.words.next() {
                return Ok(Some(word));
            }
            let Some((index, line)) = self.lines.next() else { return Ok(None) };
            self.line = index + 1;
            let text = std::str::from_utf8(line).map_err(|_| MeshError::NotText { line: self.line })?;
            self.words = text.split_ascii_whitespace();
        }
    }

    fn end_line(&mut self) {
        self.words = "".split_ascii_whitespace();
    }

    fn unexpected(&self, expected: &'static str, found: Option<&str>) -> MeshError {
        let found = found.map_or_else(|| "the end of the file".into(), |word| format!("`{word}`"));
        MeshError::Unexpected { line: self.line, expected, found }
    }

    /// Steps over words that must come next.
    fn expect(&mut self, expected: &[&'static str], shown: &'static str) -> Result<(), MeshError> {
        for &word in expected {
            let found = self.next()?;
            if found != Some(word) {
                return Err(self.unexpected(shown, found));
            }
        }
        Ok(())
    }

    fn vector(&mut self) -> Result<[f64; 3], MeshError> {
        let mut vector = [0.0; 3];
        for component in &mut vector {
            let word = self.next()?;
            *component = match word.map(str::parse) {
                Some(Ok(number)) => number,
                _ => return Err(self.unexpected("a number", word)),
            };
        }
        Ok(vector)
    }

    /// A triangle behind its word `facet`.
    fn facet(&mut self) -> Result<[[f64; 3]; 3], MeshError> {
        self.expect(&["normal"], "`normal`")?;
        self.vector()?;
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
            ("vertex 1e0", "vertex one", "line 5 of ASCII STL: expected a number, found `one`"),
            ("outer loop", "outer", "line 4 of ASCII STL: expected `outer loop`, found `vertex`"),
            (
                "  endloop",
                "  vertex 0 0 1",
                "line 7 of ASCII STL: expected `endloop` and `endfacet` behind three vertices, found `vertex`",
            ),
            ("   vertex 1e0 0 0\n", "", "line 6 of ASCII STL: expected `vertex`, three to a facet, found `endloop`"),
            ("endsolid", "end", "line 9 of ASCII STL: expected `solid`, `facet` or `endsolid`, found `end`"),
            (
                " endfacet\nendsolid a part of mine\n",
                "",
                "line 8 of ASCII STL: expected `endloop` and `endfacet` behind three vertices, found the end of the file",
            ),
        ] {
            assert_eq!(wrong(ONE.replacen(from, to, 1).as_bytes()), message);
        }
        let mut bytes = ONE.as_bytes().to_vec();
        let at = bytes.len() - 20;
        bytes[at] = 0xff;
        assert_eq!(wrong(&bytes), "ASCII STL expected, but line 9 is not text");
    }
}
