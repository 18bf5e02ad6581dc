//! Why a signal was suspected: the decision, the evidence against the signal and for it, the rivals, what would have cleared the
//! signal, and the consequences.

mod question;
mod inquiry;
mod wording;
mod rivals;
mod aftermath;
mod tracks;
mod chart;
mod text;
mod json;
mod page;

pub use inquiry::{Inquiry, inquire};
pub use question::Question;

pub(crate) use page::list as listed_items;

use crate::events::is_accusation;
use crate::{Source, Style};
use inquiry::Snapshot;
use serde_json::Value;
use shsa_core::engine::{Comparison, Event, EventKind, Evidence};
use shsa_core::knowledge::KnowledgeBase;
use shsa_core::monitor::{ResidualState, Symptom};
use shsa_core::time::{Span, Time};
use shsa_core::trust::Verdict;
use shsa_drawing::Timeline;
use shsa_format::drive::Run;
use shsa_format::event;
use shsa_format::text::counted;
use shsa_format::words;
use wording::{Words, listed};

/// The most comparisons in a section, and the most later events.
const MOST_LISTED: usize = 12;

/// A part of the answer.
pub(crate) struct Section {
    pub(crate) title: &'static str,
    pub(crate) items: Vec<Item>,
}

/// A statement with its evidence.
pub(crate) struct Item {
    pub(crate) text: String,
    pub(crate) notes: Vec<String>,
}

/// The evidence about a signal at a moment, with the names of its model.
struct EvidenceInWords<'a> {
    signal: &'a str,
    words: Words<'a>,
    evidence: &'a Evidence,
    /// The decision; `None` when a moment without one is explained.
    event: Option<&'a Event>,
}

/// An inquiry with the names of its model.
///
/// # Example
/// ```
/// use shsa_report::explanation::{Explanation, Question, inquire};
/// use shsa_report::{Source, Style};
///
/// let text = std::fs::read_to_string("../../stories/02-fallback-by-value.yaml")?;
/// let story = shsa_format::story::load(&text, "02.yaml", std::path::Path::new(".")).story.expect("a story");
/// let source = Source::of_story(&story);
/// let question = Question::Signal { name: "/gnss/speed".to_owned(), at: None };
/// let inquiry = inquire(&source, &question, |_| {})?;
/// let explanation = Explanation::new(&inquiry, &source);
/// assert!(explanation.text(Style::PLAIN).starts_with("/gnss/speed was found to have failed at 20.100 s"));
/// assert_eq!(explanation.json()["decision"], "failed");
/// let drawings = explanation.drawings(&source, None, 1);
/// assert!(drawings[0].svg().starts_with("<svg"));
/// assert!(explanation.page(&drawings, "02.yaml").starts_with("<!DOCTYPE html>"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Explanation<'a> {
    inquiry: &'a Inquiry,
    about: EvidenceInWords<'a>,
}

/// All decisions of a run, numbered from 1, one line each.
#[must_use]
pub fn list_text(run: &Run, style: Style) -> String {
    text::list(run, style)
}

/// All decisions of a run as one object.
#[must_use]
pub fn list_json(run: &Run) -> Value {
    json::list(run)
}

/// The evidence about the signal of a decision, in sections; times count from `first`.
pub(crate) fn evidence_sections(
    known: &KnowledgeBase,
    first: Time,
    evidence: &Evidence,
    event: &Event,
) -> Vec<Section> {
    let words = Words { knowledge: known, first };
    let signal = words.signal(evidence.signal);
    EvidenceInWords { signal, words, evidence, event: Some(event) }.evidence_sections()
}

/// The evidence about the signal of a decision as JSON: sections with a `title` and `items`, each a `text` with `notes`. Times in the
/// texts count from `first`.
#[must_use]
pub fn evidence_json(known: &KnowledgeBase, first: Time, evidence: &Evidence, event: &Event) -> Value {
    let item = |item: Item| serde_json::json!({ "text": item.text, "notes": item.notes });
    let section = |section: Section| {
        let items: Vec<Value> = section.items.into_iter().map(item).collect();
        serde_json::json!({ "title": section.title, "items": items })
    };
    evidence_sections(known, first, evidence, event).into_iter().map(section).collect()
}

fn item(text: impl Into<String>) -> Item {
    Item { text: text.into(), notes: Vec::new() }
}

impl<'a> Explanation<'a> {
    /// The explanation of an inquiry into this source.
    #[must_use]
    pub fn new(inquiry: &'a Inquiry, source: &'a Source) -> Explanation<'a> {
        let knowledge = known(inquiry, source, &inquiry.focus);
        let words = Words { knowledge, first: inquiry.run.first };
        let event = inquiry.focus.event.and_then(|number| inquiry.run.events.get(number));
        let (signal, evidence) = (&*inquiry.signal, &inquiry.focus.evidence);
        Explanation { inquiry, about: EvidenceInWords { signal, words, evidence, event } }
    }

    /// The headline, then a paragraph for each section.
    #[must_use]
    pub fn text(&self, style: Style) -> String {
        text::text(self, style)
    }

    /// One object.
    #[must_use]
    pub fn json(&self) -> Value {
        json::object(self)
    }

    /// Repeats the run of the source, and draws the values around the explained moment: first of the variable with the most evidence
    /// against the signal, then of others with conflicts, of 4 and of `most` variables at the most. `window` is the length of the
    /// shown time; without one, as much as it takes to see the reason of the decision.
    #[must_use]
    pub fn drawings(&self, source: &Source, window: Option<Span>, most: usize) -> Vec<Timeline> {
        let mut variables = chart::variables(self.about.evidence, self.about.words.knowledge);
        variables.truncate(most);
        chart::drawings(self, source, &variables, window)
    }

    /// A page for the browser with these drawings; `model` is the name of the model's file.
    #[must_use]
    pub fn page(&self, drawings: &[Timeline], model: &str) -> String {
        page::page(self, drawings, model)
    }

    fn time(&self) -> Time {
        self.about.event.map_or(self.about.evidence.time, |event| event.time)
    }

    /// The decision or the verdict, and its time.
    fn headline(&self) -> String {
        let (signal, time) = (&self.inquiry.signal, self.about.words.time(self.time()));
        let Some(event) = self.about.event else {
            let verdict = event::verdict(self.about.evidence.absence, self.about.evidence.verdict);
            return format!("{signal} was {verdict} at {time}: no decision about it stood");
        };
        let symptom = event.symptom.filter(|symptom| *symptom != Symptom::Silent);
        let symptom = symptom.map_or(String::new(), |symptom| format!(", {}", symptom.name()));
        match (event.signal, event.kind) {
            (None, kind) => {
                let need = event
                    .variable
                    .map_or("", |variable| &self.about.words.knowledge.variables()[variable].name);
                format!("{need} was {} at {time}, after what was decided about {signal}", kind.name())
            }
            (_, EventKind::Suspected) => format!("{signal} was suspected at {time}{symptom}"),
            (_, EventKind::Failed) => format!("{signal} was found to have failed at {time}{symptom}"),
            (_, EventKind::Silent) => format!("{signal} fell silent at {time}"),
            (_, EventKind::Restored) => format!("{signal} was trusted again at {time}"),
            (_, kind) => format!("{signal}: {} at {time}", kind.name()),
        }
    }

    fn sections(&self) -> Vec<Section> {
        let mut sections = self.about.evidence_sections();
        sections.push(Section { title: "What followed", items: self.aftermath() });
        sections.push(Section { title: "The needs", items: self.needs() });
        sections.retain(|section| !section.items.is_empty());
        sections
    }
}

impl<'a> EvidenceInWords<'a> {
    /// The evidence of the witnesses, and the rivals.
    fn evidence_sections(&self) -> Vec<Section> {
        let mut sections = vec![
            Section { title: "In plain words", items: self.plain() },
            Section { title: "Evidence against it", items: self.compared(Bearing::Against) },
            Section { title: "Evidence for it", items: self.compared(Bearing::For) },
            Section { title: "Comparisons that are no evidence", items: self.compared(Bearing::None) },
        ];
        if self.is_accused() {
            sections.push(Section { title: "Other candidates", items: self.rivals() });
            let items = self.would_clear().into_iter().map(item).collect();
            sections.push(Section { title: "What would have cleared it", items });
        }
        sections.retain(|section| !section.items.is_empty());
        sections
    }

    fn is_accused(&self) -> bool {
        self.event.is_some_and(is_accusation)
    }

    fn conflicts(&self) -> impl Iterator<Item = &'a Comparison> {
        self.evidence.comparisons.iter().filter(|each| each.is_conflict())
    }

    fn supports(&self) -> impl Iterator<Item = &'a Comparison> {
        self.evidence.comparisons.iter().filter(|each| each.is_support())
    }

    fn plain(&self) -> Vec<Item> {
        let all = self.evidence.comparisons.len();
        let (against, support) = (self.conflicts().count(), self.supports().count());
        let signal = self.signal;
        let parts = match all {
            0 => {
                format!(
                    "No comparison is evidence about {signal}: no other way in the model gives its variable."
                )
            }
            _ => format!(
                "Of {} that {signal} is part of, {against} are evidence against it and {support} for it.",
                counted(all, "comparison")
            ),
        };
        let mut items = vec![item(parts)];
        items.extend(self.reason().map(item));
        if let Some(event) = self.event {
            items.push(item(format!("The engine said: {}.", words::reasons(&event.because))));
        }
        items
    }

    /// Why the verdict follows.
    fn reason(&self) -> Option<String> {
        let signal = self.signal;
        let undistinguished: Vec<&str> =
            self.undistinguished().iter().map(|rival| self.words.signal(rival.signal)).collect();
        let is_compared = self.conflicts().next().is_some();
        match (
            self.event.filter(|event| event.signal.is_some()).map(|event| event.kind),
            self.evidence.verdict,
        ) {
            (Some(EventKind::Failed), _) if is_compared && undistinguished.is_empty() => {
                Some(format!("Of all signals in these disagreements, {signal} alone is part of each."))
            }
            (Some(EventKind::Suspected), _) if !undistinguished.is_empty() => Some(format!(
                "No evidence distinguishes it from {}, so it is only suspected.",
                listed(&undistinguished)
            )),
            (None, Verdict::Unknown) => {
                Some("No independent witness has evidence about it: unknown is not healthy.".to_owned())
            }
            (None, Verdict::Healthy) => Some(
                "At least one independent witness agreed with it, and nothing disagreed enough to count."
                    .to_owned(),
            ),
            _ => None,
        }
    }

    fn compared(&self, bearing: Bearing) -> Vec<Item> {
        let chosen: Vec<&Comparison> =
            self.evidence.comparisons.iter().filter(|each| Bearing::of(each) == bearing).collect();
        let mut items: Vec<Item> = chosen
            .iter()
            .take(MOST_LISTED)
            .map(|each| {
                let notes = match bearing {
                    Bearing::None => vec![self.words.why_silent(each, self.evidence.time)],
                    _ => [self.words.counted(each)].into_iter().chain(self.words.rests_on(each)).collect(),
                };
                Item { text: self.words.comparison(each), notes }
            })
            .collect();
        if chosen.len() > MOST_LISTED {
            items.push(item(format!("and {} more", counted(chosen.len() - MOST_LISTED, "comparison"))));
        }
        items
    }
}

/// The knowledge base of a snapshot's ids.
fn known<'a>(inquiry: &'a Inquiry, source: &'a Source, snapshot: &Snapshot) -> &'a KnowledgeBase {
    source.eras.get(snapshot.era).map_or(inquiry.run.engine.knowledge(), |era| &era.knowledge)
}

/// The side for which a comparison is evidence.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Bearing {
    Against,
    For,
    None,
}

impl Bearing {
    fn of(comparison: &Comparison) -> Bearing {
        match comparison.residual_state {
            _ if !comparison.explained_by.is_empty() => Bearing::None,
            ResidualState::Conflict | ResidualState::Undecided => Bearing::Against,
            ResidualState::Agree if comparison.bears_witness => Bearing::For,
            ResidualState::Agree | ResidualState::Unknown => Bearing::None,
        }
    }
}
