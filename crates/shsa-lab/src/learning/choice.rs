//! Chooses few of many relations: none that follows from others, none with unrelated signals.

use crate::learning::shape::{Relation, Shape};

/// The share of the error of a smaller relation that a relation with more signals may leave at most.
const MUCH_LESS: f64 = 0.4;

/// The choice so far.
pub(crate) struct Choice {
    relations: Vec<Relation>,
    /// For each signal one with the same content, perhaps delayed.
    same_as: Vec<usize>,
}

impl Choice {
    pub(crate) fn new(signals: usize) -> Choice {
        Choice { relations: Vec::new(), same_as: (0..signals).collect() }
    }

    fn root(&self, signal: usize) -> usize {
        let mut at = signal;
        while self.same_as[at] != at {
            at = self.same_as[at];
        }
        at
    }

    /// Whether two signals are known to have the same content.
    pub(crate) fn is_same(&self, one: usize, other: usize) -> bool {
        self.root(one) == self.root(other)
    }

    /// Takes relations of two signals, the best first; those of equal signals join groups, each signal once.
    pub(crate) fn take_pairs(&mut self, mut pairs: Vec<Relation>) {
        pairs.sort_by(|one, other| one.score.all().total_cmp(&other.score.all()));
        let (same, other): (Vec<Relation>, Vec<Relation>) =
            pairs.into_iter().partition(|it| matches!(it.shape, Shape::Equal { .. }));
        for relation in same {
            let (one, other) = (self.root(relation.target), self.root(relation.inputs[0]));
            if one != other {
                self.same_as[one.max(other)] = one.min(other);
                self.relations.push(relation);
            }
        }
        self.take(other);
    }

    /// Relations of three and more.
    pub(crate) fn take_larger(&mut self, mut relations: Vec<Relation>) {
        relations.sort_by(|one, other| {
            one.inputs.len().cmp(&other.inputs.len()).then(one.score.all().total_cmp(&other.score.all()))
        });
        self.take(relations);
    }

    fn take(&mut self, relations: Vec<Relation>) {
        for relation in relations {
            let members = self.members(&relation);
            let is_whole = members.len() == relation.inputs.len() + 1;
            let is_known = |known: &Relation| {
                let known_members = self.members(known);
                let is_part = known_members.iter().all(|it| members.contains(it));
                // A quantity and its rate are no functions of each other: a third one may follow from both.
                let leaves_target_open = matches!(known.shape, Shape::Rate { .. } | Shape::Integral)
                    && !known_members.contains(&self.root(relation.target));
                is_part
                    && !leaves_target_open
                    && (known_members.len() == members.len()
                        || relation.score.all() > MUCH_LESS * known.score.all())
            };
            let is_new =
                !self.relations.iter().filter(|it| !matches!(it.shape, Shape::Equal { .. })).any(is_known);
            if is_whole && is_new {
                self.let_go_of_parts(&relation, &members);
                self.relations.push(relation);
            }
        }
    }

    /// Lets go of lines and curves between two factors of a product, which explains far more: the third one varied little.
    fn let_go_of_parts(&mut self, product: &Relation, members: &[usize]) {
        if !matches!(product.shape, Shape::Product(_)) {
            return;
        }
        let is_curve = |it: &Relation| {
            matches!(it.shape, Shape::Line { .. } | Shape::Polynomial(_) | Shape::Power(_) | Shape::Saturated)
        };
        let is_part = |it: &Relation| self.members(it).iter().all(|member| members.contains(member));
        let kept = self.relations.iter().filter(|it| !(is_curve(it) && is_part(it))).cloned().collect();
        self.relations = kept;
    }

    /// The signals of a relation, each replaced by the representative of its group.
    fn members(&self, relation: &Relation) -> Vec<usize> {
        let mut members: Vec<usize> = relation.signals().into_iter().map(|it| self.root(it)).collect();
        members.sort_unstable();
        members.dedup();
        members
    }

    pub(crate) fn relations(self) -> Vec<Relation> {
        self.relations
    }
}
