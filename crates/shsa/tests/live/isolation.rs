//! Substitutes in processes of their own: the processes are killed, stopped and starved, and the need is still served.
#![cfg(target_os = "linux")]

use crate::running::{Folder, Running, TOKEN};
use serde_json::Value;
use std::fs;
use std::process::Command;
use std::time::{Duration, Instant};

const ROVER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/rover.yaml");

fn need(state: &Value) -> &Value {
    let mut models = state["models"].as_object().unwrap().values();
    &models.next().unwrap()["needs"]["v_dmin"]
}

/// The process that computes the need's source, and the number of its answers.
fn worker(state: &Value) -> Option<(u64, u64)> {
    let isolation = &need(state)["isolation"];
    let is_working = isolation["state"] == "working";
    is_working.then(|| (isolation["process"].as_u64().unwrap(), isolation["answers"].as_u64().unwrap()))
}

/// Starts a run with a need that a process serves.
fn working(arguments: &[&str]) -> (Running, u64) {
    let run = Running::start(arguments.iter().copied());
    let state = run.until("a process answers", |state| worker(state).is_some_and(|(_, answers)| answers > 5));
    let process = worker(&state).unwrap().0;
    (run, process)
}

fn signal(process: u64, signal: &str) {
    assert!(Command::new("kill").args([signal, &process.to_string()]).status().unwrap().success());
}

/// Checks that another process has taken over, and that the need was served all the time.
#[track_caller]
fn check_replaced(run: &Running, before: u64) {
    let answers = |state: &Value| need(state)["isolation"]["answers"].as_u64();
    let at_first = answers(&run.get("/state").1);
    let state = run.until("another process answers", |state| {
        worker(state).is_some_and(|(process, _)| process != before) && answers(state) > at_first
    });
    let need = need(&state);
    assert_eq!(need["quality"], "Good", "{need}");
    assert_eq!(need["source"], "/lidar/scan by nearest, in a process of its own");
    assert_eq!(need["isolation"]["replaced"], 1, "{need}");
    // Two periods of the lidar, and some time for a busy machine.
    assert!(need["longest_gap_s"].as_f64() < Some(0.3), "{need}");
    assert!(!fs::exists(format!("/proc/{before}")).unwrap(), "it still runs");
}

#[test]
fn a_killed_process_is_replaced_and_the_need_goes_on() {
    let (run, process) = working(&["--isolation", "process"]);
    signal(process, "-KILL");
    let note = run.decision("restarted");
    let because = note["because"].as_str().unwrap();
    assert!(because.contains("killed by signal 9") && because.contains("at once"), "{because}");
    check_replaced(&run, process);
    let (_, metrics) = run.get("/metrics");
    let metrics = metrics.as_str().unwrap();
    assert!(metrics.contains(r#"shsa_process_replaced_total{model="rover",need="v_dmin"} 1"#), "{metrics}");
    for place in ["engine", "process"] {
        let worst = format!(
            r#"shsa_service_seconds{{model="rover",need="v_dmin",place="{place}",statistic="worst"}}"#
        );
        assert!(metrics.contains(&worst), "{metrics}");
    }
    let state = run.get("/state").1;
    let trip = &need(&state)["isolation"]["round_trip_us"];
    assert!(trip["p50"].as_f64() > Some(0.0), "{trip}");
    let last = worker(&state).unwrap().0;
    assert_eq!(run.stop().code(), Some(0));
    let end = Instant::now() + Duration::from_secs(10);
    while fs::exists(format!("/proc/{last}")).unwrap() {
        assert!(Instant::now() < end, "it outlives its run");
        std::thread::sleep(Duration::from_millis(10));
    }
}

#[test]
fn a_hanging_process_is_killed_and_replaced() {
    let (run, process) = working(&["--isolation", "process"]);
    signal(process, "-STOP");
    let note = run.decision("restarted");
    let because = note["because"].as_str().unwrap();
    assert!(
        because.contains("overran: no answer for") && because.contains("100.0 ms are granted"),
        "{because}"
    );
    check_replaced(&run, process);
}

#[test]
fn a_process_has_nothing_but_its_pipes() {
    let (_run, process) = working(&["--isolation", "process"]);
    let read = |what: &str| fs::read(format!("/proc/{process}/{what}")).unwrap();
    let text = |what: &str| String::from_utf8_lossy(&read(what)).into_owned();
    assert_eq!(text("environ"), "", "its environment");
    assert!(!text("cmdline").contains(TOKEN));
    let files = fs::read_dir(format!("/proc/{process}/fd")).unwrap();
    let mut files: Vec<String> = files
        .map(|file| fs::read_link(file.unwrap().path()).unwrap().to_string_lossy().into_owned())
        .collect();
    files.sort();
    assert_eq!(files.len(), 3, "{files:?}");
    assert!(files.iter().all(|file| file.starts_with("pipe:")), "{files:?}");
    let status = text("status");
    for line in ["NoNewPrivs:\t1", "Seccomp:\t2", "Threads:\t1"] {
        assert!(status.contains(line), "{line}: {status}");
    }
    let limits = text("limits");
    let limit = |name: &str| {
        let line = limits.lines().find(|line| line.starts_with(name)).unwrap();
        line[name.len()..].split_whitespace().next().unwrap().to_owned()
    };
    for (name, most) in
        [("Max open files", "3"), ("Max processes", "0"), ("Max file size", "0"), ("Max core file size", "0")]
    {
        assert_eq!(limit(name), most, "{name}");
    }
    let own = limit("Max address space").parse::<u64>().unwrap();
    assert!(own < (1 << 30), "{own}");
    // The kernel's limit follows the processor time used.
    assert!(limit("Max cpu time").parse::<u64>().unwrap() < 10);
    assert_eq!(fs::read_link(format!("/proc/{process}/cwd")).unwrap().to_str(), Some("/"));
}

#[test]
fn a_process_that_is_given_too_little_memory_is_given_up_and_the_operator_can_allow_it() {
    // Each past hour takes 100 kB; all together they exceed the free memory of a new process.
    let folder = Folder::new();
    let past: String = (1..=40).map(|hours| format!(" + delay(min(v_3D), {hours} h)")).collect();
    let model = model(&folder, &[&format!("v_dmin = min(v_3D){past}")], "");
    // A value from so many hours ago counts as old.
    let text = fs::read_to_string(&model).unwrap();
    fs::write(&model, text.replace("max_age: 2 s", "max_age: 41 h")).unwrap();
    let run = Running::start([&*model, "--isolation", "process", "--isolation-memory", "0"]);
    let note = run.decision("restarted");
    assert!(note["because"].as_str().unwrap().contains("more memory than it is granted"), "{note}");
    let note = run.decision("given_up");
    assert!(note["because"].as_str().unwrap().contains("after 6 failures"), "{note}");
    run.until("what fails serves no more", |state| need(state)["isolation"]["state"] == "nothing to compute");
    let (status, answer) = run.order(Some(TOKEN), r#"{"order": "allow", "relation": "much_0"}"#);
    assert_eq!(status, 200, "{answer}");
    run.decision("restarted");
}

/// A model of the rover's bus. The first of these equations computes its need from the depth image; it may rest on `w_1`, which
/// the second one gives, and so on.
fn model(folder: &Folder, equations: &[&str], keys: &str) -> String {
    let variable = |at: usize| format!("  w_{at}: {{ unit: m, shape: vector }}\n");
    let relation = |(at, equation): (usize, &&str)| {
        format!("  much_{at}: {{ equation: '{equation}', for: [{}] }}\n", output(equation))
    };
    let text = format!(
        "shsa: 1
variables:
  v_3D: {{ unit: m, shape: vector, range: [0, 30] }}
  v_dmin: {{ unit: m }}
{}relations:
{}signals:
  /depth/image: {{ variable: v_3D, source: /depth/image#data, unit: m, rate: 15 Hz, value_error: 0.08 }}
needs:
  v_dmin: {{ signal: /dmin, max_age: 2 s{keys} }}
",
        (1..equations.len()).map(variable).collect::<String>(),
        equations.iter().enumerate().map(relation).collect::<String>()
    );
    let path = folder.path("image.yaml");
    fs::write(&path, text).unwrap();
    path.to_str().unwrap().to_owned()
}

fn output(equation: &str) -> &str {
    equation.split_once(" = ").unwrap().0
}

#[test]
fn a_process_that_takes_more_of_the_processor_than_granted_is_replaced() {
    let folder = Folder::new();
    let sum =
        |of: &str| (0..45).map(|at| format!("min({of} * {at} + {at} m)")).collect::<Vec<_>>().join(" + ");
    let last = 11;
    let mut equations = vec![format!("v_dmin = {}", sum("w_1"))];
    equations.extend(
        (1..last).map(|at| format!("w_{at} = w_{0} + ({1}) * 1e-9", at + 1, sum(&format!("w_{}", at + 1)))),
    );
    equations.push(format!("w_{last} = 1 * v_3D"));
    let equations: Vec<&str> = equations.iter().map(String::as_str).collect();
    let model = model(&folder, &equations, "");
    let run = Running::start([
        &*model,
        "--isolation",
        "process",
        "--isolation-cpu",
        "1",
        "--isolation-time",
        "1 s",
    ]);
    let note = run.decision("restarted");
    let because = note["because"].as_str().unwrap();
    assert!(
        because.contains("ms of the processor within") && because.contains("1 % are granted"),
        "{because}"
    );
}

#[test]
fn a_need_may_ask_for_a_process_itself() {
    let folder = Folder::new();
    let model = model(&folder, &["v_dmin = min(v_3D)"], ", isolation: process");
    let (run, _) = working(&[&model]);
    let (_, state) = run.get("/state");
    assert_eq!(need(&state)["source"], "/depth/image by much_0, in a process of its own");
    // This model asks for no process.
    let run = Running::start([ROVER]);
    let state = run.until("it is served", |state| need(state)["quality"] == "Good");
    assert_eq!(need(&state)["isolation"], Value::Null);
    assert_eq!(need(&state)["source"], "/lidar/scan by nearest");
}
