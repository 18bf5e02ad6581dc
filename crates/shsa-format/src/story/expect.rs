//! The expectations of a story and their checks.

use super::change;
use super::curve::Curve;
use crate::drive::Run;
use crate::words;
use shsa_core::assurance::Ground;
use shsa_core::engine::{Engine, Event, EventKind, Publication, PublishedValue, Quality};
use shsa_core::knowledge::{KnowledgeBase, NeedId, SignalId, Variable, VariableId};
use shsa_core::monitor::Symptom;
use shsa_core::statement::{Level, Scales};
use shsa_core::time::{Span, Time};
use shsa_core::trust::Verdict;
use shsa_core::unit::Unit;

/// A stretch of time, both ends included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Between {
    pub(super) from: Time,
    pub(super) to: Time,
}

impl Between {
    fn contains(self, time: Time) -> bool {
        self.from <= time && time <= self.to
    }
}

/// The required number of events.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Times {
    AtLeastOnce,
    Exactly(usize),
}

/// An expectation of a story.
#[derive(Clone, Debug)]
pub(super) enum Expectation {
    /// Events of a kind, or of any kind.
    Events {
        kind: Option<EventKind>,
        signal: Option<SignalId>,
        variable: Option<VariableId>,
        need: Option<NeedId>,
        symptom: Option<Symptom>,
        /// Texts that the reason contains.
        because: Vec<String>,
        /// Texts that the description of the source contains.
        substitution: Vec<String>,
        between: Between,
        times: Times,
    },
    /// The verdict on a signal.
    Verdict { signal: SignalId, verdict: Verdict, at: Time },
    /// The source of a need: texts that its description contains; `None` when no source may serve the need.
    Source { need: NeedId, source: Option<Vec<String>>, at: Time },
    /// Limits of the published values.
    Values { need: NeedId, between: Between, limits: Vec<Limit> },
}

/// A limit of published values; amounts are in the unit of the need's variable.
#[derive(Clone, Debug)]
pub(super) enum Limit {
    /// No value is published.
    None,
    /// The largest time between two values, and between values and the ends of the stretch.
    LongestGap(Span),
    /// The largest difference between the midpoints of two successive values.
    LargestJump(f64),
    /// The largest distance of a midpoint from the true value at the time of publication.
    LargestError(f64, Box<Curve>),
    /// The largest width of a value.
    LargestWidth(f64),
    /// The quality that all values have.
    Quality(Quality),
    /// All values are given at this level; `None` at none.
    Level(Option<Level>),
    /// All values are let out by contracts on this ground.
    Admitted(Ground),
}

/// The results of a run that expectations are compared with.
pub(super) struct Evidence<'a> {
    pub(super) knowledge: &'a KnowledgeBase,
    pub(super) run: &'a Run,
    /// What the expectations that look at a moment saw.
    pub(super) seen: Vec<Option<String>>,
}

impl Expectation {
    /// The moment at which the expectation looks at the engine.
    pub(super) fn moment(&self) -> Option<Time> {
        match self {
            Expectation::Verdict { at, .. } | Expectation::Source { at, .. } => Some(*at),
            Expectation::Events { .. } | Expectation::Values { .. } => None,
        }
    }

    /// The observed state of the engine at the moment, in words; its ids are those of `own`.
    pub(super) fn look(&self, own: &KnowledgeBase, engine: &Engine) -> Option<String> {
        let known = engine.knowledge();
        match self {
            Expectation::Verdict { signal, .. } => {
                let signal = change::signal(own, *signal, known);
                let verdict = signal.map(|signal| verdict_name(engine.verdict(signal)));
                Some(verdict.unwrap_or("no such signal").to_owned())
            }
            Expectation::Source { need, .. } => {
                let status = engine.need_status(change::need(own, *need, known)?);
                status.source.as_ref().map(words::served_by)
            }
            Expectation::Events { .. } | Expectation::Values { .. } => None,
        }
    }

    /// Whether the expectation is met, and the observed result.
    pub(super) fn check(&self, at: usize, evidence: &Evidence<'_>) -> (bool, String) {
        let seen = evidence.seen.get(at).cloned().flatten();
        match self {
            Expectation::Events { between, times, .. } => self.check_events(evidence, *between, *times),
            Expectation::Verdict { verdict, .. } => {
                let found = seen.unwrap_or_default();
                (found == verdict_name(*verdict), found)
            }
            Expectation::Source { source, .. } => {
                let met = match (source, &seen) {
                    (Some(texts), Some(found)) => holds_all(|| found.clone(), texts),
                    (None, None) => true,
                    _ => false,
                };
                (met, seen.unwrap_or_else(|| "nothing".to_owned()))
            }
            Expectation::Values { need, between, limits } => check_values(evidence, *need, *between, limits),
        }
    }

    fn check_events(&self, evidence: &Evidence<'_>, between: Between, times: Times) -> (bool, String) {
        let events = evidence.run.events.iter().chain(&evidence.run.outliers);
        let found: Vec<&Event> = events.filter(|event| self.fits(event)).collect();
        let inside = found.iter().filter(|event| between.contains(event.time)).count();
        let met = match times {
            Times::AtLeastOnce => inside > 0,
            Times::Exactly(times) => inside == times,
        };
        let shown: Vec<String> = found.iter().map(|event| headline(evidence.knowledge, event)).collect();
        (met, if shown.is_empty() { "no such event".to_owned() } else { shown.join(", ") })
    }

    /// Whether an event is of this kind, or a decision of any, at any time.
    fn fits(&self, event: &Event) -> bool {
        let Expectation::Events { kind, signal, variable, need, symptom, because, substitution, .. } = self
        else {
            return false;
        };
        kind.map_or(event.kind.is_decision(), |kind| kind == event.kind)
            && signal.is_none_or(|signal| event.signal == Some(signal))
            && variable.is_none_or(|variable| event.variable == Some(variable) && event.signal.is_none())
            && need.is_none_or(|need| event.need == Some(need))
            && symptom.is_none_or(|symptom| event.symptom == Some(symptom))
            && holds_all(|| words::reasons(&event.because), because)
            && holds_all(
                || event.substitution.as_ref().map(words::served_by).unwrap_or_default(),
                substitution,
            )
    }
}

/// Whether a text contains all parts; the text is made only when there are parts.
fn holds_all(text: impl FnOnce() -> String, parts: &[String]) -> bool {
    if parts.is_empty() {
        return true;
    }
    let text = text();
    parts.iter().all(|part| text.contains(part.as_str()))
}

fn check_values(evidence: &Evidence<'_>, need: NeedId, between: Between, limits: &[Limit]) -> (bool, String) {
    let publications = evidence.run.publications.iter();
    let values: Vec<&Publication> = publications
        .filter(|publication| publication.need == need && between.contains(publication.time))
        .collect();
    let variable = evidence.knowledge.needs()[need].variable;
    let Variable { unit, wraps, .. } = &evidence.knowledge.variables()[variable];
    let turn = wraps.map(|turn| unit.as_ref().map_or(turn, |unit| turn / unit.to_si_difference(1.0)));
    let shown = |value: f64| unit.as_ref().map_or(value, |unit| unit.from_si(value));
    let middles: Vec<(Time, f64)> = values.iter().map(|value| (value.time, shown(middle(value)))).collect();
    let mut met = true;
    let mut found = vec![format!("{} values", values.len())];
    for limit in limits {
        let (holds, text) = match limit {
            Limit::Quality(quality) => alike(&values, quality, |it| it.quality, |it| it.name().to_owned()),
            Limit::Level(level) => alike(&values, level, |it| it.admitted.level, |it| level_name(*it)),
            Limit::Admitted(ground) => {
                alike(&values, ground, |it| it.admitted.ground, |it| it.name().to_owned())
            }
            Limit::LargestWidth(limit) => {
                let scale = unit.as_ref().map_or(1.0, |unit| unit.scale);
                let widths = values.iter().map(|value| (value.time, width(value) / scale));
                largest(
                    "width",
                    widths,
                    *limit,
                    &unit.as_ref().map_or(String::new(), |unit| format!(" {unit}")),
                )
            }
            limit => limit.check(&middles, between, unit.as_ref(), turn),
        };
        met &= holds;
        found.extend(text);
    }
    (met, found.join(", "))
}

impl Limit {
    fn check(
        &self,
        middles: &[(Time, f64)],
        between: Between,
        unit: Option<&Unit>,
        turn: Option<f64>,
    ) -> (bool, Option<String>) {
        let name = unit.map_or(String::new(), |unit| format!(" {unit}"));
        match self {
            Limit::None => (middles.is_empty(), None),
            // What is asked of the values themselves, not of their middles.
            Limit::LargestWidth(_) | Limit::Quality(_) | Limit::Level(_) | Limit::Admitted(_) => (true, None),
            Limit::LongestGap(limit) => {
                let times = middles.iter().map(|(time, _)| *time);
                let times: Vec<Time> = [between.from].into_iter().chain(times).chain([between.to]).collect();
                let longest = times.windows(2).map(|two| two[1] - two[0]).max().unwrap_or(Span::ZERO);
                (longest <= *limit, Some(format!("longest gap {:.0} ms", longest.seconds() * 1e3)))
            }
            Limit::LargestJump(limit) => {
                let jumps = middles.windows(2).map(|two| (two[1].0, apart(two[1].1, two[0].1, turn)));
                largest("jump", jumps, *limit, &name)
            }
            Limit::LargestError(limit, truth) => {
                let mut truth = truth.values(unit.cloned());
                let errors = middles.iter().map(|&(time, middle)| (time, apart(middle, truth(time), turn)));
                largest("error", errors, *limit, &name)
            }
        }
    }
}

/// The distance of two values, the shorter way round where they wrap.
fn apart(one: f64, other: f64, turn: Option<f64>) -> f64 {
    let straight = (one - other).abs();
    turn.map_or(straight, |turn| (straight % turn).min(turn - straight % turn))
}

fn largest(
    what: &str,
    amounts: impl Iterator<Item = (Time, f64)>,
    limit: f64,
    unit: &str,
) -> (bool, Option<String>) {
    match amounts.max_by(|one, other| one.1.total_cmp(&other.1)) {
        Some((time, amount)) => {
            let text = format!("largest {what} {amount:.3}{unit} at {:.2} s", time.seconds());
            (amount <= limit, Some(text))
        }
        None => (false, Some(format!("no {what} to measure"))),
    }
}

/// Whether all values are alike in something, and which is the first that is not.
fn alike<T: PartialEq>(
    values: &[&Publication],
    expected: &T,
    of: impl Fn(&Publication) -> T,
    name: impl Fn(&T) -> String,
) -> (bool, Option<String>) {
    let other = values.iter().find(|value| of(value) != *expected);
    let text = other.map(|value| format!("{} at {:.2} s", name(&of(value)), value.time.seconds()));
    (other.is_none() && !values.is_empty(), text)
}

fn level_name(level: Option<Level>) -> String {
    level.map_or_else(|| "no level".to_owned(), |level| Scales::standard().written(level))
}

fn width(publication: &Publication) -> f64 {
    match &publication.value {
        PublishedValue::Scalar(value) => value.width(),
        PublishedValue::Vector(elements) => elements.iter().map(|it| it.width()).fold(0.0, f64::max),
    }
}

fn middle(publication: &Publication) -> f64 {
    match &publication.value {
        PublishedValue::Scalar(value) => value.midpoint(),
        PublishedValue::Vector(_) => f64::NAN,
    }
}

/// The names of all verdicts.
pub(super) const VERDICTS: [(&str, Verdict); 4] = [
    ("unknown", Verdict::Unknown),
    ("healthy", Verdict::Healthy),
    ("suspect", Verdict::Suspect),
    ("failed", Verdict::Failed),
];

fn verdict_name(verdict: Verdict) -> &'static str {
    VERDICTS.iter().find(|(_, known)| *known == verdict).map_or("", |(name, _)| name)
}

/// An event without its reason: `failed /a at 16.20 s`.
pub(super) fn headline(knowledge: &KnowledgeBase, event: &Event) -> String {
    let signal = event.signal.map(|signal| knowledge.signals()[signal].name.as_str());
    let variable = event.variable.map(|variable| knowledge.variables()[variable].name.as_str());
    let relation = event.relation.map(|relation| &knowledge.relations()[relation].name);
    let about = match (signal, relation) {
        (None, Some(relation)) => format!("relation {relation}"),
        _ => signal.or(variable).unwrap_or_default().to_owned(),
    };
    format!("{} {about} at {:.2} s", event.kind.name(), event.time.seconds())
}
