//! How numbers are written in an XML file: as text, or as bytes behind a header.

use base64::{Engine as _, engine::general_purpose::STANDARD};
use roxmltree::Node;

use super::{Faults, Number, attribute, line, quoted, whole, word};

/// How numbers are written in a file.
pub(crate) struct Coding<'c> {
    little_endian: bool,
    header: Number,
    packed: bool,
    /// Data behind the XML.
    appended: Option<&'c [u8]>,
    /// These are raw instead of base64.
    raw: bool,
}

impl<'c> Coding<'c> {
    /// As the attributes of the file say.
    pub fn of(root: &Node<'_, '_>, appended: Option<&'c [u8]>) -> Result<Self, Faults> {
        let packed = match attribute(root, "compressor").unwrap_or_default() {
            "" => false,
            "vtkZLibDataCompressor" => true,
            other => {
                let message = format!("its data are packed by {}: save it with zlib or unpacked", quoted(other));
                return Err(Faults::one(line(root), message));
            }
        };
        let data = root.children().find(|node| node.has_tag_name("AppendedData"));
        let encoding = data.map_or(Ok("base64"), |data| word(&data, "encoding", &["base64", "raw"]))?;
        Ok(Self {
            little_endian: word(root, "byte_order", &["LittleEndian", "BigEndian"])? == "LittleEndian",
            header: if word(root, "header_type", &["UInt32", "UInt64"])? == "UInt64" {
                Number::U64
            } else {
                Number::U32
            },
            packed,
            appended,
            raw: encoding == "raw",
        })
    }

    /// The numbers of an array, of which there should be `count`; text may hold fewer or more.
    pub fn values(&self, array: &Node<'_, '_>, number: Number, count: usize) -> Result<Vec<f64>, String> {
        let told = |faults: Faults| faults.0.into_iter().next().map_or(String::new(), |fault| fault.message);
        // Comments, instructions and elements may stand between its words.
        let text: String = array.children().filter(Node::is_text).filter_map(|node| node.text()).collect();
        let length = count.saturating_mul(number.bytes());
        let bytes = match word(array, "format", &["ascii", "binary", "appended"]).map_err(told)? {
            "ascii" => {
                let parse = |word: &str| word.parse().map_err(|_| format!("expected a number, found {}", quoted(word)));
                return text.split_whitespace().map(parse).collect();
            }
            "binary" => self.unpack(&mut Base64 { letters: text.as_bytes(), bytes: Vec::new() }, length)?,
            _ => {
                let offset = whole(array, "offset", None).map_err(told)?;
                let data = self.appended.ok_or("its data are appended, but nothing is")?;
                let data = data.get(offset..).ok_or("its data begin behind the end of the file")?;
                match self.raw {
                    true => self.unpack(&mut Raw(data), length)?,
                    false => self.unpack(&mut Base64 { letters: data, bytes: Vec::new() }, length)?,
                }
            }
        };
        Ok(number.values(&bytes, self.little_endian))
    }

    /// The bytes behind a header that says how many there are: `length`.
    fn unpack(&self, data: &mut impl Source, length: usize) -> Result<Vec<u8>, String> {
        let expect = |found: usize| match found == length {
            true => Ok(()),
            false => Err(format!("expected {length} bytes of values, found a header that says {found}")),
        };
        let word = self.header.bytes();
        let header = |index: usize, data: &mut dyn Source| -> Result<usize, String> {
            let bytes = data.bytes(index.saturating_mul(word), word)?;
            // Exact below 2⁵³, and beyond that far from what any file holds.
            Ok(self.header.values(bytes, self.little_endian).first().map_or(0, |value| *value as usize))
        };
        if !self.packed {
            expect(header(0, data)?)?;
            return data.bytes(word, length).map(<[u8]>::to_vec);
        }
        // Number of blocks, their size, size of the last one (0: as the others), then the packed sizes.
        let (blocks, size, last) = (header(0, data)?, header(1, data)?, header(2, data)?);
        let whole_blocks = if last == 0 { blocks } else { blocks.saturating_sub(1) };
        expect(whole_blocks.saturating_mul(size).saturating_add(if blocks == 0 { 0 } else { last }))?;
        let mut at = blocks.saturating_add(3).saturating_mul(word);
        // A header in base64 is padded, and so the data begin where it ends in either form.
        let mut unpacked = Vec::new();
        for block in 0..blocks {
            let packed = header(3 + block, data)?;
            let size = if block + 1 == blocks && last > 0 { last } else { size };
            let bytes = data.bytes(at, packed)?;
            let values = miniz_oxide::inflate::decompress_to_vec_zlib_with_limit(bytes, size)
                .map_err(|error| format!("its packed data are damaged: {error}"))?;
            if values.len() != size {
                return Err(format!(
                    "its packed data are damaged: block {block} has {} bytes, not {size}",
                    values.len()
                ));
            }
            unpacked.extend(values);
            at = at.saturating_add(packed);
        }
        Ok(unpacked)
    }
}

/// Where bytes come from.
trait Source {
    /// `length` bytes from byte `at` on.
    fn bytes(&mut self, at: usize, length: usize) -> Result<&[u8], String>;
}

const SHORT: &str = "its data are shorter than they say";

struct Raw<'d>(&'d [u8]);

impl Source for Raw<'_> {
    fn bytes(&mut self, at: usize, length: usize) -> Result<&[u8], String> {
        self.0.get(at..at.saturating_add(length)).ok_or_else(|| SHORT.into())
    }
}

/// Base64, decoded as far as it is asked for. Its pieces may each be padded: VTK writes a header of its own before packed data.
struct Base64<'d> {
    letters: &'d [u8],
    bytes: Vec<u8>,
}

impl Source for Base64<'_> {
    fn bytes(&mut self, at: usize, length: usize) -> Result<&[u8], String> {
        let end = at.saturating_add(length);
        let mut group = [0; 4];
        while self.bytes.len() < end {
            for letter in &mut group {
                let blanks = self.letters.iter().take_while(|byte| byte.is_ascii_whitespace()).count();
                let (next, rest) = self.letters[blanks..].split_first().ok_or(SHORT)?;
                // What follows appended data.
                if *next == b'<' {
                    return Err(SHORT.into());
                }
                (*letter, self.letters) = (*next, rest);
            }
            let decoded = STANDARD.decode_vec(group, &mut self.bytes);
            decoded.map_err(|error| format!("its base64 is damaged: {error}"))?;
        }
        self.bytes.get(at..end).ok_or_else(|| SHORT.into())
    }
}
