//! A new knowledge base takes over while the engine runs: unchanged parts continue without a gap.
//!
//! The new engine is set up as at the beginning. Every stage then takes over what is the same, matched by names: the ports of
//! signals with the same meaning, the recent comparisons of ways with the same computation, the verdicts that rest on such
//! comparisons, the orders in force, silences and probations, the source of each need, and the plans for its losses. Nothing of
//! the old knowledge base stays, and nothing grows with the number of changes.

use super::message::Output;
use super::provider::Succession;
use super::{Engine, events};
use crate::knowledge::{IdVec, KnowledgeBase, Lineage, NeedId};
use crate::time::{Span, Time};

impl Engine {
    /// Replaces the knowledge base at a moment, after all earlier inputs.
    ///
    /// An [`Output::Reloaded`] stands between the outputs with the ids of the old knowledge base and those with the ids of the
    /// new one. An unchanged signal, relation or need of the same name continues as if nothing had happened. A changed signal is
    /// judged anew, and a verdict is dropped when no comparison of its signal continues. Where the change takes a need's source
    /// away, the next best serves the need at once.
    ///
    /// Complexity: that of [`Engine::new`] without the plans that continue, and O(n log n) in what is taken over.
    pub fn reload(&mut self, knowledge: KnowledgeBase, at: Time) {
        self.advance(at);
        if self.waiting {
            self.settle();
        }
        let now = self.now.unwrap_or(at);
        let lineage = Lineage::new(&self.knowledge, &knowledge);
        let knowledge = knowledge.succeeding(self.knowledge.version());
        let ready_sources = core::mem::take(&mut self.ready_sources);
        let new = Engine::with_standby(knowledge, self.options, |knowledge, graph| {
            ready_sources.carried_over(&self.graph, &lineage, knowledge, graph)
        });
        let old = core::mem::replace(self, new);
        self.inherit(old, &lineage, now);
    }

    fn inherit(&mut self, mut old: Engine, lineage: &Lineage, now: Time) {
        self.now = old.now;
        self.inherit_estimators(&mut old, lineage);
        self.inherit_learned(&old, lineage);
        self.outputs.append(&mut old.outputs);
        self.outputs.push_back(Output::Reloaded(now));
        self.ledger.inherit_returns(&old.ledger, lineage);
        let orders = old.standing_orders();
        let inheritance = self.monitor.inherit(old.monitor, lineage, now);
        // Who adds a signal answers for it; one that was there is not confirmed by a change.
        for (id, signal) in self.knowledge.signals().enumerate() {
            if old.knowledge.signal(&signal.name).is_none() {
                self.monitor.confirm(id);
            }
        }
        let ledgers = (&old.ledger, &mut self.ledger);
        let dropped = self.judge.inherit(&old.judge, ledgers, &self.monitor, lineage, &inheritance);
        for (component, is_described_anew) in dropped {
            let event = events::judged_anew(&self.knowledge, component, is_described_anew, now);
            self.outputs.push_back(Output::Event(event));
        }
        self.keep_orders(&orders, Span::ZERO, now);
        let (providers, outputs, situation) = self.situation(now, None);
        let change = Succession { old: &old.knowledge, lineage, inheritance: &inheritance, situation };
        let mut is_new = IdVec::filled(providers.len(), |_: NeedId| true);
        let ids = old.knowledge.needs().ids();
        for (id, provider) in ids.zip(old.providers) {
            let Some(need) = lineage.need(id) else { continue };
            is_new[need] = false;
            let event = providers[need].inherit(provider, &change);
            outputs.extend(event.map(Output::Event));
        }
        for (provider, _) in providers.iter_mut().zip(&is_new).filter(|(_, is_new)| **is_new) {
            provider.begin(&change);
        }
    }
}
