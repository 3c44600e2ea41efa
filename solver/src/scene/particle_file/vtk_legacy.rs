//! Legacy VTK (The VTK User's Guide, "VTK File Formats"): points and point data of a POLYDATA or UNSTRUCTURED_GRID data set, in text
//! or binary, versions 1 to 5.

use super::{Columns, Faults, Values, vtk_xml::Number};

/// Reads the points and their data; cells are skipped.
pub(super) fn read(contents: &[u8]) -> Result<Columns, Faults> {
    let mut cursor = Cursor { rest: contents, line: 1, line_begins: true, binary: false };
    if !cursor.take_line().starts_with("# vtk DataFile Version") {
        return Err(Faults::one(Some(1), "expected `# vtk DataFile Version`"));
    }
    cursor.take_line();
    cursor.binary = match cursor.word().as_str() {
        "ASCII" => false,
        "BINARY" => true,
        other => return Err(cursor.wrong(&format!("expected ASCII or BINARY, found {other:?}"))),
    };
    let mut columns = Columns::default();
    let mut points = None;
    // Whether the arrays that follow belong to points.
    let mut of_points = false;
    loop {
        match cursor.word().to_ascii_uppercase().as_str() {
            "" => break,
            "DATASET" => {
                let kind = cursor.word();
                if !["POLYDATA", "UNSTRUCTURED_GRID"].contains(&kind.as_str()) {
                    return Err(cursor.wrong(&format!("expected POLYDATA or UNSTRUCTURED_GRID, found {kind:?}")));
                }
            }
            "POINTS" => {
                let count = cursor.count()?;
                let number = cursor.kind()?;
                columns.push_array("points", 3, &cursor.numbers(count.saturating_mul(3), number)?);
                points = Some(count);
            }
            "VERTICES" | "LINES" | "POLYGONS" | "TRIANGLE_STRIPS" | "CELLS" => {
                let (first, size) = (cursor.count()?, cursor.count()?);
                cursor.skip_cells(first, size)?;
            }
            "CELL_TYPES" => {
                let count = cursor.count()?;
                cursor.numbers(count, Number::I32)?;
            }
            "POINT_DATA" => {
                of_points = true;
                let count = cursor.count()?;
                if points != Some(count) {
                    return Err(cursor.wrong(&format!("point data of {count} points do not fit the points")));
                }
            }
            "CELL_DATA" => {
                of_points = false;
                // Its number of rows is that of the cells.
                points = Some(cursor.count()?);
            }
            "SCALARS" => {
                let (name, number) = (cursor.word(), cursor.kind()?);
                let components = cursor.rest_of_line().parse().unwrap_or(1);
                cursor.skip_word("LOOKUP_TABLE");
                cursor.array(&mut columns, &name, components, points, number, of_points)?;
            }
            "VECTORS" | "NORMALS" => {
                let (name, number) = (cursor.word(), cursor.kind()?);
                cursor.array(&mut columns, &name, 3, points, number, of_points)?;
            }
            "FIELD" => {
                cursor.word();
                for _ in 0..cursor.count()? {
                    let (name, components, rows) = (cursor.word(), cursor.count()?, cursor.count()?);
                    let number = cursor.kind()?;
                    let kept = of_points && points == Some(rows);
                    cursor.array(&mut columns, &name, components, Some(rows), number, kept)?;
                }
            }
            "METADATA" => while !cursor.take_line().trim().is_empty() {},
            other => return Err(cursor.wrong(&format!("expected a section such as POINT_DATA, found {other:?}"))),
        }
    }
    match columns.columns.is_empty() {
        true => Err(cursor.wrong("expected POINTS, found none")),
        false => Ok(columns),
    }
}

struct Cursor<'c> {
    rest: &'c [u8],
    line: usize,
    /// Whether the rest begins a line.
    line_begins: bool,
    binary: bool,
}

impl Cursor<'_> {
    fn wrong(&self, message: &str) -> Faults {
        Faults::one(Some(self.line), message)
    }

    fn advance(&mut self, count: usize) {
        let (taken, rest) = self.rest.split_at(count.min(self.rest.len()));
        self.line += taken.iter().filter(|byte| **byte == b'\n').count();
        self.line_begins = taken.last().map_or(self.line_begins, |byte| *byte == b'\n');
        self.rest = rest;
    }

    /// What is left of the line, without its end.
    fn take_line(&mut self) -> String {
        let length = self.rest.iter().position(|byte| *byte == b'\n').unwrap_or(self.rest.len());
        let line = String::from_utf8_lossy(&self.rest[..length]).into_owned();
        self.advance(length + 1);
        line
    }

    fn rest_of_line(&mut self) -> String {
        self.take_line().trim().to_owned()
    }

    /// The next word, on this line or a later one; empty at the end.
    fn word(&mut self) -> String {
        let start = self.rest.iter().position(|byte| !byte.is_ascii_whitespace()).unwrap_or(self.rest.len());
        self.advance(start);
        let length = self.rest.iter().position(u8::is_ascii_whitespace).unwrap_or(self.rest.len());
        let word = String::from_utf8_lossy(&self.rest[..length]).into_owned();
        self.advance(length);
        word
    }

    /// Skips a line that begins with a word, where the next one does.
    fn skip_word(&mut self, word: &str) {
        if self.rest.starts_with(word.as_bytes()) {
            self.take_line();
        }
    }

    fn count(&mut self) -> Result<usize, Faults> {
        let word = self.word();
        word.parse().map_err(|_| self.wrong(&format!("expected a whole number, found {word:?}")))
    }

    fn kind(&mut self) -> Result<Number, Faults> {
        let word = self.word();
        Number::legacy(&word).ok_or_else(|| self.wrong(&format!("expected a type such as double, found {word:?}")))
    }

    /// The next numbers: words, or big-endian bytes on the line that follows.
    fn numbers(&mut self, count: usize, number: Number) -> Result<Vec<f64>, Faults> {
        if !self.binary {
            return (0..count)
                .map(|_| {
                    let word = self.word();
                    word.parse().map_err(|_| self.wrong(&format!("expected a number, found {word:?}")))
                })
                .collect();
        }
        self.end_line();
        let length = count.saturating_mul(number.bytes());
        let Some(bytes) = self.rest.get(..length) else {
            return Err(self.wrong(&format!("expected {length} bytes, found {}", self.rest.len())));
        };
        let values = number.values(bytes, false);
        self.advance(length);
        Ok(values)
    }

    /// Goes to the start of the next line, unless it is there.
    fn end_line(&mut self) {
        if !self.line_begins {
            self.take_line();
        }
    }

    /// Skips cells: `count size` with as many integers, or from version 5 two arrays of these lengths.
    fn skip_cells(&mut self, first: usize, size: usize) -> Result<(), Faults> {
        self.end_line();
        if !self.rest.starts_with(b"OFFSETS") {
            return self.numbers(size, Number::I32).map(drop);
        }
        for length in [first, size] {
            self.word();
            let number = self.kind()?;
            self.numbers(length, number)?;
        }
        Ok(())
    }

    fn array(
        &mut self,
        columns: &mut Columns,
        name: &str,
        components: usize,
        rows: Option<usize>,
        number: Number,
        kept: bool,
    ) -> Result<(), Faults> {
        let Some(rows) = rows else { return Err(self.wrong("expected POINTS before their data")) };
        if components == 0 {
            return Err(self.wrong(&format!("expected an array `{name}` of at least one component")));
        }
        let values = self.numbers(rows.saturating_mul(components), number)?;
        if kept && columns.find(&name.to_ascii_lowercase()).is_none_or(|values| matches!(values, Values::Words(_))) {
            columns.push_array(name, components, &values);
        }
        Ok(())
    }
}
