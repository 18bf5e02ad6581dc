//! `shsa plan --contingency`: the substitutes for lost signals, in advance.

mod evidence;

use crate::plan::find_variable;
use crate::show;
use evidence::Contracts;
use serde_json::{Value, json};
use shsa_core::knowledge::{KnowledgeBase, SignalId, VariableId};
use shsa_core::plan::{Contingency, Graph, Options, Preparation, Requirements};
use shsa_core::substitution::Substitution;
use shsa_report::Paint;
use shsa_report::substitution::Names;
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

/// How many substitutions are considered as substitute, as in the engine.
const MOST: usize = 32;

/// The asked variables: the one with the name, or those of all needs.
///
/// # Errors
/// When there is no variable with this name, or no need.
fn variables(knowledge: &KnowledgeBase, name: Option<&str>) -> anyhow::Result<Vec<VariableId>> {
    if let Some(name) = name {
        return Ok(vec![find_variable(knowledge, name)?]);
    }
    let needed: BTreeSet<VariableId> = knowledge.needs().iter().map(|need| need.variable).collect();
    anyhow::ensure!(!needed.is_empty(), "the model has no needs; name a variable");
    Ok(needed.into_iter().collect())
}

/// All answers, as text or as one JSON object; `requirements` gives those of a variable, and sets what the options forbid.
///
/// # Errors
/// When there is no variable to ask about, or its requirements are invalid.
pub(crate) fn answer(
    knowledge: &KnowledgeBase,
    name: Option<&str>,
    preparation: &Preparation,
    requirements: impl Fn(VariableId, &mut Options) -> anyhow::Result<Requirements>,
    as_json: bool,
) -> anyhow::Result<String> {
    let variables = variables(knowledge, name)?;
    let graph = Graph::new(knowledge);
    let table = |(preparation, variables): (Preparation, Vec<VariableId>)| {
        let excluded = preparation.requirements.narrowed(knowledge, &preparation.options).forbidden_signals;
        let table = Contingency::new(knowledge, &graph, variables.iter().copied(), preparation);
        (table, variables, excluded)
    };
    let tables: Vec<_> = alike(&variables, preparation, requirements)?.into_iter().map(table).collect();
    let contracts = Contracts::new(knowledge, &graph);
    let mut prospects = Vec::new();
    for (table, variables, excluded) in &tables {
        let prospect = |&variable| Prospect::of(&contracts, table, variable, excluded);
        prospects.extend(variables.iter().map(prospect));
    }
    prospects.sort_by_key(|prospect: &Prospect| prospect.variable);
    Ok(match as_json {
        true => {
            let searches = tables.iter().map(|(table, ..)| table.searches()).sum();
            let mut answer = to_json(knowledge, preparation.pairs, searches, &prospects);
            answer["needs"] = contracts.to_json(&variables);
            answer.to_string()
        }
        false => [to_text(knowledge, &prospects), contracts.to_text(&variables)].concat(),
    })
}

/// The variables grouped by equal requirements, each group with the settings of its table.
fn alike(
    variables: &[VariableId],
    preparation: &Preparation,
    requirements: impl Fn(VariableId, &mut Options) -> anyhow::Result<Requirements>,
) -> anyhow::Result<Vec<(Preparation, Vec<VariableId>)>> {
    let mut groups: Vec<(Preparation, Vec<VariableId>)> = Vec::new();
    for &variable in variables {
        let mut preparation = Preparation { count: MOST, ..preparation.clone() };
        preparation.requirements = requirements(variable, &mut preparation.options)?;
        match groups.iter_mut().find(|(known, _)| *known == preparation) {
            Some((_, variables)) => variables.push(variable),
            None => groups.push((preparation, vec![variable])),
        }
    }
    Ok(groups)
}

/// One lost signal, or two; derived signals are lost with them.
type Loss = Vec<SignalId>;

/// The substitution that serves a variable.
#[derive(PartialEq)]
struct Server {
    substitution: Substitution,
    utility: f64,
    names: Names,
}

/// The server of one variable now, and after each loss.
struct Prospect<'a> {
    table: &'a Contingency,
    variable: VariableId,
    now: Option<Server>,
    after: Vec<(Loss, Option<Server>)>,
    complete: bool,
}

impl<'a> Prospect<'a> {
    fn of(
        contracts: &Contracts<'_>,
        table: &'a Contingency,
        variable: VariableId,
        excluded: &[SignalId],
    ) -> Prospect<'a> {
        let knowledge = contracts.knowledge;
        let server = |loss: &[SignalId]| {
            let lost = table.with_derived(loss);
            let plan = contracts.plan(table.preparation(), variable, &lost);
            let plan = plan.map(Cow::Owned).or_else(|| table.plan(variable, &lost).map(Cow::Borrowed))?;
            let substitutions = &plan.substitutions;
            let is_out = |signal: SignalId| excluded.contains(&signal) || lost.contains(&signal);
            // A substitution that only continues its own last value comes last, as in the engine.
            let fresh = |(substitution, _): &&(Substitution, f64)| !substitution.continues_itself(knowledge);
            let found = substitutions.iter().find(fresh).or_else(|| substitutions.first()).cloned();
            Some(found.map(|(substitution, utility)| {
                let names = Names::of(knowledge, &substitution, &is_out);
                Server { substitution, utility, names }
            }))
        };
        let now = server(&[]).flatten();
        let mut losses = losses(table, variable);
        losses.extend(contracts.observed(variable).map(|signal| vec![signal]));
        losses.sort_by_key(|loss| (loss.len(), loss.clone()));
        losses.dedup();
        let losses = losses.into_iter();
        let after = losses.filter_map(|loss| server(&loss).map(|server| (loss, server))).collect();
        Prospect { table, variable, now, after, complete: table.is_complete(variable) }
    }

    fn single(&self, signal: SignalId) -> Option<&Server> {
        let of_signal = |(loss, _): &&(Loss, Option<Server>)| *loss == [signal];
        self.after.iter().find(of_signal).map_or(self.now.as_ref(), |(_, server)| server.as_ref())
    }

    /// Whether a loss has another effect than each smaller loss: another server, or none.
    fn is_news(&self, loss: &[SignalId], server: Option<&Server>) -> bool {
        match loss {
            [one, other] => server != self.single(*one) && server != self.single(*other),
            _ => server != self.now.as_ref(),
        }
    }

    fn news(&self) -> impl Iterator<Item = (&Loss, Option<&Server>)> {
        let all = self.after.iter().map(|(loss, server)| (loss, server.as_ref()));
        all.filter(|(loss, server)| self.is_news(loss, *server))
    }

    /// Losses after which nothing serves the variable, although something does after each smaller loss.
    fn unhealed(&self) -> impl Iterator<Item = &Loss> {
        self.news().filter(|(_, server)| server.is_none()).map(|(loss, _)| loss)
    }

    /// The relevant signals that are lost as well, because they are derived from the lost ones.
    fn taken_along(&self, loss: &[SignalId]) -> Vec<SignalId> {
        let lost = self.table.with_derived(loss);
        let lost = self.table.loss(self.variable, &lost).unwrap_or_default();
        lost.iter().copied().filter(|signal| !loss.contains(signal)).collect()
    }

    /// The relative change of utility after a loss; negative for less.
    fn change(&self, server: &Server) -> f64 {
        self.now.as_ref().map_or(0.0, |now| (server.utility - now.utility) / now.utility)
    }
}

/// All relevant losses of one signal in file order, then those of two.
fn losses(table: &Contingency, variable: VariableId) -> Vec<Loss> {
    let events = table.events(variable);
    let mut losses: Vec<Loss> = events.iter().map(|&event| vec![event]).collect();
    if table.preparation().pairs {
        for &one in events {
            let lost = table.with_derived(&[one]);
            let then = table.then_matter(variable, &lost);
            let is_more =
                |other: &&SignalId| !lost.contains(other) && !table.with_derived(&[**other]).contains(&one);
            let others = events.iter().filter(|&&other| other > one).chain(then).filter(is_more);
            losses.extend(others.map(|&other| vec![one.min(other), one.max(other)]));
        }
        losses.sort_by_key(|loss| (loss.len(), loss.clone()));
        losses.dedup();
    }
    losses
}

fn signal_names<'a>(knowledge: &'a KnowledgeBase, loss: &[SignalId]) -> Vec<&'a str> {
    loss.iter().map(|&signal| knowledge.signals()[signal].name.as_str()).collect()
}

fn needed_as(knowledge: &KnowledgeBase, variable: VariableId) -> Vec<&str> {
    let needs = knowledge.needs().iter().filter(|need| need.variable == variable);
    needs.map(|need| need.signal.as_str()).collect()
}

fn to_json(knowledge: &KnowledgeBase, pairs: bool, searches: u64, prospects: &[Prospect]) -> Value {
    let server = |server: &Server| server.names.to_json(server.utility);
    let one = |prospect: &Prospect| {
        let losses = prospect.after.iter().map(|(loss, after)| {
            json!({
                "lost": signal_names(knowledge, loss),
                "with_them": signal_names(knowledge, &prospect.taken_along(loss)),
                "takes_over": after.as_ref().map(server),
                "change": after.as_ref().map(|after| prospect.change(after)),
            })
        });
        json!({
            "variable": knowledge.variables()[prospect.variable].name,
            "needed_as": needed_as(knowledge, prospect.variable),
            "now": prospect.now.as_ref().map(server),
            "losses": losses.collect::<Vec<_>>(),
            "unhealed": prospect.unhealed().map(|loss| signal_names(knowledge, loss)).collect::<Vec<_>>(),
            "complete": prospect.complete,
        })
    };
    json!({
        "pairs": pairs,
        "searches": searches,
        "variables": prospects.iter().map(one).collect::<Vec<_>>(),
    })
}

fn to_text(knowledge: &KnowledgeBase, prospects: &[Prospect]) -> String {
    let mut parts: Vec<String> = prospects.iter().map(|prospect| section(knowledge, prospect)).collect();
    parts.push(unhealed(knowledge, prospects));
    parts.join("\n\n")
}

/// The section of one variable: its server, the substitutes, and the losses without effect.
fn section(knowledge: &KnowledgeBase, prospect: &Prospect) -> String {
    let name = show::style().paint(Paint::Bold, &knowledge.variables()[prospect.variable].name);
    let head = match &prospect.now {
        None => return format!("{name}: nothing can provide it now"),
        Some(now) => format!(
            "{name}: now {} from {}, utility {:.6}",
            now.names.relations_or_own(),
            now.names.signals.join(", "),
            now.utility
        ),
    };
    let rows: Vec<Vec<String>> =
        prospect.news().map(|(loss, server)| row(knowledge, prospect, loss, server)).collect();
    let mut lines = vec![head];
    if !rows.is_empty() {
        lines.push(show::style().table(&["lost", "takes over", "from", "utility", "change"], rows));
    }
    let singles = |(loss, server): &&(Loss, Option<Server>)| loss.len() == 1 && *server == prospect.now;
    let same: Vec<&str> =
        prospect.after.iter().filter(singles).flat_map(|(loss, _)| signal_names(knowledge, loss)).collect();
    if !same.is_empty() {
        lines.push(show::style().wrapped(&format!("no difference alone: {}", same.join(", ")), 0));
    }
    if !prospect.complete {
        lines.push("not all losses were searched for: too much to search".to_owned());
    }
    lines.join("\n")
}

fn row(
    knowledge: &KnowledgeBase,
    prospect: &Prospect,
    loss: &[SignalId],
    server: Option<&Server>,
) -> Vec<String> {
    let mut lost = signal_names(knowledge, loss).join(" + ");
    let along = prospect.taken_along(loss);
    if !along.is_empty() {
        lost = format!("{lost}, with it {}", signal_names(knowledge, &along).join(", "));
    }
    let Some(server) = server else { return vec![lost, show::style().paint(Paint::Red, "nothing")] };
    let mut relations = server.names.relations_or_own();
    if server.substitution.continues_itself(knowledge) {
        relations.push_str(" (from its last value)");
    }
    let change = match (100.0 * prospect.change(server)).round() {
        0.0 => "same".to_owned(),
        percent => format!("{percent:+} %"),
    };
    vec![lost, relations, server.names.signals.join(", "), format!("{:.6}", server.utility), change]
}

/// The losses that nothing heals, with the variables that become unknown.
fn unhealed(knowledge: &KnowledgeBase, prospects: &[Prospect]) -> String {
    let mut missing: BTreeMap<&Loss, Vec<&str>> = BTreeMap::new();
    for prospect in prospects {
        let name = knowledge.variables()[prospect.variable].name.as_str();
        prospect.unhealed().for_each(|loss| missing.entry(loss).or_default().push(name));
    }
    if missing.is_empty() {
        let pairs = prospects.iter().any(|prospect| prospect.table.preparation().pairs);
        let count = if pairs { "one or two signals" } else { "one signal" };
        return show::style().paint(Paint::Green, &format!("every loss of {count} is healed"));
    }
    let row = |(loss, variables): (&&Loss, &Vec<&str>)| {
        vec![signal_names(knowledge, loss).join(" + "), variables.join(", ")]
    };
    show::style().table(&["nothing heals the loss of", "needed for"], missing.iter().map(row).collect())
}
