//! Parquet files written by hand, files beside the results of an independent reader, and damaged files.

use super::super::tests::independent::{Reader, check_values, collected, counted, expected, sample};
use super::super::tests::parquet_writer::{moments, small};
use super::super::{Wanted, read_bytes};
use super::*;
use shsa_core::observation::RawValue;
use std::path::Path;

const READ: Reader = read;

#[test]
fn numbers_texts_and_lists_are_read() {
    let all = collected(READ, &small());
    assert_eq!(all.shown(), ["log log: time [ns], v [m/s] [m/s], name, ranges x3"]);
    let second = 1_000_000_000;
    let values =
        |field: &str| all.column("log", field).into_iter().map(|(_, value)| value).collect::<Vec<_>>();
    assert_eq!(all.column("log", "v [m/s]")[2], (1_700_000_002 * second, "2.5".to_owned()));
    assert_eq!(values("v [m/s]"), ["1.5", "-", "2.5"]);
    assert_eq!(values("name"), ["'a'", "'bc'", "'d'"]);
    assert_eq!(values("ranges"), ["[1.0, 2.0]", "-", "[3.0]"]);
    assert!(all.damages.is_empty() && all.notes.is_empty(), "{:?} {:?}", all.damages, all.notes);
}

#[test]
fn the_time_is_a_column_that_has_some() {
    let mut times: Vec<Option<i64>> = (0..200).map(|second| Some(second * 1_000_000)).collect();
    times[..150].fill(None);
    let all = collected(READ, &moments(&[("installed", &[None; 200]), ("read_at", &times)]));
    let column = all.column("log", "read_at");
    assert_eq!((column.len(), column[0].0), (50, 150_000_000_000));
    assert_eq!(all.damages, [(Place::Whole, "150 rows have no time; left out".into())]);
}

#[test]
fn a_page_that_is_lost_is_told_by_its_place() {
    let mut bytes = small();
    let at = bytes.windows(5).position(|it| it == [3, 0b101, 1, 3, 0b10]).unwrap();
    // More bits for a number than there are.
    bytes[at + 2] = 40;
    let all = collected(READ, &bytes);
    let values: Vec<String> = all.column("log", "v [m/s]").into_iter().map(|(_, value)| value).collect();
    assert_eq!((values, all.count()), (vec!["-".to_owned(); 3], 3));
    let (place, what) = &all.damages[0];
    assert!(matches!(place, Place::Offset(at) if *at > 4), "{place:?}");
    assert_eq!(what, "a page cannot be read (encoding 8); 3 values of 'v [m/s]' are missing");
}

#[test]
fn pages_that_are_odd_are_read() {
    let values = |file: &str, field: &str| -> Option<Vec<String>> {
        let path = Path::new("log.parquet");
        let wanted = [Wanted::new("a", format!("log#{field}@row*1s"))];
        let recording = read_bytes(path, &sample(&format!("odd/{file}"))?, &wanted, &ReadOptions::default());
        let recording = recording.unwrap();
        assert!(!recording.degraded, "{:?}", recording.warnings);
        Some(recording.samples.iter().map(|sample| format!("{:?}", sample.value)).collect())
    };
    let Some(numbers) = values("ARROW-17100.parquet", "col1") else { return };
    assert_eq!(numbers.join(" "), (1..=5).map(|at| format!("Number({at}.0)")).collect::<Vec<_>>().join(" "));
    let truths = values("rle_boolean_encoding.parquet", "datatype_boolean").unwrap();
    let begin = [1, 0, 1, 1, 0, 0, 1, 1, 1].map(|bit| format!("Number({bit}.0)"));
    assert_eq!((truths.len(), &truths[..9]), (62, &begin[..]));
    assert_eq!(values("datapage_v2_empty_datapage.snappy.parquet", "value"), Some(Vec::new()));
}

const FILES: [&str; 5] = [
    "wheel_speed_snappy.parquet",
    "wheel_speed_timestamp_zstd.parquet",
    "wheel_speed_int96.parquet",
    "alltypes_plain.snappy.parquet",
    "alltypes_tiny_pages.parquet",
];

#[test]
fn tables_are_read_as_python_does() {
    for file in FILES {
        let (Some(bytes), Some(expected)) = (sample(&format!("parquet/{file}")), expected("parquet", file))
        else {
            return;
        };
        let all = collected(READ, &bytes);
        assert_eq!(
            (all.damages.as_slice(), all.count() as u64),
            (&[][..], expected["rows"].as_u64().unwrap()),
            "{file}"
        );
        for (name, of_field) in expected["fields"].as_object().unwrap() {
            let (first, last) = check_values(&all.column("log", name), of_field, name);
            for (time, end) in [(first, "first"), (last, "last")] {
                let time_ns = of_field[end].get("time_ns").map(|it| it.as_i64().unwrap());
                assert_eq!(time, time_ns.unwrap_or(time), "{file} {name}");
            }
        }
    }
}

#[test]
fn a_table_without_a_time_is_counted_by_its_rows() {
    let file = "delta_binary_packed.parquet";
    let (Some(bytes), Some(expected)) = (sample(&format!("parquet/{file}")), expected("parquet", file))
    else {
        return;
    };
    for (name, of_field) in expected["fields"].as_object().unwrap() {
        let wanted = [Wanted::new("/x", format!("delta_binary_packed#{name}@row*1s"))];
        let read = read_bytes(Path::new(file), &bytes, &wanted, &ReadOptions::default()).unwrap();
        let shown = read.samples.iter().map(|sample| match sample.value {
            RawValue::Number(number) => (sample.time.0, number.to_string()),
            _ => panic!("{sample:?}"),
        });
        check_values(&shown.collect::<Vec<_>>(), of_field, name);
    }
    let wanted = [Wanted::new("/x", "bitwidth1")];
    let error = read_bytes(Path::new(file), &bytes, &wanted, &ReadOptions::default()).unwrap_err();
    assert!(error.to_string().contains("no column looks like the time"), "{error}");
}

#[test]
fn a_cut_file_says_that_its_description_is_missing() {
    for file in FILES {
        let Some(bytes) = sample(&format!("parquet/{file}")) else { return };
        for step in 0..20 {
            let part = counted(READ, &bytes[..bytes.len() * step / 20]);
            assert_eq!(part.messages, 0, "{file}");
            assert!(
                part.damages[0].contains("is missing: nothing can be read"),
                "{file}: {:?}",
                part.damages
            );
        }
    }
}

#[test]
fn a_damaged_page_costs_its_values_and_no_others() {
    for file in FILES {
        let Some(bytes) = sample(&format!("parquet/{file}")) else { return };
        let mut broken = bytes.clone();
        let described =
            bytes.len() - 8 - u32::from_le_bytes(bytes[bytes.len() - 8..][..4].try_into().unwrap()) as usize;
        let sound = counted(READ, &bytes).messages;
        for step in 0..50_usize {
            let (at, bit) = ((step * 7_919 + 13).wrapping_mul(104_729) % bytes.len(), 1 << (step % 8));
            broken[at] ^= bit;
            let one = counted(READ, &broken);
            assert!(one.messages <= sound + 1, "{file} at {at}");
            broken[at] = bytes[at];
            // Damage before the description never makes the whole file unreadable, unless it is in the times.
            let is_reported = one.messages == sound || !one.damages.is_empty();
            assert!(is_reported || at >= described, "{file} at {at}: {} of {sound}", one.messages);
        }
        for step in 0..50_usize {
            broken[(step * 7_919 + 13).wrapping_mul(104_729) % described] ^= 1 << (step % 8);
        }
        assert!(!counted(READ, &broken).damages.is_empty(), "{file}: nothing is reported");
    }
}
