//! What is tried: every kind and amount of fault for every signal, at every onset and with every seed.

use anyhow::bail;
use shsa_core::knowledge::{Id, KnowledgeBase, Signal, SignalId};
use shsa_core::observation::RawValue;
use shsa_core::time::{Span, Time};
use shsa_format::fault::{Fault, FaultKind};
use shsa_format::recording::Sample;

/// What a drift reaches at its end where amounts are multiples of the smallest detectable bias: it is to be found before.
pub(super) const DRIFT_REACHES: f64 = 3.0;

/// A kind of fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, clap::ValueEnum)]
pub(super) enum Kind {
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
    pub(super) const ALL: [Kind; 9] = [
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
    pub(super) fn name(self) -> &'static str {
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
    fn is_random(self) -> bool {
        matches!(self, Kind::Noise | Kind::Spike)
    }

    /// The multiples that make sense, of those that are wanted: one without a number for a kind without an amount.
    fn multiples(self, wanted: &[f64], is_detectable: bool) -> Vec<Option<f64>> {
        match self {
            Kind::Stuck | Kind::Drop => vec![None],
            Kind::Drift if is_detectable => vec![Some(DRIFT_REACHES)],
            Kind::Noise | Kind::Delay => wanted.iter().filter(|by| **by > 0.0).copied().map(Some).collect(),
            _ => wanted.iter().copied().map(Some).collect(),
        }
    }
}

/// A kind of fault and its amount as a multiple of what the signal declares.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct What {
    pub(super) kind: Kind,
    pub(super) multiple: Option<f64>,
}

impl What {
    /// Such as `bias 2×`.
    pub(super) fn label(self) -> String {
        self.multiple.map_or(self.kind.name().to_owned(), |by| format!("{} {by}×", self.kind.name()))
    }
}

/// One fault of one signal, tried at several onsets and with several seeds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cell {
    pub(super) what: What,
    pub(super) signal: SignalId,
    /// The amount that is injected: in the signal's unit, a second for a drift, a factor for a scale, seconds for a
    /// delay, beyond the last value for a spoof.
    pub(super) size: Option<f64>,
}

/// One run.
#[derive(Clone, Debug)]
pub(super) struct Trial {
    pub(super) cell: usize,
    pub(super) fault: Fault,
    /// When the fault ends, and the run with it.
    pub(super) end: Time,
    pub(super) seed: u64,
}

/// What the user wants to be tried.
pub(super) struct Wish<'a> {
    pub(super) kinds: &'a [Kind],
    pub(super) multiples: &'a [f64],
    pub(super) signals: &'a [SignalId],
    pub(super) onsets: usize,
    pub(super) seeds: u64,
    pub(super) duration: Option<Span>,
    /// Multiples are of these, and not of declared errors.
    pub(super) detectable: Option<&'a Detectable>,
}

/// What is seen of each signal with a calibrated model.
pub(super) struct Detectable {
    /// Where the part begins that the model was not fitted to; no fault begins before.
    pub(super) from: Span,
    /// The smallest detectable bias of each signal by index, in its unit.
    pub(super) biases: Vec<Option<f64>>,
}

/// All that is tried.
pub(super) struct Grid {
    pub(super) whats: Vec<What>,
    pub(super) signals: Vec<SignalId>,
    pub(super) cells: Vec<Cell>,
    pub(super) trials: Vec<Trial>,
    /// When faults begin, from the first sample on.
    pub(super) onsets: Vec<Span>,
    /// How long a fault lasts.
    pub(super) duration: Span,
    /// What cannot be tried, and why.
    pub(super) left_out: Vec<String>,
}

/// How large the values of a signal are, and how well they are known.
struct Size {
    /// The declared error of a value of median size, in the signal's unit.
    error: f64,
    /// Median of the values' magnitudes, in the signal's unit.
    median: f64,
    /// The declared error of its time stamps and the mean time from one value to the next.
    time: Span,
}

impl Grid {
    /// Lays out the grid over samples that are in the order of reception; there is at least one.
    ///
    /// # Errors
    /// When the recording is too short, or nothing is left to try.
    pub(super) fn new(
        knowledge: &KnowledgeBase,
        samples: &[Sample],
        wish: &Wish<'_>,
    ) -> anyhow::Result<Grid> {
        let received = |sample: Option<&Sample>| sample.map_or(Time(0), |sample| sample.received);
        let first = received(samples.first());
        let length = received(samples.last()) - first;
        let earliest = wish.detectable.map_or(Span::ZERO, |it| it.from);
        let duration = wish.duration.unwrap_or(Span(length.0 / 4));
        if duration <= Span::ZERO || duration >= length - earliest {
            bail!(
                "the recording lasts {} s: faults of {} s leave no time before them",
                length.seconds(),
                duration.seconds()
            );
        }
        let mut whats = Vec::new();
        for &kind in wish.kinds {
            whats.extend(
                kind.multiples(wish.multiples, wish.detectable.is_some())
                    .into_iter()
                    .map(|multiple| What { kind, multiple }),
            );
        }
        let mut grid = Grid {
            whats,
            signals: Vec::new(),
            cells: Vec::new(),
            trials: Vec::new(),
            onsets: onsets(length - duration - earliest, wish.onsets).map(|onset| earliest + onset).collect(),
            duration,
            left_out: Vec::new(),
        };
        for &signal in wish.signals {
            grid.add(&knowledge.signals()[signal], signal, samples, wish);
        }
        if grid.trials.is_empty() {
            bail!("nothing to try: {}", grid.left_out.join("; "));
        }
        Ok(grid)
    }

    fn add(&mut self, signal: &Signal, id: SignalId, samples: &[Sample], wish: &Wish<'_>) {
        let own: Vec<&Sample> = samples.iter().filter(|sample| sample.wanted == id.index()).collect();
        let Some(mut size) = Size::of(signal, &own) else {
            self.left_out.push(format!("{}: not in the recording", signal.name));
            return;
        };
        if let Some(detectable) = wish.detectable {
            size.error = detectable.biases.get(id.index()).copied().flatten().unwrap_or(0.0);
        }
        if size.error <= 0.0 && wish.detectable.is_some() {
            let reason = "faults with an amount, as no comparison in the recording sees a step of it";
            self.left_out.push(format!("{}: {reason}", signal.name));
        } else if size.error <= 0.0 {
            let reason =
                "faults with an amount, as no value error is declared that it could be a multiple of";
            self.left_out.push(format!("{}: {reason}", signal.name));
        }
        self.signals.push(id);
        for what in self.whats.clone() {
            let Some(size) = size.amount(what, self.duration) else { continue };
            let cell = self.cells.len();
            self.cells.push(Cell { what, signal: id, size });
            for &from in &self.onsets {
                let Some(kind) = fault_kind(what.kind, size.unwrap_or(0.0), &own, from, samples) else {
                    continue;
                };
                let to = from + self.duration;
                let fault = Fault { kind, signal: signal.name.clone(), from, to: Some(to) };
                let end = samples.first().map_or(Time(0), |sample| sample.received) + to;
                let seeds = 1..=if what.kind.is_random() { wish.seeds } else { 1 };
                let trial = |seed| Trial { cell, fault: fault.clone(), end, seed };
                self.trials.extend(seeds.map(trial));
            }
        }
    }
}

/// Evenly over the room, the last one at its end.
fn onsets(room: Span, count: usize) -> impl Iterator<Item = Span> {
    let share = move |number: usize| Span::from_seconds(room.seconds() * number as f64 / count as f64);
    (1..=count).map(share)
}

impl Size {
    /// `None` without a finite value.
    fn of(signal: &Signal, own: &[&Sample]) -> Option<Size> {
        let mut magnitudes: Vec<f64> =
            own.iter().flat_map(|sample| numbers(&sample.value)).map(f64::abs).collect();
        magnitudes.retain(|value| value.is_finite());
        let middle = magnitudes.len() / 2;
        let median =
            (!magnitudes.is_empty()).then(|| *magnitudes.select_nth_unstable_by(middle, f64::total_cmp).1)?;
        let scale = signal.unit.as_ref().map_or(1.0, |unit| unit.scale);
        let declared = signal.value_error;
        let error = declared.lo.abs().max(declared.hi.abs()) / scale + declared.relative * median;
        let (first, last) = (own.first()?.received, own.last()?.received);
        let period = Span((last - first).0 / (own.len() as i64 - 1).max(1));
        let (early, late) = signal.time_error;
        Some(Size { error, median, time: early.abs().max(late.abs()) + period })
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

fn numbers(value: &RawValue) -> Vec<f64> {
    match value {
        RawValue::Number(value) => vec![*value],
        RawValue::Interval { lo, hi } => vec![lo.midpoint(*hi)],
        RawValue::Vector(values) => values.clone(),
    }
}

/// The fault of a size; `None` for a spoof before which no value has come.
fn fault_kind(kind: Kind, size: f64, own: &[&Sample], from: Span, samples: &[Sample]) -> Option<FaultKind> {
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
            let onset = samples.first()?.received + from;
            let before = own.partition_point(|sample| sample.received < onset).checked_sub(1)?;
            FaultKind::Spoof(numbers(&own.get(before)?.value).first()? + size)
        }
    })
}
