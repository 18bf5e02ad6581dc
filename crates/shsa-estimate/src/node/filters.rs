//! The filter over all inputs of a fusion, and one without each of those that are to be predicted.
//!
//! What a sensor measures is no witness about itself, not even through the past of a filter: so a state of its own is kept for the
//! others. A measurement costs a step of each filter.

use crate::fusion::{Fusion, Verdict};
use crate::method::{Innovation, Measurement};
use shsa_core::time::Time;

/// All filters of a fusion.
pub(super) struct Filters {
    all: Fusion,
    /// Each without some inputs. They take in all that the others say, whether it is trusted or not: what they are there for is
    /// to show contradictions, and to go on showing that there are none any more.
    witnesses: Vec<Fusion>,
    /// What is not trusted at present.
    masked: Vec<bool>,
}

impl Filters {
    /// Over so many inputs: the filter over all, and one without each of these sets, made by functions.
    ///
    /// # Errors
    /// Those of the functions.
    pub(super) fn new<E>(
        inputs: usize,
        sets: &[Vec<usize>],
        all: impl Fn() -> Result<Fusion, E>,
        witness: impl Fn() -> Result<Fusion, E>,
    ) -> Result<Filters, E> {
        let without = |set: &Vec<usize>| {
            let mut fusion = witness()?;
            set.iter().for_each(|input| fusion.mask(*input, true));
            Ok(fusion)
        };
        let witnesses = sets.iter().map(without).collect::<Result<_, E>>()?;
        Ok(Filters { all: all()?, witnesses, masked: vec![false; inputs] })
    }

    /// The filter over all inputs.
    pub(super) fn all_mut(&mut self) -> &mut Fusion {
        &mut self.all
    }

    /// As [`Filters::all_mut`], to look at.
    pub(super) fn all(&self) -> &Fusion {
        &self.all
    }

    /// Whether an input is trusted from now on.
    pub(super) fn trust(&mut self, input: usize, is_trusted: bool) {
        if let Some(masked) = self.masked.get_mut(input) {
            *masked = !is_trusted;
            self.all.mask(input, !is_trusted);
        }
    }

    /// Takes a measurement in, everywhere.
    pub(super) fn measure(&mut self, at: Time, measurement: Measurement) -> Verdict {
        for witness in &mut self.witnesses {
            witness.measure(at, measurement);
        }
        self.all.measure(at, measurement)
    }

    /// A control input has this value from a time on.
    pub(super) fn control(&mut self, at: Time, control: usize, value: f64) {
        self.witnesses.iter_mut().for_each(|witness| witness.control(at, control, value));
        self.all.control(at, control, value);
    }

    /// Begins all of them anew.
    pub(super) fn restart(&mut self, at: Time) {
        self.witnesses.iter_mut().for_each(|witness| witness.restart(at));
        self.all.restart(at);
    }

    /// The last measurement of an input beside what the filter without this set says of it, if that is known.
    pub(super) fn innovation(&self, set: usize, input: usize) -> Option<(Time, Innovation)> {
        let witness = self.witnesses.get(set)?;
        witness.innovation(input).filter(|(at, _)| witness.is_known(*at))
    }

    /// Whether all inputs are trusted, and none is in conflict.
    pub(super) fn is_calm(&self) -> bool {
        let accepts = |input: usize| self.all.watch(input).is_some_and(|watch| watch.rejections == 0);
        self.masked.iter().enumerate().all(|(input, masked)| !masked && accepts(input))
    }

    /// Lets the filter without this set begin anew from what is known with all that is trusted. While that is nothing, since
    /// nobody can tell who is wrong, it begins from what all say together: else no contradiction would ever end.
    pub(super) fn anchor(&mut self, set: usize, at: Time) {
        let Filters { all, witnesses, .. } = self;
        let Some((together, rest)) = witnesses.split_first_mut() else { return };
        let from = if all.is_known(at) { &*all } else { &*together };
        begin(rest, set, from, at);
    }

    /// Lets the filter without this set begin anew from what all say together: what was reckoned for so long bears no witness.
    pub(super) fn anchor_together(&mut self, set: usize, at: Time) {
        let Some((together, rest)) = self.witnesses.split_first_mut() else { return };
        begin(rest, set, together, at);
    }
}

/// The first set leaves out nothing, and is not among these.
fn begin(rest: &mut [Fusion], set: usize, from: &Fusion, at: Time) {
    let witness = set.checked_sub(1).and_then(|place| rest.get_mut(place));
    witness.into_iter().filter(|_| from.is_known(at)).for_each(|witness| witness.begin_as(from));
}
