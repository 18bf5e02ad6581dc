//! Names that are taken over: what their takeovers have to know, and what comes of them.

use super::Healer;
use crate::wiring::{Note, Situation, Takeover};
use shsa_bridge::{Bridge, Quality};
use shsa_core::diagnosis::Verdict;
use shsa_core::engine::{Order, Subject};
use shsa_core::time::Time;

impl Healer {
    /// Whether messages under this name may be somebody else's substitutes.
    pub(in super::super) fn takes(&self, topic: &str) -> bool {
        self.takeovers.iter().any(|takeover| takeover.topic() == topic)
    }

    /// Goes on with what it takes over: whether that has changed how it stands, and what is to be told.
    pub(in super::super) fn take_over(
        &mut self,
        now: Time,
        is_ours: impl Fn(&str) -> bool,
        bridge: &mut dyn Bridge,
    ) -> (bool, Vec<Note>) {
        let mut takeovers = std::mem::take(&mut self.takeovers);
        let (mut is_news, mut notes) = (false, Vec::new());
        for takeover in &mut takeovers {
            let outlet = &self.outlets[takeover.need()];
            let situation = Situation {
                now,
                is_bad: self.is_bad(takeover),
                is_served: outlet.is_served_without(takeover.signal()),
                is_ours: is_ours(outlet.topic()),
                source: &outlet.provenance().source,
            };
            let is_same = |leaving: &&Takeover| leaving.topic() == takeover.topic();
            if self.leaving.iter().find(is_same).is_some_and(Takeover::is_acting) {
                // One action after the other.
                continue;
            }
            let before = takeover.stage();
            takeover.step(&situation, bridge, self.patterns.as_mut());
            is_news |= takeover.stage() != before;
            if takeover.is_silencing() {
                self.leaving.retain(|leaving| leaving.topic() != takeover.topic());
            }
            notes.extend(std::iter::from_fn(|| takeover.note()));
        }
        self.takeovers = takeovers;
        self.leaving.retain_mut(|takeover| {
            let is_over = takeover.leave(now, bridge);
            notes.extend(std::iter::from_fn(|| takeover.note()));
            !is_over
        });
        (is_news || !notes.is_empty(), notes)
    }

    /// Whether the source of a takeover is not trusted.
    fn is_bad(&self, takeover: &Takeover) -> bool {
        let (engine, signal) = (&self.engine, takeover.signal_id());
        let forbidden = || Order::Forbid(Subject::Signal(takeover.signal().to_owned()));
        engine.verdict(signal) == Verdict::Failed
            || engine.absence(signal).is_some()
            // What serves the need is not forbidden.
            || self.outlets[takeover.need()].is_served_without(takeover.signal())
                && engine.standing_orders().contains(&forbidden())
    }

    pub(super) fn quality_of(&self, takeover: &Takeover, now: Time) -> Quality {
        takeover.quality(self.outlets[takeover.need()].quality(now), self.is_bad(takeover))
    }

    /// The takeovers, each with how far who reads its name can trust that.
    pub(in super::super) fn takeovers(&self, now: Time) -> impl Iterator<Item = (&Takeover, Quality)> {
        self.takeovers.iter().map(move |takeover| (takeover, self.quality_of(takeover, now)))
    }

    /// When it goes on with one of them, unless something happens before.
    pub(in super::super) fn take_over_due(&self, now: Time) -> Option<Time> {
        self.takeovers.iter().chain(&self.leaving).filter_map(|takeover| takeover.due(now)).min()
    }

    /// Whether an operator vouches for a source whose name is taken.
    pub(super) fn order_back(&mut self, order: &Order) -> bool {
        let Order::Clear(Subject::Signal(signal)) = order else { return false };
        let takeover = self.takeovers.iter_mut().find(|takeover| takeover.signal() == signal);
        takeover.is_some_and(Takeover::order_back)
    }
}
