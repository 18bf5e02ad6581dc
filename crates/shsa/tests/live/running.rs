//! A run of the command in the background, and requests to it.

use serde_json::Value;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, ExitStatus, Output, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::{Duration, Instant};

/// The token of every run in these tests.
pub(crate) const TOKEN: &str = "a-token-for-the-tests-only";
/// A time limit that no step reaches, even on a busy machine.
const PATIENCE: Duration = Duration::from_secs(60);

/// A temporary folder that is removed after the test.
pub(crate) struct Folder(PathBuf);

impl Folder {
    pub(crate) fn new() -> Folder {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let name = format!("live-{}-{}", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed));
        let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        std::fs::create_dir_all(&path).unwrap();
        Folder(path)
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// A run that is ended when this is dropped.
pub(crate) struct Running {
    child: Child,
    address: String,
    decisions: Receiver<String>,
    /// Standard output that nobody reads.
    _unread: Option<ChildStdout>,
}

impl Running {
    /// Starts `shsa run` with these arguments, on a free port for HTTP.
    pub(crate) fn start<'a>(arguments: impl IntoIterator<Item = &'a str>) -> Running {
        Running::start_under(&[], arguments)
    }

    /// As [`Running::start`], with a command before it that runs the rest of its line, as `env NAME=VALUE`.
    pub(crate) fn start_under<'a>(under: &[&str], arguments: impl IntoIterator<Item = &'a str>) -> Running {
        Running::begin(under, arguments, true)
    }

    /// As [`Running::start`]; its standard output is a pipe that nobody reads.
    #[allow(dead_code, reason = "not every test uses all of it")]
    pub(crate) fn start_unread<'a>(arguments: impl IntoIterator<Item = &'a str>) -> Running {
        Running::begin(&[], arguments, false)
    }

    fn begin<'a>(under: &[&str], arguments: impl IntoIterator<Item = &'a str>, is_read: bool) -> Running {
        let arguments: Vec<&str> = arguments.into_iter().collect();
        let any_port = ["--http", "127.0.0.1:0"].into_iter().filter(|_| !arguments.contains(&"--http"));
        let mut command = match under {
            [] => Command::new(crate::program()),
            [first, rest @ ..] => {
                let mut command = Command::new(first);
                command.args(rest).arg(crate::program());
                command
            }
        };
        let mut child = command
            .args(["run", "--json"])
            .args(any_port)
            .args(&arguments)
            .env("SHSA_TOKEN", TOKEN)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let output = child.stdout.take().unwrap();
        let (decisions, unread) = if is_read { (lines(output), None) } else { (channel().1, Some(output)) };
        let notes = lines(child.stderr.take().unwrap());
        let mut stated = Vec::new();
        let address = loop {
            let Ok(note) = notes.recv_timeout(PATIENCE) else { panic!("it said only {stated:?}") };
            match note.split_once("http://").and_then(|(_, rest)| rest.strip_suffix("/state")) {
                Some(address) => break address.to_owned(),
                None => stated.push(note),
            }
        };
        Running { child, address, decisions, _unread: unread }
    }

    /// The output of a run that ends by itself.
    #[allow(dead_code, reason = "not every test uses all of it")]
    pub(crate) fn ended<'a>(arguments: impl IntoIterator<Item = &'a str>) -> Output {
        let mut command = Command::new(crate::program());
        command.args(["run", "--http", "127.0.0.1:0", "--for", "10 s"]).args(arguments).output().unwrap()
    }

    /// The next decision of this kind; earlier ones are skipped.
    #[track_caller]
    pub(crate) fn decision(&self, kind: &str) -> Value {
        let end = Instant::now() + PATIENCE;
        let mut others = Vec::new();
        loop {
            let line = self.decisions.recv_timeout(end.saturating_duration_since(Instant::now()));
            let Ok(line) = line else { panic!("no decision '{kind}' came, but {others:#?}") };
            let decision: Value = serde_json::from_str(&line).unwrap();
            if decision["kind"] == kind {
                return decision;
            }
            others.push(line);
        }
    }

    /// All decisions since the last call.
    #[allow(dead_code, reason = "not every test uses all of it")]
    pub(crate) fn decisions(&self) -> Vec<Value> {
        self.decisions.try_iter().map(|line| serde_json::from_str(&line).unwrap()).collect()
    }

    /// A file of the process in /proc.
    #[allow(dead_code, reason = "not every test uses all of it")]
    pub(crate) fn process(&self, file: &str) -> String {
        std::fs::read_to_string(format!("/proc/{}/{file}", self.child.id())).unwrap()
    }

    /// Waits until the state meets a condition.
    #[track_caller]
    pub(crate) fn until(&self, what: &str, mut is_so: impl FnMut(&Value) -> bool) -> Value {
        let end = Instant::now() + PATIENCE;
        while Instant::now() < end {
            let (_, state) = self.get("/state");
            if is_so(&state) {
                return state;
            }
            thread::sleep(Duration::from_millis(20));
        }
        panic!("not so: {what}")
    }

    /// The address of its HTTP server.
    #[allow(dead_code, reason = "not every test uses all of it")]
    pub(crate) fn address(&self) -> &str {
        &self.address
    }

    /// The folder of its open files in /proc.
    #[allow(dead_code, reason = "not every test uses all of it")]
    pub(crate) fn files(&self) -> String {
        format!("/proc/{}/fd", self.child.id())
    }

    /// The status and the JSON of an answer.
    pub(crate) fn get(&self, path: &str) -> (u16, Value) {
        let stream = TcpStream::connect(&self.address).unwrap();
        let (status, text) = self.text(stream, &format!("GET {path}"), "", "");
        (status, serde_json::from_str(&text).unwrap_or(Value::String(text)))
    }

    /// Gives an order with this token; returns the status and the JSON of the answer.
    pub(crate) fn order(&self, token: Option<&str>, order: &str) -> (u16, Value) {
        self.order_over(TcpStream::connect(&self.address).unwrap(), token, order)
    }

    /// As [`Running::order`], over a given connection.
    pub(crate) fn order_over(&self, stream: TcpStream, token: Option<&str>, order: &str) -> (u16, Value) {
        let shown = token.map_or(String::new(), |token| format!("Authorization: bearer {token}\r\n"));
        let (status, text) = self.text(stream, "POST /orders", &shown, order);
        (status, serde_json::from_str(&text).unwrap_or(Value::String(text)))
    }

    /// The status and the text of the answer to a request.
    pub(crate) fn text(
        &self,
        mut stream: TcpStream,
        request: &str,
        headers: &str,
        body: &str,
    ) -> (u16, String) {
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let (host, length) = (&self.address, body.len());
        let request = format!(
            "{request} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n{headers}Content-Length: {length}\r\n\r\n{body}"
        );
        Running::answer(&mut stream, &request)
    }

    /// As [`Running::text`], for a literal request.
    pub(crate) fn answer(stream: &mut TcpStream, request: &str) -> (u16, String) {
        stream.write_all(request.as_bytes()).unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        let (head, body) = answer.split_once("\r\n\r\n").unwrap();
        let status = head.split(' ').nth(1).unwrap().parse().unwrap();
        (status, body.to_owned())
    }

    /// Ends it by SIGTERM, and waits.
    pub(crate) fn stop(mut self) -> ExitStatus {
        self.signal("-TERM");
        self.child.wait().unwrap()
    }

    /// As [`Running::stop`]; also returns all decisions that were not taken before.
    #[allow(dead_code, reason = "not every test uses all of it")]
    pub(crate) fn stop_and_tell(mut self) -> (ExitStatus, Vec<Value>) {
        self.signal("-TERM");
        let status = self.child.wait().unwrap();
        let reported = self.decisions.iter().map(|line| serde_json::from_str(&line).unwrap());
        (status, reported.collect())
    }

    /// The id of the process.
    #[allow(dead_code, reason = "not every test uses all of it")]
    pub(crate) fn id(&self) -> u32 {
        self.child.id()
    }

    /// Ends it by SIGKILL, as a crash would.
    pub(crate) fn kill(mut self) {
        self.signal("-KILL");
        self.child.wait().unwrap();
    }

    /// Sends it a Unix signal.
    pub(crate) fn signal(&self, signal: &str) {
        let status = Command::new("kill").args([signal, &self.child.id().to_string()]).status().unwrap();
        assert!(status.success());
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn lines(input: impl Read + Send + 'static) -> Receiver<String> {
    let (sender, receiver) = channel();
    thread::spawn(move || {
        let lines = BufReader::new(input).lines().map_while(Result::ok);
        lines.for_each(|line| drop(sender.send(line)));
    });
    receiver
}
