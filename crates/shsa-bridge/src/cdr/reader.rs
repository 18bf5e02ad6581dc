//! Fields of a CDR message as values.

use super::plan::{Body, Place, Plan, Target, text};
use super::types::{Count, Kind, Primitive, Types, full_name};
use crate::BridgeError;
use crate::payload::{Reading, Unreadable};
use shsa_core::observation::RawValue;
use shsa_core::time::{Span, Time};
use shsa_message::path::{Condition, Path, is_text};
use shsa_message::source::Field;

/// Reads the same fields of messages of one type.
#[derive(Clone, Debug)]
pub(crate) struct Reader {
    message_type: String,
    fields: Vec<Asked>,
}

/// One field.
#[derive(Clone, Debug)]
struct Asked {
    path: String,
    value: Plan,
    stamp: Option<(Plan, Span)>,
    conditions: Vec<(Plan, String)>,
}

impl Reader {
    /// For these fields of a type. Without a path of its own the stamp is that of the header, where there is one.
    ///
    /// # Errors
    /// When the type is not known, or a path leads nowhere or to no number.
    pub(crate) fn new(fields: &[Field], message_type: &str, types: &Types) -> Result<Reader, BridgeError> {
        let message_type = full_name(message_type).into_owned();
        let fields =
            fields.iter().map(|field| Asked::of(field, &message_type, types)).collect::<Result<_, _>>()?;
        Ok(Reader { message_type, fields })
    }

    /// Reads a message and tells each field by its index. A field whose condition this message does not meet is not told.
    pub(crate) fn read(&self, message: &[u8], mut each: impl FnMut(usize, Result<Reading, Unreadable>)) {
        let body = body(message);
        for (index, field) in self.fields.iter().enumerate() {
            let reading = match &body {
                Ok(body) => field.read(*body, &self.message_type),
                Err(unreadable) => Some(Err(unreadable.clone())),
            };
            if let Some(reading) = reading {
                each(index, reading);
            }
        }
    }
}

/// What is behind the header of a message.
pub(crate) fn body(message: &[u8]) -> Result<Body<'_>, Unreadable> {
    match message.split_first_chunk() {
        Some(([0, order @ (0 | 1), _, _], bytes)) => Ok(Body { bytes, is_big_endian: *order == 0 }),
        Some(([high, low, ..], _)) => {
            let kind = u16::from_be_bytes([*high, *low]);
            Err(Unreadable::Layout(format!(
                "an encapsulation 0x{kind:04x} is no plain CDR (0x0000 or 0x0001)"
            )))
        }
        None => Err(Unreadable::Layout(format!("{} bytes are no CDR message", message.len()))),
    }
}

/// The way to a field, with what must hold of the message.
pub(super) fn plan_of(path: &Path, message_type: &str, types: &Types) -> Result<Plan, BridgeError> {
    Plan::new(types, message_type, &path.steps).map_err(BridgeError::Configuration)
}

/// The way to the stamp of the header that a type begins with.
pub(super) fn header_stamp(message_type: &str, types: &Types) -> Option<Plan> {
    let first = types.members(message_type).ok()?.first()?;
    let is_header = matches!(&first.kind, Kind::Message(name) if &**name == "std_msgs/msg/Header");
    let path = Path::parse(&format!("{}.stamp", first.name)).ok()?;
    (is_header && first.count == Count::One).then(|| Plan::new(types, message_type, &path.steps).ok())?
}

impl Asked {
    fn of(field: &Field, message_type: &str, types: &Types) -> Result<Asked, BridgeError> {
        let path = Path::parse(&field.path)?;
        let value = plan_of(&path, message_type, types)?;
        if value.target == Target::Text {
            let problem = format!("`{}` is a text in {message_type}, no number", field.path);
            return Err(BridgeError::Configuration(problem));
        }
        let stamp = match &field.stamp {
            Some(stamp) => {
                let plan = plan_of(&Path::parse(&stamp.path)?, message_type, types)?;
                Some((plan, stamp.step.unwrap_or(Span::from_millis(1000))))
            }
            None => header_stamp(message_type, types).map(|plan| (plan, Span::ZERO)),
        };
        let condition = |condition: Condition| {
            let plan =
                Plan::new(types, message_type, &condition.steps).map_err(BridgeError::Configuration)?;
            Ok((plan, condition.text))
        };
        let conditions = path.conditions.into_iter().map(condition).collect::<Result<_, BridgeError>>()?;
        Ok(Asked { path: field.path.clone(), value, stamp, conditions })
    }

    /// `None`: a condition is not met.
    fn read(&self, body: Body<'_>, message_type: &str) -> Option<Result<Reading, Unreadable>> {
        let element = self.chosen(body)?;
        let value = self.value.locate(body).and_then(|place| {
            let place = match element {
                Some(index) => element_of(&self.value, place, index)?,
                None => place,
            };
            value(&self.value, place, element.is_none(), body)
        });
        let unreadable = || {
            let (path, length) = (&self.path, body.bytes.len());
            Unreadable::Layout(format!("`{path}` of {message_type} is not within {length} bytes"))
        };
        let stamp = self.stamp.as_ref().and_then(|(plan, step)| stamp(plan, *step, body));
        Some(value.map(|value| Reading { value, stamp }).ok_or_else(unreadable))
    }

    /// The element that the conditions choose, if they choose one; `None`: a condition is not met.
    fn chosen(&self, body: Body<'_>) -> Option<Option<usize>> {
        let mut chosen = None;
        for (plan, asked) in &self.conditions {
            let place = plan.locate(body)?;
            let index = (0..place.count).scan(place.at, |at, _| entry(plan.target, body, at));
            let found = index.enumerate().find(|(_, found)| is_text(found, asked));
            match (found, plan.count) {
                (Some(_), Count::One) => {}
                (Some((index, _)), _) => chosen = Some(index),
                (None, _) => return None,
            }
        }
        Some(chosen)
    }
}

/// One element of a list as text; moves on to the next one.
fn entry(target: Target, body: Body<'_>, at: &mut usize) -> Option<String> {
    match target {
        Target::Text => {
            let (found, end) = text(body, *at)?;
            *at = end;
            Some(String::from_utf8_lossy(found).into_owned())
        }
        Target::Primitive(primitive) => {
            let number = number(primitive, body, *at)?;
            *at += primitive.size();
            Some(number.to_string())
        }
        Target::Time => None,
    }
}

fn element_of(plan: &Plan, list: Place, index: usize) -> Option<Place> {
    let Target::Primitive(primitive) = plan.target else { return None };
    (index < list.count && plan.count != Count::One)
        .then(|| Place { at: list.at + index * primitive.size(), count: 1 })
}

fn value(plan: &Plan, place: Place, is_whole: bool, body: Body<'_>) -> Option<RawValue> {
    match plan.target {
        Target::Time => time(body, place.at).map(|time| RawValue::Number(time.seconds())),
        Target::Primitive(primitive) if is_whole && plan.count != Count::One => {
            let numbers =
                (0..place.count).map(|index| number(primitive, body, place.at + index * primitive.size()));
            numbers.collect::<Option<_>>().map(RawValue::Vector)
        }
        Target::Primitive(primitive) => number(primitive, body, place.at).map(RawValue::Number),
        Target::Text => None,
    }
}

/// A message's own stamp; zero means that nobody stamped it.
fn stamp(plan: &Plan, step: Span, body: Body<'_>) -> Option<Time> {
    let place = plan.locate(body)?;
    let stamp = match plan.target {
        Target::Time => time(body, place.at)?,
        Target::Primitive(primitive) => {
            Time::from_seconds(number(primitive, body, place.at)? * step.seconds())
        }
        Target::Text => return None,
    };
    (stamp.0 != 0).then_some(stamp)
}

fn time(body: Body<'_>, at: usize) -> Option<Time> {
    let seconds = i32::from_ne_bytes(take(body, at)?);
    let nanoseconds = u32::from_ne_bytes(take(body, at.checked_add(4)?)?);
    Some(Time(i64::from(seconds) * 1_000_000_000 + i64::from(nanoseconds)))
}

/// Bytes in the order of this machine.
fn take<const N: usize>(body: Body<'_>, at: usize) -> Option<[u8; N]> {
    let mut bytes: [u8; N] = *body.bytes.get(at..)?.first_chunk()?;
    if body.is_big_endian != cfg!(target_endian = "big") {
        bytes.reverse();
    }
    Some(bytes)
}

fn number(primitive: Primitive, body: Body<'_>, at: usize) -> Option<f64> {
    Some(match primitive {
        Primitive::Bool | Primitive::Byte | Primitive::U8 => u8::from_ne_bytes(take(body, at)?).into(),
        Primitive::I8 => i8::from_ne_bytes(take(body, at)?).into(),
        Primitive::I16 => i16::from_ne_bytes(take(body, at)?).into(),
        Primitive::U16 => u16::from_ne_bytes(take(body, at)?).into(),
        Primitive::I32 => i32::from_ne_bytes(take(body, at)?).into(),
        Primitive::U32 => u32::from_ne_bytes(take(body, at)?).into(),
        Primitive::I64 => i64::from_ne_bytes(take(body, at)?) as f64,
        Primitive::U64 => u64::from_ne_bytes(take(body, at)?) as f64,
        Primitive::F32 => f32::from_ne_bytes(take(body, at)?).into(),
        Primitive::F64 => f64::from_ne_bytes(take(body, at)?),
    })
}
