//! The admission of a way by contracts at a moment. Only this module makes one, and only an admitted way can be started.

use crate::statement::Level;
use core::marker::PhantomData;

/// Why a way is admitted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Ground {
    /// The need demands nothing.
    #[default]
    Undemanded,
    /// The demands are met.
    Met,
    /// The demands were met until evidence became unknown, for no longer than a value of the need may be old.
    Lapsing,
    /// The demands are not met; the policy `degrade` admits the ways with the highest level.
    Degraded,
    /// The demands are not met; the policy `warn` only reports that.
    Warned,
    /// The demands are not met; an operator has overridden them for a time.
    Overridden,
}

impl Ground {
    /// All grounds.
    pub const ALL: [Ground; 6] = [
        Ground::Undemanded,
        Ground::Met,
        Ground::Lapsing,
        Ground::Degraded,
        Ground::Warned,
        Ground::Overridden,
    ];

    /// The name of the ground in files.
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

/// The ground of an admission, and the level that is given with it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Admitted {
    /// The ground.
    pub ground: Ground,
    /// The level that the certificates give now, never a higher one; `None` where they give none, or nothing is demanded.
    pub level: Option<Level>,
}

impl Admitted {
    /// The admission of what rests on both: the weaker ground, and the lower level where both have one of the same scale.
    #[must_use]
    pub fn weaker(self, other: Admitted) -> Admitted {
        let lower = |one: Level, other: Level| (one.scale == other.scale).then(|| one.min(other));
        let level = self.level.zip(other.level).and_then(|(one, other)| lower(one, other));
        Admitted { ground: self.ground.max(other.ground), level }
    }
}

/// A value that contracts admit now, under the knowledge and the evidence of this moment.
///
/// It borrows from the [`Assessments`](super::Assessments) that admit it, so that it ends before evidence can change. No other
/// code can make one:
///
/// ```compile_fail,E0451
/// use shsa_core::assurance::{Admitted, Assured};
/// let by_hand = Assured { value: "a way", admitted: Admitted::default(), now: core::marker::PhantomData };
/// ```
///
/// A way that is not assured cannot be started:
///
/// ```compile_fail,E0308
/// use shsa_core::{alignment::Port, knowledge::*, service::Service, substitution::Way};
/// fn start(knowledge: &KnowledgeBase, way: Way, ports: &IdVec<SignalId, Port>) -> Option<Service> {
///     Service::start(knowledge, way, ports, None)
/// }
/// ```
///
/// and a way that was assured before the evidence changed cannot be started either:
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
/// while a way that is assured afterwards can be:
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
    /// Only [`Assessments`](super::Assessments) calls this.
    pub(super) fn new(value: T, admitted: Admitted) -> Self {
        Assured { value, admitted, now: PhantomData }
    }

    /// The ground and the level of the admission.
    #[must_use]
    pub fn admitted(&self) -> Admitted {
        self.admitted
    }

    /// The admitted value, to be started at once: it is no longer assured.
    #[must_use]
    pub fn into_value(self) -> T {
        self.value
    }
}
