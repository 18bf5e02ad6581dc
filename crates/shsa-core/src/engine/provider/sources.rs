//! The sources that may serve a need now, and the best of them.
//!
//! Sources are ranked when the trust in a signal has changed, never in between: changing records make no source flap.

use super::super::ready_sources::ReadySources;
use super::super::ways::{Lost, Source};
use super::proven::{Rank, Ranked};
use super::situation::Situation;
use crate::assurance::Assessments;
use crate::knowledge::{KnowledgeBase, NeedId, VariableId};
use crate::monitor::Monitor;
use crate::numbers::BRIEF;
use crate::plan::Graph;
use crate::reason::{Candidate, Joint, Reason, Reasons};
use crate::substitution::Way;
use crate::time::Time;
use alloc::sync::Arc;
use alloc::vec::Vec;

/// How many alternatives an event names.
pub(super) const MOST_NAMED: usize = 3;

/// The sources of a need.
#[derive(Debug)]
pub(super) struct Sources {
    /// The sources that may serve the need now, best first.
    found: Arc<[Source]>,
    /// The sources that may be right: suspects, too.
    possible: Arc<[Source]>,
    /// The sources as ranked when the trust in a signal last changed.
    ranked: Vec<Ranked>,
    /// Whether the best proven of equally good sources is taken.
    prefers_proven: bool,
    /// The source that serves the need when nothing is wrong.
    pub(super) preferred: Option<Way>,
    /// Whether the sources are uncertain: allowed only because none is trusted.
    is_unproven: bool,
    /// Since when all sources give values again after a silence, where others could confirm them.
    returning_since: Option<Time>,
    /// Whether the need has sources without a signal in common.
    are_several: bool,
    /// Whether no two of the sources are independent.
    pub(super) is_alone: bool,
    /// Whether no source is known to be better than the one in use. Kept until the sources, their ranks or the one in use change,
    /// as every value asks for it.
    pub(super) is_unrivalled: bool,
}

impl Sources {
    /// The sources with nothing lost, not ranked yet.
    pub(super) fn new(
        knowledge: &KnowledgeBase,
        graph: &Graph,
        ready_sources: &ReadySources,
        need: NeedId,
        prefers_proven: bool,
    ) -> Sources {
        let found = ready_sources.sources(knowledge, graph, need, &Lost::default());
        Sources {
            are_several: !read_one_signal(found.iter()),
            returning_since: None,
            found,
            possible: Arc::default(),
            ranked: Vec::new(),
            prefers_proven,
            preferred: None,
            is_unproven: false,
            is_alone: false,
            is_unrivalled: false,
        }
    }

    /// Goes on after a change of the model: a return after a silence keeps its time.
    pub(super) fn inherit(&mut self, old: &Sources) {
        self.returning_since = old.returning_since;
    }

    /// Finds the sources of a need again, without ranking; returns the exclusions that were applied. Where the need withholds what
    /// is uncertain, an unproven source does not serve.
    pub(super) fn find<'s>(
        &mut self,
        need: NeedId,
        withholds: bool,
        situation: &'s Situation<'_>,
        contracts: &mut Assessments,
    ) -> &'s Lost {
        let [trusted, returning, unproven, suspect] = &situation.lost;
        let admitted = contracts.is_demanding().then(|| situation.assess(need, contracts));
        let find = |at: usize, lost| match &admitted {
            Some(lists) => lists.get(at).cloned().unwrap_or_default(),
            None => situation.sources(need, lost),
        };
        let tried =
            [trusted, returning, unproven].into_iter().take(if withholds { 2 } else { 3 }).enumerate();
        let mut tried = tried.map(|(at, lost)| (lost, find(at, lost)));
        let found = tried.find(|(_, sources)| !sources.is_empty());
        let (lost, sources) = found.unwrap_or_else(|| (returning, Arc::default()));
        // These sources serve only because none is trusted.
        self.is_unproven = !sources.is_empty() && core::ptr::eq(lost, unproven);
        let is_returning = !sources.is_empty() && core::ptr::eq(lost, returning) && self.are_several;
        self.returning_since = is_returning.then(|| self.returning_since.unwrap_or(situation.now));
        self.found = sources;
        self.possible = if withholds { Arc::default() } else { situation.sources(need, suspect) };
        self.is_alone = false;
        self.is_unrivalled = false;
        lost
    }

    /// Keeps the sources that `is_kept` accepts.
    pub(super) fn keep(&mut self, is_kept: impl Fn(&Way) -> bool) {
        let kept: Vec<usize> = (0..self.found.len())
            .filter(|&at| self.found.get(at).is_some_and(|source| is_kept(&source.way)))
            .collect();
        self.ranked.retain_mut(|ranked| {
            let place = kept.binary_search(&ranked.at);
            ranked.at = place.unwrap_or(ranked.at);
            place.is_ok()
        });
        self.found = kept.iter().filter_map(|&at| self.found.get(at)).cloned().collect();
    }

    /// Whether all sources give values again after a recent silence, and sources that could confirm them may not yet.
    pub(super) fn are_returning(&self, now: Time) -> bool {
        self.returning_since.is_some_and(|since| now - since < BRIEF)
    }

    /// Whether the need has several sources, and those that `has_spoken` accepts read one signal in common: nothing confirms it.
    pub(super) fn are_left_alone(&self, has_spoken: impl Fn(&Way) -> bool) -> bool {
        self.are_several && read_one_signal(self.found.iter().filter(|source| has_spoken(&source.way)))
    }

    /// All sources, best utility first.
    pub(super) fn all(&self) -> &[Source] {
        &self.found
    }

    /// The sources that may be right, suspects among them, best utility first; nothing where no suspect is among them.
    pub(super) fn suspected(&self) -> &[Source] {
        if self.possible.iter().all(|it| self.contain(&it.way)) { &[] } else { &self.possible }
    }

    /// Whether a way is one of the sources, or a suspect.
    pub(super) fn may_be_right(&self, way: &Way) -> bool {
        self.contain(way) || self.possible.iter().any(|source| source.way == *way)
    }

    /// Whether a way is one of the sources.
    pub(super) fn contain(&self, way: &Way) -> bool {
        self.found.iter().any(|source| source.way == *way)
    }

    /// Whether the sources are uncertain: allowed only because none is trusted.
    pub(super) fn is_unproven(&self) -> bool {
        self.is_unproven
    }

    /// Ranks the sources by utility; equals by the share of time with a value that others confirmed, then by the distance from
    /// the others, then in the order of the search.
    ///
    /// Complexity: O(n²) for at most 32 sources, whatever the size of the model.
    pub(super) fn rank(&mut self, knowledge: &KnowledgeBase, monitor: &Monitor, now: Option<Time>) {
        let rates_ways = knowledge.utility().rates_ways();
        let prefers_proven = self.prefers_proven;
        let ranked = |(at, source): (usize, &Source)| {
            let watched = now.and_then(|now| Some(monitor.figures(monitor.find(&source.way)?, now)));
            let figures = watched.filter(|_| prefers_proven || rates_ways).unwrap_or_default();
            let rating = knowledge.utility().of_way(|figure| figures.get(figure));
            let utility = match rates_ways {
                true => knowledge.utility().aggregate().with(source.utility, rating),
                false => source.utility,
            };
            Ranked::new(at, utility, figures, source.way.substitution.continues_itself(knowledge))
        };
        // Ranks in place, without allocation: this runs with every value while nothing serves the need.
        self.is_unrivalled = false;
        self.ranked.clear();
        self.ranked.extend(self.found.iter().enumerate().map(ranked));
        if prefers_proven {
            self.compare();
        }
        self.ranked.sort_unstable_by(Ranked::order);
    }

    /// Compares the record of each source with those of the others.
    fn compare(&mut self) {
        for at in 0..self.ranked.len() {
            let rank = self.ranked.get(at).map(|ranked| Rank::among(&self.ranked, ranked));
            if let (Some(ranked), Some(rank)) = (self.ranked.get_mut(at), rank) {
                ranked.rank = rank;
            }
        }
    }

    /// The sources as they were last ranked, best first.
    pub(super) fn ranked(&self) -> impl Iterator<Item = (&Source, &Ranked)> {
        self.ranked.iter().filter_map(|ranked| Some((self.found.get(ranked.at)?, ranked)))
    }

    /// The ways of the sources in the same order.
    pub(super) fn ways(&self) -> impl Iterator<Item = &Way> {
        self.ranked().map(|(source, _)| &source.way)
    }

    /// The preferred source if it is the best, or one whose utility is above that of the source in use by more than the
    /// hysteresis, both with and without records: a record alone makes no need leave a sound source.
    pub(super) fn better(&self, active: &Way, hysteresis: f64) -> Option<&Way> {
        let best = self.found.first()?;
        if best.way == *active {
            return None;
        }
        if self.preferred.as_ref() == Some(&best.way) {
            return Some(&best.way);
        }
        let (current, ranked) = self.ranked().find(|(source, _)| source.way == *active)?;
        let is_above = |one: f64, other: f64| one > other + hysteresis * other.abs();
        let is_better = |other: &(&Source, &Ranked)| {
            is_above(other.0.utility, current.utility) && is_above(other.1.utility, ranked.utility)
        };
        self.ranked().find(is_better).map(|(source, _)| &source.way)
    }

    /// The chosen source and the next ones, with their utilities.
    pub(super) fn alternatives(
        &self,
        knowledge: &KnowledgeBase,
        variable: VariableId,
        active: Option<&Way>,
    ) -> Reasons {
        // Records are reported where they decide the choice.
        let in_order = self.ranked.iter().map(|ranked| ranked.at).is_sorted();
        let is_proven = !in_order || knowledge.utility().rates_ways();
        let candidate = |(source, ranked): (&Source, &Ranked)| Candidate {
            source: source.way.describe(knowledge),
            utility: ranked.utility,
            proof: is_proven.then(|| ranked.proof(knowledge, variable)),
        };
        let is_chosen = |(source, _): &(&Source, &Ranked)| active == Some(&source.way);
        let chosen = self.ranked().find(is_chosen).map(candidate);
        let chosen = chosen.map(|source| Reasons::from(Reason::TakesOver { source }));
        let sources: Vec<Candidate> =
            self.ranked().filter(|source| !is_chosen(source)).take(MOST_NAMED).map(candidate).collect();
        let others = match sources.is_empty() {
            true => Reason::NothingLeft,
            false => Reason::NextBest { sources },
        };
        chosen.unwrap_or_default().then(Joint::Next, others)
    }
}

/// Whether all sources read one signal in common.
fn read_one_signal<'s>(mut sources: impl Iterator<Item = &'s Source> + Clone) -> bool {
    let reads = |source: &Source, signal| source.way.inputs().any(|input| input == signal);
    let first = sources.next();
    first.is_none_or(|first| first.way.inputs().any(|it| sources.clone().all(|other| reads(other, it))))
}
