//! Dumps that these tests write as `mavlogdump` prints messages, and the dump of a copter's log.

use super::super::super::tests::collector::Collector;
use super::super::super::tests::independent::{
    Reader, check_cut, check_flipped, collected, collected_with, sample,
};
use super::super::binary;
use super::*;
use proptest::prelude::*;

const DUMP: Reader = |input, options, listener| read(input, options, listener);
const BINARY: Reader = |input, _options, listener| binary::read(input, listener);

/// A value of a field, its letter in a format and its bytes there.
#[derive(Clone, Debug)]
enum Cell {
    Whole(i64),
    Number(f64),
    Text(String),
    List(Vec<i16>),
}

impl Cell {
    fn letter(&self) -> (char, usize) {
        match self {
            Cell::Whole(_) => ('q', 8),
            Cell::Number(_) => ('d', 8),
            Cell::Text(_) => ('Z', 64),
            Cell::List(_) => ('a', 64),
        }
    }

    /// As Python's `str` shows it, and pymavlink a quiet not-a-number.
    fn text(&self) -> String {
        match self {
            Cell::Whole(whole) => whole.to_string(),
            Cell::Number(number) if number.is_nan() => "qnan".into(),
            Cell::Number(number) => format!("{number:?}"),
            Cell::Text(text) => text.clone(),
            Cell::List(items) => format!("array('h', {items:?})"),
        }
    }

    /// As Python's `json` writes it.
    fn json(&self) -> String {
        match self {
            Cell::Number(number) if number.is_infinite() => {
                if *number > 0.0 { "Infinity" } else { "-Infinity" }.into()
            }
            Cell::Number(number) => format!("{number:?}"),
            Cell::Text(text) => serde_json::to_string(text).unwrap(),
            Cell::List(items) => format!("{items:?}"),
            Cell::Whole(whole) => whole.to_string(),
        }
    }

    /// As the collector shows the value.
    fn shown(&self) -> String {
        match self {
            Cell::Number(number) => number.to_string(),
            Cell::Text(text) => format!("'{text}'"),
            Cell::List(items) => {
                format!("{:?}", items.iter().map(|item| f64::from(*item)).collect::<Vec<_>>())
            }
            Cell::Whole(whole) => whole.to_string(),
        }
    }
}

/// A line of a message, as text and as JSON, with a time of 2017-09-10 that is no better than 10 ms.
fn lines(name: &str, fields: &[(String, Cell)]) -> [String; 2] {
    let text: Vec<String> = fields.iter().map(|(name, cell)| format!("{name} : {}", cell.text())).collect();
    let json: Vec<String> =
        fields.iter().map(|(name, cell)| format!("\"{name}\": {}", cell.json())).collect();
    [
        format!("2017-09-10 10:49:22.70: {name} {{{}}}\n", text.join(", ")),
        format!(
            "{{\"meta\": {{\"type\": \"{name}\", \"timestamp\": 1505040562.709}}, \"data\": {{{}}}}}\n",
            json.join(", ")
        ),
    ]
}

fn text(text: &str) -> Cell {
    Cell::Text(text.to_owned())
}

/// The lines that define a kind and give its messages.
fn written(kind: usize, messages: &[Vec<Cell>]) -> [String; 2] {
    let name = format!("K{kind}");
    let named = |cells: &[Cell]| -> Vec<(String, Cell)> {
        cells.iter().enumerate().map(|(at, cell)| (format!("F{at}"), cell.clone())).collect()
    };
    let first: Vec<(char, usize)> = messages[0].iter().map(Cell::letter).collect();
    let columns: Vec<String> = named(&messages[0]).into_iter().map(|(name, _)| name).collect();
    let format = [
        ("Type".to_owned(), Cell::Whole(kind as i64)),
        ("Length".to_owned(), Cell::Whole(3 + first.iter().map(|(_, size)| *size as i64).sum::<i64>())),
        ("Name".to_owned(), text(&name)),
        ("Format".to_owned(), Cell::Text(first.iter().map(|(letter, _)| *letter).collect())),
        ("Columns".to_owned(), Cell::Text(columns.join(","))),
    ];
    let all = messages.iter().map(|cells| lines(&name, &named(cells)));
    std::iter::once(lines("FMT", &format))
        .chain(all)
        .fold(Default::default(), |[text, json]: [String; 2], more| [text + &more[0], json + &more[1]])
}

/// Messages of one kind: texts may hold anything of the notation but the name of the next field.
fn messages() -> impl Strategy<Value = Vec<Vec<Cell>>> {
    let letters = prop::collection::vec(0..4_u8, 1..6);
    let cell = |letter: u8| match letter {
        0 => any::<i64>().prop_map(Cell::Whole).boxed(),
        1 => any::<f64>().prop_map(Cell::Number).boxed(),
        2 => "([a-z][a-z ,:{}\"'=0-9]{0,20}[a-z}])?".prop_map(Cell::Text).boxed(),
        _ => prop::collection::vec(any::<i16>(), 1..5).prop_map(Cell::List).boxed(),
    };
    letters.prop_flat_map(move |letters| {
        prop::collection::vec(letters.into_iter().map(cell).collect::<Vec<_>>(), 1..5)
    })
}

proptest! {
    #[test]
    fn every_value_is_read_from_text_and_from_json(kinds in prop::collection::vec(messages(), 1..5)) {
        let kinds: Vec<(usize, Vec<Vec<Cell>>)> = kinds.into_iter().enumerate().collect();
        for form in [0, 1] {
            let dump: String = kinds.iter().map(|(kind, messages)| written(*kind, messages)[form].clone()).collect();
            prop_assert!(is_log(dump.as_bytes()));
            let all = collected(DUMP, dump.as_bytes());
            prop_assert_eq!(&all.damages, &[]);
            for (kind, messages) in &kinds {
                for field in 0..messages[0].len() {
                    let found = all.column(&format!("K{kind}"), &format!("F{field}"));
                    let found: Vec<String> = found.into_iter().map(|(_, value)| value).collect();
                    let expected: Vec<String> = messages.iter().map(|cells| cells[field].shown()).collect();
                    prop_assert_eq!(found, expected, "{}", dump);
                }
            }
        }
    }
}

/// A log as both forms of a dump, from what the reader of the log reports.
fn dumped(log: &Collector) -> [String; 2] {
    let mut all: Vec<(Times, [String; 2])> = Vec::new();
    for (shown, topic) in log.shown().iter().zip(&log.topics) {
        let (names, fields) = shown.split_once(": ").unwrap();
        let names = names.split_once(' ').unwrap().0;
        let fields: Vec<&str> = fields.rsplit_once(" x").unwrap().0.split(", ").collect();
        let fields: Vec<&str> = fields.iter().map(|field| field.split(" [").next().unwrap()).collect();
        for (times, values) in &topic.messages {
            let cell = |value: &String| match value.strip_prefix('\'') {
                Some(quoted) => Cell::Text(quoted.trim_end_matches('\'').to_owned()),
                None => value.parse().map_or_else(|_| Cell::Number(value.parse().unwrap()), Cell::Whole),
            };
            let named = fields.iter().map(|field| (*field).to_owned()).zip(values.iter().map(cell));
            all.push((*times, lines(names, &named.collect::<Vec<_>>())));
        }
    }
    all.sort_by_key(|(times, _)| times.received);
    [0, 1].map(|form| all.iter().map(|(_, lines)| lines[form].as_str()).collect())
}

#[test]
fn the_dump_of_a_copters_log_holds_what_the_log_does() {
    let Some(bytes) = sample("dataflash/log.bin") else { return };
    let log = collected(BINARY, &bytes);
    for dump in dumped(&log) {
        let all = collected(DUMP, dump.as_bytes());
        assert_eq!((&all.damages, all.count()), (&Vec::new(), log.count()));
        for topic in &log.topics {
            let found = all.topics.iter().find(|known| known.full == topic.full).unwrap();
            let sorted = |messages: &[(Times, Vec<String>)]| {
                let mut all: Vec<_> =
                    messages.iter().map(|(times, values)| (times.received, values.clone())).collect();
                all.sort();
                all
            };
            // These have no time of their own, and that of their neighbours, which have another order here.
            if topic.name != "FMT" && topic.name != "PARM" {
                assert_eq!(sorted(&found.messages), sorted(&topic.messages), "{}", topic.full);
            }
        }
        let begin = &dump.as_bytes()[..200_000];
        check_cut(DUMP, begin);
        check_flipped(DUMP, begin, 0.85);
    }
}

#[test]
fn telemetry_has_the_times_of_its_lines_and_its_senders() {
    let text = "2020-07-01 12:00:00.25: ATTITUDE {time_boot_ms : 5, roll : 0.5, q : [1.0, 0.0]} srcSystem=1 srcComponent=2 seq=9\n\
                2020-07-01 12:00:00.50: BAD_DATA {Bad prefix, data:['fe']} srcSystem=1 srcComponent=2 seq=0\nlost 3 messages\n\
                2020-07-01 12:00:00.75: ATTITUDE {time_boot_ms : 7, roll : qnan, more : 1} srcSystem=1 srcComponent=2 seq=10\n\
                2020-07-01 12:00:00.75: ATTITUDE {time_boot_ms : 8, roll : 2.5, q : [1.0, 0.5]} srcSystem=3 srcComponent=2\n\
                2020-07-01 12:00:00.90: ATTITUDE {time_boot_ms : 9, ro\n\
                2020-07-01 12:00:01.00: ATTITUDE {time_boot_ms : 9, roll : 2.5} srcSystem=3 srcCom";
    let zone: Zone = "+02:00".parse().unwrap();
    let all = collected_with(DUMP, text.as_bytes(), &ReadOptions { zone, ..ReadOptions::default() });
    let ten = 1_593_597_600_000_000_000;
    let one = "ATTITUDE[srcSystem=1][srcComponent=2]";
    let at = |ms: i64, value: &str| (ten + ms * 1_000_000, value.to_owned());
    assert_eq!(all.column(one, "roll"), [at(250, "0.5"), at(750, "NaN")]);
    assert_eq!(all.column(one, "q[1]")[0], at(250, "0.0"));
    assert_eq!(all.column("ATTITUDE[srcSystem=3][srcComponent=2]", "q"), [at(750, "[1.0, 0.5]")]);
    let places: Vec<Place> = all.damages.iter().map(|(place, _)| *place).collect();
    assert_eq!(places, [Place::Line(6), Place::Line(7)]);
    assert_eq!(all.notes, [(Place::Whole, "2 lines hold no message".to_owned())]);
}

#[test]
fn a_dump_without_messages_of_gps_is_tied_by_its_first_line() {
    let [text, json] = [0, 1].map(|form| {
        let line =
            |us: i64| lines("IMU", &[("TimeUS".into(), Cell::Whole(us)), ("X".into(), Cell::Whole(us))]);
        [line(1_000_000), line(1_002_500)].map(|lines| lines[form].clone()).concat()
    });
    for (dump, first) in [(text, 700_000_000), (json, 709_000_000)] {
        let all = collected(DUMP, dump.as_bytes());
        let first = 1_505_040_562_000_000_000 + first;
        let times: Vec<i64> = all.column("IMU", "X").into_iter().map(|(time, _)| time).collect();
        assert_eq!(times, [first, first + 2_500_000], "{dump}");
    }
}
