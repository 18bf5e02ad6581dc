//! The observations of a story: formulas of time sampled as by sensors, faults, and single rows.

use super::curve::Curve;
use crate::fault::Fault;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use shsa_core::engine::{Input, Order};
use shsa_core::knowledge::{Id, KnowledgeBase, NeedId, SignalId};
use shsa_core::observation::{Observation, RawValue};
use shsa_core::time::{Span, Time};
use shsa_recording::Sample;

/// The observations and orders.
#[derive(Clone, Debug, Default)]
pub(super) struct Trace {
    pub(super) duration: Span,
    pub(super) seed: u64,
    pub(super) sources: Vec<Source>,
    pub(super) echoes: Vec<Echo>,
    pub(super) faults: Vec<(Fault, SignalId)>,
    pub(super) rows: Vec<Sample>,
    /// Orders of operators, by time.
    pub(super) orders: Vec<(Time, Order)>,
}

/// A sensor that samples a formula.
#[derive(Clone, Debug)]
pub(super) struct Source {
    pub(super) signal: SignalId,
    pub(super) curve: Curve,
    pub(super) period: Span,
    /// The first sample, and the end of all samples.
    pub(super) from: Span,
    pub(super) to: Span,
    /// The largest lateness of a sample, uniformly distributed.
    pub(super) jitter: Span,
    /// By how much the content is older than its stamp.
    pub(super) delay: Span,
    /// The time from the stamp to the reception.
    pub(super) latency: Span,
    /// The largest error to either side, in the unit of the signal, uniformly distributed.
    pub(super) noise: f64,
    /// How far a sample must be from the last one that was sent; 0: each is sent.
    pub(super) dead_band: f64,
}

/// A publisher that repeats the published values of a need under another name.
#[derive(Clone, Copy, Debug)]
pub(super) struct Echo {
    pub(super) signal: SignalId,
    pub(super) need: NeedId,
    pub(super) latency: Span,
}

impl Trace {
    /// All observations except the echoes, with the faults injected into what is sampled, and all orders, in the order of
    /// reception. Inputs after the end are left out. An order comes before the observations of its moment.
    pub(super) fn inputs(&self, knowledge: &KnowledgeBase) -> Vec<Input> {
        let sampled =
            |(number, source): (usize, &Source)| source.samples(knowledge, self.seed, number as u64);
        let mut samples: Vec<Sample> = self.sources.iter().enumerate().flat_map(sampled).collect();
        samples.sort_by_key(|sample| sample.received);
        for (number, (fault, signal)) in self.faults.iter().enumerate() {
            let scaling = knowledge.signals()[*signal].scaling;
            let seed = self.seed.wrapping_add(number as u64);
            fault.inject(&mut samples, signal.index(), scaling, Time(0), seed);
        }
        // What is written out is meant as it stands.
        samples.extend(self.rows.iter().cloned());
        samples.sort_by_key(|sample| sample.received);
        let end = Time(0) + self.duration;
        let order = |(time, order): &(Time, Order)| Input::Order { time: *time, order: order.clone() };
        let mut inputs: Vec<Input> = self.orders.iter().map(order).collect();
        inputs.extend(samples.into_iter().filter(|sample| sample.received <= end).map(input));
        inputs.sort_by_key(Input::time);
        inputs
    }
}

impl Source {
    fn samples(&self, knowledge: &KnowledgeBase, seed: u64, number: u64) -> Vec<Sample> {
        let signal = &knowledge.signals()[self.signal];
        let mut value = self.curve.values(signal.unit.clone());
        let reading = |value: f64| signal.scaling.map_or(value, |scaling| scaling.reading(value));
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(number);
        let count = (self.to - self.from).0.max(0) / self.period.0.max(1) + 1;
        let moment = |step: i64| Time(0) + self.from + self.period.times(step);
        let within = |time: &Time| *time - Time(0) < self.to;
        let mut sent = f64::NAN;
        (0..count)
            .map(moment)
            .take_while(within)
            .filter_map(|moment| {
                let time = moment + Span((self.jitter.0 as f64 * even(&mut random)) as i64);
                let noise = self.noise * (2.0 * even(&mut random) - 1.0);
                let value = value(time - self.delay) + noise;
                if (value - sent).abs() < self.dead_band {
                    return None;
                }
                sent = value;
                let value = RawValue::Number(reading(value));
                Some(Sample { wanted: self.signal.index(), time, received: time + self.latency, value })
            })
            .collect()
    }
}

/// A uniform random number between 0 (included) and 1 (excluded), with 53 bits.
fn even(random: &mut ChaCha8Rng) -> f64 {
    (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
}

fn input(sample: Sample) -> Input {
    Input::Observation(Observation {
        signal: SignalId::from_index(sample.wanted),
        stamp: sample.time,
        received: sample.received,
        value: sample.value,
    })
}
