//! The loop of a service: messages in, its work, messages out.

use super::timing::{Beat, Figures, Pace};
use super::work::Work;
use crate::outcome::Outcome;
use crate::show;
use shsa_bridge::{Address, Bridge, Clock, Link};
use shsa_core::time::{Span, Time};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// The longest rest: afterwards the link and the end of the run are checked.
const LONGEST_REST: Span = Span::from_millis(100);

/// A running service.
pub(super) struct Session {
    pub(super) bridge: Box<dyn Bridge>,
    pub(super) work: Box<dyn Work>,
    pub(super) pace: Pace,
    pub(super) figures: Figures,
    pub(super) stop: Arc<AtomicBool>,
    /// The time at which the service ends by itself.
    pub(super) until: Option<Time>,
    /// The address of the bus, for messages.
    pub(super) bus: Address,
    /// How long the bus may be unreachable.
    pub(super) patience: Option<Span>,
    /// The period of the figures.
    pub(super) stats: Option<Span>,
    pub(super) watch: Watch,
}

/// What the session remembers between its turns.
#[derive(Debug, Default)]
pub(super) struct Watch {
    /// The newest time of a value.
    at: Option<Time>,
    down_since: Option<Time>,
    reported: Option<Time>,
    is_shedding: bool,
}

impl Session {
    /// Runs until it is stopped, its duration has passed, or the bus was unreachable for too long.
    ///
    /// # Errors
    /// When the bus refuses a publication.
    pub(super) fn run(mut self) -> anyhow::Result<Outcome> {
        let mut beat = match self.pace {
            Pace::Every(period) => Some(Beat::new(period, self.now())),
            Pace::Any | Pace::All => None,
        };
        let outcome = loop {
            self.receive()?;
            if let Some(beat) = &mut beat {
                self.keep_time(beat)?;
            }
            if let Some(unreachable) = self.look_after_the_bus() {
                break unreachable;
            }
            self.print_figures();
            // Messages that arrived before the end are still processed.
            if self.is_over() && (self.bridge.inbox().is_empty() || self.until.is_some()) {
                break self.end();
            }
            self.rest(beat.as_ref().map(Beat::next));
        };
        if self.stats.is_some() {
            self.report_figures();
        }
        Ok(outcome)
    }

    /// The outcome after the duration: if the bus is unreachable then, nothing was delivered.
    fn end(&self) -> Outcome {
        match self.bridge.link() {
            Link::Down(why) if !self.stop.load(Ordering::Acquire) => show::unreachable(&self.bus, &why),
            _ => Outcome::Done,
        }
    }

    fn is_over(&self) -> bool {
        self.stop.load(Ordering::Acquire) || self.until.is_some_and(|until| self.now() >= until)
    }

    fn clock(&self) -> Clock {
        self.bridge.inbox().clock().clone()
    }

    fn now(&self) -> Time {
        self.bridge.inbox().clock().now()
    }

    fn receive(&mut self) -> anyhow::Result<()> {
        let clock = self.clock();
        // Stamps read before a step of the clock is followed would be wrong by the whole step.
        let _step = clock.follow();
        // Only messages that wait now, so that a flood cannot delay the check of the time.
        for _ in 0..self.bridge.inbox().len() {
            let Some(message) = self.bridge.receive() else { break };
            let Some(stamp) = self.work.receive(&message, &clock) else { continue };
            let at = self.watch.at.map_or(stamp, |before| before.max(stamp));
            self.watch.at = Some(at);
            let is_due = !matches!(self.pace, Pace::Every(_)) && self.work.is_due(self.pace);
            if is_due {
                self.compute(at)?;
            }
        }
        Ok(())
    }

    fn keep_time(&mut self, beat: &mut Beat) -> anyhow::Result<()> {
        let now = self.now();
        let Some(missed) = beat.take(now) else { return Ok(()) };
        self.figures.shed += missed;
        if missed > 0 && !self.watch.is_shedding {
            self.watch.is_shedding = true;
            let worst = self.figures.worst().seconds() * 1e3;
            show::warn(format_args!(
                "not every period was kept (worst observed execution time {worst:.3} ms): what is overdue is left out"
            ));
        }
        if self.work.is_due(self.pace) {
            self.compute(now)?;
        }
        Ok(())
    }

    fn compute(&mut self, at: Time) -> anyhow::Result<()> {
        let clock = self.clock();
        let began = Instant::now();
        self.work.compute(at, &clock, self.bridge.as_mut(), &mut self.figures)?;
        self.figures.took(began.elapsed());
        Ok(())
    }

    /// Tells when the bus becomes unreachable and when it is back; returns the outcome when it was unreachable for too long.
    fn look_after_the_bus(&mut self) -> Option<Outcome> {
        let now = self.now();
        let Link::Down(why) = self.bridge.link() else {
            if self.watch.down_since.take().is_some() {
                show::notice(&format!("{} is reached", self.bus));
            }
            return None;
        };
        let is_new = self.watch.down_since.is_none();
        let since = *self.watch.down_since.get_or_insert(now);
        if self.patience.is_some_and(|patience| now - since >= patience) {
            return Some(show::unreachable(&self.bus, &why));
        }
        if is_new {
            show::warn(format_args!("{} cannot be reached and is waited for: {why}", self.bus));
        }
        None
    }

    fn print_figures(&mut self) {
        let now = self.now();
        let Some(every) = self.stats else { return };
        let last = *self.watch.reported.get_or_insert(now);
        if now - last >= every {
            self.watch.reported = Some(now);
            self.report_figures();
        }
    }

    fn report_figures(&mut self) {
        let unreadable = match self.work.unreadable() {
            (count, Some(because)) => format!("; unreadable {count}, the last one: {because}"),
            (_, None) => String::new(),
        };
        let dropped = self.bridge.inbox().dropped();
        let troubles: String = self.bridge.troubles().iter().map(|trouble| format!("; {trouble}")).collect();
        show::notice(&format!("{}; dropped {dropped}{unreadable}{troubles}", self.figures));
    }

    fn rest(&self, next: Option<Time>) {
        let until = next.map_or(LONGEST_REST, |next| (next - self.now()).min(LONGEST_REST));
        self.bridge.inbox().wait(Duration::from_nanos(u64::try_from(until.0).unwrap_or(0)));
    }
}
