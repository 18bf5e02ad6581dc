//! The path to a field of a message, compiled once.

use super::definition::{Count, Kind, Member, Primitive};
use super::layout::{Body, Layout};
use super::steps::{Step, Steps, run};
use super::types::Types;
use crate::MessageError;
use crate::path::{Step as PathStep, split_each};

/// The largest number of fields visited for one plan: nested definitions can grow exponentially.
const WORK_MAX: usize = 100_000;
/// The deepest nesting of types.
const DEPTH_MAX: usize = 64;

/// The place of a field in a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// The first byte in the body.
    pub at: usize,
    /// The number of elements; 1 for a field that is no list.
    pub count: usize,
}

/// The kind of a plan's field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// Numbers.
    Primitive(Primitive),
    /// Texts.
    Text,
    /// Seconds and nanoseconds: a point in time, in ROS 2 also a duration.
    Time,
    /// A message, which has no value of its own.
    Message,
}

/// The place of a field in the bytes of a message.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    steps: Vec<Step>,
    /// The kind of the field, or of its elements.
    pub target: Target,
    /// The number of its elements.
    pub count: Count,
    /// Where the field is in each element of a list of messages; then the steps lead to this list.
    pub(super) each: Option<Each>,
}

/// A field of each element of a list of messages.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Each {
    /// The steps over an element.
    pub(super) element: Vec<Step>,
    /// The steps from the start of an element to the field.
    pub(super) inner: Vec<Step>,
}

impl Plan {
    /// The plan for the field at a path within a type. Without steps: the field `data`.
    ///
    /// # Errors
    /// The part of the path that does not exist, and the existing ones; or why the field cannot be reached.
    pub fn new(
        types: &Types,
        layout: Layout,
        message_type: &str,
        path: &[PathStep],
    ) -> Result<Plan, MessageError> {
        Ok(compile(types, layout, message_type, path)?.0)
    }

    /// As [`Plan::new`], for a value or a text.
    ///
    /// # Errors
    /// The errors of [`Plan::new`], and a field that is a message.
    pub fn of_value(
        types: &Types,
        layout: Layout,
        message_type: &str,
        path: &[PathStep],
    ) -> Result<Plan, MessageError> {
        match compile(types, layout, message_type, path)? {
            (Plan { target: Target::Message, .. }, Kind::Message(name)) => Err(is_message(types, name, path)),
            (plan, _) => Ok(plan),
        }
    }

    /// Where the field is in each element of the list; `None` when the message is too short, or the field is not of each
    /// element. At most `O(message)`.
    pub(super) fn places(&self, body: Body<'_>) -> Option<Vec<usize>> {
        let each = self.each.as_ref()?;
        let (count, mut at) = self.count.read(body, run(&self.steps, body, 0)?)?;
        // An element takes at least a byte, or all of them are alike and empty.
        if count > body.bytes.len() {
            return None;
        }
        let place = |_| {
            let place = run(&each.inner, body, at)?;
            at = run(&each.element, body, at)?;
            Some(place)
        };
        (0..count).map(place).collect()
    }

    /// The place of the field; `None` when the message is too short or a list has no such element, and for a field of each
    /// element of a list, which has many places. At most `O(message)`.
    #[must_use]
    pub fn locate(&self, body: Body<'_>) -> Option<Place> {
        if self.each.is_some() {
            return None;
        }
        let at = run(&self.steps, body, 0)?;
        let size = match self.target {
            Target::Primitive(primitive) => primitive.size(),
            Target::Time => 8,
            Target::Text => 4,
            Target::Message => return None,
        };
        let place = match self.count {
            Count::One => Place { at, count: 1 },
            Count::Fixed(count) => Place { at, count },
            Count::Free(_) => {
                let (count, at) = body.counted(at)?;
                let first = || at.checked_next_multiple_of(body.layout.alignment(size));
                Place { at: if count == 0 { at } else { first()? }, count }
            }
        };
        let end = place.at.checked_add(place.count.checked_mul(size)?)?;
        (end <= body.bytes.len()).then_some(place)
    }
}

/// The plan, and the field's kind in the definition.
fn compile<'t>(
    types: &'t Types,
    layout: Layout,
    message_type: &str,
    path: &[PathStep],
) -> Result<(Plan, &'t Kind), MessageError> {
    let data = [PathStep::Key("data".into())];
    let path = if path.is_empty() { &data } else { path };
    let mut steps = Steps::default();
    let mut compiler = Compiler::new(types, layout);
    let (list, rest) = split_each(path).map_or((path, None), |(list, rest)| (list, Some(rest)));
    let (mut kind, mut count) = compiler.descend(message_type, list, &mut steps)?;
    let list = rest.map(|rest| compiler.of_each(kind, count, list, rest)).transpose()?;
    let of_list = list.map(|list| {
        let outer = std::mem::replace(&mut steps, list.inner);
        (kind, count) = (list.kind, Count::One);
        (outer, list.element, list.count)
    });
    let is_one = count == Count::One;
    let target = match kind {
        Kind::Primitive(Primitive::Time) if is_one => Target::Time,
        Kind::Primitive(primitive) => {
            if !matches!(count, Count::Free(_)) {
                steps.align(layout.alignment(primitive.size()));
            }
            Target::Primitive(*primitive)
        }
        Kind::Text(_) => Target::Text,
        Kind::Message(name) if is_time(name) && is_one => {
            steps.align(layout.alignment(4));
            Target::Time
        }
        Kind::Message(_) => Target::Message,
        Kind::WideText => return Err(MessageError::WideText),
    };
    let plan = match of_list {
        Some((outer, element, count)) => {
            Plan { steps: outer.list, target, count, each: Some(Each { element, inner: steps.list }) }
        }
        None => Plan { steps: steps.list, target, count, each: None },
    };
    Ok((plan, kind))
}

/// The way to a field of each element of a list.
struct OfEach<'t> {
    /// The kind of the field.
    kind: &'t Kind,
    /// The number of the list's elements.
    count: Count,
    /// The steps over an element.
    element: Vec<Step>,
    /// The steps from the start of an element to the field, up to its alignment.
    inner: Steps,
}

/// Whether a type is a point in time or a duration of ROS 2.
fn is_time(name: &str) -> bool {
    matches!(name, "builtin_interfaces/msg/Time" | "builtin_interfaces/msg/Duration")
}

fn is_message(types: &Types, name: &str, path: &[PathStep]) -> MessageError {
    let members = types.members(name).unwrap_or_default();
    let last = path.iter().rev().find_map(|step| match step {
        PathStep::Key(key) => Some(key.clone()),
        PathStep::Index(_) | PathStep::Each => None,
    });
    MessageError::IsMessage {
        field: last.unwrap_or_default(),
        message_type: name.to_owned(),
        parts: members.iter().map(|member| member.name.clone()).collect(),
    }
}

/// Compiles the steps of a plan.
pub(super) struct Compiler<'t> {
    types: &'t Types,
    layout: Layout,
    work_left: usize,
}

impl<'t> Compiler<'t> {
    pub(super) fn new(types: &'t Types, layout: Layout) -> Compiler<'t> {
        Compiler { types, layout, work_left: WORK_MAX }
    }

    /// Appends the steps to the field at a path within a type, up to its count or its alignment.
    fn descend(
        &mut self,
        root: &str,
        path: &[PathStep],
        steps: &mut Steps,
    ) -> Result<(&'t Kind, Count), MessageError> {
        let mut owner = root;
        let mut path = path.iter().peekable();
        while let Some(step) = path.next() {
            let PathStep::Key(name) = step else { return Err(MessageError::NoList(owner.to_owned())) };
            let member = self.pass_to(owner, name, steps)?;
            let mut count = member.count;
            if let Some(index) = path.peek().and_then(|step| step.index()).filter(|_| count != Count::One) {
                path.next();
                self.enter(member, index, steps)?;
                count = Count::One;
            }
            match (&member.kind, path.peek()) {
                (kind, None) => return Ok((kind, count)),
                (_, Some(PathStep::Index(_))) => return Err(MessageError::NoList(format!("'{name}'"))),
                (Kind::Message(_), _) if count != Count::One => return Err(MessageError::List(name.clone())),
                (Kind::Message(inner), _) => owner = inner,
                _ => return Err(MessageError::NoParts(name.clone())),
            }
        }
        Err(MessageError::NoField)
    }

    /// The way to the field at a path within each element of a list.
    fn of_each(
        &mut self,
        kind: &'t Kind,
        count: Count,
        list: &[PathStep],
        rest: &[PathStep],
    ) -> Result<OfEach<'t>, MessageError> {
        let name = || list.iter().rev().find_map(key).unwrap_or_default();
        let Kind::Message(message) = kind else { return Err(MessageError::NoParts(name())) };
        if count == Count::One {
            return Err(MessageError::NoList(format!("'{}'", name())));
        }
        let element = self.element(&Member { name: name(), kind: kind.clone(), count }, 0)?;
        let mut inner = Steps::anywhere();
        let (kind, of_field) = self.descend(message, rest, &mut inner)?;
        if of_field != Count::One {
            return Err(MessageError::List(rest.iter().rev().find_map(key).unwrap_or_default()));
        }
        Ok(OfEach { kind, count, element, inner })
    }

    /// Skips the fields before the named one.
    fn pass_to(&mut self, owner: &str, name: &str, steps: &mut Steps) -> Result<&'t Member, MessageError> {
        let members = self.types.members(owner)?;
        for member in members {
            if member.name == name {
                return Ok(member);
            }
            self.over(member, member.count, 0, steps)?;
        }
        Err(MessageError::UnknownField {
            name: name.to_owned(),
            owner: owner.to_owned(),
            known: members.iter().map(|member| member.name.clone()).collect(),
        })
    }

    fn enter(&mut self, member: &Member, index: usize, steps: &mut Steps) -> Result<(), MessageError> {
        let element = self.element(member, 0)?;
        steps.push(Step::Enter { count: member.count, index, element }, 1);
        Ok(())
    }

    /// The steps over one element of a list.
    fn element(&mut self, member: &Member, depth: usize) -> Result<Vec<Step>, MessageError> {
        let mut element = Steps::anywhere();
        self.over(member, Count::One, depth, &mut element)?;
        Ok(element.list)
    }

    /// Appends the steps over a field, or over one of its elements.
    fn over(
        &mut self,
        member: &Member,
        count: Count,
        depth: usize,
        steps: &mut Steps,
    ) -> Result<(), MessageError> {
        self.work_left = self.work_left.checked_sub(1).ok_or(MessageError::TooLarge)?;
        if depth > DEPTH_MAX {
            return Err(MessageError::TooDeep);
        }
        let uniform = self.uniform(&member.kind, depth)?;
        match (count, uniform) {
            (Count::Fixed(0), _) => {}
            // An empty list ends behind its count.
            (Count::Free(_), Some((align, size))) => steps.push(Step::List { align, size }, align.min(4)),
            (Count::One, Some((align, size))) => {
                steps.align(align);
                steps.skip(size);
            }
            (Count::Fixed(count), Some((align, size))) => {
                steps.align(align);
                steps.skip(size.checked_mul(count).ok_or(MessageError::TooLarge)?);
            }
            (Count::One, None) => self.over_one(&member.kind, depth, steps)?,
            (count, None) => {
                let element = self.element(member, depth + 1)?;
                steps.push(Step::Each { count, element }, 1);
            }
        }
        Ok(())
    }

    /// Appends the steps over a value of variable size.
    pub(super) fn over_one(
        &mut self,
        kind: &Kind,
        depth: usize,
        steps: &mut Steps,
    ) -> Result<(), MessageError> {
        match kind {
            Kind::Text(_) => steps.push(Step::Text, 1),
            Kind::WideText => return Err(MessageError::WideTextBefore),
            Kind::Message(inner) => {
                for member in self.types.members(inner)? {
                    self.over(member, member.count, depth + 1, steps)?;
                }
            }
            Kind::Primitive(_) => {}
        }
        Ok(())
    }

    /// Alignment and size of a value without gaps at any position: numbers of one alignment.
    fn uniform(&mut self, kind: &Kind, depth: usize) -> Result<Option<(usize, usize)>, MessageError> {
        self.work_left = self.work_left.checked_sub(1).ok_or(MessageError::TooLarge)?;
        let members = match kind {
            Kind::Primitive(primitive) => {
                let size = primitive.size();
                return Ok(Some((self.layout.alignment(size), size)));
            }
            Kind::Message(name) if depth <= DEPTH_MAX => self.types.members(name)?,
            _ => return Ok(None),
        };
        let mut whole = if members.is_empty() { Some((1, self.layout.nothing())) } else { None };
        for member in members {
            let Some((align, size)) = self.uniform(&member.kind, depth + 1)? else { return Ok(None) };
            let count = match member.count {
                Count::One => 1,
                Count::Fixed(count) => count,
                Count::Free(_) => return Ok(None),
            };
            let size = size.checked_mul(count).ok_or(MessageError::TooLarge)?;
            whole = match whole {
                None => Some((align, size)),
                Some((same, before)) if same == align => {
                    Some((align, before.checked_add(size).ok_or(MessageError::TooLarge)?))
                }
                Some(_) => return Ok(None),
            };
        }
        Ok(whole)
    }
}

/// The name of a step.
fn key(step: &PathStep) -> Option<String> {
    match step {
        PathStep::Key(key) => Some(key.clone()),
        PathStep::Index(_) | PathStep::Each => None,
    }
}

#[cfg(test)]
mod tests;
