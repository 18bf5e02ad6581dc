//! What contracts admit at a moment. Only this module makes it, and nothing else can be started.

use crate::statement::Level;
use core::marker::PhantomData;

/// Why something may go out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Ground {
    /// Nothing is demanded.
    #[default]
    Undemanded,
    /// What is demanded is met.
    Met,
    /// It was met until evidence became unknown, for no longer than a value of the need may be old.
    Lapsing,
    /// It is not met; the policy `degrade` lets the highest level go out that is given.
    Degraded,
    /// It is not met; the policy `warn` only tells so.
    Warned,
    /// It is not met; an operator has overridden it for a time.
    Overridden,
}

impl Ground {
    /// Every ground.
    pub const ALL: [Ground; 6] = [
        Ground::Undemanded,
        Ground::Met,
        Ground::Lapsing,
        Ground::Degraded,
        Ground::Warned,
        Ground::Overridden,
    ];

    /// What it is called in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Ground::Undemanded => "undemanded",
            Ground::Met => "met",
            Ground::Lapsing => "lapsing",
            Ground::Degraded => "degraded",
            Ground::Warned => "warned",
            Ground::Overridden => "overridden",
        }
    }
}

/// On which ground something may go out, and the level that is given with it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Admitted {
    /// Why it may.
    pub ground: Ground,
    /// The level that certificates give now, never more; `None` where they give none, or nothing is demanded.
    pub level: Option<Level>,
}

impl Admitted {
    /// What rests on both: the weaker ground, and the lower level where both give one of the same scale.
    #[must_use]
    pub fn weaker(self, other: Admitted) -> Admitted {
        let lower = |one: Level, other: Level| (one.scale == other.scale).then(|| one.min(other));
        let level = self.level.zip(other.level).and_then(|(one, other)| lower(one, other));
        Admitted { ground: self.ground.max(other.ground), level }
    }
}

/// Something that contracts admit now, under the knowledge and the evidence of this moment.
///
/// It borrows from the [`Assessments`](super::Assessments) that admit it, so it is gone before evidence can change. Nobody else
/// makes one:
///
/// ```compile_fail,E0451
/// use shsa_core::assurance::{Admitted, Assured};
/// let by_hand = Assured { value: "a way", admitted: Admitted::default(), now: core::marker::PhantomData };
/// ```
///
/// What is not assured cannot be started:
///
/// ```compile_fail,E0308
/// use shsa_core::{alignment::Port, knowledge::*, service::Service, substitution::Way};
/// fn start(knowledge: &KnowledgeBase, way: Way, ports: &IdVec<SignalId, Port>) -> Option<Service> {
///     Service::start(knowledge, way, ports, None)
/// }
/// ```
///
/// and what was assured before the evidence changed cannot, either:
///
/// ```compile_fail,E0502
/// use shsa_core::{alignment::Port, assurance::Assessments, knowledge::*, service::Service, substitution::Way};
/// fn start(knowledge: &KnowledgeBase, way: Way, ports: &IdVec<SignalId, Port>, contracts: &mut Assessments) {
///     let assured = contracts.admit(way).unwrap();
///     contracts.withdraw_override();
///     Service::start(knowledge, assured, ports, None);
/// }
/// ```
///
/// while the same in the other order can:
///
/// ```
/// use shsa_core::{alignment::Port, assurance::Assessments, knowledge::*, service::Service, substitution::Way};
/// fn start(knowledge: &KnowledgeBase, way: Way, ports: &IdVec<SignalId, Port>, contracts: &mut Assessments) {
///     contracts.withdraw_override();
///     let assured = contracts.admit(way).unwrap();
///     Service::start(knowledge, assured, ports, None);
/// }
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Assured<'now, T> {
    value: T,
    admitted: Admitted,
    now: PhantomData<&'now ()>,
}

impl<T> Assured<'_, T> {
    /// For [`Assessments`](super::Assessments) alone.
    pub(super) fn new(value: T, admitted: Admitted) -> Self {
        Assured { value, admitted, now: PhantomData }
    }

    /// On which ground, and at which level.
    #[must_use]
    pub fn admitted(&self) -> Admitted {
        self.admitted
    }

    /// What is admitted, to be started at once: it is assured no longer.
    #[must_use]
    pub fn into_value(self) -> T {
        self.value
    }
}
