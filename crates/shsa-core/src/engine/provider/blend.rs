//! Blending: after a switch, the output moves from the last published value to the values of the new source without a jump.

use super::Server;
use super::settings::Settings;
use super::turn::Turn;
use crate::alignment::Sample;
use crate::circle;
use crate::interval::Interval;
use crate::time::{Span, Time};

/// The server of the last value, and the rest of the offset from the server before.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Blend {
    server: Option<Server>,
    /// How far the output was from the new server's value when that server took over, and when.
    offset: Option<(f64, Time)>,
}

impl Blend {
    /// The server of the last value.
    pub(super) fn server(&self) -> Option<Server> {
        self.server
    }

    /// Renames the server; where `rename` gives `None`, the next value counts as that of another server.
    pub(super) fn renamed(self, rename: impl FnOnce(Server) -> Option<Server>) -> Blend {
        Blend { server: self.server.and_then(rename), ..self }
    }

    /// The next value counts as that of another server.
    pub(super) fn leave(&mut self) {
        self.server = None;
    }

    /// The next value of this server is not a switch.
    pub(super) fn pass_to(&mut self, server: Server) {
        self.server = Some(server);
    }

    /// Ends blending: uncertain values are not blended.
    pub(super) fn stop(&mut self) {
        *self = Blend { server: Some(Server::Unsure), offset: None };
    }

    /// The value to publish: while a blend lasts, moved towards the last value and grown so that it still holds
    /// the new one, unless it were too wide then.
    pub(super) fn apply(
        &mut self,
        sample: Sample,
        turn: Turn,
        last: Option<Sample>,
        settings: &Settings,
        now: Time,
    ) -> Sample {
        let span = settings.switching.blend;
        if self.server.replace(turn.server) != Some(turn.server) {
            let beside = |value: Interval| {
                settings.wraps.map_or(value, |turn| circle::nearest(value, sample.value, turn))
            };
            let from = last.map(|last| beside(last.value).midpoint() - sample.value.midpoint());
            self.offset = from.filter(|_| span > Span::ZERO).map(|amount| (amount, now));
        }
        let Some((amount, began)) = self.offset else { return sample };
        let left = 1.0 - (now - began).seconds() / span.seconds();
        if left <= 0.0 {
            self.offset = None;
            return sample;
        }
        let shift = amount * left;
        let moved = Interval::new(sample.value.lo() + shift, sample.value.hi() + shift);
        let value = moved.widened(shift.abs());
        let blended = Sample { value, ..sample };
        let is_fit =
            value.is_bounded() && settings.stated(blended, turn.timing).value.width() <= settings.max_width;
        if is_fit { blended } else { sample }
    }
}
