//! Why a need has had no value for longer than a value may be old.

use super::Provider;
use super::settings::Settings;
use super::unsure::{hull_would_serve, independent};
use crate::alignment::Sample;
use crate::knowledge::{KnowledgeBase, WhenUnsure};
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
    if let Some(way) = provider.forced() {
        let alone = Reason::NoValueFrom { age, source: way.describe(knowledge) };
        return Reasons::from(alone)
            .then(Joint::Namely, Reasons::from(Reason::GivesUnfit).then(Joint::With, limits));
    }
    let unsure = provider.state.unsure();
    let why = unsure.map(|unsure| unsure.why_not(knowledge, &provider.settings).into());
    let why = why.or_else(|| provider.why_none_admitted());
    let why = why.or_else(|| {
        let disagreed = Reasons::from(disagreement(provider, knowledge, monitor, now)?);
        Some(match would_serve(provider, knowledge) {
            Some(hull) => disagreed.then(Joint::Next, hull),
            None => disagreed,
        })
    });
    let gives = |way: &Way| {
        monitor.find(way).and_then(|index| monitor.way(index)).is_none_or(|it| it.latest(now).is_some())
    };
    let is_there = || provider.sources.ways().any(gives);
    let why = why.unwrap_or_else(|| match is_there() {
        true => unfit(&provider.settings),
        false => Reason::NothingGiven.into(),
    });
    Reasons::from(Reason::NoValue { age }).then(Joint::Namely, why)
}

/// That all values are contradicted, or no such as the need demands.
pub(super) fn unfit(settings: &Settings) -> Reasons {
    let limits = Reason::Limits { age: settings.max_age, width: settings.max_width };
    Reasons::from(Reason::AllUnfit).then(Joint::With, limits)
}

/// What would serve a need that states nothing of how it is served when unsure.
fn would_serve(provider: &Provider, knowledge: &KnowledgeBase) -> Option<Reason> {
    let settings = &provider.settings;
    let is_open = settings.when_unsure == WhenUnsure::Unstated && !settings.is_vector;
    let ways = is_open.then(|| independent(knowledge, provider.sources.all()))?;
    (ways.len() > 1).then(|| hull_would_serve(knowledge, &ways))
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
