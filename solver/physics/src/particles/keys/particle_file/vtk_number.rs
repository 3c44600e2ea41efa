//! Types of numbers in VTK files.

/// Type of a number in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Number {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

impl Number {
    /// By its name in a legacy file. `bit`, `string` and `variant` are no such types.
    pub fn legacy(name: &str) -> Option<Self> {
        Some(match name.to_ascii_lowercase().as_str() {
            "char" | "signed_char" => Self::I8,
            "unsigned_char" => Self::U8,
            "short" => Self::I16,
            "unsigned_short" => Self::U16,
            // A legacy file holds ids as 32 bits, whatever the library counts with.
            "int" | "vtkidtype" => Self::I32,
            "unsigned_int" => Self::U32,
            "long" | "vtktypeint64" => Self::I64,
            "unsigned_long" | "vtktypeuint64" => Self::U64,
            "float" => Self::F32,
            "double" => Self::F64,
            _ => return None,
        })
    }

    /// By its name in an XML file.
    pub fn xml(name: &str) -> Option<Self> {
        Some(match name {
            "Int8" => Self::I8,
            "UInt8" => Self::U8,
            "Int16" => Self::I16,
            "UInt16" => Self::U16,
            "Int32" => Self::I32,
            "UInt32" => Self::U32,
            "Int64" => Self::I64,
            "UInt64" => Self::U64,
            "Float32" => Self::F32,
            "Float64" => Self::F64,
            _ => return None,
        })
    }

    /// Bytes of one.
    pub fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// The numbers that bytes hold; what is left over at the end is not one.
    pub fn values(self, bytes: &[u8], little_endian: bool) -> Vec<f64> {
        let number = |chunk: &[u8]| {
            let mut word = [0u8; 8];
            let word = &mut word[..chunk.len()];
            word.copy_from_slice(chunk);
            if !little_endian {
                word.reverse();
            }
            let bits = word.iter().rev().fold(0u64, |bits, byte| bits << 8 | u64::from(*byte));
            // Whole numbers of a file that names particles are far below 2⁵³.
            match self {
                Self::I8 => f64::from(bits as i8),
                Self::I16 => f64::from(bits as i16),
                Self::I32 => f64::from(bits as i32),
                Self::I64 => bits as i64 as f64,
                Self::U8 | Self::U16 | Self::U32 | Self::U64 => bits as f64,
                Self::F32 => f64::from(f32::from_bits(bits as u32)),
                Self::F64 => f64::from_bits(bits),
            }
        };
        bytes.chunks_exact(self.bytes()).map(number).collect()
    }
}
