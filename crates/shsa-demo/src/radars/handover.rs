//! The service of a border between two radars: it predicts the tracks of the radar that is left to the time of those of the radar that is
//! entered, associates them, and says where both see one vehicle, and how many vehicles each sees.
//!
//! The association is global nearest neighbour: the assignment of least Mahalanobis distance, within a gate. The distance counts that a
//! radar may stand or stamp wrongly by some metres: else a faulty radar's tracks would find no partners, and no contradiction would be
//! seen.

use super::assignment::assign;
use super::radar::{ACROSS_M, ALONG_M, SPACING_M, Track, sees};
use std::collections::VecDeque;

/// A chi-square variable of two degrees of freedom is below it with 99.9 %.
const GATE: f64 = 13.8;
/// How far off a radar may be along and across, m: one standard deviation.
const PLACED_M: (f64, f64) = (3.0, 0.7);
/// Half a lorry, and the error of its position, m.
const HALF_M: f64 = 7.0;
/// The time over which vehicles are counted, in scans of 0.1 s.
const COUNTED: usize = 40;
/// Scans between two vehicles: values of the one are not compared with values of the other.
const QUIET: usize = 4;
/// A message of a vehicle is used for this long, s.
const TOLD_FOR_S: f64 = 0.6;

/// A border between two radars.
#[derive(Clone, Debug)]
pub(super) struct Handover {
    /// The radar that is left, from 0; the next one is entered.
    radar: usize,
    counts: VecDeque<Counts>,
    /// The vehicle that was spoken of last.
    last: Option<Track>,
    /// For how many scans nothing is said, as another vehicle is spoken of from now on.
    quiet: usize,
}

/// How many vehicles are at the border.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Counts {
    pub(super) left: f64,
    pub(super) entered: f64,
    pub(super) told: f64,
}

/// One vehicle, by each who sees it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Seen {
    pub(super) left: Option<Track>,
    pub(super) entered: Option<Track>,
    pub(super) told: Option<Track>,
}

impl Seen {
    fn all(&self) -> impl Iterator<Item = Track> {
        [self.left, self.entered, self.told].into_iter().flatten()
    }

    /// Where it is: by the mean of the radars, else by itself.
    fn place(&self) -> Option<Track> {
        match (self.left, self.entered) {
            (Some(one), Some(other)) => {
                Some(Track { x: f64::midpoint(one.x, other.x), y: f64::midpoint(one.y, other.y), ..one })
            }
            (one, other) => one.or(other).or(self.told),
        }
    }

    /// The vehicle that most of them are tracks of: for the score only.
    pub(super) fn of(&self) -> Option<u32> {
        let tracks: Vec<u32> = self.all().map(|track| track.of).collect();
        tracks.iter().copied().max_by_key(|id| tracks.iter().filter(|other| *other == id).count())
    }
}

impl Handover {
    pub(super) fn new(radar: usize) -> Handover {
        Handover { radar, counts: VecDeque::new(), last: None, quiet: 0 }
    }

    /// Takes in the newest tracks of both radars and what vehicles have told; returns the vehicle nearest to the middle, and the counts.
    pub(super) fn take(
        &mut self,
        left: &[Track],
        entered: &[Track],
        told: &[Track],
        at_s: f64,
    ) -> (Seen, Counts) {
        let fresh = told.iter().filter(|told| at_s - told.at_s < TOLD_FOR_S).copied();
        let [left, entered, told] = [left.to_vec(), entered.to_vec(), fresh.collect()]
            .map(|tracks: Vec<Track>| self.at(tracks, at_s));
        let count = |tracks: &[Track]| tracks.iter().filter(|track| self.is_whole(**track)).count() as f64;
        let counts = Counts { left: count(&left), entered: count(&entered), told: count(&told) };
        self.counts.push_back(counts);
        if self.counts.len() > COUNTED {
            self.counts.pop_front();
        }
        let seen = with_told(pairs(&left, &entered), &told);
        (self.spoken_of(&seen, at_s), self.mean())
    }

    /// The vehicle of the scan before while it is there, else the nearest one, after some scans of silence.
    fn spoken_of(&mut self, seen: &[Seen], at_s: f64) -> Seen {
        let last = self.last.map(|last| last.ahead(at_s));
        let is_same =
            |seen: &&Seen| last.zip(seen.place()).is_some_and(|(last, now)| distance(&last, &now).is_some());
        let same = seen.iter().find(is_same).filter(|seen| seen.place().is_some_and(|it| self.is_whole(it)));
        let chosen = same.copied().or_else(|| self.nearest(seen)).unwrap_or_default();
        if same.is_none() && last.is_some() {
            self.quiet = QUIET;
        }
        self.last = chosen.place();
        let is_quiet = self.quiet > 0;
        self.quiet = self.quiet.saturating_sub(1);
        if is_quiet { Seen::default() } else { chosen }
    }

    /// Tracks at another time, as far as they are then where both radars could see them.
    fn at(&self, tracks: Vec<Track>, at_s: f64) -> Vec<Track> {
        let both =
            |track: &Track| sees(self.radar, track.x, track.y) && sees(self.radar + 1, track.x, track.y);
        tracks.into_iter().map(|track| track.ahead(at_s)).filter(both).collect()
    }

    /// Whether a lorry there is within both fields.
    fn is_whole(&self, track: Track) -> bool {
        let ends = [track.x - HALF_M, track.x + HALF_M];
        ends.into_iter().all(|x| sees(self.radar, x, track.y) && sees(self.radar + 1, x, track.y))
    }

    fn nearest(&self, seen: &[Seen]) -> Option<Seen> {
        let middle = SPACING_M * (self.radar as f64 + 1.0) + 50.0;
        let away =
            |seen: &Seen| seen.all().map(|track| (track.x - middle).abs()).fold(f64::INFINITY, f64::min);
        // Who is seen by more is the better witness.
        let witness = |seen: &Seen| (seen.place().is_some_and(|it| self.is_whole(it)), seen.all().count());
        let order = |one: &&Seen, other: &&Seen| {
            witness(other).cmp(&witness(one)).then(away(one).total_cmp(&away(other)))
        };
        seen.iter().min_by(order).copied()
    }

    fn mean(&self) -> Counts {
        let scans = self.counts.len() as f64;
        let mean = |count: fn(&Counts) -> f64| self.counts.iter().map(count).sum::<f64>() / scans;
        Counts { left: mean(|it| it.left), entered: mean(|it| it.entered), told: mean(|it| it.told) }
    }
}

/// The square of the distance of two tracks in standard deviations, within the gate.
fn distance(one: &Track, other: &Track) -> Option<f64> {
    let variance = |bound: f64, placed: f64| 2.0 * (bound / 3.0).powi(2) + placed.powi(2);
    let square = (one.x - other.x).powi(2) / variance(ALONG_M, PLACED_M.0)
        + (one.y - other.y).powi(2) / variance(ACROSS_M, PLACED_M.1);
    (square < GATE).then_some(square)
}

/// The vehicles that are seen: by both radars, or by one of them.
fn pairs(left: &[Track], entered: &[Track]) -> Vec<Seen> {
    let assigned =
        assign(left.len(), entered.len(), |row, column| distance(left.get(row)?, entered.get(column)?));
    let partner = |column: &Option<usize>| column.and_then(|column| entered.get(column).copied());
    let mut seen: Vec<Seen> = left
        .iter()
        .zip(&assigned)
        .map(|(track, column)| Seen { left: Some(*track), entered: partner(column), told: None })
        .collect();
    let alone = entered.iter().enumerate().filter(|(column, _)| !assigned.contains(&Some(*column)));
    seen.extend(alone.map(|(_, track)| Seen { entered: Some(*track), ..Seen::default() }));
    seen
}

/// With what the vehicles say themselves.
fn with_told(mut seen: Vec<Seen>, told: &[Track]) -> Vec<Seen> {
    let places: Vec<Option<Track>> = seen.iter().map(Seen::place).collect();
    let cost = |row: usize, column: usize| distance(places.get(row)?.as_ref()?, told.get(column)?);
    let assigned = assign(seen.len(), told.len(), cost);
    for (seen, column) in seen.iter_mut().zip(&assigned) {
        seen.told = column.and_then(|column| told.get(column).copied());
    }
    let alone = told.iter().enumerate().filter(|(column, _)| !assigned.contains(&Some(*column)));
    seen.extend(alone.map(|(_, track)| Seen { told: Some(*track), ..Seen::default() }));
    seen
}

#[cfg(test)]
mod tests {
    use super::*;

    fn track(x: f64, y: f64) -> Track {
        Track { at_s: 0.0, x, y, speed: 20.0, of: x as u32 }
    }

    #[test]
    fn tracks_are_predicted_and_associated_as_a_whole() {
        let mut border = Handover::new(0);
        // 0.1 s later both are 2 m further; the nearest partner of the second would be that of the first.
        let left = [track(145.0, 2.0), track(150.0, 2.0)];
        let entered = [track(150.0, 2.0), track(155.0, 2.0)].map(|it| Track { at_s: 0.1, ..it });
        let (seen, counts) = border.take(&left, &entered, &[], 0.1);
        assert_eq!((seen.left.map(|it| it.x), seen.entered.map(|it| it.x)), (Some(147.0), Some(150.0)));
        assert_eq!((counts.left, counts.entered, counts.told), (2.0, 2.0, 0.0));
    }

    #[test]
    fn another_lane_is_no_partner() {
        let mut border = Handover::new(0);
        let (seen, _) = border.take(&[track(145.0, 2.0)], &[track(145.0, 5.5)], &[], 0.0);
        assert!(seen.left.is_some() != seen.entered.is_some());
    }
}
