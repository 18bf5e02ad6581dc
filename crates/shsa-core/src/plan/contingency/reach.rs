//! The variables that a search can visit: its answer depends on nothing else.

use super::super::graph::{Options, Producer, View};
use crate::knowledge::{IdVec, VariableId};
use alloc::vec::Vec;

/// Walks over the variables that a search could visit, with stamps instead of sets: a walk costs nothing in the size of the
/// graph.
#[derive(Clone, Debug, Default)]
pub(super) struct Reach {
    /// The last walk that visited each variable.
    stamps: IdVec<VariableId, u64>,
    /// The last walk from a root.
    base: u64,
    /// The last walk.
    last: u64,
}

/// A relation that may be used for `place` and reads the provided variable `input`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reading {
    pub(super) input: VariableId,
    pub(super) place: VariableId,
    pub(super) producer: Producer,
}

/// The result of a walk.
#[derive(Clone, Debug, Default)]
pub(super) struct Reached {
    /// The variables, in the order of discovery.
    pub(super) variables: Vec<VariableId>,
    /// The readings, ascending by their inputs.
    readings: Vec<Reading>,
    /// The number of visited inputs.
    pub(super) work: u64,
}

impl Reached {
    /// The relations that read a provided variable.
    pub(super) fn readings(&self, input: VariableId) -> &[Reading] {
        let start = self.readings.partition_point(|reading| reading.input < input);
        let end = self.readings.partition_point(|reading| reading.input <= input);
        self.readings.get(start..end).unwrap_or_default()
    }
}

impl Reach {
    /// Fits the stamps to the number of variables of a graph.
    pub(super) fn fit(&mut self, variables: usize) {
        if self.stamps.len() != variables {
            *self = Reach { stamps: IdVec::filled(variables, |_| 0), base: 0, last: 0 };
        }
    }

    /// The variables whose provision a search from `root` may read: the root, and the inputs of all relations above variables
    /// that are not provided. `None` after `most` inputs.
    pub(super) fn from(
        &mut self,
        view: &View,
        root: VariableId,
        options: &Options,
        most: u64,
    ) -> Option<Reached> {
        self.last += 1;
        self.base = self.last;
        let mut reached = self.walk(view, Vec::from([root]), options, most)?;
        reached.variables.push(root);
        Some(reached)
    }

    /// The variables reached in addition to the last walk from a root, when some variables of it are no longer provided.
    pub(super) fn beyond(
        &mut self,
        view: &View,
        lost: Vec<VariableId>,
        options: &Options,
        most: u64,
    ) -> Option<Reached> {
        self.last += 1;
        self.walk(view, lost, options, most)
    }

    fn walk(
        &mut self,
        view: &View,
        mut open: Vec<VariableId>,
        options: &Options,
        most: u64,
    ) -> Option<Reached> {
        let mut reached = Reached::default();
        open.iter().for_each(|&variable| self.stamps[variable] = self.base);
        while let Some(place) = open.pop() {
            for producer in view.producers(place) {
                let inputs = view.graph().inputs_of(producer);
                reached.work += 1 + inputs.len() as u64;
                if reached.work > most {
                    return None;
                }
                for &input in inputs.iter().filter(|&&input| input != place) {
                    let provided = view.is_provided(input);
                    if provided {
                        reached.readings.push(Reading { input, place, producer: *producer });
                    }
                    if self.is_new(input) {
                        reached.variables.push(input);
                        open.extend((options.substitute_provided || !provided).then_some(input));
                    }
                }
            }
        }
        reached.readings.sort_unstable_by_key(|reading| reading.input);
        Some(reached)
    }

    fn is_new(&mut self, variable: VariableId) -> bool {
        let stamp = &mut self.stamps[variable];
        let new = *stamp != self.last && *stamp != self.base;
        if new {
            *stamp = self.last;
        }
        new
    }
}
