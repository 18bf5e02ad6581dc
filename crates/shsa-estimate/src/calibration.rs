//! A model calibrated: what its pairs need, the errors that explain it, and how that fares with what came later.

mod edit;
mod pair;

pub use pair::PairFit;

use crate::comparison::Watched;
use crate::delay::{self, Curve};
use crate::order::{median, quantile, sorted};
use crate::rhythm::Rhythm;
use crate::widening::{Demand, least_widening};
use edit::Trial;
use shsa_core::engine::{self, Engine, EventKind, Input, Output};
use shsa_core::knowledge::{Bounds, Draft, IdVec, KnowledgeBase, RelationId, SignalId, VariableId};
use shsa_core::monitor::WatchedWay;
use shsa_core::observation::Observation;
use shsa_core::plan::Graph;
use shsa_core::substitution::Way;
use shsa_core::time::{Span, Time};
use std::collections::BTreeSet;

/// Offsets are taken out of the signals of a variable when that leaves no more than this share of what its pairs need.
const OFFSETS_WORTH: f64 = 0.8;

/// What a pair needs at least when its parameters are weighed: a share of what the largest pair of the same needs.
const LEAST_OF_MOST: f64 = 0.05;

/// Rounds in which signals vote about each other's offsets; a few dozen are enough for any dozen of witnesses.
const ROUNDS: usize = 100;

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
}

impl Default for Options {
    /// One false conflict an hour, 95 %, 2 s.
    fn default() -> Options {
        Options {
            false_alarms_per_hour: 1.0,
            confidence: 0.95,
            most_delay: Span::from_millis(2_000),
            left_out: Vec::new(),
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
    /// How much more the signal shows than the others do, in its unit; 0 where that is not worth taking out.
    pub offset: f64,
    /// How much later the signal tells than its model says; zero where that is not believed.
    pub delay: Span,
    /// The smallest constant bias of the signal that brings it into conflict with another way in 95 % of the later
    /// comparisons, in its unit; `None` when nothing is compared with it alone.
    pub smallest_bias: Option<f64>,
    /// The pair that sees it.
    pub seen_by: Option<usize>,
    /// The pair that asks for the most.
    pub asked_by: Option<usize>,
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
    /// Every number that is fitted.
    pub fitted: Vec<Fitted>,
    /// The model with the fitted numbers.
    pub draft: Draft,
    /// What is said about the later observations with the model as it was.
    pub before: Verdicts,
    /// And with the fitted one.
    pub after: Verdicts,
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
    let is_left_out = |it: &Observation| {
        options.left_out.iter().any(|(from, to)| *from <= it.received && it.received < *to)
    };
    let observations: Vec<Observation> = observations.iter().filter(|it| !is_left_out(it)).cloned().collect();
    let observations = observations.as_slice();
    let (early, late) = observations.split_at(observations.partition_point(|it| it.received < split));
    let knowledge = edit::built(draft)?;
    let graph = Graph::new(&knowledge);
    let ways = engine::to_watch(&knowledge, &graph, engine::WatchBudget::default());
    let mut work =
        Work { draft, observations, early, split, options, parameters: parameters(&knowledge, &ways), ways };
    let mut trial = Trial::new(&work.parameters, &knowledge);
    let plain = work.watch(&trial, observations)?;
    let count = plain.comparisons.len();
    match plain.comparisons.iter().map(|all| work.before_split(all).len()).sum::<usize>() {
        _ if count == 0 => return Err(Problem::NoPairs),
        0 => return Err(Problem::NotObserved { pairs: count }),
        _ => {}
    }
    let pair_delays = work.delays(&plain);
    trial.delays = signal_delays(&knowledge, &plain, &pair_delays);
    let delayed = if trial.delays.iter().any(|delay| *delay > Span::ZERO) {
        work.watch(&trial, observations)?
    } else {
        plain
    };
    let (trial, watched) = work.without_offsets(&knowledge, trial, delayed)?;
    let gains = work.gains(&trial, &knowledge)?;
    let mut pairs: Vec<PairFit> =
        (0..count).map(|at| PairFit::new(&work, &watched, at, pair_delays[at])).collect();
    let demand =
        |(pair, gains): (&PairFit, &Vec<(usize, f64)>)| Demand { gains: gains.clone(), least: pair.needed };
    let demands: Vec<Demand> = pairs.iter().zip(&gains).map(demand).collect();
    let errors = work.solve(&demands);
    for (at, pair) in pairs.iter_mut().enumerate() {
        pair.test(&work, &watched.comparisons[at], demands[at].reached(&errors));
    }
    let fitted = work.fitted(&watched, &trial, &pairs, &demands, &errors, &knowledge);
    let rhythms = Rhythm::of_all(&knowledge, observations, &options.left_out);
    let draft = edit::patched(draft, &fitted, &rhythms, &knowledge);
    work.draft = &draft;
    let after = verdicts(&edit::built(&draft)?, late);
    let before = verdicts(&knowledge, late);
    Ok(Calibration { rhythms, pairs, fitted, before, after, draft })
}

/// What all steps need.
struct Work<'a> {
    draft: &'a Draft,
    observations: &'a [Observation],
    /// Those before the split.
    early: &'a [Observation],
    split: Time,
    options: &'a Options,
    ways: Vec<Way>,
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

impl Work<'_> {
    fn watch(&self, trial: &Trial, observations: &[Observation]) -> Result<Watched, Problem> {
        let knowledge = edit::built(&trial.applied(self.draft))?;
        Ok(Watched::over(&knowledge, &self.ways, observations))
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

    /// Takes out what the signals of a variable differ by all the time, where it is worth it.
    fn without_offsets(
        &self,
        knowledge: &KnowledgeBase,
        trial: Trial,
        watched: Watched,
    ) -> Result<(Trial, Watched), Problem> {
        let needed = |watched: &Watched| -> Vec<f64> {
            (0..watched.comparisons.len()).map(|at| PairFit::new(self, watched, at, None).needed).collect()
        };
        let offsets = offsets(self, knowledge, &watched);
        let mut moved = Trial { offsets: offsets.clone(), ..trial.clone() };
        let other = self.watch(&moved, self.observations)?;
        let (with, without) = (needed(&watched), needed(&other));
        let variables = watched.monitor.pairs().iter().map(|pair| watched.sides(pair).0.variable());
        let variables: Vec<VariableId> = variables.collect();
        let sum = |of: &[f64], variable: VariableId| -> f64 {
            of.iter()
                .zip(&variables)
                .filter(|(_, own)| **own == variable)
                .map(|(needed, _)| needed.max(0.0))
                .sum()
        };
        for way in watched.monitor.ways() {
            let Some(signal) = way.computation.way().direct() else { continue };
            let variable = way.variable();
            if sum(&without, variable) > OFFSETS_WORTH * sum(&with, variable) {
                moved.offsets[signal] = 0.0;
            }
        }
        if moved.offsets.iter().all(|offset| *offset == 0.0) {
            return Ok((trial, watched));
        }
        let watched = self.watch(&moved, self.observations)?;
        Ok((moved, watched))
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

    fn fitted(
        &self,
        watched: &Watched,
        trial: &Trial,
        pairs: &[PairFit],
        demands: &[Demand],
        errors: &[f64],
        knowledge: &KnowledgeBase,
    ) -> Vec<Fitted> {
        let one = |(number, parameter): (usize, &Parameter)| {
            let uses = |at: &usize| {
                pairs[*at].needed > 0.0 && demands[*at].gains.iter().any(|(it, _)| *it == number)
            };
            let tightness = |at: &usize| demands[*at].reached(errors) / pairs[*at].needed;
            let asking = (0..pairs.len()).filter(uses);
            let asked_by = asking.min_by(|one, other| tightness(one).total_cmp(&tightness(other)));
            let (offset, delay, seen) = match parameter {
                Parameter::Relation(_) => (0.0, Span::ZERO, None),
                Parameter::Signal(signal) => {
                    let seen = self.smallest_bias(watched, *signal, pairs);
                    let scale = edit::scale(knowledge, *signal);
                    (trial.offsets[*signal], trial.delays[*signal], seen.map(|(bias, by)| (bias / scale, by)))
                }
            };
            Fitted {
                parameter: *parameter,
                error: asked_by.map(|_| errors[number]),
                offset,
                delay,
                smallest_bias: seen.map(|(bias, _)| bias),
                seen_by: seen.map(|(_, by)| by),
                asked_by,
            }
        };
        self.parameters.iter().enumerate().map(one).collect()
    }

    /// The smallest bias, SI, and the pair that sees it: the signal against ways that do not rest on it.
    fn smallest_bias(&self, watched: &Watched, signal: SignalId, pairs: &[PairFit]) -> Option<(f64, usize)> {
        let is_own = |way: &WatchedWay| way.computation.way().direct() == Some(signal);
        let compares = |at: &usize| {
            let (one, other) = watched.sides(&watched.monitor.pairs()[*at]);
            let sees = |own, by: &WatchedWay| is_own(own) && !by.rests_on.contains(signal);
            sees(one, other) || sees(other, one)
        };
        let seen = (0..pairs.len()).filter(compares).filter_map(|at| Some((pairs[at].smallest_bias?, at)));
        seen.min_by(|one, other| one.0.total_cmp(&other.0))
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

/// By how much each signal lies above the mean of those that carry the same variable, in its own unit: least squares
/// over the medians of their pairs.
fn offsets(work: &Work<'_>, knowledge: &KnowledgeBase, watched: &Watched) -> IdVec<SignalId, f64> {
    let direct = |way: &WatchedWay| way.computation.way().direct();
    let pairs = watched.monitor.pairs().iter().zip(&watched.comparisons);
    let known: Vec<(SignalId, SignalId, f64)> = pairs
        .filter_map(|(pair, comparisons)| {
            let (slow, other) = watched.sides(pair);
            let early = work.before_split(comparisons);
            let difference = median(early.iter().map(|it| it.value - it.known));
            (!early.is_empty()).then_some((direct(slow)?, direct(other)?, difference))
        })
        .collect();
    let mut offsets = IdVec::filled(knowledge.signals().len(), |_: SignalId| 0.0);
    // All at once (Jacobi), with the present value as one more vote: the sum of each group stays 0.
    for _ in 0..ROUNDS {
        offsets = IdVec::filled(offsets.len(), |signal: SignalId| {
            let by_others = known.iter().filter_map(|&(one, other, difference)| match signal {
                _ if one == signal => Some(offsets[other] + difference),
                _ if other == signal => Some(offsets[one] - difference),
                _ => None,
            });
            let (sum, count) = by_others.fold((offsets[signal], 1), |(sum, count), it| (sum + it, count + 1));
            sum / f64::from(count)
        });
    }
    IdVec::filled(offsets.len(), |signal: SignalId| offsets[signal] / edit::scale(knowledge, signal))
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
