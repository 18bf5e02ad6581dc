//! Certificates of conserts-rs and safeTbox, composed.

use super::claim::Claim;
use super::{Written, check_moment, read};
use crate::outcome::AlreadyTold;
use crate::show::{self, Paint};
use serde_json::{Value, json};
use shsa_core::assurance::{
    Certificates, Evaluation, EvidenceId, GuaranteeId, Leaf, ServiceId, System, Verdict,
};
use shsa_core::interval::Truth;
use shsa_format::case::{Measured, gsn, words};
use shsa_format::conserts;
use shsa_format::text::{counted, table};
use std::path::PathBuf;

/// The most evaluations for one question about minimal sets.
const MOST_EVALUATIONS: usize = 2_000;

/// Composed certificates, with their evaluation.
pub(super) struct Report {
    system: System,
    evaluation: Evaluation,
    title: String,
}

impl Report {
    /// # Errors
    /// When a file is no certificate, or the moment names evidence that no certificate has.
    pub(super) fn new(paths: &[PathBuf], moment: Option<&Written>) -> anyhow::Result<Report> {
        let mut files: Vec<Certificates> = Vec::new();
        for path in paths {
            let name = path.display().to_string();
            let (certificates, report) = conserts::read(&read(path)?, &name);
            show::tell_report(&report);
            if !report.ok() {
                return Err(AlreadyTold.into());
            }
            files.push(certificates);
        }
        let system = System::new(conserts::compose(files))
            .map_err(|problems| anyhow::anyhow!("these certificates cannot be composed: {problems:?}"))?;
        let mut evaluation = Evaluation::new(&system);
        let known: Vec<(&str, &str)> = evidence(&system).map(|(_, of, name)| (of, name)).collect();
        if let Some(written) = moment {
            check_moment(written, &known)?;
        }
        let said: Vec<(EvidenceId, Truth)> = evidence(&system)
            .map(|(id, of, name)| match moment.map(|(_, _, moment)| moment.of(of, name)) {
                None => (id, Truth::True),
                Some(None) => (id, Truth::Unknown),
                Some(Some(Measured::Truth(truth))) => (id, truth),
                Some(Some(Measured::Number(number))) => {
                    (id, system.certificates().evidence[id].truth(number))
                }
            })
            .collect();
        evaluation.set_all(&system, said.into_iter());
        let names = paths.iter().map(|path| path.display().to_string());
        Ok(Report { system, evaluation, title: names.collect::<Vec<_>>().join(", ") })
    }

    /// Whether every service with guarantees gives one of them, and every service with demands has one of them met: of several,
    /// lesser ones are alternatives to better ones.
    pub(super) fn is_given(&self) -> bool {
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
    pub(super) fn claims(&self) -> Vec<Claim<'_>> {
        let rows = self.system.certificates();
        let taken: Vec<GuaranteeId> = rows.demands.ids().flat_map(|id| self.system.matches(id)).collect();
        let claim = |(id, row): (GuaranteeId, &shsa_core::assurance::Guarantee)| Claim {
            name: format!("{} {}", rows.services[row.service].name, row.name),
            brief: self.title.clone(),
            system: &self.system,
            evaluation: self.evaluation.clone(),
            root: id,
            observed: evidence(&self.system).map(|(_, of, name)| format!("{name} of {of}")).collect(),
        };
        rows.guarantees.enumerate().filter(|(id, _)| !taken.contains(id)).map(claim).collect()
    }

    pub(super) fn text(&self) -> String {
        let (rows, now) = (self.system.certificates(), &self.evaluation);
        let guarantees = rows.guarantees.enumerate().map(|(id, row)| {
            let verdict = now.guarantee(&self.system, id);
            vec![
                format!("{} gives {}", rows.services[row.service].name, row.name),
                words::statement(&rows.scales, &row.statement),
                painted(verdict),
                self.missing(id, verdict),
            ]
        });
        let demands = rows.demands.enumerate().map(|(id, row)| {
            let met = painted(now.demand(&self.system, id));
            let what = words::statement(&rows.scales, &row.statement);
            vec![format!("{} asks {}", rows.services[row.service].name, row.name), what, met, String::new()]
        });
        let table = table(&["", "statement", "", "lacks"], guarantees.chain(demands).collect());
        format!("{}: {}\n\n{table}\n", self.title, counted(rows.services.len(), "service"))
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

    pub(super) fn json(&self) -> Value {
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
        let cases = self
            .claims()
            .into_iter()
            .map(|claim| json!({ "claim": claim.name, "case": gsn::json(&claim.argument(), &claim.name) }));
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

fn painted(verdict: Verdict) -> String {
    let paint = match verdict {
        Verdict::Holds => Paint::Green,
        Verdict::Open | Verdict::Circular | Verdict::Refused => Paint::Red,
    };
    show::paint(paint, words::verdict(verdict))
}
