//! A bus of two pipes: standard input brings the messages of others, and publications go to standard output, a JSON object a
//! line. It needs no network, for trying a service or when another program carries its messages.
//!
//! `{"topic": "/input1", "payload": 1.5, "stamp_ns": 5}`; the payload is what a message would hold. The stamp may be left away,
//! and so may `quality`, the name of a status code.

use serde::Deserialize;
use serde_json::{Value, json};
use shsa_bridge::payload::plain;
use shsa_bridge::{Bridge, BridgeError, Inbox, Link, Message, Outgoing, Payload, PublisherId, Quality};
use shsa_core::time::Time;
use std::collections::BTreeSet;
use std::io::{self, BufRead, Read, Write};
use std::process;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;

/// The longest line that is read, bytes.
const LONGEST: u64 = 8 << 20;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Line {
    topic: String,
    payload: Value,
    stamp_ns: Option<i64>,
    /// The name of its status code.
    quality: Option<String>,
}

/// Standard input and output as a bus.
pub(super) struct Pipes {
    inbox: Inbox,
    broken: Arc<AtomicU64>,
    reported: u64,
}

impl Pipes {
    /// Reads messages of these topics from now on; the end of the input sets `stop`. The topics are given at once, because
    /// messages before a subscription would be lost.
    ///
    /// # Errors
    /// When no thread can be started.
    pub(super) fn open(inbox: Inbox, stop: Arc<AtomicBool>, topics: BTreeSet<Arc<str>>) -> io::Result<Pipes> {
        let broken = Arc::new(AtomicU64::new(0));
        let pipes = Pipes { inbox: inbox.clone(), broken: broken.clone(), reported: 0 };
        thread::Builder::new().name("stdin".into()).spawn(move || {
            let mut input = io::stdin().lock();
            let mut line = Vec::new();
            while matches!(input.by_ref().take(LONGEST).read_until(b'\n', &mut line), Ok(read) if read > 0) {
                match message(&line, &inbox) {
                    Some(message) if topics.contains(&message.topic) => inbox.push(message),
                    Some(_) => {}
                    None if line.trim_ascii().is_empty() => {}
                    None => _ = broken.fetch_add(1, Ordering::Relaxed),
                }
                line.clear();
            }
            stop.store(true, Ordering::Release);
            inbox.wake();
        })?;
        Ok(pipes)
    }
}

fn message(line: &[u8], inbox: &Inbox) -> Option<Message> {
    let line: Line = serde_json::from_slice(line).ok()?;
    let payload = Payload::Bytes(line.payload.to_string().into_bytes().into());
    let stamp = line.stamp_ns.map(Time);
    let quality = line.quality.as_deref().and_then(Quality::named);
    Some(Message { stamp, quality, ..Message::new(line.topic.into(), inbox.clock().now(), payload) })
}

impl Bridge for Pipes {
    fn publisher(&self) -> PublisherId {
        PublisherId(u128::from(process::id()))
    }

    fn inbox(&self) -> &Inbox {
        &self.inbox
    }

    fn subscribe(&mut self, _: &str, _: Option<&str>) -> Result<(), BridgeError> {
        Ok(())
    }

    fn subscribe_all(&mut self) -> Result<(), BridgeError> {
        Err(BridgeError::Configuration("standard input is read by topic".into()))
    }

    fn publish(&mut self, message: Outgoing<'_>) -> Result<(), BridgeError> {
        let text = match &message.payload {
            Payload::Value(value) => plain(value),
            Payload::Bytes(bytes) => String::from_utf8_lossy(bytes).into_owned(),
        };
        let payload: Value = serde_json::from_str(&text).unwrap_or(Value::String(text));
        let quality = message.provenance.map(|provenance| provenance.quality.name());
        let line = json!({
            "topic": message.topic, "payload": payload, "stamp_ns": message.stamp.0, "quality": quality
        });
        let mut output = io::stdout().lock();
        writeln!(output, "{line}")
            .and_then(|()| output.flush())
            .map_err(|error| BridgeError::Configuration(format!("standard output: {error}")))
    }

    fn link(&self) -> Link {
        Link::Up
    }

    fn troubles(&mut self) -> Vec<BridgeError> {
        let broken = self.broken.load(Ordering::Relaxed);
        let new = broken - std::mem::replace(&mut self.reported, broken);
        let reported =
            || BridgeError::Configuration(format!("{new} lines of standard input are no messages"));
        (new > 0).then(reported).into_iter().collect()
    }
}
