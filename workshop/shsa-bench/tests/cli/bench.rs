//! `shsa-bench` from outside: small runs.

use crate::folder::Folder;

#[test]
fn scale_measures_each_size_and_writes_what_it_found() {
    let folder = Folder::new();
    let ended = folder.ends("scale --sizes 300,100 --out found --json", 0);
    let lines: Vec<serde_json::Value> =
        ended.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let relations: Vec<_> = lines.iter().map(|line| line["relations"].as_f64().unwrap()).collect();
    assert_eq!(relations, [100.0, 300.0]);
    for line in &lines {
        assert!(line["load_s"].as_f64().unwrap() > 0.0 && line["change_worst_s"].as_f64().unwrap() > 0.0);
        assert_eq!(line["table_needs"], line["needs"]);
        assert!(line["structure_worst_s"].as_f64().unwrap() >= line["structure_median_s"].as_f64().unwrap());
    }
    // The model has three needs; a change concerns one of them.
    let searches = |key: &str| lines[1][key].as_f64().unwrap();
    assert!(searches("structure_searches") < searches("table_searches"), "{}", lines[1]);
    let read = |name: &str| std::fs::read_to_string(folder.path("found").join(name)).unwrap();
    assert!(read("scale.md").contains("shsa-bench scale --sizes 300,100 --seed 1"));
    assert!(read("scale-time.svg").starts_with("<svg") && read("scale-memory.svg").starts_with("<svg"));
    assert_eq!(read("scale.jsonl"), ended.stdout);
}

#[test]
fn coverage_judges_nothing_without_recordings() {
    let folder = Folder::new();
    folder.refuses("coverage --data . --out found", &["SKIPPED: ./comma2k19", "nothing is judged"]);
    assert!(!folder.path("found").exists());
}

#[test]
fn scale_refuses_sizes_that_no_file_can_have() {
    let words = "a model of 7 relations cannot be measured: 100 to 1500000 can";
    Folder::new().refuses("scale --sizes 7", &[words]);
}

#[test]
fn monitor_measures_each_case_and_writes_what_it_found() {
    let folder = Folder::new();
    let ended = folder.ends("monitor --turn 0.001 --out found --json", 0);
    let lines: Vec<serde_json::Value> =
        ended.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let ways: Vec<_> = lines.iter().map(|line| line["ways"].as_u64().unwrap()).collect();
    assert_eq!(ways, [3, 3, 10_000, 10_000, 2, 2, 4, 8, 16, 32]);
    for line in &lines {
        assert!(line["observations_per_second"].as_f64().unwrap() > 0.0, "{line}");
    }
    let read = |name: &str| std::fs::read_to_string(folder.path("found").join(name)).unwrap();
    assert!(read("monitor.md").contains("`shsa-bench monitor --turn 0.001 --out workshop/measured`"));
    assert!(read("monitor-ways.svg").starts_with("<svg"));
    assert_eq!(read("monitor.jsonl"), ended.stdout);
    folder.refuses("monitor --turn 0", &["0.001 to 60 seconds"]);
}

#[test]
fn day_replays_what_it_writes_and_removes_it() {
    crate::with_shsa();
    let folder = Folder::new();
    let ended = folder.ends("day --hours 0.005 --signals 10 --out found --json", 0);
    let found: serde_json::Value = serde_json::from_str(&ended.stdout).unwrap();
    assert_eq!((&found["observations"], &found["events"]), (&18_000.0.into(), &0.into()));
    assert!(found["peak_bytes"].as_f64().unwrap() > 0.0 && found["seconds"].as_f64().unwrap() > 0.0);
    let read = |name: &str| std::fs::read_to_string(folder.path("found").join(name)).unwrap();
    assert!(
        read("day.md")
            .contains("`shsa-bench day --hours 0.005 --signals 10 --rate 100 --out workshop/measured`")
    );
    assert!(read("day-memory.svg").starts_with("<svg"));
}

#[test]
fn learning_drafts_and_learns_from_what_it_writes() {
    crate::with_shsa();
    let folder = Folder::new();
    let ended = folder.ends("learning --signals 8 --seconds 300 --rate 4 --json", 0);
    let found: Vec<serde_json::Value> =
        ended.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let commands: Vec<_> = found.iter().map(|it| it["command"].as_str().unwrap()).collect();
    assert_eq!(commands, ["draft", "learn"]);
    assert!(found.iter().all(|it| it["found"].as_u64() > Some(0)), "{found:?}");
    assert!(found.iter().all(|it| it["peak_bytes"].as_f64() > Some(0.0)), "{found:?}");
}

/// The most runs of a measurement in real time.
const ATTEMPTS: usize = 5;

/// The lines about reactions, after those about the gate, with what holds on a machine of any speed checked.
fn reactions_of(output: &str) -> Vec<serde_json::Value> {
    let lines: Vec<serde_json::Value> =
        output.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let parts: Vec<_> = lines.iter().map(|line| line["part"].as_str().unwrap()).collect();
    // The gate is measured once more with the processors kept awake, where the system allows it.
    let gates = parts.iter().take_while(|part| **part == "gate").count();
    assert!((1..=2).contains(&gates) && parts[gates..] == ["reaction", "reaction"], "{parts:?}");
    let (gates, reactions) = lines.split_at(gates);
    assert!(gates.iter().all(|gate| gate["lost"] == 0), "{gates:?}");
    for reaction in reactions {
        // A signal that is silent for long, as its messages come late, may have moved as far as the wrong value.
        let count = |name: &str| reaction[name].as_u64().unwrap();
        assert!(count("faults") == 20 && count("unhealed") <= 20 && count("wrong") < 1_000, "{reaction}");
    }
    reactions.to_vec()
}

#[test]
fn live_measures_what_is_asked_and_keeps_the_section_of_a_soak() {
    let folder = Folder::new();
    let read = |name: &str| std::fs::read_to_string(folder.path("found").join(name)).unwrap();
    let soaked = folder.ends("live --bus memory --soak 3s --rate 500 --out found --json", 0);
    let soak: serde_json::Value = serde_json::from_str(&soaked.stdout).unwrap();
    assert_eq!((&soak["messages"]["said"], &soak["messages"]["lost"]), (&1_500.into(), &0.into()), "{soak}");
    assert!(
        read("live.md")
            .contains("`shsa-bench live --bus memory --soak '3 s' --rate 500 --out workshop/measured`")
    );
    assert!(read("live-soak-memory.svg").starts_with("<svg"));

    // On a busy machine messages come late: all faults of a run may end before they are healed. One of several runs shows healing.
    let mut runs = (0..ATTEMPTS).map(|_| {
        folder.ends("live --bus memory --part gate,reaction --seconds 1 --faults 1 --out found --json", 0)
    });
    let ended = runs.find(|ended| reactions_of(&ended.stdout).iter().all(|it| it["unhealed"] != 20)).unwrap();
    let document = read("live.md");
    let at = |head: &str| document.find(head).unwrap();
    assert!(at("## The gate") < at("## Reaction") && at("## Reaction") < at("## Soak"));
    assert_eq!(read("live.jsonl"), ended.stdout);
    folder.refuses("live --seconds 0", &["1 to 3600 seconds"]);
}
