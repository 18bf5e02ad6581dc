//! The smallest fault of each kind that the whole loop detects, found by trying.
//!
//! An amount is *seen* when an alarm follows the fault with either sign, at every one of some moments, and with every seed if it
//! is random. A drift must be detected before it ends, noise and spikes within half of their duration, other faults within a
//! quarter, so that late alarms by chance do not count. The amount is doubled until it is seen, then reduced to within a tenth
//! above an amount that is not seen; twice the amount must be seen, too, which excludes lucky ones. The result is not a property
//! of one comparison: it includes debouncing, the judge, gates and timeouts.

use super::baseline::Baseline;
use super::grid::Trial;
use super::kind::{Kind, fault_kind};
use super::onset::{Onset, Recorded, onsets};
use super::parallel::{Progress, on_all_cores};
use super::rounded;
use super::size::Size;
use crate::LabError;
use serde_json::{Map, Value, json};
use shsa_core::knowledge::{Id, KnowledgeBase, Signal, SignalId};
use shsa_core::time::{Span, Time};
use shsa_format::fault::Fault;
use shsa_recording::Sample;
use std::num::NonZeroUsize;

/// The largest amount in the search, as a multiple of the first one,
const MOST_TIMES: f64 = 256.0;

/// and as a multiple of the values' range: if the error is declared at a relation, the signal's own error means little.
const MOST_RANGES: f64 = 8.0;

/// The smallest amount in the search, as a part of the first one.
const LEAST_PART: f64 = 1.0 / 1024.0;

/// The largest ratio between the result and an amount that is not seen.
const PRECISION: f64 = 1.1;

/// A fault must be detected within its duration divided by this.
fn part(kind: Kind) -> i64 {
    match kind {
        Kind::Drift => 1,
        Kind::Noise | Kind::Spike => 2,
        _ => 4,
    }
}

/// The first amount if no error is declared: this share of the values' range.
const SHARE_OF_RANGE: f64 = 0.01;

/// The number of moments from which onsets are chosen.
const CANDIDATES: usize = 400;

/// The settings of a search.
pub struct SearchSpec<'a> {
    /// The kinds of faults; those without an amount are left out.
    pub kinds: &'a [Kind],
    /// The signals with faults.
    pub signals: &'a [SignalId],
    /// The number of moments.
    pub onsets: usize,
    /// The number of seeds for a random fault.
    pub seeds: u64,
    /// The duration of a fault.
    pub duration: Span,
    /// Unhealthy times of reception, which no fault may overlap.
    pub unhealthy: Vec<(Time, Time)>,
    /// The number of threads; `None`: one for each core.
    pub threads: Option<NonZeroUsize>,
    /// The receiver of progress.
    pub progress: &'a dyn Progress,
}

/// The smallest faults of a model in a recording.
pub struct Smallest {
    /// The duration of a fault.
    pub duration: Span,
    /// The onsets, from the first sample of the recording.
    pub onsets: Vec<Span>,
    /// By signal, and by kind in the order of the spec.
    pub found: Vec<Found>,
}

/// The smallest fault of a kind and a signal.
#[derive(Clone, Debug)]
pub struct Found {
    /// The signal.
    pub signal: SignalId,
    /// The kind of fault.
    pub kind: Kind,
    /// The smallest amount, or why there is none.
    pub limit: Limit,
}

/// The result of a search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Limit {
    /// This amount is seen: in the signal's unit, a second for a drift, a part of the value for a scale, seconds for a delay,
    /// relative to the last value for a spoof.
    Seen {
        /// The amount.
        amount: f64,
        /// The longest latency of all runs.
        within: Span,
    },
    /// No amount up to `up_to` is seen at every moment; `up_to` is seen in `seen` of `of` runs.
    Unseen {
        /// The largest amount that was tried.
        up_to: f64,
        /// The number of runs in which it is seen.
        seen: usize,
        /// The number of runs.
        of: usize,
    },
    /// The recording has no values then, or no amount would change one.
    NotRecorded,
}

impl Smallest {
    /// Searches in recorded samples. Except for the unhealthy times of the spec, they must be healthy, and the model must be
    /// fitted to them.
    ///
    /// Time: about ten amounts for each signal and kind, each with a run for every onset and seed, up to the first run in which
    /// the amount is not seen.
    ///
    /// # Errors
    /// When a run panicked.
    pub fn find(
        knowledge: &KnowledgeBase,
        sessions: &[Recorded<'_>],
        spec: &SearchSpec<'_>,
    ) -> Result<Smallest, LabError> {
        let baselines: Vec<Baseline<'_>> =
            sessions.iter().filter_map(|it| Baseline::new(knowledge, it.origin, it.samples)).collect();
        let onsets = healthy_onsets(&baselines, spec);
        let pairs =
            spec.signals.iter().flat_map(|&signal| spec.kinds.iter().map(move |&kind| (signal, kind)));
        let jobs: Vec<(SignalId, Kind)> = pairs.filter(|(_, kind)| kind.has_amount()).collect();
        let work = |number: usize| {
            let &(signal, kind) = jobs.get(number)?;
            let limit = Search::new(&baselines, spec, &onsets, signal, kind)
                .map_or(Limit::NotRecorded, |mut search| search.limit());
            Some(Found { signal, kind, limit })
        };
        let found = on_all_cores(jobs.len(), spec.threads, spec.progress, "smallest faults", work)?;
        let onsets = onsets.into_iter().map(|onset| onset.at).collect();
        Ok(Smallest { duration: spec.duration, onsets, found: found.into_iter().flatten().collect() })
    }

    /// The result for a signal and kind; `None` if it was not searched for.
    pub fn limit(&self, signal: SignalId, kind: Kind) -> Option<Limit> {
        self.found.iter().find(|it| it.signal == signal && it.kind == kind).map(|it| it.limit)
    }

    /// The kinds that were looked for.
    pub fn kinds(&self) -> Vec<Kind> {
        Kind::ALL.into_iter().filter(|kind| self.found.iter().any(|it| it.kind == *kind)).collect()
    }

    /// The results by signal and kind: the amount to inject and the longest latency; if none is seen, the largest amount tried,
    /// and the number of runs in which it is seen.
    pub fn to_json(&self, knowledge: &KnowledgeBase) -> Value {
        let kinds = self.kinds();
        let limit = |limit: Limit| match limit {
            Limit::NotRecorded => Value::Null,
            Limit::Seen { amount, within } => json!({ "amount": amount, "within_s": within.seconds() }),
            Limit::Unseen { up_to, seen, of } => json!({ "unseen_up_to": up_to, "seen": seen, "of": of }),
        };
        let of_signal = |(id, signal): (SignalId, &Signal)| {
            let cells =
                kinds.iter().filter_map(|&kind| Some((kind.name().to_owned(), limit(self.limit(id, kind)?))));
            (signal.name.clone(), Value::Object(cells.collect()))
        };
        let onsets: Vec<f64> = self.onsets.iter().map(|onset| onset.seconds()).collect();
        let signals: Map<String, Value> = knowledge.signals().enumerate().map(of_signal).collect();
        json!({ "onsets_s": onsets, "fault_s": self.duration.seconds(), "signals": signals })
    }

    /// Describes the result for a signal and kind; a drift by the amount that it reaches.
    pub fn described(&self, signal: &Signal, id: SignalId, kind: Kind) -> String {
        let unit = signal.unit.as_ref().map_or(String::new(), |unit| format!(" {unit}"));
        let amount = |amount: f64| match kind {
            Kind::Delay => format!("{} s", rounded(amount)),
            Kind::Scale => format!("{} %", rounded(100.0 * amount)),
            Kind::Drift => format!("{}{unit}", rounded(amount * self.duration.seconds())),
            _ => format!("{}{unit}", rounded(amount)),
        };
        match self.limit(id, kind) {
            None => "-".to_owned(),
            Some(Limit::NotRecorded) => "not recorded".to_owned(),
            Some(Limit::Seen { amount: seen, within }) => {
                format!("{} in {} s", amount(seen), rounded(within.seconds()))
            }
            Some(Limit::Unseen { up_to, seen, of }) => {
                format!("not up to {} ({seen} of {of})", amount(up_to))
            }
        }
    }

    /// The smallest amount that is seen, and its longest latency.
    pub fn seen(&self, signal: SignalId, kind: Kind) -> Option<(f64, Span)> {
        match self.limit(signal, kind)? {
            Limit::Seen { amount, within } => Some((amount, within)),
            Limit::Unseen { .. } | Limit::NotRecorded => None,
        }
    }
}

/// The wanted number of moments, evenly chosen among those whose fault overlaps no unhealthy time.
fn healthy_onsets(baselines: &[Baseline<'_>], spec: &SearchSpec<'_>) -> Vec<Onset> {
    let sessions: Vec<Recorded<'_>> =
        baselines.iter().map(|it| Recorded { origin: it.origin, samples: it.samples }).collect();
    let is_healthy = |onset: &Onset| {
        let Some(baseline) = baselines.get(onset.session) else { return false };
        let (from, to) = (baseline.origin + onset.at, baseline.origin + onset.at + spec.duration);
        !spec.unhealthy.iter().any(|(begin, end)| from < *end && *begin < to)
    };
    let all = onsets(&sessions, &[], spec.duration, CANDIDATES);
    let healthy: Vec<Onset> = all.into_iter().filter(is_healthy).collect();
    let count = spec.onsets.min(healthy.len());
    let place = |number: usize| healthy.get((number * healthy.len() / count).saturating_sub(1)).copied();
    (1..=count).filter_map(place).collect()
}

/// A run of a search: onset, sign and seed.
#[derive(Clone, Copy)]
struct Try {
    onset: Onset,
    side: f64,
    seed: u64,
}

/// The search for one amount.
struct Search<'a> {
    baselines: &'a [Baseline<'a>],
    signal: SignalId,
    name: &'a str,
    kind: Kind,
    duration: Span,
    /// The samples of the signal, by session in the order of reception.
    own: Vec<Vec<&'a Sample>>,
    /// The runs; the one that failed last comes first, because it probably fails again.
    tries: Vec<Try>,
    start: f64,
    most: f64,
}

impl<'a> Search<'a> {
    /// `None` when there is no run to try.
    fn new(
        baselines: &'a [Baseline<'a>],
        spec: &SearchSpec<'_>,
        onsets: &[Onset],
        signal: SignalId,
        kind: Kind,
    ) -> Option<Search<'a>> {
        let description = &baselines.first()?.knowledge.signals()[signal];
        let of_session =
            |it: &'a Baseline<'a>| it.samples.iter().filter(|it| it.wanted == signal.index()).collect();
        let own: Vec<Vec<&Sample>> = baselines.iter().map(of_session).collect();
        let size = Size::of(description, &own)?;
        let seeds = 1..=if kind.is_random() { spec.seeds } else { 1 };
        let sides: &[f64] = if kind.has_sides() { &[1.0, -1.0] } else { &[1.0] };
        let all = onsets.iter().flat_map(|&onset| seeds.clone().map(move |seed| (onset, seed)));
        let tries = all.flat_map(|(onset, seed)| sides.iter().map(move |&side| Try { onset, side, seed }));
        let value = if size.error > 0.0 { size.error } else { SHARE_OF_RANGE * size.range };
        let most = (MOST_TIMES * value).max(MOST_RANGES * size.range);
        let (start, most) = match kind {
            Kind::Delay => {
                let start = size.time.seconds();
                (start, (MOST_TIMES * start).min(0.5 * spec.duration.seconds()))
            }
            Kind::Drift => (value / spec.duration.seconds(), most / spec.duration.seconds()),
            Kind::Scale => (value / size.median, most / size.median),
            _ => (value, most),
        };
        let is_possible = start > 0.0 && start.is_finite() && most.is_finite();
        is_possible.then(|| Search {
            baselines,
            signal,
            name: &description.name,
            kind,
            duration: spec.duration,
            own,
            tries: tries.collect(),
            start,
            most,
        })
    }

    fn limit(&mut self) -> Limit {
        let mut start = self.start.min(self.most);
        loop {
            let Some((mut hi, mut within, mut lo)) = self.bracket(start) else { return self.unseen() };
            while hi > PRECISION * lo && lo > 0.0 {
                let middle = (lo * hi).sqrt();
                match self.seen(middle) {
                    Some(seen) => (hi, within) = (middle, seen),
                    None => lo = middle,
                }
            }
            if self.seen(2.0 * hi).is_some() {
                return Limit::Seen { amount: hi, within };
            }
            start = 4.0 * hi;
        }
    }

    /// An amount that is seen, its latency, and half of it, which is not seen (0 if every amount is seen).
    fn bracket(&mut self, start: f64) -> Option<(f64, Span, f64)> {
        let (mut amount, mut below) = (start, None);
        let mut within = loop {
            if amount > self.most {
                return None;
            }
            match self.seen(amount) {
                Some(within) => break within,
                None => (below, amount) = (Some(amount), 2.0 * amount),
            }
        };
        if let Some(below) = below {
            return Some((amount, within, below));
        }
        while amount > LEAST_PART * self.start {
            match self.seen(0.5 * amount) {
                Some(faster) => (amount, within) = (0.5 * amount, faster),
                None => return Some((amount, within, 0.5 * amount)),
            }
        }
        Some((amount, within, 0.0))
    }

    /// The longest latency of an amount; `None` when it is not seen in a run.
    fn seen(&mut self, amount: f64) -> Option<Span> {
        let mut slowest = None;
        for at in 0..self.tries.len() {
            match self.tried(*self.tries.get(at)?, amount) {
                None => {}
                Some(Some(latency)) => slowest = slowest.max(Some(latency)),
                Some(None) => {
                    self.tries.swap(0, at);
                    return None;
                }
            }
        }
        slowest
    }

    /// The latency of a run's alarm; `None` when the fault changes nothing.
    fn tried(&self, one: Try, amount: f64) -> Option<Option<Span>> {
        let Onset { session, at: from } = one.onset;
        let (baseline, own) = (self.baselines.get(session)?, self.own.get(session)?);
        let scaling = baseline.knowledge.signals()[self.signal].scaling;
        let size = if self.kind == Kind::Scale { 1.0 + one.side * amount } else { one.side * amount };
        let kind = fault_kind(self.kind, size, own, scaling, baseline.origin + from)?;
        let to = from + Span(self.duration.0 / part(self.kind));
        let fault = Fault { kind, signal: self.name.to_owned(), from, to: Some(to) };
        let end = baseline.origin + to;
        let trial = Trial { cell: 0, session, fault, end, seed: one.seed, is_below: false };
        baseline.first_alarm(&trial, self.signal)
    }

    fn unseen(&self) -> Limit {
        let results: Vec<Option<Span>> =
            self.tries.iter().filter_map(|&one| self.tried(one, self.most)).collect();
        match results.len() {
            0 => Limit::NotRecorded,
            of => Limit::Unseen { up_to: self.most, seen: results.iter().flatten().count(), of },
        }
    }
}
