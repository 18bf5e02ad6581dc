//! What contracts admit after a loss, and what would happen to every need if a piece of evidence failed.

use super::MOST;
use crate::show;
use serde_json::{Value, json};
use shsa_core::analysis::{Failure, Prospect, Serving};
use shsa_core::assurance::{Admitted, Assurance, Bounds, Ground, Reading, Search};
use shsa_core::interval::Truth;
use shsa_core::knowledge::{
    ContractId, EvidenceSource, KnowledgeBase, NeedId, Policy, SignalId, VariableId, Watched,
};
use shsa_core::plan::{Admission, BestFirst, Graph, Options, Plan, Preparation};
use shsa_core::substitution::{Step, Substitution, Way};
use shsa_drawing::case::words;
use shsa_report::Paint;
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};

/// The contracts of a model; none where no need demands anything.
pub(super) struct Contracts<'a> {
    pub(super) knowledge: &'a KnowledgeBase,
    graph: &'a Graph,
    assurance: Option<Assurance>,
    /// What can be given at best for each need, as far as it was asked.
    bounds: RefCell<BTreeMap<NeedId, Bounds>>,
}

/// What the contracts of all needs of a variable admit.
#[derive(Debug)]
struct All<'a>(Vec<Search<'a>>);

impl Admission for All<'_> {
    fn may_admit(&self, steps: &[Step]) -> bool {
        self.0.iter().all(|search| search.may_admit(steps))
    }

    fn admits(&self, substitution: &Substitution) -> bool {
        self.0.iter().all(|search| search.admits(substitution))
    }
}

impl<'a> Contracts<'a> {
    pub(super) fn new(knowledge: &'a KnowledgeBase, graph: &'a Graph) -> Contracts<'a> {
        Contracts { knowledge, graph, assurance: Assurance::new(knowledge), bounds: RefCell::default() }
    }

    /// The needs of a variable that demand something.
    fn demanding(&self, variable: VariableId) -> impl Iterator<Item = (NeedId, &Assurance)> {
        let needs = self.knowledge.needs().enumerate().filter(move |(_, need)| need.variable == variable);
        needs.filter_map(|(need, _)| {
            self.assurance.as_ref().filter(|assurance| assurance.demands(need)).map(|it| (need, it))
        })
    }

    /// What the contracts of all needs admit, while all that is not lost is as it should be. Where they admit nothing in common, the
    /// contracts of needs that stop without decide alone; `None` where no need does.
    pub(super) fn plan(
        &self,
        preparation: &Preparation,
        variable: VariableId,
        lost: &[SignalId],
    ) -> Option<Plan> {
        let demanding: Vec<_> = self.demanding(variable).collect();
        let stops = |need| Assurance::policy(self.knowledge, need) == Policy::Stop;
        let strict: Vec<_> = demanding.iter().copied().filter(|(need, _)| stops(*need)).collect();
        let is_all = strict.len() == demanding.len();
        let plan = self.admitted(preparation, variable, lost, &demanding);
        match plan.filter(|plan| is_all || !plan.substitutions.is_empty()) {
            None => self.admitted(preparation, variable, lost, &strict),
            plan => plan,
        }
    }

    /// What the contracts of some needs admit; `None` without needs.
    fn admitted(
        &self,
        preparation: &Preparation,
        variable: VariableId,
        lost: &[SignalId],
        needs: &[(NeedId, &Assurance)],
    ) -> Option<Plan> {
        if needs.is_empty() {
            return None;
        }
        let truth = |_: ContractId, watched: &Watched, _: &Way| match watched.source {
            EvidenceSource::Signal(signal, _) if lost.contains(&signal) => Reading::UNKNOWN,
            _ => Reading::lasting(Truth::True),
        };
        let mut bounds = self.bounds.borrow_mut();
        for &(need, assurance) in needs {
            let bounds = bounds.entry(need).or_insert_with(|| assurance.bounds(self.knowledge, need));
            bounds.read(self.knowledge, &truth);
        }
        let mut searches: Vec<Search<'_>> = Vec::new();
        for &(need, assurance) in needs {
            let search = Search::new(self.knowledge, assurance, need, &truth, lost);
            searches.extend(bounds.get(&need).map(|bounds| search.within(bounds)));
        }
        let Preparation { options, requirements, limits, .. } = preparation;
        let forbidden_signals = [options.forbidden_signals.as_slice(), lost].concat();
        let options = Options { forbidden_signals, ..options.clone() };
        let search =
            BestFirst::meeting(self.knowledge, self.graph, variable, &options, requirements, *limits);
        let all = All(searches);
        Some(Plan::of(&mut search.admitted_by(&all), MOST))
    }

    /// The signals that evidence is about, where contracts demand something for a variable.
    pub(super) fn observed(&self, variable: VariableId) -> impl Iterator<Item = SignalId> {
        let is_demanding = self.demanding(variable).next().is_some();
        let rows = self.knowledge.contracts().rows().iter().filter(move |_| is_demanding);
        let of = |watched: &Watched| match watched.source {
            EvidenceSource::Signal(signal, _) => Some(signal),
            EvidenceSource::Source(_) | EvidenceSource::Specification(_) | EvidenceSource::Attested => None,
        };
        let signals: BTreeSet<SignalId> = rows.flat_map(|row| &row.evidence).filter_map(of).collect();
        signals.into_iter()
    }

    fn prospects(&self, variables: &[VariableId]) -> impl Iterator<Item = Prospect> {
        let needs = variables.iter().flat_map(|variable| self.demanding(*variable));
        needs.map(|(need, assurance)| Prospect::new(self.knowledge, assurance, self.graph, need))
    }

    fn level(&self, admitted: Admitted) -> Option<String> {
        admitted.level.map(|level| self.knowledge.contracts().scales().written(level))
    }

    fn name(&self, failure: &Failure) -> String {
        format!("{} of {}", failure.watched.name, self.knowledge.contracts().rows()[failure.contract].name)
    }

    pub(super) fn to_json(&self, variables: &[VariableId]) -> Value {
        let served = |prospect: &Prospect, serving: Option<Serving>| {
            serving.and_then(|Serving { way, admitted }| {
                Some(json!({
                    "source": prospect.ways.get(way)?.way.describe(self.knowledge),
                    "admitted": admitted.ground.name(),
                    "level": self.level(admitted),
                }))
            })
        };
        let one = |prospect: Prospect| {
            let failure = |it: Failure| {
                json!({
                    "of": self.knowledge.contracts().rows()[it.contract].name,
                    "evidence": it.watched.name,
                    "observed": words::watched(self.knowledge, &it.watched),
                    "then": served(&prospect, it.then),
                })
            };
            json!({
                "need": self.knowledge.need_name(prospect.need),
                "now": served(&prospect, prospect.serving(self.knowledge, |it| it.at_best)),
                "evidence": prospect.failures(self.knowledge).into_iter().map(failure).collect::<Vec<_>>(),
                "complete": prospect.is_complete,
            })
        };
        self.prospects(variables).map(one).collect()
    }

    /// A table a need, each after a blank line.
    pub(super) fn to_text(&self, variables: &[VariableId]) -> String {
        self.prospects(variables).map(|prospect| format!("\n\n{}", self.section(&prospect))).collect()
    }

    fn section(&self, prospect: &Prospect) -> String {
        let name = show::style().paint(Paint::Bold, self.knowledge.need_name(prospect.need));
        let now = prospect.serving(self.knowledge, |candidacy| candidacy.at_best);
        let head = match now {
            None => return format!("{name}: contracts admit nothing, whatever is observed"),
            Some(serving) => format!("{name} by contract: now {}", self.served(prospect, serving).join(", ")),
        };
        let failures = prospect.failures(self.knowledge);
        let (same, changed): (Vec<&Failure>, Vec<&Failure>) = failures.iter().partition(|it| it.then == now);
        let row = |failure: &Failure| {
            let then = failure.then.map(|serving| self.served(prospect, serving));
            let then =
                then.unwrap_or_else(|| [show::style().paint(Paint::Red, "nothing"), String::new()].into());
            [vec![self.name(failure)], then].concat()
        };
        let mut lines = vec![head];
        if !changed.is_empty() {
            let rows = changed.into_iter().map(row).collect();
            lines.push(show::style().table(&["evidence that fails", "serves then", "level"], rows));
        }
        if !same.is_empty() {
            let names: Vec<String> = same.into_iter().map(|failure| self.name(failure)).collect();
            lines.push(show::style().wrapped(&format!("no difference alone: {}", names.join(", ")), 0));
        }
        lines.join("\n")
    }

    /// What serves, and the level with the ground where that is not what was demanded.
    fn served(&self, prospect: &Prospect, Serving { way, admitted }: Serving) -> Vec<String> {
        let source = prospect.ways.get(way).map(|it| it.way.describe(self.knowledge));
        let level = self.level(admitted).unwrap_or_else(|| "no level".to_owned());
        let level = match admitted.ground {
            Ground::Met => level,
            ground => format!("{level} ({})", ground.name()),
        };
        vec![source.unwrap_or_default(), level]
    }
}
