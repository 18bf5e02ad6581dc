//! Certificates by their definition: sets of what holds, grown until nothing changes, and every choice of evidence tried.

use std::collections::BTreeSet;

/// A system as its definition has it: numbers instead of names, and no ids.
pub(super) struct Plain {
    pub(super) guarantees: Vec<PlainGuarantee>,
    pub(super) demands: Vec<PlainDemand>,
    pub(super) evidence: usize,
}

pub(super) struct PlainGuarantee {
    pub(super) service: usize,
    pub(super) says: Says,
    pub(super) when: PlainTree,
}

pub(super) struct PlainDemand {
    pub(super) says: Says,
    pub(super) of: Vec<usize>,
    pub(super) all: bool,
}

/// Type, level as scale and rank, and a bound of a deviation (at most) and of a duration (at least).
#[derive(Clone)]
pub(super) struct Says {
    pub(super) kind: usize,
    pub(super) level: Option<(usize, u32)>,
    pub(super) at_most: Option<u32>,
    pub(super) at_least: Option<u32>,
}

#[derive(Clone)]
pub(super) enum PlainTree {
    AtLeast(usize, Vec<PlainTree>),
    Demand(usize),
    Evidence(usize),
}

impl Plain {
    pub(super) fn meets(&self, guarantee: usize, demand: usize, at: Option<(usize, u32)>) -> bool {
        let (given, asked) = (&self.guarantees[guarantee].says, &self.demands[demand].says);
        let level =
            at.is_none_or(|(scale, rank)| given.level.is_some_and(|it| it.0 == scale && it.1 >= rank));
        let at_most = asked.at_most.is_none_or(|bound| given.at_most.is_some_and(|it| it <= bound));
        let at_least = asked.at_least.is_none_or(|bound| given.at_least.is_some_and(|it| it >= bound));
        given.kind == asked.kind && level && at_most && at_least
    }

    pub(super) fn met(&self, demand: usize, at: Option<(usize, u32)>, holds: &BTreeSet<usize>) -> bool {
        let row = &self.demands[demand];
        let by = |&service: &usize| {
            let own = |&&it: &&usize| self.guarantees[it].service == service;
            holds.iter().filter(own).any(|&it| self.meets(it, demand, at))
        };
        if row.all { row.of.iter().all(by) } else { row.of.iter().any(by) }
    }

    pub(super) fn is_true(&self, tree: &PlainTree, evidence: u32, holds: &BTreeSet<usize>) -> bool {
        match tree {
            PlainTree::AtLeast(needed, parts) => {
                parts.iter().filter(|part| self.is_true(part, evidence, holds)).count() >= *needed
            }
            PlainTree::Demand(demand) => self.met(*demand, self.demands[*demand].says.level, holds),
            PlainTree::Evidence(at) => evidence >> at & 1 == 1,
        }
    }

    /// The fixed point that iteration from `start` ends in.
    pub(super) fn fixed_point(&self, evidence: u32, mut holds: BTreeSet<usize>) -> BTreeSet<usize> {
        loop {
            let is_true = |it: &usize| self.is_true(&self.guarantees[*it].when, evidence, &holds);
            let next: BTreeSet<usize> = (0..self.guarantees.len()).filter(is_true).collect();
            if next == holds {
                return holds;
            }
            holds = next;
        }
    }

    pub(super) fn least(&self, evidence: u32) -> BTreeSet<usize> {
        self.fixed_point(evidence, BTreeSet::new())
    }

    /// Minimal sets of evidence beyond `given` with which something holds, and minimal sets without which it does not.
    pub(super) fn minimal(
        &self,
        given: u32,
        holds: impl Fn(u32) -> bool,
    ) -> (Vec<Vec<usize>>, Vec<Vec<usize>>) {
        let free = !given & ((1 << self.evidence) - 1);
        let sets = || (0..1u32 << self.evidence).filter(|set| set & !free == 0);
        let repairs = smallest(sets().filter(|set| holds(given | set)));
        let causes = smallest(sets().filter(|set| !holds(given | free & !set)));
        (repairs, causes)
    }
}

/// The minimal ones of sets that are given as bits, by size and elements.
pub(super) fn smallest(sets: impl Iterator<Item = u32>) -> Vec<Vec<usize>> {
    let mut all: Vec<u32> = sets.collect();
    all.sort_by_key(|set| set.count_ones());
    let mut found: Vec<u32> = Vec::new();
    for set in all {
        if !found.iter().any(|smaller| smaller & !set == 0) {
            found.push(set);
        }
    }
    let named = |set: &u32| (0..32).filter(|at| set >> at & 1 == 1).collect::<Vec<usize>>();
    ordered(found.iter().map(named).collect())
}

pub(super) fn ordered(mut sets: Vec<Vec<usize>>) -> Vec<Vec<usize>> {
    sets.sort_by(|a, b| a.len().cmp(&b.len()).then_with(|| a.cmp(b)));
    sets
}

pub(super) fn collect(tree: &PlainTree, leaves: &mut BTreeSet<(bool, usize)>) {
    match tree {
        PlainTree::AtLeast(_, parts) => parts.iter().for_each(|part| collect(part, leaves)),
        PlainTree::Demand(at) => _ = leaves.insert((true, *at)),
        PlainTree::Evidence(at) => _ = leaves.insert((false, *at)),
    }
}

pub(super) fn with(tree: &PlainTree, chosen: &impl Fn((bool, usize)) -> bool) -> bool {
    match tree {
        PlainTree::AtLeast(needed, parts) => {
            parts.iter().filter(|part| with(part, chosen)).count() >= *needed
        }
        PlainTree::Demand(at) => chosen((true, *at)),
        PlainTree::Evidence(at) => chosen((false, *at)),
    }
}
