//! What an operator can order, in names: an order outlives a change of the knowledge base.

use crate::time::Span;
use alloc::string::String;
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

/// What an operator can order. [`Engine::order`](crate::engine::Engine::order) obeys, or says why it cannot.
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
    /// Takes back [`Order::Force`] and [`Order::Override`] for a need, named as there.
    Release(String),
    /// The operator vouches for a signal, a relation, or all signals that share something: the accusation is dropped
    /// with the evidence for it. New evidence can accuse it again.
    Clear(Subject),
    /// What the contract of a need refuses goes out all the same for a time, at the level that it has.
    Override {
        /// The need, named as in [`Order::Force`].
        need: String,
        /// For how long; longer than nothing.
        lasts: Span,
        /// Why; not empty.
        because: String,
    },
    /// Somebody has checked a piece of evidence that nothing measures.
    Attest {
        /// The contract and the evidence: `speed/installed`.
        evidence: String,
        /// Whether it is so.
        holds: bool,
    },
}

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
            Order::Override { need, lasts, because } => {
                write!(out, "override the contract of {need} for {} s: {because}", lasts.seconds())
            }
            Order::Attest { evidence, holds: true } => write!(out, "attest {evidence}"),
            Order::Attest { evidence, holds: false } => write!(out, "deny {evidence}"),
        }
    }
}
