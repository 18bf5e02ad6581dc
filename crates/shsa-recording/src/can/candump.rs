//! The output of Linux's `candump`: with `-L` (or `-l`) `(1410714882.622188) can0 0DF50B23#A1B2`, with `-ta` `(1410714882.622188)
//! can0  0DF50B23   [2]  A1 B2`.

use super::super::lines::{self, Lines};
use super::super::topic::{Input, Listener};
use super::super::{Place, ReadOptions, RecordingError};
use super::bus::{Bus, Frame};
use super::dbc::EXTENDED;
use shsa_core::time::{Span, Time};
use shsa_message::stamp::decimal;

/// The longest data of a frame of CAN FD; CAN XL has more and is not read.
const DATA_MAX: usize = 64;

/// The bit of an identifier that marks an error frame.
const ERROR: u32 = 1 << 29;

/// Whether a text begins as these files do, after comments.
pub(in super::super) fn is_log(head: &[u8]) -> bool {
    let text = String::from_utf8_lossy(head);
    let mut lines = lines::of(&text).filter(|line| !line.starts_with('#'));
    lines.next().is_some_and(|line| matches!(parsed(line), Ok(Some(_))))
}

/// The content of a line.
struct Parsed<'a> {
    time: Time,
    channel: &'a str,
    id: u32,
    data: [u8; DATA_MAX],
    length: usize,
    has_data: bool,
}

/// Reads all frames.
pub(in super::super) fn read(
    input: &mut dyn Input,
    options: &ReadOptions,
    listener: &mut dyn Listener,
) -> Result<(), RecordingError> {
    let mut bus = Bus::new(options, listener)?;
    let mut lines = Lines::new(input);
    while let Some(line) = lines.next(listener) {
        match parsed(&line.text) {
            Ok(Some(frame)) if frame.has_data => {
                let Parsed { time, channel, id, ref data, length, .. } = frame;
                let data = data.get(..length).unwrap_or_default();
                bus.report(&Frame { time, channel, id, data }, listener);
            }
            Ok(Some(_)) => bus.pass(),
            Ok(None) => {}
            Err(_) if !line.is_ended => {
                listener.damaged(
                    Place::Line(line.number),
                    "the file ends within this line; line left out".into(),
                );
            }
            Err(problem) => listener.damaged(Place::Line(line.number), format!("{problem}; line left out")),
        }
    }
    bus.finish(listener);
    Ok(())
}

/// The content of a line; `None` for a blank line or a comment.
fn parsed(line: &str) -> Result<Option<Parsed<'_>>, String> {
    let line = line.trim();
    if line.is_empty() || line.starts_with('#') {
        return Ok(None);
    }
    let (time, rest) =
        line.strip_prefix('(').and_then(|rest| rest.split_once(')')).ok_or("no time in parentheses")?;
    let time =
        decimal(time.trim(), Span::from_millis(1_000)).ok_or_else(|| format!("'{time}' is no time"))?;
    let (channel, rest) = rest.trim_start().split_once(char::is_whitespace).ok_or("no channel")?;
    let rest = rest.trim_start();
    let (id, content) = match rest.split_once('#') {
        Some((id, content)) => (id, content),
        None => rest.split_once(char::is_whitespace).ok_or("no frame")?,
    };
    let id = identifier(id)?;
    let has_data = id & ERROR == 0;
    let mut parsed = Parsed { time, channel, id, data: [0; DATA_MAX], length: 0, has_data };
    parsed.take(content)?;
    Ok(Some(parsed))
}

/// The identifier: three digits for 11 bits, eight for 29.
fn identifier(text: &str) -> Result<u32, String> {
    let is_hex = text.bytes().all(|byte| byte.is_ascii_hexdigit());
    let id = u32::from_str_radix(text, 16)
        .ok()
        .filter(|id| is_hex && matches!(text.len(), 3 | 8) && *id < 1 << 30);
    let id = id.ok_or_else(|| format!("'{text}' is no identifier of three or eight digits"))?;
    Ok(if text.len() == 8 { id | EXTENDED } else { id })
}

impl Parsed<'_> {
    /// The data after the identifier: `A1B2`, `A1.B2`, `#1A1B2` (FD, with flags), `R` (a remote frame), `[2] A1 B2`, `[4] remote request`. The rest of
    /// the line (`R` received, `T` sent, the data as text) is ignored.
    fn take(&mut self, content: &str) -> Result<(), String> {
        if let Some(listed) = content.trim_start().strip_prefix('[') {
            let (length, bytes) = listed.split_once(']').ok_or("no length in brackets")?;
            if bytes.trim_start().starts_with("remote") {
                self.has_data = false;
                return Ok(());
            }
            let length: usize = length.trim().parse().map_err(|_| format!("'{length}' is no length"))?;
            return bytes.split_whitespace().take(length).try_for_each(|byte| self.hexadecimal(byte));
        }
        // A frame of no bytes has a blank behind the `#`.
        let digits = content.split(char::is_whitespace).next().unwrap_or("");
        if digits.starts_with('R') {
            self.has_data = false;
            return Ok(());
        }
        // The digit after the second `#` has the FD flags; `_D` at the end is the requested length.
        let digits = digits.strip_prefix('#').map_or(digits, |flagged| flagged.get(1..).unwrap_or(""));
        let digits = digits.split('_').next().unwrap_or("");
        digits.split('.').try_for_each(|part| self.hexadecimal(part))
    }

    fn hexadecimal(&mut self, digits: &str) -> Result<(), String> {
        let digit = |byte: u8| char::from(byte).to_digit(16).and_then(|digit| u8::try_from(digit).ok());
        let (pairs, rest) = digits.as_bytes().as_chunks::<2>();
        for [high, low] in pairs {
            let byte = digit(*high).zip(digit(*low)).map(|(high, low)| high << 4 | low);
            let byte = byte.ok_or_else(|| "the data are no hexadecimal digits".to_owned())?;
            *self.data.get_mut(self.length).ok_or("more than 64 bytes of data")? = byte;
            self.length += 1;
        }
        if rest.is_empty() { Ok(()) } else { Err("the data have an odd number of digits".into()) }
    }
}
