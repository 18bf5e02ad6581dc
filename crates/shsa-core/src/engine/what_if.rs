//! What would serve the needs if signals were lost: the answers that an engine would act on, before the loss happens.

use super::ready_sources::ReadySources;
use super::ways::{Lost, Source};
use crate::knowledge::{KnowledgeBase, NeedId, SignalId};
use crate::plan::Graph;
use crate::substitution::Way;
use alloc::vec::Vec;

/// A knowledge base with the ready sources of its needs. It takes no inputs and makes no decisions; contracts are left out.
#[derive(Debug)]
pub struct WhatIf {
    knowledge: KnowledgeBase,
    graph: Graph,
    ready_sources: ReadySources,
}

impl WhatIf {
    /// Plans ahead as an engine does. Complexity: a search for each need and each signal that matters to it, within limits.
    #[must_use]
    pub fn new(knowledge: KnowledgeBase) -> WhatIf {
        let graph = Graph::new(&knowledge);
        let ready_sources = ReadySources::new(&knowledge, &graph);
        WhatIf { knowledge, graph, ready_sources }
    }

    /// The knowledge base.
    #[must_use]
    pub fn knowledge(&self) -> &KnowledgeBase {
        &self.knowledge
    }

    /// The signals whose loss alone makes a difference to a need, ascending.
    #[must_use]
    pub fn matters(&self, need: NeedId) -> &[SignalId] {
        self.ready_sources.matters(self.knowledge.needs()[need].variable)
    }

    /// The ways that could serve a need without these signals and without all that is derived from them, best first, each with
    /// its utility. Complexity: O(log of the ready sources), or that of one search.
    #[must_use]
    pub fn ways(&self, need: NeedId, lost: &[SignalId]) -> Vec<(Way, f64)> {
        let lost = Lost { signals: self.ready_sources.with_derived(lost), relations: Vec::new() };
        let sources = self.ready_sources.sources(&self.knowledge, &self.graph, need, &lost);
        sources.iter().map(|Source { way, utility }| (way.clone(), *utility)).collect()
    }
}
