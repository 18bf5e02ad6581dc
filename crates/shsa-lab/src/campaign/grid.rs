//! The grid of trials: every kind and amount of fault for every signal, at every onset and with every seed.

use super::detectable::Detectable;
use super::kind::{Kind, What, fault_kind};
use super::onset::{Onset, Recorded, onsets};
use super::size::Size;
use crate::LabError;
use shsa_core::knowledge::{KnowledgeBase, Signal, SignalId};
use shsa_core::time::{Span, Time};
use shsa_format::fault::Fault;
use shsa_recording::Sample;
use std::collections::BTreeMap;

/// One fault of one signal; trials differ in onset and seed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// The kind of fault and its multiple.
    pub what: What,
    /// The signal with the fault.
    pub signal: SignalId,
    /// The injected amount: in the signal's unit, a second for a drift, a factor for a scale, seconds for a delay, relative to
    /// the last value for a spoof.
    pub size: Option<f64>,
}

/// Faults that are not tried.
#[derive(Clone, Debug, PartialEq)]
pub struct Untried {
    /// The signal of the faults.
    pub signal: SignalId,
    /// The reason.
    pub reason: Reason,
    /// The number of runs that were left out.
    pub runs: usize,
}

/// Why faults are not tried.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Reason {
    /// No amount is detected at each moment of the first half.
    Unseen,
    /// The signal has no values at that time: it is silent, or ends within the fault.
    Absent,
    /// No amount can be derived: the values are constant, and no error is declared.
    NoAmount,
}

impl Reason {
    /// All reasons, in the order of reports.
    pub const ALL: [Reason; 3] = [Reason::Unseen, Reason::Absent, Reason::NoAmount];

    /// The text after "not tried".
    pub fn words(self) -> &'static str {
        match self {
            Reason::Unseen => "of no amount that is seen at each moment of the first half",
            Reason::Absent => "when their signal is silent",
            Reason::NoAmount => "without an amount",
        }
    }
}

/// One run of a cell.
#[derive(Clone, Debug)]
pub struct Trial {
    /// The index of its cell.
    pub cell: usize,
    /// The index of its session, from 0.
    pub session: usize,
    /// The injected fault.
    pub fault: Fault,
    /// When the fault ends, and with it the run.
    pub end: Time,
    /// The seed of the fault's random numbers.
    pub seed: u64,
    /// A stuck value of a signal that would hardly change: the fault is smaller than the smallest detectable one.
    pub is_below: bool,
}

/// The settings of a grid.
pub struct GridSpec<'a> {
    /// The kinds of faults.
    pub kinds: &'a [Kind],
    /// The amounts, as multiples.
    pub multiples: &'a [f64],
    /// The signals with faults.
    pub signals: &'a [SignalId],
    /// The number of moments at which each fault begins.
    pub onsets: usize,
    /// The number of seeds for a random fault.
    pub seeds: u64,
    /// The duration of a fault; `None`: a quarter of the longest session.
    pub duration: Option<Span>,
    /// If given, multiples are of these faults, and not of declared errors.
    pub detectable: Option<&'a Detectable>,
    /// By signal, the amount that replaces a missing value error, in the signal's unit.
    pub instead: &'a BTreeMap<SignalId, f64>,
}

/// The grid of trials.
pub struct Grid {
    /// Every kind with every multiple.
    pub whats: Vec<What>,
    /// The signals with faults.
    pub signals: Vec<SignalId>,
    /// The cells by signal, then by kind and multiple.
    pub cells: Vec<Cell>,
    /// The trials by cell.
    pub trials: Vec<Trial>,
    /// The beginnings of faults.
    pub onsets: Vec<Onset>,
    /// The duration of a fault.
    pub duration: Span,
    /// The faults that cannot be tried, with the reasons.
    pub left_out: Vec<String>,
    /// The numbers of faults that cannot be tried.
    pub untried: Vec<Untried>,
}

impl Grid {
    /// The grid over sessions, of which there must be one at least.
    ///
    /// # Errors
    /// When all sessions are too short, or no trial is left.
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

    /// Adds the runs of the last cell.
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
            let Some(kind) = fault_kind(what.kind, size.unwrap_or(0.0), own, signal.scaling, onset) else {
                continue;
            };
            let to = from + self.duration;
            let fault = Fault { kind, signal: signal.name.clone(), from, to: Some(to) };
            let end = recorded.origin + to;
            // If the signal ends within the time of a fault, the fault would be shorter.
            let is_cut = own.last().is_none_or(|last| last.received < end - Span(self.duration.0 / 10));
            if spec.detectable.is_some() && is_cut {
                continue;
            }
            let is_below =
                spec.detectable.is_some_and(|it| it.is_below(&fault, id, own, signal.scaling, end));
            let seeds = 1..=if what.kind.is_random() { spec.seeds } else { 1 };
            let cell = self.cells.len() - 1;
            let trial = |seed| Trial { cell, session, fault: fault.clone(), end, seed, is_below };
            self.trials.extend(seeds.map(trial));
        }
    }
}
