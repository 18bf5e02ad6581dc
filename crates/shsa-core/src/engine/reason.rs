//! Decisions in words: which values disagreed, which alternatives there were, which limit was reached.

use super::message::{Event, EventKind};
use super::snapshot::Accusation;
use crate::alignment::{Defect, Misdated};
use crate::diagnosis::{Blame, Component, Decision, Judge, Proof, rests_on};
use crate::interval::Interval;
use crate::knowledge::{Cause, CauseId, KnowledgeBase, SignalId, SignalSet, VariableId};
use crate::monitor::{Absence, Change, Evidence, Fault, Monitor, Residual, ResidualState, Symptom, Tendency};
use crate::time::{Span, Time};
use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;

/// How many disagreements a reason names.
const MOST_NAMED: usize = 3;

fn event(
    knowledge: &KnowledgeBase,
    kind: EventKind,
    component: Component,
    because: String,
    time: Time,
) -> Event {
    let (signal, relation, variable) = match component {
        Component::Signal(signal) => (Some(signal), None, Some(knowledge.signals()[signal].variable)),
        Component::Relation(relation) => {
            (None, Some(relation), knowledge.relations()[relation].outputs.first().copied())
        }
        Component::Cause(_) => (None, None, None),
    };
    Event { signal, relation, ..Event::new(time, kind, variable, because) }
}

/// A signal that says nothing usable any more; what all who share it are absent with is named.
pub(super) fn absence(
    knowledge: &KnowledgeBase,
    monitor: &Monitor,
    change: &Change,
    absence: Absence,
    now: Time,
) -> Event {
    let timeout = knowledge.signals()[change.signal].timeout.unwrap_or(Span::ZERO);
    let last = match change.last_valid {
        Some(last) => format!("the last one {} ago", span(now - last)),
        None => "none ever".to_string(),
    };
    let (kind, symptom, what) = match absence {
        Absence::Silent => (EventKind::Silent, Symptom::Silent, "nothing received".to_string()),
        Absence::Invalid => (
            EventKind::Failed,
            Symptom::Invalid,
            "no possible value (not a number, infinite or of a wrong shape)".to_string(),
        ),
        Absence::OutOfRange => {
            let description = &knowledge.signals()[change.signal];
            let shown = |range| interval(knowledge, description.variable, range);
            let range = description.limits.range.map_or(String::new(), shown);
            (EventKind::Failed, Symptom::OutOfRange, format!("only values out of {range}"))
        }
    };
    let mut because = format!("{what} within {}: {last}", span(timeout));
    let is_absent = |signal: &SignalId| monitor.timeouts().absence(*signal).is_some();
    let has_failed = |cause: &Cause| {
        cause.signals.len() > 1
            && cause.signals.contains(&change.signal)
            && cause.signals.iter().all(is_absent)
    };
    let cause = knowledge.causes().enumerate().find(|(_, cause)| has_failed(cause)).map(|(id, _)| id);
    if let Some(cause) = cause {
        because += &format!("; {} is absent with all that share it", knowledge.causes()[cause].name);
    }
    let about = Component::Signal(change.signal);
    Event { symptom: Some(symptom), cause, ..event(knowledge, kind, about, because, now) }
}

/// A signal whose own readings show that it is faulty.
pub(super) fn fault(knowledge: &KnowledgeBase, signal: SignalId, fault: &Fault, now: Time) -> Event {
    let description = &knowledge.signals()[signal];
    let variable = description.variable;
    let shown = |value| interval(knowledge, variable, value);
    let what = match fault.evidence {
        Evidence::Invalid(defect) => match defect {
            Defect::Shape => "of a wrong shape".to_string(),
            Defect::NotANumber => "not a number".to_string(),
            Defect::Infinite => "infinite".to_string(),
            Defect::Bounds => "with its lower bound above the upper one".to_string(),
        },
        Evidence::OutOfRange(value) => {
            let range = description.limits.range.map_or(String::new(), shown);
            format!("{} is out of {range}", shown(value))
        }
        Evidence::TooFast(jump) => format!(
            "from {} to {} within {}, at most {} a second is possible",
            shown(jump.from),
            shown(jump.to),
            span(jump.within),
            difference(knowledge, variable, jump.max_rate)
        ),
        Evidence::OutOfOrder(back) => format!("its time stamp went back by {}", span(back)),
        Evidence::Late(delay) => {
            let most = description.limits.max_delay.unwrap_or(Span::ZERO);
            format!("arrived {} after its time stamp, {} is allowed", span(delay), span(most))
        }
        Evidence::Frozen(still) => {
            let most = description.limits.frozen_after.unwrap_or(Span::ZERO);
            format!("it has said exactly the same for {}, {} is allowed", span(still), span(most))
        }
        Evidence::WrongClock(Misdated::Off(off)) => {
            let side = if off.0 < 0 { "ahead of" } else { "behind" };
            let off = span(Span(off.0.saturating_abs()));
            format!(
                "its time stamps are {off} {side} the time of reception, and no two clocks of one system differ by that"
            )
        }
        Evidence::WrongClock(Misdated::Standing(stood)) => {
            format!("its time stamp has been the same for {}, while its values have changed", span(stood))
        }
    };
    let (k, n) = fault.count;
    let because = format!("{what} ({k} of {n} values)");
    let about = Component::Signal(signal);
    Event { symptom: Some(fault.symptom), ..event(knowledge, EventKind::Failed, about, because, now) }
}

/// A signal that speaks again and has done so for its probation.
pub(super) fn returned(knowledge: &KnowledgeBase, signal: SignalId, probation: Span, now: Time) -> Event {
    let because = format!("it has spoken again for {}", span(probation));
    event(knowledge, EventKind::Restored, Component::Signal(signal), because, now)
}

/// What decisions are told from.
pub(super) struct Scene<'a> {
    pub(super) knowledge: &'a KnowledgeBase,
    pub(super) monitor: &'a Monitor,
    pub(super) judge: &'a Judge,
    pub(super) now: Time,
}

impl Scene<'_> {
    /// Whether a pair is in conflict, and speaks against something.
    fn is_against(&self, pair: &Residual, about: Component) -> bool {
        pair.relationship(self.now) == ResidualState::Conflict
            && self.judge.speaks_against(self.monitor, pair, about)
    }

    /// The pairs that speak against something; where all are explained otherwise, those that disagree.
    fn against(&self, about: Component) -> Vec<&Residual> {
        let is_conflict = |pair: &&Residual| {
            rests_on(self.monitor, pair, about) && pair.relationship(self.now) == ResidualState::Conflict
        };
        let all: Vec<&Residual> = self.monitor.residuals().iter().filter(is_conflict).collect();
        let open: Vec<&Residual> = all.iter().copied().filter(|pair| self.is_against(pair, about)).collect();
        if open.is_empty() { all } else { open }
    }

    fn symptom(&self, signal: SignalId) -> Symptom {
        let against = self.against(Component::Signal(signal));
        let counts = |pair: &Residual| against.iter().any(|it| core::ptr::eq(*it, pair));
        self.monitor.symptom(signal, self.now, counts)
    }
}

/// A change of verdict.
pub(super) fn decision(scene: &Scene<'_>, decision: &Decision) -> Event {
    let &Scene { knowledge, now, .. } = scene;
    match decision {
        Decision::Failed(blame) => {
            let why = match (blame.cause, blame.component) {
                (Some(cause), _) => format!("{}, explains it best", shared(knowledge, cause)),
                (None, Component::Relation(relation)) => {
                    format!("relation {} no longer holds", knowledge.relations()[relation].name)
                }
                _ => "no other explanation is as probable".to_string(),
            };
            accused(scene, EventKind::Failed, blame, &why)
        }
        Decision::Suspected(blame, choice) => {
            let mut why = match choice.len() {
                1 => "it explains most, but some comparisons are undecided".to_string(),
                _ => format!("it may be any of {}", components(knowledge, choice)),
            };
            if let Some(cause) = blame.cause {
                why += &format!("; by {}", shared(knowledge, cause));
            }
            accused(scene, EventKind::Suspected, blame, &why)
        }
        Decision::Cleared(component) => {
            let because = "every comparison with it agrees again".to_string();
            event(knowledge, EventKind::Restored, *component, because, now)
        }
        Decision::Recovered(signal, probation, proof) => {
            let what = match proof {
                Proof::Witness => "its values are sound and others agree with it",
                Proof::Return => {
                    "its values are sound and where they could have got to from the last one before, and nothing has \
                     contradicted them,"
                }
            };
            let because = format!("{what} for {}", span(*probation));
            event(knowledge, EventKind::Restored, Component::Signal(*signal), because, now)
        }
        Decision::Unproven(component, probation) => {
            let because = format!(
                "nothing has spoken against it any more for {}, and nothing for it: where nothing else is left it may \
                 serve, and what rests on it is uncertain",
                span(*probation)
            );
            event(knowledge, EventKind::Suspected, *component, because, now)
        }
        Decision::Contradicted(component) => {
            let because = format!("{}; it is contradicted again", disagreements(scene, *component));
            event(knowledge, EventKind::Suspected, *component, because, now)
        }
    }
}

fn accused(scene: &Scene<'_>, kind: EventKind, blame: &Blame, why: &str) -> Event {
    let &Scene { knowledge, monitor, now, .. } = scene;
    let symptom = match blame.component {
        Component::Signal(signal) => Some((signal, scene.symptom(signal))),
        Component::Relation(_) | Component::Cause(_) => None,
    };
    let mut because = disagreements(scene, blame.component);
    if because.is_empty() {
        because = "it disagrees with nothing itself".to_string();
    }
    if let Some(traits) = symptom.and_then(|(signal, symptom)| traits(monitor, signal, symptom, now)) {
        because += &format!("; {traits}");
    }
    because += &format!("; {why}");
    match (blame.probability, &blame.next) {
        (Some(own), Some((next, other))) if *other >= LEAST_TOLD => {
            let next = name(knowledge, *next);
            because += &format!("; probability {}, next {next} {}", probability(own), probability(*other));
        }
        (Some(own), _) => because += &format!("; probability {}", probability(own)),
        (None, _) => because += "; too many possibilities for a probability",
    }
    if blame.relapses > 0 {
        because +=
            &format!("; intermittent: accused again soon after it was trusted, {}", times(blame.relapses));
    }
    let about = event(knowledge, kind, blame.component, because, now);
    let symptom = symptom.map(|(_, symptom)| symptom);
    Event { symptom, cause: blame.cause, probability: blame.probability, ..about }
}

fn times(count: u32) -> String {
    match count {
        1 => "once".to_string(),
        _ => format!("{count} times"),
    }
}

/// Probabilities below this are not told.
const LEAST_TOLD: f64 = 0.0005;

/// With two digits, and never 1: nothing is certain.
fn probability(share: f64) -> String {
    match share {
        share if share >= 1.0 - LEAST_TOLD => "above 0.999".to_string(),
        share if !(0.095..0.995).contains(&share) => format!("{share:.3}"),
        share => format!("{share:.2}"),
    }
}

fn shared(knowledge: &KnowledgeBase, cause: CauseId) -> String {
    let cause = &knowledge.causes()[cause];
    let signals: SignalSet = cause.signals.iter().copied().collect();
    format!("{}, which {} share", cause.name, names(knowledge, &signals))
}

fn name(knowledge: &KnowledgeBase, component: Component) -> String {
    match component {
        Component::Signal(signal) => knowledge.signals()[signal].name.clone(),
        Component::Relation(relation) => format!("relation {}", knowledge.relations()[relation].name),
        Component::Cause(cause) => knowledge.causes()[cause].name.clone(),
    }
}

fn components(knowledge: &KnowledgeBase, choice: &[Component]) -> String {
    choice.iter().map(|component| name(knowledge, *component)).collect::<Vec<_>>().join(", ")
}

/// What makes a symptom, where the disagreements do not tell.
fn traits(monitor: &Monitor, signal: SignalId, symptom: Symptom, now: Time) -> Option<String> {
    match symptom {
        Symptom::Frozen => {
            Some(format!("it has said the same for {}", span(now - monitor.frozen(signal).since())))
        }
        Symptom::Skewed => {
            let late = monitor.skew(signal, now)?;
            let side = if late.0 < 0 { "early" } else { "late" };
            Some(format!("it seems to tell things {} {side}", span(Span(late.0.abs()))))
        }
        Symptom::Noisy => Some("its values scatter around what others say".to_string()),
        Symptom::Drifting => Some("the difference has built up slowly".to_string()),
        _ => None,
    }
}

/// Something that the operator vouches for; for a signal, perhaps because of what it shares.
pub(super) fn cleared_by_operator(
    knowledge: &KnowledgeBase,
    component: Component,
    cause: Option<CauseId>,
    now: Time,
) -> Event {
    let because = match cause {
        Some(cause) => format!(
            "cleared with {} by order of the operator: what spoke against it is forgotten",
            knowledge.causes()[cause].name
        ),
        None => "cleared by order of the operator: what spoke against it is forgotten".to_string(),
    };
    Event { cause, ..event(knowledge, EventKind::Restored, component, because, now) }
}

/// An accusation, as an event has told it.
pub(super) fn accusation(knowledge: &KnowledgeBase, event: &Event) -> Accusation {
    Accusation {
        since: event.time,
        symptom: event.symptom,
        cause: event.cause.map(|cause| knowledge.causes()[cause].name.clone()),
        probability: event.probability,
        because: event.because.clone(),
    }
}

/// What cannot be done, or no more, with the component that it is about.
pub(super) fn refused(
    knowledge: &KnowledgeBase,
    component: Option<Component>,
    because: String,
    now: Time,
) -> Event {
    match component {
        Some(component) => event(knowledge, EventKind::Refused, component, because, now),
        None => Event::new(now, EventKind::Refused, None, because),
    }
}

/// A signal that was accused before the knowledge base changed, and is not any more.
pub(super) fn judged_anew(
    knowledge: &KnowledgeBase,
    component: Component,
    is_described_anew: bool,
    now: Time,
) -> Event {
    let because = match is_described_anew {
        true => "the changed model describes it anew",
        false => "the comparisons that spoke about it are gone with the changed model",
    };
    event(knowledge, EventKind::Restored, component, because.to_string(), now)
}

/// The disagreements that speak against a signal or relation.
fn disagreements(scene: &Scene<'_>, about: Component) -> String {
    let against = scene.against(about);
    let named = against.iter().take(MOST_NAMED);
    let mut named: Vec<String> =
        named.filter_map(|pair| disagreement(scene.knowledge, scene.monitor, pair, scene.now)).collect();
    if against.len() > MOST_NAMED {
        named.push(format!("and {} more disagreements", against.len() - MOST_NAMED));
    }
    named.join("; ")
}

fn disagreement(knowledge: &KnowledgeBase, monitor: &Monitor, pair: &Residual, now: Time) -> Option<String> {
    let (way, other) = (monitor.way(pair.way)?, monitor.way(pair.other)?);
    let (one, two) = (way.computation.way().describe(knowledge), other.computation.way().describe(knowledge));
    let variable = way.variable();
    if pair.window.relationship(now) != ResidualState::Conflict {
        return Some(together(knowledge, variable, pair, (&one, &two)));
    }
    let last = pair.disagreement?;
    let (k, n) = pair.window.counts();
    Some(format!(
        "{one} says {} where {two} says {} ({k} of {n} comparisons)",
        interval(knowledge, variable, last.value),
        interval(knowledge, variable, last.other),
    ))
}

/// What comparisons that agree one by one say together.
fn together(
    knowledge: &KnowledgeBase,
    variable: VariableId,
    pair: &Residual,
    (one, two): (&str, &str),
) -> String {
    match pair.trend.tendency() {
        Tendency::Drift => {
            let mean = pair.trend.mean();
            let (more, less) = if mean < 0.0 { (two, one) } else { (one, two) };
            format!(
                "{more} has said {} more than {less} on average",
                difference(knowledge, variable, mean.abs())
            )
        }
        Tendency::Noise => format!("{one} and {two} scatter against each other"),
        Tendency::Skew => format!("{one} and {two} tell the same at different times"),
        Tendency::Calm | Tendency::Building => format!("{one} and {two} disagreed"),
    }
}

/// An interval in the unit of a variable.
#[must_use]
pub fn interval(knowledge: &KnowledgeBase, variable: VariableId, value: Interval) -> String {
    let shown = |number: f64| match &knowledge.variables()[variable].unit {
        Some(unit) => unit.from_si(number),
        None => number,
    };
    let unit = knowledge.variables()[variable].unit.as_ref().map_or(String::new(), |unit| format!(" {unit}"));
    let value = knowledge.variables()[variable].brought_back(value);
    format!("{}..{}{unit}", number(shown(value.lo())), number(shown(value.hi())))
}

/// A difference of values, SI, in the unit of a variable; one of temperatures in kelvin.
#[must_use]
pub fn difference(knowledge: &KnowledgeBase, variable: VariableId, difference: f64) -> String {
    match &knowledge.variables()[variable].unit {
        Some(unit) if unit.offset != 0.0 => format!("{} K", number(difference)),
        Some(unit) => format!("{} {unit}", number(difference / unit.scale)),
        None => number(difference),
    }
}

/// With four significant digits, without an exponent where that is short.
fn number(value: f64) -> String {
    let magnitude = libm::floor(libm::log10(value.abs()));
    match magnitude {
        m if !m.is_finite() => "0".to_string(),
        m if (-4.0..0.0).contains(&m) => format!("{value:.*}", (3.0 - m) as usize),
        m if (0.0..4.0).contains(&m) => format!("{value:.*}", (3.0 - m) as usize),
        m if (4.0..9.0).contains(&m) => format!("{value:.0}"),
        _ => format!("{value:.3e}"),
    }
}

/// A span with the unit that suits it.
#[must_use]
pub fn span(length: Span) -> String {
    match length.seconds() {
        seconds if seconds.abs() < 1.0 => format!("{:.0} ms", seconds * 1e3),
        seconds if seconds.abs() < 100.0 => format!("{seconds:.1} s"),
        seconds => format!("{seconds:.0} s"),
    }
}

/// The first of some names, and how many there are beside.
pub(super) fn listed(names: &[&str]) -> String {
    let named = names.get(..MOST_NAMED.min(names.len())).unwrap_or_default().join(", ");
    match names.len().saturating_sub(MOST_NAMED) {
        0 => named,
        more => format!("{named} and {more} more"),
    }
}

/// Names of signals, in file order.
pub(super) fn names(knowledge: &KnowledgeBase, signals: &SignalSet) -> String {
    let names: Vec<&str> = signals.iter().map(|signal| knowledge.signals()[signal].name.as_str()).collect();
    names.join(", ")
}
