//! A session with a Zenoh network: opened in the background until it succeeds, and closed within a time limit.

use super::options::{Mode, Options, Settings, first_line, set};
use crate::{BridgeError, Channel, Link, PublisherId};
use ::zenoh::{Config, Session, Wait};
use serde_json::json;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Sender};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::{Duration, Instant};

/// The longest wait for the other side when closing.
const CLOSING_MAX: Duration = Duration::from_secs(1);
/// The longest wait between two attempts to open.
const RETRY_MAX: Duration = Duration::from_secs(2);

/// A session, or the attempts to open one. Dropping it closes the session.
#[derive(Debug)]
pub(crate) struct Connection {
    shared: Arc<Shared>,
    publisher: PublisherId,
}

#[derive(Debug)]
struct Shared {
    settings: Settings,
    session: OnceLock<Session>,
    state: Mutex<State>,
    closed: AtomicBool,
}

/// Runs as soon as there is a session.
type Job = Box<dyn FnOnce(&Session) + Send>;

#[derive(Default)]
struct State {
    waiting: Vec<Job>,
    /// Why there is no connection.
    problem: String,
}

impl std::fmt::Debug for State {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} waiting, {}", self.waiting.len(), self.problem)
    }
}

impl Connection {
    /// Opens a session; if the other side cannot be reached within the options' patience, attempts go on in the background.
    ///
    /// # Errors
    /// When the options cannot be used, an address cannot be listened on, or the other side refuses us.
    pub(crate) fn open(options: &Options) -> Result<Connection, BridgeError> {
        let mut settings = options.settings()?;
        let own = settings.config.get_json("id").ok().filter(|id| id != "null");
        let id = own.map_or_else(random_id, |id| id.trim_matches('"').to_owned());
        set(&mut settings.config, "id", &json!(id))?;
        let publisher = u128::from_str_radix(&id, 16).map(PublisherId);
        let publisher =
            publisher.map_err(|_| BridgeError::Configuration(format!("id: '{id}' is no identity")))?;
        let state = Mutex::new(State { problem: "not connected yet".into(), ..State::default() });
        let shared =
            Arc::new(Shared { settings, session: OnceLock::new(), state, closed: AtomicBool::new(false) });
        let connection = Connection { shared: shared.clone(), publisher };
        let (first, opened) = mpsc::channel();
        std::thread::spawn(move || shared.keep_opening(&first));
        match opened.recv_timeout(options.patience) {
            Ok(Err(problem @ (BridgeError::Configuration(_) | BridgeError::Refused(_)))) => Err(problem),
            _ => Ok(connection),
        }
    }

    pub(crate) fn channel(&self) -> Channel {
        self.shared.settings.channel
    }

    pub(crate) fn publisher(&self) -> PublisherId {
        self.publisher
    }

    /// The session, once there is one.
    pub(crate) fn session(&self) -> Option<&Session> {
        self.shared.session.get()
    }

    /// Runs a job with the session: now, or as soon as there is one.
    pub(crate) fn when_open(&self, job: impl FnOnce(&Session) + Send + 'static) {
        let mut state = self.shared.lock();
        match self.shared.session.get() {
            None => state.waiting.push(Box::new(job)),
            Some(session) => {
                drop(state);
                job(session);
            }
        }
    }

    pub(crate) fn link(&self) -> Link {
        match self.session() {
            Some(session) if self.shared.is_connected(session) => Link::Up,
            Some(_) => Link::Down(format!("no connection to {}", self.shared.settings.connect.join(", "))),
            None => Link::Down(self.shared.lock().problem.clone()),
        }
    }
}

impl Drop for Connection {
    fn drop(&mut self) {
        self.shared.closed.store(true, Ordering::Release);
        let Some(session) = self.session().cloned() else { return };
        let (done, closed) = mpsc::channel();
        std::thread::spawn(move || {
            // The result of closing does not matter, and the waiting thread may have given up.
            let _ = session.close().wait();
            let _ = done.send(());
        });
        let _ = closed.recv_timeout(CLOSING_MAX);
    }
}

impl Shared {
    /// Tries until there is a session, or the connection is dropped; sends the outcome of the first attempt.
    fn keep_opening(&self, first: &Sender<Result<(), BridgeError>>) {
        let mut wait = Duration::from_millis(100);
        while !self.closed.load(Ordering::Acquire) {
            let opened = self.try_open();
            let outcome = match &opened {
                Ok(session) => self.explain(session),
                Err(problem) => Err(problem.clone()),
            };
            if let Err(problem) = &outcome {
                self.lock().problem = problem.to_string();
            }
            if let Ok(session) = opened {
                self.serve(session);
                let _ = first.send(outcome);
                return;
            }
            // The receiver is gone after the first attempt.
            let _ = first.send(outcome);
            std::thread::sleep(wait);
            wait = (wait * 2).min(RETRY_MAX);
        }
    }

    /// Stores the session and runs the waiting jobs in order, before any new one.
    fn serve(&self, session: Session) {
        let mut state = self.lock();
        for job in state.waiting.drain(..) {
            job(&session);
        }
        let session = self.session.get_or_init(|| session);
        drop(state);
        if self.closed.load(Ordering::Acquire) {
            let _ = session.close().wait();
        }
    }

    fn try_open(&self) -> Result<Session, BridgeError> {
        let opened = ::zenoh::open(self.settings.config.clone()).wait();
        opened.map_err(|problem| {
            let problem = first_line(&problem.to_string());
            // A peer connects in the background: an immediate failure concerns its own side.
            let asked = match self.settings.mode {
                Mode::Client => self.probe(),
                Mode::Peer => None,
            };
            asked.unwrap_or_else(|| kind_of(&problem, self.settings.mode))
        })
    }

    /// Why a session has no connection.
    fn explain(&self, session: &Session) -> Result<(), BridgeError> {
        let patience = Instant::now() + Duration::from_millis(300);
        while Instant::now() < patience {
            if self.is_connected(session) {
                return Ok(());
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        self.probe().map_or(Ok(()), Err)
    }

    /// Probes each endpoint alone, because a session of several does not tell what was wrong; `None`: one endpoint answers.
    fn probe(&self) -> Option<BridgeError> {
        let mut problem = None;
        for endpoint in &self.settings.connect {
            match self.probe_one(endpoint) {
                Ok(()) => return None,
                Err(found @ BridgeError::Refused(_)) => return Some(found),
                Err(found) => problem = Some(found),
            }
        }
        problem
    }

    fn probe_one(&self, endpoint: &str) -> Result<(), BridgeError> {
        let mut config: Config = self.settings.config.clone();
        set(&mut config, "id", &json!(random_id()))?;
        set(&mut config, "mode", &json!("peer"))?;
        for (key, value) in [
            ("listen/endpoints", json!([])),
            ("scouting/multicast/enabled", json!(false)),
            ("scouting/gossip/enabled", json!(false)),
            ("connect/endpoints", json!([endpoint])),
            ("connect/timeout_ms", json!(0)),
            ("connect/exit_on_failure", json!(true)),
        ] {
            set(&mut config, key, &value)?;
        }
        let session = ::zenoh::open(config).wait().map_err(|problem| {
            kind_of(&format!("{endpoint}: {}", first_line(&problem.to_string())), Mode::Client)
        })?;
        let _ = session.close().wait();
        Ok(())
    }

    /// Whether the session has a connection that it should have. A session that only listens needs none.
    fn is_connected(&self, session: &Session) -> bool {
        let info = session.info();
        self.settings.connect.is_empty()
            || info.routers_zid().wait().next().is_some()
            || info.peers_zid().wait().next().is_some()
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Classifies an error by its text, as Zenoh's errors are texts.
fn kind_of(problem: &str, mode: Mode) -> BridgeError {
    let text = problem.to_lowercase();
    // The last text is a router's answer to a wrong password; it has no details.
    let refusals =
        ["certificate", "unknownissuer", "notvalidforname", "handshake", "alert", "received a close message"];
    if refusals.iter().any(|word| text.contains(word)) {
        BridgeError::Refused(problem.to_owned())
    } else if mode == Mode::Peer {
        BridgeError::Configuration(problem.to_owned())
    } else {
        BridgeError::Lost(problem.to_owned())
    }
}

/// Unique hexadecimal digits without a leading zero.
fn random_id() -> String {
    ::zenoh::session::ZenohId::default().to_string()
}
