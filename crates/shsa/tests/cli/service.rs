//! `shsa service`: the generic service, over standard input and output.

use crate::folder::Folder;
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Write};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::{Duration, Instant};

/// A running service.
pub(crate) struct Service {
    child: Child,
    input: Option<ChildStdin>,
    output: BufReader<ChildStdout>,
}

impl Service {
    pub(crate) fn start(arguments: &[&str]) -> Service {
        let mut command = Command::new(env!("CARGO_BIN_EXE_shsa"));
        command.args(["service", "--stdio"]).args(arguments);
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        let (input, output) = (child.stdin.take(), BufReader::new(child.stdout.take().unwrap()));
        Service { child, input, output }
    }

    pub(crate) fn say(&mut self, topic: &str, payload: Value, stamp_s: f64) {
        let stamp_ns = (stamp_s * 1e9) as i64;
        let line = json!({ "topic": topic, "payload": payload, "stamp_ns": stamp_ns });
        writeln!(self.input.as_mut().unwrap(), "{line}").unwrap();
    }

    fn receive(&mut self) -> Value {
        let mut line = String::new();
        self.output.read_line(&mut line).unwrap();
        serde_json::from_str(&line).unwrap_or_else(|error| panic!("{error}: {line:?}"))
    }

    /// Closes its input; returns its output until its end, its exit status, and its standard error.
    pub(crate) fn end(mut self) -> (Vec<Value>, i32, String) {
        drop(self.input.take());
        let rest: Vec<String> = (&mut self.output).lines().map(Result::unwrap).collect();
        let output = self.child.wait_with_output().unwrap();
        let reported = rest.iter().map(|line| serde_json::from_str(line).unwrap()).collect();
        (reported, output.status.code().unwrap_or(-1), String::from_utf8(output.stderr).unwrap())
    }
}

fn payloads(lines: &[Value]) -> Vec<&Value> {
    lines.iter().map(|line| &line["payload"]).collect()
}

const SUM: [&str; 8] =
    ["-i", "/input1#data", "-i", "/input2#data", "-p", "y = x[0] + x[1]", "-o", "/output#data"];

#[test]
fn listing_1_1_of_the_thesis_adds_two_numbers() {
    let mut service = Service::start(&SUM);
    service.say("/input1", json!({"data": 1.5}), 1.0);
    service.say("/elsewhere", json!(7), 1.0);
    service.say("/input2", json!({"data": 2}), 1.1);
    let sum = service.receive();
    assert_eq!((&sum["topic"], &sum["payload"]), (&json!("/output"), &json!({"data": 3.5})));
    assert_eq!((&sum["stamp_ns"], &sum["quality"]), (&json!(1_100_000_000_i64), &json!("Good")));
    service.say("/input1", json!({"data": -2.0}), 1.2);
    assert_eq!(service.receive()["payload"], json!({"data": 0}));
    let (rest, status, errors) = service.end();
    assert_eq!((rest.len(), status, errors.as_str()), (0, 0, ""));
}

#[test]
fn a_complete_set_is_waited_for_where_that_is_asked() {
    let mut service = Service::start(&[&SUM[..], &["--complete"]].concat());
    for (topic, number, stamp) in [
        ("/input1", 1, 1.0),
        ("/input1", 2, 1.1),
        ("/input2", 10, 1.1),
        ("/input2", 20, 1.2),
        ("/input1", 3, 1.2),
    ] {
        service.say(topic, json!({ "data": number }), stamp);
    }
    let (reported, status, _) = service.end();
    assert_eq!(payloads(&reported), [&json!({"data": 12}), &json!({"data": 23})]);
    assert_eq!(status, 0);
}

#[test]
fn several_outputs_lists_and_changes() {
    let program = "y[0] = min(x[0]); y[1] = x[1] - previous(x[1])";
    let arguments = ["-i", "/scan#ranges", "/step", "-p", program, "-o", "/nearest", "/change"];
    let mut service = Service::start(&[&arguments[..], &["--vector", "0", "--complete"]].concat());
    for (stamp, scan, step) in [(1.0, [4.0, 2.0, 9.0], 1), (2.0, [7.0, 8.0, 6.5], 5)] {
        service.say("/scan", json!({ "ranges": scan, "frame": "lidar" }), stamp);
        service.say("/step", json!(step), stamp);
    }
    let (reported, ..) = service.end();
    let found: Vec<(&str, f64)> =
        reported.iter().map(|it| (it["topic"].as_str().unwrap(), it["payload"].as_f64().unwrap())).collect();
    // A change needs two values.
    assert_eq!(found, [("/nearest", 2.0), ("/nearest", 6.5), ("/change", 4.0)]);
}

#[test]
fn garbage_is_counted_and_nothing_is_made_of_it() {
    let mut service = Service::start(&[&SUM[..], &["--stats", "1 h"]].concat());
    service.say("/input1", json!({"data": 1}), 1.0);
    service.say("/input2", json!({"data": "many"}), 1.0);
    service.say("/input2", json!({"other": 2}), 1.0);
    writeln!(service.input.as_mut().unwrap(), "{{\"topic\": 5}}\nnonsense\n").unwrap();
    service.say("/input2", json!({"data": 4}), 1.0);
    let (reported, status, errors) = service.end();
    assert_eq!((payloads(&reported), status), (vec![&json!({"data": 5})], 0));
    for part in ["evaluated 1, published 1", "unreadable 2", "2 lines of standard input are no messages"] {
        assert!(errors.contains(part), "{errors}");
    }
}

#[test]
fn a_value_that_is_too_old_is_none() {
    let mut service =
        Service::start(&["-i", "/a", "-p", "y = x", "-o", "/b", "--period", "20 ms", "--max-age", "150 ms"]);
    let mut line = json!({ "topic": "/a", "payload": 1 }).to_string();
    line.push('\n');
    service.input.as_mut().unwrap().write_all(line.as_bytes()).unwrap();
    assert_eq!(service.receive()["payload"], json!(1));
    std::thread::sleep(Duration::from_millis(400));
    let (reported, status, _) = service.end();
    // At most one output for each period in which the input was fresh.
    assert!((1..=8).contains(&reported.len()), "{}", reported.len());
    assert_eq!(status, 0);
}

#[test]
fn it_ends_with_a_signal_and_with_its_time() {
    let mut service = Service::start(&SUM);
    service.say("/input1", json!({"data": 1}), 1.0);
    service.say("/input2", json!({"data": 2}), 1.0);
    assert_eq!(service.receive()["payload"], json!({"data": 3}));
    let id = service.child.id().to_string();
    assert!(Command::new("kill").args(["-TERM", &id]).status().unwrap().success());
    assert_eq!(service.child.wait().unwrap().code(), Some(0));
    let began = Instant::now();
    let mut timed = Service::start(&[&SUM[..], &["--for", "200 ms"]].concat());
    assert_eq!(timed.child.wait().unwrap().code(), Some(0));
    assert!(began.elapsed() >= Duration::from_millis(200));
}

/// Checks arguments that are refused before any work, with these words on standard error.
#[track_caller]
fn check_refused(arguments: &[&str], words: &[&str]) {
    let (reported, status, errors) = Service::start(arguments).end();
    assert_eq!((reported.len(), status), (0, 2), "{errors}");
    words.iter().for_each(|word| assert!(errors.contains(word), "{errors}"));
}

#[test]
fn what_cannot_be_is_refused_with_its_place() {
    let mut wrong = SUM;
    wrong[5] = "y = x[0] + x[2]";
    check_refused(&wrong, &["`x[2]` is not defined", "  |            ^^^^", "did you mean `x[0]`?"]);
    wrong[5] = "y = x[0] +";
    check_refused(&wrong, &["error:", "  | y = x[0] +"]);
    wrong[5] = "y = os.system(x[0])";
    check_refused(&wrong, &["error:"]);
    check_refused(&[&SUM[..], &["--period", "1 ns"]].concat(), &["is shorter than one evaluation"]);
    check_refused(&[&SUM[..], &["--vector", "2"]].concat(), &["there are 2 inputs, counted from 0"]);
    check_refused(
        &[&SUM[..], &["--max-age", "1 s", "--max-age", "2 s", "--max-age", "3 s"]].concat(),
        &["3 greatest ages for 2 inputs"],
    );
    check_refused(&["-i", "/a", "-p", "y = x", "-o", "#data"], &["write TOPIC or TOPIC#FIELD"]);
    check_refused(&["-p", "y = 1", "-o", "/b"], &["give it a --period"]);
}

#[test]
fn a_bus_that_cannot_be_reached_is_reported_at_once() {
    let folder = Folder::new();
    let service = "service -i /a#x -p y=x -o /b --bus mqtt://127.0.0.1:1";
    let ended = folder.run(&format!("{service} --patience 1ms"));
    assert_eq!(ended.status, 4, "{}", ended.stderr);
    assert!(ended.stderr.contains("error: mqtt://127.0.0.1:1 cannot be reached: "), "{}", ended.stderr);
    let ended = folder.run(&format!("{service} --for 500ms --log-format text"));
    assert_eq!(ended.status, 4, "{}", ended.stderr);
    let lines: Vec<&str> = ended.stderr.lines().collect();
    assert!(
        lines[0].contains("Z warning mqtt://127.0.0.1:1 cannot be reached and is waited for"),
        "{lines:?}"
    );
    assert!(lines[1].contains("Z error   mqtt://127.0.0.1:1 cannot be reached"), "{lines:?}");
    assert_eq!(folder.run(&format!("{service} --for 500ms -q")).stderr.lines().count(), 2);
}
