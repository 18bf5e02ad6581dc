//! Certificates as Prolog: rules without negation, whose least fixed point tabling finds.

use shsa_core::assurance::{DemandId, Evaluation, GuaranteeId, Quantifier, System, Tree};
use shsa_core::knowledge::Id;
use std::fmt::Write as _;

/// A program of `guarantee/1` and `demand/1`: the numbers of the guarantees and demands that hold under the present evidence.
///
/// Guarantees, demands and evidence have the numbers of the system, with their names in comments. `meets/2` states which
/// guarantee meets which demand by its statement. The program is for SWI-Prolog (`:- table`), where rules may depend on each
/// other. Time: linear in the certificates and their matches.
#[must_use]
pub fn write(system: &System, evaluation: &Evaluation) -> String {
    let rows = system.certificates();
    let mut out = String::from(
        ":- table guarantee/1, demand/1.\n:- dynamic evidence/1, meets/2.\n:- discontiguous evidence/1, meets/2, guarantee/1, demand/1.\n\
         at_least(N, _) :- N =< 0.\nat_least(N, [G|Gs]) :- N > 0, call(G), M is N - 1, at_least(M, Gs).\n\
         at_least(N, [_|Gs]) :- N > 0, at_least(N, Gs).\n",
    );
    // Writing to memory never fails.
    let mut line = |text: std::fmt::Arguments<'_>| _ = writeln!(out, "{text}");
    for (id, row) in rows.evidence.enumerate() {
        let holds = if evaluation.truth(id).is_true() { "" } else { "% not true now: " };
        line(format_args!("{holds}evidence({}). % {}", id.index(), comment(&row.name)));
    }
    for (id, row) in rows.demands.enumerate() {
        system.matches(id).for_each(|by| line(format_args!("meets({}, {}).", id.index(), by.index())));
        line(format_args!("demand({}) :- {}. % {}", id.index(), asked(system, id), comment(&row.name)));
    }
    for (id, row) in rows.guarantees.enumerate() {
        line(format_args!("guarantee({}) :- {}. % {}", id.index(), goal(&row.when), comment(&row.name)));
    }
    out
}

/// A rule to add to a program: `claim` follows where the guarantee holds; `name` is its name for people.
#[must_use]
pub fn claim(id: GuaranteeId, name: &str) -> String {
    format!("claim :- guarantee({}). % {}\n", id.index(), comment(name))
}

/// A name for a comment, without control characters.
fn comment(name: &str) -> String {
    name.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

/// The condition of a demand: a guarantee of one of the services that are asked meets it, or one of each.
fn asked(system: &System, id: DemandId) -> String {
    let (rows, row) = (system.certificates(), &system.certificates().demands[id]);
    if row.quantifier == Quantifier::Any {
        return format!("meets({}, G), guarantee(G)", id.index());
    }
    let of_one = |&service: &_| {
        let own = system.matches(id).filter(|&by| rows.guarantees[by].service == service);
        at_least(1, own.map(|by| format!("guarantee({})", by.index())).collect())
    };
    at_least(row.of.len() as u32, row.of.iter().map(of_one).collect())
}

fn goal(tree: &Tree) -> String {
    let all = |parts: &[Tree]| parts.iter().map(goal).collect::<Vec<_>>();
    match tree {
        Tree::All(parts) => at_least(parts.len() as u32, all(parts)),
        Tree::Any(parts) => at_least(1, all(parts)),
        Tree::AtLeast(needed, parts) => at_least(*needed, all(parts)),
        Tree::Demand(id) => format!("demand({})", id.index()),
        Tree::Evidence(id) => format!("evidence({})", id.index()),
    }
}

fn at_least(needed: u32, goals: Vec<String>) -> String {
    match (needed as usize, goals.len()) {
        (0, _) => "true".to_owned(),
        (1, 1) => goals.concat(),
        (needed, count) if needed == count => format!("({})", goals.join(", ")),
        (1, 2..) => format!("({})", goals.join(" ; ")),
        (needed, _) => format!("at_least({needed}, [{}])", goals.join(", ")),
    }
}
