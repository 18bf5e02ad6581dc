//! Every comparison that the engine's monitor makes over observations, as numbers.

use shsa_core::alignment::{Known, Sample};
use shsa_core::knowledge::KnowledgeBase;
use shsa_core::monitor::{self, Monitor, Residual, WatchedWay, WayIndex};
use shsa_core::observation::Observation;
use shsa_core::substitution::Way;
use shsa_core::time::{Span, Time, Validity};
use std::collections::VecDeque;

/// The most outputs that wait for the other way.
const MOST_WAITING: usize = 64;

/// One comparison of two ways, all in SI.
#[derive(Clone, Copy, Debug)]
pub struct Comparison {
    /// When it was made.
    pub received: Time,
    /// The time in which the slower way's value was true.
    pub validity: Validity,
    /// The midpoint of the slower way's value.
    pub value: f64,
    /// The midpoint of the other way's value at the same moment.
    pub known: f64,
    /// The sum of both widths.
    pub width: f64,
}

impl Comparison {
    /// The difference of both values beyond what they leave open: 0 where they overlap.
    #[must_use]
    pub fn beyond(&self) -> f64 {
        let apart = self.value - self.known;
        (apart.abs() - 0.5 * self.width).max(0.0).copysign(apart)
    }
}

/// All ways of a model with their outputs, and all pairs with their comparisons.
pub struct Watched {
    /// The monitor.
    pub monitor: Monitor,
    /// For each way, the pairs in which it is the slower one, and all of its pairs.
    compares: Vec<Vec<usize>>,
    touches: Vec<Vec<usize>>,
    /// For each pair, the outputs of the slower way that wait for the other way.
    waiting: Vec<VecDeque<Sample>>,
    /// For each way, the validity and the midpoint of each output, SI.
    pub outputs: Vec<Vec<(Validity, f64)>>,
    /// The comparisons of each pair, in the order of [`Monitor::residuals`].
    pub comparisons: Vec<Vec<Comparison>>,
}

impl Watched {
    /// Compares as the engine does, and starts anew for each stretch. Observations are in the order of reception. Time: that of
    /// the monitor.
    #[must_use]
    pub fn over<'o>(
        knowledge: &KnowledgeBase,
        ways: &[Way],
        stretches: impl IntoIterator<Item = &'o [Observation]>,
    ) -> Watched {
        let monitor = || Monitor::new(knowledge, ways.to_vec(), monitor::Options::default());
        let mut watched = Watched::empty(monitor());
        for (number, stretch) in stretches.into_iter().enumerate() {
            if number > 0 {
                watched.monitor = monitor();
                watched.waiting.iter_mut().for_each(VecDeque::clear);
            }
            watched.go_on(knowledge, stretch);
        }
        watched
    }

    fn empty(monitor: Monitor) -> Watched {
        let mut compares = vec![Vec::new(); monitor.ways().len()];
        let mut touches = compares.clone();
        // That a value lies within a range shows nothing of its errors.
        let is_range = |pair: &Residual| monitor.way(pair.other).is_some_and(WatchedWay::is_range);
        let pairs = monitor.residuals().iter().enumerate();
        for (number, pair) in pairs.filter(|(_, pair)| !is_range(pair)) {
            compares[pair.way.0 as usize].push(number);
            touches[pair.way.0 as usize].push(number);
            touches[pair.other.0 as usize].push(number);
        }
        let waiting = vec![VecDeque::new(); monitor.residuals().len()];
        let outputs = vec![Vec::new(); monitor.ways().len()];
        let comparisons = vec![Vec::new(); monitor.residuals().len()];
        Watched { monitor, compares, touches, waiting, outputs, comparisons }
    }

    fn go_on(&mut self, knowledge: &KnowledgeBase, observations: &[Observation]) {
        for moment in observations.chunk_by(|one, next| one.received == next.received) {
            let Some(now) = moment.first().map(|first| first.received) else { continue };
            for observation in moment {
                self.monitor.observe(knowledge, observation, now);
            }
            self.monitor.settle(now);
            self.note(now);
        }
    }

    fn note(&mut self, now: Time) {
        let fresh: Vec<(WayIndex, Sample)> = self.monitor.fresh().collect();
        for (WayIndex(way), sample) in &fresh {
            self.outputs[*way as usize].push((sample.validity, sample.value.midpoint()));
            for &number in &self.compares[*way as usize] {
                let waiting = &mut self.waiting[number];
                waiting.push_back(*sample);
                if waiting.len() > MOST_WAITING {
                    waiting.pop_front();
                }
            }
        }
        for (WayIndex(way), _) in &fresh {
            for at in 0..self.touches[*way as usize].len() {
                self.compare(self.touches[*way as usize][at], now);
            }
        }
    }

    /// Compares the waiting outputs of a pair, oldest first, as far as the other way has outputs.
    fn compare(&mut self, number: usize, now: Time) {
        while let Some(sample) = self.waiting[number].front().copied() {
            let (slow, other) = self.sides(&self.monitor.residuals()[number]);
            let comparison = match other.beside(slow, sample.validity) {
                Known::Later => return,
                Known::Never => None,
                Known::Value(known) => {
                    let known = slow.in_turn(known, sample.value);
                    // A mean is compared with the mean over the same time, and not with a value of its middle.
                    let is_of_moment = slow.computation.timing().mean_over == Span::ZERO;
                    let line = other.line(sample.validity, sample.value).filter(|_| is_of_moment);
                    Some(Comparison {
                        received: now,
                        validity: sample.validity,
                        value: sample.value.midpoint(),
                        known: line.map_or(known.midpoint(), |line| line.value),
                        width: sample.value.width() + known.width(),
                    })
                }
            };
            self.waiting[number].pop_front();
            self.comparisons[number].extend(comparison);
        }
    }

    /// The slower and the faster way of a pair.
    #[must_use]
    pub fn sides(&self, pair: &Residual) -> (&WatchedWay, &WatchedWay) {
        let way = |index: WayIndex| &self.monitor.ways()[index.0 as usize];
        (way(pair.way), way(pair.other))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::chance::Chance;
    use shsa_core::engine::{WatchBudget, to_watch};
    use shsa_core::knowledge::{Id, SignalId};
    use shsa_core::observation::RawValue;
    use shsa_core::plan::Graph;

    /// A noisy sensor, and another one that gives means of it.
    fn observations(chance: &mut Chance, rate_hz: f64, over_s: f64) -> Vec<Observation> {
        let fast: Vec<f64> = (0..(60.0 * rate_hz) as usize).map(|_| chance.normal()).collect();
        let observation = |signal: usize, at: f64, value: f64| {
            let at = Time::from_seconds(at);
            let value = RawValue::Number(value);
            Observation { signal: SignalId::from_index(signal), stamp: at, received: at, value }
        };
        let own =
            fast.iter().enumerate().map(|(number, value)| observation(0, number as f64 / rate_hz, *value));
        let mean = |number: usize| {
            let to = over_s + 0.5 * number as f64;
            let from = ((to - over_s) * rate_hz).ceil() as usize;
            let within = &fast[from..(to * rate_hz) as usize];
            observation(1, to, within.iter().sum::<f64>() / within.len() as f64)
        };
        let means = (0..(2.0 * (59.0 - over_s)) as usize).map(mean);
        let mut all: Vec<Observation> = own.chain(means).collect();
        all.sort_by_key(|it| it.received);
        all
    }

    /// Whatever the noise of single values, and although nothing bounds how fast they change.
    #[test]
    fn a_mean_is_compared_with_the_mean_over_its_time() {
        for seed in 0..10 {
            let mut chance = Chance::new(seed);
            let (rate_hz, over_s) = (20.0 + 30.0 * chance.share(), 1.0 + 2.0 * chance.share());
            let text = format!(
                "shsa: 1\nvariables: {{ x: {{ unit: m }} }}\nsignals:\n  fast: {{ variable: x, rate: {rate_hz} Hz }}\n  \
                 slow: {{ variable: x, rate: 2 Hz, mean_over: {over_s} s, delay: {} s }}\n",
                0.5 * over_s
            );
            let knowledge = shsa_model::load(&text, "means.yaml").knowledge;
            let ways = to_watch(&knowledge, &Graph::new(&knowledge), WatchBudget::default());
            let all = observations(&mut chance, rate_hz, over_s);
            let watched = Watched::over(&knowledge, &ways, [all.as_slice()]);
            let apart: Vec<f64> =
                watched.comparisons.iter().flatten().map(|it| it.value - it.known).collect();
            let deviation = crate::order::variance(&apart).sqrt();
            assert!(
                apart.len() > 80 && deviation < 0.2,
                "seed {seed}: {} comparisons, {deviation}",
                apart.len()
            );
        }
    }
}
