//! What an operator can order, in names: an order outlives a change of the knowledge base.

use crate::diagnosis::Component;
use crate::knowledge::{KnowledgeBase, NeedId};
use crate::unit::nearest;
use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;
use core::fmt;

/// What an order is about.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Subject {
    /// The signal of this name.
    Signal(String),
    /// The relation of this name.
    Relation(String),
    /// What signals share, by its name.
    Cause(String),
}

/// What an operator can order. [`Engine::order`](super::Engine::order) obeys, or says why it cannot.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Order {
    /// A signal or a relation serves no need, and is no evidence about others, until it is allowed again. A forbidden
    /// signal stands for all that come from the same source, and for what is derived from it.
    Forbid(Subject),
    /// Takes back [`Order::Forbid`].
    Allow(Subject),
    /// A need is served from one source only, whatever is thought of it, until it is released. The source is never
    /// replaced: while it gives no usable value, the need is not served.
    Force {
        /// The name under which the need is published, or its variable.
        need: String,
        /// A signal of the need's variable, or a way as events tell it: `/a, /b by r1`.
        source: String,
    },
    /// Takes back [`Order::Force`] for a need, named as there.
    Release(String),
    /// The operator vouches for a signal, a relation, or all signals that share something: the accusation is dropped
    /// with the evidence for it. New evidence can accuse it again.
    Clear(Subject),
}

/// Why an order cannot be obeyed; nothing has changed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refusal {
    /// What is wrong.
    pub reason: String,
    /// What would be possible.
    pub help: String,
}

impl Refusal {
    pub(super) fn new(reason: impl Into<String>, help: impl Into<String>) -> Refusal {
        Refusal { reason: reason.into(), help: help.into() }
    }

    pub(super) fn unknown<'a>(
        what: &str,
        name: &str,
        known: impl Iterator<Item = &'a str> + Clone,
    ) -> Refusal {
        /// So many names are a help.
        const MOST_NAMED: usize = 8;
        let help = match nearest(name, known.clone()) {
            Some(near) => format!("did you mean `{near}`?"),
            None => {
                let names: Vec<&str> = known.clone().take(MOST_NAMED).collect();
                let more = if known.count() > MOST_NAMED { ", .." } else { "" };
                format!("known here: {}{more}", names.join(", "))
            }
        };
        Refusal::new(format!("there is no {what} `{name}`"), help)
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{}; {}", self.reason, self.help)
    }
}

impl core::error::Error for Refusal {}

impl fmt::Display for Subject {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Subject::Signal(name) => write!(out, "{name}"),
            Subject::Relation(name) => write!(out, "relation {name}"),
            Subject::Cause(name) => write!(out, "{name}"),
        }
    }
}

impl fmt::Display for Order {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Order::Forbid(subject) => write!(out, "forbid {subject}"),
            Order::Allow(subject) => write!(out, "allow {subject}"),
            Order::Force { need, source } => write!(out, "serve {need} from {source}"),
            Order::Release(need) => write!(out, "release {need}"),
            Order::Clear(subject) => write!(out, "clear {subject}"),
        }
    }
}

impl Subject {
    /// The name of a component.
    pub(super) fn of(knowledge: &KnowledgeBase, component: Component) -> Subject {
        match component {
            Component::Signal(id) => Subject::Signal(knowledge.signals()[id].name.clone()),
            Component::Relation(id) => Subject::Relation(knowledge.relations()[id].name.clone()),
            Component::Cause(id) => Subject::Cause(knowledge.causes()[id].name.clone()),
        }
    }

    /// The component of this name; of a signal, the one that stands for its source.
    pub(super) fn find(&self, knowledge: &KnowledgeBase) -> Result<Component, Refusal> {
        match self {
            Subject::Signal(name) => {
                let names = knowledge.signals().iter().map(|signal| signal.name.as_str());
                let found = knowledge.signal(name).map(|signal| Component::Signal(knowledge.witness(signal)));
                found.ok_or_else(|| Refusal::unknown("signal", name, names))
            }
            Subject::Relation(name) => {
                let mut relations = knowledge.relations().enumerate();
                let names = knowledge.relations().iter().map(|relation| relation.name.as_str());
                let found = relations.find(|(_, relation)| relation.name == *name);
                found
                    .map(|(id, _)| Component::Relation(id))
                    .ok_or_else(|| Refusal::unknown("relation", name, names))
            }
            Subject::Cause(name) => {
                let mut causes = knowledge.causes().enumerate();
                let names = knowledge.causes().iter().map(|cause| cause.name.as_str());
                let found = causes.find(|(_, cause)| cause.name == *name);
                found
                    .map(|(id, _)| Component::Cause(id))
                    .ok_or_else(|| Refusal::unknown("common cause", name, names))
            }
        }
    }
}

/// The need that is published under a name, else the only one of a variable of this name.
pub(super) fn find_need(knowledge: &KnowledgeBase, name: &str) -> Result<NeedId, Refusal> {
    let of_it = knowledge.needs_named(name);
    match of_it.as_slice() {
        [need] => Ok(*need),
        [] => Err(Refusal::unknown("need", name, knowledge.needs().iter().map(|need| need.signal.as_str()))),
        several => {
            let names: Vec<&str> =
                several.iter().map(|need| knowledge.needs()[*need].signal.as_str()).collect();
            let reason = format!("{} needs have the variable `{name}`", several.len());
            Err(Refusal::new(reason, format!("name one of them: {}", names.join(", "))))
        }
    }
}

/// What a refusal of something that is known already says.
pub(super) fn already(order: &Order) -> Refusal {
    Refusal::new(format!("`{order}` is in force already"), "nothing has to be done".to_string())
}
