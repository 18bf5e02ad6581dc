//! What a substitution must meet to be of use, pruned inside the search, and why one does not.
//!
//! Rate, integrity and independence are questions to single signals and relations: what falls short is left out of
//! the graph before the search begins. Latency and width add up along a substitution. Each is computed from its
//! sources to its sink and never falls when a part of it gets worse, so a partial substitution has a lower bound:
//! its undecided places count with the least that any of their choices could have. A partial substitution whose bound
//! is beyond the requirement is dropped with everything that would follow from it.

use super::graph::Options;
use super::subproblem::{ChoiceId, Place, Subproblem};
use crate::expression::{Binary, Formula, Operation, Symbol, Unary};
use crate::knowledge::{
    INTEGRITY, INTEGRITY_LEVELS, Id, KnowledgeBase, Need, Properties, RelationId, SignalId, SignalSet,
    VariableId, integrity_level,
};
use crate::substitution::{Step, Substitution, Way};
use crate::time::Span;
use alloc::collections::BTreeMap;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

/// What a substitution must meet; by default anything does.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Requirements {
    /// The largest age of what it rests on, when it comes: the delay of a signal, and what time operators between it
    /// and the result look back.
    pub max_latency: Option<Span>,
    /// The longest time between two of its values: the period of its fastest signal. One that does not tell its rate may have
    /// any.
    pub max_period: Option<Span>,
    /// The largest width of its values, SI: the errors of its signals and relations, as far as they go through its
    /// formulas without change of scale by other values.
    pub max_width: Option<f64>,
    /// The least rate of its signals, observations a second; a signal that does not tell its rate has none.
    pub min_rate_hz: Option<f64>,
    /// The least integrity level of its signals, 1 (`A`) to 4 (`D`), by their property `integrity` (0 without), and of
    /// its relations (any without).
    pub integrity: Option<f64>,
    /// It must share no signal with these, nor rest on one that is derived from the same: the suspects.
    pub independent_of: Vec<SignalId>,
}

/// Why a substitution is no answer.
#[derive(Clone, Debug, PartialEq)]
pub enum Shortfall {
    /// Forbidden, or not available; no other signal carries the variable.
    Signal(VariableId),
    /// Forbidden.
    Relation(RelationId),
    /// No usable signal of a variable is as fast: the fastest, and what was asked.
    Rate(VariableId, f64, f64),
    /// No usable signal of a variable has the level: the highest, and what was asked.
    SignalIntegrity(VariableId, f64, f64),
    /// A relation does not have the level: its own, and what was asked.
    RelationIntegrity(RelationId, f64, f64),
    /// All signals of a variable share something with a suspect.
    Shared(VariableId, SignalId),
    /// The age of what it rests on, and the largest that was asked.
    Latency(Span, Span),
    /// The time between two of its values, and the longest that was asked.
    Period(Span, Span),
    /// The least width of its values, and the largest that was asked, SI.
    Width(f64, f64),
}

impl Shortfall {
    /// In words, with names, SI units.
    #[must_use]
    pub fn describe(&self, knowledge: &KnowledgeBase) -> String {
        let variable = |id: &VariableId| knowledge.variables()[*id].name.as_str();
        let relation = |id: &RelationId| knowledge.relations()[*id].name.as_str();
        match self {
            Shortfall::Signal(id) => format!("no signal of {} may be used", variable(id)),
            Shortfall::Relation(id) => format!("{} may not be used", relation(id)),
            Shortfall::Rate(id, rate, least) => {
                format!("signals of {} come {rate} times a second, not {least}", variable(id))
            }
            Shortfall::SignalIntegrity(id, own, least) => {
                format!("signals of {} have integrity {}, not {}", variable(id), letter(*own), letter(*least))
            }
            Shortfall::RelationIntegrity(id, own, least) => {
                format!("{} has integrity {}, not {}", relation(id), letter(*own), letter(*least))
            }
            Shortfall::Shared(id, signal) => {
                let signal = &knowledge.signals()[*signal].name;
                format!(
                    "{} is known only by {signal}, which is not independent of the suspects",
                    variable(id)
                )
            }
            Shortfall::Latency(own, most) => {
                format!("it rests on values {} s old, more than {} s", own.seconds(), most.seconds())
            }
            Shortfall::Period(own, most) => {
                format!("its values come every {} s, and may be {} s old", own.seconds(), most.seconds())
            }
            Shortfall::Width(own, most) => format!("its values are at least {own} wide, more than {most}"),
        }
    }
}

fn letter(level: f64) -> &'static str {
    INTEGRITY_LEVELS.iter().rev().find(|(_, least)| level >= *least).map_or("none", |(name, _)| *name)
}

impl Requirements {
    /// Those of a need; its suspects are for the caller to add.
    #[must_use]
    pub fn of(need: &Need) -> Requirements {
        Requirements {
            max_latency: Some(need.max_age),
            max_period: Some(need.max_age),
            max_width: need.max_width,
            min_rate_hz: need.min_rate_hz,
            integrity: need.integrity.and_then(|letter| integrity_level(letter.encode_utf8(&mut [0; 4]))),
            ..Requirements::default()
        }
    }

    /// The signals and relations that fall short on their own, ascending: nothing that meets the requirements rests on them.
    /// Complexity: O(model).
    #[must_use]
    pub fn barred(&self, knowledge: &KnowledgeBase) -> (Vec<SignalId>, Vec<RelationId>) {
        let Options { forbidden_signals, forbidden_relations, .. } =
            self.narrowed(knowledge, &Options::default());
        (forbidden_signals, forbidden_relations)
    }

    /// Whether anything must be checked along substitutions.
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
        let low = relations.filter(|(_, relation)| self.low_relation(&relation.properties).is_some());
        options.forbidden_relations.extend(low.map(|(id, _)| id));
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

    /// The level of a relation that has too low a one.
    fn low_relation(&self, properties: &Properties) -> Option<(f64, f64)> {
        let least = self.integrity?;
        let own = *properties.get(INTEGRITY)?;
        (own < least).then_some((own, least))
    }

    /// Everything for which a substitution falls short; empty for one that the search would give.
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
            let low = self.low_relation(&knowledge.relations()[relation].properties);
            found.extend(low.map(|(own, least)| Shortfall::RelationIntegrity(relation, own, least)));
        }
        let admitted = |signal: &SignalId| self.admits(knowledge, &suspects, *signal);
        let source = |variable| {
            let signals = usable(knowledge, options, variable).filter(admitted);
            Cost::of_source(knowledge, variable, signals)
        };
        found.extend(self.beyond(Cost::along(knowledge, substitution, source)));
        if found.is_empty() && self.limits_paths() {
            // Each limit may be met by other signals than the next one.
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

    /// The ways of a substitution with signals that do not fall short on their own, as many as are looked at.
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

    /// Everything for which a way falls short: a substitution whose signals are chosen.
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
            let low = self.low_relation(&knowledge.relations()[relation].properties);
            found.extend(low.map(|(own, least)| Shortfall::RelationIntegrity(relation, own, least)));
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

    /// What is beyond the limits; without a signal for a source there is no end to anything, and that is told already.
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
            // A constant holds always.
            && self.max_period.is_none_or(|most| cost.period <= most || cost.period == Span::MAX)
            && self.max_width.is_none_or(|most| cost.width <= most * (1.0 + SLACK))
    }
}

/// By how much a width may be beyond its limit through rounding.
const SLACK: f64 = 1e-9;

/// How many choices of signals of a substitution are looked at for one that meets the requirements.
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

/// What adds up from the sources to the sink, at least.
#[derive(Clone, Copy, Debug)]
struct Cost {
    latency: Span,
    /// SI.
    width: f64,
    /// That of the fastest signal; without end of constants.
    period: Span,
}

impl Cost {
    const NONE: Cost = Cost { latency: Span::ZERO, width: 0.0, period: Span::ZERO };
    const MAX: Cost = Cost { latency: Span::MAX, width: f64::INFINITY, period: Span::MAX };

    /// What a complete substitution costs, from what its sources do.
    fn along(
        knowledge: &KnowledgeBase,
        substitution: &Substitution,
        source: impl Fn(VariableId) -> Cost,
    ) -> Cost {
        let source = |&variable: &VariableId| (variable, source(variable));
        let mut known: BTreeMap<VariableId, Cost> = substitution.sources.iter().map(source).collect();
        for step in &substitution.steps {
            let of = |input| known.get(&input).copied().unwrap_or(Cost::NONE);
            known.insert(step.output, Cost::of_step(knowledge, *step, of));
        }
        known.get(&substitution.sink).copied().unwrap_or(Cost::NONE)
    }

    /// Of the best signals of a provided variable; a constant has the width of its bounds.
    fn of_source(
        knowledge: &KnowledgeBase,
        variable: VariableId,
        signals: impl Iterator<Item = SignalId>,
    ) -> Cost {
        if let Some(constant) = knowledge.variables()[variable].constant {
            return Cost { latency: Span::ZERO, width: constant.width(), period: Span::MAX };
        }
        signals.map(|signal| &knowledge.signals()[signal]).fold(Cost::MAX, |least, signal| {
            let width = signal.value_error.hi - signal.value_error.lo;
            let period = signal.rate_hz.map_or(Span::ZERO, |rate| Span::from_seconds(1.0 / rate));
            least.least(Cost { latency: signal.delay, width, period })
        })
    }

    fn of_step(knowledge: &KnowledgeBase, step: Step, of: impl Fn(VariableId) -> Cost) -> Cost {
        let relation = &knowledge.relations()[step.relation];
        let latency = relation.needs(step.output).map(|input| of(input).latency).max().unwrap_or_default();
        let period = relation.needs(step.output).map(|input| of(input).period).min().unwrap_or(Span::MAX);
        let Some(formula) = relation.formula(step.output) else {
            return Cost { latency, width: 0.0, period };
        };
        let width = |symbol: Symbol| of(VariableId::from_index(symbol.0 as usize)).width;
        Cost { latency: latency + looks_back(formula), width: least_width(formula, &width), period }
    }

    fn least(self, other: Cost) -> Cost {
        Cost {
            latency: self.latency.min(other.latency),
            width: self.width.min(other.width),
            period: self.period.min(other.period),
        }
    }
}

/// The longest time that operators on a way to a leaf look back.
fn looks_back(formula: &Formula) -> Span {
    let below = formula.arguments().iter().map(looks_back).max().unwrap_or_default();
    match formula.operation() {
        Operation::Derivative(window) | Operation::Delay(window) | Operation::MovingMean(window) => {
            below + window
        }
        _ => below,
    }
}

/// The width that the interval evaluation of a formula has at least, from the widths of its variables.
///
/// Sums and differences add widths up, a constant factor scales them; whatever else may narrow them counts as
/// nothing.
fn least_width(formula: &Formula, width: &dyn Fn(Symbol) -> f64) -> f64 {
    let argument =
        |at: usize| formula.arguments().get(at).map_or(0.0, |argument| least_width(argument, width));
    let factor = |at: usize| {
        let constant = formula.arguments().get(at).and_then(Formula::as_constant);
        constant.map_or(0.0, |constant| constant.bounds.mignitude())
    };
    match formula.operation() {
        Operation::Constant(constant) => constant.bounds.width(),
        Operation::Symbol(symbol) => width(symbol),
        Operation::Unary(Unary::Neg) | Operation::Delay(_) => argument(0),
        Operation::Binary(Binary::Add | Binary::Sub) => argument(0) + argument(1),
        Operation::Binary(Binary::Mul) => (factor(0) * argument(1)).max(factor(1) * argument(0)),
        Operation::Binary(Binary::Div) => {
            let divisor = formula.arguments().get(1).and_then(Formula::as_constant);
            divisor.map_or(0.0, |divisor| argument(0) / divisor.bounds.magnitude())
        }
        _ => 0.0,
    }
}

/// How often lower bounds are carried on from the sources where places need each other in a circle.
const ROUNDS: usize = 4;

/// The requirements along substitutions, as one search checks them.
#[derive(Debug)]
pub(super) struct Paths<'a> {
    knowledge: &'a KnowledgeBase,
    options: Options,
    requirements: Requirements,
    /// What each variable of the scope costs at least, whatever is chosen.
    least: BTreeMap<VariableId, Cost>,
}

impl<'a> Paths<'a> {
    /// For a scope that was made with the same, narrowed options. Complexity: O(scope).
    pub(super) fn new(
        knowledge: &'a KnowledgeBase,
        requirements: Requirements,
        options: Options,
        subproblem: &Subproblem,
    ) -> Paths<'a> {
        let mut paths = Paths { knowledge, options, requirements, least: BTreeMap::new() };
        paths.least.extend(subproblem.places().map(|place| (subproblem.variable(place), Cost::NONE)));
        // From below, so that the bounds are true after every round; of a tree one is enough.
        for _ in 0..ROUNDS {
            for place in subproblem.places().rev() {
                let costs = subproblem.choices(place).map(|choice| paths.cost(subproblem, place, choice));
                let least = costs.fold(Cost::MAX, Cost::least);
                paths.least.insert(subproblem.variable(place), least);
            }
        }
        paths
    }

    fn cost(&self, subproblem: &Subproblem, place: Place, choice: ChoiceId) -> Cost {
        let output = subproblem.variable(place);
        match subproblem.choice(choice).relation {
            Some(relation) => {
                Cost::of_step(self.knowledge, Step { relation, output }, |input| self.least(input))
            }
            None => self.source(output),
        }
    }

    fn source(&self, variable: VariableId) -> Cost {
        Cost::of_source(self.knowledge, variable, usable(self.knowledge, &self.options, variable))
    }

    fn least(&self, variable: VariableId) -> Cost {
        self.least.get(&variable).copied().unwrap_or_else(|| self.source(variable))
    }

    /// Whether some completion of these steps, which are in their order of computation, may meet the requirements.
    ///
    /// Complexity: O(n log n) for n inputs of the steps.
    pub(super) fn allow(&self, root: VariableId, steps: &[Step]) -> bool {
        let mut known: BTreeMap<VariableId, Cost> = BTreeMap::new();
        for step in steps {
            let of = |input| known.get(&input).copied().unwrap_or_else(|| self.least(input));
            known.insert(step.output, Cost::of_step(self.knowledge, *step, of));
        }
        let cost = known.get(&root).copied().unwrap_or_else(|| self.least(root));
        self.requirements.allow(cost)
    }

    /// Whether a complete substitution meets the requirements.
    pub(super) fn admit(&self, substitution: &Substitution) -> bool {
        let Paths { knowledge, options, requirements, .. } = self;
        let is_short = |way: &Way| !requirements.shortfalls_of_way(knowledge, way).is_empty();
        requirements.allow(Cost::along(knowledge, substitution, |source| self.source(source)))
            && !requirements.ways(knowledge, options, &SignalSet::new(), substitution).iter().all(is_short)
    }
}
