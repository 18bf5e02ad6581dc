//! Orders of an operator, by names, so that an order outlives a change of the knowledge base.

use crate::time::Span;
use alloc::string::String;
use core::fmt;

/// The subject of an order.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Subject {
    /// The signal of this name.
    Signal(String),
    /// The relation of this name.
    Relation(String),
    /// The common cause of this name.
    Cause(String),
}

/// An order of an operator. [`Engine::order`](crate::engine::Engine::order) obeys, or returns why it cannot.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Order {
    /// A signal or a relation serves no need, and is no evidence about others, until it is allowed again. A forbidden signal
    /// stands for all signals of the same source, and for all derived from it.
    Forbid(Subject),
    /// Takes back [`Order::Forbid`].
    Allow(Subject),
    /// A need is served from one source only, whatever its verdict, until it is released. The source is never replaced: while it
    /// gives no usable value, the need is not served.
    Force {
        /// The name under which the need is published, or its variable.
        need: String,
        /// A signal of the need's variable, or a way as events name it: `/a, /b by r1`.
        source: String,
    },
    /// Takes back [`Order::Force`] and [`Order::Override`] for a need, named as there.
    Release(String),
    /// The operator vouches for a signal, a relation, or all signals with a common cause: the accusation is dropped with its
    /// evidence. New evidence can accuse it again.
    Clear(Subject),
    /// A source that the contract of a need refuses serves it all the same for a time, at its own level.
    Override {
        /// The need, named as in [`Order::Force`].
        need: String,
        /// For how long; more than zero.
        lasts: Span,
        /// The operator's reason; not empty.
        because: String,
    },
    /// An operator has checked a piece of evidence that is not measured.
    Attest {
        /// The contract and the evidence: `speed/installed`.
        evidence: String,
        /// Whether the evidence is true.
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
