//! Blending: after a switch, the output moves from the last published value to the values of the new source without a jump.

use super::Server;
use super::settings::Settings;
use crate::alignment::Sample;
use crate::circle;
use crate::interval::Interval;
use crate::time::{Span, Time};

/// Who gave the last value, and what is left of the way from the one before.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Blend {
    server: Option<Server>,
    /// How far the output was from its new server when that took over, and when.
    offset: Option<(f64, Time)>,
}

impl Blend {
    /// Who gave the last value.
    pub(super) fn server(&self) -> Option<Server> {
        self.server
    }

    /// The server is the same only where this says so; else the next value is that of another one.
    pub(super) fn renamed(self, rename: impl FnOnce(Server) -> Option<Server>) -> Blend {
        Blend { server: self.server.and_then(rename), ..self }
    }

    /// The next value is that of another server, whoever gives it.
    pub(super) fn leave(&mut self) {
        self.server = None;
    }

    /// The next value of this server goes on from the last one.
    pub(super) fn pass_to(&mut self, server: Server) {
        self.server = Some(server);
    }

    /// What goes out uncertain is not blended.
    pub(super) fn stop(&mut self) {
        *self = Blend { server: Some(Server::Unsure), offset: None };
    }

    /// The value to publish: while a blend lasts, moved towards the last value and grown so that it still holds
    /// the new one, unless it were too wide then.
    pub(super) fn apply(
        &mut self,
        sample: Sample,
        server: Server,
        last: Option<Sample>,
        settings: &Settings,
        now: Time,
    ) -> Sample {
        let span = settings.switching.blend;
        if self.server.replace(server) != Some(server) {
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
        let is_fit = value.is_bounded() && value.width() <= settings.max_width;
        if is_fit { Sample { value, ..sample } } else { sample }
    }
}
