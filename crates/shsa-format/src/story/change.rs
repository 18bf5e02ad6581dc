//! Changes of the model in the middle of a story, and one set of names for all of it.

use crate::drive::{Era, Run};
use shsa_core::engine::{Event, Publication};
use shsa_core::knowledge::{
    CauseId, Diagnostic, KnowledgeBase, Model, NeedId, RelationId, Severity, SignalId, VariableId,
};
use shsa_core::time::Time;
use shsa_model::live;
use shsa_model::reader::Reader;
use shsa_model::tree::Node;

/// Changes a model at a moment and returns the new era; `node` is written as for `shsa replay --reload`.
pub(super) fn changed(reader: &mut Reader, model: &mut Model, node: &Node, at: Time) -> Option<Era> {
    let edits = live::edits(reader, node.clone());
    match model.edit(&edits) {
        Ok(_) => {
            let (knowledge, inputs) = (model.knowledge().clone(), Vec::new());
            Some(Era { from: at, knowledge, change: None, inputs })
        }
        Err(found) => {
            let is_error = |found: &Diagnostic| found.severity == Severity::Error;
            reader.problems.extend(found.into_iter().filter(is_error));
            None
        }
    }
}

/// The signal of another knowledge base with the same name.
pub(super) fn signal(of: &KnowledgeBase, signal: SignalId, to: &KnowledgeBase) -> Option<SignalId> {
    to.signal(&of.signals()[signal].name)
}

/// The need of another knowledge base that publishes under the same name.
pub(super) fn need(of: &KnowledgeBase, need: NeedId, to: &KnowledgeBase) -> Option<NeedId> {
    let name = &of.needs()[need].signal;
    to.needs().enumerate().find(|(_, need)| need.signal == *name).map(|(id, _)| id)
}

fn variable(of: &KnowledgeBase, variable: VariableId, to: &KnowledgeBase) -> Option<VariableId> {
    to.variable(&of.variables()[variable].name)
}

fn relation(of: &KnowledgeBase, relation: RelationId, to: &KnowledgeBase) -> Option<RelationId> {
    let name = &of.relations()[relation].name;
    to.relations().enumerate().find(|(_, relation)| relation.name == *name).map(|(id, _)| id)
}

fn cause(of: &KnowledgeBase, cause: CauseId, to: &KnowledgeBase) -> Option<CauseId> {
    let name = &of.causes()[cause].name;
    to.causes().enumerate().find(|(_, cause)| cause.name == *name).map(|(id, _)| id)
}

/// All events and publications of a run, with the ids of one knowledge base. Those of a need that this knowledge base does not
/// have are left out.
pub(super) fn in_first_names(run: &Run, knowledge: &KnowledgeBase) -> (Vec<Event>, Vec<Publication>) {
    let event = |(known, event): (&KnowledgeBase, &Event)| Event {
        signal: event.signal.and_then(|id| signal(known, id, knowledge)),
        variable: event.variable.and_then(|id| variable(known, id, knowledge)),
        need: event.need.and_then(|id| need(known, id, knowledge)),
        relation: event.relation.and_then(|id| relation(known, id, knowledge)),
        cause: event.cause.and_then(|id| cause(known, id, knowledge)),
        ..event.clone()
    };
    let publication = |(known, publication): (&KnowledgeBase, &Publication)| {
        Some(Publication { need: need(known, publication.need, knowledge)?, ..publication.clone() })
    };
    (
        run.events_with_models().map(event).collect(),
        run.publications_with_models(0).filter_map(publication).collect(),
    )
}
