//! A monitor goes on from the one before a change of the knowledge base: unchanged elements keep their state.

use super::comparison::insert;
use super::{Monitor, Residual, WatchedWay, WayIndex};
use crate::knowledge::{Id, Lineage, SignalSet};
use crate::time::Time;
use alloc::collections::BTreeMap;
use alloc::vec::Vec;

/// The state that a monitor has taken over from the one before.
#[derive(Clone, Debug, Default)]
pub struct Inheritance {
    /// For each way of the old monitor, the same way of the new one; `None` where it is gone or computes something else.
    ways: Vec<Option<WayIndex>>,
    /// The signals of all pairs that go on.
    pub compared: SignalSet,
    /// Whether every pair goes on.
    pub is_whole: bool,
}

impl Inheritance {
    /// The way that goes on from a way of the old monitor.
    #[must_use]
    pub fn way(&self, old: WayIndex) -> Option<WayIndex> {
        self.ways.get(old.0 as usize).copied().flatten()
    }
}

impl Monitor {
    /// Takes over the ports, absences and detectors of signals that mean the same, the outputs of ways that compute the same, and
    /// the recent comparisons of pairs of these. Time: O(n log n) in signals, ways and pairs, and their samples.
    ///
    /// To be called between two moments: nothing may wait to be compared.
    pub fn inherit(&mut self, old: Monitor, lineage: &Lineage, now: Time) -> Inheritance {
        self.timeouts.inherit(&old.timeouts, lineage, now);
        self.detectors.inherit(&old.detectors, lineage);
        self.clocks.inherit(&old.clocks, lineage);
        let confirmed: SignalSet = old.ports.ids().filter(|it| old.is_confirmed(*it) == Some(true)).collect();
        for (index, port) in old.ports.into_iter().enumerate() {
            let before = Id::from_index(index);
            if let Some(signal) = lineage.signal(before) {
                if confirmed.contains(before) {
                    self.confirm(signal);
                }
                self.frozen[signal] = old.frozen[before];
                self.ports[signal].inherit(port);
            }
        }
        let ways = self.inherit_ways(old.ways, lineage);
        self.keep_areas();
        self.consensus.inherit(&old.consensus, &ways, now);
        self.waiting = self.ways.iter().filter(|way| !way.late.is_empty()).count();
        let mut inheritance = Inheritance { ways, compared: SignalSet::new(), is_whole: true };
        self.inherit_pairs(&old.pairs, &mut inheritance);
        inheritance
    }

    fn inherit_ways(&mut self, old: Vec<WatchedWay>, lineage: &Lineage) -> Vec<Option<WayIndex>> {
        let key = |way: &crate::substitution::Way| (way.substitution.clone(), way.signals.clone());
        let places: BTreeMap<_, usize> =
            self.ways.iter().enumerate().map(|(at, way)| (key(way.computation.way()), at)).collect();
        let mut inherit = |mut old: WatchedWay| {
            let at = *places.get(&key(&old.computation.way().succeeded(lineage)?))?;
            let way = self.ways.get_mut(at)?;
            if !way.computation.inherit(&mut old.computation, lineage) {
                return None;
            }
            let capacity = way.outputs.capacity();
            way.outputs = old.outputs;
            way.outputs.make_room(capacity);
            way.measured = old.measured;
            way.observed = way.observed.and(old.observed);
            way.late.extend(old.late.iter().take(way.late.capacity()));
            Some(WayIndex(u32::try_from(at).unwrap_or(u32::MAX)))
        };
        old.into_iter().map(&mut inherit).collect()
    }

    fn inherit_pairs(&mut self, old: &[Residual], inheritance: &mut Inheritance) {
        let chances: Vec<u64> = self.pairs.iter().map(|pair| self.chances(pair)).collect();
        self.pairs.iter_mut().zip(chances).for_each(|(pair, chances)| pair.before = chances);
        let places: BTreeMap<_, usize> =
            self.pairs.iter().enumerate().map(|(at, pair)| ((pair.way, pair.other), at)).collect();
        for before in old {
            let both = inheritance.way(before.way).zip(inheritance.way(before.other));
            let place = both.and_then(|both| places.get(&both));
            let pair = place.and_then(|&at| Some((at, self.pairs.get_mut(at)?)));
            match pair.and_then(|(at, pair)| pair.window.inherit(&before.window).then_some((at, pair))) {
                Some((at, pair)) => {
                    pair.trend = before.trend;
                    pair.disagreement = before.disagreement;
                    pair.moved = before.moved;
                    pair.due = before.due;
                    pair.known = before.known;
                    if pair.due.is_some()
                        && let Some(awaited) = self.awaited.get_mut(pair.other.0 as usize)
                    {
                        insert(awaited, u32::try_from(at).unwrap_or(u32::MAX));
                    }
                    (pair.made, pair.before) = (before.made, before.before);
                    inheritance.compared.extend(&pair.signals);
                }
                None => inheritance.is_whole = false,
            }
        }
        self.index.renew(&self.pairs);
    }
}
