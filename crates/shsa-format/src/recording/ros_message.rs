//! ROS 1 messages: from the text of a definition to a flat plan that reads one field and skips the rest.
//!
//! Definition language: <http://wiki.ros.org/msg>; on the wire all is packed, little endian, lists and texts after a
//! count of four bytes.

use std::collections::BTreeMap;

use super::names;
use super::rosbag::time_ns;

/// So many fields may be looked at for one plan: definitions nest, and a malicious one nests exponentially.
const WORK_MAX: usize = 100_000;
/// Types may nest so deep.
const DEPTH_MAX: usize = 64;

/// The types of one definition text, by full name (`nav_msgs/Odometry`).
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Definition {
    types: BTreeMap<String, Vec<Field>>,
    root: String,
}

#[derive(Clone, Debug, PartialEq)]
struct Field {
    name: String,
    kind: Kind,
    count: Count,
}

#[derive(Clone, Debug, PartialEq)]
enum Kind {
    Primitive(Primitive),
    Text,
    Message(String),
}

/// How many values a field holds.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Count {
    One,
    Fixed(usize),
    /// Said on the wire.
    Free,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Primitive {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
    Time,
    Duration,
}

/// What a plan found in a message.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Taken {
    /// A number; a duration in seconds.
    Number(f64),
    /// A list of numbers.
    Vector(Vec<f64>),
    /// A point in time in nanoseconds.
    Time(i64),
    /// A text.
    Text(String),
    /// A list of texts.
    Texts(Vec<String>),
}

/// How one field is read from the bytes of a message.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Plan {
    steps: Vec<Step>,
    kind: Kind,
    count: Count,
}

#[derive(Clone, Debug, PartialEq)]
enum Step {
    /// So many bytes.
    Skip(usize),
    /// As many elements of this size as the wire says: texts, and lists of numbers.
    SkipSized(usize),
    /// Elements of changing size, each by these steps.
    SkipEach(Count, Vec<Step>),
    /// To one element of a list that must be longer than the index.
    Enter { index: usize, count: Count, element: Vec<Step> },
}

impl Definition {
    /// Reads a definition text: the fields of the type `root`, then those of the types that it uses, each after a line of
    /// `=` and a line `MSG: package/Type`. Lines that are no field are passed over.
    pub(super) fn parse(root: &str, text: &str) -> Definition {
        let mut types: BTreeMap<String, Vec<Field>> = BTreeMap::new();
        let mut current = root.to_owned();
        types.insert(current.clone(), Vec::new());
        for line in text.lines().map(str::trim) {
            if let Some(name) = line.strip_prefix("MSG:") {
                current = name.trim().to_owned();
                types.insert(current.clone(), Vec::new());
            } else if let Some(field) = field(line, &current) {
                types.entry(current.clone()).or_default().push(field);
            }
        }
        Definition { types, root: root.to_owned() }
    }

    /// A plan for the field at a path: `twist.twist.linear.x`, `ranges`, `position[1]`, `transforms[0].header.stamp`.
    ///
    /// # Errors
    /// Says which part of the path is not there, and what is.
    pub(super) fn plan(&self, path: &str) -> Result<Plan, String> {
        let mut compiler = Compiler { types: &self.types, work_left: WORK_MAX, steps: Vec::new() };
        let (kind, count) = compiler.descend(&self.root, path)?;
        Ok(Plan { steps: compiler.steps, kind, count })
    }

    /// Whether messages of this type begin with a header.
    pub(super) fn has_header(&self) -> bool {
        let first = self.types.get(&self.root).and_then(|fields| fields.first());
        first.is_some_and(|field| {
            field.name == "header" && field.kind == Kind::Message("std_msgs/Header".into())
        })
    }
}

/// A field of a definition's line; `None` for comments, constants, blank lines.
fn field(line: &str, owner: &str) -> Option<Field> {
    let line = line.split('#').next()?;
    let (kind, name) = line.trim().split_once(char::is_whitespace)?;
    let name = name.trim();
    if name.contains('=') || name.is_empty() || kind.starts_with('=') {
        return None;
    }
    let (kind, count) = match kind.strip_suffix(']').and_then(|open| open.split_once('[')) {
        None => (kind, Count::One),
        Some((kind, "")) => (kind, Count::Free),
        Some((kind, size)) => (kind, Count::Fixed(size.parse().ok()?)),
    };
    Some(Field { name: name.to_owned(), kind: kind_of(kind, owner), count })
}

fn kind_of(kind: &str, owner: &str) -> Kind {
    let primitive = match kind {
        "int8" | "byte" => Primitive::I8,
        "uint8" | "char" | "bool" => Primitive::U8,
        "int16" => Primitive::I16,
        "uint16" => Primitive::U16,
        "int32" => Primitive::I32,
        "uint32" => Primitive::U32,
        "int64" => Primitive::I64,
        "uint64" => Primitive::U64,
        "float32" => Primitive::F32,
        "float64" => Primitive::F64,
        "time" => Primitive::Time,
        "duration" => Primitive::Duration,
        "string" => return Kind::Text,
        "Header" => return Kind::Message("std_msgs/Header".into()),
        full if full.contains('/') => return Kind::Message(full.into()),
        near => {
            let package = owner.split_once('/').map_or("", |(package, _)| package);
            return Kind::Message(format!("{package}/{near}"));
        }
    };
    Kind::Primitive(primitive)
}

/// Makes the steps of one plan.
struct Compiler<'a> {
    types: &'a BTreeMap<String, Vec<Field>>,
    work_left: usize,
    steps: Vec<Step>,
}

impl<'a> Compiler<'a> {
    /// Appends the steps to the start of the field at a path within a type, and gives what is there.
    fn descend(&mut self, root: &str, path: &str) -> Result<(Kind, Count), String> {
        let mut owner = root.to_owned();
        let mut parts = path.split('.').peekable();
        while let Some(part) = parts.next() {
            let (name, index) = split_index(part)?;
            let field = self.pass_to(&owner, name)?;
            let count = match index {
                Some(index) => self.enter(field, index)?,
                None => field.count,
            };
            match &field.kind {
                kind if parts.peek().is_none() => return Ok((kind.clone(), count)),
                Kind::Message(_) if count != Count::One => {
                    return Err(format!("'{name}' is a list; say which element: {name}[0]"));
                }
                Kind::Message(inner) => owner.clone_from(inner),
                _ => return Err(format!("'{name}' has no parts")),
            }
        }
        Err("names no field".into())
    }

    /// Skips the fields before the named one.
    fn pass_to(&mut self, owner: &str, name: &str) -> Result<&'a Field, String> {
        let fields = self.fields(owner)?;
        for field in fields {
            if field.name == name {
                return Ok(field);
            }
            let steps = self.over(field, 0)?;
            for step in steps {
                push(&mut self.steps, step);
            }
        }
        let known = fields.iter().map(|field| field.name.as_str());
        Err(format!("no field '{name}' in {owner}{}", names::hint(name, known)))
    }

    fn enter(&mut self, field: &Field, index: usize) -> Result<Count, String> {
        if field.count == Count::One {
            return Err(format!("'{}' is no list", field.name));
        }
        let one = Field { count: Count::One, ..field.clone() };
        let element = self.over(&one, 0)?;
        self.steps.push(Step::Enter { index, count: field.count, element });
        Ok(Count::One)
    }

    fn fields(&self, name: &str) -> Result<&'a [Field], String> {
        self.types
            .get(name)
            .map(Vec::as_slice)
            .ok_or_else(|| format!("the type {name} is not defined in the bag"))
    }

    /// The steps over one field.
    fn over(&mut self, field: &Field, depth: usize) -> Result<Vec<Step>, String> {
        self.work_left = self.work_left.checked_sub(1).ok_or("its message type is too large")?;
        let element = match &field.kind {
            Kind::Primitive(primitive) => vec![Step::Skip(primitive.size())],
            Kind::Text => vec![Step::SkipSized(1)],
            Kind::Message(_) if depth > DEPTH_MAX => return Err("its message type nests too deep".into()),
            Kind::Message(inner) => {
                let mut steps = Vec::new();
                for field in self.fields(inner)? {
                    self.over(field, depth + 1)?.into_iter().for_each(|step| push(&mut steps, step));
                }
                steps
            }
        };
        let size = match element.as_slice() {
            [] => Some(0),
            [Step::Skip(size)] => Some(*size),
            _ => None,
        };
        Ok(match (field.count, size) {
            (Count::One, _) => element,
            (Count::Fixed(count), Some(size)) => {
                vec![Step::Skip(count.checked_mul(size).ok_or("its message type is too large")?)]
            }
            (Count::Free, Some(size)) => vec![Step::SkipSized(size)],
            (count, None) => vec![Step::SkipEach(count, element)],
        })
    }
}

/// Appends a step; skips of fixed sizes become one. Nothing to skip is no step.
fn push(steps: &mut Vec<Step>, step: Step) {
    match (steps.last_mut(), step) {
        (_, Step::Skip(0)) => {}
        (Some(Step::Skip(before)), Step::Skip(more)) => *before = before.saturating_add(more),
        (_, step) => steps.push(step),
    }
}

/// `position[1]` is the name and the index.
fn split_index(part: &str) -> Result<(&str, Option<usize>), String> {
    match part.strip_suffix(']').and_then(|open| open.split_once('[')) {
        None => Ok((part.trim(), None)),
        Some((name, index)) => match index.trim().parse() {
            Ok(index) => Ok((name.trim(), Some(index))),
            Err(_) => Err(format!("'[{index}]' is no index; write it like {name}[0]")),
        },
    }
}

impl Plan {
    /// Whether the plan gives a number or a list of numbers.
    pub(super) fn is_numeric(&self) -> bool {
        matches!(self.kind, Kind::Primitive(_))
    }

    /// Whether the plan gives a number, a text, or a list of texts.
    pub(super) fn is_comparable(&self) -> bool {
        match self.kind {
            Kind::Primitive(_) => self.count == Count::One,
            Kind::Text => true,
            Kind::Message(_) => false,
        }
    }

    /// Reads the field; `None` when the message is too short or a list has no such element. At most `O(message)`.
    pub(super) fn run(&self, message: &[u8]) -> Option<Taken> {
        let mut rest = message;
        for step in &self.steps {
            rest = step.run(rest)?;
        }
        match (&self.kind, self.count) {
            (Kind::Primitive(primitive), Count::One) => primitive.read(rest),
            (Kind::Primitive(primitive), count) => {
                let (count, rest) = counted(count, rest)?;
                let bytes = rest.get(..count.checked_mul(primitive.size())?)?;
                let values = bytes.chunks_exact(primitive.size()).map(|bytes| primitive.value(bytes));
                values.collect::<Option<_>>().map(Taken::Vector)
            }
            (Kind::Text, Count::One) => text(rest).map(|(text, _)| Taken::Text(text)),
            (Kind::Text, count) => texts(count, rest).map(Taken::Texts),
            _ => None,
        }
    }
}

fn text(bytes: &[u8]) -> Option<(String, &[u8])> {
    let (count, rest) = counted(Count::Free, bytes)?;
    let (text, rest) = rest.split_at_checked(count)?;
    Some((String::from_utf8_lossy(text).into_owned(), rest))
}

fn texts(count: Count, bytes: &[u8]) -> Option<Vec<String>> {
    let (count, mut rest) = counted(count, bytes)?;
    let mut texts = Vec::new();
    for _ in 0..count {
        let (text, after) = text(rest)?;
        texts.push(text);
        rest = after;
    }
    Some(texts)
}

impl Step {
    /// What follows in the message.
    fn run<'a>(&self, message: &'a [u8]) -> Option<&'a [u8]> {
        match self {
            Step::Skip(size) => message.get(*size..),
            Step::SkipSized(size) => {
                let (count, rest) = counted(Count::Free, message)?;
                rest.get(count.checked_mul(*size)?..)
            }
            Step::SkipEach(count, element) => {
                let (count, rest) = counted(*count, message)?;
                skip(count, element, rest)
            }
            Step::Enter { index, count, element } => {
                let (count, rest) = counted(*count, message)?;
                if *index >= count { None } else { skip(*index, element, rest) }
            }
        }
    }
}

/// Skips elements one by one. Ends with the message: an element without size is skipped in one go.
fn skip<'a>(count: usize, element: &[Step], message: &'a [u8]) -> Option<&'a [u8]> {
    match element {
        [] => Some(message),
        [Step::Skip(size)] => message.get(count.checked_mul(*size)?..),
        _ => {
            (0..count).try_fold(message, |rest, _| element.iter().try_fold(rest, |rest, step| step.run(rest)))
        }
    }
}

fn counted(count: Count, message: &[u8]) -> Option<(usize, &[u8])> {
    match count {
        Count::One => Some((1, message)),
        Count::Fixed(count) => Some((count, message)),
        Count::Free => {
            let (count, rest) = message.split_first_chunk()?;
            Some((u32::from_le_bytes(*count) as usize, rest))
        }
    }
}

impl Primitive {
    fn size(self) -> usize {
        match self {
            Primitive::I8 | Primitive::U8 => 1,
            Primitive::I16 | Primitive::U16 => 2,
            Primitive::I32 | Primitive::U32 | Primitive::F32 => 4,
            Primitive::I64 | Primitive::U64 | Primitive::F64 | Primitive::Time | Primitive::Duration => 8,
        }
    }

    fn read(self, bytes: &[u8]) -> Option<Taken> {
        match self {
            Primitive::Time => time_ns(bytes).map(Taken::Time),
            _ => self.value(bytes).map(Taken::Number),
        }
    }

    fn value(self, bytes: &[u8]) -> Option<f64> {
        Some(match self {
            Primitive::I8 => i8::from_le_bytes(*bytes.first_chunk()?).into(),
            Primitive::U8 => u8::from_le_bytes(*bytes.first_chunk()?).into(),
            Primitive::I16 => i16::from_le_bytes(*bytes.first_chunk()?).into(),
            Primitive::U16 => u16::from_le_bytes(*bytes.first_chunk()?).into(),
            Primitive::I32 => i32::from_le_bytes(*bytes.first_chunk()?).into(),
            Primitive::U32 => u32::from_le_bytes(*bytes.first_chunk()?).into(),
            Primitive::I64 => i64::from_le_bytes(*bytes.first_chunk()?) as f64,
            Primitive::U64 => u64::from_le_bytes(*bytes.first_chunk()?) as f64,
            Primitive::F32 => f32::from_le_bytes(*bytes.first_chunk()?).into(),
            Primitive::F64 => f64::from_le_bytes(*bytes.first_chunk()?),
            Primitive::Time => time_ns(bytes)? as f64 * 1e-9,
            Primitive::Duration => {
                let seconds = i32::from_le_bytes(*bytes.first_chunk()?);
                let nanoseconds = i32::from_le_bytes(*bytes.get(4..)?.first_chunk()?);
                f64::from(seconds) + f64::from(nanoseconds) * 1e-9
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROBOT: &str = "\
# a comment
uint8 OK=0
string NAME=robot # one
Header header
string[] names
Part[] parts
float64[2] pair # two of them
other/Flag flag
float32[] ranges
duration lag
================================================================================
MSG: std_msgs/Header
uint32 seq
time stamp
string frame_id
================
MSG: bot/Part
string label
int16 size
================
MSG: other/Flag
bool set
";

    /// A message as its type says: the wire is only its fields, one after the other.
    fn message() -> Vec<u8> {
        let text = |text: &str| [&(text.len() as u32).to_le_bytes(), text.as_bytes()].concat();
        let part = |label: &str, size: i16| [text(label), size.to_le_bytes().into()].concat();
        let floats = [1.5_f32, f32::INFINITY].map(f32::to_le_bytes).concat();
        [
            7_u32.to_le_bytes().to_vec(),
            3_u32.to_le_bytes().to_vec(),
            500_u32.to_le_bytes().to_vec(),
            text("base"),
            2_u32.to_le_bytes().to_vec(),
            text("a"),
            text("bcd"),
            2_u32.to_le_bytes().to_vec(),
            part("left", -4),
            part("right wheel", 9),
            [0.25_f64, -0.5].map(f64::to_le_bytes).concat(),
            vec![1],
            2_u32.to_le_bytes().to_vec(),
            floats,
            (-1_i32).to_le_bytes().to_vec(),
            500_000_000_i32.to_le_bytes().to_vec(),
        ]
        .concat()
    }

    #[track_caller]
    fn check(path: &str, expected: &str) {
        let shown = match Definition::parse("bot/Robot", ROBOT).plan(path) {
            Err(problem) => format!("error: {problem}"),
            Ok(plan) => plan.run(&message()).map_or("nothing".into(), |taken| format!("{taken:?}")),
        };
        assert_eq!(shown, expected);
    }

    #[test]
    fn fields_are_read_by_path() {
        check("header.seq", "Number(7.0)");
        check("header.stamp", "Time(3000000500)");
        check("header.frame_id", "Text(\"base\")");
        check("parts[0].label", "Text(\"left\")");
        check("parts[1].size", "Number(9.0)");
        check("pair", "Vector([0.25, -0.5])");
        check("pair[1]", "Number(-0.5)");
        check("flag.set", "Number(1.0)");
        check("ranges", "Vector([1.5, inf])");
        check("ranges[0]", "Number(1.5)");
        check("lag", "Number(-0.5)");
        check("names[1]", "Text(\"bcd\")");
    }

    #[test]
    fn what_is_not_there_is_nothing_or_an_error() {
        check("ranges[2]", "nothing");
        check("parts[9].size", "nothing");
        check("names", "Texts([\"a\", \"bcd\"])");
        check("parts", "nothing");
        check("parts.size", "error: 'parts' is a list; say which element: parts[0]");
        check("flag.sett", "error: no field 'sett' in other/Flag; did you mean 'set'? (there is: set)");
        check("lag.secs", "error: 'lag' has no parts");
        check("flag[0]", "error: 'flag' is no list");
        check("ranges[x]", "error: '[x]' is no index; write it like ranges[0]");
        check(
            "",
            "error: no field '' in bot/Robot (there is: header, names, parts, pair, flag, ranges, lag)",
        );
    }

    #[test]
    fn a_message_cut_anywhere_gives_nothing_past_the_cut() {
        let definition = Definition::parse("bot/Robot", ROBOT);
        let plan = definition.plan("ranges").unwrap();
        let whole = message();
        for length in 0..whole.len() - 8 {
            assert_eq!(plan.run(&whole[..length]), None, "cut at {length}");
        }
        assert!(plan.run(&whole[..whole.len() - 8]).is_some());
    }

    #[test]
    fn plans_are_short() {
        let plan = Definition::parse("bot/Robot", ROBOT).plan("pair[1]").unwrap();
        let shown = format!("{:?}", plan.steps);
        assert_eq!(
            shown,
            "[Skip(12), SkipSized(1), SkipEach(Free, [SkipSized(1)]), SkipEach(Free, [SkipSized(1), Skip(2)]), \
             Enter { index: 1, count: Fixed(2), element: [Skip(8)] }]"
        );
    }

    #[test]
    fn malicious_definitions_end() {
        #[track_caller]
        fn check(definition: &str, expected: &str) {
            let plan = Definition::parse("m/A", definition).plan("last");
            assert_eq!(plan.map(|_| ()), Err(expected.to_owned()));
        }
        check("A again\nint8 last", "its message type nests too deep");
        check("B b\nint8 last", "the type m/B is not defined in the bag");
        check(
            "Wide[18446744073709551615] b\nint8 last\nMSG: m/Wide\ntime a",
            "its message type is too large",
        );
        let level = |n: usize| format!("MSG: m/L{n}\n{}", format!("L{} x\n", n + 1).repeat(100));
        let nested: String = (0..9).map(level).collect();
        check(&format!("L0 a\nint8 last\n{nested}MSG: m/L9\nint8 x"), "its message type is too large");
    }

    #[test]
    fn lists_of_nothing_take_no_time() {
        let definition = Definition::parse("m/A", "Void[4294967295] a\nVoid[] b\nint8 last\nMSG: m/Void\n");
        let plan = definition.plan("last").unwrap();
        assert_eq!(plan.run(&[255, 255, 255, 255, 5]), Some(Taken::Number(5.0)));
    }
}
