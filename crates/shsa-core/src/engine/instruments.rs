//! The quantities that the engine measures for contracts: rate, age, width, value, agreement, availability and verdict of signals
//! and sources.
//!
//! This module stores nothing: a reading follows from the state of monitor and judge, so it is right after a change of the model,
//! too.

use crate::assurance::Reading;
use crate::diagnosis::Judge;
use crate::interval::{Interval, Truth};
use crate::knowledge::{ContractId, EvidenceSource, KnowledgeBase, Measure, SignalId, VariableId, Watched};
use crate::monitor::{Figures, Monitor, WayIndex};
use crate::statement;
use crate::substitution::Way;
use crate::time::{Span, Time, Validity};
use crate::trust::{Ledger, Verdict};
use alloc::collections::BTreeMap;
use alloc::string::String;

/// Evidence from operators, by the contract and its name there: `speed/installed`.
pub(super) type Attested = BTreeMap<String, bool>;

/// A rate is measured over this many gaps between values.
const GAPS: usize = 8;

/// The state that evidence is read from.
pub(super) struct Instruments<'a> {
    pub(super) knowledge: &'a KnowledgeBase,
    pub(super) monitor: &'a Monitor,
    pub(super) judge: &'a Judge,
    pub(super) ledger: &'a Ledger,
    /// Evidence from operators, where there are contracts.
    pub(super) attested: Option<&'a Attested>,
    pub(super) now: Time,
}

/// A quantity as it is known now.
#[derive(Clone, Copy)]
struct Measured {
    value: Interval,
    /// When the newest value behind the quantity was true.
    of: Validity,
    changes: Changes,
}

/// How a quantity changes while no value comes.
#[derive(Clone, Copy)]
enum Changes {
    Not,
    /// The quantity is an age: it grows with time.
    Age,
    /// The quantity is a rate: this many values since a time.
    Rate {
        count: f64,
        since: Time,
    },
}

impl Changes {
    /// The first times at which a quantity has passed a bound.
    fn pass(self, of: Validity, bound: f64) -> [Time; 2] {
        match self {
            Changes::Not => [Time::MAX; 2],
            _ if bound <= 0.0 => [Time::MAX; 2],
            Changes::Age => [after(of.from, bound), after(of.to, bound)],
            Changes::Rate { count, since } => [after(since, count / bound), Time::MAX],
        }
    }
}

/// Just after this many seconds, by more than the tolerance of comparisons of bounds.
fn after(since: Time, seconds: f64) -> Time {
    match seconds.is_finite() {
        true => since + Span::from_seconds(seconds * (1.0 + 4e-9)) + Span(1),
        false => Time::MAX,
    }
}

impl Instruments<'_> {
    /// The reading of a piece of evidence of a contract, where a way serves.
    ///
    /// Complexity: O(1), but for verdicts, agreement and availability: linear in the comparisons of the signal, and in the ways
    /// of its variable.
    pub(super) fn read(&self, contract: ContractId, watched: &Watched, way: &Way) -> Reading {
        match watched.source {
            EvidenceSource::Attested => self.attested_reading(contract, watched),
            EvidenceSource::Specification(variable) => self.specified(watched, variable),
            EvidenceSource::Signal(signal, Measure::Verdict) => Reading::lasting(self.verdict(signal)),
            EvidenceSource::Source(Measure::Verdict) => Reading::lasting(self.verdict_of(way)),
            EvidenceSource::Signal(signal, measure) => self.judged(watched, self.of_signal(signal, measure)),
            EvidenceSource::Source(measure) => {
                // A signal that serves by itself is measured even where the monitor does not watch its way.
                let measured = match way.direct() {
                    Some(signal) => self.of_signal(signal, measure),
                    None => self.monitor.find(way).and_then(|index| self.of_way(index, measure)),
                };
                self.judged(watched, measured)
            }
        }
    }

    fn attested_reading(&self, contract: ContractId, watched: &Watched) -> Reading {
        let contract = self.knowledge.contracts().rows()[contract].name.as_str();
        // Names of signals may hold a slash, those of evidence do not.
        let is_it = |name: &String| name.rsplit_once('/') == Some((contract, watched.name.as_str()));
        let holds =
            self.attested.into_iter().flatten().find(|(name, _)| is_it(name)).map(|(_, holds)| *holds);
        holds.map_or(Reading::UNKNOWN, |holds| Reading::lasting(holds.into()))
    }

    /// The verdict of a specification: unknown while a signal that it reads is absent, and until each has given a value.
    fn specified(&self, watched: &Watched, variable: VariableId) -> Reading {
        let is_absent = |signal| self.monitor.timeouts().absence(signal).is_some();
        let computed = self.monitor.ways_of(variable).filter_map(|index| {
            let way = self.monitor.way(index)?;
            (!way.rests_on.is_empty() && !way.rests_on.iter().any(is_absent)).then_some(index)
        });
        let verdicts = computed.map(|index| self.judged(watched, self.of_way(index, Measure::Value)));
        verdicts.min_by_key(|reading| reading.truth).unwrap_or(Reading::UNKNOWN)
    }

    fn verdict(&self, signal: SignalId) -> Truth {
        if self.monitor.timeouts().absence(signal).is_some() {
            return Truth::False;
        }
        match self.judge.verdict(self.ledger, self.knowledge.witness(signal), self.monitor, self.now) {
            Verdict::Healthy => Truth::True,
            Verdict::Unknown => Truth::Unknown,
            Verdict::Suspect | Verdict::Failed => Truth::False,
        }
    }

    /// A way is as healthy as the least healthy of its signals.
    fn verdict_of(&self, way: &Way) -> Truth {
        way.inputs().map(|signal| self.verdict(signal)).min().unwrap_or(Truth::Unknown)
    }

    /// Compares a measured quantity with its bounds, while the measurement is recent enough.
    fn judged(&self, watched: &Watched, measured: Option<Measured>) -> Reading {
        let (Some(measured), Some(within)) = (measured, watched.within) else { return Reading::UNKNOWN };
        let expires = watched.max_age.map_or(Time::MAX, |most| measured.of.to + most + Span(1));
        if expires <= self.now {
            return Reading::UNKNOWN;
        }
        let truth = statement::truth(measured.value, within);
        let bounds = [within.lo(), within.hi()];
        let changes = bounds.into_iter().flat_map(|bound| measured.changes.pass(measured.of, bound));
        let ahead = changes.chain([expires]).filter(|at| *at > self.now);
        Reading { truth, until: ahead.min().unwrap_or(Time::MAX) }
    }

    fn of_signal(&self, signal: SignalId, measure: Measure) -> Option<Measured> {
        let port = &self.monitor.ports()[signal];
        let moment = |back: usize| port.moment(back);
        let value = match measure {
            Measure::Width => port.widest()?,
            Measure::Value => port.hull()?,
            Measure::Agreement | Measure::Availability => {
                let variable = self.knowledge.signals()[signal].variable;
                self.figure(self.monitor.find_direct(variable, signal)?, measure)?
            }
            Measure::Rate => return self.rate(moment),
            Measure::Age | Measure::Verdict => return self.age(moment(0)?),
        };
        Some(Measured { value, of: moment(0)?, changes: Changes::Not })
    }

    fn of_way(&self, index: WayIndex, measure: Measure) -> Option<Measured> {
        let outputs = &self.monitor.way(index)?.outputs;
        let moment = |back: usize| outputs.newest(back).map(|sample| sample.validity);
        let newest = outputs.newest(0)?;
        let value = match measure {
            Measure::Width => Interval::point(newest.value.width()),
            Measure::Value => newest.value,
            Measure::Agreement | Measure::Availability => self.figure(index, measure)?,
            Measure::Rate => return self.rate(moment),
            Measure::Age | Measure::Verdict => return self.age(newest.validity),
        };
        Some(Measured { value, of: newest.validity, changes: Changes::Not })
    }

    fn age(&self, of: Validity) -> Option<Measured> {
        let value =
            Interval::new((self.now - of.to).seconds().max(0.0), (self.now - of.from).seconds().max(0.0));
        Some(Measured { value, of, changes: Changes::Age })
    }

    /// Values a second over the last gaps; an overdue value counts as a gap. One value has no rate.
    fn rate(&self, moment: impl Fn(usize) -> Option<Validity>) -> Option<Measured> {
        let newest = moment(0)?;
        let (gaps, oldest) = (1..=GAPS).rev().find_map(|back| Some((back as f64, moment(back)?)))?;
        let since = oldest.to;
        let usual = (newest.to - since).seconds() / gaps;
        let waited = (self.now - newest.to).seconds();
        let rate = match waited > usual {
            true => (gaps + 1.0) / (self.now - since).seconds(),
            false => 1.0 / usual,
        };
        let value = Interval::point(rate);
        let changes = Changes::Rate { count: gaps + 1.0, since };
        rate.is_finite().then_some(Measured { value, of: newest, changes })
    }

    fn figure(&self, way: WayIndex, measure: Measure) -> Option<Interval> {
        let Figures { agreement, availability, .. } = self.monitor.figures(way, self.now);
        let figure = if measure == Measure::Agreement { agreement } else { availability };
        figure.map(Interval::point)
    }
}
