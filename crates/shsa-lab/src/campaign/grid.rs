//! What is tried: every kind and amount of fault for every signal, at every onset and with every seed.

use super::smallest::Smallest;
use crate::LabError;
use shsa_core::knowledge::{Id, KnowledgeBase, Scaling, Signal, SignalId};
use shsa_core::observation::RawValue;
use shsa_core::time::{Span, Time};
use shsa_format::fault::{Fault, FaultKind};
use shsa_format::recording::Sample;
use std::collections::BTreeMap;

/// What a drift reaches at least, in smallest detectable biases, where amounts are multiples of what is seen: it is to be
/// found before.
pub const DRIFT_REACHES: f64 = 3.0;

/// A value that sticks must be so many smallest biases and drifts away from what it would be.
const STUCK_BY: f64 = 2.0;

/// A kind of fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// The value stays.
    Stuck,
    /// The amount is added.
    Bias,
    /// Nothing comes.
    Drop,
    /// Up to plus or minus the amount is added.
    Noise,
    /// More and more is added, the amount at the fault's end.
    Drift,
    /// The amount is added to one value in ten.
    Spike,
    /// Values are multiplied: the one of median size is off by the amount.
    Scale,
    /// Values come later, by the amount.
    Delay,
    /// The last value before the fault plus the amount comes instead.
    Spoof,
}

impl Kind {
    /// All of them, in the order of reports.
    pub const ALL: [Kind; 9] = [
        Kind::Stuck,
        Kind::Bias,
        Kind::Drop,
        Kind::Noise,
        Kind::Drift,
        Kind::Spike,
        Kind::Scale,
        Kind::Delay,
        Kind::Spoof,
    ];

    /// As in `--inject`.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Stuck => "stuck",
            Kind::Bias => "bias",
            Kind::Drop => "drop",
            Kind::Noise => "noise",
            Kind::Drift => "drift",
            Kind::Spike => "spike",
            Kind::Scale => "scale",
            Kind::Delay => "delay",
            Kind::Spoof => "spoof",
        }
    }

    /// Whether seeds make a difference.
    pub fn is_random(self) -> bool {
        matches!(self, Kind::Noise | Kind::Spike)
    }

    /// Whether it has an amount.
    pub fn has_amount(self) -> bool {
        !matches!(self, Kind::Stuck | Kind::Drop)
    }

    /// Whether its amount may be negative, too.
    pub fn has_sides(self) -> bool {
        matches!(self, Kind::Bias | Kind::Drift | Kind::Spike | Kind::Scale | Kind::Spoof)
    }

    /// The multiples that make sense, of those that are wanted: one without a number for a kind without an amount.
    fn multiples(self, wanted: &[f64]) -> Vec<Option<f64>> {
        match self {
            Kind::Stuck | Kind::Drop => vec![None],
            Kind::Noise | Kind::Delay => wanted.iter().filter(|by| **by > 0.0).copied().map(Some).collect(),
            _ => wanted.iter().copied().map(Some).collect(),
        }
    }
}

/// A kind of fault and its amount as a multiple of what the signal declares.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct What {
    /// The kind of fault.
    pub kind: Kind,
    /// The multiple; `None` for a kind without an amount.
    pub multiple: Option<f64>,
}

impl What {
    /// Such as `bias 2×`.
    pub fn label(self) -> String {
        self.multiple.map_or(self.kind.name().to_owned(), |by| format!("{} {by}×", self.kind.name()))
    }
}

/// One fault of one signal, tried at several onsets and with several seeds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// What is injected.
    pub what: What,
    /// The signal that is broken.
    pub signal: SignalId,
    /// The amount that is injected: in the signal's unit, a second for a drift, a factor for a scale, seconds for a
    /// delay, beyond the last value for a spoof.
    pub size: Option<f64>,
}

/// When a fault begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Onset {
    /// The number of the session, from 0.
    pub session: usize,
    /// From the first sample of its recording on.
    pub at: Span,
}

/// A session that faults are tried in; there is at least one sample.
#[derive(Clone, Copy)]
pub struct Recorded<'a> {
    /// From which times count.
    pub origin: Time,
    /// In the order of reception.
    pub samples: &'a [Sample],
}

impl<'a> Recorded<'a> {
    /// When the first and the last sample were received.
    pub fn span(&self) -> (Time, Time) {
        let received = |sample: Option<&Sample>| sample.map_or(self.origin, |sample| sample.received);
        (received(self.samples.first()), received(self.samples.last()))
    }

    /// How long it lasts.
    pub fn length(&self) -> Span {
        let (first, last) = self.span();
        last - first
    }

    /// What one signal has said.
    pub fn own(&self, signal: SignalId) -> Vec<&'a Sample> {
        self.samples.iter().filter(|sample| sample.wanted == signal.index()).collect()
    }
}

/// Faults that are not tried.
#[derive(Clone, Debug, PartialEq)]
pub struct Untried {
    /// The signal that is broken.
    pub signal: SignalId,
    /// Why.
    pub reason: Reason,
    /// How many runs these would have been.
    pub runs: usize,
}

/// Why faults are not tried.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Reason {
    /// No amount is seen at each moment of the first half.
    Unseen,
    /// The signal has nothing to break at that time: it is silent, or ends within the fault.
    Absent,
    /// Nothing says how large a fault should be: its values are all the same, and no error is declared.
    NoAmount,
}

impl Reason {
    /// All of them, in the order of reports.
    pub const ALL: [Reason; 3] = [Reason::Unseen, Reason::Absent, Reason::NoAmount];

    /// In words, after "not tried".
    pub fn words(self) -> &'static str {
        match self {
            Reason::Unseen => "of no amount that is seen at each moment of the first half",
            Reason::Absent => "when their signal is silent",
            Reason::NoAmount => "without an amount",
        }
    }
}

/// One run.
#[derive(Clone, Debug)]
pub struct Trial {
    /// The number of its cell.
    pub cell: usize,
    /// The number of the session that it runs in, from 0.
    pub session: usize,
    /// What is injected.
    pub fault: Fault,
    /// When the fault ends, and the run with it.
    pub end: Time,
    /// What chance in it begins with.
    pub seed: u64,
    /// A value that sticks while it would hardly move: less of a fault than what is seen.
    pub is_below: bool,
}

/// What is to be tried.
pub struct GridSpec<'a> {
    /// The kinds of faults.
    pub kinds: &'a [Kind],
    /// The amounts, as multiples.
    pub multiples: &'a [f64],
    /// The signals that are to be broken.
    pub signals: &'a [SignalId],
    /// How many moments each fault begins at.
    pub onsets: usize,
    /// How many seeds a fault with chance in it is run with.
    pub seeds: u64,
    /// How long a fault lasts; `None`: a quarter of the longest session.
    pub duration: Option<Span>,
    /// Multiples are of these, and not of declared errors.
    pub detectable: Option<&'a Detectable>,
    /// By signal, what takes the place of an error of value where none is declared, in the signal's unit.
    pub instead: &'a BTreeMap<SignalId, f64>,
}

/// What is seen of each signal with a calibrated model.
pub struct Detectable {
    /// Where the part of each session begins that the model was not fitted to, since its beginning; no fault begins before.
    pub from: Vec<Span>,
    /// The smallest faults that are seen in the part before.
    pub smallest: Smallest,
}

/// All that is tried.
pub struct Grid {
    /// Every kind with every multiple.
    pub whats: Vec<What>,
    /// The signals that are broken.
    pub signals: Vec<SignalId>,
    /// By signal, then by kind and multiple.
    pub cells: Vec<Cell>,
    /// By cell.
    pub trials: Vec<Trial>,
    /// When faults begin.
    pub onsets: Vec<Onset>,
    /// How long a fault lasts.
    pub duration: Span,
    /// What cannot be tried, and why.
    pub left_out: Vec<String>,
    /// The same, counted.
    pub untried: Vec<Untried>,
}

/// How large the values of a signal are, and how well they are known.
pub(super) struct Size {
    /// The declared error of a value of median size, in the signal's unit.
    pub error: f64,
    /// Median of the values' magnitudes, in the signal's unit.
    pub median: f64,
    /// Between the lowest and the highest value.
    pub range: f64,
    /// The declared error of its time stamps and the mean time from one value to the next.
    pub time: Span,
}

impl Grid {
    /// Lays out the grid over sessions, of which there is at least one.
    ///
    /// # Errors
    /// When all are too short, or nothing is left to try.
    pub fn new(
        knowledge: &KnowledgeBase,
        sessions: &[Recorded<'_>],
        spec: &GridSpec<'_>,
    ) -> Result<Grid, LabError> {
        let longest = sessions.iter().map(Recorded::length).max().unwrap_or_default();
        let duration = spec.duration.unwrap_or(Span(longest.0 / 4));
        let earliest = spec.detectable.map_or(&[][..], |it| &it.from);
        let onsets = onsets(sessions, earliest, duration, spec.onsets);
        if duration <= Span::ZERO || onsets.is_empty() {
            return Err(LabError::Unfit(format!(
                "the recording lasts {} s: faults of {} s leave no time before them",
                longest.seconds(),
                duration.seconds()
            )));
        }
        let mut whats = Vec::new();
        for &kind in spec.kinds {
            whats.extend(kind.multiples(spec.multiples).into_iter().map(|multiple| What { kind, multiple }));
        }
        let (signals, cells, trials, left_out, untried) = Default::default();
        let mut grid = Grid { whats, signals, cells, trials, onsets, duration, left_out, untried };
        for &signal in spec.signals {
            grid.add(&knowledge.signals()[signal], signal, sessions, spec);
        }
        if grid.trials.is_empty() {
            return Err(LabError::Unfit(format!("nothing to try: {}", grid.left_out.join("; "))));
        }
        Ok(grid)
    }

    fn add(&mut self, signal: &Signal, id: SignalId, sessions: &[Recorded<'_>], spec: &GridSpec<'_>) {
        let own: Vec<Vec<&Sample>> = sessions.iter().map(|session| session.own(id)).collect();
        let Some(mut size) = Size::of(signal, &own) else {
            self.left_out.push(format!("{}: not in the recording", signal.name));
            return;
        };
        if size.error <= 0.0 {
            size.error = spec.instead.get(&id).copied().unwrap_or(0.0);
        }
        if size.error <= 0.0 && spec.detectable.is_none() {
            let reason = "faults with an amount, as no value error is declared that it could be a multiple of, \
                          and its values are all the same";
            self.left_out.push(format!("{}: {reason}", signal.name));
        }
        self.signals.push(id);
        for what in self.whats.clone() {
            let runs = self.onsets.len() * if what.kind.is_random() { spec.seeds as usize } else { 1 };
            let (amount, reason) = match spec.detectable {
                Some(detectable) => (detectable.amount(what, id, self.duration), Reason::Unseen),
                None => (size.amount(what, self.duration), Reason::NoAmount),
            };
            let Some(size) = amount else {
                self.untried.push(Untried { signal: id, reason, runs });
                continue;
            };
            let before = self.trials.len();
            self.cells.push(Cell { what, signal: id, size });
            self.add_runs(signal, sessions, &own, spec);
            let runs = runs - (self.trials.len() - before);
            if runs > 0 {
                self.untried.push(Untried { signal: id, reason: Reason::Absent, runs });
            }
        }
    }

    /// The runs of the last cell.
    fn add_runs(
        &mut self,
        signal: &Signal,
        sessions: &[Recorded<'_>],
        own: &[Vec<&Sample>],
        spec: &GridSpec<'_>,
    ) {
        let Some(&Cell { what, signal: id, size }) = self.cells.last() else { return };
        for &Onset { session, at: from } in &self.onsets {
            let (Some(recorded), Some(own)) = (sessions.get(session), own.get(session)) else { continue };
            let onset = recorded.origin + from;
            let Some(kind) = fault_kind(what.kind, size.unwrap_or(0.0), (own, signal.scaling), onset) else {
                continue;
            };
            let to = from + self.duration;
            let fault = Fault { kind, signal: signal.name.clone(), from, to: Some(to) };
            let end = recorded.origin + to;
            // A signal that ends within the time of a fault has a shorter one.
            let is_cut = own.last().is_none_or(|last| last.received < end - Span(self.duration.0 / 10));
            if spec.detectable.is_some() && is_cut {
                continue;
            }
            let is_below =
                spec.detectable.is_some_and(|it| it.is_below(&fault, id, (own, signal.scaling), end));
            let seeds = 1..=if what.kind.is_random() { spec.seeds } else { 1 };
            let cell = self.cells.len() - 1;
            let trial = |seed| Trial { cell, session, fault: fault.clone(), end, seed, is_below };
            self.trials.extend(seeds.map(trial));
        }
    }
}

/// So many moments evenly over the time in which a fault can begin and end within one session: from `earliest` on of each, where
/// that is given.
pub(super) fn onsets(
    sessions: &[Recorded<'_>],
    earliest: &[Span],
    duration: Span,
    count: usize,
) -> Vec<Onset> {
    let mut rooms: Vec<(Onset, Span)> = Vec::new();
    for (session, recorded) in sessions.iter().enumerate() {
        let length = recorded.length();
        let early = earliest.get(session).copied().unwrap_or(Span::ZERO).min(length);
        let room = length - early - duration;
        if room > Span::ZERO {
            let at = recorded.span().0 - recorded.origin + early;
            rooms.push((Onset { session, at }, room));
        }
    }
    let all = Span(rooms.iter().map(|(_, room)| room.0).sum());
    let place = |mut onset: Span| {
        rooms.iter().find_map(|&(Onset { session, at }, room)| {
            if onset <= room {
                return Some(Onset { session, at: at + onset });
            }
            onset = onset - room;
            None
        })
    };
    if all <= Span::ZERO {
        Vec::new()
    } else {
        evenly(all, count).filter_map(|onset| place(onset.min(all))).collect()
    }
}

/// Evenly over the room, the last one at its end.
pub(super) fn evenly(room: Span, count: usize) -> impl Iterator<Item = Span> {
    let share = move |number: usize| Span::from_seconds(room.seconds() * number as f64 / count as f64);
    (1..=count).map(share)
}

impl Size {
    /// By its samples in each session; `None` without a finite value.
    pub(super) fn of(signal: &Signal, own: &[Vec<&Sample>]) -> Option<Size> {
        let values = own.iter().flatten().flat_map(|sample| numbers(&sample.value, signal.scaling));
        let values = values.filter(|value| value.is_finite());
        let (lowest, highest) = values
            .clone()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), value| (lo.min(value), hi.max(value)));
        let mut magnitudes: Vec<f64> = values.map(f64::abs).collect();
        let middle = magnitudes.len() / 2;
        let median =
            (!magnitudes.is_empty()).then(|| *magnitudes.select_nth_unstable_by(middle, f64::total_cmp).1)?;
        let scale = signal.unit.as_ref().map_or(1.0, |unit| unit.scale);
        let declared = signal.value_error;
        let error = declared.lo.abs().max(declared.hi.abs()) / scale + declared.relative * median;
        let lasts = |own: &Vec<&Sample>| Some((own.last()?.received - own.first()?.received).0);
        let steps: usize = own.iter().map(|own| own.len().saturating_sub(1)).sum();
        let period = Span(own.iter().filter_map(lasts).sum::<i64>() / (steps as i64).max(1));
        let (early, late) = signal.time_error;
        Some(Size { error, median, range: highest - lowest, time: early.abs().max(late.abs()) + period })
    }

    /// What is injected, `None` where that is impossible.
    fn amount(&self, what: What, duration: Span) -> Option<Option<f64>> {
        let Some(by) = what.multiple else { return Some(None) };
        let amount = match what.kind {
            Kind::Delay => by * self.time.seconds(),
            _ if self.error <= 0.0 => return None,
            Kind::Drift => by * self.error / duration.seconds(),
            Kind::Scale => 1.0 + by * self.error / self.median,
            _ => by * self.error,
        };
        amount.is_finite().then_some(Some(amount))
    }
}

impl Detectable {
    /// So many times what is seen; `None` where nothing is.
    fn amount(&self, what: What, signal: SignalId, duration: Span) -> Option<Option<f64>> {
        let Some(by) = what.multiple else { return Some(None) };
        let (seen, _) = self.smallest.seen(signal, what.kind)?;
        Some(Some(match what.kind {
            Kind::Drift => by * seen.abs().max(self.reaching(signal, duration).unwrap_or(0.0) / by.abs()),
            Kind::Scale => 1.0 + by * seen,
            _ => by * seen,
        }))
    }

    /// The drift that reaches three smallest biases within the time.
    fn reaching(&self, signal: SignalId, duration: Span) -> Option<f64> {
        let (bias, _) = self.smallest.seen(signal, Kind::Bias)?;
        Some(DRIFT_REACHES * bias / duration.seconds())
    }

    /// Whether a value that sticks would move too little in that time to be seen: it never leaves where it stuck by twice
    /// the smallest bias, and by twice the smallest drift since then, for as long as that bias takes to be seen.
    fn is_below(
        &self,
        fault: &Fault,
        signal: SignalId,
        (own, scaling): (&[&Sample], Option<Scaling>),
        end: Time,
    ) -> bool {
        if fault.kind != FaultKind::Stuck(None) {
            return false;
        }
        let seen = |kind| self.smallest.seen(signal, kind);
        // What is never seen hides nothing: such a run counts.
        let Some(((bias, within), (drift, _))) = seen(Kind::Bias).zip(seen(Kind::Drift)) else {
            return false;
        };
        let number = |sample: &Sample| numbers(&sample.value, scaling).first().copied();
        let onset = end - fault.to.map_or(Span::ZERO, |to| to - fault.from);
        let begin = own.partition_point(|sample| sample.received < onset);
        let Some(held) = begin.checked_sub(1).and_then(|at| number(own.get(at)?)) else { return true };
        let mut away: Option<(Time, bool)> = None;
        for sample in own.iter().skip(begin).take_while(|sample| sample.received < end) {
            let Some(value) = number(sample) else { continue };
            let (left, needed) = (value - held, bias.max(drift * (sample.received - onset).seconds()));
            away = match away.filter(|(_, above)| *above == (left > 0.0)) {
                _ if left.abs() < STUCK_BY * needed => None,
                Some((since, _)) if sample.received - since >= within => return false,
                same => same.or(Some((sample.received, left > 0.0))),
            };
        }
        true
    }
}

/// What a reading says, in the signal's unit.
fn numbers(reading: &RawValue, scaling: Option<Scaling>) -> Vec<f64> {
    let mut values = match reading {
        RawValue::Number(value) => vec![*value],
        RawValue::Interval { lo, hi } => vec![lo.midpoint(*hi)],
        RawValue::Vector(values) => values.clone(),
    };
    if let Some(scaling) = scaling {
        values.iter_mut().for_each(|value| *value = scaling.value(*value));
    }
    values
}

/// The fault of a size; `None` for a spoof before which no value has come.
pub(super) fn fault_kind(
    kind: Kind,
    size: f64,
    (own, scaling): (&[&Sample], Option<Scaling>),
    onset: Time,
) -> Option<FaultKind> {
    Some(match kind {
        Kind::Stuck => FaultKind::Stuck(None),
        Kind::Bias => FaultKind::Bias(size),
        Kind::Drop => FaultKind::Drop,
        Kind::Noise => FaultKind::Noise(size),
        Kind::Drift => FaultKind::Drift(size),
        Kind::Spike => FaultKind::Spike(size),
        Kind::Scale => FaultKind::Scale(size),
        Kind::Delay => FaultKind::Delay(Span::from_seconds(size)),
        Kind::Spoof => {
            let before = own.partition_point(|sample| sample.received < onset).checked_sub(1)?;
            FaultKind::Spoof(numbers(&own.get(before)?.value, scaling).first()? + size)
        }
    })
}
