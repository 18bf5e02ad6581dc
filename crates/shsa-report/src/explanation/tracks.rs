//! The values of a variable's ways over time, and their disagreements; recorded while an engine runs.

use crate::bands::{BandSource, Watched, joined};
use core::ops::Bound;
use shsa_core::alignment::Sample;
use shsa_core::circle;
use shsa_core::engine::{Engine, Evidence, Side};
use shsa_core::interval::Interval;
use shsa_core::knowledge::{Variable, VariableId};
use shsa_core::time::{Span, Time, Validity};

/// The most ways that are drawn, of those that rest on the accused and of others: more cannot be told apart in a drawing.
const MOST_ACCUSED: usize = 2;
const MOST_OTHERS: usize = 5;

/// The values of one way.
pub(super) struct Track {
    pub(super) source: BandSource,
    pub(super) is_accused: bool,
    pub(super) samples: Vec<Sample>,
}

/// The values of a variable's ways in a stretch of time.
pub(super) struct Tracks {
    pub(super) variable: VariableId,
    pub(super) from: Time,
    pub(super) to: Time,
    pub(super) tracks: Vec<Track>,
    /// The number of further ways.
    pub(super) left_out: usize,
    /// The stretches in which a comparison with the accused disagreed.
    pub(super) disagreements: Vec<Validity>,
    watched: Vec<Watched>,
}

impl Tracks {
    /// Tracks of a variable's ways that take part in the evidence.
    pub(super) fn new(evidence: &Evidence, variable: VariableId, (from, to): (Time, Time)) -> Tracks {
        let of_it = || evidence.comparisons.iter().filter(|comparison| comparison.variable == variable);
        let mut sides: Vec<&Side> = Vec::new();
        let mut conflicts: Vec<_> = of_it().collect();
        // Conflicts come first, and the signal itself comes before ways computed from it.
        conflicts.sort_by_key(|each| (!each.is_conflict(), each.own.way.direct().is_none()));
        for side in conflicts.iter().flat_map(|comparison| [&comparison.own, &comparison.other]) {
            if !sides.iter().any(|known| known.index == side.index) {
                sides.push(side);
            }
        }
        let all = sides.len();
        let rests = |side: &&&Side| side.rests_on.contains(evidence.signal);
        let accused = sides.iter().filter(rests).take(MOST_ACCUSED);
        let others = sides.iter().filter(|side| !rests(side)).take(MOST_OTHERS);
        let track = |side: &&Side| Track {
            source: BandSource::Way(side.index, side.way.clone()),
            is_accused: side.rests_on.contains(evidence.signal),
            samples: Vec::new(),
        };
        let mut tracks: Vec<Track> = accused.chain(others).map(track).collect();
        let left_out = all - tracks.len();
        if tracks.is_empty() {
            let source = BandSource::Signal(evidence.signal);
            tracks.push(Track { source, is_accused: true, samples: Vec::new() });
        }
        let watched =
            |comparison: &shsa_core::engine::Comparison| Watched { pair: comparison.pair, last: None };
        let watched = of_it().filter(|each| each.explained_by.is_empty()).map(watched).collect();
        Tracks { variable, from, to, tracks, left_out, disagreements: Vec::new(), watched }
    }

    /// Takes in new values; call it after each input while the knowledge base stays the same.
    pub(super) fn look(&mut self, engine: &Engine) {
        for track in &mut self.tracks {
            track.look(engine, (self.from, self.to));
        }
        for watched in &mut self.watched {
            self.disagreements.extend(watched.look(engine));
        }
    }

    /// Unwraps the tracks of a variable that wraps: the first track begins within one turn, each other one as near to it as
    /// possible, and none jumps. Returns whether a track leaves that turn.
    pub(super) fn bring_beside(&mut self, variable: &Variable) -> bool {
        let Some(turn) = variable.wraps else { return false };
        let [known, others @ ..] = self.tracks.as_mut_slice() else { return false };
        known.go_on_from(turn, |first| variable.brought_back(first.value));
        for track in others {
            track.go_on_from(turn, |first| {
                let beside = known.samples.iter().find(|sample| sample.validity.to >= first.validity.to);
                let beside = beside.or(known.samples.last()).map(|sample| sample.value);
                beside.map_or_else(
                    || variable.brought_back(first.value),
                    |it| circle::nearest(first.value, it, turn),
                )
            });
        }
        let begins = variable.turn_begins();
        let is_outside = |value: Interval| value.lo() < begins || value.hi() > begins + turn;
        self.tracks.iter().flat_map(|track| &track.samples).any(|sample| is_outside(sample.value))
    }

    /// The stretches of time in which a comparison disagreed, ascending.
    pub(super) fn stretches(&self) -> Vec<Validity> {
        let inside = Validity { from: self.from, to: self.to };
        let merged = joined(self.disagreements.clone(), Span::ZERO);
        merged.into_iter().filter_map(|each| each.intersection(inside)).collect()
    }
}

impl Track {
    fn look(&mut self, engine: &Engine, (from, to): (Time, Time)) {
        let last = self.samples.last().map(|last| Bound::Excluded(last.validity.to));
        let Track { source, samples, .. } = self;
        source.news(engine, last.unwrap_or(Bound::Included(from)), to, |sample| samples.push(sample));
    }

    /// Shifts the samples by whole turns: the first one to where `begin` puts it, each further one next to its predecessor.
    fn go_on_from(&mut self, turn: f64, begin: impl FnOnce(&Sample) -> Interval) {
        let Some(mut before) = self.samples.first().map(begin) else { return };
        for sample in &mut self.samples {
            sample.value = circle::nearest(sample.value, before, turn);
            before = sample.value;
        }
    }
}

/// The time to be shown before and after a decision, so that its cause is visible: that of a trend lies before its alarm, by
/// the time over which the trend averages.
pub(super) fn half_window(engine: &Engine, evidence: &Evidence) -> Span {
    let periods = evidence.comparisons.iter().flat_map(|each| [each.own.index, each.other.index]);
    let periods = periods.filter_map(|index| engine.monitor().way(index)?.computation.timing().period);
    let period = periods.max().unwrap_or(Span::ZERO);
    let conflicts = || evidence.comparisons.iter().filter(|each| each.is_conflict());
    let onset = conflicts().filter_map(|each| each.onset).min();
    let latency = onset.map_or(Span::ZERO, |onset| evidence.time - onset);
    let of_trends = conflicts().filter(|each| each.together.is_some());
    let of_trends = of_trends.filter_map(|each| engine.monitor().residuals().get(each.pair));
    let averaged = of_trends.map(|pair| pair.trend.latency(period)).max().unwrap_or(Span::ZERO);
    let timeout = engine.knowledge().signals()[evidence.signal].timeout.unwrap_or(Span::ZERO);
    [Span::from_millis(2_000), latency.times(3), averaged.times(3), timeout.times(3), period.times(15)]
        .into_iter()
        .max()
        .unwrap_or_default()
}
