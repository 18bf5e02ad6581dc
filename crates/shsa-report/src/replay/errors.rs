//! The errors of the values of needs relative to a run without the injected faults, found while both runs go on.

use shsa_core::engine::{Publication, PublishedValue, Quality};
use shsa_core::knowledge::KnowledgeBase;
use shsa_core::time::Time;
use shsa_format::drive::Run;
use std::collections::{BTreeMap, VecDeque};

/// The most values of a need that are kept of each of the two runs: hours of a need that is served at 1 Hz, while one run goes on
/// without the other.
const KEPT: usize = 1 << 14;

/// The error of one run's values relative to another run.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Difference {
    count: u64,
    squares: f64,
    pub(super) most: f64,
}

impl Difference {
    /// The root mean square.
    pub(super) fn rms(&self) -> f64 {
        (self.squares / self.count as f64).sqrt()
    }

    pub(super) fn and(self, other: Difference) -> Difference {
        Difference {
            count: self.count + other.count,
            squares: self.squares + other.squares,
            most: self.most.max(other.most),
        }
    }
}

/// The root mean square and the largest difference of the values of each need to the values of a run without faults. A value is
/// compared with the one in force at its time. Uncertain values and lists are left out.
///
/// Memory: 512 KiB for each need at most.
#[derive(Clone, Debug, Default)]
pub struct NeedErrors {
    /// By the published name.
    of_need: BTreeMap<String, OfNeed>,
}

#[derive(Clone, Debug, Default)]
struct OfNeed {
    /// The newest values of the run without faults.
    references: VecDeque<(Time, f64)>,
    /// The values whose reference is not yet certain.
    waiting: VecDeque<(Time, f64)>,
    sum: Difference,
}

impl NeedErrors {
    /// The errors of a run, both runs being over and their values kept.
    #[must_use]
    pub fn between(run: &Run, clean: &Run) -> NeedErrors {
        let mut errors = NeedErrors::default();
        let mut references = clean.publications_with_models(0).peekable();
        for (known, publication) in run.publications_with_models(0) {
            while let Some((known, it)) = references.next_if(|(_, it)| it.time <= publication.time) {
                errors.reference(known, it);
            }
            errors.value(known, publication);
        }
        references.for_each(|(known, it)| errors.reference(known, it));
        errors.end();
        errors
    }

    /// Takes in a value of the run without faults.
    pub fn reference(&mut self, knowledge: &KnowledgeBase, publication: &Publication) {
        if let Some((of_need, point)) = self.point(knowledge, publication) {
            if of_need.references.len() == KEPT {
                of_need.references.pop_front();
            }
            of_need.references.push_back(point);
            of_need.settle(false);
        }
    }

    /// Takes in a value of the run with faults.
    pub fn value(&mut self, knowledge: &KnowledgeBase, publication: &Publication) {
        if let Some((of_need, point)) = self.point(knowledge, publication) {
            of_need.waiting.push_back(point);
            of_need.settle(false);
        }
    }

    /// Compares what is left when both runs are over.
    pub fn end(&mut self) {
        self.of_need.values_mut().for_each(|of_need| of_need.settle(true));
    }

    /// The error of the need that is published under this name; `None` where nothing could be compared.
    pub(super) fn of(&self, signal: &str) -> Option<Difference> {
        self.of_need.get(signal).map(|of_need| of_need.sum).filter(|sum| sum.count > 0)
    }

    /// The time of a value and its middle, with those of its need.
    fn point(&mut self, known: &KnowledgeBase, it: &Publication) -> Option<(&mut OfNeed, (Time, f64))> {
        // The midpoint of an uncertain value is no estimate.
        let PublishedValue::Scalar(value) = it.value else { return None };
        if it.quality == Quality::Uncertain {
            return None;
        }
        let signal = &known.needs()[it.need].signal;
        if !self.of_need.contains_key(signal) {
            self.of_need.insert(signal.clone(), OfNeed::default());
        }
        Some((self.of_need.get_mut(signal)?, (it.time, value.midpoint())))
    }
}

impl OfNeed {
    /// Compares the values whose reference no later one can replace; at the end all.
    fn settle(&mut self, is_over: bool) {
        while let Some(&(time, value)) = self.waiting.front() {
            let is_certain = self.references.back().is_some_and(|(latest, _)| *latest > time);
            if !is_certain && !is_over && self.waiting.len() <= KEPT {
                return;
            }
            self.waiting.pop_front();
            let standing = self.references.partition_point(|(at, _)| *at <= time);
            let reference = standing.checked_sub(1).and_then(|before| self.references.get(before));
            if let Some((_, expected)) = reference {
                let error = (value - expected).abs();
                self.sum = self.sum.and(Difference { count: 1, squares: error * error, most: error });
            }
        }
    }
}
