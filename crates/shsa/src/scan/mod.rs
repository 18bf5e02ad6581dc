//! `shsa scan`: the topics on a bus with their rates, the signals that they carry, and the missing signals.
//!
//! `bus -> inbox -> Heard, topic by topic -> text, JSON, or the draft of a model`

mod topic_record;
mod matched;
pub(crate) mod draft;
mod json;
pub(crate) mod text;

use crate::bus::BusArguments;
use crate::outcome::Outcome;
use crate::{old, show};
use matched::Matched;
use shsa_bridge::Address;
use shsa_bridge::memory::MemoryBus;
use shsa_bridge::{Bridge, Clock, Inbox, Link};
use shsa_core::time::Span;
use shsa_message::span::parse_span;
use std::collections::BTreeMap;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use topic_record::TopicRecord;

/// Arguments of `shsa scan`.
#[derive(clap::Args)]
#[command(after_help = "Example: shsa scan models/rover.yaml --bus mqtt://localhost --for 10s

`shsa draft --bus BUS` writes a model of what is received.

Exit status: 1 when no message is received, or a signal of the model is missing; 4 when the bus cannot be reached.")]
pub(crate) struct Arguments {
    /// A knowledge base: the scan shows which signal each field carries, and which signals are missing.
    model: Option<PathBuf>,
    /// How long to listen, as `10 s`.
    #[arg(long = "for", value_name = "TIME", default_value = "5s", value_parser = parse_span)]
    duration: Span,
    /// Write a model with the received signals that MODEL does not have.
    #[arg(long, hide = true, conflicts_with = "json")]
    draft: bool,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    bus: BusArguments,
}

/// The received messages, and the duration of the scan.
pub(crate) struct Scan {
    bus: String,
    seconds: f64,
    topics: BTreeMap<Arc<str>, TopicRecord>,
    matched: Option<Matched>,
    /// How many more values are kept for a draft.
    room: usize,
}

/// The most values that are kept for a draft: 16 bytes each.
const VALUES_MAX: usize = 4_000_000;

/// What to listen to, and how long.
pub(crate) struct Listening<'a> {
    /// Signals that are known.
    pub(crate) model: Option<&'a Path>,
    pub(crate) bus: &'a BusArguments,
    pub(crate) duration: Span,
    /// Whether values are kept for a draft.
    pub(crate) is_draft: bool,
}

/// Receives messages for a while, and reports the results.
///
/// # Errors
/// When the model is invalid, or the bus cannot be used.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let Arguments { model, bus, duration, draft: is_draft, json } = arguments;
    if *is_draft {
        old::note("shsa scan", "--draft", "draft --bus BUS");
    }
    let listening = Listening { model: model.as_deref(), bus, duration: *duration, is_draft: *is_draft };
    let scan = match listened(&listening)? {
        Ok(scan) => scan,
        Err(outcome) => return Ok(outcome),
    };
    let output = match (json, is_draft) {
        (true, _) => json::shown(&scan),
        (_, true) => draft::drafted(&scan)?,
        _ => text::shown(&scan),
    };
    writeln!(std::io::stdout().lock(), "{}", output.trim_end())?;
    let is_missing =
        scan.matched.as_ref().is_some_and(|matched| matched.missing(&scan.topics).next().is_some());
    Ok(if scan.is_silent() || is_missing { Outcome::No } else { Outcome::Done })
}

/// What was received; or the outcome, when the bus cannot be reached.
///
/// # Errors
/// When the model is invalid, or the bus cannot be used.
pub(crate) fn listened(listening: &Listening<'_>) -> anyhow::Result<Result<Scan, Outcome>> {
    let knowledge = listening.model.map(show::load_model).transpose()?;
    let matched = knowledge.map(Matched::new).transpose()?;
    let clock = Clock::running();
    let inbox = Inbox::new(listening.bus.queue, clock.clone());
    let memory = MemoryBus::new(clock);
    let address = &listening.bus.bus;
    let mut bridge = listening.bus.options().visit(inbox, &memory)?;
    bridge.subscribe_all()?;
    if let Link::Down(reason) = bridge.link() {
        return Ok(Err(show::unreachable(address, &reason)));
    }
    let stop = Arc::new(AtomicBool::new(false));
    if *address == Address::Memory {
        show::notice("no bus was given: a simulated robot drives about in this process (see --bus)");
        shsa_demo::rover::simulate(&memory, &stop)?;
    }
    let duration = Duration::from_nanos(listening.duration.0.unsigned_abs());
    let mut scan = Scan {
        bus: address.to_string(),
        seconds: duration.as_secs_f64(),
        topics: BTreeMap::new(),
        matched,
        room: if listening.is_draft { VALUES_MAX } else { 0 },
    };
    scan.listen(bridge.as_mut(), duration);
    scan.topics.values_mut().for_each(TopicRecord::finish);
    stop.store(true, Ordering::Release);
    if let (true, Link::Down(reason)) = (scan.is_silent(), bridge.link()) {
        return Ok(Err(show::unreachable(address, &reason)));
    }
    print_losses(bridge.as_mut());
    if listening.is_draft && scan.room == 0 {
        show::warn(format_args!(
            "the draft is of the first {VALUES_MAX} values; listen for less time (--for)"
        ));
    }
    Ok(Ok(scan))
}

impl Scan {
    /// Whether no message was received.
    pub(crate) fn is_silent(&self) -> bool {
        self.topics.is_empty()
    }

    fn listen(&mut self, bridge: &mut dyn Bridge, duration: Duration) {
        let inbox = bridge.inbox().clone();
        let end = Instant::now() + duration;
        while Instant::now() < end {
            inbox.wait(end.saturating_duration_since(Instant::now()).min(Duration::from_millis(100)));
            while let Some(message) = inbox.pop() {
                if let Some(matched) = &mut self.matched {
                    matched.take(&message, inbox.clock());
                }
                self.topics.entry(message.topic.clone()).or_default().take(message, &mut self.room);
                if Instant::now() >= end {
                    return;
                }
            }
        }
    }
}

/// Tells messages that were lost or refused.
fn print_losses(bridge: &mut dyn Bridge) {
    for losses in bridge.inbox().losses() {
        let (topic, dropped) = (losses.topic, losses.dropped);
        show::warn(format_args!(
            "{topic}: {dropped} messages came faster than they could be read; see --queue"
        ));
    }
    bridge.troubles().iter().for_each(show::warn);
}
