//! Resolves the names of an order, and explains a refusal.

use crate::knowledge::{KnowledgeBase, NeedId};
use crate::order::{Order, Subject};
use crate::reason::{Joint, Reason, Reasons};
use crate::trust::Component;
use crate::unit::nearest;
use alloc::borrow::ToOwned;
use alloc::string::String;
use alloc::vec::Vec;
use core::fmt;

/// Why an order cannot be obeyed; a refused order changes nothing.
#[derive(Clone, Debug, PartialEq)]
pub struct Refusal {
    /// What is wrong.
    pub reason: Reasons,
    /// What would be possible.
    pub help: Reasons,
}

impl Refusal {
    pub(super) fn new(reason: impl Into<Reasons>, help: impl Into<Reasons>) -> Refusal {
        Refusal { reason: reason.into(), help: help.into() }
    }

    /// The refusal of an unknown name: `reason` gives what is missing.
    pub(super) fn unknown<'a>(
        reason: Reason,
        name: &str,
        known: impl Iterator<Item = &'a str> + Clone,
    ) -> Refusal {
        /// At most this many names are suggested.
        const MOST_NAMED: usize = 8;
        let help = match nearest(name, known.clone()) {
            Some(near) => Reason::DidYouMean { name: near.to_owned() },
            None => {
                let names: Vec<String> = known.clone().take(MOST_NAMED).map(ToOwned::to_owned).collect();
                match known.count() > MOST_NAMED {
                    true => Reason::KnownAmongOthers { names },
                    false => Reason::KnownHere { names },
                }
            }
        };
        Refusal::new(reason, help)
    }

    /// Reason and help, as an event reports them.
    pub(super) fn reasons(self) -> Reasons {
        self.reason.then(Joint::Next, self.help)
    }
}

impl fmt::Display for Refusal {
    /// Writes the codes; texts are made outside the core.
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut between = "";
        for reason in self.reason.iter().chain(self.help.iter()) {
            write!(out, "{between}{}", reason.code())?;
            between = "; ";
        }
        Ok(())
    }
}

impl core::error::Error for Refusal {}

impl Subject {
    /// The name of a component.
    pub(super) fn of(knowledge: &KnowledgeBase, component: Component) -> Subject {
        match component {
            Component::Signal(id) => Subject::Signal(knowledge.signals()[id].name.clone()),
            Component::Relation(id) => Subject::Relation(knowledge.relations()[id].name.clone()),
            Component::Cause(id) => Subject::Cause(knowledge.causes()[id].name.clone()),
        }
    }

    /// The component of this name; for a signal, the one that represents its source.
    pub(super) fn find(&self, knowledge: &KnowledgeBase) -> Result<Component, Refusal> {
        match self {
            Subject::Signal(name) => {
                let names = knowledge.signals().iter().map(|signal| signal.name.as_str());
                let found = knowledge.signal(name).map(|signal| Component::Signal(knowledge.witness(signal)));
                found.ok_or_else(|| Refusal::unknown(Reason::NoSignal { name: name.clone() }, name, names))
            }
            Subject::Relation(name) => {
                let mut relations = knowledge.relations().enumerate();
                let names = knowledge.relations().iter().map(|relation| relation.name.as_str());
                let found = relations.find(|(_, relation)| relation.name == *name);
                found
                    .map(|(id, _)| Component::Relation(id))
                    .ok_or_else(|| Refusal::unknown(Reason::NoRelation { name: name.clone() }, name, names))
            }
            Subject::Cause(name) => {
                let mut causes = knowledge.causes().enumerate();
                let names = knowledge.causes().iter().map(|cause| cause.name.as_str());
                let found = causes.find(|(_, cause)| cause.name == *name);
                found
                    .map(|(id, _)| Component::Cause(id))
                    .ok_or_else(|| Refusal::unknown(Reason::NoCause { name: name.clone() }, name, names))
            }
        }
    }
}

/// The need that is published under a name, else the only one of a variable of this name.
pub(super) fn find_need(knowledge: &KnowledgeBase, name: &str) -> Result<NeedId, Refusal> {
    let of_it = knowledge.needs_named(name);
    match of_it.as_slice() {
        [need] => Ok(*need),
        [] => {
            let names = knowledge.needs().iter().map(|need| need.signal.as_str());
            Err(Refusal::unknown(Reason::NoNeed { name: name.to_owned() }, name, names))
        }
        several => {
            let needs = several.iter().map(|need| knowledge.needs()[*need].signal.clone()).collect();
            let reason = Reason::SeveralNeeds { count: several.len() as u64, variable: name.to_owned() };
            Err(Refusal::new(reason, Reason::NameOne { needs }))
        }
    }
}

/// The refusal of an order that is in force already.
pub(super) fn already(order: &Order) -> Refusal {
    Refusal::new(Reason::AlreadyInForce { order: order.clone() }, Reason::NothingToDo)
}
