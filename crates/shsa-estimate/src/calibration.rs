//! A model calibrated: what its pairs need, the errors that explain it, and how that fares with what came later.

mod edit;
mod calm;
mod jump;
mod pair;
mod unhealthy;
mod offset;
mod shape;
mod lasting;
mod bias;

pub use pair::PairFit;
pub use unhealthy::Stretch;

use crate::comparison::Watched;
use crate::delay::{self, Curve};
use crate::order::{median, quantile, sorted};
use crate::rhythm::Rhythm;
use crate::widening::{Demand, least_widening};
use bias::Seen;
use edit::Trial;
use shsa_core::engine::{self, Engine, EventKind, Input, Output};
use shsa_core::knowledge::{Bounds, Draft, IdVec, KnowledgeBase, RelationId, SignalId};
use shsa_core::monitor::WatchedWay;
use shsa_core::observation::Observation;
use shsa_core::plan::Graph;
use shsa_core::substitution::Way;
use shsa_core::time::{Span, Time};
use std::collections::BTreeSet;

/// What a pair needs at least when its parameters are weighed: a share of what the largest pair of the same needs.
const LEAST_OF_MOST: f64 = 0.05;

/// A pair that comes into conflict in what was fitted asks for this many times as much,
const MORE: f64 = 1.1;
/// so many times at most.
const MOST_ROUNDS: usize = 12;

/// What is asked for.
#[derive(Clone, Debug)]
pub struct Options {
    /// Conflicts of one healthy pair an hour that are accepted, above 0.
    pub false_alarms_per_hour: f64,
    /// How certain a bound must be where it rests on counting alone, below 1.
    pub confidence: f64,
    /// Delays up to this are searched for.
    pub most_delay: Span,
    /// Times of reception that are not healthy, from the first up to the second, and are left out.
    pub left_out: Vec<(Time, Time)>,
    /// Whether stretches that look unhealthy are fitted, too.
    pub fits_all: bool,
}

impl Default for Options {
    /// One false conflict an hour, 95 %, 2 s.
    fn default() -> Options {
        Options {
            false_alarms_per_hour: 1.0,
            confidence: 0.95,
            most_delay: Span::from_millis(2_000),
            left_out: Vec::new(),
            fits_all: false,
        }
    }
}

/// Why nothing can be calibrated.
#[derive(Clone, Debug, thiserror::Error)]
pub enum Problem {
    /// The model, or what would become of it, has an error.
    #[error("the model has an error: {0}")]
    Model(String),
    /// No variable is known in two ways.
    #[error("no variable of the model is known in two ways, so there is nothing to compare")]
    NoPairs,
    /// No two ways of one variable were observed together.
    #[error(
        "of the model's {pairs} pairs of ways, none has a comparison before the split: are their signals in the recording?"
    )]
    NotObserved {
        /// Pairs of the model.
        pairs: usize,
    },
}

/// A number of the model that is fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Parameter {
    /// The value error of a signal that is compared itself.
    Signal(SignalId),
    /// The error of a relation.
    Relation(RelationId),
}

/// A number of the model, fitted.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// Which.
    pub parameter: Parameter,
    /// Plus-minus, in the unit of the signal or of the relation's left side; `None` when no pair asks for it, and it
    /// stays as it is.
    pub error: Option<f64>,
    /// How much more the signal shows than the others do, or the right side of the relation than its left side, in the
    /// same unit; 0 where that is not worth taking out.
    pub offset: f64,
    /// Besides, this much of the value, in percent.
    pub percent: f64,
    /// Plus-minus on the time of the signal, beyond what the model says; zero where that does not help.
    pub time_error: Span,
    /// How much later the signal tells than its model says; zero where that is not believed.
    pub delay: Span,
    /// The smallest step of the signal that brings a pair into conflict in 95 % of the later windows, in its unit;
    /// `None` when no pair shows it.
    pub smallest_bias: Option<f64>,
    /// The pair that sees it.
    pub seen_by: Option<usize>,
    /// The smallest step that is an alarm when it lasts, by what many comparisons say together, and how long it must last;
    /// `None` when that is not smaller.
    pub lasting_bias: Option<(f64, Span)>,
    /// The pair that asks for the most.
    pub asked_by: Option<usize>,
}

impl Fitted {
    /// Of a signal that is not compared itself: its errors are those of the relations that read it.
    fn only_seen(signal: SignalId, time_error: Span, seen: Seen) -> Fitted {
        Fitted {
            parameter: Parameter::Signal(signal),
            error: None,
            offset: 0.0,
            percent: 0.0,
            time_error,
            delay: Span::ZERO,
            smallest_bias: Some(seen.bias),
            seen_by: Some(seen.by),
            lasting_bias: seen.lasting,
            asked_by: None,
        }
    }
}

/// What a whole engine says about observations that should all be healthy.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Verdicts {
    /// Signals called faulty: false alarms.
    pub failed: usize,
    /// Signals suspected.
    pub suspected: usize,
    /// Signals called silent.
    pub silent: usize,
}

/// A model calibrated.
#[derive(Clone, Debug)]
pub struct Calibration {
    /// How each signal comes, over all observations.
    pub rhythms: Vec<Rhythm>,
    /// Every pair that the engine compares.
    pub pairs: Vec<PairFit>,
    /// Every number that is fitted, and every signal of which a step is seen.
    pub fitted: Vec<Fitted>,
    /// The model with the fitted numbers.
    pub draft: Draft,
    /// What is said about the later observations with the model as it was.
    pub before: Verdicts,
    /// And with the fitted one.
    pub after: Verdicts,
    /// Stretches before the split that look like faults and were not fitted.
    pub unhealthy: Vec<Stretch>,
}

/// Fits errors, offsets and delays to what was received before `split`, and tests them on the rest.
///
/// The observations are healthy and in the order of reception; the draft builds without errors. Delays come first: of
/// each pair the shift with the least spread, of each signal the median over its pairs. Then offsets, then what each pair
/// needs so that a window of comparisons is in conflict no more often than wanted, and last the errors that give every
/// pair that much, with the least sum of squares. Time: a few runs of the monitor, and one more for each parameter that
/// a relation reads.
///
/// # Errors
/// When there is nothing to compare.
pub fn calibrate(
    draft: &Draft,
    observations: &[Observation],
    split: Time,
    options: &Options,
) -> Result<Calibration, Problem> {
    let knowledge = edit::built(draft)?;
    let ways = engine::to_watch(&knowledge, &Graph::new(&knowledge), engine::WatchBudget::default());
    let healthy = without(observations, &options.left_out);
    let work = Work::new(draft, &knowledge, &ways, &healthy, split, options);
    let trial = Trial::new(&work.parameters, &knowledge);
    let plain = work.watch(&trial, &healthy)?;
    let count = plain.comparisons.len();
    match plain.comparisons.iter().map(|all| work.before_split(all).len()).sum::<usize>() {
        _ if count == 0 => return Err(Problem::NoPairs),
        0 => return Err(Problem::NotObserved { pairs: count }),
        _ => {}
    }
    let unhealthy = if options.fits_all { Vec::new() } else { work.unhealthy(&plain) };
    if unhealthy.is_empty() {
        return work.calibration(&knowledge, trial, plain, unhealthy);
    }
    let spans: Vec<(Time, Time)> = unhealthy.iter().map(|it| (it.from, it.to)).collect();
    let healthy = without(&healthy, &spans);
    let work = Work::new(draft, &knowledge, &ways, &healthy, split, options);
    let plain = work.watch(&trial, &healthy)?;
    work.calibration(&knowledge, trial, plain, unhealthy)
}

/// The observations that were not received in one of these times.
fn without(observations: &[Observation], left_out: &[(Time, Time)]) -> Vec<Observation> {
    let is_kept =
        |it: &&Observation| !left_out.iter().any(|(from, to)| *from <= it.received && it.received < *to);
    observations.iter().filter(is_kept).cloned().collect()
}

/// What all steps need.
struct Work<'a> {
    draft: &'a Draft,
    observations: &'a [Observation],
    /// Those before the split.
    early: &'a [Observation],
    split: Time,
    options: &'a Options,
    ways: &'a [Way],
    parameters: Vec<Parameter>,
}

/// The signals that are compared themselves, then the relations that the others use.
fn parameters(knowledge: &KnowledgeBase, ways: &[Way]) -> Vec<Parameter> {
    let signals = ways.iter().filter_map(Way::direct).map(Parameter::Signal);
    let has_formula = |relation: &RelationId| !knowledge.relations()[*relation].formulas.is_empty();
    let relations = ways.iter().flat_map(|way| way.substitution.relations()).filter(has_formula);
    let all: BTreeSet<Parameter> = signals.chain(relations.map(Parameter::Relation)).collect();
    all.into_iter().collect()
}

impl<'a> Work<'a> {
    fn new(
        draft: &'a Draft,
        knowledge: &KnowledgeBase,
        ways: &'a [Way],
        observations: &'a [Observation],
        split: Time,
        options: &'a Options,
    ) -> Work<'a> {
        let early = &observations[..observations.partition_point(|it| it.received < split)];
        Work { draft, observations, early, split, options, parameters: parameters(knowledge, ways), ways }
    }

    /// Fits and tests; `plain` is what was watched without any errors.
    fn calibration(
        &self,
        knowledge: &KnowledgeBase,
        mut trial: Trial,
        plain: Watched,
        unhealthy: Vec<Stretch>,
    ) -> Result<Calibration, Problem> {
        let count = plain.comparisons.len();
        let pair_delays = self.delays(&plain);
        trial.delays = signal_delays(knowledge, &plain, &pair_delays);
        let delayed = if trial.delays.iter().any(|delay| *delay > Span::ZERO) {
            self.watch(&trial, self.observations)?
        } else {
            plain
        };
        let (trial, watched) = self.without_offsets(knowledge, trial, delayed)?;
        let (trial, watched) = self.shaped(knowledge, trial, watched)?;
        let gains = self.gains(&trial, knowledge)?;
        let mut pairs: Vec<PairFit> =
            (0..count).map(|at| PairFit::new(self, &watched, at, pair_delays[at])).collect();
        let demand = |(pair, gains): (&PairFit, &Vec<(usize, f64)>)| Demand {
            gains: gains.clone(),
            least: pair.needed,
        };
        let mut demands: Vec<Demand> = pairs.iter().zip(&gains).map(demand).collect();
        let errors = self.silent_errors(&trial, &mut demands)?;
        for (pair, demand) in pairs.iter_mut().zip(&demands) {
            pair.needed = demand.least;
        }
        for (at, pair) in pairs.iter_mut().enumerate() {
            pair.test(self, &watched.comparisons[at], demands[at].reached(&errors));
        }
        let fitted = self.fitted(&watched, &trial, &pairs, &demands, &errors, knowledge)?;
        let rhythms = Rhythm::of_all(knowledge, self.observations, &self.options.left_out);
        let draft = edit::patched(self.draft, &fitted, &trial.time_errors, &rhythms, knowledge);
        let late = &self.observations[self.early.len()..];
        let after = verdicts(&edit::built(&draft)?, late);
        let before = verdicts(knowledge, late);
        Ok(Calibration { rhythms, pairs, fitted, before, after, unhealthy, draft })
    }

    fn watch(&self, trial: &Trial, observations: &[Observation]) -> Result<Watched, Problem> {
        let knowledge = edit::built(&trial.applied(self.draft))?;
        Ok(Watched::over(&knowledge, self.ways, observations))
    }

    fn before_split<'c>(
        &self,
        comparisons: &'c [crate::comparison::Comparison],
    ) -> &'c [crate::comparison::Comparison] {
        &comparisons[..comparisons.partition_point(|it| it.received < self.split)]
    }

    fn delays(&self, watched: &Watched) -> Vec<Option<delay::Delay>> {
        let curves: Vec<Curve> = watched.outputs.iter().map(|outputs| Curve::new(outputs)).collect();
        let pairs = watched.monitor.pairs().iter().zip(&watched.comparisons);
        pairs
            .map(|(pair, comparisons)| {
                let period = watched.sides(pair).0.computation.timing().period.unwrap_or(Span::ZERO);
                let most = self.options.most_delay.seconds().max(4.0 * period.seconds());
                delay::between(self.before_split(comparisons), &curves[pair.other.0 as usize], most)
            })
            .collect()
    }

    /// How much wider each pair becomes for one unit of each parameter, by trying: half a width, in SI.
    fn gains(&self, trial: &Trial, knowledge: &KnowledgeBase) -> Result<Vec<Vec<(usize, f64)>>, Problem> {
        let base = self.watch(trial, self.early)?;
        let widths = |watched: &Watched| -> Vec<f64> {
            watched.comparisons.iter().map(|all| median(all.iter().map(|it| it.width))).collect()
        };
        let narrow = widths(&base);
        let mut gains = vec![Vec::new(); narrow.len()];
        for (number, parameter) in self.parameters.iter().enumerate() {
            let wider = match self.is_only_direct(*parameter) {
                Some(signal) => direct_gains(&base, knowledge, signal),
                None => {
                    let tried =
                        self.watch(&Trial { probe: Some(*parameter), ..trial.clone() }, self.early)?;
                    let wide = widths(&tried);
                    wide.iter()
                        .zip(&narrow)
                        .map(|(wide, narrow)| 0.5 * (wide - narrow) / edit::PROBE)
                        .collect()
                }
            };
            for (gains, wider) in gains.iter_mut().zip(wider).filter(|(_, wider)| *wider > 1e-12) {
                gains.push((number, wider));
            }
        }
        Ok(gains)
    }

    /// The signal of a parameter when no relation reads it.
    fn is_only_direct(&self, parameter: Parameter) -> Option<SignalId> {
        let Parameter::Signal(signal) = parameter else { return None };
        let reads = |way: &&Way| way.direct().is_none() && way.inputs().any(|input| input == signal);
        self.ways.iter().find(reads).is_none().then_some(signal)
    }

    /// The errors that give every pair what it needs. Widening is counted relative to the least that any pair of a
    /// parameter needs: one that agrees well with somebody is not to blame for those that agree with nobody.
    fn solve(&self, demands: &[Demand]) -> Vec<f64> {
        let scale = |number: usize| {
            let gain =
                |demand: &Demand| demand.gains.iter().find(|(at, _)| *at == number).map(|(_, gain)| *gain);
            let own = || demands.iter().filter_map(|demand| Some((gain(demand)?, demand.least)));
            let largest = own().map(|(gain, _)| gain).fold(0.0, f64::max);
            let most = own().map(|(_, least)| least).fold(0.0, f64::max);
            let least = own().map(|(_, least)| least).fold(f64::INFINITY, f64::min).max(LEAST_OF_MOST * most);
            if largest > 0.0 && most > 0.0 { largest / least } else { 1.0 }
        };
        let scales: Vec<f64> = (0..self.parameters.len()).map(scale).collect();
        let asked: Vec<Demand> =
            demands.iter().filter(|it| it.least > 0.0 && !it.gains.is_empty()).cloned().collect();
        least_widening(&scales, &asked)
    }

    /// The errors with which no pair comes into conflict more often than wanted in what is fitted. What a pair gets of them depends on the moment,
    /// and what it needs is known for one width all the time only: a pair that comes into conflict all the same asks for
    /// more. Time: a run of the monitor over the earlier part for each round.
    fn silent_errors(&self, trial: &Trial, demands: &mut [Demand]) -> Result<Vec<f64>, Problem> {
        let least = self.least_errors(trial)?;
        let solve = |demands: &[Demand]| -> Vec<f64> {
            self.solve(demands).into_iter().zip(&least).map(|(error, least)| error.max(*least)).collect()
        };
        let mut errors = solve(demands);
        let span =
            self.early.first().zip(self.early.last()).map(|(first, last)| last.received - first.received);
        let accepted = self.options.false_alarms_per_hour * span.map_or(0.0, Span::seconds) / 3600.0;
        for _ in 0..MOST_ROUNDS {
            let is_asked = |number: usize| {
                let asks =
                    |demand: &Demand| demand.least > 0.0 && demand.gains.iter().any(|(at, _)| *at == number);
                demands.iter().any(asks)
            };
            let tried = |(number, error): (usize, &f64)| is_asked(number).then_some(*error);
            let tried = Trial { errors: errors.iter().enumerate().map(tried).collect(), ..trial.clone() };
            let watched = self.watch(&tried, self.early)?;
            let is_loud = |conflicts: &(usize, bool)| conflicts.0 as f64 > accepted;
            if !watched.conflicts.iter().any(is_loud) {
                break;
            }
            for (demand, _) in demands.iter_mut().zip(&watched.conflicts).filter(|(_, it)| is_loud(it)) {
                demand.least = MORE * demand.reached(&errors).max(demand.least);
            }
            errors = solve(demands);
        }
        Ok(errors)
    }

    fn fitted(
        &self,
        watched: &Watched,
        trial: &Trial,
        pairs: &[PairFit],
        demands: &[Demand],
        errors: &[f64],
        knowledge: &KnowledgeBase,
    ) -> Result<Vec<Fitted>, Problem> {
        let seen = self.smallest_biases(watched, trial, pairs, knowledge)?;
        let one = |(number, parameter): (usize, &Parameter)| {
            let uses = |at: &usize| {
                pairs[*at].needed > 0.0 && demands[*at].gains.iter().any(|(it, _)| *it == number)
            };
            let tightness = |at: &usize| demands[*at].reached(errors) / pairs[*at].needed;
            let asking = (0..pairs.len()).filter(uses);
            let asked_by = asking.min_by(|one, other| tightness(one).total_cmp(&tightness(other)));
            let (delay, time_error, seen) = match parameter {
                Parameter::Relation(_) => (Span::ZERO, Span::ZERO, None),
                Parameter::Signal(signal) => {
                    (trial.delays[*signal], trial.time_errors[*signal], seen[*signal])
                }
            };
            Fitted {
                parameter: *parameter,
                error: asked_by.map(|_| errors[number]),
                offset: trial.offsets[number],
                percent: trial.shares[number],
                time_error,
                delay,
                smallest_bias: seen.map(|it| it.bias),
                seen_by: seen.map(|it| it.by),
                lasting_bias: seen.and_then(|it| it.lasting),
                asked_by,
            }
        };
        let fitted: Vec<Fitted> = self.parameters.iter().enumerate().map(one).collect();
        let is_new = |signal: &SignalId| !self.parameters.contains(&Parameter::Signal(*signal));
        let others =
            knowledge.signals().ids().filter(is_new).filter_map(|signal| {
                Some(Fitted::only_seen(signal, trial.time_errors[signal], seen[signal]?))
            });
        let others: Vec<Fitted> = others.collect();
        Ok(fitted.into_iter().chain(others).collect())
    }
}

/// Of signals that no relation reads, a pair that compares one itself becomes wider by its own unit.
fn direct_gains(watched: &Watched, knowledge: &KnowledgeBase, signal: SignalId) -> Vec<f64> {
    let is_own = |way: &WatchedWay| way.computation.way().direct() == Some(signal);
    let gain = |pair| match watched.sides(pair) {
        (one, other) if is_own(one) || is_own(other) => edit::scale(knowledge, signal),
        _ => 0.0,
    };
    watched.monitor.pairs().iter().map(gain).collect()
}

/// How much later each signal tells than the model says: the median over the pairs that compare it itself. Of the two
/// of a pair, only the later one is moved.
fn signal_delays(
    knowledge: &KnowledgeBase,
    watched: &Watched,
    delays: &[Option<delay::Delay>],
) -> IdVec<SignalId, Span> {
    IdVec::filled(knowledge.signals().len(), |signal: SignalId| {
        let is_own = |way: &WatchedWay| way.computation.way().direct() == Some(signal);
        let late = |(pair, delay): (_, &Option<delay::Delay>)| {
            let late_s = delay.map_or(0.0, |delay| delay.late_s);
            let (slow, other) = watched.sides(pair);
            is_own(slow).then_some(late_s).or_else(|| is_own(other).then_some(-late_s))
        };
        let pairs = watched.monitor.pairs().iter().zip(delays);
        let late = median(pairs.filter_map(late)).max(0.0);
        // To the millisecond: no recording says more.
        Span::from_millis((late * 1e3).round() as i64)
    })
}

/// What a whole engine says.
fn verdicts(knowledge: &KnowledgeBase, observations: &[Observation]) -> Verdicts {
    let mut engine = Engine::new(knowledge.clone(), engine::Options::default());
    let mut verdicts = Verdicts::default();
    for observation in observations {
        engine.handle(Input::Observation(observation.clone()));
        while let Some(output) = engine.poll() {
            let Output::Event(event) = output else { continue };
            match event.kind {
                EventKind::Failed => verdicts.failed += 1,
                EventKind::Suspected => verdicts.suspected += 1,
                EventKind::Silent => verdicts.silent += 1,
                _ => {}
            }
        }
    }
    verdicts
}
