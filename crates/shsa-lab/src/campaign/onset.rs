//! Sessions for faults, and the moments at which faults begin.

use shsa_core::knowledge::{Id, SignalId};
use shsa_core::time::{Span, Time};
use shsa_recording::Sample;

/// The beginning of a fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Onset {
    /// The index of the session, from 0.
    pub session: usize,
    /// The time since the first sample of the recording.
    pub at: Span,
}

/// A session for faults; it has at least one sample.
#[derive(Clone, Copy)]
pub struct Recorded<'a> {
    /// The origin of times.
    pub origin: Time,
    /// The samples in the order of reception.
    pub samples: &'a [Sample],
}

impl<'a> Recorded<'a> {
    /// When the first and the last sample were received.
    pub fn span(&self) -> (Time, Time) {
        let received = |sample: Option<&Sample>| sample.map_or(self.origin, |sample| sample.received);
        (received(self.samples.first()), received(self.samples.last()))
    }

    /// The duration.
    pub fn length(&self) -> Span {
        let (first, last) = self.span();
        last - first
    }

    /// The samples of one signal.
    pub fn own(&self, signal: SignalId) -> Vec<&'a Sample> {
        self.samples.iter().filter(|sample| sample.wanted == signal.index()).collect()
    }
}

/// Spreads `count` moments evenly over the times at which a fault can begin and end within one session. If `earliest` is given,
/// no fault begins before its time in each session.
pub(super) fn onsets(
    sessions: &[Recorded<'_>],
    earliest: &[Span],
    duration: Span,
    count: usize,
) -> Vec<Onset> {
    let mut rooms: Vec<(Onset, Span)> = Vec::new();
    for (session, recorded) in sessions.iter().enumerate() {
        let length = recorded.length();
        let early = earliest.get(session).copied().unwrap_or(Span::ZERO).min(length);
        let room = length - early - duration;
        if room > Span::ZERO {
            let at = recorded.span().0 - recorded.origin + early;
            rooms.push((Onset { session, at }, room));
        }
    }
    let all = Span(rooms.iter().map(|(_, room)| room.0).sum());
    let place = |mut onset: Span| {
        rooms.iter().find_map(|&(Onset { session, at }, room)| {
            if onset <= room {
                return Some(Onset { session, at: at + onset });
            }
            onset = onset - room;
            None
        })
    };
    if all <= Span::ZERO {
        Vec::new()
    } else {
        evenly(all, count).filter_map(|onset| place(onset.min(all))).collect()
    }
}

/// Spreads `count` moments evenly over the room; the last one is at its end.
pub(super) fn evenly(room: Span, count: usize) -> impl Iterator<Item = Span> {
    let share = move |number: usize| Span::from_seconds(room.seconds() * number as f64 / count as f64);
    (1..=count).map(share)
}
