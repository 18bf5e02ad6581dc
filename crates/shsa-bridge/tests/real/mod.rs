//! Programs that are not ours: a Python client that a test talks with by lines of JSON, a free port, files that go away.

#![allow(dead_code, reason = "not every test uses all of it")]

use serde_json::Value;
use std::collections::VecDeque;
use std::io::{BufRead, BufReader, Write};
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

/// Everything that is waited for is there within this time, or never will be.
pub(crate) const PATIENCE: Duration = Duration::from_secs(20);

/// A running Python script of `tests/python`; it is killed with this value, by its own id.
pub(crate) struct Script {
    child: Child,
    orders: ChildStdin,
    answers: Receiver<Value>,
    /// What it said before an order was done.
    said: VecDeque<Value>,
}

/// The Python of the virtual environment that `cargo xtask test` makes; `None`, said aloud, where there is none.
pub(crate) fn python() -> Option<PathBuf> {
    let python = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target/python/bin/python");
    if python.exists() {
        return Some(python);
    }
    let mut error = std::io::stderr();
    let _ = writeln!(error, "SKIPPED: target/python is absent; `cargo xtask test` makes it");
    None
}

/// A port on the loopback interface that nobody listens on.
pub(crate) fn free_port() -> u16 {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a loopback interface");
    listener.local_addr().expect("an address").port()
}

/// Looks again and again until something is there.
#[track_caller]
pub(crate) fn eventually<T>(what: &str, mut look: impl FnMut() -> Option<T>) -> T {
    let end = Instant::now() + PATIENCE;
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(Instant::now() < end, "never came: {what}");
        std::thread::sleep(Duration::from_millis(2));
    }
}

impl Script {
    /// Starts a script, and waits until it says that it is ready.
    #[track_caller]
    pub(crate) fn start(python: &Path, script: &str, argument: &Value) -> Script {
        Script::begin(python, script, argument, PATIENCE).0
    }

    /// Starts a script, and waits for what it says when it is ready; it may take a minute more.
    #[track_caller]
    pub(crate) fn start_and_keep(python: &Path, script: &str, argument: &Value) -> Value {
        Script::begin(python, script, argument, PATIENCE + Duration::from_secs(60)).1
    }

    #[track_caller]
    fn begin(python: &Path, script: &str, argument: &Value, patience: Duration) -> (Script, Value) {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/python").join(script);
        let mut command = Command::new(python);
        command.arg(path).arg(argument.to_string()).stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut child = command.spawn().expect("python runs");
        let (orders, output) = (child.stdin.take().expect("piped"), child.stdout.take().expect("piped"));
        let (sender, answers) = channel();
        std::thread::spawn(move || {
            let lines = BufReader::new(output).lines().map_while(Result::ok);
            for line in lines.filter_map(|line| serde_json::from_str(&line).ok()) {
                if sender.send(line).is_err() {
                    return;
                }
            }
        });
        let mut script = Script { child, orders, answers, said: VecDeque::new() };
        let ready = script.next_within("ready", patience);
        (script, ready)
    }

    /// Sends it a signal of Unix by its id.
    pub(crate) fn signal(&self, signal: &str) {
        let killed = Command::new("kill").args([format!("-{signal}"), self.child.id().to_string()]).status();
        assert!(killed.is_ok_and(|status| status.success()));
    }

    /// Gives an order, and waits until it is done; what it says meanwhile is kept for whoever asks next.
    #[track_caller]
    pub(crate) fn order(&mut self, order: &Value) {
        writeln!(self.orders, "{order}").expect("the script reads");
        let mut said = VecDeque::new();
        let end = Instant::now() + PATIENCE;
        loop {
            let answer = self.take(end).unwrap_or_else(|why| panic!("the script never said 'done': {why}"));
            if answer.get("done").is_some() {
                break;
            }
            said.push_back(answer);
        }
        self.said = said;
    }

    /// What it says next, at the latest at `end`.
    fn take(&mut self, end: Instant) -> Result<Value, RecvTimeoutError> {
        let said = self.said.pop_front();
        said.map_or_else(|| self.answers.recv_timeout(end.saturating_duration_since(Instant::now())), Ok)
    }

    /// Gives an order, and takes what it says with this key before it is done.
    #[track_caller]
    pub(crate) fn answer(&mut self, order: &Value, key: &str) -> Value {
        writeln!(self.orders, "{order}").expect("the script reads");
        let answer = self.next_with(key);
        self.next_with("done");
        answer
    }

    /// What it says within a time that has this key.
    pub(crate) fn poll(&mut self, key: &str, patience: Duration) -> Option<Value> {
        let end = Instant::now() + patience;
        loop {
            let answer = self.take(end).ok()?;
            if answer.get(key).is_some() {
                return Some(answer);
            }
        }
    }

    /// What it says next that has this key; what it says before is passed over.
    #[track_caller]
    pub(crate) fn next_with(&mut self, key: &str) -> Value {
        self.next_within(key, PATIENCE)
    }

    #[track_caller]
    fn next_within(&mut self, key: &str, patience: Duration) -> Value {
        let end = Instant::now() + patience;
        loop {
            match self.take(end) {
                Ok(answer) if answer.get(key).is_some() => return answer,
                Ok(_) => {}
                Err(RecvTimeoutError::Timeout) => panic!("the script never said '{key}'"),
                Err(RecvTimeoutError::Disconnected) => panic!("the script ended before it said '{key}'"),
            }
        }
    }
}

impl Drop for Script {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
