//! A part of the conflicts, with the explanations that are probable enough beside the best one.

use super::evidence::Beliefs;
use super::verdict::Blame;
use crate::diagnosis::candidates::{Comparison, Part, probabilities};
use crate::knowledge::CauseId;
use crate::monitor::Residual;
use crate::trust::Component;
use alloc::collections::BTreeSet;
use alloc::vec::Vec;
use core::cell::OnceCell;

/// All pairs in conflict with the priors and comparisons for their explanation: the same for each part.
#[derive(Clone, Copy)]
pub(super) struct Conflicts<'p> {
    pub(super) beliefs: &'p Beliefs,
    /// The conflicts, and the agreements that support the components in them.
    pub(super) comparisons: &'p [Comparison],
    pub(super) pairs: &'p [&'p Residual],
    /// The parts when all undecided pairs are taken for conflicts.
    pub(super) rivals: &'p [Part],
    /// Whether some of the undecided pairs only just agree.
    pub(super) only_just: bool,
}

/// A part of the conflicts, and the components that it accuses.
pub(super) struct Case<'p> {
    pub(super) conflicts: Conflicts<'p>,
    part: &'p Part,
    /// The signals and relations of each candidate, best first.
    candidates: Vec<BTreeSet<Component>>,
    /// The rival candidates: those with all undecided pairs taken for conflicts.
    rivals: Vec<BTreeSet<Component>>,
    /// The components that belong to all candidates and rivals.
    pub(super) certain: BTreeSet<Component>,
    /// In the order of the part's components; computed only where a component is accused.
    probabilities: OnceCell<Option<Vec<f64>>>,
}

impl<'p> Case<'p> {
    pub(super) fn new(conflicts: Conflicts<'p>, part: &'p Part) -> Case<'p> {
        let Conflicts { beliefs, rivals, .. } = conflicts;
        let accused = |part: &Part| -> Vec<BTreeSet<Component>> {
            part.candidates.iter().map(|candidate| beliefs.accused(&candidate.components)).collect()
        };
        let first = part.components.first();
        let is_of = |rival: &&Part| first.is_some_and(|first| rival.components.binary_search(first).is_ok());
        let (candidates, rivals) =
            (accused(part), rivals.iter().find(is_of).map(accused).unwrap_or_default());
        let mut certain = candidates.first().cloned().unwrap_or_default();
        certain.retain(|component| candidates.iter().chain(&rivals).all(|set| set.contains(component)));
        let probabilities = OnceCell::new();
        Case { conflicts, part, candidates, rivals, certain, probabilities }
    }

    /// The components of all candidates.
    pub(super) fn accused(&self) -> BTreeSet<Component> {
        self.candidates.iter().flatten().copied().collect()
    }

    /// The components of the candidates that stay candidates, whatever the undecided pairs turn out to be.
    pub(super) fn likely(&self) -> BTreeSet<Component> {
        if self.conflicts.only_just {
            // A pair that only just agrees is evidence against no component.
            return BTreeSet::new();
        }
        let stays = |set: &&BTreeSet<Component>| self.rivals.iter().any(|rival| rival.is_superset(set));
        self.candidates.iter().filter(stays).flatten().copied().collect()
    }

    pub(super) fn blame(&self, component: Component) -> Blame {
        let cause = self.cause_of(component);
        let blamed = cause.map_or(component, Component::Cause);
        let Conflicts { beliefs, comparisons, .. } = self.conflicts;
        let find = || probabilities(comparisons, self.part, |component| beliefs.of(component));
        let known =
            self.probabilities.get_or_init(find).iter().flat_map(|all| self.part.components.iter().zip(all));
        let known: Vec<(Component, f64)> = known.map(|(component, share)| (*component, *share)).collect();
        let probability = known.iter().find(|(known, _)| *known == blamed).map(|(_, share)| *share);
        let is_other = |(other, _): &&(Component, f64)| {
            *other != component && *other != blamed && !self.certain.contains(other)
        };
        let next = known.iter().filter(is_other).copied().reduce(|a, b| if b.1 > a.1 { b } else { a });
        Blame { component, cause, probability, next, relapses: 0 }
    }

    /// The cause by which the best candidate that accuses a signal accuses it.
    pub(super) fn cause_of(&self, component: Component) -> Option<CauseId> {
        let Component::Signal(signal) = component else { return None };
        let place = self.candidates.iter().position(|accused| accused.contains(&component))?;
        let candidate = self.part.candidates.get(place)?;
        if candidate.components.contains(&component) {
            return None;
        }
        candidate.components.iter().find_map(|other| match other {
            Component::Cause(cause) if self.conflicts.beliefs.shares(signal, *cause) => Some(*cause),
            _ => None,
        })
    }
}
