//! The frames between a run and its processes, over two pipes; both sides use this module.
//!
//! A frame is its length in bytes (`u32`) and its content; numbers are little-endian, times nanoseconds, values SI.
//!
//! | first byte | from | content |
//! |---|---|---|
//! | `C` | run | what is to be computed, JSON: [`Order`] |
//! | `P`, `T` | run | a task: number, moment, when the last value was true, inputs; to `P` (the past) no answer is expected |
//! | `R` | process | it is ready |
//! | `E` | process | why it cannot do its work, text |
//! | `A` | process | an answer: number, and validity and value where there is one |

use serde::{Deserialize, Serialize};
use shsa_core::computation::Task;
use shsa_core::engine::PublishedValue;
use shsa_core::interval::Interval;
use shsa_core::time::{Time, Validity};
use std::io::{self, Read, Write};

/// The longest frame, bytes: a task with a depth image of half a million elements has 8 MiB.
const LONGEST: usize = 64 << 20;
/// The largest number of inputs of a program.
const MOST_INPUTS: usize = 1 << 12;

/// The computation that a process is to do, by names.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Order {
    /// The part of the model that the computation needs, as YAML.
    pub(super) model: String,
    /// The variable that it computes.
    pub(super) sink: String,
    /// Each relation, with the variable for which it is solved.
    pub(super) steps: Vec<(String, String)>,
    /// Each source variable with its signal; `None` for a constant.
    pub(super) sources: Vec<(String, Option<String>)>,
}

/// A frame from the run to the process.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Word {
    Order(Order),
    /// A task, its number, and whether it belongs to the past.
    Task(Task, u64, bool),
}

/// A frame from the process to the run.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Reply {
    Ready,
    Refused(String),
    Answer { number: u64, result: Option<(PublishedValue, Validity)> },
}

impl Word {
    /// Writes the frame.
    pub(super) fn write(&self, frames: &mut Vec<u8>) {
        framed(frames, |body| match self {
            Word::Order(order) => {
                body.push(b'C');
                body.extend(serde_json::to_vec(order).unwrap_or_default());
            }
            Word::Task(task, number, is_past) => {
                body.push(if *is_past { b'P' } else { b'T' });
                body.extend(number.to_le_bytes());
                write_validity(body, task.moment);
                body.push(u8::from(task.last.is_some()));
                write_validity(body, task.last.unwrap_or(task.moment));
                body.extend((task.values.len() as u32).to_le_bytes());
                task.values.iter().for_each(|values| write_values(body, values));
            }
        });
    }

    /// Reads the next frame; `None` at the end.
    ///
    /// # Errors
    /// When the input fails, or is no valid frame.
    pub(super) fn read(input: &mut impl Read) -> io::Result<Option<Word>> {
        let Some(body) = frame(input)? else { return Ok(None) };
        Word::parse(&body).map(Some).ok_or_else(broken)
    }

    fn parse(body: &[u8]) -> Option<Word> {
        let (kind, rest) = body.split_first()?;
        let mut rest = Rest(rest);
        match kind {
            b'C' => serde_json::from_slice(rest.0).ok().map(Word::Order),
            b'P' | b'T' => {
                let (number, moment) = (rest.number()?, rest.validity()?);
                let has_last = rest.byte()? == 1;
                let last = rest.validity().filter(|_| has_last);
                let count = rest.count().filter(|count| *count <= MOST_INPUTS)?;
                let values = (0..count).map(|_| rest.values()).collect::<Option<_>>()?;
                let task = Task { values, moment, last };
                rest.0.is_empty().then_some(Word::Task(task, number, *kind == b'P'))
            }
            _ => None,
        }
    }
}

impl Reply {
    /// Writes the frame.
    ///
    /// # Errors
    /// Errors of the output.
    pub(super) fn write(&self, output: &mut impl Write) -> io::Result<()> {
        let mut bytes = Vec::new();
        framed(&mut bytes, |body| match self {
            Reply::Ready => body.push(b'R'),
            Reply::Refused(why) => {
                body.push(b'E');
                body.extend(why.as_bytes());
            }
            Reply::Answer { number, result } => {
                body.push(b'A');
                body.extend(number.to_le_bytes());
                let Some((value, validity)) = result else { return body.push(0) };
                let (shape, values) = match value {
                    PublishedValue::Scalar(value) => (1, std::slice::from_ref(value)),
                    PublishedValue::Vector(values) => (2, values.as_slice()),
                };
                body.push(shape);
                write_validity(body, *validity);
                write_values(body, values);
            }
        });
        output.write_all(&bytes)?;
        output.flush()
    }

    /// Reads the next frame; `None` at the end.
    ///
    /// # Errors
    /// When the input fails, or is no valid frame.
    pub(super) fn read(input: &mut impl Read) -> io::Result<Option<Reply>> {
        let Some(body) = frame(input)? else { return Ok(None) };
        Reply::parse(&body).map(Some).ok_or_else(broken)
    }

    fn parse(body: &[u8]) -> Option<Reply> {
        let (kind, rest) = body.split_first()?;
        let mut rest = Rest(rest);
        let reply = match kind {
            b'R' => Reply::Ready,
            b'E' => return Some(Reply::Refused(String::from_utf8_lossy(rest.0).into_owned())),
            b'A' => {
                let number = rest.number()?;
                let shape = rest.byte()?;
                let result = match shape {
                    0 => None,
                    _ => {
                        let (validity, values) = (rest.validity()?, rest.values()?);
                        let value = match (shape, values.as_slice()) {
                            (1, [value]) => PublishedValue::Scalar(*value),
                            (2, _) => PublishedValue::Vector(values),
                            _ => return None,
                        };
                        Some((value, validity))
                    }
                };
                Reply::Answer { number, result }
            }
            _ => return None,
        };
        rest.0.is_empty().then_some(reply)
    }
}

fn framed(frames: &mut Vec<u8>, write: impl FnOnce(&mut Vec<u8>)) {
    let at = frames.len();
    frames.extend([0; 4]);
    write(frames);
    let length = (frames.len() - at - 4) as u32;
    frames[at..at + 4].copy_from_slice(&length.to_le_bytes());
}

/// The content of the next frame. It allocates only as much as has arrived.
fn frame(input: &mut impl Read) -> io::Result<Option<Vec<u8>>> {
    let mut length = [0; 4];
    match input.read_exact(&mut length) {
        Ok(()) => {}
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => return Ok(None),
        Err(error) => return Err(error),
    }
    let length = u32::from_le_bytes(length) as usize;
    if length > LONGEST {
        return Err(broken());
    }
    let mut body = Vec::with_capacity(length.min(1 << 16));
    input.by_ref().take(length as u64).read_to_end(&mut body)?;
    if body.len() == length { Ok(Some(body)) } else { Ok(None) }
}

fn broken() -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, "what came is no frame")
}

fn write_validity(body: &mut Vec<u8>, validity: Validity) {
    body.extend(validity.from.0.to_le_bytes());
    body.extend(validity.to.0.to_le_bytes());
}

fn write_values(body: &mut Vec<u8>, values: &[Interval]) {
    body.extend((values.len() as u32).to_le_bytes());
    for value in values {
        body.extend(value.lo().to_le_bytes());
        body.extend(value.hi().to_le_bytes());
    }
}

/// The unread part of a frame.
struct Rest<'a>(&'a [u8]);

impl Rest<'_> {
    fn bytes<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (bytes, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(*bytes)
    }

    fn byte(&mut self) -> Option<u8> {
        self.bytes().map(u8::from_le_bytes)
    }

    fn number(&mut self) -> Option<u64> {
        self.bytes().map(u64::from_le_bytes)
    }

    fn count(&mut self) -> Option<usize> {
        self.bytes().map(|bytes| u32::from_le_bytes(bytes) as usize)
    }

    fn validity(&mut self) -> Option<Validity> {
        let mut time = || self.bytes().map(i64::from_le_bytes).map(Time);
        Some(Validity { from: time()?, to: time()? })
    }

    fn values(&mut self) -> Option<Vec<Interval>> {
        let count = self.count()?;
        let (values, rest) = self.0.split_at_checked(count.checked_mul(16)?)?;
        self.0 = rest;
        let mut values = Rest(values);
        let mut bound = || values.bytes().map(f64::from_le_bytes);
        (0..count).map(|_| Some(Interval::new(bound()?, bound()?))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn valid(from: i64, to: i64) -> Validity {
        Validity { from: Time(from), to: Time(to) }
    }

    #[test]
    fn what_is_written_is_read() {
        let list = vec![Interval::new(f64::MAX, f64::INFINITY), Interval::EMPTY, Interval::new(-0.5, 1.0)];
        let task = Task { values: vec![list.clone(), vec![]], moment: valid(-3, 5), last: Some(valid(1, 2)) };
        let order = Order { sink: "v".into(), steps: vec![("r".into(), "v".into())], ..Order::default() };
        let words = [
            Word::Order(order),
            Word::Task(task.clone(), 7, false),
            Word::Task(Task { last: None, ..task }, u64::MAX, true),
        ];
        let mut bytes = Vec::new();
        words.iter().for_each(|word| word.write(&mut bytes));
        let mut input = bytes.as_slice();
        for word in &words {
            assert_eq!(Word::read(&mut input).unwrap().as_ref(), Some(word));
        }
        assert_eq!(Word::read(&mut input).unwrap(), None);

        let scalar = PublishedValue::Scalar(Interval::new(1.0, 2.0));
        let all = [
            Reply::Ready,
            Reply::Refused("no".into()),
            Reply::Answer { number: 3, result: None },
            Reply::Answer { number: 4, result: Some((scalar, valid(1, 2))) },
            Reply::Answer { number: 5, result: Some((PublishedValue::Vector(list), valid(1, 2))) },
        ];
        let mut bytes = Vec::new();
        all.iter().for_each(|reply| reply.write(&mut bytes).unwrap());
        let mut input = bytes.as_slice();
        for reply in &all {
            assert_eq!(Reply::read(&mut input).unwrap().as_ref(), Some(reply));
        }
    }

    #[test]
    fn what_is_no_frame_is_refused_wherever_it_breaks() {
        let mut bytes = Vec::new();
        let task = Task { values: vec![vec![Interval::new(1.0, 2.0)]], moment: valid(1, 2), last: None };
        Word::Task(task, 7, false).write(&mut bytes);
        for cut in 4..bytes.len() {
            assert!(Word::read(&mut &bytes[..cut]).unwrap().is_none(), "cut at {cut}");
            assert!(Word::parse(&bytes[4..cut]).is_none(), "cut at {cut}");
        }
        assert!(Word::read(&mut [255_u8; 8].as_slice()).is_err());
        let mut many = b"T".to_vec();
        many.extend([0; 8 + 16 + 1 + 16]);
        many.extend(u32::MAX.to_le_bytes());
        assert!(Word::parse(&many).is_none());
        // A scalar of two numbers, and a count that exceeds the frame.
        let mut answer = b"A".to_vec();
        answer.extend([0; 8]);
        answer.push(1);
        answer.extend([0; 16]);
        answer.extend(2_u32.to_le_bytes());
        answer.extend([0; 32]);
        assert!(Reply::parse(&answer).is_none());
        assert!(Reply::parse(b"Rx").is_none() && Reply::parse(b"?").is_none() && Reply::parse(b"").is_none());
    }
}
