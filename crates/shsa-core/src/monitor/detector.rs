//! Detectors that look at one signal alone: invalid, out of range, too fast, frozen, stamped by a wrong clock, out of order,
//! late. All work alike: a signal is faulty when enough of its recent moments of reception show the symptom.
//!
//! A single bad reading is no fault, but single jumps that come again and again are. For as long as a signal may be silent, it
//! may also give nothing but impossible values. A moment of reception counts once, and is bad when any of its readings is
//! bad, so the order within a moment does not matter. A fault ends when a whole window shows no symptom.

mod moment;

use super::symptom::Symptom;
use super::window::Debounce;
use crate::alignment::{Defect, Jump, Misdated, Port, Reception};
use crate::interval::Interval;
use crate::knowledge::{IdVec, KnowledgeBase, Lineage, Signal, SignalId};
use crate::time::{Span, Time};
use alloc::vec::Vec;
use moment::Moment;

/// What is detected; of several at once, the first explains the others best.
const DETECTED: [Symptom; 7] = [
    Symptom::Invalid,
    Symptom::OutOfRange,
    Symptom::TooFast,
    Symptom::Frozen,
    Symptom::WrongClock,
    Symptom::OutOfOrder,
    Symptom::Late,
];

/// The place of [`Symptom::TooFast`] in [`DETECTED`].
const TOO_FAST: usize = 2;

/// What was seen is stale after this many periods without a reading.
const STALE_PERIODS: i64 = 6;

/// Single outliers that come again and again are a fault, too, although most readings are sound: each of them alone is kept
/// out and forgotten. They are when they are this share of the readings of late,
const RECURRING: f64 = 0.04;
/// and so many of them,
const FEWEST_RECURRING: f64 = 4.5;
/// over at least so long, as what shakes a vehicle is over then, and
const RECURS_OVER: Span = Span::from_millis(5_000);
/// so many readings.
const RECURS_AMONG: f64 = 64.0;
/// A smaller share of single outliers is none.
const NONE_RECURRING: f64 = 1e-3;

/// What a reading shows, in numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Evidence {
    /// It was no value.
    Invalid(Defect),
    /// The value, SI.
    OutOfRange(Interval),
    /// The two values and the time between them.
    TooFast(Jump),
    /// By how much its time stamp went back.
    OutOfOrder(Span),
    /// Time from its stamp to its reception.
    Late(Span),
    /// For how long the readings have been exactly the same.
    Frozen(Span),
    /// What its stamps are off by.
    WrongClock(Misdated),
}

/// How many moments of reception are looked at, and how many bad ones make a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Rule {
    n: u32,
    k: u32,
}

/// A fault that a signal's own readings show.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fault {
    /// What kind it is.
    pub symptom: Symptom,
    /// What the reading that decided it shows; of several at one moment, the worst.
    pub evidence: Evidence,
    /// In how many of how many recent moments of reception.
    pub count: (u32, u32),
}

/// A change of what a signal's own readings show.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Finding {
    /// The signal.
    pub signal: SignalId,
    /// The fault that has begun; `None` when it is over.
    pub fault: Option<Fault>,
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
    /// The share of single outliers among the readings of late, and among how many that is; whether the fault is that they
    /// come again and again.
    outliers: f64,
    memory: f64,
    recurs: bool,
    /// Where the readings of this moment are gathered.
    moment: Option<u32>,
}

/// The detectors of all signals. O(1) an observation; nothing is allocated.
#[derive(Clone, Debug)]
pub struct Detectors {
    list: IdVec<SignalId, Detector>,
    /// What is gathered of this moment; only of signals that show, or have shown, a symptom.
    moments: Vec<(SignalId, Moment)>,
    findings: Vec<Finding>,
}

impl Detectors {
    /// For the signals of a knowledge base.
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

    /// Goes on from the detectors before a change, for the signals whose readings mean the same.
    pub fn inherit(&mut self, old: &Detectors, lineage: &Lineage) {
        for (id, before) in old.list.enumerate() {
            let Some(detector) = lineage.signal(id).map(|signal| &mut self.list[signal]) else { continue };
            (detector.bits, detector.outliers, detector.recurs) =
                (before.bits, before.outliers, before.recurs);
            detector.keep_window();
            (detector.seen, detector.last, detector.fault) = (before.seen, before.last, before.fault);
        }
    }

    /// Forgets what the readings of a signal have shown; between two moments.
    pub(super) fn forget(&mut self, signal: SignalId) {
        let detector = &mut self.list[signal];
        (detector.bits, detector.shows, detector.seen, detector.fault) =
            ([0; DETECTED.len()], false, 0, None);
    }

    /// Notes what a port says about a reading.
    // Once for every observation or comparison, from two places: by a hint alone it would be called.
    #[inline(always)]
    pub fn observe(&mut self, signal: SignalId, reception: &Reception, now: Time) {
        let detector = &mut self.list[signal];
        if reception.is_sound() && detector.is_quiet() {
            detector.count(now);
        } else {
            // A copy, so that what is sound need not be in memory.
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

    /// Whether something has been noted that is not settled.
    #[must_use]
    pub fn is_pending(&self) -> bool {
        !self.moments.is_empty()
    }

    /// Takes together what has been noted of this moment, and opens and closes the gates of the ports.
    pub fn settle(&mut self, ports: &mut IdVec<SignalId, Port>, now: Time) {
        self.findings.clear();
        if self.moments.is_empty() {
            return;
        }
        self.moments.sort_unstable_by_key(|(signal, _)| *signal);
        for (signal, moment) in self.moments.drain(..) {
            let detector = &mut self.list[signal];
            if let Some(finding) = detector.take(&moment, now) {
                self.findings.push(Finding { signal, fault: finding });
            }
            ports[signal].set_gate(detector.is_open());
        }
    }

    /// What the last settled moment has changed, by signal.
    #[must_use]
    pub fn findings(&self) -> &[Finding] {
        &self.findings
    }

    /// What a signal's own readings show now.
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
        let in_span = period.map_or(0.0, |period| RECURS_OVER.seconds() / period.seconds());
        Detector {
            bits,
            rules,
            shows: false,
            seen: 0,
            last: None,
            lifetime,
            fault: None,
            outliers: 0.0,
            memory: in_span.max(RECURS_AMONG),
            recurs: false,
            moment: None,
        }
    }

    /// Forgets what is before the windows.
    fn keep_window(&mut self) {
        for (bits, rule) in self.bits.iter_mut().zip(&self.rules) {
            *bits &= u64::MAX >> (64 - rule.n.clamp(1, 64));
        }
        self.shows = self.bits != [0; DETECTED.len()];
    }

    /// The jumps in the window.
    fn jumps(&self) -> u64 {
        self.bits.get(TOO_FAST).copied().unwrap_or(0)
    }

    /// What share of single outliers is a fault.
    fn most_outliers(&self) -> f64 {
        RECURRING.max(FEWEST_RECURRING / self.memory)
    }

    /// Whether a sound reading changes nothing.
    fn is_quiet(&self) -> bool {
        self.moment.is_none() && self.fault.is_none() && !self.shows
    }

    /// Counts a moment once, and forgets what is stale.
    fn count(&mut self, now: Time) {
        let Some(last) = self.last.replace(now) else {
            self.seen = 1;
            return;
        };
        if self.lifetime.is_some_and(|lifetime| now - last > lifetime) {
            (self.bits, self.shows, self.seen) = ([0; DETECTED.len()], false, 0);
        }
        if last != now {
            self.seen = (self.seen + 1).min(64);
            if self.outliers > 0.0 {
                let left = self.outliers * (1.0 - 1.0 / self.memory);
                self.outliers = if left < NONE_RECURRING { 0.0 } else { left };
            }
        }
    }

    /// Takes a moment in: the fault that begins (`Some(Some)`) or is over (`Some(None)`).
    fn take(&mut self, moment: &Moment, now: Time) -> Option<Option<Fault>> {
        self.moment = None;
        self.count(now);
        let shown = moment.shown();
        for (bits, evidence) in self.bits.iter_mut().zip(&shown) {
            *bits = *bits << 1 | u64::from(evidence.is_some());
        }
        self.keep_window();
        // A jump after a sound reading may be an outlier; when it is not over with the next reading, it was none.
        match self.jumps() & 7 {
            0b001 | 0b101 => self.outliers += 1.0 / self.memory,
            0b011 => self.outliers = (self.outliers - 1.0 / self.memory).max(0.0),
            _ => {}
        }
        if self.fault.is_none() {
            let fault =
                (0..DETECTED.len()).zip(shown).find_map(|(at, evidence)| self.decided(at, evidence?))?;
            self.fault = Some(fault.symptom);
            let k = self.rules.get(TOO_FAST).map_or(0, |rule| rule.k);
            self.recurs = fault.symptom == Symptom::TooFast && self.jumps().count_ones() < k;
            return Some(Some(fault));
        }
        let recurs = self.recurs && self.outliers > 0.5 * self.most_outliers();
        if recurs || self.shows {
            return None;
        }
        (self.fault, self.recurs) = (None, false);
        Some(None)
    }

    /// The fault that a bad moment decides.
    fn decided(&self, at: usize, evidence: Evidence) -> Option<Fault> {
        let (count, rule) = (self.bits.get(at)?.count_ones(), self.rules.get(at)?);
        let symptom = *DETECTED.get(at)?;
        let fault = |count, n| Fault { symptom, evidence, count: (count, n) };
        if count >= rule.k {
            return Some(fault(count, self.seen.min(rule.n).max(count)));
        }
        let among = libm::round(self.memory);
        let recurring = || fault(libm::round(self.outliers * among) as u32, among as u32);
        (at == TOO_FAST && self.outliers >= self.most_outliers()).then(recurring)
    }

    /// Whether the gate of the port must be open: jumps are the rule, or have been in this window.
    fn is_open(&self) -> bool {
        let jumps = self.jumps().count_ones();
        let is_rule = self.rules.get(TOO_FAST).is_some_and(|rule| jumps >= rule.k);
        is_rule || (self.fault == Some(Symptom::TooFast) && !self.recurs && jumps > 0)
    }
}

/// By symptom, in the order of [`DETECTED`].
fn rules(signal: &Signal, period: Option<Span>, debounce: Debounce) -> [Rule; DETECTED.len()] {
    let (n, k) = debounce.window(period.unwrap_or(debounce.span));
    // As many as may be absent altogether; where more of them follow each other, the timeout tells.
    let absent = signal.timeout.zip(period).map_or(0, |(timeout, period)| timeout.0 / period.0.max(1));
    let silent = u32::try_from(absent).unwrap_or(u32::MAX);
    let impossible = match silent {
        0 => Rule { n, k },
        silent => Rule {
            n: n.max(silent.saturating_add(1).saturating_mul(2)).min(64),
            k: k.max(silent.saturating_add(1)),
        },
    };
    // Of two readings that have changed places, only one goes back.
    let swapped = Rule { n, k: (k / 2).max(2).min(k) };
    // After a stall, what has been waiting comes late once.
    let late = Rule { n, k: (n * 3).div_ceil(4).max(k) };
    // What has been the same for so long is frozen now, and is not with the first reading that moves.
    let still = Rule { n: 1, k: 1 };
    // What has been held up may come at once; a clock is wrong for longer.
    let in_second = period.map_or(0, |period| Span::from_millis(1_000).0 / period.0.max(1));
    let second = u32::try_from(in_second).unwrap_or(u32::MAX).clamp(4, 64);
    let misdated = Rule { n: second, k: (second * 3).div_ceil(4) };
    [impossible, impossible, Rule { n, k }, still, misdated, swapped, late]
}
