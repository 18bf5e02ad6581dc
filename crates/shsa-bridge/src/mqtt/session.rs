//! The connection: connects, subscribes, sends waiting messages, and starts again when it breaks.

use super::claims::RENEWED;
use super::client::{self, Client, Failure, Happening, Sender};
use super::options::Options;
use super::shared::Shared;
use super::turns::Turns;
use crate::clock::Uptime;
use std::future::{pending, poll_fn};
use std::hash::{BuildHasher, RandomState};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::pin::{Pin, pin};
use std::sync::Arc;
use std::task::Poll;
use std::time::Duration;
use tokio::task::yield_now;
use tokio::time::{Sleep, sleep, timeout};

/// The shortest pause between attempts to connect; the first retry has none. The pause doubles up to [`Options::retry`], and
/// takes this length after a refusal.
const PAUSE_MIN: Duration = Duration::from_millis(100);
/// After a connection of this length, the first retry has no pause.
const STABLE: Duration = Duration::from_secs(5);
/// This many short connections in a row suggest that two clients use the same name.
const FIGHT: u32 = 3;
/// The time limit of the goodbye.
const GOODBYE: Duration = Duration::from_secs(1);
/// After this many messages in a row, the driving thread handles what they have brought.
const AT_ONE_GO: u32 = 16;

/// The reason when this client itself ends a working connection.
const OVERTAKEN: &str = "nobody was here for a while, and what waited to be written is too old";

/// Connects and serves until it is stopped.
pub(super) async fn run(shared: Arc<Shared>, options: Options, turns: Arc<Turns>) {
    let mut pause = Duration::ZERO;
    let mut short_lived = 0;
    while !shared.is_stopping() {
        let Some(end) = connection(&shared, &options, &turns, short_lived).await else { break };
        if end.lasted >= STABLE {
            pause = Duration::ZERO;
            short_lived = 0;
            shared.lasted();
        }
        short_lived += u32::from(!end.lasted.is_zero());
        let longest = options.retry.max(PAUSE_MIN);
        let this_pause = with_jitter(if end.is_refusal { longest } else { pause });
        pause = (pause * 2).clamp(PAUSE_MIN, longest);
        if timeout(this_pause, shared.stop.notified()).await.is_ok() {
            break;
        }
    }
}

/// How a connection ended.
struct End {
    is_refusal: bool,
    /// Zero: there was no connection.
    lasted: Duration,
}

/// One connection from its beginning to its end. `None`: the bridge was stopped.
async fn connection(shared: &Shared, options: &Options, turns: &Turns, short_lived: u32) -> Option<End> {
    let (sender, mut client) = match client::new(options, shared.publisher, shared.will()) {
        Ok(both) => both,
        Err(_) => return Some(End { is_refusal: true, lasted: Duration::ZERO }),
    };
    let mut since = None;
    // The library can panic; this costs the connection, not the bridge.
    let mut failure = match without_panic(serve(shared, turns, &sender, &mut client, &mut since)).await {
        Some(Some(failure)) => failure,
        Some(None) => return None,
        None => Failure { is_refusal: false, reason: "the client library has failed".to_owned() },
    };
    let lasted = since.map_or(Duration::ZERO, |since: Uptime| since.elapsed());
    // Not every broker gives the reason.
    if short_lived >= FIGHT && !failure.is_refusal && (1..STABLE.as_nanos()).contains(&lasted.as_nanos()) {
        let name = &options.name;
        failure.reason +=
            &format!(" again and again: perhaps another client has the same identifier `{name}`");
    }
    shared.disconnected(&failure, &mut client);
    Some(End { is_refusal: failure.is_refusal, lasted })
}

/// `None`: the bridge was stopped.
async fn serve(
    shared: &Shared,
    turns: &Turns,
    sender: &Sender,
    client: &mut Client,
    since: &mut Option<Uptime>,
) -> Option<Failure> {
    // The number of messages before the driving thread handles them.
    let mut left = 0;
    let mut renewal = pin!(sleep(RENEWED));
    loop {
        let is_connected = since.is_some();
        let coming = next(shared, client, turns, &mut left);
        let Some(polled) = or_stop(shared, coming, is_connected.then_some(renewal.as_mut())).await else {
            if is_connected {
                say_goodbye(shared, sender, client).await;
            }
            return None;
        };
        match polled {
            Err(failure) => {
                client.left_over().into_iter().for_each(|happening| shared.happened(happening));
                return Some(failure);
            }
            Ok(Happening::Connected { has_kept }) => {
                *since = Some(Uptime::now());
                shared.connected(sender, has_kept);
            }
            Ok(happening) => {
                let is_message = matches!(happening, Happening::Arrived(_));
                shared.happened(happening);
                if is_message && left == 0 {
                    left = AT_ONE_GO;
                    yield_now().await;
                }
                left = left.saturating_sub(u32::from(is_message));
                shared.pump();
            }
        }
    }
}

/// Waits for `coming`. Meanwhile publishes the claims when they have changed or a renewal is due. `None`: the bridge is stopped.
async fn or_stop<T>(
    shared: &Shared,
    coming: impl Future<Output = T>,
    mut renewal: Option<Pin<&mut Sleep>>,
) -> Option<T> {
    let mut coming = pin!(coming);
    loop {
        let is_connected = renewal.is_some();
        let due = async {
            match &mut renewal {
                Some(renewal) => renewal.as_mut().await,
                None => pending().await,
            }
        };
        tokio::select! {
            come = &mut coming => return Some(come),
            () = shared.stop.notified() => return None,
            () = shared.claims.changed(), if is_connected => shared.claim(),
            () = due => shared.renew_claims(),
        }
        if let Some(renewal) = renewal.as_mut().filter(|renewal| renewal.is_elapsed()) {
            renewal.as_mut().reset(tokio::time::Instant::now() + RENEWED);
        }
    }
}

/// The next event. After a silence, a message is handled at once.
async fn next(
    shared: &Shared,
    client: &mut Client,
    turns: &Turns,
    left: &mut u32,
) -> Result<Happening, Failure> {
    let mut polled = pin!(client.poll());
    poll_fn(|context| {
        // This check is as close to the write as possible: a process may be suspended anywhere.
        if shared.is_overtaken() {
            return Poll::Ready(Err(Failure { is_refusal: false, reason: OVERTAKEN.to_owned() }));
        }
        let now = polled.as_mut().poll(context);
        if now.is_pending() {
            *left = 0;
            turns.nothing_waits();
        }
        now
    })
    .await
}

/// The result of a future; `None`: it panicked.
async fn without_panic<T>(future: impl Future<Output = T>) -> Option<T> {
    let mut future = pin!(future);
    poll_fn(|context| match catch_unwind(AssertUnwindSafe(|| future.as_mut().poll(context))) {
        Ok(polled) => polled.map(Some),
        Err(_) => Poll::Ready(None),
    })
    .await
}

/// Sends waiting messages, disconnects, and reads on until the broker has closed: then it has received everything.
async fn say_goodbye(shared: &Shared, sender: &Sender, client: &mut Client) {
    let goodbye = async {
        let mut has_left = false;
        loop {
            shared.pump();
            if !has_left && shared.has_sent_all() {
                sender.leave();
                has_left = true;
            }
            if client.poll().await.is_err() {
                return;
            }
        }
    };
    let _or_the_time_is_over = timeout(GOODBYE, goodbye).await;
}

/// A pause, changed by up to a quarter, so that many clients do not reconnect at the same moment.
fn with_jitter(pause: Duration) -> Duration {
    let random = RandomState::new().hash_one(0_u8) as f64 / u64::MAX as f64;
    pause.mul_f64(0.75 + random / 2.0)
}
