//! Fields and control messages as bytes.
//!
//! A field travels as two byte strings: the *attachment* is a [`FieldMessage`] without values, the *payload* is the
//! values, raw and little-endian. A recorded field is one [`FieldMessage`]: the attachment's bytes followed by the
//! payload's as the packed array of its type. Protobuf concatenates, so nothing is encoded twice.

use std::sync::Arc;

use bytes::{BufMut as _, Bytes};
use prost::{
    Message,
    encoding::{WireType, encode_key, encode_varint},
};

use crate::{Envelope, Field, FieldMessage, MessageError, Port, Support, ValueKind, Values, Version};

/// A field as it came, with its envelope; `same_as` names the version whose values it repeats.
#[derive(Clone, Debug)]
pub struct Received {
    /// Sender and version.
    pub envelope: Envelope,
    /// The field, or `None` where only `same_as` was sent.
    pub field: Option<Field>,
    /// Name of the field.
    pub name: String,
    /// Name, unit, components, kind as announced.
    pub port: Arc<Port>,
    /// What the rows stand on.
    pub support: Support,
    /// The version whose values these are, where they were not sent again.
    pub same_as: Option<Version>,
}

/// The attachment of `field`: everything but the values.
#[must_use]
pub fn field_attachment(envelope: &Envelope, field: &Field, same_as: Option<Version>) -> Vec<u8> {
    header(envelope, &field.port, &field.support, same_as)
}

/// The attachment of a field as it came, to send it on.
#[must_use]
pub fn received_attachment(received: &Received) -> Vec<u8> {
    header(&received.envelope, &received.port, &received.support, received.same_as)
}

fn header(envelope: &Envelope, port: &Port, support: &Support, same_as: Option<Version>) -> Vec<u8> {
    let (port, support) = (Some(port.clone()), Some(support.clone()));
    FieldMessage { envelope: Some(envelope.clone()), port, support, same_as, ..FieldMessage::default() }.encode_to_vec()
}

/// Decodes a field from its attachment and payload; the payload's bytes are kept, not copied, where aligned.
///
/// # Errors
/// The attachment is malformed or incomplete, or the payload does not fill the announced shape.
pub fn decode_field(attachment: &[u8], payload: Bytes) -> Result<Received, MessageError> {
    let header = decode::<FieldMessage>("field", attachment)?;
    received(header, |kind| Values::from_bytes(kind, payload))
}

/// The recorded form of a field, from its attachment and payload.
#[must_use]
pub fn field_record(attachment: &[u8], kind: ValueKind, payload: &[u8]) -> Vec<u8> {
    // Tags of the packed arrays in field.proto.
    let tag = match kind {
        ValueKind::F64 => 13,
        ValueKind::U32 => 14,
        ValueKind::U8 | ValueKind::Unspecified => 15,
    };
    let mut record = Vec::with_capacity(attachment.len() + payload.len() + 12);
    record.put_slice(attachment);
    if !payload.is_empty() {
        encode_key(tag, WireType::LengthDelimited, &mut record);
        encode_varint(payload.len() as u64, &mut record);
        record.put_slice(payload);
    }
    record
}

/// Decodes a recorded field.
///
/// # Errors
/// The record is malformed or incomplete, or its values do not fill the announced shape.
pub fn decode_field_record(record: &[u8]) -> Result<Received, MessageError> {
    field_of(decode::<FieldMessage>("field", record)?)
}

/// A field with its values as one message, as it stands in a [`crate::Snapshot`].
#[must_use]
pub fn field_message(envelope: &Envelope, field: &Field) -> FieldMessage {
    let mut message = FieldMessage {
        envelope: Some(envelope.clone()),
        port: Some(Port::clone(&field.port)),
        support: Some(field.support.clone()),
        ..FieldMessage::default()
    };
    match (field.f64(), field.u32(), field.u8()) {
        (Ok(values), ..) => message.f64 = values.to_vec(),
        (_, Ok(values), _) => message.u32 = values.to_vec(),
        (.., Ok(values)) => message.u8 = values.to_vec(),
        _ => {}
    }
    message
}

/// The field of such a message.
///
/// # Errors
/// The message is incomplete, or its values do not fill the announced shape.
pub fn field_of(mut message: FieldMessage) -> Result<Received, MessageError> {
    let (doubles, words) = (std::mem::take(&mut message.f64), std::mem::take(&mut message.u32));
    let octets = std::mem::take(&mut message.u8);
    received(message, |kind| match kind {
        ValueKind::F64 => doubles.into(),
        ValueKind::U32 => words.into(),
        ValueKind::U8 | ValueKind::Unspecified => octets.into(),
    })
}

fn received(message: FieldMessage, values: impl FnOnce(ValueKind) -> Values) -> Result<Received, MessageError> {
    let missing = |part| MessageError::Missing { what: "field", part };
    let port = message.port.ok_or_else(|| missing("port"))?;
    let envelope = message.envelope.ok_or_else(|| missing("envelope"))?;
    envelope.version.ok_or_else(|| missing("version"))?;
    let support: Support = message.support.ok_or_else(|| missing("support"))?;
    let name = port.field.clone();
    let port = Arc::new(port);
    let field = match message.same_as {
        Some(_) => None,
        None => Some(Field::with_support(Arc::clone(&port), support.clone(), values(port.kind()))?),
    };
    Ok(Received { envelope, field, name, port, support, same_as: message.same_as })
}

/// Decodes a control message; `what` names its type in the error.
///
/// # Errors
/// The bytes are malformed.
pub fn decode<M: Message + Default>(what: &'static str, bytes: &[u8]) -> Result<M, MessageError> {
    M::decode(bytes).map_err(|source| MessageError::Malformed { what, source })
}

/// xxh3 of some bytes: what names a scene in a manifest and a set of final fields in a summary.
#[must_use]
pub fn hash(bytes: &[u8]) -> u64 {
    xxhash_rust::xxh3::xxh3_64(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Measure, SCHEMA_VERSION};

    fn envelope() -> Envelope {
        Envelope {
            run: "r".into(),
            schema: SCHEMA_VERSION,
            version: Some(Version { step: 3, attempt: 1, iteration: 2 }),
            ..Envelope::default()
        }
    }

    #[test]
    fn wire_and_record_hold_the_same_values_bit_for_bit() {
        let port = Arc::new(Port::f64("temperature", "K", "particles", 1, Measure::Magnitude));
        let values = vec![300.0, f64::MIN_POSITIVE, -0.0, 1e300];
        let field = Field::new(&port, 4, values).unwrap();
        let attachment = field_attachment(&envelope(), &field, None);
        let wire = decode_field(&attachment, field.values().bytes().clone()).unwrap();
        let record = field_record(&attachment, ValueKind::F64, field.values().bytes());
        let recorded = decode_field_record(&record).unwrap();
        assert_eq!(wire.field.unwrap().values().bytes(), field.values().bytes());
        assert_eq!(recorded.field.unwrap().values().bytes(), field.values().bytes());
        assert_eq!(recorded.envelope, envelope());
        assert_eq!(FieldMessage::decode(record.as_slice()).unwrap().f64[3], 1e300);
    }

    #[test]
    fn indices_are_fixed_width_in_a_record() {
        let port = Arc::new(Port::u32("contact_pairs", "contacts", 2));
        let field = Field::new(&port, 0, vec![0u32, 70_000, 5, 6]).unwrap();
        let attachment = field_attachment(&envelope(), &field, None);
        let record = field_record(&attachment, ValueKind::U32, field.values().bytes());
        assert_eq!(decode_field_record(&record).unwrap().field.unwrap().u32().unwrap(), [0, 70_000, 5, 6]);
    }

    #[test]
    fn a_short_payload_is_refused_with_the_numbers() {
        let port = Arc::new(Port::f64("temperature", "K", "particles", 1, Measure::Magnitude));
        let field = Field::new(&port, 0, vec![1.0, 2.0]).unwrap();
        let attachment = field_attachment(&envelope(), &field, None);
        let error = decode_field(&attachment, field.values().bytes().slice(..8)).unwrap_err();
        assert!(error.to_string().contains("take 16 bytes, but 8 came"), "{error}");
    }

    #[test]
    fn every_byte_string_is_refused_or_decoded_without_a_panic() {
        for length in 0..64 {
            let noise: Vec<u8> = (0..length).map(|i: u32| (i.wrapping_mul(151) >> 1) as u8).collect();
            let _ = decode_field(&noise, Bytes::from(noise.clone()));
            let _ = decode_field_record(&noise);
        }
    }
}
