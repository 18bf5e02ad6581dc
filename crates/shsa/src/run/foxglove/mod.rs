//! Viewers that follow a run over WebSocket, as Foxglove does (`shsa run --foxglove`).
//!
//! One thread waits for viewers, and each viewer has a thread of its own: a slow one holds nobody up.

mod hub;
mod protocol;

use anyhow::Context;
use hub::Hub;
use serde_json::Value;
use shsa_report::mcap::{Message, Sink};
use std::io::{self, ErrorKind};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, SystemTime};
use tungstenite::handshake::server::{ErrorResponse, Request, Response};
use tungstenite::http::{HeaderValue, StatusCode, header};
use tungstenite::protocol::WebSocketConfig;
use tungstenite::{Error, WebSocket, accept_hdr_with_config};

/// The most connections at a time.
const MOST_VIEWERS: usize = 16;
/// How long a viewer may take to say what it wants, and to take what it is sent.
const PATIENCE: Duration = Duration::from_secs(5);
/// How long a message waits at most until it is sent.
const PACE: Duration = Duration::from_millis(20);
/// The longest message of a viewer, bytes.
const LONGEST: usize = 1 << 20;

/// The viewers of a run.
pub(super) struct Viewers(Arc<Mutex<Hub>>);

impl Viewers {
    /// Waits for viewers at an address. Returns the address with the port that was chosen.
    ///
    /// # Errors
    /// When the address cannot be used.
    pub(super) fn serve(address: SocketAddr, name: &str) -> anyhow::Result<(Viewers, SocketAddr)> {
        let listener = TcpListener::bind(address).with_context(|| format!("listening on {address}"))?;
        let address = listener.local_addr()?;
        let began = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
        let greeting = protocol::server_info(name, &began.as_nanos().to_string());
        let hub = Arc::new(Mutex::new(Hub::new(greeting)));
        let shared = hub.clone();
        thread::Builder::new().name("foxglove".into()).spawn(move || wait(&listener, &shared))?;
        Ok((Viewers(hub), address))
    }
}

impl Sink for Viewers {
    fn write(&mut self, message: &Message<'_>) -> io::Result<()> {
        locked(&self.0).write(message);
        Ok(())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }

    fn finish(&mut self, _layout: &Value) -> io::Result<()> {
        locked(&self.0).end();
        Ok(())
    }
}

fn locked(hub: &Mutex<Hub>) -> MutexGuard<'_, Hub> {
    hub.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Takes in viewers until the process ends.
fn wait(listener: &TcpListener, hub: &Arc<Mutex<Hub>>) {
    let places = Arc::new(());
    for stream in listener.incoming() {
        let Ok(stream) = stream else {
            // No more files can be opened now.
            thread::sleep(PACE);
            continue;
        };
        if Arc::strong_count(&places) > MOST_VIEWERS {
            continue;
        }
        let (hub, place) = (hub.clone(), places.clone());
        let follow = move || {
            let _held = place;
            // How a viewer goes is its own business.
            let _gone = accept(stream).and_then(|socket| attend(socket, &hub));
        };
        let _no_thread = thread::Builder::new().name("viewer".into()).spawn(follow);
    }
}

fn accept(stream: TcpStream) -> Result<WebSocket<TcpStream>, Error> {
    stream.set_read_timeout(Some(PATIENCE))?;
    stream.set_write_timeout(Some(PATIENCE))?;
    stream.set_nodelay(true)?;
    let config = WebSocketConfig::default().max_message_size(Some(LONGEST)).max_frame_size(Some(LONGEST));
    let socket = accept_hdr_with_config(stream, agreed, Some(config));
    let socket = socket.map_err(|_| Error::ConnectionClosed)?;
    socket.get_ref().set_read_timeout(Some(PACE))?;
    Ok(socket)
}

/// Agrees upon the protocol.
#[expect(clippy::result_large_err, reason = "the type is that of the library's callback")]
fn agreed(request: &Request, mut response: Response) -> Result<Response, ErrorResponse> {
    let text = |name| request.headers().get(name).and_then(|value| value.to_str().ok());
    let refusal = |status, why: &str| {
        let mut refusal = ErrorResponse::new(Some(why.to_owned()));
        *refusal.status_mut() = status;
        refusal
    };
    if !protocol::is_welcome(text(header::ORIGIN)) {
        return Err(refusal(StatusCode::FORBIDDEN, "pages from elsewhere may not follow this run"));
    }
    let offered = request.headers().get_all(header::SEC_WEBSOCKET_PROTOCOL).iter();
    let offered: Vec<&str> =
        offered.filter_map(|value| value.to_str().ok()).flat_map(|it| it.split(',')).map(str::trim).collect();
    let Some(name) = protocol::NAMES.into_iter().find(|name| offered.contains(name)) else {
        let why = format!("this server speaks {}", protocol::NAMES.join(" and "));
        return Err(refusal(StatusCode::BAD_REQUEST, &why));
    };
    response.headers_mut().insert(header::SEC_WEBSOCKET_PROTOCOL, HeaderValue::from_static(name));
    Ok(response)
}

/// Passes on what a viewer asks for, until it goes or the run is over.
fn attend(mut socket: WebSocket<TcpStream>, hub: &Mutex<Hub>) -> Result<(), Error> {
    let viewer = locked(hub).enter();
    let ended = converse(&mut socket, hub, viewer);
    locked(hub).leave(viewer);
    ended
}

fn converse(socket: &mut WebSocket<TcpStream>, hub: &Mutex<Hub>, viewer: u64) -> Result<(), Error> {
    loop {
        let waiting = locked(hub).take(viewer);
        let Some(waiting) = waiting else { return socket.close(None).and_then(|()| socket.flush()) };
        waiting.into_iter().try_for_each(|frame| socket.write(frame))?;
        socket.flush()?;
        match socket.read() {
            Ok(message) if message.is_text() => locked(hub).ask(viewer, message.to_text()?),
            Ok(_) => {}
            Err(Error::Io(error)) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
            Err(error) => return Err(error),
        }
    }
}
