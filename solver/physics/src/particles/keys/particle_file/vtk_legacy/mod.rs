//! Legacy VTK (The VTK User's Guide, "VTK File Formats"): points and point data of a POLYDATA or UNSTRUCTURED_GRID data set, in text
//! or binary, versions 1 to 5. What VTK writes beside them is stepped over; keywords are read in any case, as VTK does.

mod cursor;

use cursor::{Cursor, Kind};

use super::{Columns, Faults, columns_of, cut, is_known, quoted, vtk_number::Number};

/// Reads the points and their data; cells are skipped.
pub(crate) fn read(contents: &[u8]) -> Result<Columns, Faults> {
    let contents = contents.strip_prefix(b"\xef\xbb\xbf").unwrap_or(contents);
    let unix;
    let contents = match cursor::is_text(contents) {
        true => {
            unix = cursor::with_unix_line_ends(contents);
            unix.as_slice()
        }
        false => contents,
    };
    let mut cursor = Cursor::new(contents);
    if !cursor.take_line().trim_start().to_ascii_lowercase().starts_with("# vtk datafile version") {
        return Err(Faults::one(Some(1), "expected `# vtk DataFile Version`"));
    }
    cursor.take_line();
    cursor.binary = match cursor.keyword().as_str() {
        "ASCII" => false,
        "BINARY" => true,
        other => return Err(cursor.wrong(&format!("expected ASCII or BINARY, found {}", quoted(other)))),
    };
    Sections { cursor, columns: Columns::default(), points: None, rows: None, components: 1 }.read()
}

/// The sections of a file, read one after the other.
struct Sections<'c> {
    cursor: Cursor<'c>,
    columns: Columns,
    /// Number of points, once they are read.
    points: Option<usize>,
    /// What the arrays that follow belong to, and how many rows they have.
    rows: Option<Rows>,
    /// Components of the last array, whose metadata may follow.
    components: usize,
}

#[derive(Clone, Copy)]
struct Rows {
    of_points: bool,
    count: usize,
}

impl Sections<'_> {
    fn read(mut self) -> Result<Columns, Faults> {
        loop {
            let section = self.cursor.keyword();
            match section.as_str() {
                "" => break,
                "DATASET" => {
                    let kind = self.cursor.keyword();
                    if !["POLYDATA", "UNSTRUCTURED_GRID"].contains(&kind.as_str()) {
                        let message = format!("expected POLYDATA or UNSTRUCTURED_GRID, found {}", quoted(&kind));
                        return Err(self.cursor.wrong(&message));
                    }
                }
                "POINTS" => self.points()?,
                "VERTICES" | "LINES" | "POLYGONS" | "TRIANGLE_STRIPS" | "CELLS" => self.cells()?,
                "CELL_TYPES" => {
                    let count = self.cursor.count()?;
                    self.cursor.numbers(count, Number::I32)?;
                }
                "POINT_DATA" => {
                    let count = self.cursor.count()?;
                    if self.points != Some(count) {
                        let points = self.points.map_or("none before".into(), |points| points.to_string());
                        let message = format!(
                            "expected point data of as many rows as there are points, found {count} rows and {points} points"
                        );
                        return Err(self.cursor.wrong(&message));
                    }
                    self.rows = Some(Rows { of_points: true, count });
                }
                "CELL_DATA" => self.rows = Some(Rows { of_points: false, count: self.cursor.count()? }),
                "METADATA" => self.cursor.skip_metadata(self.components),
                "FIELD" => self.field()?,
                // The colours of a table: bytes in binary, shares in text.
                "LOOKUP_TABLE" => {
                    self.cursor.word();
                    let count = self.cursor.count()?;
                    let number = if self.cursor.binary { Number::U8 } else { Number::F32 };
                    self.cursor.numbers(count.saturating_mul(4), number)?;
                }
                attribute => self.attribute(attribute)?,
            }
        }
        if self.points.is_some() { Ok(self.columns) } else { Err(self.cursor.wrong("expected POINTS, found none")) }
    }

    fn points(&mut self) -> Result<(), Faults> {
        if self.points.is_some() {
            return Err(self.cursor.wrong("expected POINTS once, found them twice"));
        }
        let count = self.cursor.count()?;
        let kind = self.cursor.word();
        let Some(Kind::Number(number)) = Kind::of(&kind) else {
            return Err(self.cursor.wrong(&format!("expected a type such as double, found {}", quoted(&kind))));
        };
        let values = self.cursor.numbers(count.saturating_mul(3), number)?;
        self.columns.push_array("points", 3, &values).map_err(|message| self.cursor.wrong(&message))?;
        (self.points, self.components) = (Some(count), 3);
        Ok(())
    }

    /// Steps over cells: `count size` with as many integers, or from version 5 two arrays of these lengths.
    fn cells(&mut self) -> Result<(), Faults> {
        let (first, size) = (self.cursor.count()?, self.cursor.count()?);
        if !self.cursor.next_is("OFFSETS") {
            return self.cursor.numbers(size, Number::I32).map(drop);
        }
        for (name, length) in [("OFFSETS", first), ("CONNECTIVITY", size)] {
            let found = self.cursor.keyword();
            if found != name {
                return Err(self.cursor.wrong(&format!("expected {name}, found {}", quoted(&found))));
            }
            let kind = self.cursor.word();
            match Kind::of(&kind) {
                Some(Kind::Number(number)) => self.cursor.numbers(length, number)?,
                _ => {
                    return Err(self
                        .cursor
                        .wrong(&format!("expected a type such as vtktypeint64, found {}", quoted(&kind))));
                }
            };
            if self.cursor.next_is("METADATA") {
                self.cursor.keyword();
                self.cursor.skip_metadata(1);
            }
        }
        Ok(())
    }

    /// Reads a section that is one array: its keyword says how many components it has.
    fn attribute(&mut self, section: &str) -> Result<(), Faults> {
        const KNOWN: [(&str, usize); 10] = [
            ("SCALARS", 1),
            ("COLOR_SCALARS", 0),
            ("VECTORS", 3),
            ("NORMALS", 3),
            ("TENSORS", 9),
            ("TENSORS6", 6),
            ("TEXTURE_COORDINATES", 0),
            ("GLOBAL_IDS", 1),
            ("PEDIGREE_IDS", 1),
            ("EDGE_FLAGS", 1),
        ];
        let Some((_, components)) = KNOWN.iter().find(|(known, _)| *known == section) else {
            let found = quoted(section);
            return Err(self.cursor.wrong(&format!("expected a section such as POINT_DATA, found {found}")));
        };
        let mut components = *components;
        let name = self.cursor.name();
        if ["COLOR_SCALARS", "TEXTURE_COORDINATES"].contains(&section) {
            components = self.cursor.count()?;
        }
        let kind = match section {
            "COLOR_SCALARS" if self.cursor.binary => "unsigned_char".into(),
            "COLOR_SCALARS" => "float".into(),
            _ => self.cursor.word(),
        };
        if section == "SCALARS" {
            let rest = self.cursor.take_line();
            components = match rest.trim() {
                "" => 1,
                count => count.parse().map_err(|_| {
                    let found = quoted(count);
                    self.cursor
                        .wrong_before(&format!("expected the number of components of `{}`, found {found}", cut(&name)))
                })?,
            };
            if self.cursor.next_is("LOOKUP_TABLE") {
                self.cursor.take_line();
            }
        }
        let Some(rows) = self.rows else {
            return Err(self.cursor.wrong(&format!("expected POINT_DATA or CELL_DATA before {section}")));
        };
        self.array(&name, components, rows.count, &kind)
    }

    fn field(&mut self) -> Result<(), Faults> {
        self.cursor.word();
        let mut arrays = self.cursor.count()?;
        while arrays > 0 {
            // Metadata of the array before.
            if self.cursor.next_is("METADATA") {
                self.cursor.keyword();
                self.cursor.skip_metadata(self.components);
                continue;
            }
            arrays -= 1;
            let name = self.cursor.name();
            // What VTK writes where an array is not there.
            if name == "NULL_ARRAY" {
                continue;
            }
            let (components, rows) = (self.cursor.count()?, self.cursor.count()?);
            let kind = self.cursor.word();
            self.array(&name, components, rows, &kind)?;
        }
        Ok(())
    }

    /// Reads an array; one on points is kept.
    fn array(&mut self, name: &str, components: usize, rows: usize, kind: &str) -> Result<(), Faults> {
        let of_points = self.rows.is_some_and(|rows| rows.of_points);
        let is_wanted =
            of_points && columns_of(name, components).map_or(true, |names| names.iter().any(|name| is_known(name)));
        let told = |message: String| format!("the array `{}`: {message}", cut(name));
        let wrong = |this: &Self, message: String| this.cursor.wrong(&told(message));
        let Some(kind) = Kind::of(kind) else {
            return Err(wrong(self, format!("expected a type such as double, found {}", quoted(kind))));
        };
        self.components = components;
        let count = rows.saturating_mul(components);
        let Kind::Number(number) = kind else {
            self.cursor.skip(kind, count).map_err(|message| wrong(self, message))?;
            return if is_wanted { Err(wrong(self, "expected numbers, found texts".into())) } else { Ok(()) };
        };
        let values = self.cursor.numbers(count, number)?;
        if !of_points {
            return Ok(());
        }
        if Some(rows) != self.points {
            let points = self.points.unwrap_or_default();
            // Data of the set as a whole may stand among those of points.
            return if is_wanted { Err(wrong(self, format!("expected {points} rows, found {rows}"))) } else { Ok(()) };
        }
        self.columns.push_point_data(name, components, &values).map_err(|message| self.cursor.wrong(&message))
    }
}
