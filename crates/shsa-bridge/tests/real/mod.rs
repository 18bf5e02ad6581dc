//! Independent programs for tests: a Python client that talks in lines of JSON, a free port, temporary files.

#![allow(dead_code, reason = "not every test uses all of it")]

pub(crate) mod network;

use serde_json::Value;
use std::collections::VecDeque;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

/// The time limit for everything that a test waits for.
pub(crate) const PATIENCE: Duration = Duration::from_secs(20);

/// A running Python script of `tests/python`; dropping it kills the process by its id.
pub(crate) struct Script {
    child: Child,
    orders: ChildStdin,
    answers: Receiver<Value>,
    /// Its output before an order was done.
    stated: VecDeque<Value>,
}

/// The Python of the virtual environment that `cargo xtask test` makes; prints SKIPPED and returns `None` if there is none.
pub(crate) fn python() -> Option<PathBuf> {
    let python = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target/python/bin/python");
    if python.exists() {
        return Some(python);
    }
    let mut error = std::io::stderr();
    let _ = writeln!(error, "SKIPPED: target/python is absent; `cargo xtask test` makes it");
    None
}

/// A free port on the loopback interface, for a server that reuses addresses.
///
/// A connection that its listener has closed keeps the port for a minute, so that no other client or server is given the port
/// before the server of the test listens there.
pub(crate) fn free_port() -> u16 {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a loopback interface");
    let address = listener.local_addr().expect("an address");
    let mut client = TcpStream::connect(address).expect("a listener");
    drop(listener.accept().expect("a client"));
    let _ = client.read(&mut [0]);
    address.port()
}

/// Repeats a check until it succeeds.
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
    /// Starts a script, and waits until it reports that it is ready.
    #[track_caller]
    pub(crate) fn start(python: &Path, script: &str, argument: &Value) -> Script {
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
        let mut script = Script { child, orders, answers, stated: VecDeque::new() };
        script.next_with("ready");
        script
    }

    /// Sends it a Unix signal.
    pub(crate) fn signal(&self, signal: &str) {
        let killed = Command::new("kill").args([format!("-{signal}"), self.child.id().to_string()]).status();
        assert!(killed.is_ok_and(|status| status.success()));
    }

    /// Gives an order, and waits until it is done; output in between is kept for later.
    #[track_caller]
    pub(crate) fn order(&mut self, order: &Value) {
        writeln!(self.orders, "{order}").expect("the script reads");
        let mut stated = VecDeque::new();
        let end = Instant::now() + PATIENCE;
        loop {
            let answer = self.take(end).unwrap_or_else(|why| panic!("the script never said 'done': {why}"));
            if answer.get("done").is_some() {
                break;
            }
            stated.push_back(answer);
        }
        self.stated = stated;
    }

    /// Its next output, at the latest at `end`.
    fn take(&mut self, end: Instant) -> Result<Value, RecvTimeoutError> {
        let stated = self.stated.pop_front();
        stated.map_or_else(|| self.answers.recv_timeout(end.saturating_duration_since(Instant::now())), Ok)
    }

    /// Gives an order, and returns the output with this key before the order is done.
    #[track_caller]
    pub(crate) fn answer(&mut self, order: &Value, key: &str) -> Value {
        writeln!(self.orders, "{order}").expect("the script reads");
        let answer = self.next_with(key);
        self.next_with("done");
        answer
    }

    /// Its output with this key within a time.
    pub(crate) fn poll(&mut self, key: &str, patience: Duration) -> Option<Value> {
        let end = Instant::now() + patience;
        loop {
            let answer = self.take(end).ok()?;
            if answer.get(key).is_some() {
                return Some(answer);
            }
        }
    }

    /// Its next output with this key; earlier output is skipped.
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
