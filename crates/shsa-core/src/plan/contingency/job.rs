//! The preparation of one variable: a search for each loss that can change its plan.

use super::super::best_first::BestFirst;
use super::super::graph::{Graph, Options, View};
use super::super::utility::Weight;
use super::super::{Plan, Scratch, StopReason};
use super::derivation::Derivations;
use super::prepare::{Entry, Preparation, Prepared, with, without};
use super::reach::{Reach, Reached};
use crate::knowledge::{KnowledgeBase, SignalId, VariableId};
use alloc::collections::BTreeMap;
use alloc::vec::Vec;

/// The inputs of plans.
#[derive(Clone, Copy)]
pub(super) struct Inputs<'a> {
    pub(super) knowledge: &'a KnowledgeBase,
    pub(super) graph: &'a Graph,
    pub(super) derivations: &'a Derivations,
    pub(super) preparation: &'a Preparation,
    /// The options of the preparation, without elements that fall short of its requirements on their own.
    pub(super) options: &'a Options,
}

/// Reusable working memory for making plans.
#[derive(Clone, Debug, Default)]
pub(super) struct Workshop {
    scratch: Scratch,
    reach: Reach,
}

impl Workshop {
    /// All plans of a variable, and the work they took; `None` when `work` is not enough for the first.
    pub(super) fn prepare(
        &mut self,
        inputs: Inputs,
        variable: VariableId,
        work: u64,
    ) -> (Option<Prepared>, u64) {
        self.reach.fit(inputs.graph.variables());
        let left = work.min(inputs.preparation.work_each);
        let (entries, plans, reads) = (BTreeMap::new(), Vec::new(), Vec::new());
        let workshop = self;
        let job = Job { workshop, inputs, variable, entries, plans, reads, left };
        let (prepared, unused) = job.run();
        let work = left - unused;
        let enough = if unused == 0 { u64::MAX } else { work };
        (prepared.map(|prepared| Prepared { work: enough, ..prepared }), work)
    }
}

/// The knowledge with some signals lost: the best plans, and the variables that a search for them can reach.
struct Situation<'a> {
    view: View<'a>,
    /// The place of the plan.
    plan: usize,
    /// Whether no limit has stopped the search.
    proven: bool,
    /// The variables of the plan, ascending.
    used: Vec<VariableId>,
    /// The reached variables with nothing lost; after a loss, those reached in addition.
    reached: Reached,
    /// The signals that carry the reached variables, ascending.
    matters: Vec<SignalId>,
}

struct Job<'a> {
    workshop: &'a mut Workshop,
    inputs: Inputs<'a>,
    variable: VariableId,
    /// By the lost signals: the place of the plan, and the signals whose loss matters then.
    entries: BTreeMap<Vec<SignalId>, (usize, Vec<SignalId>)>,
    plans: Vec<Plan>,
    reads: Vec<VariableId>,
    /// The remaining work.
    left: u64,
}

impl<'a> Job<'a> {
    fn run(mut self) -> (Option<Prepared>, u64) {
        let Some(base) = self.without(&[], None) else { return (None, 0) };
        let events = self.inputs.derivations.with_origins(&base.matters);
        let complete = self.losses(&base, &events).is_some();
        let entry = |(lost, (plan, matters))| Entry { lost, plan, matters };
        let entries = self.entries.into_iter().map(entry).collect();
        self.reads.sort_unstable();
        self.reads.dedup();
        let (plans, reads) = (self.plans, self.reads);
        (Some(Prepared { entries, plans, events, reads, complete, work: 0 }), self.left)
    }

    /// Returns `None` when the work is not enough.
    fn losses(&mut self, base: &Situation<'a>, events: &[SignalId]) -> Option<()> {
        let mut leaders = Vec::new();
        for &signal in &base.matters {
            let situation = self.after(base, base, &[signal])?;
            leaders.extend(situation.map(|situation| (signal, situation)));
        }
        for &event in events {
            self.event(base, &[event])?;
        }
        if self.inputs.preparation.pairs {
            self.pairs(base, &leaders)?;
            self.pairs_of_events(base, events)?;
        }
        Some(())
    }

    /// The loss of some signals and all that are derived from them; returns the signals that matter after it.
    fn event(&mut self, base: &Situation<'a>, lost: &[SignalId]) -> Option<Vec<SignalId>> {
        let lost = self.inputs.derivations.with_derived(lost);
        let (mut set, mut matters) = (Vec::new(), base.matters.clone());
        loop {
            let all = with(&set, &lost, &matters);
            if all == set {
                return Some(matters);
            }
            if !self.entries.contains_key(&all) {
                self.after(base, base, &all)?;
            }
            matters = self.entries.get(&all)?.1.clone();
            set = all;
        }
    }

    fn pairs_of_events(&mut self, base: &Situation<'a>, events: &[SignalId]) -> Option<()> {
        for &one in events {
            let matters = self.event(base, &[one])?;
            for &other in events.iter().chain(&self.inputs.derivations.with_origins(&matters)) {
                self.pay(1)?;
                // Without derived signals, the loss is one of the pairs.
                if self.inputs.derivations.with_derived(&[one, other]).len() > 2 {
                    self.event(base, &[one, other])?;
                }
            }
        }
        Some(())
    }

    /// A pair with a signal whose loss alone changes the plan is compared with that loss; other pairs are compared with no loss.
    fn pairs(&mut self, base: &Situation<'a>, leaders: &[(SignalId, Situation<'a>)]) -> Option<()> {
        let leads = |signal: &SignalId| leaders.binary_search_by_key(signal, |(leader, _)| *leader).is_ok();
        for (leader, situation) in leaders {
            let done = |other: &SignalId| other == leader || (other < leader && leads(other));
            for &other in base.matters.iter().chain(&situation.matters).filter(|other| !done(other)) {
                self.after(base, situation, &[*leader.min(&other), *leader.max(&other)])?;
            }
        }
        let followers: Vec<SignalId> = base.matters.iter().copied().filter(|signal| !leads(signal)).collect();
        for (at, &one) in followers.iter().enumerate() {
            for &other in followers.iter().skip(at + 1) {
                self.after(base, base, &[one, other])?;
            }
        }
        Some(())
    }

    /// Adds the entry of a loss (ascending) that comes after a `known` situation; returns the new situation if a search is
    /// needed. `None` when the work is not enough.
    #[expect(clippy::option_option, reason = "not enough work, or nothing new")]
    fn after(
        &mut self,
        base: &Situation<'a>,
        known: &Situation<'a>,
        lost: &[SignalId],
    ) -> Option<Option<Situation<'a>>> {
        let view = View::new(self.inputs.graph, &without(self.inputs.options, lost));
        if !self.makes_no_difference(base, known, &view, lost)? {
            return self.without(lost, Some((base, view))).map(Some);
        }
        // With nothing lost before, variables beyond the lost signals cannot help either.
        let matters = if core::ptr::eq(base, known) { &[][..] } else { &known.matters };
        let matters = matters.iter().filter(|signal| !lost.contains(signal)).copied().collect();
        self.entries.insert(lost.to_vec(), (known.plan, matters));
        Some(None)
    }

    /// Whether the known plan stays the best after a loss: because no search can read the lost signals, or because the loss
    /// improves no relation that could read them.
    ///
    /// The latter: the plan uses no variable that the loss changes, so its weight stays. Take any other substitution that is
    /// valid after the loss, and regard the lost variables as provided again. This removes relations, and makes none heavier if
    /// no relation that reads the lost variables is lighter after the loss. The result is a substitution of before the loss that
    /// is not better than the plan, so the original is not better either.
    fn makes_no_difference(
        &mut self,
        base: &Situation<'a>,
        known: &Situation<'a>,
        view: &View<'a>,
        lost: &[SignalId],
    ) -> Option<bool> {
        if self.inputs.preparation.requirements.limits_paths() {
            // A provided variable may be older, or less exact, than a computed one.
            return Some(false);
        }
        for variable in lost.iter().filter_map(|&signal| self.inputs.graph.carried(signal)) {
            let (before, after) = (known.view.status(variable), view.status(variable));
            if before == after {
                continue;
            }
            // A signal with a weight may weigh more than its replacement.
            let was_heavy = !after.provided && before.weight != Weight::ZERO;
            if was_heavy || !known.proven || known.used.binary_search(&variable).is_ok() {
                return Some(false);
            }
            let beyond = if core::ptr::eq(base, known) { &[][..] } else { known.reached.readings(variable) };
            for reading in base.reached.readings(variable).iter().chain(beyond) {
                self.pay(1 + self.inputs.graph.inputs(reading.producer.relation).len() as u64)?;
                let weight = |view: &View| view.weight(&reading.producer, reading.place);
                if weight(view) < weight(&known.view) {
                    return Some(false);
                }
            }
        }
        self.pay(1)?;
        Some(true)
    }

    /// Searches without some signals; `None` when the work is not enough.
    fn without(
        &mut self,
        lost: &[SignalId],
        after: Option<(&Situation<'a>, View<'a>)>,
    ) -> Option<Situation<'a>> {
        let options = without(self.inputs.options, lost);
        let (view, reached) = match after {
            Some((base, view)) => {
                let reached = self.reach_beyond(base, &view, lost, &options)?;
                (view, reached)
            }
            None => {
                let view = View::new(self.inputs.graph, &options);
                let reached = self.workshop.reach.from(&view, self.variable, &options, self.left)?;
                (view, reached)
            }
        };
        self.pay(reached.work)?;
        let Inputs { knowledge, graph, preparation, .. } = self.inputs;
        let Preparation { count, limits, requirements, .. } = preparation;
        let search =
            BestFirst::with_scratch(&mut self.workshop.scratch, graph, self.variable, &options, *limits);
        let plan = Plan::of(&mut search.along_paths(knowledge, requirements, options), *count);
        self.left = self.left.saturating_sub(plan.expanded);
        self.reads.extend_from_slice(&reached.variables);
        let matters = self.carriers(&reached);
        self.entries.insert(lost.to_vec(), (self.plans.len(), matters.clone()));
        let situation = Situation {
            view,
            plan: self.plans.len(),
            proven: matches!(plan.stop, StopReason::Complete | StopReason::Found(_)),
            used: used(&plan),
            reached,
            matters,
        };
        self.plans.push(plan);
        Some(situation)
    }

    fn reach_beyond(
        &mut self,
        base: &Situation<'a>,
        view: &View<'a>,
        lost: &[SignalId],
        options: &Options,
    ) -> Option<Reached> {
        // A search decides again over everything that it can reach with nothing lost.
        self.pay(base.reached.work)?;
        let is_lost = |&variable: &VariableId| {
            base.view.status(variable).provided
                && !view.status(variable).provided
                && !base.reached.readings(variable).is_empty()
                && !options.substitute_provided
        };
        let carried = lost.iter().filter_map(|&signal| self.inputs.graph.carried(signal));
        let mut lost: Vec<_> = carried.filter(is_lost).collect();
        lost.sort_unstable();
        lost.dedup();
        self.workshop.reach.beyond(view, lost, options, self.left)
    }

    fn pay(&mut self, work: u64) -> Option<()> {
        self.left = self.left.checked_sub(work)?;
        Some(())
    }

    /// The usable signals that carry the reached variables, ascending.
    fn carriers(&self, reached: &Reached) -> Vec<SignalId> {
        let forbidden = &self.inputs.options.forbidden_signals;
        let carriers =
            reached.variables.iter().flat_map(|&variable| self.inputs.graph.usable_carriers(variable));
        let mut carriers: Vec<_> = carriers.filter(|signal| !forbidden.contains(signal)).collect();
        carriers.sort_unstable();
        carriers
    }
}

fn used(plan: &Plan) -> Vec<VariableId> {
    let mut used: Vec<_> =
        plan.substitutions.iter().flat_map(|(substitution, _)| substitution.variables()).collect();
    used.sort_unstable();
    used.dedup();
    used
}
