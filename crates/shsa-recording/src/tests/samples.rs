//! Small recordings in common formats, compared with the results of independent readers, where they are available.

use super::*;
use serde_json::Value;

/// The folder of a family of formats with the expected content of its files; `None`, with a loud message, where it is missing.
fn family(name: &str) -> Option<(PathBuf, Value)> {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/formats")).join(name);
    let Ok(expected) = fs::read_to_string(folder.join("expected.json")) else {
        eprintln!("SKIPPED: no samples at {}", folder.display());
        return None;
    };
    Some((folder, serde_json::from_str(&expected).unwrap()))
}

/// Checks the samples of the only wanted signal; `time` names the time to compare.
#[track_caller]
fn compare(what: &str, samples: &[Sample], expected: &Value, time: &str) {
    assert_eq!(samples.len() as u64, expected["count"].as_u64().unwrap(), "{what}: count");
    let number = |sample: &Sample| match &sample.value {
        RawValue::Number(number) => *number,
        other => panic!("{what}: {other:?}"),
    };
    for (end, sample) in [("first", samples.first()), ("last", samples.last())] {
        let (sample, expected) = (sample.unwrap(), &expected[end]);
        assert_eq!(Some(sample.time.0), expected[time].as_i64(), "{what}: {end} {time}");
        is_near(&format!("{what}: {end}"), number(sample), expected["value"].as_f64().unwrap());
    }
    let mean = samples.iter().map(number).sum::<f64>() / samples.len() as f64;
    is_near(&format!("{what}: mean"), mean, expected["mean"].as_f64().unwrap());
}

#[track_caller]
fn is_near(what: &str, value: f64, expected: f64) {
    assert!((value - expected).abs() <= 1e-6 * expected.abs().max(1e-3), "{what}: {value}, not {expected}");
}

fn samples_of(path: &Path, source: &str) -> Recording {
    samples_of_result(path, source).unwrap()
}

fn samples_of_result(path: &Path, source: &str) -> Result<Recording, RecordingError> {
    read(&[path.into()], &wanted(&[source]), &ReadOptions::default())
}

#[test]
fn tables() {
    let Some((folder, expected)) = family("tables") else { return };
    for (file, expected) in expected.as_object().unwrap() {
        let stem = file.split('.').next().unwrap();
        for (field, expected) in expected["fields"].as_object().unwrap() {
            let recording = samples_of(&folder.join(file), &format!("{stem}#{field}"));
            assert!(!recording.degraded, "{file}: {:?}", recording.warnings);
            compare(&format!("{file}#{field}"), &recording.samples, expected, "time_ns");
        }
    }
}

/// Checks each field of the topics of a file, by each of its times.
fn topics_of(path: &Path, expected: &Value) {
    let name = path.file_name().unwrap().to_string_lossy().into_owned();
    for (field, expected) in expected["fields"].as_object().into_iter().flatten() {
        // A text is no value of a signal.
        if expected["first"]["value"].is_string() {
            continue;
        }
        for (time, source) in
            [("received_ns", "@received"), ("published_ns", "@published"), ("stamp_ns", "@header.stamp")]
        {
            let is_reported = expected["first"][time].as_i64().is_some_and(|time| time != 0);
            if is_reported {
                let recording = samples_of(path, &format!("{field}{source}"));
                compare(&format!("{name}: {field}{source}"), &recording.samples, expected, time);
            }
        }
    }
    let info = inventory(&[path.to_owned()], &ReadOptions::default()).unwrap();
    for (topic, count) in expected["topics"].as_object().into_iter().flatten() {
        let topics = info.iter().flat_map(|file| &file.topics).filter(|it| it.name == *topic);
        let found: usize = topics.map(|it| it.count).sum();
        assert_eq!(found as u64, count.as_u64().unwrap(), "{name}: {topic}");
    }
}

#[test]
fn mcap_files() {
    let Some((folder, expected)) = family("mcap") else { return };
    for (file, expected) in expected.as_object().unwrap() {
        topics_of(&folder.join(file), expected);
    }
    let cut = inventory(&[folder.join("car_json_cut.mcap")], &ReadOptions::default()).unwrap().remove(0);
    let found: usize = cut.topics.iter().map(|topic| topic.count).sum();
    assert!(cut.degraded && found >= 1_090, "{found} messages");
}

#[test]
fn bags_of_ros_2() {
    let Some((folder, expected)) = family("rosbag2") else { return };
    for (bag, expected) in expected.as_object().unwrap() {
        topics_of(&folder.join(bag), expected);
    }
}

/// Formats without an end mark: a file cut between two lines or messages is complete.
const ENDLESS: [&str; 9] = ["csv", "txt", "log", "lp", "jsonl", "asc", "nmea", "ulg", "bin"];

/// Cuts every file of a family at 20 places, and flips 200 bytes in five ways: the damage is reported, samples are in order,
/// nothing panics.
fn damaged(family: &str, sources: &[&str]) {
    if let Some((folder, _)) = self::family(family) {
        damaged_at(folder, sources);
    }
}

/// Does the same with one file, or with all files of a folder.
fn damaged_at(path: PathBuf, sources: &[&str]) {
    let files = files::files_of(&[path], &Files::Disk).unwrap();
    for File { path, .. } in files.iter().filter(|file| file.path.extension().is_some_and(|it| it != "json"))
    {
        let read = |bytes: &[u8]| read_bytes(path, bytes, &wanted(sources), &ReadOptions::default());
        damaged_bytes(path, &fs::read(path).unwrap(), read);
    }
}

/// Does the same with the bytes of a file that `read` reads.
fn damaged_bytes(path: &Path, whole: &[u8], read: impl Fn(&[u8]) -> Result<Recording, RecordingError>) {
    let is_reported = |bytes: &[u8]| match read(bytes) {
        Ok(recording) => {
            let in_order = |(_, samples): (_, &[Sample])| samples.is_sorted_by_key(|it| it.received);
            assert!(recording.by_session().all(in_order), "{}", path.display());
            recording.degraded
        }
        Err(_) => true,
    };
    for part in 0..20 {
        let length = whole.len() * part / 20;
        let is_endless = path.extension().is_some_and(|ending| ENDLESS.iter().any(|it| ending == *it));
        // A logger that was switched off leaves a file without an end mark.
        let has_no_end = is_endless || whole.starts_with(b"UnFinMF");
        assert!(is_reported(&whole[..length]) || has_no_end, "{} cut at {length}", path.display());
    }
    for round in 0..5 {
        let mut flipped = whole.to_vec();
        let mut at: usize = 7_919 * (round + 1);
        for _ in 0..200 {
            at = at.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let length = flipped.len();
            flipped[(at >> 20) % length] ^= 1 << (at % 8);
        }
        is_reported(&flipped);
    }
}

/// Files that are packed as a whole are read from the disk.
#[test]
#[cfg(feature = "zstd")]
fn damaged_packed_files_are_survived_and_reported() {
    let Some((bags, _)) = family("rosbag2") else { return };
    let Some((tables, _)) = family("tables") else { return };
    let bag = fs::read(bags.join("gps_nav_zstd_file/gps_nav_zstd_file.db3.zstd")).unwrap();
    let table = gzipped(&fs::read(tables.join("occupancy.csv")).unwrap());
    for (name, whole, source) in
        [("bag.db3.zstd", bag, "/vehicle_pose#pose.position.x"), ("occupancy.csv.gz", table, "Temperature")]
    {
        let folder = Folder::with(&[]);
        let path = folder.0.join(name);
        let read = |bytes: &[u8]| {
            fs::write(&path, bytes).unwrap();
            samples_of_result(&path, source)
        };
        let sound = read(&whole).unwrap();
        assert!(sound.samples.len() > 500 && !sound.degraded, "{name}: {:?}", sound.warnings);
        damaged_bytes(&path, &whole, read);
    }
}

#[test]
fn damaged_samples_are_survived_and_reported() {
    damaged("tables", &["T", "WSPD", "Temperature", "MODAQ_Va_V", "peak_period_0"]);
    let sources = [
        "/imu#rate.z",
        "/gnss#speed",
        "/fix#latitude",
        "/odom#twist.twist.linear.x",
        "/imu#angular_velocity.z",
    ];
    damaged("mcap", &sources);
    damaged("parquet", &["wheel_1", "double_col", "float_col", "bitwidth1@row*1s"]);
    damaged("can", &["0x17#data[0]"]);
    damaged("dataflash", &["IMU[0]#GyrZ"]);
    damaged("influx", &["room#temperature"]);
    damaged("mdf", &["ImuData#AccelerationZ", "Speed"]);
    damaged("nmea", &["RMC#speed"]);
    damaged("signalk", &["navigation.rateOfTurn"]);
    damaged("ulog", &["sensor_combined#accelerometer_m_s2[0]", "vehicle_gps_position#alt"]);
    let bag =
        Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/turtlebot3/turtlebot3.bag"));
    match bag.exists() {
        true => damaged_at(bag.to_owned(), &["odom#twist.twist.linear.x", "/imu#angular_velocity.z"]),
        false => eprintln!("SKIPPED: no recording at {}", bag.display()),
    }
}

/// Cuts real databases at 20 places, and flips 200 bytes, one at a time and all at once: damage is reported, most is read,
/// nothing panics.
#[test]
fn damaged_databases_are_survived_and_reported() {
    let Some((folder, _)) = family("rosbag2") else { return };
    for (bag, source) in
        [("gps_nav", "/vehicle_pose#pose.position.x"), ("turtlebot3_renamed", "/odom#twist.twist.linear.x")]
    {
        let entries = fs::read_dir(folder.join(bag)).unwrap().map(|entry| entry.unwrap().path());
        let path = entries.into_iter().find(|path| path.extension().is_some_and(|it| it == "db3")).unwrap();
        let whole = fs::read(&path).unwrap();
        let read = |bytes: &[u8]| {
            let read = read_bytes(&path, bytes, &wanted(&[source]), &ReadOptions::default());
            read.map_or((0, true), |recording| (recording.samples.len(), recording.degraded))
        };
        let (sound, is_degraded) = read(&whole);
        assert!(sound > 100 && !is_degraded, "{bag}: {sound}");
        let mut before = 0;
        for part in 0..20 {
            let (count, is_reported) = read(&whole[..whole.len() * part / 20]);
            assert!(is_reported && count >= before && count <= sound, "{bag} at {part}: {count} of {sound}");
            before = count;
        }
        assert!(before > sound / 2, "{bag}: {before} of {sound}");
        let mut flipped = whole.clone();
        let place =
            |step: usize| ((step * 7_919 + 13).wrapping_mul(104_729) % whole.len(), 1_u8 << (step % 8));
        let mut whole_ones = 0;
        for (at, bit) in (0..200).map(place) {
            flipped[at] ^= bit;
            let (count, is_reported) = read(&flipped);
            // A loss is reported; a message that has changed to another topic cannot be noticed.
            assert!(count + 1 >= sound || is_reported, "{bag} at {at}: {count} of {sound}");
            whole_ones += usize::from(count * 10 >= sound * 9);
            flipped[at] ^= bit;
        }
        assert!(whole_ones > 180, "{bag}: {whole_ones} of 200 are read but for a tenth");
        (0..200).map(place).for_each(|(at, bit)| flipped[at] ^= bit);
        read(&flipped);
    }
}
