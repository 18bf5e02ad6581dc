//! Small recordings in the formats that people bring, against what independent readers say of them, where they are there.

use super::*;
use serde_json::Value;

/// The folder of a family of formats and what is expected of its files, or `None` and a loud word.
fn family(name: &str) -> Option<(PathBuf, Value)> {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/formats")).join(name);
    let Ok(expected) = fs::read_to_string(folder.join("expected.json")) else {
        eprintln!("SKIPPED: no samples at {}", folder.display());
        return None;
    };
    Some((folder, serde_json::from_str(&expected).unwrap()))
}

/// Whether the samples of the only wanted signal are those that are expected; `time` names which of the times is meant.
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
    read(&[path.into()], &wanted(&[source]), &ReadOptions::default()).unwrap()
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

/// Of each field of the topics of a file, by each of its times.
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
            let is_told = expected["first"][time].as_i64().is_some_and(|time| time != 0);
            if is_told {
                let recording = samples_of(path, &format!("{field}{source}"));
                compare(&format!("{name}: {field}{source}"), &recording.samples, expected, time);
            }
        }
    }
    let info: Vec<FileInfo> = files::files_of(&[path.to_owned()])
        .unwrap()
        .iter()
        .map(|file| inventory(&file.path, &ReadOptions::default()).unwrap())
        .collect();
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
        if file == "car_protobuf.mcap" {
            eprintln!("SKIPPED: {file}: protobuf is not read yet");
            continue;
        }
        topics_of(&folder.join(file), expected);
    }
    let cut = inventory(&folder.join("car_json_cut.mcap"), &ReadOptions::default()).unwrap();
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
