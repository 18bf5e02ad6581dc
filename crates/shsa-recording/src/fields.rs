//! One field of a topic's messages: its path is resolved once, then the field is read in each message.

use super::json_value;
use super::members::Members;
use super::names::{self, Fit};
use super::topic::{Body, Field, Fields, Value};
use shsa_core::observation::RawValue;
use shsa_core::time::{Span, Time};
use shsa_message::MessageError;
use shsa_message::json::{Kind, Place, unescaped};
use shsa_message::moment::{DateOrder, moment};
use shsa_message::number::float;
use shsa_message::path::{Path as FieldPath, Step, is_number, is_text, split_each};
use shsa_message::protobuf::{self, Found};
use shsa_message::ros::{Body as RosBody, Count, Layout, Plan, Target};
use shsa_message::stamp;
use shsa_message::zone::Zone;

/// The fields of a message's header that usually have its stamp.
const STAMPS: [&str; 2] = ["header.stamp", "timestamp"];

/// Why a field cannot be located.
#[derive(Debug)]
pub(super) struct Unlocated {
    /// The problem.
    pub(super) problem: String,
    /// All fields that fit, where there are several.
    pub(super) choices: Vec<String>,
}

impl From<String> for Unlocated {
    fn from(problem: String) -> Unlocated {
        Unlocated { problem, choices: Vec::new() }
    }
}

/// The place of one field in the messages of a topic.
pub(super) enum Locator {
    /// The field of this index, or an element of its list.
    Named(usize, Option<usize>),
    /// A member of a JSON value.
    Json(Vec<Step>),
    /// A member of this number among those of [`Body::Members`].
    Member(usize),
    /// What is at these steps within each element of a JSON list.
    Each(Box<Locator>, Vec<Step>),
    /// A field of a ROS message.
    Ros(Layout, Plan),
    /// A field of a Protocol Buffers message.
    Protobuf(protobuf::Plan),
}

impl Fields {
    /// Locates the field at a path. The path `data` also fits the only field of a message.
    ///
    /// # Errors
    /// The problem with the path, and the fields that exist.
    pub(super) fn locate(&self, path: &str) -> Result<Locator, Unlocated> {
        match self {
            Fields::Named(fields) => named(fields, path).map(|(at, element)| Locator::Named(at, element)),
            Fields::Json => {
                let steps = FieldPath::parse(path).map_err(said)?.steps;
                Ok(match split_each(&steps) {
                    Some((list, each)) => {
                        Locator::Each(Box::new(Locator::Json(list.to_vec())), each.to_vec())
                    }
                    None => Locator::Json(steps),
                })
            }
            Fields::Ros { types, kind, layout } => {
                let path = FieldPath::parse(path).map_err(said)?;
                Ok(Locator::Ros(*layout, Plan::new(types, *layout, kind, &path.steps).map_err(said)?))
            }
            Fields::Protobuf(types, kind) => {
                let path = FieldPath::parse(path).map_err(said)?;
                Ok(Locator::Protobuf(protobuf::Plan::new(types, kind, &path.steps).map_err(said)?))
            }
            Fields::Unknown(reason) => Err(reason.clone().into()),
        }
    }

    /// The places of the stamp in the header of the messages; `None` where there is none.
    pub(super) fn header_stamp(&self) -> Option<Vec<Locator>> {
        match self {
            Fields::Json | Fields::Protobuf(..) => {
                Some(STAMPS.iter().filter_map(|path| self.locate(path).ok()).collect())
            }
            Fields::Ros { types, kind, layout } => {
                let plan = Plan::new(types, *layout, kind, &types.header_stamp(kind)?).ok()?;
                Some(vec![Locator::Ros(*layout, plan)])
            }
            Fields::Named(_) | Fields::Unknown(_) => None,
        }
    }
}

/// The field with a name: the full name, else the name without its unit, else in any letter case, else as an element of a list.
fn named(fields: &[Field], path: &str) -> Result<(usize, Option<usize>), Unlocated> {
    let names: Vec<String> = fields.iter().map(|field| field.name.clone()).collect();
    let find = |path: &str| match names::column_of(&names, path) {
        Fit::Column(at) => Some(Ok(at)),
        Fit::Several(all) => {
            let choices = all.iter().filter_map(|at| names.get(*at).cloned()).collect();
            Some(Err(Unlocated { problem: format!("'{path}' fits several fields"), choices }))
        }
        Fit::Nothing if path == "data" && names.len() == 1 => Some(Ok(0)),
        Fit::Nothing => None,
    };
    let value = || find("value").filter(|_| path == "data");
    if let Some(found) = find(path).or_else(|| find(names::bare(path))).or_else(value) {
        return found.map(|at| (at, None));
    }
    if let Some((list, index)) = element(path)
        && let Some(found) = find(list)
    {
        return found.map(|at| (at, Some(index)));
    }
    Err(format!("no field '{path}'{}", names::hint(path, names.iter().map(String::as_str))).into())
}

/// `q[2]` and `q.2`: a list and the index of an element.
fn element(path: &str) -> Option<(&str, usize)> {
    let (list, index) = match path.strip_suffix(']') {
        Some(open) => open.rsplit_once('[')?,
        None => path.rsplit_once('.')?,
    };
    Some((list, index.trim().parse().ok()?))
}

/// The problem of a message type as the problem of a field.
fn said(problem: MessageError) -> Unlocated {
    let problem = match problem {
        MessageError::NoIndex { index, name, .. } => {
            format!("'[{index}]' is no index; write it like {name}[0]")
        }
        MessageError::UnknownType { name, .. } => format!("the type {name} is not defined in the file"),
        MessageError::UnknownField { name, owner, known } => {
            let hint = names::hint(&name, known.iter().map(String::as_str));
            format!("no field '{name}' in {owner}{hint}")
        }
        other => other.to_string(),
    };
    problem.into()
}

impl Locator {
    /// Whether the field can be a number.
    pub(super) fn can_be_number(&self) -> bool {
        match self {
            Locator::Ros(_, plan) => matches!(plan.target, Target::Primitive(_) | Target::Time),
            Locator::Protobuf(plan) => plan.is_number(),
            Locator::Named(..) | Locator::Json(_) | Locator::Member(_) | Locator::Each(..) => true,
        }
    }

    /// Whether the field can be compared with a text: a number, a text, a list of texts.
    pub(super) fn can_be_compared(&self) -> bool {
        match self {
            Locator::Ros(_, plan) => match plan.target {
                Target::Primitive(_) | Target::Time => plan.count == Count::One,
                Target::Text => true,
                Target::Message => false,
            },
            Locator::Each(..) => false,
            Locator::Named(..) | Locator::Json(_) | Locator::Member(_) | Locator::Protobuf(_) => true,
        }
    }

    /// The value of the field, or of one element of its list; `None` when it is missing or no number.
    pub(super) fn value(&self, body: Body<'_>, element: Option<usize>) -> Option<RawValue> {
        match (self, body) {
            (Locator::Named(at, own), _) => of_named(body.value(*at), element.or(*own)),
            (Locator::Json(_) | Locator::Member(_), _) => {
                let (text, place) = self.json(body)?;
                json_value::value(text, place, element)
            }
            (Locator::Each(list, steps), _) => {
                let (text, place) = list.json(body)?;
                json_value::of_each(text, place, steps, element)
            }
            (Locator::Ros(layout, plan), Body::Bytes(bytes)) => plan.value(of_ros(*layout, bytes)?, element),
            (Locator::Protobuf(plan), Body::Bytes(bytes)) => of_protobuf(plan.find(bytes)?, element),
            _ => None,
        }
    }

    /// The text of the field; `None` when it is missing or no text.
    pub(super) fn text(&self, body: Body<'_>) -> Option<String> {
        match (self, body) {
            (Locator::Named(at, None), _) => match body.value(*at) {
                Value::Text(text) => Some(text.to_owned()),
                _ => None,
            },
            (Locator::Json(_) | Locator::Member(_), _) => {
                let (text, place) = self.json(body).filter(|(_, place)| place.kind == Kind::Text)?;
                Some(unescaped(place.of(text)).into_owned())
            }
            (Locator::Ros(layout, plan), Body::Bytes(bytes)) => plan.text(of_ros(*layout, bytes)?),
            (Locator::Protobuf(plan), Body::Bytes(bytes)) => match plan.find(bytes)? {
                Found::Text(text) => Some(text),
                _ => None,
            },
            _ => None,
        }
    }

    /// The field as a stamp; `step` is the unit of a number. `None` as in [`Locator::value`], and for zero in a message.
    pub(super) fn stamp(&self, body: Body<'_>, step: Option<Span>) -> Option<Time> {
        let stamp = match (self, body) {
            (Locator::Named(at, None), _) => match body.value(*at) {
                Value::Whole(whole) => {
                    let step = step.unwrap_or_else(|| stamp::likely_step(whole.unsigned_abs()));
                    Time(whole.checked_mul(step.0)?)
                }
                Value::Number(number) => Time::from_seconds(number * step.map_or(1.0, |step| step.seconds())),
                Value::Text(text) => text_stamp(text, step)?,
                Value::Missing | Value::List(_) | Value::Interval(..) => return None,
            },
            (Locator::Json(_) | Locator::Member(_), _) => {
                let (text, place) = self.json(body)?;
                json_value::stamp(text, place, step)?
            }
            (Locator::Ros(layout, plan), Body::Bytes(bytes)) => {
                plan.stamp(of_ros(*layout, bytes)?, step.unwrap_or(Span::from_millis(1_000)))?
            }
            (Locator::Protobuf(plan), Body::Bytes(bytes)) => match plan.find(bytes)? {
                Found::Time(seconds, nanoseconds) => {
                    Time(seconds.checked_mul(1_000_000_000)?.checked_add(nanoseconds)?)
                }
                Found::Number(number) => {
                    let step = step.unwrap_or_else(|| stamp::likely_step(number.abs() as u64));
                    Time::from_seconds(number * step.seconds())
                }
                _ => return None,
            },
            _ => return None,
        };
        // Zero in a message means that it was not stamped; in a table zero is a time.
        (stamp.0 != 0 || matches!(self, Locator::Named(..))).then_some(stamp)
    }

    /// Compares the field with a text: `Some(None)` where its one value is equal; for a list, the index of the first equal
    /// element.
    pub(super) fn find(&self, body: Body<'_>, asked: &str) -> Option<Option<usize>> {
        match (self, body) {
            (Locator::Named(at, None), _) => match body.value(*at) {
                Value::Text(text) => is_text(text, asked).then_some(None),
                Value::Number(number) => is_number(number, asked).then_some(None),
                Value::Whole(whole) => is_number(whole as f64, asked).then_some(None),
                Value::List(items) => items.iter().position(|item| is_number(*item, asked)).map(Some),
                Value::Missing | Value::Interval(..) => None,
            },
            (Locator::Json(_) | Locator::Member(_), _) => {
                let (text, place) = self.json(body)?;
                json_value::find(text, place, asked)
            }
            (Locator::Ros(layout, plan), Body::Bytes(bytes)) => plan.find(of_ros(*layout, bytes)?, asked),
            (Locator::Protobuf(plan), Body::Bytes(bytes)) => plan.find(bytes)?.says(asked),
            _ => None,
        }
    }
}

impl Locator {
    /// Has a JSON value found in one pass with the other members that are looked for.
    pub(super) fn join(&mut self, members: &mut Members) {
        match self {
            Locator::Json(steps) => {
                if let Some(member) = members.add(steps) {
                    *self = Locator::Member(member);
                }
            }
            Locator::Each(list, _) => list.join(members),
            _ => {}
        }
    }

    /// A JSON text, and where in it the field is.
    fn json<'a>(&self, body: Body<'a>) -> Option<(&'a str, Place)> {
        match (self, body) {
            (Locator::Member(member), Body::Members(found)) => Some((found.text, found.place(*member)?)),
            (Locator::Json(steps), Body::Members(found)) => {
                Some((found.text, json_value::at(found.text, steps)?))
            }
            (Locator::Json(steps), Body::Bytes(bytes)) => {
                let text = std::str::from_utf8(bytes).ok()?;
                Some((text, json_value::at(text, steps)?))
            }
            _ => None,
        }
    }
}

/// A stamp from a number, or from a date and a time, in UTC where the text has no zone.
fn text_stamp(text: &str, step: Option<Span>) -> Option<Time> {
    let moment = || moment(text, DateOrder::YearMonthDay, &Zone::default()).map(|moment| moment.time);
    stamp::number(text.trim(), step).map(|(time, _)| time).or_else(moment)
}

fn of_ros(layout: Layout, bytes: &[u8]) -> Option<RosBody<'_>> {
    match layout {
        Layout::Packed => Some(RosBody::packed(bytes)),
        Layout::Cdr => RosBody::cdr(bytes).ok(),
    }
}

fn of_protobuf(found: Found, element: Option<usize>) -> Option<RawValue> {
    match (found, element) {
        (Found::Number(number), None) => Some(RawValue::Number(number)),
        (Found::Numbers(numbers), None) => Some(RawValue::Vector(numbers)),
        (Found::Numbers(numbers), Some(index)) => numbers.get(index).copied().map(RawValue::Number),
        (Found::Time(seconds, nanoseconds), None) => {
            Some(RawValue::Number(seconds as f64 + nanoseconds as f64 * 1e-9))
        }
        _ => None,
    }
}

/// The number of a word for a truth: 1 or 0, as in JSON.
fn truth(word: &str) -> Option<f64> {
    let is = |known: &str| word.eq_ignore_ascii_case(known);
    if is("true") { Some(1.0) } else { is("false").then_some(0.0) }
}

fn of_named(value: Value<'_>, element: Option<usize>) -> Option<RawValue> {
    match (value, element) {
        (Value::Number(number), None) => Some(RawValue::Number(number)),
        (Value::Whole(whole), None) => Some(RawValue::Number(whole as f64)),
        (Value::Text(text), None) => {
            float(text).or_else(|| float(text.trim())).or_else(|| truth(text.trim())).map(RawValue::Number)
        }
        (Value::Interval(lo, hi), None) => Some(RawValue::Interval { lo, hi }),
        (Value::List(items), None) => Some(RawValue::Vector(items.to_vec())),
        (Value::List(items), Some(index)) => items.get(index).copied().map(RawValue::Number),
        _ => None,
    }
}
