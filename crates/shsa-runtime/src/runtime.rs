//! A run, built from models, options and a bus. It runs in a thread of the caller.

use crate::bindings::OutputOptions;
use crate::connection::Connection;
use crate::control::{Desk, Guard, Tokens, bus, http};
use crate::discovery::Discovery;
use crate::error::{Context, RuntimeError};
use crate::event_log::EventLog;
use crate::explained::Explained;
use crate::federation::Federation;
use crate::figures::Figures;
use crate::handle::Handle;
use crate::healer::Healer;
use crate::neighbours::Neighbours;
use crate::options::{Model, Options};
use crate::ownership::Ownership;
use crate::session::{Questions, Reported, Session};
use crate::shared_session::SharedSession;
use crate::shared_verdicts::SharedVerdicts;
use crate::strangers::Strangers;
use shsa_bridge::Bridge;
use shsa_core::time::{Span, Time};
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Runs models on a bus.
///
/// ```
/// use shsa_bridge::memory::MemoryBus;
/// use shsa_bridge::{Bridge, Clock, Outgoing, Payload};
/// use shsa_core::observation::RawValue;
/// use shsa_model::live::{Live, Written};
/// use shsa_runtime::{Ending, Model, Options, Runtime};
///
/// let text = "
/// shsa: 1
/// variables: { speed: { unit: m/s } }
/// signals: { wheel: { variable: speed } }
/// needs: { speed: { signal: healed/speed, max_age: 1 min } }
/// ";
/// let (live, _) = Live::load(Written { name: "car", text }).unwrap();
/// let model = Model { name: "car".to_owned(), path: None, live };
///
/// let bus = MemoryBus::new(Clock::running());
/// let (mut wheel, mut reader) = (bus.join(16), bus.join(16));
/// reader.subscribe("healed/speed", None)?;
/// let runtime = Runtime::new(vec![model], Options::default(), Box::new(bus.join(16)))?;
/// let handle = runtime.handle();
/// let run = std::thread::spawn(move || runtime.run());
///
/// let now = bus.clock().by_wall(bus.clock().now());
/// wheel.publish(Outgoing::new("wheel", now, Payload::Value(RawValue::Number(5.0))))?;
/// let healed = loop {
///     match reader.receive() {
///         Some(message) => break message,
///         None => std::thread::yield_now(),
///     }
/// };
/// assert_eq!(healed.value(), Some(&RawValue::Interval { lo: 5.0, hi: 5.0 }));
///
/// handle.stop();
/// assert_eq!(run.join().unwrap()?, Ending::Served);
/// # Ok::<(), shsa_runtime::RuntimeError>(())
/// ```
pub struct Runtime {
    pub(super) session: Session,
    handle: Handle,
    duration: Option<Span>,
}

/// The end of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// Every need was served.
    Served,
    /// A need was not served.
    Unserved,
}

impl Runtime {
    /// Subscribes to the signals of the models, restores their states if there are any, and answers requests on the bus from then
    /// on.
    ///
    /// # Errors
    /// When models, options and bus do not fit each other, the bus refuses, or a file cannot be read or written.
    pub fn new(
        models: Vec<Model>,
        options: Options,
        mut bridge: Box<dyn Bridge>,
    ) -> Result<Runtime, RuntimeError> {
        let Options { name, engine, form, wiring, sandbox, .. } = options;
        let (inbox, clock) = (bridge.inbox().clone(), bridge.inbox().clock().clone());
        inbox.attend()?;
        // Other instances are looked up before any input is subscribed to: the first value would make this instance take a need
        // that another one serves.
        let shared_verdicts = SharedVerdicts::new(&name, bridge.as_ref())?;
        let ownership = Ownership::new(&name, bridge.as_ref())?;
        let output_options = OutputOptions { form, wiring };
        let hears = ownership.is_some();
        let healer =
            |model: Model| Healer::new(model, engine, output_options.clone(), hears, bridge.as_mut());
        let mut healers = models.into_iter().map(healer).collect::<Result<Vec<_>, _>>()?;
        for healer in &mut healers {
            healer.isolate(&sandbox, inbox.clone())?;
        }
        if let Some(journal) = &options.journal {
            healers.iter_mut().try_for_each(|healer| healer.keep_journal(journal))?;
        }
        for (model, recorder) in options.recorders {
            if let Some(healer) = healers.iter_mut().find(|healer| healer.name() == model) {
                healer.keep_record(recorder)?;
            }
        }
        if let Some(folder) = &options.state {
            healers.iter_mut().try_for_each(|healer| healer.keep_state(folder, clock.now()))?;
        }
        let log = EventLog::new(format!("shsa/{name}/events"), options.printer, clock.clone())?;
        let (desk, requests) = Desk::new(inbox);
        let guard = Guard::new(Tokens { view: options.view_token, order: options.token }, desk.clone());
        let tally = bus::serve(&name, bridge.as_mut(), desk.clone(), guard.clone())?;
        let stop: Arc<AtomicBool> = Arc::default();
        let handle = Handle { desk, stop: stop.clone(), listeners: log.listeners() };
        let federation = if options.join { Federation::new(&name, &healers, bridge.as_mut())? } else { None };
        let neighbours = Neighbours::new(&name, bridge.as_ref())?;
        let discovery = options.home_assistant.as_deref();
        let discovery = discovery.map(|prefix| Discovery::new(prefix, &name, bridge.as_mut())).transpose();
        let discovery = discovery.context("announcing to Home Assistant")?;
        let session = Session {
            name,
            healers,
            log,
            other_pages: options.other_pages,
            explained: Explained::new(options.explainer, clock.now()),
            figures: Figures::new()?,
            requests: Questions::new(requests),
            stop,
            until: None,
            rests_until: Time::MIN,
            ownership,
            shared_verdicts,
            strangers: Strangers::default(),
            federation,
            neighbours,
            discovery,
            connection: Connection::default(),
            reported: Reported::new(),
            tally,
            guard,
            bridge,
        };
        Ok(Runtime { session, handle, duration: options.duration })
    }

    /// The handle that stops the run, asks for its state, gives orders and subscribes to decisions, from other threads.
    #[must_use]
    pub fn handle(&self) -> Handle {
        self.handle.clone()
    }

    /// Serves state, decisions, figures and orders over HTTP until the process ends; returns the address that it listens on.
    /// Other instances on the bus are told the address. Orders need the token of the options. A request must name the host by an address, as `localhost`, or by one of `hosts`.
    ///
    /// # Errors
    /// When it cannot listen on the address, or the bus refuses to tell others.
    pub fn serve_http(&self, address: SocketAddr, hosts: &[String]) -> Result<SocketAddr, RuntimeError> {
        let Handle { desk, listeners, .. } = self.handle();
        let address = http::serve(address, hosts, desk, self.session.guard.clone(), listeners)?;
        if let Some(neighbours) = &self.session.neighbours {
            neighbours.announce(address, hosts, self.session.bridge.as_ref())?;
        }
        Ok(address)
    }

    /// Runs until it is stopped, or its duration has passed.
    ///
    /// # Errors
    /// When the bus refuses a model that has just taken over.
    pub fn run(mut self) -> Result<Ending, RuntimeError> {
        let now = self.session.bridge.inbox().clock().now();
        self.session.until = self.duration.map(|duration| now + duration);
        SharedSession::run(self.session)
    }
}
