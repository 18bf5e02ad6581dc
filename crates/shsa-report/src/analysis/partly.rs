//! Faults that comparisons show or isolate only in part, with the reasons.

use super::Report;
use shsa_core::analysis::Reservation;
use shsa_core::trust::Component;
use std::collections::BTreeMap;

impl Report<'_> {
    /// `yes`, `in part` or `no`: whether comparisons show a fault.
    pub(super) fn detectable(&self, component: Component) -> &'static str {
        let shown_by = self.analysis.faults.isolability(component).map_or(0, |found| found.shown_by);
        match shown_by {
            0 => "no",
            _ if self.analysis.partly.is_in_part(self.knowledge, component) => "in part",
            _ => "yes",
        }
    }

    /// From how many others a fault is isolable, and from how many more only in part: `2 of 3`, `0 of 3, 2 in part`.
    pub(super) fn isolable(
        &self,
        component: Component,
        is_other: impl Fn(&Component) -> bool,
        others: usize,
    ) -> String {
        let described = self.analysis.isolable_from(component).filter(&is_other).count();
        match self.analysis.isolable_in_part_from(component).filter(&is_other).count() {
            0 => format!("{described} of {others}"),
            in_part => format!("{described} of {others}, {in_part} in part"),
        }
    }

    /// Why a fault is detectable or isolable only in part; empty where there is nothing to say.
    pub(super) fn in_part(&self, component: Component) -> Vec<String> {
        let analysis = self.analysis;
        let all = analysis.partly.reservations(self.knowledge, component);
        let is_in_part = analysis.partly.is_in_part(self.knowledge, component);
        let is_mixed = analysis
            .faults
            .isolable_components_from(component)
            .any(|other| !analysis.is_isolable_from(component, other));
        let counts = |reservation: &&Reservation| {
            is_in_part || is_mixed && matches!(reservation, Reservation::Branches(_))
        };
        all.iter().filter(counts).map(|reservation| self.reservation(*reservation)).collect()
    }

    /// All faults that are detectable or isolable only in part, one line for each reason.
    pub(super) fn partly(&self) -> Vec<String> {
        let mut by_reason: BTreeMap<String, Vec<&str>> = BTreeMap::new();
        for component in self.analysis.faults.components() {
            for reason in self.in_part(component) {
                by_reason.entry(reason).or_default().push(self.component(component));
            }
        }
        by_reason.into_iter().map(|(reason, faults)| format!("{}: {reason}", faults.join(", "))).collect()
    }

    fn reservation(&self, reservation: Reservation) -> String {
        let name = |relation| self.component(Component::Relation(relation));
        match reservation {
            Reservation::Branches(relation) => format!(
                "{} has several solutions: it hides a fault that leads to another one of them",
                name(relation)
            ),
            Reservation::Change(relation) => format!(
                "{} takes only a derivative: it shows a change, and an offset only for the window of the derivative",
                name(relation)
            ),
        }
    }
}
