//! Every comparison that the engine's monitor makes over observations, as numbers.

use shsa_core::knowledge::KnowledgeBase;
use shsa_core::monitor::{self, Monitor, Pair, Relationship, WatchedWay, WayIndex};
use shsa_core::observation::Observation;
use shsa_core::substitution::Way;
use shsa_core::time::{Time, Validity};

/// One comparison of two ways, all in SI.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Comparison {
    pub(crate) received: Time,
    pub(crate) validity: Validity,
    /// The middle of the slower way's value, and of what the other says about the same moment.
    pub(crate) value: f64,
    pub(crate) known: f64,
    /// By how much the value lies above what is known: how much wider both must be together to meet. Negative: they
    /// overlap by that.
    pub(crate) above: f64,
    /// As `above`, below.
    pub(crate) below: f64,
    /// The widths of both.
    pub(crate) width: f64,
}

/// All ways of a model with what they said, and all pairs with what they compared.
pub(crate) struct Watched {
    pub(crate) monitor: Monitor,
    /// When and what each way said: the middle of its value, SI.
    pub(crate) outputs: Vec<Vec<(Validity, f64)>>,
    pub(crate) comparisons: Vec<Vec<Comparison>>,
    /// How often each pair came into conflict, by single comparisons or by many together, and whether it is.
    pub(crate) conflicts: Vec<(usize, bool)>,
}

impl Watched {
    /// Compares as the engine does. Observations are in the order of reception. Time: that of the monitor.
    pub(crate) fn over(knowledge: &KnowledgeBase, ways: &[Way], observations: &[Observation]) -> Watched {
        let monitor = Monitor::new(knowledge, ways.to_vec(), monitor::Options::default());
        let mut compares = vec![Vec::new(); monitor.ways().len()];
        for (number, pair) in monitor.pairs().iter().enumerate() {
            compares[pair.way.0 as usize].push(number);
        }
        let outputs = vec![Vec::new(); monitor.ways().len()];
        let comparisons = vec![Vec::new(); monitor.pairs().len()];
        let conflicts = vec![(0, false); monitor.pairs().len()];
        let mut watched = Watched { monitor, outputs, comparisons, conflicts };
        for moment in observations.chunk_by(|one, next| one.received == next.received) {
            let Some(now) = moment.first().map(|first| first.received) else { continue };
            for observation in moment {
                watched.monitor.observe(knowledge, observation, now);
            }
            watched.monitor.settle(now);
            watched.note(&compares, now);
        }
        watched
    }

    fn note(&mut self, compares: &[Vec<usize>], now: Time) {
        for (WayIndex(way), sample) in self.monitor.fresh() {
            self.outputs[way as usize].push((sample.validity, sample.value.midpoint()));
            for &number in &compares[way as usize] {
                let (slow, other) = self.sides(&self.monitor.pairs()[number]);
                let Some(known) = other.beside(slow, sample.validity).value() else { continue };
                let comparison = Comparison {
                    received: now,
                    validity: sample.validity,
                    value: sample.value.midpoint(),
                    known: known.midpoint(),
                    above: sample.value.lo() - known.hi(),
                    below: known.lo() - sample.value.hi(),
                    width: sample.value.width() + known.width(),
                };
                self.comparisons[number].push(comparison);
                let (count, before) = &mut self.conflicts[number];
                let is_now = self.monitor.pairs()[number].relationship(now) == Relationship::Conflict;
                *count += usize::from(is_now && !std::mem::replace(before, is_now));
            }
        }
    }

    /// The slower and the faster way of a pair.
    pub(crate) fn sides(&self, pair: &Pair) -> (&WatchedWay, &WatchedWay) {
        let way = |index: WayIndex| &self.monitor.ways()[index.0 as usize];
        (way(pair.way), way(pair.other))
    }
}
