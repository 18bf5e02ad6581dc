//! Detectors that test one signal alone: invalid, out of range, too fast, frozen, stamped by a wrong clock, out of order, late.
//! All work alike: a signal is faulty when enough of its recent moments of reception show the symptom.
//!
//! A single bad reading is no fault, but recurring single jumps are. For as long as a signal may be silent, all its readings may
//! also be impossible. A moment of reception counts once, and is bad when any of its readings is bad, so the order within a
//! moment does not matter. A fault ends when a whole window shows no symptom.

mod moment;

use super::symptom::Symptom;
use super::window::{Debounce, Recurring};
use crate::alignment::{Defect, Jump, Misdated, Port, Reception, Still};
use crate::interval::Interval;
use crate::knowledge::{IdVec, KnowledgeBase, Lineage, Signal, SignalId};
use crate::numbers::STALE_PERIODS;
use crate::time::{Span, Time};
use alloc::vec::Vec;
use moment::Moment;

/// The detected symptoms; of several at once, the first explains the others best.
const DETECTED: [Symptom; 7] = [
    Symptom::Invalid,
    Symptom::OutOfRange,
    Symptom::TooFast,
    Symptom::Frozen,
    Symptom::WrongClock,
    Symptom::OutOfOrder,
    Symptom::Late,
];

/// The places in [`DETECTED`] of the symptoms that one refused reading shows.
const OUT_OF_RANGE: usize = 1;
const TOO_FAST: usize = 2;

/// The evidence of a reading, in numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Evidence {
    /// The reading was no value.
    Invalid(Defect),
    /// The value, SI.
    OutOfRange(Interval),
    /// The two values and the time between them.
    TooFast(Jump),
    /// By how much the time stamp went back.
    OutOfOrder(Span),
    /// The time from the time stamp to the reception.
    Late(Span),
    /// For how long the readings have been exactly the same.
    Frozen(Still),
    /// The error of the time stamps.
    WrongClock(Misdated),
}

/// A fault is at least `k` bad ones among the last `n` moments of reception.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Rule {
    n: u32,
    k: u32,
}

/// A fault that a signal's own readings show.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fault {
    /// The kind of the fault.
    pub symptom: Symptom,
    /// The evidence of the reading that completed the fault; of several at one moment, the worst.
    pub evidence: Evidence,
    /// The number of bad moments of reception, and among how many recent ones.
    pub count: (u32, u32),
    /// Where it may be that the sensor only has nothing to show, for how long that may have lasted.
    pub absent_for: Option<Span>,
}

/// What a signal's own readings show anew.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Finding {
    /// The signal.
    pub signal: SignalId,
    /// What they show.
    pub shown: Shown,
}

/// What readings show anew.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shown {
    /// A fault.
    Fault(Fault),
    /// That the fault is over.
    Over,
    /// A reading that was refused, and no other in the window: no fault.
    Single(Symptom, Evidence),
}

/// The recent moments of reception of a signal: a row of bits for each symptom, the newest lowest.
#[derive(Clone, Copy, Debug)]
struct Detector {
    bits: [u64; DETECTED.len()],
    rules: [Rule; DETECTED.len()],
    /// Whether any of the bits is set.
    shows: bool,
    /// How many moments have been seen, up to 64.
    seen: u32,
    last: Option<Time>,
    lifetime: Option<Span>,
    fault: Option<Symptom>,
    /// Whether the present fault is a jump from readings that were fewer than those after it: then those were wrong.
    is_early: bool,
    /// The single outliers, and whether the present fault is recurring outliers.
    singles: Recurring,
    recurs: bool,
    /// The place of this moment's readings in [`Detectors::moments`].
    moment: Option<u32>,
}

/// The detectors of all signals. O(1) an observation; nothing is allocated.
#[derive(Clone, Debug)]
pub struct Detectors {
    list: IdVec<SignalId, Detector>,
    /// The readings of this moment; only of signals that show, or have shown, a symptom.
    moments: Vec<(SignalId, Moment)>,
    findings: Vec<Finding>,
}

impl Detectors {
    /// The detectors of the signals of a knowledge base.
    #[must_use]
    pub fn new(knowledge: &KnowledgeBase, debounce: Debounce) -> Detectors {
        let count = knowledge.signals().len();
        let detector = |signal| Detector::new(&knowledge.signals()[signal], debounce);
        Detectors {
            list: IdVec::filled(count, detector),
            moments: Vec::with_capacity(count),
            findings: Vec::with_capacity(count),
        }
    }

    /// Takes over the state before a change of the model, for the signals whose readings mean the same.
    pub fn inherit(&mut self, old: &Detectors, lineage: &Lineage) {
        for (id, before) in old.list.enumerate() {
            let Some(detector) = lineage.signal(id).map(|signal| &mut self.list[signal]) else { continue };
            (detector.bits, detector.recurs) = (before.bits, before.recurs);
            detector.singles.inherit(&before.singles);
            detector.keep_window();
            (detector.seen, detector.last, detector.fault) = (before.seen, before.last, before.fault);
            detector.is_early = before.is_early;
        }
    }

    /// Forgets the readings of a signal; to be called between two moments.
    pub(super) fn forget(&mut self, signal: SignalId) {
        let detector = &mut self.list[signal];
        (detector.bits, detector.shows, detector.seen, detector.fault) =
            ([0; DETECTED.len()], false, 0, None);
        detector.is_early = false;
    }

    /// Notes how a port has received a reading.
    // Called with every observation from two places: `inline` alone would not inline it.
    #[inline(always)]
    pub fn observe(&mut self, signal: SignalId, reception: &Reception, now: Time) {
        let detector = &mut self.list[signal];
        if reception.is_sound() && detector.is_quiet() {
            detector.count(now);
        } else {
            // A copy, so that a sound reception need not be in memory.
            self.gather(signal, *reception);
        }
    }

    #[inline(never)]
    fn gather(&mut self, signal: SignalId, reception: Reception) {
        let detector = &mut self.list[signal];
        let place = *detector.moment.get_or_insert_with(|| {
            self.moments.push((signal, Moment::default()));
            u32::try_from(self.moments.len() - 1).unwrap_or(u32::MAX)
        });
        if let Some((_, moment)) = self.moments.get_mut(place as usize) {
            moment.add(&reception);
        }
    }

    /// Whether noted readings are not settled yet.
    #[must_use]
    pub fn is_pending(&self) -> bool {
        !self.moments.is_empty()
    }

    /// Evaluates the readings of this moment, and opens and closes the gates of the ports.
    pub fn settle(&mut self, ports: &mut IdVec<SignalId, Port>, now: Time) {
        self.findings.clear();
        if self.moments.is_empty() {
            return;
        }
        self.moments.sort_unstable_by_key(|(signal, _)| *signal);
        for (signal, moment) in self.moments.drain(..) {
            let detector = &mut self.list[signal];
            if let Some(shown) = detector.take(&moment, now) {
                self.findings.push(Finding { signal, shown });
            }
            let port = &mut ports[signal];
            port.set_gate(detector.is_open());
            if detector.fault.is_none() && core::mem::take(&mut detector.is_early) {
                port.start_anew();
            }
        }
    }

    /// The findings of the last settled moment, by signal.
    #[must_use]
    pub fn findings(&self) -> &[Finding] {
        &self.findings
    }

    /// The present fault of a signal's own readings.
    #[must_use]
    pub fn fault(&self, signal: SignalId) -> Option<Symptom> {
        self.list[signal].fault
    }
}

impl Detector {
    fn new(signal: &Signal, debounce: Debounce) -> Detector {
        let period = signal.period();
        let rules = rules(signal, period, debounce);
        let longest = rules.iter().map(|rule| i64::from(rule.n)).max().unwrap_or(0).max(STALE_PERIODS);
        let lifetime = period.map(|period| period.times(longest).max(debounce.span));
        let bits = [0; DETECTED.len()];
        Detector {
            bits,
            rules,
            shows: false,
            seen: 0,
            last: None,
            lifetime,
            fault: None,
            is_early: false,
            singles: Recurring::new(period),
            recurs: false,
            moment: None,
        }
    }

    /// Forgets moments before the windows.
    fn keep_window(&mut self) {
        for (bits, rule) in self.bits.iter_mut().zip(&self.rules) {
            *bits &= u64::MAX >> (64 - rule.n.clamp(1, 64));
        }
        self.shows = self.bits != [0; DETECTED.len()];
    }

    /// The jumps in the window, as bits.
    fn jumps(&self) -> u64 {
        self.bits.get(TOO_FAST).copied().unwrap_or(0)
    }

    /// Whether a sound reading changes nothing.
    fn is_quiet(&self) -> bool {
        self.moment.is_none() && self.fault.is_none() && !self.shows
    }

    /// Counts a moment once, and forgets outdated moments.
    fn count(&mut self, now: Time) {
        let Some(last) = self.last.replace(now) else {
            self.seen = 1;
            return;
        };
        if self.lifetime.is_some_and(|lifetime| now - last > lifetime) {
            (self.bits, self.shows) = ([0; DETECTED.len()], false);
        }
        if last != now {
            self.seen = (self.seen + 1).min(64);
            if self.singles.is_any() {
                self.singles.fade();
            }
        }
    }

    /// Evaluates a moment: returns what it shows anew.
    fn take(&mut self, moment: &Moment, now: Time) -> Option<Shown> {
        self.moment = None;
        self.count(now);
        let mut shown = moment.shown();
        for (bits, evidence) in self.bits.iter_mut().zip(&shown) {
            *bits = *bits << 1 | u64::from(evidence.is_some());
        }
        if let Some(jump) = moment.refuted() {
            self.note_refuted();
            shown[TOO_FAST].get_or_insert(Evidence::TooFast(jump));
        }
        self.keep_window();
        // A jump after a sound reading counts as an outlier; if the next reading jumps, too, it was none.
        match self.jumps() & 7 {
            0b001 | 0b101 => self.singles.add(),
            0b011 => self.singles.take_back(),
            _ => {}
        }
        if self.fault.is_none() {
            let Some(fault) =
                (0..DETECTED.len()).zip(shown).find_map(|(at, evidence)| self.decided(at, evidence?))
            else {
                return self.single(&shown);
            };
            self.fault = Some(fault.symptom);
            let k = self.rules.get(TOO_FAST).map_or(0, |rule| rule.k);
            let jumps = self.jumps().count_ones();
            self.recurs = fault.symptom == Symptom::TooFast && jumps < k;
            self.is_early =
                fault.symptom == Symptom::TooFast && !self.recurs && self.seen.saturating_sub(jumps) < jumps;
            return Some(Shown::Fault(fault));
        }
        if (self.recurs && self.singles.are_too_many(true)) || self.shows {
            return None;
        }
        (self.fault, self.recurs) = (None, false);
        Some(Shown::Over)
    }

    /// The only refused reading in the window, where this moment shows it.
    fn single(&self, shown: &[Option<Evidence>; DETECTED.len()]) -> Option<Shown> {
        [OUT_OF_RANGE, TOO_FAST].into_iter().find_map(|at| {
            let is_single = self.bits.get(at)?.count_ones() == 1;
            is_single.then_some(Shown::Single(*DETECTED.get(at)?, (*shown.get(at)?)?))
        })
    }

    /// Notes that the reading of the moment before was an outlier.
    fn note_refuted(&mut self) {
        if let Some(bits) = self.bits.get_mut(TOO_FAST) {
            *bits |= 0b10;
            self.singles.add();
        }
    }

    /// The fault that a bad moment completes.
    fn decided(&self, at: usize, evidence: Evidence) -> Option<Fault> {
        let (count, rule) = (self.bits.get(at)?.count_ones(), self.rules.get(at)?);
        let symptom = *DETECTED.get(at)?;
        let shows_nothing = matches!(evidence, Evidence::Invalid(_) | Evidence::OutOfRange(_));
        let absent_for = shows_nothing.then(|| self.lifetime.unwrap_or(Span::ZERO));
        let fault = |count, n| Fault { symptom, evidence, count: (count, n), absent_for };
        if count >= rule.k {
            return Some(fault(count, self.seen.min(rule.n).max(count)));
        }
        let (count, among) = self.singles.counted();
        (at == TOO_FAST && self.singles.are_too_many(false)).then(|| fault(count, among))
    }

    /// Whether the port's gate must be open: jumps are frequent, or the fault is jumps and the window still has one.
    fn is_open(&self) -> bool {
        let jumps = self.jumps().count_ones();
        let is_rule = self.rules.get(TOO_FAST).is_some_and(|rule| jumps >= rule.k);
        is_rule || (self.fault == Some(Symptom::TooFast) && !self.recurs && jumps > 0)
    }
}

/// The rules by symptom, in the order of [`DETECTED`].
fn rules(signal: &Signal, period: Option<Span>, debounce: Debounce) -> [Rule; DETECTED.len()] {
    let (n, k) = debounce.window(period.unwrap_or(debounce.span));
    // As many impossible readings as may be missing altogether are no fault; the timeout detects longer runs.
    let absent = signal.timeout.zip(period).map_or(0, |(timeout, period)| timeout.0 / period.0.max(1));
    let silent = u32::try_from(absent).unwrap_or(u32::MAX);
    let impossible = match silent {
        0 => Rule { n, k },
        silent => Rule {
            n: n.max(silent.saturating_add(1).saturating_mul(2)).min(64),
            k: k.max(silent.saturating_add(1)),
        },
    };
    // Of two swapped readings only one goes back.
    let swapped = Rule { n, k: (k / 2).max(2).min(k) };
    // After a stall, the held-up readings are late once.
    let late = Rule { n, k: (n * 3).div_ceil(4).max(k) };
    // A frozen reading has been the same for long already: one shows the fault, and the first that differs ends it.
    let still = Rule { n: 1, k: 1 };
    // Held-up readings may come at once; a wrong clock shows in most readings of a second.
    let in_second = period.map_or(0, |period| Span::from_millis(1_000).0 / period.0.max(1));
    let second = u32::try_from(in_second).unwrap_or(u32::MAX).clamp(4, 64);
    let misdated = Rule { n: second, k: (second * 3).div_ceil(4) };
    [impossible, impossible, Rule { n, k }, still, misdated, swapped, late]
}
