//! The assurance case as one page for the browser, without scripts and external resources.

use super::claim::Claim;
use super::model::{ModelReport, Need};
use super::text::{self, listed};
use crate::page::{document, list, section, verdict_cell};
use shsa_core::assurance::{EvidenceId, Verdict};
use shsa_core::knowledge::Id;
use shsa_drawing::case::{Argument, Node, words};
use shsa_drawing::escaped;
use shsa_format::text::counted;

const WAYS: &str = "Each way of serving the need with the contracts of all who take part: the highest level of what is asked, \
    whether it may serve, and the evidence on which that rests, or what it lacks.";
const LOSSES: &str = "What is left when one signal is lost, its values and all evidence about it, while all else is as it should be.";
const CASE: &str = "The argument for what is given, or against it: claims that rest on claims of others and on evidence, each \
    as it stands. What holds is the least fixed point of all contracts: nothing rests on itself, and what is unknown supports \
    nothing.";

/// The page of a model.
pub(super) fn page(report: &ModelReport<'_>) -> String {
    let lead = format!("{}, {}.", counted(report.needs.len(), "need"), report.when());
    let needs: String = report.needs.iter().map(|need| of_need(report, need)).collect();
    document(&escaped(&report.title), "assurance case", &lead, &needs)
}

/// The page of certificates.
pub(super) fn of_claims(claims: &[Claim<'_>]) -> String {
    let case =
        |claim: &Claim<'_>| section(&escaped(&claim.name), &escaped(&claim.brief), &case(&claim.argument()));
    let lead = counted(claims.len(), "guarantee");
    document("Certificates", "assurance case", &lead, &claims.iter().map(case).collect::<String>())
}

fn of_need(report: &ModelReport<'_>, need: &Need) -> String {
    let name = escaped(&need.name);
    let argument = report.claim(need).map(|claim| case(&claim.argument())).unwrap_or_default();
    [
        section(&format!("{name}: {}", escaped(&text::answer(report, need))), WAYS, &ways(report, need)),
        section(&format!("{name}: what each loss takes"), LOSSES, &losses(report, need)),
        section(&format!("{name}: the case"), CASE, &argument),
    ]
    .concat()
}

fn ways(report: &ModelReport<'_>, need: &Need) -> String {
    let row = |at: usize| {
        let (candidacy, (_, assessment)) = (&need.prospect.ways[at], &need.now[at]);
        let conditions = match assessment.verdict {
            Verdict::Holds => {
                let observed = report.observed(candidacy);
                let names =
                    |set: &Vec<EvidenceId>| set.iter().map(|id| observed[id.index()].clone()).collect();
                listed(candidacy.conditions.sets.iter().map(names).collect())
            }
            _ => {
                let sets = need.why(at);
                listed(sets.iter().map(|set| set.iter().map(super::model::lacking).collect()).collect())
            }
        };
        let level = report.level(assessment.level).unwrap_or_else(|| "-".to_owned());
        let mode = report.mode(candidacy, assessment).filter(|mode| mode != "served").unwrap_or_default();
        let cells = [candidacy.way.describe(report.knowledge), level, mode];
        format!(
            "<tr><td class=\"name\">{}</td><td>{}</td><td>{}</td>{}<td>{}</td></tr>\n",
            escaped(&cells[0]),
            escaped(&cells[1]),
            escaped(&cells[2]),
            verdict_cell(assessment.verdict),
            escaped(&conditions)
        )
    };
    let table = list(
        &["Way", "Level", "Mode", "Stands", "On condition that, or lacks"],
        &(0..need.prospect.ways.len()).map(row).collect::<Vec<_>>(),
    );
    let weak = text::weak(report, need).map_or(String::new(), |weak| format!("<p>{}</p>\n", escaped(&weak)));
    table + &weak
}

fn losses(report: &ModelReport<'_>, need: &Need) -> String {
    let row = |(signal, left): &(_, Option<usize>)| {
        let name = escaped(&report.knowledge.signals()[*signal].name);
        let (class, then) = match left.and_then(|at| need.prospect.ways.get(at)) {
            None => ("no", "nothing".to_owned()),
            Some(candidacy) => {
                let level = report.level(candidacy.without(report.knowledge, &[*signal]).level);
                let level = level.map_or(String::new(), |level| format!(", {level}"));
                ("yes", format!("{}{level}", candidacy.way.describe(report.knowledge)))
            }
        };
        format!("<tr><td class=\"name\">{name}</td><td class=\"{class}\">{}</td></tr>\n", escaped(&then))
    };
    list(&["Lost", "What is left"], &need.prospect.losses.iter().map(row).collect::<Vec<_>>())
}

/// The drawing, and a table of the nodes with their verdicts.
fn case(argument: &Argument) -> String {
    let row = |node: &Node| {
        let kind = words::kind(node.kind);
        format!("<tr><td>{kind}</td><td>{}</td>{}</tr>\n", escaped(&node.text), verdict_cell(node.state))
    };
    let drawn = match shsa_drawing::argument(argument) {
        Ok(svg) => format!("<div class=\"graph\">{svg}</div>\n"),
        Err(too_large) => format!("<p>Not drawn: {}.</p>\n", escaped(&too_large.to_string())),
    };
    drawn + &list(&["", "What is said", "Stands"], &argument.nodes.iter().map(row).collect::<Vec<_>>())
}
