//! What falls short of requirements, and why: candidates for a substitution, and needs that nothing meets.

use serde_json::{Value, json};
use shsa_core::knowledge::{KnowledgeBase, Need, VariableId};
use shsa_core::plan::{self, Graph, Limits, Options, Requirements, StopReason};
use shsa_core::substitution::Substitution;
use shsa_format::words;
use std::collections::BTreeSet;

/// The most candidates that are checked for reasons.
const MOST_ASKED: usize = 1_000;

/// The limits of the search for unmet needs: decisions of a search, and needs.
const MOST_EXPANSIONS: u64 = 20_000;
const MOST_NEEDS: usize = 100;

/// Needs whose demands no candidate meets, although something knows their variable, with the reasons of the best candidate. If a
/// search reaches its limits, the need is not listed.
#[must_use]
pub fn unmet(knowledge: &KnowledgeBase) -> Vec<String> {
    let graph = Graph::new(knowledge);
    let limits = Limits { expansions: MOST_EXPANSIONS, ..Limits::default() };
    let one = |need: &Need| {
        let (options, requirements) = (Options::default(), Requirements::of(need));
        let narrowed = requirements.narrowed(knowledge, &options);
        let variable = need.variable;
        let plan = plan::best_meeting(knowledge, &graph, variable, &narrowed, &requirements, 1, limits);
        if !plan.substitutions.is_empty() || plan.stop != StopReason::Complete {
            return None;
        }
        let refused = refused(knowledge, &graph, variable, &options, &requirements, limits);
        let reason = refused.first()?.reasons.first()?;
        Some(format!("nothing meets what the need {} demands: {reason}", need.signal))
    };
    knowledge.needs().iter().take(MOST_NEEDS).filter_map(one).collect()
}

/// A candidate that fails the requirements, with the reasons.
#[derive(Clone, Debug)]
pub struct Refused {
    /// The candidate.
    pub substitution: Substitution,
    /// Why it fails, in words.
    pub reasons: Vec<String>,
}

/// The best candidates without the requirements that fail them, with the reasons: from all signals and relations, and from the
/// permitted ones.
#[must_use]
pub fn refused(
    knowledge: &KnowledgeBase,
    graph: &Graph,
    variable: VariableId,
    options: &Options,
    requirements: &Requirements,
    limits: Limits,
) -> Vec<Refused> {
    let anything = Options {
        substitute_provided: options.substitute_provided,
        without_empty: options.without_empty,
        ..Options::default()
    };
    let mut candidates = plan::best(graph, variable, &anything, MOST_ASKED, limits).substitutions;
    let seen: BTreeSet<_> = candidates.iter().map(|(substitution, _)| substitution.relations()).collect();
    let narrowed = requirements.narrowed(knowledge, options);
    let more = plan::best(graph, variable, &narrowed, MOST_ASKED, limits).substitutions.into_iter();
    candidates.extend(more.filter(|(substitution, _)| !seen.contains(&substitution.relations())));
    let asked = candidates.into_iter().map(|(substitution, _)| {
        let shortfalls = requirements.shortfalls(knowledge, options, &substitution);
        let reasons =
            shortfalls.iter().map(|shortfall| words::reason(&shortfall.reason(knowledge))).collect();
        Refused { substitution, reasons }
    });
    asked.filter(|refused| !refused.reasons.is_empty()).collect()
}

impl Refused {
    /// The names of its relations.
    #[must_use]
    pub fn relations(&self, knowledge: &KnowledgeBase) -> Vec<String> {
        let relations = self.substitution.relations();
        relations.into_iter().map(|relation| knowledge.relations()[relation].name.clone()).collect()
    }

    /// As one JSON object.
    #[must_use]
    pub fn to_json(&self, knowledge: &KnowledgeBase) -> Value {
        json!({ "relations": self.relations(knowledge), "because": self.reasons })
    }
}
