//! Why a need has had no value for longer than a value may be old.

use super::Provider;
use crate::alignment::Sample;
use crate::knowledge::KnowledgeBase;
use crate::monitor::Monitor;
use crate::reason::{Joint, Reason, Reasons};
use crate::substitution::Way;
use crate::time::{Span, Time};

/// Why the need was last served this long ago.
pub(super) fn reasons(
    provider: &Provider,
    knowledge: &KnowledgeBase,
    monitor: &Monitor,
    age: Span,
    now: Time,
) -> Reasons {
    let limits = Reason::Limits { age: provider.settings.max_age, width: provider.settings.max_width };
    let unfit = |what| Reasons::from(what).then(Joint::With, limits);
    if let Some(way) = provider.forced() {
        let alone = Reason::NoValueFrom { age, source: way.describe(knowledge) };
        return Reasons::from(alone).then(Joint::Namely, unfit(Reason::GivesUnfit));
    }
    let unsure = provider.state.unsure();
    let why = unsure.map(|unsure| unsure.why_not(knowledge, &provider.settings).into());
    let why = why.or_else(|| provider.why_none_admitted());
    let why = why.or_else(|| disagreement(provider, knowledge, monitor, now).map(Reasons::from));
    let why = why.unwrap_or_else(|| unfit(Reason::AllUnfit));
    Reasons::from(Reason::NoValue { age }).then(Joint::Namely, why)
}

/// The disagreement of the source with another one that holds back the newest value, although neither is accused.
fn disagreement(
    provider: &Provider,
    knowledge: &KnowledgeBase,
    monitor: &Monitor,
    now: Time,
) -> Option<Reason> {
    let source = provider.state.way()?;
    let own = monitor.way(monitor.find(source)?)?;
    let stated = |it: &Sample| provider.settings.stated(*it, own.computation.timing());
    let newest = own.latest(now).filter(|it| provider.settings.is_fit(&stated(it), now))?;
    let disagrees = |other: &&Way| {
        let other = monitor.find(other).and_then(|index| monitor.way(index));
        let vote = other.and_then(|other| Some((other, other.vote(newest.validity)?.0)));
        vote.is_some_and(|(other, says)| !other.in_turn(says, newest.value).overlaps(newest.value))
    };
    let other = provider.sources.ways().find(disagrees)?;
    Some(Reason::Disagreed { one: source.describe(knowledge), other: other.describe(knowledge) })
}
