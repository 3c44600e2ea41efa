//! A field: values of one port on one support at one version, as they go from node to node.

use std::{collections::BTreeMap, sync::Arc};

use bytes::Bytes;

use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error as _};

use crate::{Envelope, MessageError, Port, Support, ValueKind, Version, codec};

// Values are cast, not converted; a big-endian machine would need a conversion here.
const _: () = assert!(cfg!(target_endian = "little"));

/// Values of a field: contiguous, little-endian, shared without copying.
///
/// The bytes are aligned for their type whatever they came from: a buffer that is not is copied once.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Values {
    kind: ValueKind,
    bytes: Bytes,
}

struct Owner<T>(Vec<T>);

impl<T: bytemuck::NoUninit> AsRef<[u8]> for Owner<T> {
    fn as_ref(&self) -> &[u8] {
        bytemuck::cast_slice(&self.0)
    }
}

impl From<Vec<f64>> for Values {
    fn from(values: Vec<f64>) -> Self {
        Self { kind: ValueKind::F64, bytes: Bytes::from_owner(Owner(values)) }
    }
}

impl From<Vec<u32>> for Values {
    fn from(values: Vec<u32>) -> Self {
        Self { kind: ValueKind::U32, bytes: Bytes::from_owner(Owner(values)) }
    }
}

impl From<Vec<u8>> for Values {
    fn from(values: Vec<u8>) -> Self {
        Self { kind: ValueKind::U8, bytes: Bytes::from(values) }
    }
}

impl Values {
    /// Takes raw little-endian bytes; copies them only where they are not aligned for `kind`.
    #[must_use]
    pub fn from_bytes(kind: ValueKind, bytes: Bytes) -> Self {
        let aligned = match kind {
            ValueKind::F64 => bytemuck::try_cast_slice::<u8, f64>(&bytes).is_ok() || !bytes.len().is_multiple_of(8),
            ValueKind::U32 => bytemuck::try_cast_slice::<u8, u32>(&bytes).is_ok() || !bytes.len().is_multiple_of(4),
            ValueKind::U8 | ValueKind::Unspecified => true,
        };
        match kind {
            ValueKind::F64 if !aligned => bytemuck::allocation::pod_collect_to_vec::<u8, f64>(&bytes).into(),
            ValueKind::U32 if !aligned => bytemuck::allocation::pod_collect_to_vec::<u8, u32>(&bytes).into(),
            _ => Self { kind, bytes },
        }
    }

    /// Type of the values.
    #[must_use]
    pub fn kind(&self) -> ValueKind {
        self.kind
    }

    /// The raw little-endian bytes.
    #[must_use]
    pub fn bytes(&self) -> &Bytes {
        &self.bytes
    }
}

/// A named quantity on a support: what one physics computes and others read.
///
/// Cloning shares the values. Rows stand on [`Support::count`] items, each with [`Port::components`] values.
#[derive(Clone, Debug, PartialEq)]
pub struct Field {
    /// Name, unit, components, kind.
    pub port: Arc<Port>,
    /// What the rows stand on.
    pub support: Support,
    /// The values, row by row.
    values: Values,
}

/// As the bytes of its recorded form, so that a state that holds fields can be encoded.
impl Serialize for Field {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let attachment =
            codec::field_attachment(&Envelope { version: Some(Version::INITIAL), ..Envelope::default() }, self, None);
        serializer.serialize_bytes(&codec::field_record(&attachment, self.port.kind(), self.values.bytes()))
    }
}

impl<'de> Deserialize<'de> for Field {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let record = <&[u8]>::deserialize(deserializer)?;
        let received = codec::decode_field_record(record).map_err(D::Error::custom)?;
        received.field.ok_or_else(|| D::Error::custom("a field without values"))
    }
}

/// Fields by name, in a fixed order.
pub type Fields = BTreeMap<String, Field>;

impl Field {
    /// Puts `values` on the support of `port`: `values.len() / components` rows at `revision`.
    ///
    /// # Errors
    /// The values do not fill whole rows, or are of another type than the port says.
    pub fn new(port: &Arc<Port>, revision: u64, values: impl Into<Values>) -> Result<Self, MessageError> {
        let values = values.into();
        let row = port.kind().bytes() * port.components as usize;
        let count = values.bytes.len().checked_div(row).unwrap_or(0) as u64;
        let support = Support { name: port.support.clone(), count, revision };
        Self::with_support(Arc::clone(port), support, values)
    }

    /// Puts `values` on `support`.
    ///
    /// # Errors
    /// The values do not fill the support's rows, or are of another type than the port says.
    pub fn with_support(port: Arc<Port>, support: Support, values: Values) -> Result<Self, MessageError> {
        if values.kind != port.kind() {
            return Err(MessageError::Kind { field: port.field.clone(), expected: port.kind(), found: values.kind });
        }
        let row = port.kind().bytes() * port.components as usize;
        let expected = usize::try_from(support.count).ok().and_then(|count| count.checked_mul(row));
        if expected != Some(values.bytes.len()) {
            return Err(MessageError::Length {
                field: port.field.clone(),
                rows: support.count,
                components: port.components,
                kind: port.kind(),
                expected: expected.unwrap_or(usize::MAX),
                found: values.bytes.len(),
            });
        }
        Ok(Self { port, support, values })
    }

    /// Name of the field.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.port.field
    }

    /// Number of rows.
    #[must_use]
    pub fn rows(&self) -> usize {
        let row = self.port.kind().bytes() * self.port.components as usize;
        self.values.bytes.len().checked_div(row).unwrap_or(0)
    }

    /// Values per row.
    #[must_use]
    pub fn components(&self) -> usize {
        self.port.components as usize
    }

    /// The values with their type.
    #[must_use]
    pub fn values(&self) -> &Values {
        &self.values
    }

    /// The values of an [`ValueKind::F64`] field, row by row.
    ///
    /// # Errors
    /// The field holds another type.
    pub fn f64(&self) -> Result<&[f64], MessageError> {
        self.cast(ValueKind::F64)
    }

    /// The values of a [`ValueKind::U32`] field, row by row.
    ///
    /// # Errors
    /// The field holds another type.
    pub fn u32(&self) -> Result<&[u32], MessageError> {
        self.cast(ValueKind::U32)
    }

    /// The values of a [`ValueKind::U8`] field, row by row.
    ///
    /// # Errors
    /// The field holds another type.
    pub fn u8(&self) -> Result<&[u8], MessageError> {
        self.cast(ValueKind::U8)
    }

    fn cast<T: bytemuck::AnyBitPattern>(&self, expected: ValueKind) -> Result<&[T], MessageError> {
        bytemuck::try_cast_slice(&self.values.bytes)
            .ok()
            .filter(|_| self.values.kind == expected)
            .ok_or_else(|| MessageError::Kind { field: self.port.field.clone(), expected, found: self.values.kind })
    }

    /// Index of the first value that is not finite; `None` where all are, or where the values are no floats.
    #[must_use]
    pub fn first_not_finite(&self) -> Option<usize> {
        let values = self.f64().ok()?;
        // Whole blocks without a branch per value: this runs on every reply.
        let block = values.chunks(512).position(|block| block.iter().fold(false, |bad, v| bad | !v.is_finite()))?;
        let start = block * 512;
        values[start..].iter().position(|value| !value.is_finite()).map(|offset| start + offset)
    }

    /// xxh3 of the values' bytes.
    #[must_use]
    pub fn hash(&self) -> u64 {
        xxhash_rust::xxh3::xxh3_64(&self.values.bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Measure;

    fn port(components: u32) -> Arc<Port> {
        Arc::new(Port::f64("positions", "m", "particles", components, Measure::Increment))
    }

    #[test]
    fn values_are_shared_not_copied() {
        let field = Field::new(&port(3), 0, vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0]).unwrap();
        let clone = field.clone();
        assert_eq!(field.f64().unwrap().as_ptr(), clone.f64().unwrap().as_ptr());
        assert_eq!(field.rows(), 2);
    }

    #[test]
    fn unaligned_bytes_are_copied_once_and_read_the_same() {
        let mut raw = vec![0u8; 1];
        raw.extend_from_slice(bytemuck::cast_slice(&[1.5f64, -2.5]));
        let shifted = Bytes::from(raw).slice(1..);
        let values = Values::from_bytes(ValueKind::F64, shifted);
        let field = Field::new(&port(1), 0, values).unwrap();
        assert_eq!(field.f64().unwrap(), [1.5, -2.5]);
    }

    #[test]
    fn rows_must_be_whole_and_of_the_announced_type() {
        assert!(matches!(Field::new(&port(3), 0, vec![1.0, 2.0]), Err(MessageError::Length { .. })));
        assert!(matches!(Field::new(&port(1), 0, vec![1u32]), Err(MessageError::Kind { .. })));
    }
}
