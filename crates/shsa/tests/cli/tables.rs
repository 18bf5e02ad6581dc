//! `shsa replay --output FILE.parquet --events FILE.parquet`: tables that others read.

use crate::folder::Folder;
use crate::real::python;
use crate::tank;
use serde_json::{Value, json};
use std::path::Path;
use std::process::Command;

/// The types and the rows of a table, as pyarrow reads it.
fn read(python: &Path, folder: &Folder, name: &str) -> (Value, Vec<Value>) {
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/python/table.py");
    let output = Command::new(python).arg(script).arg(folder.path(name)).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let mut told: Value = serde_json::from_slice(&output.stdout).unwrap();
    (told["types"].take(), told["rows"].as_array().unwrap().clone())
}

/// A row without the columns that have no value.
fn present(row: &Value) -> Value {
    let fields = row.as_object().unwrap().iter().filter(|(_, value)| !value.is_null());
    Value::Object(fields.map(|(name, value)| (name.clone(), value.clone())).collect())
}

#[test]
fn pyarrow_reads_the_values_and_the_decisions_of_a_replay() {
    let Some(python) = python() else { return };
    let folder = tank::folder();
    let replay = "replay tank.yaml run.csv";
    let report = folder.json(&format!("{replay} --output values.parquet --events events.parquet"), 0);
    folder.json(&format!("{replay} --output values.jsonl"), 0);

    let (types, rows) = read(&python, &folder, "values.parquet");
    assert_eq!(types["time"], "timestamp[ns, tz=UTC]");
    assert_eq!(
        (&types["lo"], &types["signal"], &types["element"]),
        (&json!("double"), &json!("string"), &json!("int64"))
    );
    let lines = folder.read("values.jsonl");
    let lines: Vec<Value> = lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert!(rows.len() == lines.len() && rows.len() > 30, "{} of {}", rows.len(), lines.len());
    for (row, line) in rows.iter().zip(&lines) {
        let expected = json!({
            "time": line["time_ns"], "received": line["received_ns"], "signal": line["signal"], "unit": "m",
            "lo": line["value"]["lo"], "hi": line["value"]["hi"], "quality": line["quality"],
        });
        assert_eq!(present(row), expected);
    }

    let (_, rows) = read(&python, &folder, "events.parquet");
    let events = report["events"].as_array().unwrap();
    assert_eq!(rows.len(), events.len());
    for (row, event) in rows.iter().zip(events) {
        let mut row = present(row);
        assert!(row.as_object_mut().unwrap().remove("time").is_some(), "{row}");
        assert_eq!(row, present(event));
    }
}

#[test]
fn streamed_values_are_the_same_table_and_our_own_reader_reads_it() {
    let folder = tank::folder();
    folder.ends("replay tank.yaml run.csv --output whole.parquet --events whole-events.parquet", 0);
    folder.ends(
        "replay tank.yaml run.csv --stream --output streamed.parquet --events streamed-events.parquet",
        0,
    );
    for (one, other) in
        [("whole.parquet", "streamed.parquet"), ("whole-events.parquet", "streamed-events.parquet")]
    {
        assert!(
            std::fs::read(folder.path(one)).unwrap() == std::fs::read(folder.path(other)).unwrap(),
            "{one}"
        );
    }
    let found = folder.json("info whole.parquet", 0);
    let topic = &found["files"][0]["topics"][0];
    assert_eq!(topic["messages"], 60, "{found}");
    let fields: Vec<&str> =
        topic["fields"].as_array().unwrap().iter().map(|field| field["path"].as_str().unwrap()).collect();
    assert_eq!(&fields[..4], ["time", "received", "session", "signal"]);
}
