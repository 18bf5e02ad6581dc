//! The exact search: the best substitutions in the order of their utility, without finding all.
//!
//! A* over partial substitutions (Hart, Nilsson, Raphael 1968, doi:10.1109/TSSC.1968.300136). The variables of a partial
//! substitution are decided breadth first, so each substitution is built in exactly one way; the bound is the weight of the
//! decided relations plus the lower bounds of the undecided places ([`Subproblem`] explains them). On trees the bound is exact,
//! and the first answer is read off it. On graphs with shared variables the best substitution is NP-hard to find (it is the
//! delete relaxation of planning: Bylander 1994, doi:10.1016/0004-3702(94)90081-7), hence the limits.

mod open;

pub(super) use open::Open;

use super::admission::Admission;
use super::decisions::Decisions;
use super::graph::{Graph, Options, View};
use super::greedy;
use super::limits::{Limits, StopReason};
use super::progress::Progress;
use super::requirements::{Paths, Requirements};
use super::scratch::{Held, Scratch};
use super::subproblem::{Rules, Subproblem};
use crate::knowledge::{KnowledgeBase, VariableId};
use crate::substitution::Substitution;
use alloc::boxed::Box;
use alloc::vec::Vec;

/// A search that returns one substitution after another, best first.
///
/// Ties are broken by fewer relations, then by file order. The order considers the first variable, breadth first from the root,
/// that two substitutions know in different ways: the relation that is earlier in the model comes first, and a variable's own
/// signals come before its relations.
#[derive(Debug)]
pub struct BestFirst<'a> {
    graph: &'a Graph,
    root: VariableId,
    /// The working memory, with the subproblem.
    scratch: Held<'a>,
    /// The open states; made when the first answer cannot be read off, or a second one is wanted.
    open: Option<Box<Open>>,
    limits: Limits,
    /// The decisions of the answer that was read off.
    read: u64,
    found: usize,
    stop: Option<StopReason>,
    /// The requirements along substitutions.
    paths: Option<Box<Paths<'a>>>,
    /// The additional check of answers.
    admission: Option<&'a dyn Admission>,
    /// The answers that the caller keeps, in states.
    kept: usize,
    /// The utility of the answer that was read off.
    rated: Option<f64>,
}

impl<'a> BestFirst<'a> {
    /// Starts a search for ways of knowing `root`. Complexity: O(part of the graph that can be reached).
    #[must_use]
    pub fn new(graph: &'a Graph, root: VariableId, options: &Options, limits: Limits) -> BestFirst<'a> {
        BestFirst::over(Held::Own(Box::default()), graph, root, options, limits)
    }

    /// As [`BestFirst::new`], in the working memory of earlier searches.
    #[must_use]
    pub fn with_scratch(
        scratch: &'a mut Scratch,
        graph: &'a Graph,
        root: VariableId,
        options: &Options,
        limits: Limits,
    ) -> BestFirst<'a> {
        BestFirst::over(Held::Lent(scratch), graph, root, options, limits)
    }

    fn over(
        mut scratch: Held<'a>,
        graph: &'a Graph,
        root: VariableId,
        options: &Options,
        limits: Limits,
    ) -> BestFirst<'a> {
        let Scratch { marks, subproblem, .. } = scratch.get_mut();
        marks.fit(graph.variables(), graph.relations());
        let rules =
            Rules { substitute_provided: options.substitute_provided, without_empty: options.without_empty };
        subproblem.find(&View::new(graph, options), root, rules, marks);
        let stop = BestFirst::refusal(graph, subproblem);
        BestFirst {
            graph,
            root,
            scratch,
            open: None,
            limits,
            read: 0,
            found: 0,
            stop,
            paths: None,
            admission: None,
            kept: 0,
            rated: None,
        }
    }

    /// Starts a search for ways of knowing `root` that meet requirements; substitutions that cannot meet them are pruned inside
    /// the search. Complexity: O(model) for the requirements on single signals, and O(n log n) for each expansion of n decisions
    /// with others.
    #[must_use]
    pub fn meeting(
        knowledge: &'a KnowledgeBase,
        graph: &'a Graph,
        root: VariableId,
        options: &Options,
        requirements: &Requirements,
        limits: Limits,
    ) -> BestFirst<'a> {
        let options = requirements.narrowed(knowledge, options);
        BestFirst::new(graph, root, &options, limits).along_paths(knowledge, requirements, options)
    }

    /// Adds the requirements along substitutions to a search that was started with these, narrowed options.
    pub(super) fn along_paths(
        mut self,
        knowledge: &'a KnowledgeBase,
        requirements: &Requirements,
        options: Options,
    ) -> BestFirst<'a> {
        if requirements.limits_paths() {
            let paths = Paths::new(knowledge, requirements.clone(), options, self.subproblem());
            self.paths = Some(Box::new(paths));
        }
        self
    }

    /// Restricts the answers to admitted ones; what cannot be admitted is pruned inside the search.
    #[must_use]
    pub fn admitted_by(self, admission: &'a dyn Admission) -> BestFirst<'a> {
        BestFirst { admission: Some(admission), ..self }
    }

    /// Whether more than the graph restricts the answers.
    fn is_restricted(&self) -> bool {
        self.paths.is_some() || self.admission.is_some()
    }

    fn subproblem(&self) -> &Subproblem {
        &self.scratch.get().subproblem
    }

    /// An empty answer, to be filled.
    pub(super) fn blank(&self) -> Substitution {
        Substitution { sink: self.root, steps: Vec::new(), sources: Vec::new() }
    }

    /// Counts answers that the caller keeps towards the limit of states.
    pub(super) fn keep(&mut self, states: usize) {
        self.kept += states;
    }

    /// The number of ways of computing variables that the search may visit: the cost of its start, and of [`BestFirst::any`].
    #[must_use]
    pub fn reach(&self) -> usize {
        self.subproblem().count()
    }

    /// The number of partial and complete substitutions dropped because they cannot meet the requirements.
    #[must_use]
    pub fn pruned(&self) -> u64 {
        self.open.as_ref().map_or(0, |open| open.pruned)
    }

    /// A search of its own over the same subproblem, from the start.
    pub(super) fn begin(&self) -> Open {
        Open::new(self.subproblem())
    }

    /// Distributes the open states.
    pub(super) fn deal(&self, open: Open, parts: usize) -> Vec<Open> {
        let with = |frontier| Open { frontier, ..self.begin() };
        let mut dealt: Vec<Open> = open.frontier.deal(parts).into_iter().map(with).collect();
        if let Some(first) = dealt.first_mut() {
            // Past expansions and answers count once.
            (first.expanded, first.given) = (open.expanded, open.given);
        }
        dealt
    }

    /// The reason why the search gives nothing more, if it does not.
    pub(super) fn stopped(&self) -> Option<StopReason> {
        self.stop
    }

    /// The substitution of complete decisions.
    pub(super) fn substitution(&self, open: &Open) -> Substitution {
        self.graph.substitution(self.root, open.decisions.steps(self.subproblem()))
    }

    fn refusal(graph: &Graph, subproblem: &Subproblem) -> Option<StopReason> {
        if !graph.is_monotone() {
            return Some(StopReason::NotMonotone);
        }
        subproblem.root().is_none().then_some(StopReason::Complete)
    }

    /// Why the last call of `next` returned nothing; [`StopReason::Found`] while there may be more.
    #[must_use]
    pub fn stop(&self) -> StopReason {
        self.stop.unwrap_or(StopReason::Found(self.found))
    }

    /// The number of decisions, including repeated ones after a jump.
    #[must_use]
    pub fn expanded(&self) -> u64 {
        self.read + self.open.as_ref().map_or(0, |open| open.expanded)
    }

    /// An upper bound of the utility of further substitutions; the lowest utility when there are none.
    #[must_use]
    pub fn bound(&self) -> f64 {
        let scale = self.graph.scale();
        let lower_bound = || self.subproblem().root().map(|root| self.subproblem().lower_bound(root));
        let open = || self.open.as_ref().map_or_else(lower_bound, |open| open.frontier.open_bound());
        match self.stop {
            Some(StopReason::Complete) => scale.worst(),
            Some(StopReason::NotMonotone) => scale.best(),
            _ => match (self.rated, &self.open) {
                // Further answers are not better than the one that was read off.
                (Some(utility), None) => utility,
                _ => open().map_or(scale.worst(), |bound| scale.utility(bound)),
            },
        }
    }

    /// A valid substitution, perhaps not the best: for a search that a limit ends without an answer.
    ///
    /// On trees it is the best one. Complexity: O(n log n) for n inputs that can be reached.
    #[must_use]
    pub fn any(&self) -> Option<(Substitution, f64)> {
        if self.stop == Some(StopReason::NotMonotone) {
            return None;
        }
        let subproblem = self.subproblem();
        let choices = greedy::choices(subproblem);
        let mut decisions = Decisions::new(subproblem);
        while let Some(choice) = decisions.next().and_then(|place| choices[place]) {
            decisions.take(subproblem, choice);
        }
        let complete =
            subproblem.root().is_some() && decisions.next().is_none() && self.meets(&decisions).is_some();
        complete.then(|| self.answer(&decisions))
    }

    fn answer(&self, decisions: &Decisions) -> (Substitution, f64) {
        let substitution = self.graph.substitution(self.root, decisions.steps(self.subproblem()));
        (substitution, self.graph.scale().utility(decisions.bound()))
    }

    /// The best substitution of a subproblem without a search; returns its utility.
    fn read_off(&mut self, answer: &mut Substitution) -> Option<f64> {
        let Scratch { subproblem, reading, .. } = self.scratch.get_mut();
        let weight = subproblem.lower_bound(subproblem.root()?);
        let decisions = subproblem.read_off(self.graph, reading, answer);
        if decisions > self.limits.expansions {
            self.stop = Some(StopReason::LimitExpansions);
            return None;
        }
        self.read = decisions;
        let utility = self.graph.scale().utility(weight);
        self.rated = Some(utility);
        Some(utility)
    }

    /// The next best substitution, by search.
    fn search(&mut self) -> Option<(Substitution, f64)> {
        let mut open = self.open.take().unwrap_or_else(|| Box::new(Open::new(self.subproblem())));
        let mut found = None;
        while self.stop.is_none() && found.is_none() {
            self.stop = open.limit(self.limits, self.kept);
            if self.stop.is_none() {
                match self.advance(&mut open) {
                    Progress::Answer => {
                        let utility = self.graph.scale().utility(open.decisions.bound());
                        let checked = open.checked.take();
                        found = Some((checked.unwrap_or_else(|| self.substitution(&open)), utility));
                    }
                    Progress::Decision => {}
                    Progress::End => self.stop = Some(StopReason::Complete),
                }
            }
        }
        self.open = Some(open);
        found
    }

    /// Takes the first open state: opens its successors, or reaches an answer.
    pub(super) fn advance(&self, open: &mut Open) -> Progress {
        let Some(state) = open.frontier.pop() else { return Progress::End };
        let subproblem = self.subproblem();
        open.expanded += open.go_to(subproblem, state);
        let next = open.decisions.next();
        let is_met = match next {
            Some(_) => self.may_meet(&open.decisions),
            None => self.meets(&open.decisions).map(|checked| open.checked = checked).is_some(),
        };
        if !is_met {
            open.pruned += 1;
            return Progress::Decision;
        }
        match next {
            Some(place) => {
                open.expanded += 1;
                open.expand(subproblem, state, place);
                Progress::Decision
            }
            None if open.is_new(subproblem) => Progress::Answer,
            None => Progress::Decision,
        }
    }

    /// Whether some completion of the decisions may meet the requirements.
    fn may_meet(&self, decisions: &Decisions) -> bool {
        let (paths, admission) = (self.paths.as_deref(), self.admission.filter(|it| it.prunes()));
        if paths.is_none() && admission.is_none() {
            return true;
        }
        let steps = decisions.steps(self.subproblem());
        paths.is_none_or(|paths| paths.allow(self.root, &steps))
            && admission.is_none_or(|admission| admission.may_admit(&steps))
    }

    /// The substitution of complete decisions that meet the requirements, where it had to be made to find this out; `None` where
    /// they do not.
    fn meets(&self, decisions: &Decisions) -> Option<Option<Substitution>> {
        if !self.is_restricted() {
            return Some(None);
        }
        let substitution = self.graph.substitution(self.root, decisions.steps(self.subproblem()));
        let is_met = self.paths.as_deref().is_none_or(|paths| paths.admit(&substitution))
            && self.admission.is_none_or(|admission| admission.admits(&substitution));
        is_met.then_some(Some(substitution))
    }
}

impl BestFirst<'_> {
    /// As `next`, in the memory of a substitution that is no longer needed; returns the utility.
    ///
    /// After `None`, the contents of `answer` have no meaning.
    pub fn next_into(&mut self, answer: &mut Substitution) -> Option<f64> {
        if self.stop.is_some() {
            return None;
        }
        let mut utility = None;
        if self.found == 0 && self.open.is_none() && self.subproblem().is_exact() && self.paths.is_none() {
            utility = self.read_off(answer);
            if utility.is_some() && self.admission.is_some_and(|admission| !admission.admits(answer)) {
                (utility, self.rated, self.read) = (None, None, 0);
            }
        } else if self.found == 1 && self.open.is_none() && self.paths.is_none() {
            // The search finds the answer that was read off again, so its decisions count once, and it is admitted already.
            self.read = 0;
            let admission = self.admission.take();
            self.search();
            self.admission = admission;
        }
        utility = utility.or_else(|| {
            let (substitution, utility) = self.search()?;
            *answer = substitution;
            Some(utility)
        });
        self.found += usize::from(utility.is_some());
        utility
    }
}

impl Iterator for BestFirst<'_> {
    type Item = (Substitution, f64);

    /// The next best substitution and its utility; after `None`, [`BestFirst::stop`] gives the reason.
    fn next(&mut self) -> Option<Self::Item> {
        let mut answer = self.blank();
        self.next_into(&mut answer).map(|utility| (answer, utility))
    }
}
