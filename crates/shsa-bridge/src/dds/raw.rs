//! Messages as RustDDS takes and gives them: their bytes with the header of CDR, which it keeps apart from the content.

use bytes::Bytes;
use rustdds::RepresentationIdentifier;
use rustdds::no_key::{Decode, DefaultDecoder, DeserializerAdapter, SerializerAdapter};
use std::convert::Infallible;

/// The length of the header.
const HEADER: usize = 4;

/// The adapter of whole messages.
pub(super) struct Raw;

/// The decoder of whole messages.
#[derive(Clone)]
pub(super) struct Whole;

impl<'de> Decode<'de, Bytes> for Whole {
    type Error = Infallible;

    fn decode_bytes(
        self,
        content: &'de [u8],
        encoding: RepresentationIdentifier,
    ) -> Result<Bytes, Infallible> {
        let is_little = u8::from(encoding == RepresentationIdentifier::CDR_LE);
        Ok([&[0, is_little, 0, 0], content].concat().into())
    }
}

impl DeserializerAdapter<Bytes> for Raw {
    type Error = Infallible;
    type Decoded = Bytes;

    fn supported_encodings() -> &'static [RepresentationIdentifier] {
        &[RepresentationIdentifier::CDR_LE, RepresentationIdentifier::CDR_BE]
    }

    fn transform_decoded(message: Bytes) -> Bytes {
        message
    }
}

impl DefaultDecoder<Bytes> for Raw {
    type Decoder = Whole;
    const DECODER: Whole = Whole;
}

impl SerializerAdapter<Bytes> for Raw {
    type Error = Infallible;

    fn output_encoding() -> RepresentationIdentifier {
        RepresentationIdentifier::CDR_LE
    }

    /// A message is [checked](is_sendable) before.
    fn to_bytes(message: &Bytes) -> Result<Bytes, Infallible> {
        Ok(message.slice(HEADER.min(message.len())..))
    }
}

/// Whether a message has the byte order in which all are sent.
pub(super) fn is_sendable(message: &[u8]) -> bool {
    message.starts_with(&[0, 1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_is_received_as_it_was_sent() {
        let message = Bytes::from_static(&[0, 1, 0, 0, 5, 6, 7]);
        let content = Raw::to_bytes(&message).unwrap();
        assert_eq!(content, [5, 6, 7].as_slice());
        assert_eq!(Whole.decode_bytes(&content, RepresentationIdentifier::CDR_LE), Ok(message));
        let other = Whole.decode_bytes(&content, RepresentationIdentifier::CDR_BE).unwrap();
        assert!(!is_sendable(&other) && other.starts_with(&[0, 0, 0, 0]), "{other:?}");
        assert_eq!(Raw::to_bytes(&Bytes::from_static(&[0, 1])).unwrap(), Bytes::new());
    }
}
