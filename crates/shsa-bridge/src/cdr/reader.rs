//! Fields of a CDR message as values.

use crate::BridgeError;
use crate::payload::{Reading, Unreadable};
use shsa_core::time::Span;
use shsa_message::path::{Path, Step};
use shsa_message::ros::{Body, Layout, Plan, Target, Types, chosen, full_name};
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
    /// A reader of these fields of a type. A field without a path to a stamp gets the stamp of the message's header, if there is
    /// one.
    ///
    /// # Errors
    /// When the type is unknown, or a path leads to no field or to no number.
    pub(crate) fn new(fields: &[Field], message_type: &str, types: &Types) -> Result<Reader, BridgeError> {
        let message_type = full_name(message_type).into_owned();
        let fields =
            fields.iter().map(|field| Asked::of(field, &message_type, types)).collect::<Result<_, _>>()?;
        Ok(Reader { message_type, fields })
    }

    /// Reads a message, and passes on each field with its index; skips a field whose condition the message does not meet.
    pub(crate) fn read(&self, message: &[u8], mut each: impl FnMut(usize, Result<Reading, Unreadable>)) {
        let body = Body::cdr(message).map_err(Unreadable::from);
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

/// The way to a field that is a value or a text.
pub(super) fn plan(path: &[Step], message_type: &str, types: &Types) -> Result<Plan, BridgeError> {
    Ok(Plan::of_value(types, Layout::Cdr, message_type, path)?)
}

/// The way to the stamp of the header that a type begins with.
pub(super) fn header_stamp(message_type: &str, types: &Types) -> Option<Plan> {
    plan(&types.header_stamp(message_type)?, message_type, types).ok()
}

impl Asked {
    fn of(field: &Field, message_type: &str, types: &Types) -> Result<Asked, BridgeError> {
        let path = Path::parse(&field.path)?;
        let value = plan(&path.steps, message_type, types)?;
        if value.target == Target::Text {
            let problem = format!("`{}` is a text in {message_type}, no number", field.path);
            return Err(BridgeError::Configuration(problem));
        }
        let stamp = match &field.stamp {
            Some(stamp) => {
                let plan = plan(&Path::parse(&stamp.path)?.steps, message_type, types)?;
                Some((plan, stamp.step.unwrap_or(Span::from_millis(1000))))
            }
            None => header_stamp(message_type, types).map(|plan| (plan, Span::ZERO)),
        };
        let conditions = path
            .conditions
            .into_iter()
            .map(|asked| Ok((plan(&asked.steps, message_type, types)?, asked.text)));
        let conditions = conditions.collect::<Result<_, BridgeError>>()?;
        Ok(Asked { path: field.path.clone(), value, stamp, conditions })
    }

    /// `None`: a condition is not met.
    fn read(&self, body: Body<'_>, message_type: &str) -> Option<Result<Reading, Unreadable>> {
        let element = chosen(&self.conditions, body)?;
        let Some(value) = self.value.value(body, element) else {
            let (path, length) = (&self.path, body.bytes.len());
            let problem = format!("`{path}` of {message_type} is not within {length} bytes");
            return Some(Err(Unreadable::Layout(problem)));
        };
        let stamp = self.stamp.as_ref().and_then(|(plan, step)| plan.stamp(body, *step));
        Some(Ok(Reading { value, stamp }))
    }
}
