//! Decisions as events, with their reasons: which values disagreed, which alternatives there were, which limit was reached.

use super::message::{Event, EventKind};
use super::unit_slip::{right_unit, unit_of_jump};
use crate::alignment::{Defect, Misdated, Still};
use crate::diagnosis::{Blame, Decision, Proof, rests_on, speaks_against};
use crate::interval::Interval;
use crate::knowledge::{Cause, CauseId, KnowledgeBase, SignalId, SignalSet, VariableId};
use crate::monitor::{
    Absence, Change, Evidence, Fault, Monitor, Residual, ResidualState, Symptom, Tendency, WatchedWay,
};
use crate::order::Subject;
use crate::reason::{Amount, Joint, Probability, Range, Reason, Reasons};
use crate::time::{Span, Time};
use crate::trust::{Accusation, Component, Ledger};
use alloc::string::String;
use alloc::vec::Vec;

/// How many disagreements a reason names.
const MOST_NAMED: usize = 3;

pub(super) fn event(
    knowledge: &KnowledgeBase,
    kind: EventKind,
    component: Component,
    because: impl Into<Reasons>,
    time: Time,
) -> Event {
    let (signal, relation, variable) = match component {
        Component::Signal(signal) => (Some(signal), None, Some(knowledge.signals()[signal].variable)),
        Component::Relation(relation) => {
            (None, Some(relation), knowledge.relations()[relation].outputs.first().copied())
        }
        Component::Cause(_) => (None, None, None),
    };
    Event { signal, relation, ..Event::new(time, kind, variable, because.into()) }
}

/// The event of a signal that gives no usable value any more; a cause is named when every signal of the cause is absent.
pub(super) fn absence(
    knowledge: &KnowledgeBase,
    monitor: &Monitor,
    change: &Change,
    absence: Absence,
    now: Time,
) -> Event {
    let within = change.allowed;
    let last = match change.last_valid {
        Some(last) => Reason::LastValue { ago: now - last },
        None => Reason::NoValueEver,
    };
    let (kind, symptom, what) = match absence {
        Absence::Silent => (EventKind::Silent, Symptom::Silent, Reason::NothingReceived { within }),
        Absence::Invalid => (EventKind::Failed, Symptom::Invalid, Reason::NothingPossible { within }),
        Absence::OutOfRange => {
            let range = range_of(knowledge, change.signal);
            (EventKind::Failed, Symptom::OutOfRange, Reason::OnlyOutOfRange { range, within })
        }
    };
    let mut because = Reasons::from(what).then(Joint::Namely, last);
    let is_absent = |signal: &SignalId| monitor.timeouts().absence(*signal).is_some();
    let has_failed = |cause: &Cause| {
        cause.signals.len() > 1
            && cause.signals.contains(&change.signal)
            && cause.signals.iter().all(is_absent)
    };
    let cause = knowledge.causes().enumerate().find(|(_, cause)| has_failed(cause)).map(|(id, _)| id);
    if let Some(cause) = cause {
        let cause = knowledge.causes()[cause].name.clone();
        because = because.then(Joint::Next, Reason::AbsentTogether { cause });
    }
    let about = Component::Signal(change.signal);
    Event { symptom: Some(symptom), cause, ..event(knowledge, kind, about, because, now) }
}

/// The range of a signal's values; unbounded where the model gives none.
fn range_of(knowledge: &KnowledgeBase, signal: SignalId) -> Range {
    let description = &knowledge.signals()[signal];
    Range::of(knowledge, description.variable, description.limits.range.unwrap_or(Interval::ENTIRE))
}

/// A signal whose own readings show that it is faulty.
pub(super) fn fault(knowledge: &KnowledgeBase, signal: SignalId, fault: &Fault, now: Time) -> Event {
    let (bad, of) = fault.count;
    let figures = Reason::Readings { bad: bad.into(), of: of.into() };
    let because = Reasons::from(shown(knowledge, signal, fault.evidence)).then(Joint::With, figures);
    let unit = unit_of_jump(knowledge, signal, fault.evidence);
    let because = unit.into_iter().fold(because, |because, unit| because.then(Joint::Next, unit));
    let about = Component::Signal(signal);
    Event { symptom: Some(fault.symptom), ..event(knowledge, EventKind::Failed, about, because, now) }
}

/// What a signal's own readings show.
pub(super) fn shown(knowledge: &KnowledgeBase, signal: SignalId, evidence: Evidence) -> Reason {
    let description = &knowledge.signals()[signal];
    let variable = description.variable;
    let range = |value| Range::of(knowledge, variable, value);
    let limits = &description.limits;
    match evidence {
        Evidence::Invalid(Defect::Shape) => Reason::WrongShape,
        Evidence::Invalid(Defect::NotANumber) => Reason::NotANumber,
        Evidence::Invalid(Defect::Infinite) => Reason::Infinite,
        Evidence::Invalid(Defect::Bounds) => Reason::BoundsCrossed,
        Evidence::OutOfRange(value) => {
            Reason::OutOfRange { value: range(value), range: range_of(knowledge, signal) }
        }
        Evidence::TooFast(jump) if jump.max_rate == 0.0 => {
            Reason::CountedDown { from: range(jump.from), to: range(jump.to) }
        }
        Evidence::TooFast(jump) => Reason::TooFast {
            from: range(jump.from),
            to: range(jump.to),
            within: jump.within,
            most: Amount::of(knowledge, variable, jump.max_rate),
        },
        Evidence::OutOfOrder(by) => Reason::StampWentBack { by },
        Evidence::Late(after) => {
            Reason::ArrivedLate { after, allowed: limits.max_delay.unwrap_or(Span::ZERO) }
        }
        Evidence::Frozen(Still { lasted, allowed }) => Reason::StoodStill { lasted, allowed },
        Evidence::WrongClock(Misdated::Off(off)) => {
            let by = Span(off.0.saturating_abs());
            if off.0 < 0 { Reason::StampsAhead { by } } else { Reason::StampsBehind { by } }
        }
        Evidence::WrongClock(Misdated::Ahead(by)) => Reason::StampsAhead { by },
        Evidence::WrongClock(Misdated::Stopped(lasted)) => Reason::StampStands { lasted },
    }
}

/// A signal that gives values again and has done so for its probation.
pub(super) fn returned(knowledge: &KnowledgeBase, signal: SignalId, lasted: Span, now: Time) -> Event {
    event(knowledge, EventKind::Restored, Component::Signal(signal), Reason::SpokenAgain { lasted }, now)
}

/// The state that decisions are explained from.
pub(super) struct Scene<'a> {
    pub(super) knowledge: &'a KnowledgeBase,
    pub(super) monitor: &'a Monitor,
    pub(super) ledger: &'a Ledger,
    pub(super) now: Time,
}

impl Scene<'_> {
    /// Whether a pair is in conflict, and accuses a component.
    fn is_against(&self, pair: &Residual, about: Component) -> bool {
        pair.residual_state(self.now) == ResidualState::Conflict
            && speaks_against(self.ledger, self.monitor, pair, about)
    }

    /// The pairs that speak against a component; where failures explain each of them, all its pairs in conflict.
    fn against(&self, about: Component) -> Vec<&Residual> {
        let is_conflict = |pair: &&Residual| {
            rests_on(self.monitor, pair, about) && pair.residual_state(self.now) == ResidualState::Conflict
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

/// The event of a change of verdict.
pub(super) fn decision(scene: &Scene<'_>, decision: &Decision) -> Event {
    let &Scene { knowledge, now, .. } = scene;
    match decision {
        Decision::Failed(blame) => {
            let why = match (blame.cause, blame.component) {
                (Some(cause), _) => {
                    let (cause, signals) = shared(knowledge, cause);
                    Reason::SharedExplainsBest { cause, signals }
                }
                (None, Component::Relation(relation)) => {
                    Reason::RelationBroken { relation: knowledge.relations()[relation].name.clone() }
                }
                _ => Reason::MostProbable,
            };
            accused(scene, EventKind::Failed, blame, why.into())
        }
        Decision::Suspected(blame, choice) => {
            let subject = |component: &Component| Subject::of(knowledge, *component);
            let mut why = Reasons::from(match choice.len() {
                0 => Reason::MayBeChance,
                1 => Reason::Undecided,
                _ => Reason::AnyOf { choices: choice.iter().map(subject).collect() },
            });
            if let Some(cause) = blame.cause {
                let (cause, signals) = shared(knowledge, cause);
                why = why.then(Joint::Next, Reason::ByShared { cause, signals });
            }
            accused(scene, EventKind::Suspected, blame, why)
        }
        Decision::Cleared(component) => restored(scene, *component, Reason::AllAgree),
        Decision::RuledOut(component) => restored(scene, *component, Reason::OthersExplain),
        &Decision::Recovered(signal, lasted, proof) => {
            let because = match proof {
                Proof::Witness => Reason::WitnessesAgree { lasted },
                Proof::Return => Reason::CameBack { lasted },
                Proof::Start => Reason::StartedAnew { lasted },
            };
            restored(scene, Component::Signal(signal), because)
        }
        &Decision::Unproven(component, lasted) => {
            event(knowledge, EventKind::Suspected, component, Reason::NothingEitherWay { lasted }, now)
        }
        Decision::Contradicted(component) => {
            let because = disagreements(scene, *component).then(Joint::Next, Reason::ContradictedAgain);
            event(knowledge, EventKind::Suspected, *component, because, now)
        }
    }
}

fn restored(scene: &Scene<'_>, component: Component, because: Reason) -> Event {
    event(scene.knowledge, EventKind::Restored, component, because, scene.now)
}

fn accused(scene: &Scene<'_>, kind: EventKind, blame: &Blame, why: Reasons) -> Event {
    let &Scene { knowledge, monitor, now, .. } = scene;
    let symptom = match blame.component {
        Component::Signal(signal) => Some((signal, scene.symptom(signal))),
        Component::Relation(_) | Component::Cause(_) => None,
    };
    let mut because = disagreements(scene, blame.component);
    if because.is_empty() {
        because = Reason::NoDisagreement.into();
    }
    if let Some(traits) = symptom.and_then(|(signal, symptom)| traits(monitor, signal, symptom, now)) {
        because = because.then(Joint::Next, traits);
    }
    let against = || scene.against(blame.component).into_iter();
    let unit = symptom.and_then(|(signal, _)| right_unit(knowledge, monitor, against(), signal));
    because = unit.into_iter().fold(because, |because, unit| because.then(Joint::Next, unit));
    because = because.then(Joint::Next, why).then(Joint::Next, probability(knowledge, blame));
    if blame.relapses > 0 {
        because = because.then(Joint::Next, Reason::Intermittent { times: blame.relapses.into() });
    }
    let about = event(knowledge, kind, blame.component, because, now);
    let symptom = symptom.map(|(_, symptom)| symptom);
    Event { symptom, cause: blame.cause, probability: blame.probability, ..about }
}

/// Probabilities below this are not reported.
const LEAST_REPORTED: f64 = 0.0005;

fn probability(knowledge: &KnowledgeBase, blame: &Blame) -> Reason {
    match (blame.probability.map(Probability), &blame.next) {
        (Some(own), Some((next, other))) if *other >= LEAST_REPORTED => Reason::ProbabilityAndNext {
            own,
            next: Subject::of(knowledge, *next),
            other: Probability(*other),
        },
        (Some(own), _) => Reason::Probability { own },
        (None, _) => Reason::TooManyPossibilities,
    }
}

/// The name of a common cause, and those of the signals that share it, in file order.
fn shared(knowledge: &KnowledgeBase, cause: CauseId) -> (String, Vec<String>) {
    let cause = &knowledge.causes()[cause];
    let signals: SignalSet = cause.signals.iter().copied().collect();
    let names = signals.iter().map(|signal| knowledge.signals()[signal].name.clone());
    (cause.name.clone(), names.collect())
}

/// What makes a symptom, where the disagreements do not show it.
fn traits(monitor: &Monitor, signal: SignalId, symptom: Symptom, now: Time) -> Option<Reason> {
    match symptom {
        Symptom::Frozen => Some(Reason::SaidTheSame { lasted: now - monitor.frozen(signal).since() }),
        Symptom::Skewed => {
            let late = monitor.skew(signal, now)?;
            let by = Span(late.0.abs());
            Some(if late.0 < 0 { Reason::SeemsEarly { by } } else { Reason::SeemsLate { by } })
        }
        Symptom::Noisy => Some(Reason::Scatters),
        Symptom::Drifting => Some(Reason::BuiltUp),
        _ => None,
    }
}

/// The event of a component that the operator vouches for; for a signal, perhaps because of a cleared common cause.
pub(super) fn cleared_by_operator(
    knowledge: &KnowledgeBase,
    component: Component,
    cause: Option<CauseId>,
    now: Time,
) -> Event {
    let because = match cause {
        Some(cause) => Reason::ClearedWith { cause: knowledge.causes()[cause].name.clone() },
        None => Reason::Cleared,
    };
    Event { cause, ..event(knowledge, EventKind::Restored, component, because, now) }
}

/// An accusation, as an event has reported it.
pub(super) fn accusation(knowledge: &KnowledgeBase, event: &Event) -> Accusation {
    Accusation {
        since: event.time,
        symptom: event.symptom,
        cause: event.cause.map(|cause| knowledge.causes()[cause].name.clone()),
        probability: event.probability,
        because: event.because.clone(),
    }
}

/// The event of an order or remembered state that cannot be followed, or not any more.
pub(super) fn refused(because: Reasons, now: Time) -> Event {
    Event::new(now, EventKind::Refused, None, because)
}

/// The event of a component that was accused before the knowledge base changed, and is no longer accused.
pub(super) fn judged_anew(
    knowledge: &KnowledgeBase,
    component: Component,
    is_described_anew: bool,
    now: Time,
) -> Event {
    let because = match is_described_anew {
        true => Reason::DescribedAnew,
        false => Reason::ComparisonsGone,
    };
    event(knowledge, EventKind::Restored, component, because, now)
}

/// The disagreements that speak against a signal or relation.
fn disagreements(scene: &Scene<'_>, about: Component) -> Reasons {
    let against = scene.against(about);
    let named = against.iter().take(MOST_NAMED);
    let named = named.filter_map(|pair| disagreement(scene.knowledge, scene.monitor, pair, scene.now));
    let named = named.fold(Reasons::default(), |all, reason| all.then(Joint::Next, reason));
    match against.len().saturating_sub(MOST_NAMED) {
        0 => named,
        more => named.then(Joint::Next, Reason::MoreDisagreements { count: more as u64 }),
    }
}

fn disagreement(knowledge: &KnowledgeBase, monitor: &Monitor, pair: &Residual, now: Time) -> Option<Reason> {
    let (way, other) = (monitor.way(pair.way)?, monitor.way(pair.other)?);
    let variable = way.variable();
    let named = [way, other].map(|way| way.computation.way().describe(knowledge));
    if pair.window.residual_state(now) != ResidualState::Conflict {
        return Some(together(knowledge, variable, pair, named));
    }
    let last = pair.disagreement?;
    let (bad, of) = pair.window.counts();
    if let Some(violated) = violated(knowledge, [way, other], variable, pair) {
        return Some(violated);
    }
    let [one, other] = named;
    Some(Reason::Disagree {
        one,
        value: Range::of(knowledge, variable, last.value),
        other,
        expected: Range::of(knowledge, variable, last.other),
        bad: bad.into(),
        of: of.into(),
    })
}

/// The violation of a specification, where a variable is its verdict.
fn violated(
    knowledge: &KnowledgeBase,
    ways: [&WatchedWay; 2],
    variable: VariableId,
    pair: &Residual,
) -> Option<Reason> {
    let specification = knowledge.specifications().iter().find(|it| it.variable == variable)?;
    let observed = ways.into_iter().find(|way| !way.rests_on.is_empty())?;
    let signals = observed.rests_on.iter().map(|signal| knowledge.signals()[signal].name.as_str());
    let (bad, of) = pair.window.counts();
    Some(Reason::Violated {
        specification: knowledge.variables()[variable].name.clone(),
        text: knowledge.relations()[specification.verdict].text.clone(),
        signals: signals.collect::<Vec<_>>().join(", "),
        bad: bad.into(),
        of: of.into(),
    })
}

/// What the comparisons of a pair say together while each of them agrees.
fn together(
    knowledge: &KnowledgeBase,
    variable: VariableId,
    pair: &Residual,
    [one, other]: [String; 2],
) -> Reason {
    match pair.trend.tendency() {
        Tendency::Drift => {
            let mean = pair.trend.mean();
            let (more, less) = if mean < 0.0 { (other, one) } else { (one, other) };
            Reason::SaysMore { more, by: Amount::of(knowledge, variable, mean.abs()), less }
        }
        Tendency::Noise => Reason::Scatter { one, other },
        Tendency::Skew => Reason::OtherTimes { one, other },
        Tendency::Calm | Tendency::Building => Reason::Disagreed { one, other },
    }
}
