//! ASC, the text form of Vector's tools: a head with a date, then one line for each frame, with seconds since that date.

use super::super::lines::{self, Lines};
use super::super::stamp::of_place;
use super::super::topic::{Input, Listener};
use super::super::{Place, ReadOptions, RecordingError};
use super::NO_DATE;
use super::bus::{Bus, Frame};
use super::dbc::EXTENDED;
use shsa_core::time::{Span, Time};
use shsa_message::stamp::{civil, decimal};
use shsa_message::zone::Zone;

const SECOND: Span = Span::from_millis(1_000);

/// The lengths of CAN FD frames that no code of four bits can be.
const LENGTHS_FD: [usize; 7] = [12, 16, 20, 24, 32, 48, 64];

/// Names of months in English and German, by their first three letters.
const MONTHS: [&[&str]; 12] = [
    &["jan"],
    &["feb"],
    &["mar", "mär", "mrz"],
    &["apr"],
    &["may", "mai"],
    &["jun"],
    &["jul"],
    &["aug"],
    &["sep"],
    &["oct", "okt"],
    &["nov"],
    &["dec", "dez"],
];

/// Whether a text begins as an ASC file does.
pub(in super::super) fn is_log(head: &[u8]) -> bool {
    let is_likely = |line: &[u8]| line.get(..5).is_some_and(|begin| begin.eq_ignore_ascii_case(b"date "));
    if !head.split(|byte| matches!(byte, b'\n' | b'\r')).any(|line| is_likely(line.trim_ascii_start())) {
        return false;
    }
    let text = String::from_utf8_lossy(head).to_lowercase();
    let mut lines = lines::of(&text);
    let first = lines.next().unwrap_or_default();
    first.starts_with("date ") && lines.next().unwrap_or_default().starts_with("base ")
}

/// The content of the head.
struct Head {
    /// The date from which times count; the boot of the recorder where the head has no date.
    start: Option<Time>,
    is_decimal: bool,
    /// Each time counts from the one before.
    is_relative: bool,
    last: Time,
    /// The note about that date.
    said: Option<String>,
}

/// A frame, as its line gives it.
struct Line<'a> {
    time: Time,
    channel: &'a str,
    id: u32,
    data: Vec<u8>,
}

/// Reads all frames.
pub(in super::super) fn read(
    input: &mut dyn Input,
    options: &ReadOptions,
    listener: &mut dyn Listener,
) -> Result<(), RecordingError> {
    let mut bus = Bus::new(options, listener)?;
    let mut head =
        Head { start: None, is_decimal: false, is_relative: false, last: Time::default(), said: None };
    let mut lines = Lines::new(input);
    while let Some(line) = lines.next(listener) {
        let text = line.text.trim();
        if !text.starts_with(|first: char| first.is_ascii_digit()) {
            head.line(text, &options.zone);
            continue;
        }
        match head.frame(text) {
            Some(Ok(Line { time, channel, id, data })) => {
                bus.report(&Frame { time, channel, id, data: &data }, listener);
            }
            Some(Err(_)) if !line.is_ended => {
                listener.damaged(
                    Place::Line(line.number),
                    "the file ends within this line; line left out".into(),
                );
            }
            Some(Err(problem)) => {
                listener.damaged(Place::Line(line.number), format!("{problem}; line left out"))
            }
            None => {}
        }
    }
    let said = if head.start.is_none() { Some(NO_DATE.to_owned()) } else { head.said };
    said.into_iter().for_each(|said| listener.note(Place::Whole, said));
    bus.finish(listener);
    Ok(())
}

impl Head {
    /// Reads a line after the head.
    fn line(&mut self, text: &str, zone: &Zone) {
        let small = text.to_lowercase();
        let words: Vec<&str> = small.split_whitespace().collect();
        match words.as_slice() {
            ["date", date @ ..] | ["begin", "triggerblock", date @ ..] => {
                if let Some(shown) = moment(date) {
                    let (start, said) = of_place(shown, zone);
                    (self.start, self.last, self.said) = (Some(start), start, said);
                }
            }
            ["base", base, "timestamps", kind, ..] => {
                self.is_decimal = *base == "dec";
                self.is_relative = *kind == "relative";
            }
            _ => {}
        }
    }

    /// `0.0004 1 12 Rx d 6 01 30 68 4F 43 16`; `None` for a line without a frame: events, statistics, errors.
    fn frame<'a>(&mut self, text: &'a str) -> Option<Result<Line<'a>, String>> {
        let mut words = text.split_whitespace();
        let since = decimal(words.next()?, SECOND)?;
        let from = if self.is_relative { self.last } else { self.start.unwrap_or_default() };
        let time = from + (since - Time::default());
        let first = words.next()?;
        self.last = time;
        if first == "CANFD" { self.flexible(words, time) } else { self.classic(first, words, time) }
    }

    /// The words after the channel: identifier, direction, `d`, length, bytes.
    fn classic<'a>(
        &self,
        channel: &'a str,
        mut words: std::str::SplitWhitespace<'a>,
        time: Time,
    ) -> Option<Result<Line<'a>, String>> {
        channel.parse::<u32>().ok()?;
        let id = words.next()?;
        if !is_direction(words.next()?) || words.next()? != "d" {
            return None;
        }
        let length = words.next().and_then(|length| self.length(length, words.clone()));
        let line = self.identifier(id).zip(length).map(|(id, length)| {
            let data = self.bytes(words, length)?;
            Ok(Line { time, channel, id, data })
        });
        Some(line.unwrap_or_else(|| Err("the identifier or the length is no number".into())))
    }

    /// The number of bytes behind the length: up to 8, also where the code of a classic frame is larger, or that of a CAN FD frame.
    fn length<'a>(&self, length: &str, words: impl Iterator<Item = &'a str>) -> Option<usize> {
        let of_base = |base| usize::from_str_radix(length, base).ok();
        let (base, there) = (if self.is_decimal { 10 } else { 16 }, words.count());
        let is_length = |length: &usize| {
            *length <= 8 || LENGTHS_FD.contains(length) && (*length > 15 || there >= *length)
        };
        let found = [base, 16].into_iter().find_map(|base| of_base(base).filter(is_length));
        found.or_else(|| of_base(16).filter(|code| *code <= 15).map(|_| 8))
    }

    /// The words after `CANFD`: channel, direction, identifier, perhaps a name, two flags, a code, the length, bytes.
    fn flexible<'a>(
        &self,
        mut words: std::str::SplitWhitespace<'a>,
        time: Time,
    ) -> Option<Result<Line<'a>, String>> {
        let channel = words.next()?;
        let (first, second) = (words.next()?, words.next()?);
        // Old versions write the direction after the identifier.
        let id = if is_direction(first) { second } else { first };
        let id = self.identifier(id)?;
        let is_flag = |word: &str| matches!(word, "0" | "1");
        let mut flag = words.next()?;
        while !is_flag(flag) {
            flag = words.next()?;
        }
        let (_second_flag, _code) = (words.next()?, words.next()?);
        let Ok(length) = words.next()?.parse::<usize>() else {
            return Some(Err("the length is no number".into()));
        };
        Some(self.bytes(words, length.min(64)).map(|data| Line { time, channel, id, data }))
    }

    fn bytes<'a>(&self, words: impl Iterator<Item = &'a str>, length: usize) -> Result<Vec<u8>, String> {
        let base = if self.is_decimal { 10 } else { 16 };
        let bytes = words.take(length).map(|word| u8::from_str_radix(word, base).ok());
        let bytes: Vec<u8> = bytes.collect::<Option<_>>().ok_or("the data are no bytes")?;
        if bytes.len() < length {
            return Err(format!("the frame has {} of its {length} bytes", bytes.len()));
        }
        Ok(bytes)
    }

    fn identifier(&self, text: &str) -> Option<u32> {
        let base = if self.is_decimal { 10 } else { 16 };
        match text.strip_suffix(['x', 'X']) {
            Some(extended) => u32::from_str_radix(extended, base).ok().map(|id| id | EXTENDED),
            None => u32::from_str_radix(text, base).ok().filter(|id| *id < 1 << 11),
        }
    }
}

fn is_direction(word: &str) -> bool {
    matches!(word, "Rx" | "Tx" | "TxRq")
}

/// `wed jan 11 05:42:09.103 pm 2023`, all in small letters; the day of the week may be missing.
fn moment(words: &[&str]) -> Option<Time> {
    let month_at = words.iter().position(|word| month(word).is_some())?;
    let month = month(words.get(month_at)?)?;
    let [day, clock, rest @ ..] = words.get(month_at + 1..)? else { return None };
    let (is_afternoon, year) = match rest {
        ["am", year] => (Some(false), year),
        ["pm", year] => (Some(true), year),
        [year] => (None, year),
        _ => return None,
    };
    let mut parts = clock.splitn(3, ':');
    let (hour, minute) = (parts.next()?.parse::<i64>().ok()?, parts.next()?.parse::<i64>().ok()?);
    let second = decimal(parts.next().unwrap_or("0"), SECOND)?;
    let hour = match is_afternoon {
        Some(true) if hour < 12 => hour + 12,
        Some(false) if hour == 12 => 0,
        _ => hour,
    };
    let is_clock =
        (0..24).contains(&hour) && (0..60).contains(&minute) && (0..61 * SECOND.0).contains(&second.0);
    let of_day = is_clock.then_some((hour * 3_600 + minute * 60) * SECOND.0 + second.0)?;
    civil(year.parse().ok()?, month, day.parse().ok()?, of_day)
}

fn month(word: &str) -> Option<i64> {
    let names = |names: &&[&str]| names.iter().any(|name| word.starts_with(name));
    let at = MONTHS.iter().position(names).filter(|_| word.parse::<f64>().is_err())?;
    i64::try_from(at + 1).ok()
}
