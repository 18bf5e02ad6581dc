//! Repeats a run and keeps the evidence about the asked signal at each decision.

use super::question::Question;
use crate::events::is_accusation;
use crate::{ReportError, Source};
use shsa_core::engine::{Event, Evidence, NeedStatus, Options};
use shsa_core::knowledge::{KnowledgeBase, NeedId};
use shsa_core::time::{Span, Time};
use shsa_format::drive::{Given, Run};
use shsa_format::text::counted;

/// A given time was read from the output, which rounds to this.
const ROUNDING: Span = Span::from_millis(1);

/// The engine's evidence about the signal at a moment.
pub(super) struct Snapshot {
    /// The index of the decision before it, among the run's events.
    pub(super) event: Option<usize>,
    /// The number of the era whose knowledge base the ids belong to.
    pub(super) era: usize,
    pub(super) evidence: Evidence,
    pub(super) needs: Vec<(NeedId, NeedStatus)>,
}

impl Snapshot {
    /// The snapshot of a signal at a moment; `None` if the present model lacks the signal.
    fn take(run: &Run, signal: &str, at: Time, event: Option<usize>) -> Option<Snapshot> {
        let id = run.engine.knowledge().signal(signal)?;
        let evidence = run.engine.evidence(id, at);
        Some(Snapshot { event, era: run.past.len(), evidence, needs: run.engine.need_statuses().collect() })
    }
}

/// The results about a signal: the whole run, and the evidence at the decisions.
pub struct Inquiry {
    pub(super) run: Run,
    /// The asked signal.
    pub(super) signal: String,
    /// The explained snapshot: of a decision, or of a moment without one.
    pub(super) focus: Snapshot,
    /// The asked moment, if a decision before it is explained.
    pub(super) later: Option<Snapshot>,
    /// The snapshot at the end of the run.
    pub(super) end: Option<Snapshot>,
}

/// Observes a run.
struct Onlooker<'q> {
    question: &'q Question,
    /// The signal, once it is known.
    signal: Option<String>,
    /// The number of events taken in.
    seen: usize,
    snapshots: Vec<Snapshot>,
    moment: Option<Snapshot>,
}

impl Onlooker<'_> {
    fn look(&mut self, run: &Run) {
        for number in self.seen..run.events.len() {
            self.seen = number + 1;
            self.observe(run, number);
        }
        let Question::Signal { name, at: Some(at) } = self.question else { return };
        let at = run.first + *at;
        if self.moment.is_none() && run.last > at {
            self.moment = Snapshot::take(run, name, at, None);
        }
    }

    fn observe(&mut self, run: &Run, number: usize) {
        if *self.question == Question::Decision(number + 1) {
            self.signal = blamed(run, number);
        }
        let (Some(signal), Some(event)) = (&self.signal, run.events.get(number)) else { return };
        let known = described(run, number);
        if is_about(known, event, signal) || *self.question == Question::Decision(number + 1) {
            self.snapshots.extend(Snapshot::take(run, signal, event.time, Some(number)));
        }
    }
}

/// The knowledge base of an event.
fn described(run: &Run, number: usize) -> &KnowledgeBase {
    run.events_with_models().nth(number).map_or(run.engine.knowledge(), |(known, _)| known)
}

/// Whether an event is about a signal.
pub(super) fn is_about(known: &KnowledgeBase, event: &Event, signal: &str) -> bool {
    event.signal.is_some_and(|id| known.signals()[id].name == signal)
}

/// The signal of a decision; for a decision about a need, the signal of the last decision before it.
fn blamed(run: &Run, number: usize) -> Option<String> {
    let name = |(known, event): (&KnowledgeBase, &Event)| {
        event.signal.map(|signal| known.signals()[signal].name.clone())
    };
    run.events_with_models().take(number + 1).filter_map(name).last()
}

/// Drives a run to its end, and answers the question; `progress` is called with every input.
///
/// # Errors
/// When all decisions are asked about, there is no such decision, the run ends before the asked time, or the model lacks the signal
/// then.
pub fn inquire(
    source: &Source,
    question: &Question,
    mut progress: impl FnMut(&Given<'_>),
) -> Result<Inquiry, ReportError> {
    let signal = match question {
        Question::Signal { name, .. } => Some(name.clone()),
        Question::All | Question::Decision(_) => None,
    };
    let mut onlooker = Onlooker { question, signal, seen: 0, snapshots: Vec::new(), moment: None };
    let run = Run::of(&source.eras, source.span, Options::default(), |run, given: Given<'_>| {
        progress(&given);
        run.give(given);
        onlooker.look(run);
        Ok::<(), ReportError>(())
    })?;
    let Onlooker { signal, snapshots, moment, .. } = onlooker;
    let signal = signal.ok_or_else(|| no_signal(&run, question))?;
    let end = Snapshot::take(&run, &signal, run.last, None);
    let (focus, later) = match question {
        Question::Signal { at: Some(at), .. } => at_time(&run, *at, snapshots, moment)?,
        Question::Decision(number) => {
            (snapshots.into_iter().find(|each| each.event == Some(*number - 1)), None)
        }
        Question::Signal { .. } | Question::All => (first(&run, snapshots), None),
    };
    let focus = focus.or_else(|| Snapshot::take(&run, &signal, run.last, None));
    let Some(focus) = focus else { return Err(ReportError::NoSignal(signal)) };
    Ok(Inquiry { run, signal, focus, later, end })
}

fn no_signal(run: &Run, question: &Question) -> ReportError {
    match question {
        Question::Decision(number) if (1..=run.events.len()).contains(number) => {
            ReportError::OnlyNeeds(*number)
        }
        Question::Decision(number) => {
            ReportError::NoDecision { number: *number, decisions: counted(run.events.len(), "decision") }
        }
        Question::Signal { .. } | Question::All => ReportError::NoSubject,
    }
}

/// The first accusation.
fn first(run: &Run, snapshots: Vec<Snapshot>) -> Option<Snapshot> {
    let accuses = |each: &Snapshot| event(run, each).is_some_and(is_accusation);
    snapshots.into_iter().find(accuses)
}

fn event<'r>(run: &'r Run, snapshot: &Snapshot) -> Option<&'r Event> {
    snapshot.event.and_then(|number| run.events.get(number))
}

/// The decision in force at a time with the evidence at that time, or only the evidence if no decision is in force.
fn at_time(
    run: &Run,
    at: Span,
    mut snapshots: Vec<Snapshot>,
    moment: Option<Snapshot>,
) -> Result<(Option<Snapshot>, Option<Snapshot>), ReportError> {
    let time = run.first + at;
    if time > run.last + ROUNDING {
        return Err(ReportError::Ended { end_s: (run.last - run.first).seconds(), at_s: at.seconds() });
    }
    let until = |each: &Snapshot| event(run, each).is_some_and(|event| event.time <= time + ROUNDING);
    let standing = snapshots.iter().rposition(until);
    let stands = |each: &Snapshot| {
        event(run, each).is_some_and(|event| {
            is_accusation(event) || (event.signal.is_some() && time - event.time <= ROUNDING)
        })
    };
    let standing = standing.map(|place| snapshots.swap_remove(place)).filter(stands);
    Ok(match standing {
        None => (moment, None),
        Some(decision) => {
            let is_same = event(run, &decision).is_some_and(|event| (time - event.time).abs() <= ROUNDING);
            (Some(decision), moment.filter(|_| !is_same))
        }
    })
}
