//! The connections for HTTP requests: few at a time, and an idle client cannot hold one for long.
//!
//! Every connection costs a file descriptor, and the bus and the disk need descriptors, too. When the limit is reached, the
//! oldest connection without a request under way makes room for a new one: a client that opens thousands of idle connections
//! closes its own.

use axum::Router;
use axum::extract::Request;
use axum::http::{HeaderValue, StatusCode, header};
use axum::middleware::{Next, from_fn};
use axum::response::{IntoResponse, Response};
use axum::{Extension, body::Body};
use http_body_util::BodyExt;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use std::collections::VecDeque;
use std::net::IpAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;
use tokio::net::{TcpListener, TcpStream};
use tokio::task::AbortHandle;
use tokio::time::{sleep, timeout};

/// Connections at a time, where the process may open as many files as usual.
const MOST: usize = 64;
/// The share of the process's file descriptors that connections may take.
const SHARE: u64 = 4;
/// The time for a whole request and its answer; an idle connection is closed after this time.
const PATIENCE: Duration = Duration::from_secs(10);
/// The buffer for a request's line and headers, bytes.
const BUFFER: usize = 16 * 1024;
/// The pause before the next attempt when no connection can be accepted.
const PAUSE: Duration = Duration::from_millis(50);

/// The address of the client.
#[derive(Clone, Copy, Debug)]
pub(super) struct Caller(pub(super) IpAddr);

/// Answers requests until the process ends.
pub(super) async fn serve(listener: TcpListener, routes: Router) {
    let mut open = Open { connections: VecDeque::new(), most: most(descriptors()) };
    loop {
        match listener.accept().await {
            Ok((stream, address)) => open.add(stream, address.ip().to_canonical(), &routes),
            Err(_) => {
                // Most likely no descriptor is left.
                open.make_room();
                sleep(PAUSE).await;
            }
        }
    }
}

/// How many files the process may have open; `None` for any number.
fn descriptors() -> Option<u64> {
    rustix::process::getrlimit(rustix::process::Resource::Nofile).current
}

fn most(descriptors: Option<u64>) -> usize {
    let share = descriptors.map_or(MOST as u64, |number| number / SHARE);
    usize::try_from(share).unwrap_or(MOST).clamp(1, MOST)
}

/// The connections that are open, the oldest first.
struct Open {
    connections: VecDeque<Connection>,
    most: usize,
}

struct Connection {
    task: AbortHandle,
    /// The number of requests under way.
    requests: Arc<AtomicUsize>,
}

/// Counts a request as under way until it is dropped.
struct UnderWay(Arc<AtomicUsize>);

impl UnderWay {
    fn new(requests: Arc<AtomicUsize>) -> UnderWay {
        requests.fetch_add(1, Ordering::Relaxed);
        UnderWay(requests)
    }
}

impl Drop for UnderWay {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

impl Open {
    fn add(&mut self, stream: TcpStream, caller: IpAddr, routes: &Router) {
        self.connections.retain(|it| !it.task.is_finished());
        if self.connections.len() >= self.most && !self.make_room() {
            return;
        }
        // A client that does not read leaves its window shut: without this, what waits for it waits for ever.
        #[cfg(any(target_os = "linux", target_os = "android"))]
        let _ = rustix::net::sockopt::set_tcp_user_timeout(&stream, PATIENCE.as_millis() as u32);
        let requests = Arc::new(AtomicUsize::new(0));
        let task = tokio::spawn(converse(stream, caller, routes.clone(), requests.clone())).abort_handle();
        self.connections.push_back(Connection { task, requests });
    }

    /// Closes the oldest connection without a request under way; `false` where each has one.
    fn make_room(&mut self) -> bool {
        let is_idle = |it: &Connection| it.requests.load(Ordering::Relaxed) == 0;
        let oldest = self.connections.iter().position(is_idle).and_then(|at| self.connections.remove(at));
        oldest.inspect(|it| it.task.abort()).is_some()
    }
}

/// Answers the requests of one connection, one after the other.
async fn converse(stream: TcpStream, caller: IpAddr, routes: Router, requests: Arc<AtomicUsize>) {
    let count = move |request: Request, next: Next| {
        let under_way = UnderWay::new(requests.clone());
        async move { answer(request, next, under_way).await }
    };
    let routes = routes.layer(Extension(Caller(caller))).layer(from_fn(count));
    let mut server = http1::Builder::new();
    server.timer(TokioTimer::new()).header_read_timeout(PATIENCE).max_buf_size(BUFFER);
    // An error of a connection concerns only its client.
    let _ = server.serve_connection(TokioIo::new(stream), TowerToHyperService::new(routes)).await;
}

/// Answers a request. It is under way until its answer is complete; for a stream, until the stream ends.
async fn answer(request: Request, next: Next, under_way: UnderWay) -> Response {
    let Ok(response) = timeout(PATIENCE, next.run(request)).await else {
        return StatusCode::REQUEST_TIMEOUT.into_response();
    };
    let is_stream = |kind: &HeaderValue| kind.as_bytes().starts_with(b"text/event-stream");
    if !response.headers().get(header::CONTENT_TYPE).is_some_and(is_stream) {
        return response;
    }
    response.map(|body| {
        Body::new(body.map_frame(move |frame| {
            let _held = &under_way;
            frame
        }))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::response::sse::{Event, Sse};
    use axum::routing::get;
    use std::convert::Infallible;
    use std::io::Write;
    use tokio_stream::StreamExt;

    #[cfg(target_os = "linux")]
    #[test]
    fn a_client_that_does_not_read_is_dropped() {
        let streams = Arc::new(AtomicUsize::new(0));
        let counted = streams.clone();
        let endless = move || {
            let held = UnderWay::new(counted.clone());
            let events = tokio_stream::iter(std::iter::repeat(()));
            let events = events.map(move |()| {
                let _held = &held;
                Ok::<_, Infallible>(Event::default().data("x".repeat(64 * 1024)))
            });
            async { Sse::new(events) }
        };
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        runtime.block_on(async {
            let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
            let address = listener.local_addr().unwrap();
            tokio::spawn(serve(listener, Router::new().route("/", get(endless))));
            let mut client = std::net::TcpStream::connect(address).unwrap();
            client.write_all(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n").unwrap();
            let until = async |count: usize| {
                while streams.load(Ordering::Relaxed) != count {
                    sleep(Duration::from_millis(20)).await;
                }
            };
            timeout(PATIENCE, until(1)).await.expect("it is served");
            timeout(PATIENCE * 4, until(0)).await.expect("it is dropped");
        });
    }

    #[test]
    fn connections_take_a_share_of_what_may_be_open() {
        assert_eq!([Some(256), Some(100), Some(1), Some(1 << 20), None].map(most), [64, 25, 1, 64, 64]);
    }
}
