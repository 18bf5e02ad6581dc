//! The instance under measurement: `shsa run` in a process of its own, or an instance in memory in a thread.

use super::middleware::{Kind, Middleware, PATIENCE, Process};
use super::model::Plan;
use crate::processor::{memory_bytes, seconds_of};
use anyhow::{Context, bail};
use serde_json::Value;
use shsa_model::live::{Live, Written};
use shsa_runtime::{Handle, Model, Options, Runtime};
use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// The instance's name on the bus.
pub(super) const NAME: &str = "bench";
/// The topic of the instance's events.
pub(super) const EVENTS: &str = "shsa/bench/events";
/// How many messages of one topic may wait for the instance.
const QUEUE: usize = 4096;

/// A running instance.
pub(super) enum Subject {
    Process {
        child: Process,
        /// The address of the instance's HTTP server.
        http: String,
    },
    Thread {
        thread: Option<JoinHandle<()>>,
        handle: Handle,
        /// The folder of the instance's thread in /proc.
        place: PathBuf,
    },
}

/// How to run an instance.
#[derive(Clone, Copy)]
pub(super) struct Manner {
    /// The transport may lose messages when a connection breaks.
    pub(super) at_most_once: bool,
    /// Run the instance on one core.
    pub(super) on_one_core: bool,
    /// The instance ends by itself after this time.
    pub(super) at_most: Duration,
}

impl Subject {
    /// Starts an instance; it is connected when this returns.
    ///
    /// # Errors
    /// When the instance does not start.
    pub(super) fn start(middleware: &Middleware, plan: &Plan, manner: Manner) -> anyhow::Result<Subject> {
        match middleware.kind {
            Kind::Memory => Subject::in_memory(middleware, plan),
            _ => Subject::in_process(middleware, plan, manner),
        }
    }

    fn in_memory(middleware: &Middleware, plan: &Plan) -> anyhow::Result<Subject> {
        let bridge = middleware.join(NAME, QUEUE, false)?;
        let text = plan.text();
        let (live, _) = Live::load(Written { name: "bench.yaml", text: &text })
            .map_err(|report| anyhow::anyhow!(report.render(false)))?;
        let model = Model { name: NAME.to_owned(), path: None, live };
        let options = Options { name: NAME.to_owned(), ..Options::default() };
        let runtime = Runtime::new(vec![model], options, bridge)?;
        let handle = runtime.handle();
        let (place, started) = channel();
        let thread = thread::Builder::new().name("healer".into()).spawn(move || {
            let _ = place.send(fs::canonicalize("/proc/thread-self").unwrap_or_default());
            if let Err(error) = runtime.run().map_err(anyhow::Error::from) {
                eprintln!("error: {error:#}");
            }
        })?;
        let place = started.recv().context("the thread did not start")?;
        Ok(Subject::Thread { thread: Some(thread), handle, place })
    }

    fn in_process(middleware: &Middleware, plan: &Plan, manner: Manner) -> anyhow::Result<Subject> {
        let model = middleware.folder.join("bench.yaml");
        fs::write(&model, plan.text()).with_context(|| format!("cannot write {}", model.display()))?;
        let program = crate::program::shsa()?;
        let mut command = match manner.on_one_core {
            true => pinned(&program),
            false => Command::new(program),
        };
        command.arg("run").arg(&model);
        command.args(["--bus", &middleware.address(manner.at_most_once), "--name", NAME, "--json"]);
        command.args(["--http", "127.0.0.1:0", "--queue", &QUEUE.to_string()]);
        command.args(["--for", &format!("{} s", manner.at_most.as_secs() + 1)]);
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
        let mut child = Process(command.spawn().context("cannot start shsa")?);
        let notes = lines(child.0.stderr.take().context("no standard error")?);
        let end = Instant::now() + PATIENCE;
        let mut other_notes = Vec::new();
        loop {
            let Ok(note) = notes.recv_timeout(end.saturating_duration_since(Instant::now())) else {
                bail!("the instance said only {other_notes:?}");
            };
            match note.split_once("http://").and_then(|(_, rest)| rest.strip_suffix("/state")) {
                Some(http) => return Ok(Subject::Process { child, http: http.to_owned() }),
                None => other_notes.push(note),
            }
        }
    }

    /// The state of the instance, as `/state` returns it.
    ///
    /// # Errors
    /// When the instance does not answer.
    pub(super) fn state(&self) -> anyhow::Result<Value> {
        match self {
            Subject::Process { http, .. } => get(http),
            Subject::Thread { handle, .. } => handle.state().context("the instance does not answer"),
        }
    }

    /// The address of its HTTP server; `None` in memory.
    pub(super) fn http(&self) -> Option<&str> {
        match self {
            Subject::Process { http, .. } => Some(http),
            Subject::Thread { .. } => None,
        }
    }

    /// Processor time used so far, in seconds.
    pub(super) fn processor_seconds(&self) -> f64 {
        match self {
            Subject::Process { child, .. } => seconds_of(&child.0.id().to_string()),
            Subject::Thread { place, .. } => seconds_of(&place.to_string_lossy()),
        }
    }

    /// Memory of its own, bytes: pages that no file backs. Those of the program's file come and go as the kernel likes. In
    /// memory, of this whole process.
    pub(super) fn memory_bytes(&self) -> f64 {
        match self {
            Subject::Process { child, .. } => memory_bytes(&child.0.id().to_string(), "RssAnon"),
            Subject::Thread { .. } => memory_bytes("self", "RssAnon"),
        }
    }
}

impl Drop for Subject {
    fn drop(&mut self) {
        if let Subject::Thread { thread, handle, .. } = self {
            handle.stop();
            let _ = thread.take().map(JoinHandle::join);
        }
    }
}

/// A program on the last core, where the system has `taskset`.
fn pinned(program: &std::path::Path) -> Command {
    let cores = thread::available_parallelism().map_or(1, std::num::NonZeroUsize::get);
    if Command::new("taskset").arg("--version").stdout(Stdio::null()).status().is_err() {
        return Command::new(program);
    }
    let mut command = Command::new("taskset");
    command.args(["--cpu-list", &(cores - 1).to_string()]).arg(program);
    command
}

fn lines(input: impl Read + Send + 'static) -> Receiver<String> {
    let (sender, receiver) = channel();
    thread::spawn(move || {
        let lines = BufReader::new(input).lines().map_while(Result::ok);
        lines.for_each(|line| drop(sender.send(line)));
    });
    receiver
}

fn get(http: &str) -> anyhow::Result<Value> {
    let mut stream = TcpStream::connect(http).context("asking the instance for its state")?;
    stream.set_read_timeout(Some(PATIENCE))?;
    write!(stream, "GET /state HTTP/1.1\r\nHost: {http}\r\nConnection: close\r\n\r\n")?;
    let mut answer = String::new();
    stream.read_to_string(&mut answer)?;
    let (_, body) = answer.split_once("\r\n\r\n").context("the instance answers with something else")?;
    Ok(serde_json::from_str(body)?)
}
