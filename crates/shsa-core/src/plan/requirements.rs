//! Requirements on substitutions, pruned inside the search, and the reasons why one falls short.
//!
//! Rate, integrity and independence concern single signals and relations: elements that fall short are left out of the graph
//! before the search. Latency and width add up along a substitution. Each is computed from the sources to the sink and never
//! falls when a part gets worse, so a partial substitution has a lower bound: undecided places count with the least value of
//! their choices. A partial substitution with a bound beyond the requirement is dropped with all its completions.

mod shortfall;
mod cost;
mod paths;

pub(super) use paths::Paths;
pub use shortfall::Shortfall;

use super::graph::Options;
use crate::expression::Formula;
use crate::knowledge::{
    INTEGRITY, KnowledgeBase, Need, Properties, Relation, RelationId, SignalId, SignalSet, VariableId,
    integrity_level,
};
use crate::substitution::{Substitution, Way};
use crate::time::Span;
use alloc::collections::BTreeMap;
use alloc::vec::Vec;
use cost::Cost;

/// Requirements on substitutions; without limits by default.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Requirements {
    /// The largest age of the inputs when a value comes: the delay of a signal, and the time that operators look back.
    pub max_latency: Option<Span>,
    /// The longest time between two values: the period of the fastest signal. A signal without a rate may have any.
    pub max_period: Option<Span>,
    /// The largest width of values, SI: the errors of signals and relations, where the formulas scale them only by constants.
    pub max_width: Option<f64>,
    /// The least rate of the signals, observations a second; a signal without a rate falls short.
    pub min_rate_hz: Option<f64>,
    /// The least integrity level of the signals, 1 (`A`) to 4 (`D`), by their property `integrity` (0 without), and of the
    /// relations (any without).
    pub integrity: Option<f64>,
    /// Whether no relation may leave one of several values open (`one_of`): the middle of all of them is none of them.
    pub single_valued: bool,
    /// Suspects: a substitution must share no signal with them, nor rest on signals with a common origin.
    pub independent_of: Vec<SignalId>,
}

impl Requirements {
    /// The requirements of a need; the caller adds the suspects.
    #[must_use]
    pub fn of(need: &Need) -> Requirements {
        Requirements {
            max_latency: Some(need.max_age),
            max_period: Some(need.max_age),
            max_width: need.max_width,
            min_rate_hz: need.min_rate_hz,
            single_valued: need.max_width.is_none(),
            integrity: need.integrity.and_then(|letter| integrity_level(letter.encode_utf8(&mut [0; 4]))),
            ..Requirements::default()
        }
    }

    /// The signals and relations that fall short on their own, ascending: no substitution that meets the requirements uses them.
    /// Complexity: O(model).
    #[must_use]
    pub fn barred(&self, knowledge: &KnowledgeBase) -> (Vec<SignalId>, Vec<RelationId>) {
        let Options { forbidden_signals, forbidden_relations, .. } =
            self.narrowed(knowledge, &Options::default());
        (forbidden_signals, forbidden_relations)
    }

    /// Whether requirements must be checked along substitutions.
    #[must_use]
    pub fn limits_paths(&self) -> bool {
        self.max_latency.is_some() || self.max_width.is_some() || self.max_period.is_some()
    }

    /// The options without the signals and relations that fall short on their own.
    #[must_use]
    pub fn narrowed(&self, knowledge: &KnowledgeBase, options: &Options) -> Options {
        let mut options = options.clone();
        let suspects = self.suspects(knowledge);
        let signals = knowledge.signals().ids().filter(|&signal| !self.admits(knowledge, &suspects, signal));
        options.forbidden_signals.extend(signals);
        let relations = knowledge.relations().enumerate();
        let short = relations.filter(|(_, relation)| {
            self.low_relation(&relation.properties).is_some() || self.is_open(relation)
        });
        options.forbidden_relations.extend(short.map(|(id, _)| id));
        options
    }

    fn suspects(&self, knowledge: &KnowledgeBase) -> SignalSet {
        self.independent_of.iter().fold(SignalSet::new(), |mut all, &signal| {
            all.extend(&knowledge.origins(signal));
            all
        })
    }

    fn admits(&self, knowledge: &KnowledgeBase, suspects: &SignalSet, signal: SignalId) -> bool {
        let is_fast = self.min_rate_hz.is_none_or(|least| rate(knowledge, signal) >= least);
        let is_safe = self.integrity.is_none_or(|least| integrity(knowledge, signal) >= least);
        is_fast && is_safe && (suspects.is_empty() || !suspects.meets(&knowledge.origins(signal)))
    }

    /// The level of a relation that is too low, and the least one.
    fn low_relation(&self, properties: &Properties) -> Option<(f64, f64)> {
        let least = self.integrity?;
        let own = *properties.get(INTEGRITY)?;
        (own < least).then_some((own, least))
    }

    /// Whether a relation leaves open what must have one value.
    fn is_open(&self, relation: &Relation) -> bool {
        let is_choice = |&output: &VariableId| relation.formula(output).is_some_and(Formula::has_choice);
        self.single_valued && relation.outputs.iter().any(is_choice)
    }

    /// The shortfalls of a relation on its own.
    fn relation(&self, knowledge: &KnowledgeBase, id: RelationId) -> impl Iterator<Item = Shortfall> {
        let relation = &knowledge.relations()[id];
        let low = self.low_relation(&relation.properties);
        let low = low.map(|(own, least)| Shortfall::RelationIntegrity(id, own, least));
        low.into_iter().chain(self.is_open(relation).then_some(Shortfall::Alternatives(id)))
    }

    /// All shortfalls of a substitution; empty for one that the search would return.
    ///
    /// Complexity: O(s) for s inputs of its relations, times the signals that carry each.
    #[must_use]
    pub fn shortfalls(
        &self,
        knowledge: &KnowledgeBase,
        options: &Options,
        substitution: &Substitution,
    ) -> Vec<Shortfall> {
        let mut found = Vec::new();
        let suspects = self.suspects(knowledge);
        for &source in &substitution.sources {
            found.extend(self.source(knowledge, options, &suspects, source));
        }
        for relation in substitution.relations() {
            if options.forbidden_relations.contains(&relation) {
                found.push(Shortfall::Relation(relation));
            }
            found.extend(self.relation(knowledge, relation));
        }
        let admitted = |signal: &SignalId| self.admits(knowledge, &suspects, *signal);
        let source = |variable| {
            let signals = usable(knowledge, options, variable).filter(admitted);
            Cost::of_source(knowledge, variable, signals)
        };
        found.extend(self.beyond(Cost::along(knowledge, substitution, source)));
        if found.is_empty() && self.limits_paths() {
            // Different signals may meet the different limits.
            let mut falling_short = None;
            for way in self.ways(knowledge, options, &suspects, substitution) {
                let shortfalls = self.shortfalls_of_way(knowledge, &way);
                if shortfalls.is_empty() {
                    return found;
                }
                falling_short.get_or_insert(shortfalls);
            }
            found.extend(falling_short.unwrap_or_default());
        }
        found
    }

    /// The ways of a substitution with signals that do not fall short on their own, within the limit of choices.
    fn ways(
        &self,
        knowledge: &KnowledgeBase,
        options: &Options,
        suspects: &SignalSet,
        substitution: &Substitution,
    ) -> Vec<Way> {
        let usable = |signal| {
            knowledge.is_available(signal)
                && !options.forbidden_signals.contains(&signal)
                && self.admits(knowledge, suspects, signal)
        };
        Way::choices(knowledge, substitution, usable, MOST_CHOICES)
    }

    /// All shortfalls of a way: a substitution with chosen signals.
    ///
    /// Complexity: O(s log s) for s inputs of its relations.
    #[must_use]
    pub fn shortfalls_of_way(&self, knowledge: &KnowledgeBase, way: &Way) -> Vec<Shortfall> {
        let mut found = Vec::new();
        let suspects = self.suspects(knowledge);
        let chosen: BTreeMap<VariableId, SignalId> = way
            .substitution
            .sources
            .iter()
            .zip(&way.signals)
            .filter_map(|(&source, signal)| Some((source, (*signal)?)))
            .collect();
        for (&source, &signal) in &chosen {
            found.extend(self.signal(knowledge, &suspects, source, signal));
        }
        for relation in way.substitution.relations() {
            found.extend(self.relation(knowledge, relation));
        }
        let source =
            |variable| Cost::of_source(knowledge, variable, chosen.get(&variable).copied().into_iter());
        found.extend(self.beyond(Cost::along(knowledge, &way.substitution, source)));
        found
    }

    fn signal(
        &self,
        knowledge: &KnowledgeBase,
        suspects: &SignalSet,
        source: VariableId,
        signal: SignalId,
    ) -> Option<Shortfall> {
        let (rate, integrity) = (rate(knowledge, signal), integrity(knowledge, signal));
        if let Some(least) = self.min_rate_hz.filter(|least| rate < *least) {
            return Some(Shortfall::Rate(source, rate, least));
        }
        if let Some(least) = self.integrity.filter(|least| integrity < *least) {
            return Some(Shortfall::SignalIntegrity(source, integrity, least));
        }
        let shares = suspects.meets(&knowledge.origins(signal));
        shares.then_some(Shortfall::Shared(source, signal))
    }

    /// The exceeded limits; infinite costs of a source without a signal are left out, as another shortfall reports them.
    fn beyond(&self, cost: Cost) -> impl Iterator<Item = Shortfall> {
        let Cost { latency, width, period } = cost;
        let late = self.max_latency.filter(|most| latency > *most && latency < Span::MAX);
        let rare = self.max_period.filter(|most| period > *most && period < Span::MAX);
        let wide = self.max_width.filter(|most| width > *most * (1.0 + SLACK) && width.is_finite());
        let late = late.map(|most| Shortfall::Latency(latency, most));
        let rare = rare.map(|most| Shortfall::Period(period, most));
        late.into_iter().chain(rare).chain(wide.map(|most| Shortfall::Width(width, most)))
    }

    fn source(
        &self,
        knowledge: &KnowledgeBase,
        options: &Options,
        suspects: &SignalSet,
        source: VariableId,
    ) -> Option<Shortfall> {
        if knowledge.variables()[source].constant.is_some() {
            return None;
        }
        let usable = || usable(knowledge, options, source);
        if usable().next().is_none() {
            return Some(Shortfall::Signal(source));
        }
        if usable().any(|signal| self.admits(knowledge, suspects, signal)) {
            return None;
        }
        let best = |of: fn(&KnowledgeBase, SignalId) -> f64| {
            usable().map(|signal| of(knowledge, signal)).fold(0.0, f64::max)
        };
        let (fastest, safest) = (best(rate), best(integrity));
        if let Some(least) = self.min_rate_hz.filter(|least| fastest < *least) {
            return Some(Shortfall::Rate(source, fastest, least));
        }
        if let Some(least) = self.integrity.filter(|least| safest < *least) {
            return Some(Shortfall::SignalIntegrity(source, safest, least));
        }
        let shared = usable().find(|&signal| suspects.meets(&knowledge.origins(signal)));
        Some(shared.map_or(Shortfall::Signal(source), |signal| Shortfall::Shared(source, signal)))
    }

    fn allow(&self, cost: Cost) -> bool {
        self.max_latency.is_none_or(|most| cost.latency <= most)
            // A constant is always valid.
            && self.max_period.is_none_or(|most| cost.period <= most || cost.period == Span::MAX)
            && self.max_width.is_none_or(|most| cost.width <= most * (1.0 + SLACK))
    }
}

/// By how much rounding may move a width beyond its limit.
const SLACK: f64 = 1e-9;

/// At most this many choices of signals of a substitution are tested against the requirements.
const MOST_CHOICES: usize = 256;

fn rate(knowledge: &KnowledgeBase, signal: SignalId) -> f64 {
    knowledge.signals()[signal].rate_hz.unwrap_or(0.0)
}

fn integrity(knowledge: &KnowledgeBase, signal: SignalId) -> f64 {
    knowledge.signals()[signal].properties.get(INTEGRITY).copied().unwrap_or(0.0)
}

fn usable<'a>(
    knowledge: &'a KnowledgeBase,
    options: &'a Options,
    variable: VariableId,
) -> impl Iterator<Item = SignalId> + 'a {
    let allowed = |signal: &SignalId| !options.forbidden_signals.contains(signal);
    knowledge
        .carriers(variable)
        .iter()
        .copied()
        .filter(|signal| knowledge.is_available(*signal))
        .filter(allowed)
}
