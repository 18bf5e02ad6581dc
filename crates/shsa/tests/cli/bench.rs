//! `shsa bench` from outside: small runs.

use crate::folder::Folder;

#[test]
fn scale_measures_each_size_and_writes_what_it_found() {
    let folder = Folder::new();
    let ended = folder.ends("bench scale --sizes 300,100 --out found --json", 0);
    let lines: Vec<serde_json::Value> =
        ended.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let relations: Vec<_> = lines.iter().map(|line| line["relations"].as_f64().unwrap()).collect();
    assert_eq!(relations, [100.0, 300.0]);
    for line in &lines {
        assert!(line["load_s"].as_f64().unwrap() > 0.0 && line["change_worst_s"].as_f64().unwrap() > 0.0);
        assert_eq!(line["table_needs"], line["needs"]);
        assert!(line["structure_worst_s"].as_f64().unwrap() >= line["structure_median_s"].as_f64().unwrap());
    }
    // Of three needs, a change touches one.
    let searches = |key: &str| lines[1][key].as_f64().unwrap();
    assert!(searches("structure_searches") < searches("table_searches"), "{}", lines[1]);
    let read = |name: &str| std::fs::read_to_string(folder.path("found").join(name)).unwrap();
    assert!(read("scale.md").contains("shsa bench scale --sizes 300,100 --seed 1"));
    assert!(read("scale-time.svg").starts_with("<svg") && read("scale-memory.svg").starts_with("<svg"));
    assert_eq!(read("scale.jsonl"), ended.stdout);
}

#[test]
fn scale_refuses_sizes_that_no_file_can_have() {
    let words = "a model of 7 relations cannot be measured: 100 to 1500000 can";
    Folder::new().refuses("bench scale --sizes 7", &[words]);
}
