//! Recordings of one call whose clocks are those of different places.

use super::*;

const TEN: &[u8] = b"time,v\n2018-07-01 10:00,1\n";

#[track_caller]
fn check(zones: &[(&str, &str)], expected: [i64; 3]) {
    let zones = zones.iter().map(|(name, zone)| ((*name).to_owned(), zone.parse().unwrap())).collect();
    let options = ReadOptions { zone: "+00:00".parse().unwrap(), zones, ..ReadOptions::default() };
    let files = [("a.csv", TEN), ("b.csv", TEN), ("c.csv.gz", &gzipped(TEN)[..])];
    let said = shown(&files, &["a#v", "b#v", "c#v"], &options);
    // The hour of the day in UTC; notes tell of sessions.
    let mut hours = [None; 3];
    for line in said.lines().filter(|line| !line.starts_with("! ")) {
        let (signal, rest) = line.split_once('@').unwrap();
        let ms: i64 = rest.split_once('=').unwrap().0.parse().unwrap();
        hours[signal.parse::<usize>().unwrap()] = Some(ms / 3_600_000 % 24);
    }
    assert_eq!(hours, expected.map(Some), "{said}");
}

#[test]
fn a_zone_is_of_one_recording() {
    check(&[], [10, 10, 10]);
    check(&[("b.csv", "Europe/Vienna")], [10, 8, 10]);
    check(&[("a", "+05:00"), ("c.csv", "-05:00")], [5, 10, 15]);
    check(&[("c.csv.gz", "+01:00"), ("a.csv", "+01:00"), ("a.csv", "+02:00")], [8, 10, 9]);
}

#[test]
fn a_zone_of_a_folder_is_of_its_recordings() {
    let folder = Folder::with(&[("a.csv", TEN), ("b.csv", TEN)]);
    let name = folder.0.file_name().unwrap().to_string_lossy().into_owned();
    let zones = vec![(name, "+03:00".parse().unwrap()), ("b".to_owned(), "+02:00".parse().unwrap())];
    let options = ReadOptions { zones, ..ReadOptions::default() };
    let recording = read(std::slice::from_ref(&folder.0), &wanted(&["a#v", "b#v"]), &options).unwrap();
    let found =
        recording.samples.iter().map(|sample| (sample.wanted, sample.time.0 / 3_600_000_000_000 % 24));
    assert_eq!(found.collect::<Vec<_>>(), [(0, 7), (1, 8)]);
    assert_eq!(recording.warnings, []);
    let files = inventory(std::slice::from_ref(&folder.0), &options).unwrap();
    assert_eq!(files.iter().map(|file| file.warnings.len()).sum::<usize>(), 0);
}

#[test]
fn a_zone_of_no_recording_is_an_error() {
    let zones = vec![("lof".to_owned(), "+03:00".parse().unwrap())];
    let options = ReadOptions { zones, ..ReadOptions::default() };
    let said = shown(&[("log.csv", TEN)], &["log#v"], &options);
    assert_eq!(said, "error: --time-zone lof=..: no recording has this name (there is: log.csv)");
}
