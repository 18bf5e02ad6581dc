//! Actions on a source. The deciding thread starts an action, another one carries it out and waits for it; each action has a time
//! limit.

use rustix::process::{Pid, Signal, kill_process_group};
use serde_json::{Value, json};
use shsa_bridge::cdr::call;
use shsa_bridge::{Answer, Bridge, BridgeError, Inbox, Outgoing, Payload};
use shsa_format::wiring::{Action, ActionKind, Call};
use std::io::{BufRead, BufReader, PipeReader, Read};
use std::os::unix::process::CommandExt;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::time::{Duration, Instant};
use std::{env, thread};

/// The most characters of an action's output that are kept.
const OUTPUT_MAX: usize = 200;
/// How often a program is checked for its end.
const LOOK: Duration = Duration::from_millis(5);
/// How long the output of an ended program is awaited: other processes may hold it open.
const OUTPUT: Duration = Duration::from_millis(200);
/// The command topic of Mosquitto's dynamic security.
const DYNAMIC_SECURITY: &str = "$CONTROL/dynamic-security/v1";

/// The result of an action: the first line of its output, or why it failed.
pub(in super::super) type Outcome = Result<String, String>;

/// A running action.
#[derive(Debug)]
pub(in super::super) struct Job(Receiver<Outcome>);

impl Job {
    /// Starts an action; its end wakes the reader of the bridge's inbox.
    pub(in super::super) fn begin(action: &Action, bridge: &mut dyn Bridge) -> Job {
        let (sender, outcome) = channel();
        let work = prepare(action, bridge);
        let inbox = bridge.inbox().clone();
        let run = move |inbox: &Inbox| {
            // The receiver may be gone.
            let _ = sender.send(work.and_then(|work| work()).map(|printed| first_line(&printed)));
            inbox.wake();
        };
        let thread = thread::Builder::new().name("action".into()).spawn(move || run(&inbox));
        // If no thread could be started, the sender is dropped, and the outcome tells it.
        drop(thread);
        Job(outcome)
    }

    /// The result; `None` while the action is running.
    pub(in super::super) fn outcome(&self) -> Option<Outcome> {
        match self.0.try_recv() {
            Ok(outcome) => Some(outcome),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => Some(Err("it could not be carried out".to_owned())),
        }
    }
}

/// Describes an action, without its possible secrets.
pub(in super::super) fn describe(action: &Action) -> String {
    match &action.kind {
        ActionKind::Command(words) => format!("the command {}", words.first().map_or("", String::as_str)),
        ActionKind::Publish { topic, .. } => format!("a message on {topic}"),
        ActionKind::Request { to, .. } => format!("a request to {to}"),
        ActionKind::Service { name, .. } => format!("the service {name}"),
        ActionKind::DynamicSecurity { client, .. } => {
            format!("the broker's dynamic security (client {client})")
        }
    }
}

type Work = Box<dyn FnOnce() -> Outcome + Send>;

/// Does the part that needs the bridge, which is quick; returns the part that has to be waited for.
fn prepare(action: &Action, bridge: &mut dyn Bridge) -> Result<Work, String> {
    let within = Duration::from_nanos(u64::try_from(action.within.0).unwrap_or(0));
    match &action.kind {
        ActionKind::Command(words) => {
            let words = words.clone();
            Ok(Box::new(move || execute(&words, within)))
        }
        ActionKind::Publish { topic, payload } => {
            let stamp = bridge.inbox().clock().by_wall(bridge.inbox().clock().now());
            let payload = Payload::Bytes(payload.clone().into());
            bridge.publish(Outgoing::new(topic, stamp, payload)).map_err(described)?;
            Ok(Box::new(|| Ok(String::new())))
        }
        ActionKind::Request { to, payload, expect } => {
            let answer = bridge.request(to, payload.clone().into(), within).map_err(described)?;
            let expect = expect.clone();
            Ok(answered(answer, move |answer| expected(answer, expect.as_deref())))
        }
        ActionKind::Service { name, call } => {
            let request = match call {
                Call::SetBool(data) => call::set_bool(*data),
                Call::Trigger => call::trigger(),
                Call::ChangeState(transition) => call::change_state(*transition),
            };
            let answer = bridge.request(name, request, within).map_err(described)?;
            Ok(answered(answer, call::outcome))
        }
        ActionKind::DynamicSecurity { client, enabled } => {
            let command = if *enabled { "enableClient" } else { "disableClient" };
            let request = json!({ "commands": [{ "command": command, "username": client }] });
            let answer =
                bridge.request(DYNAMIC_SECURITY, request.to_string().into(), within).map_err(described)?;
            Ok(answered(answer, secured))
        }
    }
}

fn answered(answer: Answer, read: impl FnOnce(&[u8]) -> Outcome + Send + 'static) -> Work {
    Box::new(move || read(&answer().map_err(described)?))
}

fn described(error: BridgeError) -> String {
    first_line(&error.to_string())
}

fn expected(answer: &[u8], expect: Option<&str>) -> Outcome {
    let printed = String::from_utf8_lossy(answer).into_owned();
    match expect {
        Some(expect) if !printed.contains(expect) => {
            Err(format!("the answer `{}` does not hold `{expect}`", first_line(&printed)))
        }
        _ => Ok(printed),
    }
}

/// The result in an answer of Mosquitto's dynamic security, which has an error for each command.
fn secured(answer: &[u8]) -> Outcome {
    let answer: Value =
        serde_json::from_slice(answer).map_err(|error| format!("no answer in JSON: {error}"))?;
    let responses = answer["responses"].as_array().into_iter().flatten();
    match responses.filter_map(|response| response["error"].as_str()).next() {
        Some(error) => Err(format!("the broker says: {error}")),
        None => Ok(String::new()),
    }
}

/// Runs a program without a shell, without input, and without our secrets. After the time limit, kills it and all that it has
/// started.
fn execute(words: &[String], within: Duration) -> Outcome {
    let Some((program, arguments)) = words.split_first() else { return Err("no program".to_owned()) };
    let failed = |what: &str, error: std::io::Error| format!("{program} {what}: {error}");
    let (output, input) = std::io::pipe().map_err(|error| failed("gets no pipe", error))?;
    let second = input.try_clone().map_err(|error| failed("gets no pipe", error))?;
    let mut command = Command::new(program);
    command.args(arguments).stdin(Stdio::null()).stdout(input).stderr(second).process_group(0);
    for (name, _) in env::vars_os().filter(|(name, _)| name.to_string_lossy().starts_with("SHSA_")) {
        command.env_remove(name);
    }
    let child = command.spawn();
    // The command holds our ends of the pipe.
    drop(command);
    let mut child = child.map_err(|error| failed("cannot be started", error))?;
    let printed = listen(output);
    let ended = wait(&mut child, within).map_err(|error| failed("cannot be waited for", error))?;
    let printed = printed.recv_timeout(OUTPUT).unwrap_or_default();
    let output_suffix = if printed.is_empty() { String::new() } else { format!(": {printed}") };
    match ended {
        Some(status) if status.success() => Ok(printed),
        Some(status) => Err(format!("{program} ended with {}{output_suffix}", shown(status))),
        None => Err(format!("{program} was killed after {:.1} s{output_suffix}", within.as_secs_f64())),
    }
}

fn shown(status: ExitStatus) -> String {
    status.code().map_or_else(|| status.to_string(), |code| format!("status {code}"))
}

/// The exit status of a program; `None`: it was killed.
fn wait(child: &mut Child, within: Duration) -> std::io::Result<Option<ExitStatus>> {
    let end = Instant::now() + within;
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(Some(status));
        }
        if Instant::now() >= end {
            // The program may have ended just now.
            let _ = kill_process_group(Pid::from_child(child), Signal::KILL);
            child.wait()?;
            return Ok(None);
        }
        thread::sleep(LOOK);
    }
}

/// The first line of an output, as soon as it is there; the rest is read so that no writer blocks.
fn listen(output: PipeReader) -> Receiver<String> {
    let (sender, printed) = channel();
    thread::spawn(move || {
        let mut output = BufReader::new(output);
        let mut line = Vec::new();
        let mut begin = output.by_ref().take(4 * OUTPUT_MAX as u64);
        while begin.read_until(b'\n', &mut line).is_ok_and(|read| read > 0) && line.trim_ascii().is_empty() {}
        let _ = sender.send(first_line(&String::from_utf8_lossy(&line)));
        let _ = std::io::copy(&mut output, &mut std::io::sink());
    });
    printed
}

/// The first line, cut to a length, without control characters for the terminal.
fn first_line(text: &str) -> String {
    let line = text.lines().map(str::trim).find(|line| !line.is_empty()).unwrap_or_default();
    line.chars().take(OUTPUT_MAX).map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(words: &[&str], within: u64) -> Outcome {
        let words: Vec<String> = words.iter().map(|word| (*word).to_owned()).collect();
        execute(&words, Duration::from_millis(within))
    }

    #[test]
    fn a_program_says_how_it_went() {
        assert_eq!(run(&["sh", "-c", "echo; echo done >&2; echo more"], 10_000), Ok("done".to_owned()));
        assert_eq!(
            run(&["sh", "-c", "echo no; exit 3"], 10_000),
            Err("sh ended with status 3: no".to_owned())
        );
        assert!(run(&["/nowhere/at-all"], 10_000).unwrap_err().contains("cannot be started"));
        // Without a shell, shell metacharacters are plain text.
        assert_eq!(run(&["echo", "$HOME; exit 1"], 10_000), Ok("$HOME; exit 1".to_owned()));
    }

    #[test]
    fn who_takes_too_long_is_killed_with_all_that_it_has_started() {
        let began = Instant::now();
        let outcome = run(&["sh", "-c", "echo begun; sleep 60 & echo $!; wait"], 200);
        assert_eq!(outcome, Err("sh was killed after 0.2 s: begun".to_owned()));
        assert!(began.elapsed() < Duration::from_secs(30));
    }

    #[test]
    fn much_output_is_no_problem_and_is_cut() {
        let printed = run(&["sh", "-c", "head -c 3000000 /dev/zero | tr '\\0' x"], 20_000).unwrap();
        assert_eq!(printed, "x".repeat(OUTPUT_MAX));
    }

    #[test]
    fn answers_are_looked_at() {
        assert_eq!(expected(b"all ok\n", Some("ok")), Ok("all ok\n".to_owned()));
        assert!(expected(b"never", Some("ok")).unwrap_err().contains("`never`"));
        assert_eq!(secured(br#"{"responses":[{"command":"disableClient"}]}"#), Ok(String::new()));
        let refused = br#"{"responses":[{"command":"disableClient","error":"Client not found"}]}"#;
        assert_eq!(secured(refused), Err("the broker says: Client not found".to_owned()));
        assert!(secured(b"?").is_err());
    }
}
