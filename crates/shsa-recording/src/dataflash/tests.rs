//! DataFlash logs written by these tests, and that of a copter.

use super::super::tests::independent::{
    Reader, check_counts, check_cut, check_flipped, check_values, collected, expected, sample,
};
use super::{binary, text};

/// The reader, which has no options.
const BINARY: Reader = |input, _options, listener| binary::read(input, listener);
const TEXT: Reader = |input, _options, listener| text::read(input, listener);

/// A log under construction.
struct Writer(Vec<u8>);

/// The content of an `FMT` message: kind, length, name, characters, names of the fields.
fn fmt(kind: u8, length: u8, name: &str, characters: &str, columns: &str) -> Vec<u8> {
    let padded = |text: &str, to: usize| [text.as_bytes(), &vec![0; to - text.len()]].concat();
    [vec![kind, length], padded(name, 4), padded(characters, 16), padded(columns, 64)].concat()
}

impl Writer {
    fn new() -> Writer {
        Writer(Vec::new()).format(128, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns")
    }

    fn message(mut self, kind: u8, content: &[u8]) -> Writer {
        self.0.extend([&[0xa3, 0x95, kind][..], content].concat());
        self
    }

    fn format(self, kind: u8, length: u8, name: &str, characters: &str, columns: &str) -> Writer {
        self.message(128, &fmt(kind, length, name, characters, columns))
    }

    fn imu(self, time_us: u64, device: u8, rate: f32, angle: i16) -> Writer {
        let content = [&time_us.to_le_bytes()[..], &[device], &rate.to_le_bytes(), &angle.to_le_bytes()];
        self.message(200, &content.concat())
    }

    fn gps(self, time_us: u64, week_ms: u32, week: u16) -> Writer {
        let content = [&time_us.to_le_bytes()[..], &week_ms.to_le_bytes(), &week.to_le_bytes()];
        self.message(201, &content.concat())
    }
}

fn begun() -> Writer {
    Writer::new().format(200, 18, "IMU", "QBfc", "TimeUS,I,GyrZ,Roll").format(
        201,
        17,
        "GPS",
        "QIH",
        "TimeUS,GMS,GWk",
    )
}

#[track_caller]
fn check(log: &Writer, topics: &[&str], damages: &[&str]) {
    let all = collected(BINARY, &log.0);
    assert_eq!(all.shown()[1..], *topics);
    let shown: Vec<String> = all.damages.iter().map(|(place, what)| format!("{place:?} {what}")).collect();
    assert_eq!(shown, damages);
}

#[test]
fn fields_are_scaled_and_times_are_tied_to_the_epoch() {
    let log =
        begun().imu(1_000_000, 0, 0.5, -2_550).gps(2_000_000, 38_980_800, 1966).imu(3_000_000, 0, 0.25, 1);
    let all = collected(BINARY, &log.0);
    let second = 1_000_000_000;
    let gps = 1_505_040_562_800_000_000;
    assert_eq!(all.column("IMU", "Roll"), [(gps - second, "-25.5".into()), (gps + second, "0.01".into())]);
    assert_eq!(all.column("IMU", "GyrZ"), [(gps - second, "0.5".into()), (gps + second, "0.25".into())]);
}

#[test]
fn units_and_devices_are_those_of_fmtu() {
    let letters = |text: &[u8]| [text, &vec![0; 16 - text.len()]].concat();
    let label = |text: &[u8]| [text, &vec![0; 64 - text.len()]].concat();
    let unit = |letter: u8, text: &[u8]| [&[0; 8][..], &[letter], &label(text)].concat();
    let multiplier = |letter: u8, value: f64| [&[0; 8][..], &[letter], &value.to_le_bytes()].concat();
    let log = begun()
        .format(202, 76, "UNIT", "QbZ", "TimeUS,Id,Label")
        .format(203, 20, "MULT", "Qbd", "TimeUS,Id,Mult")
        .format(204, 44, "FMTU", "QBNN", "TimeUS,FmtType,UnitIds,MultIds")
        .message(202, &unit(b's', b"s"))
        .message(202, &unit(b'E', b"rad/s"))
        .message(203, &multiplier(b'F', 1e-6))
        .message(204, &[&[0; 8][..], &[200], &letters(b"s#Ed"), &letters(b"F-0B")].concat())
        .imu(1, 0, 0.5, 0)
        .imu(2, 1, 1.5, 0)
        .imu(3, 1, 1.5, 0);
    let all = collected(BINARY, &log.0);
    let imu: Vec<String> = all.shown().into_iter().filter(|it| it.starts_with("IMU")).collect();
    let fields = "TimeUS [us], I, GyrZ [rad/s], Roll";
    assert_eq!(imu, [format!("IMU IMU[0]: {fields} x1"), format!("IMU IMU[1]: {fields} x2")]);
}

#[test]
fn reading_goes_on_after_damage() {
    let mut log = begun();
    let begin = log.0.len();
    for step in 0..50 {
        log = log.imu(step, 0, 1.0, 0);
    }
    // The header of one message, the kind of another, the content of a third.
    log.0[begin + 10 * 18 + 1] = 0;
    log.0[begin + 20 * 18 + 2] = 201;
    log.0[begin + 30 * 18 + 9] ^= 0x55;
    let lost =
        [10, 20].map(|at| format!("Offset({}) no message begins here: 18 bytes are lost", begin + at * 18));
    check(&log, &["IMU IMU: TimeUS, I, GyrZ, Roll x48"], &lost.each_ref().map(String::as_str));
    log.0.truncate(begin + 50 * 18 - 3);
    let cut = format!("Offset({}) the log ends within a message: 15 of 18 bytes are there", begin + 49 * 18);
    check(&log, &["IMU IMU: TimeUS, I, GyrZ, Roll x47"], &[&lost[0], &lost[1], &cut]);
}

#[test]
fn lines_of_text_hold_the_same() {
    let log = "ArduCopter V4\nFMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format,Columns\n\
               FMT, 200, 18, IMU, QBfc, TimeUS,I,GyrZ,Roll\nFMT, 201, 17, GPS, QIH, TimeUS,GMS,GWk\n\
               FMT, 202, 75, MSG, QZ, TimeUS,Message\n\
               IMU, 1000000, 0, 0.5, -25.5\nGPS, 2000000, 38980800, 1966\nMSG, 2500000, hello, world\n\
               IMU, 3000000, 0\nIMU, 3000000, 0, 0.25, 0.";
    let all = collected(TEXT, log.as_bytes());
    let gps = 1_505_040_562_800_000_000;
    let second = 1_000_000_000;
    assert_eq!(all.column("IMU", "Roll"), [(gps - second, "-25.5".into()), (gps + second, "0".into())]);
    assert_eq!(all.column("MSG", "Message")[0].1, "'hello, world'");
    let shown: Vec<String> = all.damages.iter().map(|(place, what)| format!("{place:?} {what}")).collect();
    assert_eq!(shown, ["Line(9) the message has not 4 values as its format; line left out"]);
    assert!(text::is_log(log.as_bytes()));
}

fn check_sample(reader: Reader, file: &str) {
    let (Some(bytes), Some(expected)) = (sample(&format!("dataflash/{file}")), expected("dataflash", file))
    else {
        return;
    };
    let all = collected(reader, &bytes);
    assert_eq!(all.damages, []);
    assert_eq!(all.count() as u64, expected["messages"].as_u64().unwrap());
    check_counts(&all, &expected["topics"]);
    for (name, of_field) in expected["fields"].as_object().unwrap() {
        let (topic, field) = name.split_once('#').unwrap();
        let (first, last) = check_values(&all.column(topic, field), of_field, name);
        for (found, at) in [(first, "first"), (last, "last")] {
            let expected = of_field[at]["unix_s"].as_f64().unwrap();
            assert!((found as f64 / 1e9 - expected).abs() < 1e-6, "{name}: {found} and {expected}");
        }
    }
}

#[test]
fn the_log_of_a_copter_is_read_as_pymavlink_does() {
    check_sample(BINARY, "log.bin");
    check_sample(TEXT, "log.log");
}

#[test]
fn the_log_of_a_copter_is_read_though_damaged() {
    for (reader, file) in [(BINARY, "log.bin"), (TEXT, "log.log")] {
        let Some(bytes) = sample(&format!("dataflash/{file}")) else { return };
        check_cut(reader, &bytes);
        check_flipped(reader, &bytes, 0.85);
    }
}
