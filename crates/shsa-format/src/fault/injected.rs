//! Samples with a fault, one after the other, so that a recording of any length is broken while it is replayed.

use super::FaultKind;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::Rng;
use shsa_core::knowledge::Scaling;
use shsa_core::observation::RawValue;
use shsa_core::time::Time;
use shsa_recording::Sample;
use std::collections::VecDeque;

/// Samples of a recording with a fault, in the order of reception; made by [`Fault::injected`](super::Fault::injected).
pub struct Injected<I> {
    pub(super) input: I,
    /// The number of the signal.
    pub(super) wanted: usize,
    pub(super) since: Time,
    /// The end of the fault, excluded.
    pub(super) until: Time,
    pub(super) change: Change,
    /// The latest value before the fault, at which the signal is stuck.
    pub(super) held: Option<RawValue>,
    /// A sample that comes after those that are late and due.
    pub(super) ahead: Option<Sample>,
    /// The delayed samples, each with its later reception.
    pub(super) late: VecDeque<Sample>,
    /// The reception of the newest sample of the input.
    pub(super) reached: Time,
}

impl<E, I: Iterator<Item = Result<Sample, E>>> Iterator for Injected<I> {
    type Item = Result<Sample, E>;

    /// At the end of the input, what is still late is lost: it would arrive after the end of the recording.
    fn next(&mut self) -> Option<Result<Sample, E>> {
        loop {
            if self.late.front().is_some_and(|late| late.received <= self.reached) {
                return self.late.pop_front().map(Ok);
            }
            if let Some(sample) = self.ahead.take() {
                return Some(Ok(sample));
            }
            match self.input.next()? {
                Ok(sample) => self.take(sample),
                Err(error) => return Some(Err(error)),
            }
        }
    }
}

impl<I> Injected<I> {
    fn take(&mut self, mut sample: Sample) {
        self.reached = sample.received;
        if sample.wanted != self.wanted {
            self.ahead = Some(sample);
            return;
        }
        let is_hit = self.since <= sample.received && sample.received < self.until;
        match (self.change.kind, &self.held) {
            (FaultKind::Drop, _) if is_hit => return,
            (FaultKind::Delay(delay), _) if is_hit => {
                sample.received = sample.received + delay;
                self.late.push_back(sample);
                return;
            }
            (FaultKind::Stuck(None), Some(held)) if is_hit => sample.value = held.clone(),
            (FaultKind::Stuck(None), _) => self.held = Some(sample.value.clone()),
            _ if is_hit => self.change.apply(&mut sample),
            _ => {}
        }
        self.ahead = Some(sample);
    }
}

/// A fault that changes values one by one.
pub(super) struct Change {
    pub(super) kind: FaultKind,
    pub(super) scaling: Option<Scaling>,
    pub(super) random: ChaCha8Rng,
    /// The begin of the fault.
    pub(super) since: Time,
}

impl Change {
    pub(super) fn apply(&mut self, sample: &mut Sample) {
        let elapsed = (sample.received - self.since).seconds();
        let mut each = |reading: &mut f64| *reading = self.reading(*reading, elapsed);
        match &mut sample.value {
            RawValue::Number(value) => each(value),
            RawValue::Interval { lo, hi } => {
                let middle = lo.midpoint(*hi);
                let mut moved = middle;
                each(&mut moved);
                (*lo, *hi) = (*lo + moved - middle, *hi + moved - middle);
            }
            RawValue::Vector(values) => values.iter_mut().for_each(each),
        }
    }

    /// The changed reading; a reading whose value does not change stays bit-identical.
    fn reading(&mut self, reading: f64, elapsed: f64) -> f64 {
        let Some(scaling) = self.scaling else { return self.changed(reading, elapsed) };
        let value = scaling.value(reading);
        let changed = self.changed(value, elapsed);
        if changed == value { reading } else { scaling.reading(changed) }
    }

    fn changed(&mut self, value: f64, elapsed: f64) -> f64 {
        match self.kind {
            FaultKind::Bias(amount) => value + amount,
            FaultKind::Noise(amount) => value + amount * (2.0 * self.random() - 1.0),
            FaultKind::Drift(rate) => value + rate * elapsed,
            FaultKind::Spike(amount) => {
                let hit = self.random() < 0.1;
                if hit { value + amount } else { value }
            }
            FaultKind::Scale(factor) => value * factor,
            FaultKind::Spoof(fixed) | FaultKind::Stuck(Some(fixed)) => fixed,
            FaultKind::Stuck(None) | FaultKind::Drop | FaultKind::Delay(_) => value,
        }
    }

    /// A uniform random number between 0 (included) and 1 (excluded), with 53 bits.
    fn random(&mut self) -> f64 {
        (self.random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }
}
