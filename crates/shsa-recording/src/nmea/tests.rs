//! NMEA recordings written by these tests, and those of boats and receivers.

use super::super::tests::independent::{
    Reader, check_cut, check_flipped, check_values, collected, counted, expected, sample,
};
use super::*;

/// The reader, which has no options.
const READ: Reader = |input, _options, listener| read(input, listener);

/// Lines with their checksums.
fn log(sentences: &[&str]) -> String {
    let line = |text: &&str| match text.split_once('$') {
        Some((before, body)) => {
            let sum = body.bytes().fold(0, |sum, byte| sum ^ byte);
            format!("{before}${body}*{sum:02X}\r\n")
        }
        None => format!("{text}\r\n"),
    };
    sentences.iter().map(line).collect()
}

const SECOND: i64 = 1_000_000_000;

/// 2016-08-12 00:00:00.
const DAY_0: i64 = 1_470_960_000 * SECOND;

#[test]
fn times_are_carried_on() {
    let text = log(&[
        "$SDDPT,1.0,0.0",
        "$GPGGA,235959.00,3503.8851,N,07658.0729,W,1,08,0.9,545.4,M,46.9,M,,",
        "$GPRMC,235959.50,A,3503.8851,N,07658.0729,W,3.75,175.45,120816,,,A",
        "$SDDPT,2.0,0.0",
        "$GPGGA,000000.50,3503.8851,N,07658.0729,W,1,08,0.9,545.4,M,46.9,M,,",
        "$IIDPT,3.0,0.0",
        "$GPZDA,000001.00,13,08,2016,00,00",
        "$GPGLL,3503.8851,N,07658.0729,W,000002.00,A",
        "boot",
    ]);
    let all = collected(READ, text.as_bytes());
    assert_eq!(all.damages, []);
    let last = DAY_0 + 86_400 * SECOND;
    assert_eq!(
        all.column("SDDPT", "depth"),
        [(last - SECOND / 2, "1".into()), (last - SECOND / 2, "2".into())]
    );
    assert_eq!(all.column("IIDPT", "depth"), [(last + SECOND / 2, "3".into())]);
    let times: Vec<i64> = all.column("GPGGA", "altitude").into_iter().map(|(time, _)| time).collect();
    assert_eq!(times, [last - SECOND, last + SECOND / 2]);
    assert_eq!(all.column("GPGLL", "status"), [(last + 2 * SECOND, "'A'".into())]);
    assert_eq!(all.notes[0].1, "1 lines are no sentences");
}

#[test]
fn times_of_day_alone_count_from_the_first_day() {
    let text = log(&[
        "$IIVHW,,T,,M,06.11,N,11.31,K",
        "$GPZDA,235959,,,,00,",
        "$SDDPT,1.0,0.0",
        "$GPRMC,000001,A,3503.8851,N,07658.0729,W,3.75,175.45,,,,A",
        "$SDDPT,2.0,0.0",
    ]);
    let all = collected(READ, text.as_bytes());
    assert_eq!(all.damages, []);
    let day = 86_400 * SECOND;
    assert_eq!(all.column("SDDPT", "depth"), [(day - SECOND, "1".into()), (day + SECOND, "2".into())]);
    assert_eq!(all.notes[0].1, "no sentence has a date (RMC, ZDA): the times of day count from 1970-01-01");
    // The date of a receiver without a fix says that its time of day is wrong, too.
    let wrong = collected(READ, log(&["$GPZDA,235959,01,01,1999,00,00", "$SDDPT,1.0,0.0"]).as_bytes());
    assert_eq!(wrong.column("SDDPT", "depth"), []);
}

#[test]
fn what_loggers_note_is_the_reception() {
    let text = log(&[
        "2016-08-12T10:00:00.100Z;N;$SDDPT,1.0,0.0",
        "2016-08-12T10:00:00.200Z;N;$GPRMC,100000.00,A,3503.8851,N,07658.0729,W,3.75,175.45,120816,,,A",
    ]);
    let all = collected(READ, text.as_bytes());
    let times = |topic: usize| all.topics[topic].messages[0].0;
    let ten = DAY_0 + 36_000 * SECOND;
    assert_eq!(times(0), Times::at(Time(ten + SECOND / 10)));
    assert_eq!(times(1), Times { stamp: Some(Time(ten)), ..Times::at(Time(ten + SECOND / 5)) });
}

#[test]
fn transducers_are_topics_by_name() {
    let text = log(&[
        "$GPZDA,000001.00,13,08,2016,00,00",
        "$IIXDR,C,19.52,C,TempAir,P,1.02481,B,Barometer",
        "$IIXDR,C,19.60,C,TempAir",
    ]);
    let all = collected(READ, text.as_bytes());
    assert_eq!(
        all.shown()[1..],
        ["XDR IIXDR[name=TempAir]: value [degC] x2", "XDR IIXDR[name=Barometer]: value [bar] x1"]
    );
}

#[test]
fn torn_sentences_and_lost_commas_are_told() {
    let rmc = "$GPRMC,100000.00,A,3503.8851,N,07658.0729,W,3.75,175.45,120816,A";
    let text = log(&[rmc, "$SDDPT,1.0,0.0"]) + "$SDDPT,1.0,0.0*00\r\n$SDDP";
    let all = collected(READ, text.as_bytes());
    assert_eq!(all.column("GPRMC", "speed")[0].1, "3.75");
    assert_eq!(all.column("GPRMC", "mode")[0].1, "");
    let shown: Vec<String> = all.damages.iter().map(|(place, what)| format!("{place:?} {what}")).collect();
    assert_eq!(
        shown,
        [
            "Line(1) GPRMC has lost commas: what stands behind field 7 is left out",
            "Line(3) a torn sentence: its checksum is wrong or absent; line left out",
            "Line(4) the file ends within this line; line left out",
        ]
    );
}

#[test]
fn a_recording_without_a_time_is_left_out() {
    let all = collected(READ, log(&["$SDDPT,1.0,0.0"]).as_bytes());
    assert_eq!(all.count(), 0);
    assert!(all.damages[0].1.starts_with("1 sentences are left out"));
}

/// A field's name in `pynmea2`, and its name here.
fn field_of(name: &str) -> (&str, &str) {
    let (topic, field) = name.split_once('#').unwrap();
    let field = match field {
        "speed_kn" | "wind_speed_kn" => "speed",
        "speed_kmph" => "speed_kmh",
        "latitude_deg" => "latitude",
        "depth_m" => "depth",
        "altitude_m" => "altitude",
        "wind_angle_deg" => "angle",
        other => panic!("no {other}"),
    };
    (topic, field)
}

fn check_sample(file: &str) {
    let (Some(bytes), Some(expected)) = (sample(&format!("nmea/{file}")), expected("nmea", file)) else {
        return;
    };
    let all = collected(READ, &bytes);
    for (name, count) in expected["sentences"].as_object().unwrap() {
        // `pynmea2` leaves out the letter before the name of the maker.
        let name = if name.starts_with("SRF") { format!("P{name}") } else { name.clone() };
        let found: usize = all.topics.iter().filter(|it| it.full == name).map(|it| it.messages.len()).sum();
        assert_eq!(found as u64, count.as_u64().unwrap(), "{name}");
    }
    for (name, of_field) in expected["fields"].as_object().unwrap() {
        let (topic, field) = field_of(name);
        check_values(&all.column(topic, field), of_field, name);
    }
}

#[test]
fn boats_and_receivers_are_read_as_pynmea2_does() {
    for file in ["boat.log", "nmea-rtk.log", "quectel-l76k-nmea.log"] {
        check_sample(file);
    }
    let Some(bytes) = sample("nmea/boat.log") else { return };
    assert!(is_log(&bytes[..4096]));
    let lost = counted(READ, &bytes).damages.iter().filter(|it| it.contains("GPRMC has lost commas")).count();
    assert_eq!(lost, 22);
}

#[test]
fn boats_are_read_though_damaged() {
    let Some(bytes) = sample("nmea/quectel-l76k-nmea.log") else { return };
    check_cut(READ, &bytes);
    check_flipped(READ, &bytes, 0.8);
}
