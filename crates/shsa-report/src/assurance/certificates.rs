//! Certificates of conserts-rs and safeTbox, composed.

use super::claim::{self, Claim};
use super::{WrittenMoment, page};
use crate::ReportError;
use crate::style::{Paint, Style};
use serde_json::{Value, json};
use shsa_core::assurance::{
    Certificates, Evaluation, EvidenceId, GuaranteeId, Leaf, ServiceId, System, Verdict,
};
use shsa_core::interval::Truth;
use shsa_drawing::case::{gsn, words};
use shsa_format::moment::Measured;
use shsa_format::text::{counted, table};

/// The most evaluations for one question about minimal sets.
const MOST_EVALUATIONS: usize = 2_000;

/// Composed certificates, with their evaluation.
///
/// # Example
/// ```
/// use shsa_foreign::conserts;
/// use shsa_report::{Style, assurance::CertificateReport};
///
/// let text = "name: brake\nguarantees:\n  - id: stops\n    description: it stops\n    dimensions: []\n";
/// let (certificates, report) = conserts::read(text, "brake.yaml");
/// let composed = conserts::compose(vec![certificates]);
/// let report = CertificateReport::new(composed, "brake.yaml".to_owned(), None)?;
/// assert_eq!(report.claims().len(), 1);
/// assert!(report.text(Style::PLAIN).starts_with("brake.yaml: 1 service"));
/// # Ok::<(), shsa_report::ReportError>(())
/// ```
pub struct CertificateReport {
    system: System,
    evaluation: Evaluation,
    title: String,
}

impl CertificateReport {
    /// The report of composed certificates; `title` names their files. Without a moment, all evidence is as it should be.
    ///
    /// # Errors
    /// When the certificates contradict themselves, or the moment names evidence that no certificate has.
    pub fn new(
        certificates: Certificates,
        title: String,
        moment: Option<&WrittenMoment>,
    ) -> Result<CertificateReport, ReportError> {
        let system = System::new(certificates)
            .map_err(|problems| ReportError::Certificates(format!("{problems:?}")))?;
        let mut evaluation = Evaluation::new(&system);
        let known: Vec<(&str, &str)> = evidence(&system).map(|(_, of, name)| (of, name)).collect();
        if let Some(written) = moment {
            written.check(&known)?;
        }
        let said: Vec<(EvidenceId, Truth)> = evidence(&system)
            .map(|(id, of, name)| match moment.map(|written| written.moment.of(of, name)) {
                None => (id, Truth::True),
                Some(None) => (id, Truth::Unknown),
                Some(Some(Measured::Truth(truth))) => (id, truth),
                Some(Some(Measured::Number(number))) => {
                    (id, system.certificates().evidence[id].truth(number))
                }
            })
            .collect();
        evaluation.set_all(&system, said.into_iter());
        Ok(CertificateReport { system, evaluation, title })
    }

    /// Whether every service with guarantees gives one of them, and every service with demands has one of them met: of several,
    /// lesser ones are alternatives to better ones.
    #[must_use]
    pub fn is_given(&self) -> bool {
        let (rows, now, system) = (self.system.certificates(), &self.evaluation, &self.system);
        let is_met = |of: ServiceId| {
            let own = rows.guarantees.enumerate().filter(|(_, row)| row.service == of);
            let given: Vec<bool> = own.map(|(id, _)| now.guarantee(system, id) == Verdict::Holds).collect();
            let own = rows.demands.enumerate().filter(|(_, row)| row.service == of);
            let asked: Vec<bool> = own.map(|(id, _)| now.demand(system, id) == Verdict::Holds).collect();
            [given, asked].iter().all(|each| each.is_empty() || each.contains(&true))
        };
        rows.services.ids().all(is_met)
    }

    /// A claim for each guarantee that meets no demand of these files.
    #[must_use]
    pub fn claims(&self) -> Vec<Claim<'_>> {
        let rows = self.system.certificates();
        let taken: Vec<GuaranteeId> = rows.demands.ids().flat_map(|id| self.system.matches(id)).collect();
        let claim = |(id, row): (GuaranteeId, &shsa_core::assurance::Guarantee)| Claim {
            name: format!("{} {}", rows.services[row.service].name, row.name),
            of: rows.services[row.service].name.clone(),
            brief: self.title.clone(),
            system: &self.system,
            evaluation: self.evaluation.clone(),
            root: id,
            observed: evidence(&self.system).map(|(_, of, name)| format!("{name} of {of}")).collect(),
        };
        rows.guarantees.enumerate().filter(|(id, _)| !taken.contains(id)).map(claim).collect()
    }

    /// The module of GSN over those of all claims: of the guarantees of one service, one is enough.
    #[must_use]
    pub fn index(&self) -> String {
        claim::index(&self.claims(), &self.title)
    }

    /// A table of guarantees and demands, with their verdicts and what they lack.
    #[must_use]
    pub fn text(&self, style: Style) -> String {
        let (rows, now) = (self.system.certificates(), &self.evaluation);
        let guarantees = rows.guarantees.enumerate().map(|(id, row)| {
            let verdict = now.guarantee(&self.system, id);
            vec![
                format!("{} gives {}", rows.services[row.service].name, row.name),
                words::statement(&rows.scales, &row.statement),
                painted(style, verdict),
                self.missing(id, verdict),
            ]
        });
        let demands = rows.demands.enumerate().map(|(id, row)| {
            let met = painted(style, now.demand(&self.system, id));
            let what = words::statement(&rows.scales, &row.statement);
            vec![format!("{} asks {}", rows.services[row.service].name, row.name), what, met, String::new()]
        });
        let table = table(&["", "statement", "", "lacks"], guarantees.chain(demands).collect());
        format!("{}: {}\n\n{table}\n", self.title, counted(rows.services.len(), "service"))
    }

    /// A page for the browser, with the assurance cases.
    #[must_use]
    pub fn page(&self) -> String {
        page::of_claims(&self.claims())
    }

    fn missing(&self, id: GuaranteeId, verdict: Verdict) -> String {
        if verdict == Verdict::Holds {
            return String::new();
        }
        let rows = self.system.certificates();
        let name = |leaf: &Leaf| match leaf {
            Leaf::Demand(id) => rows.demands[*id].name.clone(),
            Leaf::Evidence(id) => rows.evidence[*id].name.clone(),
        };
        let sets = self.evaluation.missing(&self.system, id, MOST_EVALUATIONS).sets;
        super::text::listed(sets.iter().map(|set| set.iter().map(name).collect()).collect())
    }

    /// One object.
    #[must_use]
    pub fn json(&self) -> Value {
        let (rows, now) = (self.system.certificates(), &self.evaluation);
        let guarantees = rows.guarantees.enumerate().map(|(id, row)| {
            json!({
                "service": rows.services[row.service].name,
                "guarantee": row.name,
                "statement": words::statement(&rows.scales, &row.statement),
                "verdict": words::verdict(now.guarantee(&self.system, id)),
            })
        });
        let demands = rows.demands.enumerate().map(|(id, row)| {
            json!({
                "service": rows.services[row.service].name,
                "demand": row.name,
                "statement": words::statement(&rows.scales, &row.statement),
                "verdict": words::verdict(now.demand(&self.system, id)),
            })
        });
        let cases = self.claims().into_iter().map(
            |claim| json!({ "claim": claim.name, "case": gsn::json(&claim.argument(), &claim.name, &[]) }),
        );
        json!({
            "model": self.title,
            "given": self.is_given(),
            "guarantees": guarantees.collect::<Vec<_>>(),
            "demands": demands.collect::<Vec<_>>(),
            "cases": cases.collect::<Vec<_>>(),
        })
    }
}

/// All pieces of evidence, with the names of their services and their own names.
fn evidence(system: &System) -> impl Iterator<Item = (EvidenceId, &str, &str)> {
    let rows = system.certificates();
    rows.evidence
        .enumerate()
        .map(|(id, row)| (id, rows.services[row.service].name.as_str(), row.name.as_str()))
}

fn painted(style: Style, verdict: Verdict) -> String {
    let paint = match verdict {
        Verdict::Holds => Paint::Green,
        Verdict::Open | Verdict::Circular | Verdict::Refused => Paint::Red,
    };
    style.paint(paint, words::verdict(verdict))
}
