//! The way to one field of a message, compiled once: skips and alignments, few of which depend on the message.
//!
//! Wire format: XCDR version 1 (OMG DDS-XTypes 1.3, 7.4.1), as ROS 2 writes it. Every number stands at a multiple of
//! its size, counted behind the header of four bytes; lists and texts follow a count of four bytes.

use super::types::{Count, Kind, Member, Primitive, Types};
use shsa_core::unit::nearest;
use shsa_message::path::Step as PathStep;

/// So many fields may be looked at for one plan: definitions nest, and a malicious one nests exponentially.
const WORK_MAX: usize = 100_000;
/// Types may nest so deep.
const DEPTH_MAX: usize = 64;

/// The body of a message, and its byte order.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Body<'a> {
    pub(crate) bytes: &'a [u8],
    pub(crate) is_big_endian: bool,
}

/// A field's place in one message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Place {
    /// Of its first byte in the body.
    pub(crate) at: usize,
    /// How many elements; 1 for what is no list.
    pub(crate) count: usize,
}

/// What stands at the end of a plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Target {
    Primitive(Primitive),
    Text,
    /// Seconds and nanoseconds: a point in time, or a duration.
    Time,
}

/// How one field is found in the bytes of a message.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Plan {
    steps: Vec<Step>,
    pub(crate) target: Target,
    pub(crate) count: Count,
}

#[derive(Clone, Debug, PartialEq)]
enum Step {
    /// So many bytes.
    Skip(usize),
    /// To a multiple of this.
    Align(usize),
    /// A text.
    Text,
    /// As many elements as the wire says, of this size, the first one at a multiple of `align`.
    List { align: usize, size: usize },
    /// Elements of changing size.
    Each { count: Count, element: Vec<Step> },
    /// To one element of a list that must be longer than the index.
    Enter { count: Count, index: usize, element: Vec<Step> },
}

impl Plan {
    /// The way to the field at a path within a type. No steps: the field `data`.
    ///
    /// # Errors
    /// Says which part of the path is not there, and what is.
    pub(crate) fn new(types: &Types, message_type: &str, path: &[PathStep]) -> Result<Plan, String> {
        let data = [PathStep::Key("data".into())];
        let path = if path.is_empty() { &data } else { path };
        let mut compiler = Compiler { types, work_left: WORK_MAX };
        let mut steps = Steps::default();
        let (kind, count) = compiler.descend(message_type, path, &mut steps)?;
        let target = match kind {
            Kind::Primitive(primitive) => {
                if count == Count::One || matches!(count, Count::Fixed(_)) {
                    steps.align(primitive.size());
                }
                Target::Primitive(*primitive)
            }
            Kind::Text(_) => Target::Text,
            Kind::Message(name) if is_time(name) && count == Count::One => {
                steps.align(4);
                Target::Time
            }
            Kind::Message(name) => return Err(compiler.is_message(name, path)),
            Kind::WideText => return Err("a text of wide characters cannot be read".into()),
        };
        Ok(Plan { steps: steps.list, target, count })
    }

    /// Where the field stands; `None` when the message is too short or a list has no such element. At most `O(message)`.
    pub(crate) fn locate(&self, body: Body<'_>) -> Option<Place> {
        let at = run(&self.steps, body, 0)?;
        let size = match self.target {
            Target::Primitive(primitive) => primitive.size(),
            Target::Time => 8,
            Target::Text => 4,
        };
        let place = match self.count {
            Count::One => Place { at, count: 1 },
            Count::Fixed(count) => Place { at, count: count as usize },
            Count::Free(_) => {
                let (count, at) = counted(body, at)?;
                Place { at: if count == 0 { at } else { aligned(at, size)? }, count }
            }
        };
        let end = place.at.checked_add(place.count.checked_mul(size)?)?;
        (end <= body.bytes.len()).then_some(place)
    }
}

/// Whether a type is a point in time or a duration.
fn is_time(name: &str) -> bool {
    matches!(name, "builtin_interfaces/msg/Time" | "builtin_interfaces/msg/Duration")
}

/// Steps, and what is known of the position behind them: modulo `modulus` it is `residue`.
struct Steps {
    list: Vec<Step>,
    modulus: usize,
    residue: usize,
}

impl Default for Steps {
    /// At the beginning of a body.
    fn default() -> Steps {
        Steps { list: Vec::new(), modulus: 8, residue: 0 }
    }
}

impl Steps {
    /// Somewhere in a body.
    fn anywhere() -> Steps {
        Steps { modulus: 1, ..Steps::default() }
    }

    fn push(&mut self, step: Step, modulus: usize) {
        self.list.push(step);
        (self.modulus, self.residue) = (modulus, 0);
    }

    fn skip(&mut self, size: usize) {
        match self.list.last_mut() {
            _ if size == 0 => {}
            Some(Step::Skip(before)) => *before = before.saturating_add(size),
            _ => self.list.push(Step::Skip(size)),
        }
        self.residue = self.residue.wrapping_add(size) % self.modulus;
    }

    fn align(&mut self, to: usize) {
        if to <= self.modulus {
            self.skip((to - self.residue % to) % to);
        } else {
            self.push(Step::Align(to), to);
        }
    }
}

/// Makes the steps of one plan.
struct Compiler<'a> {
    types: &'a Types,
    work_left: usize,
}

const TOO_LARGE: &str = "its message type is too large";

impl<'a> Compiler<'a> {
    /// Appends the steps to the field at a path within a type, up to its count or its alignment.
    fn descend(
        &mut self,
        root: &str,
        path: &[PathStep],
        steps: &mut Steps,
    ) -> Result<(&'a Kind, Count), String> {
        let mut owner = root;
        let mut path = path.iter().peekable();
        while let Some(step) = path.next() {
            let PathStep::Key(name) = step else { return Err(format!("{owner} is no list")) };
            let member = self.pass_to(owner, name, steps)?;
            let mut count = member.count;
            if let Some(index) = path.peek().and_then(|step| index(step)).filter(|_| count != Count::One) {
                path.next();
                self.enter(member, index, steps)?;
                count = Count::One;
            }
            match (&member.kind, path.peek()) {
                (kind, None) => return Ok((kind, count)),
                (_, Some(PathStep::Index(_))) => return Err(format!("'{name}' is no list")),
                (Kind::Message(_), _) if count != Count::One => {
                    return Err(format!("'{name}' is a list; say which element: {name}[0]"));
                }
                (Kind::Message(inner), _) => owner = inner,
                _ => return Err(format!("'{name}' has no parts")),
            }
        }
        Err("names no field".into())
    }

    /// Skips the fields before the named one.
    fn pass_to(&mut self, owner: &str, name: &str, steps: &mut Steps) -> Result<&'a Member, String> {
        let members = self.types.members(owner)?;
        for member in members {
            if member.name == name {
                return Ok(member);
            }
            self.over(member, member.count, 0, steps)?;
        }
        let known: Vec<&str> = members.iter().map(|member| member.name.as_str()).collect();
        let hint = match nearest(name, known.iter().copied()) {
            Some(near) => format!("; is it {near}?"),
            None => format!(" (there is: {})", known.join(", ")),
        };
        Err(format!("no field '{name}' in {owner}{hint}"))
    }

    fn is_message(&self, name: &str, path: &[PathStep]) -> String {
        let members = self.types.members(name).unwrap_or_default();
        let parts: Vec<&str> = members.iter().map(|member| member.name.as_str()).collect();
        let last = path.iter().rev().find_map(|step| match step {
            PathStep::Key(key) => Some(key.as_str()),
            PathStep::Index(_) => None,
        });
        format!("'{}' is a {name}; name one of its fields: {}", last.unwrap_or_default(), parts.join(", "))
    }

    fn enter(&mut self, member: &Member, index: usize, steps: &mut Steps) -> Result<(), String> {
        let mut element = Steps::anywhere();
        self.over(member, Count::One, 0, &mut element)?;
        steps.push(Step::Enter { count: member.count, index, element: element.list }, 1);
        Ok(())
    }

    /// Appends the steps over one field, or over one element of it.
    fn over(&mut self, member: &Member, count: Count, depth: usize, steps: &mut Steps) -> Result<(), String> {
        self.work_left = self.work_left.checked_sub(1).ok_or(TOO_LARGE)?;
        if depth > DEPTH_MAX {
            return Err("its message type nests too deep".into());
        }
        if let Some((align, size)) = self.uniform(&member.kind, depth)? {
            match count {
                Count::One | Count::Fixed(_) => {
                    let count = if let Count::Fixed(count) = count { count as usize } else { 1 };
                    if count > 0 {
                        steps.align(align);
                        steps.skip(size.checked_mul(count).ok_or(TOO_LARGE)?);
                    }
                }
                // After no elements it stands behind the count.
                Count::Free(_) => steps.push(Step::List { align, size }, align.min(4)),
            }
            return Ok(());
        }
        if count != Count::One {
            let mut element = Steps::anywhere();
            self.over(member, Count::One, depth + 1, &mut element)?;
            steps.push(Step::Each { count, element: element.list }, 1);
            return Ok(());
        }
        match &member.kind {
            Kind::Text(_) => steps.push(Step::Text, 1),
            Kind::WideText => return Err("a text of wide characters before it cannot be skipped".into()),
            Kind::Message(inner) => {
                for member in self.types.members(inner)? {
                    self.over(member, member.count, depth + 1, steps)?;
                }
            }
            Kind::Primitive(_) => {}
        }
        Ok(())
    }

    /// Alignment and size of what has no gaps wherever it stands: numbers of one size.
    fn uniform(&mut self, kind: &Kind, depth: usize) -> Result<Option<(usize, usize)>, String> {
        self.work_left = self.work_left.checked_sub(1).ok_or(TOO_LARGE)?;
        let members = match kind {
            Kind::Primitive(primitive) => return Ok(Some((primitive.size(), primitive.size()))),
            Kind::Message(name) if depth <= DEPTH_MAX => self.types.members(name)?,
            _ => return Ok(None),
        };
        // What has no fields stands as one byte.
        let mut whole = if members.is_empty() { Some((1, 1)) } else { None };
        for member in members {
            let Some((align, size)) = self.uniform(&member.kind, depth + 1)? else { return Ok(None) };
            let count = match member.count {
                Count::One => 1,
                Count::Fixed(count) => count as usize,
                Count::Free(_) => return Ok(None),
            };
            let size = size.checked_mul(count).ok_or(TOO_LARGE)?;
            whole = match whole {
                None => Some((align, size)),
                Some((same, before)) if same == align => {
                    Some((align, before.checked_add(size).ok_or(TOO_LARGE)?))
                }
                Some(_) => return Ok(None),
            };
        }
        Ok(whole)
    }
}

/// The index that a step says: `[1]`, or the name `1`.
fn index(step: &PathStep) -> Option<usize> {
    match step {
        PathStep::Index(index) => Some(*index),
        PathStep::Key(key) => key.parse().ok(),
    }
}

/// The position behind some steps.
fn run(steps: &[Step], body: Body<'_>, at: usize) -> Option<usize> {
    steps.iter().try_fold(at, |at, step| step.run(body, at))
}

impl Step {
    fn run(&self, body: Body<'_>, at: usize) -> Option<usize> {
        let end = match self {
            Step::Skip(size) => at.checked_add(*size)?,
            Step::Align(to) => aligned(at, *to)?,
            Step::Text => text(body, at)?.1,
            Step::List { align, size } => {
                let (count, at) = counted(body, at)?;
                if count == 0 { at } else { aligned(at, *align)?.checked_add(count.checked_mul(*size)?)? }
            }
            Step::Each { count, element } => {
                let (count, at) = count.read(body, at)?;
                each(count, element, body, at)?
            }
            Step::Enter { count, index, element } => {
                let (count, at) = count.read(body, at)?;
                if *index >= count { None } else { each(*index, element, body, at) }?
            }
        };
        (end <= body.bytes.len()).then_some(end)
    }
}

/// Every element takes a byte at least, so this ends with the message.
fn each(count: usize, element: &[Step], body: Body<'_>, at: usize) -> Option<usize> {
    if count > body.bytes.len() {
        return None;
    }
    (0..count).try_fold(at, |at, _| run(element, body, at))
}

impl Count {
    fn read(self, body: Body<'_>, at: usize) -> Option<(usize, usize)> {
        match self {
            Count::One => Some((1, at)),
            Count::Fixed(count) => Some((count as usize, at)),
            Count::Free(_) => counted(body, at),
        }
    }
}

/// A count and the position behind it.
fn counted(body: Body<'_>, at: usize) -> Option<(usize, usize)> {
    let at = aligned(at, 4)?;
    let bytes = *body.bytes.get(at..)?.first_chunk()?;
    let count = if body.is_big_endian { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) };
    Some((count as usize, at + 4))
}

fn aligned(at: usize, to: usize) -> Option<usize> {
    at.checked_next_multiple_of(to)
}

/// The text at a position without its closing zero, and the position behind it.
pub(crate) fn text<'a>(body: Body<'a>, at: usize) -> Option<(&'a [u8], usize)> {
    let (length, at) = counted(body, at)?;
    let end = at.checked_add(length)?;
    let text = body.bytes.get(at..end)?;
    Some((text.strip_suffix(&[0]).unwrap_or(text), end))
}

#[cfg(test)]
mod tests {
    use super::*;
    use shsa_message::path::Path;

    fn plan(types: &Types, message_type: &str, path: &str) -> Result<Plan, String> {
        Plan::new(types, message_type, &Path::parse(path).unwrap().steps)
    }

    #[track_caller]
    fn check(message_type: &str, path: &str, expected: &str) {
        let shown = match plan(&Types::standard(), message_type, path) {
            Ok(plan) => format!("{:?} {:?} {:?}", plan.steps, plan.target, plan.count),
            Err(problem) => problem,
        };
        assert_eq!(shown, expected);
    }

    #[test]
    fn plans_are_short() {
        check("std_msgs/msg/Float64", "", "[] Primitive(F64) One");
        check(
            "nav_msgs/msg/Odometry",
            "twist.twist.linear.x",
            "[Skip(8), Text, Text, Align(8), Skip(344)] Primitive(F64) One",
        );
        let skips = "[Skip(8), Text, Align(4), Skip(28)] Primitive(F32) Free(None)";
        check("sensor_msgs/msg/LaserScan", "ranges", skips);
        check("sensor_msgs/msg/NavSatFix", "header.stamp", "[] Time One");
        check(
            "tf2_msgs/msg/TFMessage",
            "transforms[2].transform.translation.z",
            "[Enter { count: Free(None), index: 2, element: [Align(4), Skip(8), Text, Text, Align(8), Skip(56)] }, \
             Align(4), Skip(8), Text, Text, Align(8), Skip(16)] Primitive(F64) One",
        );
    }

    #[test]
    fn what_is_not_there_is_said() {
        check(
            "nav_msgs/msg/Odometry",
            "twist.linear.x",
            "no field 'linear' in geometry_msgs/msg/TwistWithCovariance (there is: twist, covariance)",
        );
        check("nav_msgs/msg/Odometry", "twits", "no field 'twits' in nav_msgs/msg/Odometry; is it twist?");
        check(
            "nav_msgs/msg/Odometry",
            "pose.pose.position",
            "'position' is a geometry_msgs/msg/Point; name one of its fields: x, y, z",
        );
        check("nav_msgs/msg/Odometry", "child_frame_id.x", "'child_frame_id' has no parts");
        check(
            "tf2_msgs/msg/TFMessage",
            "transforms.transform",
            "'transforms' is a list; say which element: transforms[0]",
        );
        check("std_msgs/msg/Float64", "data[0]", "'data' is no list");
        check("bot/msg/None", "x", "the message type bot/msg/None is not known");
    }

    #[test]
    fn malicious_definitions_end() {
        let mut types = Types::default();
        types.add("m/A", "A again\nint8 last");
        assert_eq!(plan(&types, "m/msg/A", "last").unwrap_err(), "its message type nests too deep");
        for level in 0..9 {
            types.add(&format!("m/L{level}"), &format!("L{} x\n", level + 1).repeat(100));
        }
        types.add("m/L9", "string x");
        types.add("m/Deep", "L0 x\nint8 last");
        assert_eq!(plan(&types, "m/msg/Deep", "last").unwrap_err(), TOO_LARGE);
        types.add("m/Wide", "Big[4294967295] a\nint8 last");
        types.add("m/Big", "Bigger[4294967295] a");
        types.add("m/Bigger", "int64[4294967295] a");
        assert_eq!(plan(&types, "m/msg/Wide", "last").unwrap_err(), TOO_LARGE);
        types.add("m/Void", "");
        types.add("m/Voids", "Void[] a\nint8 last");
        let voids = plan(&types, "m/msg/Voids", "last").unwrap();
        let body = Body { bytes: &[255, 255, 255, 255, 0, 5], is_big_endian: false };
        assert_eq!(voids.locate(body), None);
        let body = Body { bytes: &[1, 0, 0, 0, 0, 5], is_big_endian: false };
        assert_eq!(voids.locate(body), Some(Place { at: 5, count: 1 }));
    }
}
