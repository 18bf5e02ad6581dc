//! The message templates of sources, in `FOLDER/MODEL.patterns.json`. After a restart, a silenced source does not publish a
//! message that could be copied.

use serde_json::{Map, Value, json};
use shsa_bridge::{Message, Payload};
use shsa_core::time::Time;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::{fs, io};

/// The file of one model.
#[derive(Debug)]
pub(in super::super) struct Patterns {
    path: PathBuf,
    known: Map<String, Value>,
}

impl Patterns {
    /// Opens the file of a model; an unreadable file counts as empty.
    pub(in super::super) fn open(folder: &Path, model: &str) -> Patterns {
        let path = folder.join(format!("{model}.patterns.json"));
        let text = fs::read_to_string(&path).unwrap_or_default();
        Patterns { path, known: serde_json::from_str(&text).unwrap_or_default() }
    }

    /// The message of a signal, if it was received under this topic.
    pub(in super::super) fn message(&self, signal: &str, topic: &str) -> Option<Message> {
        let known = self.known.get(signal).filter(|known| known["topic"] == topic)?;
        let payload = Payload::Bytes(from_hex(known["payload"].as_str()?)?.into());
        let message_type = known["type"].as_str().map(Into::into);
        Some(Message { message_type, ..Message::new(topic.into(), Time(0), payload) })
    }

    /// Keeps the message of a signal.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub(in super::super) fn keep(&mut self, signal: &str, message: &Message) -> io::Result<()> {
        let Payload::Bytes(bytes) = &message.payload else { return Ok(()) };
        let kept = json!({ "topic": &*message.topic, "type": message.message_type.as_deref(), "payload": hex(bytes) });
        self.known.insert(signal.to_owned(), kept);
        let beside = self.path.with_extension("json.new");
        fs::write(&beside, Value::Object(self.known.clone()).to_string())?;
        fs::rename(&beside, &self.path)
    }
}

fn hex(bytes: &[u8]) -> String {
    let mut text = String::with_capacity(bytes.len() * 2);
    for byte in bytes {
        let _cannot_fail = write!(text, "{byte:02x}");
    }
    text
}

fn from_hex(text: &str) -> Option<Vec<u8>> {
    let (pairs, rest) = text.as_bytes().as_chunks::<2>();
    let byte = |pair: &[u8; 2]| u8::from_str_radix(std::str::from_utf8(pair).ok()?, 16).ok();
    rest.is_empty().then(|| pairs.iter().map(byte).collect())?
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_kept_is_known_after_a_restart() {
        let folder = std::env::temp_dir().join(format!("shsa-patterns-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let payload = Payload::Bytes(vec![0, 1, 0xab, 255].into());
        let message = Message {
            message_type: Some("std_msgs/msg/Float64".into()),
            ..Message::new("/a".into(), Time(0), payload)
        };
        let mut patterns = Patterns::open(&folder, "car");
        assert_eq!(patterns.message("wheel", "/a"), None);
        patterns.keep("wheel", &message).unwrap();
        let again = Patterns::open(&folder, "car");
        assert_eq!(again.message("wheel", "/a"), Some(message));
        assert_eq!(again.message("wheel", "/b"), None, "the source has moved");
        assert_eq!(from_hex("0g"), None);
        assert_eq!(from_hex("012"), None);
        fs::remove_dir_all(&folder).unwrap();
    }
}
