//! Values on their way out: under the names of their needs, and under those that are taken over.

use super::Healer;
use crate::outlet::Outlet;
use shsa_bridge::{Bridge, BridgeError, Quality};
use shsa_core::engine::{self, EventKind, Publication};
use shsa_core::time::Time;

/// What has become of a value.
pub(in super::super) struct Served {
    /// Whether the need is served better or worse by it than before.
    pub(in super::super) is_news: bool,
    /// The names under which it was not sent, and why.
    pub(in super::super) failed: Vec<(String, BridgeError)>,
}

impl Healer {
    /// Sends a value of a need, where that is ours to serve.
    pub(in super::super) fn serve(
        &mut self,
        publication: &Publication,
        is_ours: impl Fn(&str) -> bool,
        bridge: &mut dyn Bridge,
    ) -> Served {
        let quality = match publication.quality {
            engine::Quality::Good => Quality::Good,
            engine::Quality::Substitute => Quality::Substitute,
            engine::Quality::Uncertain => Quality::Uncertain,
        };
        let outlet = &mut self.outlets[publication.need];
        if !outlet.has_source() {
            outlet.follow(EventKind::Restored, self.engine.need_status(publication.need).source);
        }
        let is_isolated = self.workers.as_ref().is_some_and(|workers| workers.is_isolated(publication));
        outlet.place(match (publication.delegated, is_isolated) {
            (true, _) => ", in a process of its own",
            (false, true) => ", in the engine for now",
            (false, false) => "",
        });
        let time = publication.time;
        let before = (outlet.quality(time), outlet.is_able(time));
        outlet.note(publication, quality);
        let failed = if is_ours(outlet.topic()) {
            self.send(publication, None, bridge)
        } else {
            outlet.leave();
            Vec::new()
        };
        let outlet = &self.outlets[publication.need];
        Served { is_news: (outlet.quality(time), outlet.is_able(time)) != before, failed }
    }

    /// Sends a value under all names of its need, or only this one; what was not sent.
    fn send(
        &mut self,
        publication: &Publication,
        only: Option<&str>,
        bridge: &mut dyn Bridge,
    ) -> Vec<(String, BridgeError)> {
        let clock = bridge.inbox().clock();
        let (stamp, now) = (Outlet::stamp(publication, clock), clock.now());
        let Healer { outlets, takeovers, backlog, .. } = self;
        let outlet = &mut outlets[publication.need];
        let mut failed = Vec::new();
        let mut follow = |name: &str, sent: Result<(), BridgeError>| {
            backlog.follow(name, publication, sent.as_ref().copied(), now);
            failed.extend(sent.err().map(|error| (name.to_owned(), error)));
        };
        let mut is_gate = true;
        for takeover in takeovers.iter_mut().filter(|takeover| takeover.need() == publication.need) {
            // A need of the name of its own source has no other publisher beside that.
            is_gate &= takeover.topic().trim_matches('/') != outlet.topic().trim_matches('/');
            // Who reads the name of a source reads plain numbers.
            let is_certain = publication.quality != engine::Quality::Uncertain;
            if is_certain && only.is_none_or(|only| only == takeover.topic()) {
                let sent = takeover.send(publication, stamp, outlet.provenance(), bridge);
                follow(takeover.topic(), sent);
            }
        }
        if !is_gate {
            outlet.leave();
        } else if only.is_none_or(|only| only == outlet.topic()) {
            let sent = outlet.send(publication, stamp, bridge);
            follow(outlet.topic(), sent);
        }
        failed
    }

    /// Whether something that was lost on its way is to be sent again now.
    pub(in super::super) fn has_backlog(&self, now: Time) -> bool {
        self.backlog.due().is_some_and(|due| due <= now)
    }

    /// Sends again what was lost on its way, while it is not too old; what was not sent.
    pub(in super::super) fn send_again(
        &mut self,
        now: Time,
        is_ours: impl Fn(&str) -> bool,
        bridge: &mut dyn Bridge,
    ) -> Vec<(String, BridgeError)> {
        let mut failed = Vec::new();
        while let Some((name, publication)) = self.backlog.next(now) {
            let outlet = &self.outlets[publication.need];
            if outlet.is_fresh(publication.time, now) && is_ours(outlet.topic()) {
                failed.extend(self.send(&publication, Some(&name), bridge));
            } else {
                self.backlog.forget(&name);
            }
        }
        failed
    }
}
