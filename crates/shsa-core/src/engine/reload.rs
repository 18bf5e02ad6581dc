//! A new knowledge base takes over while the engine runs: what it leaves alone goes on without a gap.
//!
//! The new engine is set up as at the beginning, and every stage then takes over what is still the same, matched by names:
//! the ports of signals that mean the same, the recent comparisons of ways that compute the same, the verdicts that
//! rest on such comparisons, silences and probations, what serves each need, and the plans for its losses. So nothing of the old knowledge base
//! stays, and nothing grows with the number of changes.

use super::message::Output;
use super::provider::Succession;
use super::{Engine, explain};
use crate::knowledge::{IdVec, KnowledgeBase, Lineage, NeedId, SignalId};
use crate::time::Time;

impl Engine {
    /// Takes a new knowledge base over at a moment; what came before it is taken together first.
    ///
    /// An [`Output::Reloaded`] stands between the outputs that speak with the ids of the old knowledge base and those
    /// that speak with the ids of the new one. A signal, relation or need of the same name that says the same goes on as if
    /// nothing had happened. A signal that is described anew is judged anew; a verdict is dropped when no comparison that
    /// speaks about its signal goes on. A need whose source the change takes away is served by the next best at once.
    ///
    /// Complexity: that of [`Engine::new`] without the plans that last, and O(n log n) in what is taken over.
    pub fn reload(&mut self, knowledge: KnowledgeBase, at: Time) {
        self.advance(at);
        if self.waiting {
            self.settle();
        }
        let now = self.now.unwrap_or(at);
        let lineage = Lineage::new(&self.knowledge, &knowledge);
        let knowledge = knowledge.succeeding(self.knowledge.version());
        let standby = core::mem::take(&mut self.standby);
        let new = Engine::with_standby(knowledge, self.options, |knowledge, graph| {
            standby.carried_over(&self.graph, &lineage, knowledge, graph)
        });
        let old = core::mem::replace(self, new);
        self.inherit(old, &lineage, now);
    }

    fn inherit(&mut self, mut old: Engine, lineage: &Lineage, now: Time) {
        self.now = old.now;
        self.outputs.append(&mut old.outputs);
        self.outputs.push_back(Output::Reloaded(now));
        let source = |(signal, since): &(SignalId, Time)| Some((lineage.source(*signal)?, *since));
        self.returning = old.returning.iter().filter_map(source).collect();
        let inheritance = self.monitor.inherit(old.monitor, lineage, now);
        let dropped = self.judge.inherit(&old.judge, &self.monitor, lineage, &inheritance);
        for (component, is_described_anew) in dropped {
            let event = explain::judged_anew(&self.knowledge, component, is_described_anew, now);
            self.outputs.push_back(Output::Event(event));
        }
        let lost = [self.lost(true), self.lost(false)];
        let change = Succession {
            old: &old.knowledge,
            new: &self.knowledge,
            lineage,
            graph: &self.graph,
            standby: &self.standby,
            monitor: &self.monitor,
            inheritance: &inheritance,
            lost,
            now,
        };
        let mut is_new = IdVec::filled(self.providers.len(), |_: NeedId| true);
        let ids = old.knowledge.needs().ids();
        for (id, provider) in ids.zip(old.providers) {
            let Some(need) = lineage.need(id) else { continue };
            is_new[need] = false;
            let event = self.providers[need].inherit(provider, &change);
            self.outputs.extend(event.map(Output::Event));
        }
        for (provider, _) in self.providers.iter_mut().zip(&is_new).filter(|(_, is_new)| **is_new) {
            provider.begin(&change);
        }
    }
}
