//! The filter over all inputs of a fusion, and one for each prediction without some inputs.
//!
//! The past measurements of a sensor are no independent witness about it. So each filter without a sensor keeps a state of its
//! own. A measurement costs a step of each filter.

use crate::fusion::{Fusion, Verdict};
use crate::method::{Innovation, Measurement};
use shsa_core::time::Time;

/// All filters of a fusion.
pub(super) struct Filters {
    all: Fusion,
    /// Filters without some inputs. They use the others' measurements whether trusted or not, as they must show contradictions,
    /// and the end of contradictions.
    witnesses: Vec<Fusion>,
    /// The inputs that are not trusted at present.
    masked: Vec<bool>,
}

impl Filters {
    /// Filters over a number of inputs: one over all, and one without each of these sets, made by functions.
    ///
    /// # Errors
    /// The errors of the functions.
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

    /// The filter over all inputs, to read.
    pub(super) fn all(&self) -> &Fusion {
        &self.all
    }

    /// Sets whether an input is trusted from now on.
    pub(super) fn trust(&mut self, input: usize, is_trusted: bool) {
        if let Some(masked) = self.masked.get_mut(input) {
            *masked = !is_trusted;
            self.all.mask(input, !is_trusted);
        }
    }

    /// Gives a measurement to all filters.
    pub(super) fn measure(&mut self, at: Time, measurement: Measurement) -> Verdict {
        for witness in &mut self.witnesses {
            witness.measure(at, measurement);
        }
        self.all.measure(at, measurement)
    }

    /// Sets a control input from a time on.
    pub(super) fn control(&mut self, at: Time, control: usize, value: f64) {
        self.witnesses.iter_mut().for_each(|witness| witness.control(at, control, value));
        self.all.control(at, control, value);
    }

    /// Restarts all filters.
    pub(super) fn restart(&mut self, at: Time) {
        self.witnesses.iter_mut().for_each(|witness| witness.restart(at));
        self.all.restart(at);
    }

    /// The last measurement of an input compared with the prediction by the filter without this set, where that is known.
    pub(super) fn innovation(&self, set: usize, input: usize) -> Option<(Time, Innovation)> {
        let witness = self.witnesses.get(set)?;
        witness.innovation(input).filter(|(at, _)| witness.is_known(*at))
    }

    /// Whether all inputs are trusted, and none is in conflict.
    pub(super) fn is_calm(&self) -> bool {
        let accepts = |input: usize| self.all.watch(input).is_some_and(|watch| watch.rejections == 0);
        self.masked.iter().enumerate().all(|(input, masked)| !masked && accepts(input))
    }

    /// Restarts the filter without this set from the estimate of all trusted inputs. While that is unknown, as the faulty input
    /// is not isolated, the filter restarts from the estimate of all inputs: otherwise no contradiction would ever end.
    pub(super) fn anchor(&mut self, set: usize, at: Time) {
        let Filters { all, witnesses, .. } = self;
        let Some((together, rest)) = witnesses.split_first_mut() else { return };
        let from = if all.is_known(at) { &*all } else { &*together };
        begin(rest, set, from, at);
    }

    /// Whether the estimate of all inputs fits a measurement of this moment. Where sensors return together and contradict each
    /// other, it lies between them, and is no estimate at all.
    pub(super) fn fits_together(&mut self, measurement: &Measurement, limit: f64) -> bool {
        self.witnesses.first_mut().is_some_and(|together| together.fits(measurement, limit))
    }

    /// Restarts the filter without this set from the estimate of all inputs, as a reckoning of this length bears no witness.
    pub(super) fn anchor_together(&mut self, set: usize, at: Time) {
        let Some((together, rest)) = self.witnesses.split_first_mut() else { return };
        begin(rest, set, together, at);
    }
}

/// The first set leaves out no input, and is not among `rest`.
fn begin(rest: &mut [Fusion], set: usize, from: &Fusion, at: Time) {
    let witness = set.checked_sub(1).and_then(|place| rest.get_mut(place));
    witness.into_iter().filter(|_| from.is_known(at)).for_each(|witness| witness.begin_as(from));
}
