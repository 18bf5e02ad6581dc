//! The live page over HTTP, and the stream behind it: all rows first, then those that have changed.
//!
//! The next part of a stream is made only when its reader has taken the one before. A slow reader gets fewer parts with the
//! latest rows in each, and an idle reader costs nothing. All pages share one [`Board`], and looks at the run are no more
//! frequent than for one page.

mod board;
mod known;
mod outlook;
mod structure;
mod what_if;

use super::http::{Shared, ask, problem};
use super::{Reply, Request};
use crate::bands::{BandsOf, LastSent};
use axum::Json;
use axum::extract::{Query, State};
use axum::http::{HeaderMap, StatusCode, Uri, header};
use axum::response::sse::{Event, KeepAlive, Sse};
use axum::response::{IntoResponse, Response};
use board::Board;
use known::Known;
use serde::Deserialize;
use std::convert::Infallible;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::Mutex;
use tokio::task::spawn_blocking;
use tokio::time::{Instant, sleep};
use tokio_stream::StreamExt;

/// The shortest time between two updates of a page.
const PACE: Duration = Duration::from_millis(100);
/// All pages together take at most one part in this many of the serving thread's time.
const SHARE: u32 = 10;

/// The state that all pages share.
#[derive(Clone, Default)]
pub(super) struct Pages {
    board: Arc<Mutex<Board>>,
    known: Known,
    /// Held while a thread computes which losses the needs survive.
    turn: Arc<Mutex<()>>,
}

/// A file of the page; a browser with the same version gets an empty answer.
pub(super) async fn file(uri: Uri, headers: HeaderMap) -> Response {
    let Some(file) = shsa_web::file(uri.path()) else {
        return problem(StatusCode::NOT_FOUND, "there is no such page");
    };
    let tag = file.tag();
    let is_known = headers.get(header::IF_NONE_MATCH).is_some_and(|known| known.as_bytes() == tag.as_bytes());
    let about = [
        (header::ETAG, tag),
        // The next version of the program has other files under the same names.
        (header::CACHE_CONTROL, "no-cache".to_owned()),
        (header::CONTENT_SECURITY_POLICY, shsa_web::POLICY.to_owned()),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff".to_owned()),
        (header::REFERRER_POLICY, "no-referrer".to_owned()),
    ];
    match is_known {
        true => (StatusCode::NOT_MODIFIED, about).into_response(),
        false => (about, [(header::CONTENT_TYPE, file.kind)], file.bytes).into_response(),
    }
}

/// All rows, then those that have changed, as server-sent events.
pub(super) async fn changes(State(shared): State<Shared>) -> Response {
    stream(shared, |shared| Reader { shared, seen: None, rest: Duration::ZERO })
}

/// The variable whose bands are requested.
#[derive(Deserialize)]
pub(super) struct OfVariable {
    model: String,
    variable: String,
}

/// The values of all ways of knowing a variable from now on, as server-sent events.
pub(super) async fn bands(State(shared): State<Shared>, Query(asked): Query<OfVariable>) -> Response {
    let OfVariable { model, variable } = asked;
    let wanted = BandsOf { model, variable, last_sent: LastSent::default() };
    // Checks that the variable exists.
    match ask(&shared, Request::Bands(wanted.clone())).await {
        Ok(Reply::Refused(why)) => problem(StatusCode::NOT_FOUND, &why),
        Err(response) => response,
        Ok(_) => stream(shared, |shared| Listener { shared, wanted, is_first: true }),
    }
}

/// A stream of server-sent events, made part by part until the run ends.
fn stream<T: Parts>(shared: Shared, rendered: impl FnOnce(Shared) -> T) -> Response {
    let Ok(place) = shared.streams.clone().try_acquire_owned() else {
        return problem(StatusCode::SERVICE_UNAVAILABLE, "as many streams as may be are open already");
    };
    let rendered = Arc::new(Mutex::new(rendered(shared)));
    let parts = tokio_stream::iter(std::iter::repeat(rendered));
    let parts = parts.then(|rendered| async move { rendered.lock().await.next().await });
    let parts = parts.map_while(move |part| {
        // Holds the place for as long as the stream exists.
        let _held = &place;
        part.map(Ok::<_, Infallible>)
    });
    Sse::new(parts).keep_alive(KeepAlive::default()).into_response()
}

/// A source of the parts of a stream.
trait Parts: Send + 'static {
    /// The next part; `None` when the run is ending.
    fn next(&mut self) -> impl Future<Output = Option<Event>> + Send;
}

/// The stream of a page.
struct Reader {
    shared: Shared,
    /// The number of the last sent look; `None` before the first.
    seen: Option<u64>,
    /// The pause before the next part.
    rest: Duration,
}

impl Parts for Reader {
    async fn next(&mut self) -> Option<Event> {
        sleep(self.rest).await;
        let pages = self.shared.pages.clone();
        let mut board = pages.board.lock().await;
        refresh(&self.shared, &mut board).await?;
        let began = Instant::now();
        let part = board.part(self.seen);
        let kind = if self.seen.is_none() { "state" } else { "change" };
        let event = Event::default().event(kind).data(part.to_string());
        self.seen = Some(board.number());
        self.rest = PACE.max(began.elapsed() * SHARE);
        Some(event)
    }
}

/// Looks at the run, unless that was done just now; `None` when the run is ending.
async fn refresh(shared: &Shared, board: &mut Board) -> Option<()> {
    if board.is_older_than(PACE / 2) {
        let Ok(Reply::Json(seen)) = ask(shared, Request::Look(board.look())).await else { return None };
        if board.take(seen) {
            outlook::look_ahead(shared, board);
        }
    }
    Some(())
}

/// The stream of a variable's bands.
struct Listener {
    shared: Shared,
    wanted: BandsOf,
    is_first: bool,
}

impl Parts for Listener {
    async fn next(&mut self) -> Option<Event> {
        if !std::mem::take(&mut self.is_first) {
            sleep(PACE).await;
        }
        let reply = ask(&self.shared, Request::Bands(self.wanted.clone())).await;
        let Ok(Reply::Json(mut rendered)) = reply else { return None };
        self.wanted.last_sent.follow(&mut rendered);
        Some(Event::default().event("bands").data(rendered.to_string()))
    }
}

/// The requested model.
#[derive(Deserialize)]
pub(super) struct OfModel {
    model: String,
}

/// The last minutes of the needs of a model.
pub(super) async fn past(State(shared): State<Shared>, Query(OfModel { model }): Query<OfModel>) -> Response {
    match ask(&shared, Request::Past(model)).await {
        Ok(Reply::Refused(why)) => problem(StatusCode::NOT_FOUND, &why),
        Ok(Reply::Json(past)) => Json(past).into_response(),
        Ok(_) => problem(StatusCode::INTERNAL_SERVER_ERROR, "no past"),
        Err(response) => response,
    }
}

/// The content of a model.
pub(super) async fn model(
    State(shared): State<Shared>,
    Query(OfModel { model }): Query<OfModel>,
) -> Response {
    match shared.pages.known.model(&shared, &model).await {
        Some(model) => Json(structure::json(model.knowledge())).into_response(),
        None => problem(StatusCode::NOT_FOUND, "there is no such model"),
    }
}

/// A question about losses.
#[derive(Deserialize)]
pub(super) struct Losses {
    model: String,
    /// The lost signals, as a JSON array of names.
    #[serde(default)]
    lost: String,
}

/// What would serve each need of a model without some signals.
pub(super) async fn what_if(
    State(shared): State<Shared>,
    Query(Losses { model, lost }): Query<Losses>,
) -> Response {
    let lost: Vec<String> = match serde_json::from_str(if lost.is_empty() { "[]" } else { &lost }) {
        Ok(lost) => lost,
        Err(error) => {
            return problem(StatusCode::BAD_REQUEST, &format!("`lost` is a JSON array of names: {error}"));
        }
    };
    let Some(model) = shared.pages.known.model(&shared, &model).await else {
        return problem(StatusCode::NOT_FOUND, "there is no such model");
    };
    match spawn_blocking(move || model.answer(&lost)).await {
        Ok(Ok(needs)) => Json(needs).into_response(),
        Ok(Err(why)) => problem(StatusCode::UNPROCESSABLE_ENTITY, &why),
        Err(_) => problem(StatusCode::SERVICE_UNAVAILABLE, "the run is ending"),
    }
}

/// The number of a decision.
#[derive(Deserialize)]
pub(super) struct OfDecision {
    number: u64,
}

/// The evidence for a decision that accuses a signal; `null` where none is kept.
pub(super) async fn evidence(
    State(shared): State<Shared>,
    Query(OfDecision { number }): Query<OfDecision>,
) -> Response {
    match ask(&shared, Request::Evidence(number)).await {
        Ok(Reply::Json(evidence)) => Json(evidence).into_response(),
        Ok(_) => problem(StatusCode::SERVICE_UNAVAILABLE, "the run is ending"),
        Err(response) => response,
    }
}
