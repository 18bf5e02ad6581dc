//! The control interface over HTTP. Anybody may ask for the health. State, events and metrics are open, too, unless the options
//! demand a token for them. Orders always need the token.
//!
//! | request | gives |
//! |---|---|
//! | `GET /` | the live page; its files are below `/web/` |
//! | `GET /changes` | what the page draws: all rows, then those that change, as server-sent events |
//! | `GET /bands?model=NAME&variable=NAME` | the values of all ways of knowing a variable, as server-sent events |
//! | `GET /past?model=NAME` | the last three minutes of each need |
//! | `GET /model?model=NAME` | the content of a model |
//! | `GET /what-if?model=NAME&lost=["a"]` | what would serve its needs without some signals |
//! | `GET /evidence?number=N` | the evidence for a decision that accuses a signal |
//! | `GET /health` | 200 while every need is served, else 503; the needs with their quality |
//! | `GET /state` | the whole state: needs, signals with verdicts and counts, figures |
//! | `GET /events?since=N` | the last decisions from number N on |
//! | `GET /events/stream` | every decision from now on, as server-sent events |
//! | `GET /metrics` | figures for Prometheus |
//! | `POST /orders` | an order as JSON, with `Authorization: Bearer TOKEN` |

use super::connections::{self, Caller};
use super::token::{Answer, Asker, Role};
use super::web::{self, Pages};
use super::{Desk, Guard, Reply, Request};
use crate::error::{Context, RuntimeError};
use crate::metrics::text_format;
use axum::body::{Body, to_bytes};
use axum::extract::{Query, Request as HttpRequest, State};
use axum::http::{HeaderMap, StatusCode, header};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::sse::{Event, KeepAlive, Sse};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use axum::{Extension, Json, Router};
use serde::Deserialize;
use serde_json::json;
use std::convert::Infallible;
use std::net::{IpAddr, SocketAddr, TcpListener};
use std::sync::Arc;
use std::thread;
use tokio::sync::{Semaphore, broadcast, oneshot};
use tokio_stream::StreamExt;
use tokio_stream::wrappers::BroadcastStream;

/// The largest order, bytes.
const LARGEST: usize = 4 * 1024 * 1024;

/// Event streams at a time: each holds a connection for as long as its client wishes.
const STREAMS: usize = 16;

/// The content type of the OpenMetrics form.
const OPEN_METRICS: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";
const TEXT_FORMAT: &str = "text/plain; version=0.0.4; charset=utf-8";

/// The data that all requests share.
#[derive(Clone)]
pub(super) struct Shared {
    desk: Desk,
    guard: Guard,
    listeners: broadcast::WeakSender<String>,
    pub(super) streams: Arc<Semaphore>,
    pub(super) pages: Pages,
    /// Names of this host besides its addresses and `localhost`.
    hosts: Arc<[String]>,
}

/// Serves requests from a thread of its own until the process ends; returns the address on which it listens.
///
/// # Errors
/// When the address cannot be bound.
pub(in super::super) fn serve(
    address: SocketAddr,
    hosts: &[String],
    desk: Desk,
    guard: Guard,
    listeners: broadcast::WeakSender<String>,
) -> Result<SocketAddr, RuntimeError> {
    let listener = TcpListener::bind(address).with_context(|| format!("listening on {address}"))?;
    listener.set_nonblocking(true)?;
    let address = listener.local_addr()?;
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    let streams = Arc::new(Semaphore::new(STREAMS));
    let routes =
        routes(Shared { desk, guard, listeners, streams, pages: Pages::default(), hosts: hosts.into() });
    thread::Builder::new().name("http".into()).spawn(move || {
        runtime.block_on(async move {
            let listener = tokio::net::TcpListener::from_std(listener)?;
            connections::serve(listener, routes).await;
            Ok::<(), std::io::Error>(())
        })
    })?;
    Ok(address)
}

fn routes(shared: Shared) -> Router {
    let looks = Router::new()
        .route("/state", get(state))
        .route("/events", get(events))
        .route("/events/stream", get(stream))
        .route("/changes", get(web::changes))
        .route("/bands", get(web::bands))
        .route("/past", get(web::past))
        .route("/model", get(web::model))
        .route("/what-if", get(web::what_if))
        .route("/evidence", get(web::evidence))
        .route("/metrics", get(metrics))
        .layer(from_fn_with_state(shared.clone(), admit));
    looks
        .route("/", get(web::file))
        .route("/web/{file}", get(web::file))
        .route("/health", get(health))
        .route("/orders", post(order))
        .layer(from_fn_with_state(shared.clone(), refuse_foreign_names))
        .with_state(shared)
}

/// Rejects requests under a foreign host name: a page of another site may have made its name point here (DNS rebinding).
async fn refuse_foreign_names(State(shared): State<Shared>, request: HttpRequest, next: Next) -> Response {
    let host = request.headers().get(header::HOST).and_then(|host| host.to_str().ok()).unwrap_or_default();
    if is_ours(host, &shared.hosts) {
        return next.run(request).await;
    }
    problem(StatusCode::FORBIDDEN, "ask by address, as localhost, or by a name that --http-host allows")
}

/// Whether a `Host`, with or without a port, is an address, `localhost` or one of some names.
fn is_ours(host: &str, names: &[String]) -> bool {
    let name = host.rsplit_once(':').filter(|(_, port)| port.bytes().all(|byte| byte.is_ascii_digit()));
    let name = name.map_or(host, |(name, _)| name).trim_end_matches('.');
    let is_address = name.trim_start_matches('[').trim_end_matches(']').parse::<IpAddr>().is_ok();
    is_address || name == "localhost" || names.iter().any(|ours| ours.eq_ignore_ascii_case(name))
}

/// Admits requests that may look; everybody may ask for the health.
async fn admit(
    State(shared): State<Shared>,
    Extension(Caller(caller)): Extension<Caller>,
    request: HttpRequest,
    next: Next,
) -> Response {
    let seen = shared.guard.look(Role::View, token(request.headers()), Asker::Known(&caller.to_string()));
    match seen.refusal("`Authorization: Bearer TOKEN`") {
        None => next.run(request).await,
        Some(why) => problem(status_of(seen), &why),
    }
}

pub(super) fn problem(status: StatusCode, why: &str) -> Response {
    (status, Json(json!({ "error": why }))).into_response()
}

pub(super) async fn ask(shared: &Shared, request: Request) -> Result<Reply, Response> {
    let (sender, receiver) = oneshot::channel();
    let handed = shared.desk.call(request, move |reply| {
        // The client may have gone.
        let _ = sender.send(reply);
    });
    if !handed {
        return Err(problem(StatusCode::SERVICE_UNAVAILABLE, "too many requests wait"));
    }
    receiver.await.map_err(|_| problem(StatusCode::SERVICE_UNAVAILABLE, "the run is ending"))
}

fn answer(reply: Result<Reply, Response>) -> Response {
    match reply {
        Ok(Reply::Json(value)) => Json(value).into_response(),
        Ok(Reply::Text(text)) => text.into_response(),
        Ok(Reply::Refused(why)) => problem(StatusCode::UNPROCESSABLE_ENTITY, &why),
        Err(response) => response,
    }
}

async fn state(State(shared): State<Shared>) -> Response {
    answer(ask(&shared, Request::State).await)
}

async fn health(State(shared): State<Shared>) -> Response {
    match ask(&shared, Request::Health).await {
        Ok(Reply::Json(health)) if health["ok"] != true => {
            (StatusCode::SERVICE_UNAVAILABLE, Json(health)).into_response()
        }
        reply => answer(reply),
    }
}

/// The metrics in OpenMetrics where the client asks for it, else in the older text format.
async fn metrics(State(shared): State<Shared>, headers: HeaderMap) -> Response {
    let accepted = headers.get_all(header::ACCEPT).iter().filter_map(|value| value.to_str().ok());
    let is_open = accepted.into_iter().any(|value| value.contains("application/openmetrics-text"));
    match ask(&shared, Request::Metrics).await {
        Ok(Reply::Text(text)) if is_open => ([(header::CONTENT_TYPE, OPEN_METRICS)], text).into_response(),
        Ok(Reply::Text(text)) => ([(header::CONTENT_TYPE, TEXT_FORMAT)], text_format(&text)).into_response(),
        reply => answer(reply),
    }
}

#[derive(Deserialize)]
struct Since {
    #[serde(default)]
    since: u64,
}

async fn events(State(shared): State<Shared>, Query(Since { since }): Query<Since>) -> Response {
    answer(ask(&shared, Request::Events(since)).await)
}

async fn stream(State(shared): State<Shared>) -> Response {
    let Some(listeners) = shared.listeners.upgrade() else {
        return problem(StatusCode::SERVICE_UNAVAILABLE, "the run is ending");
    };
    let Ok(place) = shared.streams.try_acquire_owned() else {
        return problem(StatusCode::SERVICE_UNAVAILABLE, &format!("{STREAMS} streams are open already"));
    };
    let events = BroadcastStream::new(listeners.subscribe()).map(move |event| {
        let _held = &place;
        Ok::<_, Infallible>(match event {
            Ok(event) => Event::default().data(event),
            Err(missed) => Event::default().event("missed").data(missed.to_string()),
        })
    });
    Sse::new(events).keep_alive(KeepAlive::default()).into_response()
}

fn status_of(seen: Answer) -> StatusCode {
    match seen {
        Answer::Pass => StatusCode::OK,
        Answer::Wrong => StatusCode::UNAUTHORIZED,
        Answer::Later => StatusCode::TOO_MANY_REQUESTS,
        Answer::Never => StatusCode::FORBIDDEN,
    }
}

/// The token of a request; the scheme of `Authorization` is case-insensitive (RFC 9110, 11.1).
fn token(headers: &HeaderMap) -> Option<&str> {
    let (scheme, token) = headers.get(header::AUTHORIZATION)?.to_str().ok()?.split_once(' ')?;
    scheme.eq_ignore_ascii_case("bearer").then(|| token.trim_start())
}

/// Reads the body only after the token was checked, so that strangers cannot make the process store anything.
async fn order(
    State(shared): State<Shared>,
    Extension(Caller(caller)): Extension<Caller>,
    headers: HeaderMap,
    body: Body,
) -> Response {
    let seen = shared.guard.look(Role::Order, token(&headers), Asker::Known(&caller.to_string()));
    if let Some(why) = seen.refusal("`Authorization: Bearer TOKEN`") {
        return problem(status_of(seen), &why);
    }
    let Ok(body) = to_bytes(body, LARGEST).await else {
        return problem(StatusCode::PAYLOAD_TOO_LARGE, &format!("an order has at most {LARGEST} bytes"));
    };
    let fields = serde_json::from_slice(&body).map_err(|error| error.to_string());
    match fields.and_then(|fields| Request::order(fields, &caller.to_string())) {
        Ok(order) => answer(ask(&shared, order).await),
        Err(error) => problem(StatusCode::BAD_REQUEST, &format!("no order: {error}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hosts_are_addresses_localhost_and_allowed_names() {
        let names = ["robot.local".to_owned()];
        for ours in
            ["127.0.0.1", "127.0.0.1:7410", "[::1]:7410", "localhost:80", "Robot.Local:7410", "robot.local."]
        {
            assert!(is_ours(ours, &names), "{ours}");
        }
        for foreign in ["", "evil.example", "evil.example:7410", "localhost.evil", "robot.local.evil"] {
            assert!(!is_ours(foreign, &names), "{foreign}");
        }
    }
}
