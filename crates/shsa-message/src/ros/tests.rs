//! Tests with messages of ROS 1: fields are found by their definitions, and garbage is rejected.

use super::*;
use crate::MessageError;
use crate::path::{Path, Step};

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

/// A message of the type: the wire has only its fields, one after the other.
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

fn plan(types: &Types, root: &str, path: &str) -> Result<Plan, MessageError> {
    let steps = if path.is_empty() { vec![Step::Key(String::new())] } else { Path::parse(path)?.steps };
    Plan::new(types, Layout::Packed, root, &steps)
}

/// The values of a plan's field.
fn taken(plan: &Plan, message: &[u8]) -> Option<String> {
    let body = Body::packed(message);
    let place = plan.locate(body)?;
    let texts = || {
        let next = |at: &mut usize, _| {
            let (text, end) = body.text(*at)?;
            *at = end;
            Some(String::from_utf8_lossy(text).into_owned())
        };
        (0..place.count).scan(place.at, next).collect::<Vec<_>>()
    };
    match (plan.target, plan.count) {
        (Target::Time, _) => body.time(place.at).map(|time| format!("Time({})", time.0)),
        (Target::Text, Count::One) => texts().first().map(|text| format!("Text({text:?})")),
        (Target::Text, _) => Some(format!("Texts({:?})", texts())),
        _ => plan.value(body, None).map(|value| format!("{value:?}")),
    }
}

#[track_caller]
fn check(path: &str, expected: &str) {
    let shown = match plan(&Types::of_bag("bot/Robot", ROBOT), "bot/Robot", path) {
        Err(problem) => format!("error: {problem}"),
        Ok(plan) => taken(&plan, &message()).unwrap_or("nothing".into()),
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
fn a_field_of_each_element_is_a_list() {
    let of_each = |path: &str, message: &[u8]| {
        let plan = plan(&Types::of_bag("bot/Robot", ROBOT), "bot/Robot", path).unwrap();
        let body = Body::packed(message);
        assert_eq!(plan.locate(body), None);
        format!("{:?} {:?}", plan.value(body, None), plan.value(body, Some(1)))
    };
    assert_eq!(of_each("parts[].size", &message()), "Some(Vector([-4.0, 9.0])) Some(Number(9.0))");
    assert_eq!(of_each("parts[].label", &message()), "None None");
    for length in 0..message().len() {
        let cut = of_each("parts[].size", &message()[..length]);
        assert!(
            ["None None", "Some(Vector([-4.0, 9.0])) Some(Number(9.0))"].contains(&cut.as_str()),
            "{cut}"
        );
    }
    check("flag[].set", "error: 'flag' is no list");
    check("names[].x", "error: 'names' has no parts");
    check("parts[].sise", "error: no field 'sise' in bot/Part; is it size?");
}

#[test]
fn what_is_not_there_is_nothing_or_an_error() {
    check("ranges[2]", "nothing");
    check("parts[9].size", "nothing");
    check("names", "Texts([\"a\", \"bcd\"])");
    check("parts", "nothing");
    check(
        "parts.size",
        "error: 'parts' is a list; say which element, parts[0], or take all of them, parts[]",
    );
    check("flag.sett", "error: no field 'sett' in other/Flag; is it set?");
    check("lag.secs", "error: 'lag' has no parts");
    check("flag[0]", "error: 'flag' is no list");
    check("", "error: no field '' in bot/Robot (there is: header, names, parts, pair, flag, ranges, lag)");
}

#[test]
fn a_message_cut_anywhere_gives_nothing_past_the_cut() {
    let plan = plan(&Types::of_bag("bot/Robot", ROBOT), "bot/Robot", "ranges").unwrap();
    let whole = message();
    for length in 0..whole.len() - 8 {
        assert_eq!(taken(&plan, &whole[..length]), None, "cut at {length}");
    }
    assert!(taken(&plan, &whole[..whole.len() - 8]).is_some());
}

#[test]
fn plans_are_short() {
    let plan = plan(&Types::of_bag("bot/Robot", ROBOT), "bot/Robot", "pair[1]").unwrap();
    let shown = format!("{plan:?}");
    let names = "Each { count: Free(None), element: [Text] }";
    let parts = "Each { count: Free(None), element: [Text, Skip(2)] }";
    let pair = "Enter { count: Fixed(2), index: 1, element: [Skip(8)] }";
    let steps = format!("Plan {{ steps: [Skip(12), Text, {names}, {parts}, {pair}]");
    assert!(shown.starts_with(&steps), "{shown}");
}

#[test]
fn malicious_definitions_end() {
    #[track_caller]
    fn check(definition: &str, expected: &str) {
        let problem = plan(&Types::of_bag("m/A", definition), "m/A", "last").unwrap_err();
        assert_eq!(problem.to_string(), expected);
    }
    check("A again\nint8 last", "its message type nests too deep");
    check("B b\nint8 last", "the message type m/B is not known; is it m/A?");
    check("Wide[18446744073709551615] b\nint8 last\nMSG: m/Wide\ntime a", "its message type is too large");
    let level = |n: usize| format!("MSG: m/L{n}\n{}", format!("L{} x\n", n + 1).repeat(100));
    let nested: String = (0..9).map(level).collect();
    check(&format!("L0 a\nint8 last\n{nested}MSG: m/L9\nint8 x"), "its message type is too large");
}

#[test]
fn lists_of_nothing_take_no_time() {
    let types = Types::of_bag("m/A", "Void[4294967295] a\nVoid[] b\nint8 last\nMSG: m/Void\n");
    let plan = plan(&types, "m/A", "last").unwrap();
    assert_eq!(taken(&plan, &[255, 255, 255, 255, 5]).as_deref(), Some("Number(5.0)"));
    // Neither do lists of messages with empty lists.
    let types = Types::of_bag("m/A", "Empty[] b\nint8 last\nMSG: m/Empty\nstring[0] a\n");
    let plan = super::tests::plan(&types, "m/A", "last").unwrap();
    assert_eq!(taken(&plan, &[255, 255, 255, 255, 5]).as_deref(), Some("Number(5.0)"));
}
