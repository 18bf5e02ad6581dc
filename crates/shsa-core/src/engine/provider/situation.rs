//! What needs choose their sources by: at a moment, over a change of the model, and after a restart.

use super::super::ready_sources::ReadySources;
use super::super::ways::Lost;
use crate::alignment::Sample;
use crate::diagnosis::Judge;
use crate::knowledge::{KnowledgeBase, Lineage, SignalId};
use crate::monitor::{Inheritance, Monitor};
use crate::plan::Graph;
use crate::reason::Reason;
use crate::substitution::Way;
use crate::time::Time;
use alloc::string::String;
use alloc::vec::Vec;

/// What a need's sources are chosen by.
pub(in super::super) struct Situation<'a> {
    pub(in super::super) knowledge: &'a KnowledgeBase,
    pub(in super::super) graph: &'a Graph,
    pub(in super::super) ready_sources: &'a ReadySources,
    pub(in super::super) monitor: &'a Monitor,
    pub(in super::super) judge: &'a Judge,
    /// What may not be used: the first of these losses that lets a need be served counts. What only the last one lets serve
    /// is uncertain.
    pub(in super::super) lost: [Lost; 3],
    /// What may not be used even where it is not known what is right: what has failed, is forbidden or absent.
    pub(in super::super) doubted: Lost,
    pub(in super::super) now: Time,
    /// The order that has brought it about; `None` when the trust in something has changed.
    pub(in super::super) order: Option<Reason>,
}

/// A change of the knowledge base, as the needs see it.
pub(in super::super) struct Succession<'a> {
    pub(in super::super) old: &'a KnowledgeBase,
    pub(in super::super) lineage: &'a Lineage,
    pub(in super::super) inheritance: &'a Inheritance,
    /// In the changed model.
    pub(in super::super) situation: Situation<'a>,
}

impl Succession<'_> {
    /// Why the change takes a source away: what is gone, described anew or withdrawn, or that it does not serve any more.
    pub(super) fn lost_by(&self, way: &Way) -> Reason {
        let Succession { old, lineage, .. } = *self;
        let new = self.situation.knowledge;
        let name = |signal: SignalId| old.signals()[signal].name.clone();
        let signals =
            |is: &dyn Fn(SignalId) -> bool| way.inputs().filter(|&id| is(id)).map(name).collect::<Vec<_>>();
        let steps = way.substitution.steps.iter().filter(|step| lineage.relation(step.relation).is_none());
        let relations = steps.map(|step| old.relations()[step.relation].name.clone());
        let gone = signals(&|id| lineage.namesake(id).is_none());
        let names: Vec<String> = gone.into_iter().chain(relations).collect();
        let anew = signals(&|id| lineage.signal(id).is_none());
        let withdrawn = signals(&|id| lineage.signal(id).is_some_and(|signal| !new.is_available(signal)));
        match (names.is_empty(), anew.is_empty(), withdrawn.is_empty()) {
            (false, ..) => Reason::Gone { names },
            (_, false, _) => Reason::SignalsDescribedAnew { signals: anew },
            (.., false) => Reason::SignalsWithdrawn { signals: withdrawn },
            _ => Reason::ServesNoMore { source: way.describe(old) },
        }
    }
}

/// How a need was served before a restart; its times are not in the future.
#[derive(Clone, Debug, PartialEq)]
pub(in super::super) struct Resumption<'a> {
    /// What served it, in words.
    pub(in super::super) source: Option<&'a str>,
    /// When the last switch was.
    pub(in super::super) switched: Option<Time>,
    /// Whether it has been told that nothing serves it.
    pub(in super::super) unserved: bool,
    /// The last published value, and when that was.
    pub(in super::super) last: Option<(Time, Sample)>,
}
