//! The gate before a port: refuses a reading that could not have followed the one before it.
//!
//! A single outlier is refused and leaves no trace. When outliers have become frequent, the detector of the signal opens the gate
//! ([`Gate::set_open`]). Then each reading is measured by the one before it, whatever that was, so that a lasting level is
//! accepted and a glitch is not.
//!
//! After an accepted jump, a signal is *away*: its readings could not have got there from the last reading before the jump. Time
//! alone does not end that, although ever more becomes possible as it passes. A signal returns with a reading that is possible
//! only after a return, or with a jump that undoes the first one.
//!
//! A repeated value may have been held: in the rows of a log, or by a bus that sends more often than the sensor measures. Its age
//! counts from the first of these readings, and is at most the time for which the signal may be silent. It may as well have been
//! measured each time. So a reading that is possible only if the value before it was held is in doubt until the next one: what
//! that one stands by was the next measurement, what it cannot have followed was a glitch.
//!
//! A reading that is impossible after the last one, but possible after the one before that by a slower movement than the last one's, is
//! refused, and either may be wrong: what the next one can follow was right.
//!
//! What never fell and jumps to where it could have got from 0 counts anew, once it rises again.
//!
//! Readings stamped on arrival come in a burst after a bus or a machine has stalled: the time between two of them is then next to
//! nothing, while they were measured a period apart. So every time between two readings counts as at least a period of the
//! signal.

#[cfg(test)]
mod tests;

use super::history::Sample;
use super::reception::Jump;
use crate::circle;
use crate::interval::Interval;
use crate::knowledge::Signal;
use crate::time::{Span, Validity};

/// Measures the readings of one signal. O(1) a reading, without allocation.
///
/// Readings of one moment of reception are measured against readings of earlier moments, so their order does not matter.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Gate {
    pace: Option<Pace>,
    /// The turn after which values repeat.
    wraps: Option<f64>,
    /// How long a value may be held.
    max_hold: Span,
    /// The earlier reading against which readings of this moment are measured, valid since its first repetition.
    anchor: Option<Sample>,
    /// The anchor before it.
    before: Option<Sample>,
    /// From its first repetition to its last one.
    held: Span,
    /// The newest reading in doubt: of an earlier moment, and of this one.
    doubt: Option<Sample>,
    doubtful: Option<Sample>,
    /// The newest accepted reading of this moment; any reading while the gate is open.
    next: Option<Sample>,
    /// The newest refused reading of this moment.
    refused: Option<Sample>,
    /// The reading refused at the moment before, where the anchor may be the wrong one.
    rival: Option<Sample>,
    is_open: bool,
    /// The state of readings that have left the possible range.
    away: Option<Away>,
    /// Where the readings have gone since the beginning or the last jump.
    course: Option<Course>,
    /// Whether the readings are at a new level that is as good as the one before the last jump.
    is_anew: bool,
}

/// The outcome of measuring a reading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Measured {
    /// The reading can have followed.
    Possible,
    /// The reading stands by this one, which was in doubt.
    Confirming(Sample),
    /// The reading can have followed, but not the one that was in doubt.
    Refuting(Jump),
    /// The reading can have followed only if the value before it was held.
    Doubtful,
    /// The reading cannot have followed.
    TooFast(Jump),
}

/// Where readings have gone since the first of them.
#[derive(Clone, Copy, Debug)]
struct Course {
    first: Interval,
    /// The highest lower bound.
    highest: f64,
    /// Whether a reading was certainly below an earlier one.
    falls: bool,
}

impl Course {
    fn new(first: Interval) -> Course {
        Course { first, highest: first.lo(), falls: false }
    }

    #[inline]
    fn step(&mut self, value: Interval) {
        self.falls |= value.hi() < self.highest;
        self.highest = self.highest.max(value.lo());
    }

    /// Whether the readings have risen and never fallen, as what counts does.
    fn counts(&self) -> bool {
        !self.falls && self.highest > self.first.hi()
    }
}

/// How far readings can move apart.
#[derive(Clone, Copy, Debug)]
struct Pace {
    /// The largest rate of change, SI a second.
    max_rate: f64,
    /// The declared period between two readings; zero without one.
    period: Span,
}

/// The state of readings that have left the possible range.
#[derive(Clone, Copy, Debug)]
struct Away {
    /// The last reading before the jump.
    last: Sample,
    /// The sum of the jumps since then.
    offset: Interval,
    /// The first jump: at least, and about.
    least: f64,
    about: f64,
    /// Whether what counted has jumped to where it could have got from 0.
    restarts: bool,
}

impl Gate {
    pub(super) fn new(signal: &Signal) -> Gate {
        let max_hold = signal.timeout.unwrap_or(Span::MAX);
        let period = signal.period().unwrap_or(Span::ZERO);
        let pace = signal.limits.max_rate.map(|max_rate| Pace { max_rate, period });
        Gate { pace, wraps: signal.limits.turn, max_hold, ..Gate::default() }
    }

    /// Begins a later moment.
    #[inline]
    pub(super) fn turn(&mut self) {
        if self.pace.is_none() {
            return;
        }
        let rival = if self.refused.is_some() || self.rival.is_some() { self.next_rival() } else { None };
        let doubtful = self.doubtful.take();
        let Some(mut next) = self.next.take() else {
            self.doubt = doubtful.or(self.doubt);
            return;
        };
        // The most frequent case: a jump is accepted only through an open gate.
        if self.is_open || self.away.is_some() {
            self.follow(next);
        }
        self.course.get_or_insert(Course::new(next.value)).step(next.value);
        let read = next.validity.from;
        if let Some(held) = self.repeated(next) {
            let since = held.validity.from.max(next.validity.to - self.max_hold);
            next.validity.from = next.validity.from.min(since);
        }
        self.held = read - next.validity.from;
        self.before = match rival {
            Some(rival) if self.is_confirmed(rival, next) => Some(rival),
            _ => self.anchor,
        };
        self.anchor = Some(next);
        self.doubt = doubtful.or(self.doubt.filter(|doubt| doubt.validity.to >= next.validity.to));
    }

    /// The earlier reading that a reading repeats.
    #[inline]
    fn repeated(&self, next: Sample) -> Option<Sample> {
        let repeats = |held: &Sample| held.value == next.value;
        self.anchor.filter(repeats).or_else(|| self.doubt.filter(repeats))
    }

    /// Measures a reading.
    #[inline]
    pub(super) fn measure(&mut self, sample: Sample) -> Measured {
        let Some(pace) = self.pace else { return Measured::Possible };
        let measured = self.anchor.map_or(Measured::Possible, |anchor| self.compare(pace, anchor, sample));
        let side = match measured {
            Measured::TooFast(_) if !self.is_open => &mut self.refused,
            Measured::Doubtful => &mut self.doubtful,
            _ => &mut self.next,
        };
        *side = Some(side.map_or(sample, |other| newer(other, sample)));
        measured
    }

    #[inline]
    fn compare(&self, pace: Pace, anchor: Sample, sample: Sample) -> Measured {
        let anchor = self.beside(anchor, sample);
        let doubt = self.doubt.filter(|doubt| doubt.validity.to < sample.validity.to);
        let from_doubt = doubt.map(|doubt| (doubt, pace.jump(self.beside(doubt, sample), sample)));
        if let Some((doubt, None)) = from_doubt {
            return Measured::Confirming(doubt);
        }
        if let Some(jump) = pace.jump(anchor, sample) {
            return self.against_anchor(jump, sample);
        }
        if self.held > Span::ZERO && !self.is_open {
            let mut last = anchor;
            last.validity.from = last.validity.from + self.held;
            if pace.jump(last, sample).is_some() {
                return Measured::Doubtful;
            }
        }
        from_doubt.and_then(|(_, jump)| jump).map_or(Measured::Possible, Measured::Refuting)
    }

    /// Takes the rival of the moment before, and notes that of this one.
    #[cold]
    #[inline(never)]
    fn next_rival(&mut self) -> Option<Sample> {
        let refused = self.refused.take();
        let rival = refused.filter(|it| self.before.is_some_and(|before| self.is_rival(before, *it)));
        core::mem::replace(&mut self.rival, rival)
    }

    /// Whether the next reading stands by a rival, and not by the anchor.
    #[cold]
    #[inline(never)]
    fn is_confirmed(&self, rival: Sample, next: Sample) -> bool {
        self.follows(rival, next) && self.anchor.is_some_and(|anchor| !self.follows(anchor, next))
    }

    /// The outcome for a reading that cannot have followed the anchor.
    #[cold]
    #[inline(never)]
    fn against_anchor(&self, jump: Jump, sample: Sample) -> Measured {
        let rival = self.rival.filter(|rival| !self.is_open && self.follows(*rival, sample));
        rival.map_or(Measured::TooFast(jump), Measured::Confirming)
    }

    /// Whether a reading can have followed another one.
    fn follows(&self, one: Sample, next: Sample) -> bool {
        self.pace.is_none_or(|pace| pace.jump(self.beside(one, next), next).is_none())
    }

    /// Whether the anchor may be wrong in place of a reading refused after it: from the one before both, the reading asks for the slower
    /// movement.
    fn is_rival(&self, before: Sample, refused: Sample) -> bool {
        let speed = |next: Sample| {
            let away = next.value.midpoint() - self.beside(before, next).value.midpoint();
            away.abs() / (next.validity.centre() - before.validity.centre()).seconds()
        };
        self.follows(before, refused) && self.anchor.is_some_and(|anchor| speed(refused) < speed(anchor))
    }

    /// Notes whether the readings leave the possible range with this one, or return to it.
    fn follow(&mut self, next: Sample) {
        let (Some(anchor), Some(pace)) = (self.anchor, self.pace) else { return };
        let anchor = self.beside(anchor, next);
        if pace.jump(anchor, next).is_some() {
            let grown = pace.reach(anchor, next);
            let by = (next.value - anchor.value).widened(grown);
            let counted = self.course.replace(Course::new(next.value)).is_some_and(|course| course.counts());
            self.is_anew = false;
            let away = self.away.get_or_insert(Away {
                last: anchor,
                offset: Interval::point(0.0),
                least: by.mignitude(),
                about: by.midpoint().abs(),
                restarts: false,
            });
            away.restarts = counted && self.wraps.is_none() && next.value.overlaps(Interval::new(0.0, grown));
            let offset = away.offset + by;
            // Three jumps by a third of a turn end where they began.
            away.offset =
                self.wraps.map_or(offset, |turn| circle::nearest(offset, Interval::point(0.0), turn));
        }
        let beside = |away: Away| Away { last: self.beside(away.last, next), ..away };
        if self.away.is_some_and(|away| beside(away).is_over(next, pace)) {
            self.away = None;
        }
        if self.away.is_some_and(|away| away.restarts) && self.course.is_some_and(|course| course.counts()) {
            self.start_anew();
        }
    }

    /// Takes a reading back that others have proved wrong: later readings are measured by the one before it.
    pub(super) fn refute(&mut self, reading: Validity) {
        let is_it = |sample: &Sample| sample.validity.to == reading.to;
        if self.next.as_ref().is_some_and(is_it) {
            self.next = None;
        } else if self.anchor.as_ref().is_some_and(is_it) {
            (self.anchor, self.held) = (self.before, Span::ZERO);
        }
    }

    /// Whether the readings are where the last sound one could have got to.
    pub(super) fn has_returned(&self) -> bool {
        let leaves = |pace: Pace| {
            let ends = self.anchor.zip(self.next);
            ends.and_then(|(anchor, next)| pace.jump(self.beside(anchor, next), next))
        };
        let is_leaving = self.is_open && self.pace.and_then(leaves).is_some();
        self.away.is_none() && !is_leaving
    }

    /// Accepts the present level of the readings as possible.
    pub(super) fn come_home(&mut self) {
        self.away = None;
    }

    /// Accepts the present level of the readings as the beginning of others.
    pub(super) fn start_anew(&mut self) {
        self.away = None;
        self.is_anew = true;
    }

    /// Whether the readings have started anew with the last jump.
    pub(super) fn has_started_anew(&self) -> bool {
        self.is_anew
    }

    /// The reading that a reading is measured by, in the turn of the latter.
    #[inline]
    fn beside(&self, anchor: Sample, sample: Sample) -> Sample {
        match self.wraps {
            None => anchor,
            Some(turn) => Sample { value: circle::nearest(anchor.value, sample.value, turn), ..anchor },
        }
    }

    /// Opens or closes the gate after a moment; an open gate continues from the newest refused reading.
    pub(super) fn set_open(&mut self, open: bool) {
        if open && !self.is_open {
            self.next = self.refused.or(self.doubtful).or(self.next);
            (self.doubt, self.doubtful) = (None, None);
        }
        self.is_open = open;
    }

    /// Takes over the state of the same signal's gate before a change of the model.
    pub(super) fn inherit(&mut self, old: Gate) {
        let Gate { pace, wraps, max_hold, .. } = *self;
        *self = Gate { pace, wraps, max_hold, ..old };
    }
}

impl Away {
    /// Whether a reading has returned.
    fn is_over(&self, reading: Sample, pace: Pace) -> bool {
        let grown = pace.reach(self.last, reading);
        // Twice the reach, as the remaining offset may have changed as well.
        let is_conclusive = 2.0 * grown < self.least;
        let is_possible = || self.last.value.widened(grown).overlaps(reading.value);
        let is_undone = || self.offset.contains(0.0) && 0.5 * self.offset.width() < self.about;
        is_conclusive && is_possible() || is_undone()
    }
}

impl Pace {
    /// How far two readings can be apart.
    #[inline]
    fn reach(self, one: Sample, other: Sample) -> f64 {
        self.max_rate * self.between(one, other).seconds()
    }

    /// The longest time between two readings.
    #[inline]
    fn between(self, one: Sample, other: Sample) -> Span {
        let (one, other) = (one.validity, other.validity);
        (other.to - one.from).max(one.to - other.from).max(self.period)
    }

    // Called with every reading: `inline` alone would not inline it.
    #[inline(always)]
    fn jump(self, anchor: Sample, sample: Sample) -> Option<Jump> {
        // The most frequent case: overlapping values need no time in between.
        if anchor.value.overlaps(sample.value) {
            return None;
        }
        let (max_rate, within) = (self.max_rate, self.between(anchor, sample));
        let reach = anchor.value.widened((max_rate * within.seconds()).next_up());
        (!reach.overlaps(sample.value)).then_some(Jump {
            from: anchor.value,
            to: sample.value,
            within,
            max_rate,
        })
    }
}

/// Of two readings of one moment always the same one, whatever their order.
fn newer(one: Sample, other: Sample) -> Sample {
    let later = (one.validity.to, one.validity.from).cmp(&(other.validity.to, other.validity.from));
    let larger =
        one.value.lo().total_cmp(&other.value.lo()).then(one.value.hi().total_cmp(&other.value.hi()));
    if later.then(larger).is_lt() { other } else { one }
}
