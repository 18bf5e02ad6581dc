//! Time stamp, publisher and provenance of a message, as a Zenoh attachment.
//!
//! A JSON object, which any client can read without our code; every key is optional:
//!
//! ```json
//! {"stamp_ns": 1700000000000000000, "publisher": "5f1a", "quality": "UncertainSubstituteValue",
//!  "status": 1083244544, "source": "/odom/speed through travelled", "admitted": "met", "level": "SIL 2", "rank": 2}
//! ```
//!
//! `stamp_ns` counts from 1970 by the wall clock, `publisher` is a Zenoh identity in hexadecimal digits, `quality` and
//! `status` are a status code of OPC UA by name and by number. `admitted`, `level` and `rank` are those of an [`Admission`].
//!
//! [`Admission`]: crate::Admission

use crate::{Outgoing, PublisherId, Quality};
use serde::Deserialize;
use shsa_core::time::Time;
use shsa_message::json;
use std::fmt::Write;

/// The bytes of an attachment without the source's name.
const WORDS: usize = 96;
/// Longer attachments are of other programs.
const LENGTH_MAX: usize = 64 << 10;

/// The content of an attachment; empty for attachments of other programs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Beside {
    pub(super) stamp: Option<Time>,
    pub(super) publisher: Option<PublisherId>,
    pub(super) quality: Option<Quality>,
}

#[derive(Deserialize)]
struct Wire<'a> {
    stamp_ns: Option<i64>,
    #[serde(borrow)]
    publisher: Option<&'a str>,
    #[serde(borrow)]
    quality: Option<&'a str>,
}

pub(super) fn write(message: &Outgoing<'_>, publisher: PublisherId) -> Vec<u8> {
    let words = message.provenance.map_or(0, |provenance| provenance.source.len() + 2 * WORDS);
    let mut text = String::with_capacity(words + WORDS);
    // Writing to memory cannot fail.
    let _ = write!(text, r#"{{"stamp_ns":{},"publisher":"{publisher}""#, message.stamp.0);
    if let Some(provenance) = message.provenance {
        let quality = provenance.quality;
        let _ = write!(text, r#","quality":"{quality}","status":{},"source":"#, quality.code());
        json::push_quoted(&provenance.source, &mut text);
        if let Some(admission) = &provenance.admission {
            admission.push_members(&mut text);
        }
    }
    text.push('}');
    text.into_bytes()
}

pub(super) fn read(bytes: &[u8]) -> Beside {
    let wire = Some(bytes).filter(|bytes| bytes.len() <= LENGTH_MAX && bytes.first() == Some(&b'{'));
    let Some(wire) = wire.and_then(|bytes| serde_json::from_slice::<Wire<'_>>(bytes).ok()) else {
        return Beside::default();
    };
    let publisher = wire.publisher.and_then(|digits| u128::from_str_radix(digits, 16).ok());
    Beside {
        stamp: wire.stamp_ns.map(Time),
        publisher: publisher.map(PublisherId),
        quality: wire.quality.and_then(Quality::named),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Admission, Payload, Provenance};
    use shsa_core::assurance::Ground;
    use shsa_core::observation::RawValue;

    #[test]
    fn what_is_written_is_read() {
        let payload = Payload::Value(RawValue::Number(1.0));
        let admission = Some(Admission { ground: Ground::Met, level: Some("SIL 2".to_owned()), rank: 2 });
        let provenance = Provenance { admission, ..Provenance::new(Quality::Substitute, "a \"quoted\" way") };
        let bare = Outgoing::new("x", Time(-5), payload.clone());
        let described =
            Outgoing { provenance: Some(&provenance), ..Outgoing::new("x", Time(i64::MAX), payload) };
        let id = PublisherId(0xabc);
        let beside = |stamp, quality| Beside { stamp: Some(Time(stamp)), publisher: Some(id), quality };
        assert_eq!(read(&write(&bare, id)), beside(-5, None));
        assert_eq!(read(&write(&described, id)), beside(i64::MAX, Some(Quality::Substitute)));
        assert_eq!(
            String::from_utf8(write(&described, id)).unwrap(),
            r#"{"stamp_ns":9223372036854775807,"publisher":"abc","quality":"UncertainSubstituteValue","status":1083244544,"source":"a \"quoted\" way","admitted":"met","level":"SIL 2","rank":2}"#
        );
    }

    #[test]
    fn attachments_of_others_tell_nothing() {
        let long = format!("{{\"stamp_ns\":1,\"x\":\"{}\"}}", "x".repeat(LENGTH_MAX));
        let foreign: [&[u8]; 6] = [b"", b"{", b"[1]", br#"{"stamp_ns":"now"}"#, &[0; 33], long.as_bytes()];
        for bytes in foreign {
            assert_eq!(read(bytes), Beside::default());
        }
        assert_eq!(read(br#"{"quality":"Excellent","other":[1]}"#), Beside::default());
    }
}
