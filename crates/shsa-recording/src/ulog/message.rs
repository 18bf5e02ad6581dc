//! The messages of a ULog: their kinds, and which bytes can be one.

use super::super::record::array;
use super::Log;

/// The length of a message's header: the length (2 bytes) and the kind.
pub(super) const HEADER: usize = 3;

/// The content of a sync message (kind `S`).
const SYNC: [u8; 8] = [0x2f, 0x73, 0x13, 0x20, 0x25, 0x0c, 0xbb, 0x12];

/// The longest message other than data that is accepted while the reader is out of step.
const LIKELY_MAX: usize = 1 << 13;

/// How many messages must follow each other for the reader to be in step again.
const CHAIN: usize = 3;

/// How many messages in a row may be of unknown content.
const DOUBTS: usize = 64;

/// The bytes that [`Log::is_way`] needs.
pub(super) const CHAIN_BYTES: usize = CHAIN * (HEADER + 0xffff);

/// The reading of the next bytes as a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reading {
    /// A message of this many bytes with its header.
    Sound(usize),
    /// A message of an unknown kind, or one of a known kind whose definition is lost, of this many bytes.
    Doubtful(usize),
    /// No message begins here.
    Wrong,
    /// The file ends within the message.
    Cut,
}

impl Log {
    /// Reads the next bytes as a message.
    pub(super) fn reading(&self, ahead: &[u8]) -> Reading {
        let (Some(size), Some(kind)) = (array(ahead, 0), ahead.get(2)) else { return Reading::Cut };
        let length = HEADER + usize::from(u16::from_le_bytes(size));
        match ahead.get(HEADER..length) {
            Some(content) if self.is_sound(*kind, content) => Reading::Sound(length),
            Some(_) if kind.is_ascii_alphabetic() && length > HEADER => Reading::Doubtful(length),
            Some(_) => Reading::Wrong,
            None if self.can_begin(*kind, length) => Reading::Cut,
            None => Reading::Wrong,
        }
    }

    /// Whether this many messages follow each other from here on, or the file ends with them.
    fn is_way(&self, mut ahead: &[u8], count: usize) -> bool {
        for _ in 0..count {
            if ahead.is_empty() {
                return true;
            }
            match self.reading(ahead) {
                Reading::Sound(length) => ahead = ahead.get(length..).unwrap_or_default(),
                Reading::Cut => return true,
                Reading::Doubtful(_) | Reading::Wrong => return false,
            }
        }
        true
    }

    /// Whether a known message follows, or some unknown ones and then a known one.
    pub(super) fn leads_to_way(&self, mut ahead: &[u8]) -> bool {
        for _ in 0..DOUBTS {
            match self.reading(ahead) {
                Reading::Doubtful(length) => ahead = ahead.get(length..).unwrap_or_default(),
                Reading::Sound(_) | Reading::Cut => return true,
                Reading::Wrong => return false,
            }
        }
        false
    }

    /// The first of the next `searched` bytes at which the reader is in step again.
    pub(super) fn way_in(&self, ahead: &[u8], searched: usize) -> Option<usize> {
        (0..searched).find(|at| {
            let rest = ahead.get(*at..).unwrap_or_default();
            matches!(self.reading(rest), Reading::Sound(_)) && self.is_way(rest, CHAIN)
        })
    }

    /// Whether a message of this kind can have this content.
    fn is_sound(&self, kind: u8, content: &[u8]) -> bool {
        let length = content.len();
        match kind {
            b'D' => {
                let id = array(content, 0).map(u16::from_le_bytes);
                let topic = id.and_then(|id| self.subscriptions.get(&id));
                topic.is_some_and(|it| (it.layout.size_min..=it.layout.size).contains(&(length - 2)))
            }
            b'S' => content == SYNC,
            b'O' | b'R' => length == 2,
            b'B' => length >= 40,
            b'L' => length >= 9 && is_level(content.first()),
            b'C' => length >= 11 && is_level(content.first()),
            b'A' => length > 3 && length < 256 && is_text(content.get(3..)),
            b'F' => length > 3 && is_text(Some(content)) && content.contains(&b':'),
            b'I' | b'P' => is_key(content),
            b'M' | b'Q' => is_key(content.get(1..).unwrap_or_default()),
            _ => false,
        }
    }

    /// Whether a message of this kind can have this length.
    fn can_begin(&self, kind: u8, length: usize) -> bool {
        match kind {
            b'D' => length > HEADER + 2,
            b'F' | b'I' | b'M' | b'P' | b'Q' | b'A' | b'L' | b'C' => {
                length > HEADER + 2 && length < LIKELY_MAX
            }
            b'S' => length == HEADER + 8,
            b'O' | b'R' => length == HEADER + 2,
            _ => false,
        }
    }
}

/// Whether a level is one of syslog's, as a digit.
fn is_level(level: Option<&u8>) -> bool {
    level.is_some_and(|level| (b'0'..=b'7').contains(level))
}

fn is_text(bytes: Option<&[u8]>) -> bool {
    bytes.is_some_and(|bytes| bytes.iter().all(|byte| (b' '..0x7f).contains(byte)))
}

/// Whether the content begins with a length, a key `float MC_ROLL_P`, and a value.
fn is_key(content: &[u8]) -> bool {
    let Some((length, rest)) = content.split_first() else { return false };
    let key = rest.get(..usize::from(*length));
    is_text(key) && key.is_some_and(|key| key.contains(&b' '))
}
