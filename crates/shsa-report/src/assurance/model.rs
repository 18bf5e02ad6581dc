//! What the contracts of a model allow.

use super::claim::{self, Claim};
use super::{WrittenMoment, json, page, text};
use crate::{ReportError, Style};
use serde_json::Value;
use shsa_core::analysis::{Candidacy, Prospect};
use shsa_core::assurance::{Assessment, Assurance, Evaluation, EvidenceId, Lacking, Leaf, Verdict};
use shsa_core::interval::Truth;
use shsa_core::knowledge::KnowledgeBase;
use shsa_core::plan::Graph;
use shsa_core::statement::Level;
use shsa_drawing::case::words;
use shsa_format::moment::{Measured, Moment};

/// The most evaluations for one question about minimal sets.
const MOST_EVALUATIONS: usize = 2_000;

/// What the contracts of a model allow: all needs with demands.
///
/// # Example
/// ```
/// use shsa_report::{Style, assurance::ModelReport};
///
/// let text = std::fs::read_to_string("../../models/stop.yaml")?;
/// let knowledge = shsa_model::load(&text, "stop.yaml").knowledge;
/// let report = ModelReport::new(&knowledge, "stop.yaml".to_owned(), None)?;
/// assert!(report.is_given());
/// assert!(report.text(Style::PLAIN).contains("given at SIL 2"));
/// assert_eq!(report.json()["given"], true);
/// assert_eq!(report.claims().len(), 1);
/// assert!(report.page().starts_with("<!DOCTYPE html>"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct ModelReport<'a> {
    pub(super) knowledge: &'a KnowledgeBase,
    pub(super) title: String,
    pub(super) needs: Vec<Need>,
    /// Whether the report is about one moment; else all evidence holds.
    pub(super) is_moment: bool,
}

/// A need, with the assessments of its ways.
pub(super) struct Need {
    pub(super) name: String,
    pub(super) prospect: Prospect,
    /// The evaluation and assessment of each way.
    pub(super) now: Vec<(Evaluation, Assessment)>,
    /// The index of the best admissible way.
    pub(super) served: Option<usize>,
}

impl<'a> ModelReport<'a> {
    /// The report of a model; `title` is the name of its file. Without a moment, all evidence is as it should be.
    ///
    /// # Errors
    /// When the moment names unknown evidence, or no need of the model demands anything.
    pub fn new(
        knowledge: &'a KnowledgeBase,
        title: String,
        moment: Option<&WrittenMoment>,
    ) -> Result<ModelReport<'a>, ReportError> {
        let rows = knowledge.contracts().rows();
        let known: Vec<(&str, &str)> = rows
            .iter()
            .flat_map(|row| row.evidence.iter().map(|watched| (row.name.as_str(), watched.name.as_str())))
            .collect();
        if let Some(written) = moment {
            written.check(&known)?;
        }
        let assurance = Assurance::new(knowledge).ok_or(ReportError::NothingDemanded)?;
        let graph = Graph::new(knowledge);
        let demanding = knowledge.needs().ids().filter(|&need| assurance.demands(need));
        let needs = demanding.map(|need| {
            let prospect = Prospect::new(knowledge, &assurance, &graph, need);
            Need::new(knowledge, prospect, moment.map(|written| &written.moment))
        });
        Ok(ModelReport { knowledge, title, needs: needs.collect(), is_moment: moment.is_some() })
    }

    /// For each need: who serves it at which level, how each way stands and what it lacks, and what each loss takes.
    #[must_use]
    pub fn text(&self, style: Style) -> String {
        text::text(self, style)
    }

    /// One object.
    #[must_use]
    pub fn json(&self) -> Value {
        json::json(self)
    }

    /// A page for the browser, with the assurance cases.
    #[must_use]
    pub fn page(&self) -> String {
        page::page(self)
    }

    /// Whether every need gets what it asks.
    #[must_use]
    pub fn is_given(&self) -> bool {
        self.needs.iter().all(|need| need.served.is_some())
    }

    /// A claim for each need: of the way that serves it, else of the first one.
    #[must_use]
    pub fn claims(&self) -> Vec<Claim<'_>> {
        self.needs.iter().filter_map(|need| self.claim(need)).collect()
    }

    /// The module of GSN over those of all claims.
    #[must_use]
    pub fn index(&self) -> String {
        claim::index(&self.claims(), &format!("{}, {}", self.title, self.when()))
    }

    pub(super) fn when(&self) -> &'static str {
        if self.is_moment { "with the evidence of one moment" } else { "with all evidence as it should be" }
    }

    pub(super) fn claim<'n>(&self, need: &'n Need) -> Option<Claim<'n>> {
        let at = need.served.unwrap_or(0);
        let (candidacy, (evaluation, assessment)) = (need.prospect.ways.get(at)?, need.now.get(at)?);
        let root = assessment.guarantee.or(candidacy.composition.roots().last().copied())?;
        let (by, when) = (candidacy.way.describe(self.knowledge), self.when());
        Some(Claim {
            name: need.name.clone(),
            of: need.name.clone(),
            brief: format!("{}: {} from {by}, {when}", self.title, need.name),
            system: candidacy.composition.system(),
            evaluation: evaluation.clone(),
            root,
            observed: self.observed(candidacy),
        })
    }

    /// Describes the pieces of evidence of a way, by their numbers.
    pub(super) fn observed(&self, candidacy: &Candidacy) -> Vec<String> {
        words::observed(self.knowledge, &candidacy.composition)
    }

    /// The name of a piece of evidence, and of its service.
    pub(super) fn evidence(&self, candidacy: &Candidacy, id: EvidenceId) -> String {
        let certificates = candidacy.composition.system().certificates();
        let row = &certificates.evidence[id];
        format!("{} of {}", row.name, certificates.services[row.service].name)
    }

    pub(super) fn level(&self, level: Option<Level>) -> Option<String> {
        level.map(|level| self.knowledge.contracts().scales().written(level))
    }

    /// The name of the guarantee in force, if a way has several.
    pub(super) fn mode(&self, candidacy: &Candidacy, assessment: &Assessment) -> Option<String> {
        let rows = &candidacy.composition.system().certificates().guarantees;
        assessment.guarantee.map(|id| rows[id].name.clone())
    }
}

impl Need {
    fn new(knowledge: &KnowledgeBase, prospect: Prospect, moment: Option<&Moment>) -> Need {
        let evaluated = |candidacy: &Candidacy| {
            let composition = &candidacy.composition;
            let evaluation = match moment {
                Some(moment) => composition.supposing(|id| said(knowledge, candidacy, id, moment)),
                None => composition.supposing(|_| Truth::True),
            };
            let assessment = composition.assess(&evaluation);
            (evaluation, assessment)
        };
        let now: Vec<_> = prospect.ways.iter().map(evaluated).collect();
        let served = now.iter().position(|(_, assessment)| assessment.verdict == Verdict::Holds);
        Need { name: knowledge.need_name(prospect.need).to_owned(), prospect, now, served }
    }

    /// The minimal sets of leaves that would have to change for a way to be admissible.
    pub(super) fn why(&self, at: usize) -> Vec<Vec<Lacking>> {
        let (Some(candidacy), Some((evaluation, assessment))) =
            (self.prospect.ways.get(at), self.now.get(at))
        else {
            return Vec::new();
        };
        match assessment.verdict {
            Verdict::Holds => Vec::new(),
            _ => candidacy.composition.why(evaluation, MOST_EVALUATIONS),
        }
    }
}

/// The truth of a piece of evidence at a moment.
fn said(knowledge: &KnowledgeBase, candidacy: &Candidacy, id: EvidenceId, moment: &Moment) -> Truth {
    let composition = &candidacy.composition;
    let found = composition.evidence(knowledge).find(|(own, ..)| *own == id);
    let Some((_, contract, watched)) = found else { return Truth::Unknown };
    match moment.of(&knowledge.contracts().rows()[contract].name, &watched.name) {
        None => Truth::Unknown,
        Some(Measured::Truth(truth)) => truth,
        Some(Measured::Number(number)) => composition.system().certificates().evidence[id].truth(number),
    }
}

/// Describes a leaf.
pub(super) fn lacking(leaf: &Lacking) -> String {
    match leaf.leaf {
        Leaf::Demand(_) => format!("{} that {} asks", leaf.name, leaf.subject),
        Leaf::Evidence(_) => format!("{} of {}", leaf.name, leaf.subject),
    }
}
