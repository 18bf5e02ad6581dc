//! A model calibrated: errors with which the whole loop keeps its promise on recordings that could have been, tested on a part
//! that it has not seen.

mod edit;
mod parts;
mod tail;
mod surrogate;
mod scales;
mod promise;
mod unhealthy;
mod smallest;

pub use promise::{Promise, Verdicts};
pub use unhealthy::Stretch;

use crate::calibration::comparison::Watched;
use crate::calibration::delay::{self, Curve, Delay};
use crate::calibration::order::{median, spread};
use crate::calibration::rhythm::Rhythm;
use crate::calibration::session::Session;
use edit::Trial;
use parts::Parts;
use scales::{Compared, Share};
use shsa_core::engine;
use shsa_core::knowledge::{Bounds, Draft, Id, IdVec, KnowledgeBase, RelationId, SignalId, VariableId};
use shsa_core::monitor::WatchedWay;
use shsa_core::plan::Graph;
use shsa_core::substitution::Way;
use shsa_core::time::Span;
use std::collections::BTreeSet;
use surrogate::Source;

/// Below this share of the largest reading, single precision tells nothing apart.
const RESOLUTION: f64 = f32::EPSILON as f64;

/// An error with which a relation says nothing.
const VACUOUS: f64 = 1e12;

/// So many observations are enough to find how an error widens a pair.
const PROBED: usize = 20_000;

/// What is asked for.
pub struct Options<'a> {
    /// Alarms of the whole model an hour that are accepted on healthy recordings, above 0.
    pub alarms_per_hour: f64,
    /// Delays up to this are searched for.
    pub most_delay: Span,
    /// Whether stretches that look unhealthy are fitted, too.
    pub fits_all: bool,
    /// Whether the smallest steps are found, too.
    pub finds_steps: bool,
    /// Observations of surrogate recordings that one factor is tried on at most.
    pub most_observations: usize,
    /// What random numbers begin with.
    pub seed: u64,
    /// Threads that surrogate recordings are dealt out to.
    pub threads: usize,
    /// Called now and then, [`STEPS`] times at least.
    pub progress: &'a (dyn Fn() + Sync),
}

/// How often [`Options::progress`] is called at least.
pub const STEPS: usize = 10;

impl Default for Options<'_> {
    /// One alarm in two hours; 2 s.
    fn default() -> Self {
        Options {
            alarms_per_hour: 0.5,
            most_delay: Span::from_millis(2_000),
            fits_all: false,
            finds_steps: true,
            most_observations: 800_000,
            seed: 1,
            threads: 1,
            progress: &|| {},
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
    /// The value error of a signal.
    Signal(SignalId),
    /// The error of a relation.
    Relation(RelationId),
}

impl Parameter {
    fn signal(self) -> Option<SignalId> {
        match self {
            Parameter::Signal(signal) => Some(signal),
            Parameter::Relation(_) => None,
        }
    }
}

/// A number of the model, fitted; all but the delay in the unit of the signal or of the relation's left side.
#[derive(Clone, Copy, Debug)]
pub struct Fitted {
    /// Which.
    pub parameter: Parameter,
    /// Plus-minus; `None` when nothing that holds shows it, and it stays as it is.
    pub error: Option<f64>,
    /// How much of the error is there all the time.
    pub offset: f64,
    /// One deviation, of which the error has as many as the model's factor: of values and of sessions.
    pub spread: f64,
    /// The standard deviation of the noise of a signal alone.
    pub noise: Option<f64>,
    /// How much later the signal tells than its model says; zero where that is not believed.
    pub delay: Span,
    /// The smallest step of the signal that is told, whichever way it points; `None` when none was, or none was looked for.
    pub smallest_bias: Option<f64>,
}

/// Two ways of knowing a variable, all values in SI.
#[derive(Clone, Debug)]
pub struct PairFit {
    /// What both know.
    pub variable: VariableId,
    /// The relations and the signals of the slower way, whose rhythm the comparisons have.
    pub one: (Vec<RelationId>, Vec<SignalId>),
    /// Those of the other.
    pub other: (Vec<RelationId>, Vec<SignalId>),
    /// Comparisons in what is fitted, and in what is not.
    pub compared: (usize, usize),
    /// The median of the first minus the second.
    pub offset: f64,
    /// The mean distance of their difference from its median.
    pub spread: f64,
    /// That as a share of how much the first itself varies, both as means over some comparisons.
    pub unexplained: f64,
    /// Whether the two are shown to tell the same: what does not hold is not fitted.
    pub holds: bool,
    /// By how much the first is later than the second, in seconds, and what share of the spread is left then; `None`
    /// when no delay explains a part of it.
    pub late: Option<(f64, f64)>,
    /// How much wider the fitted errors make them: half of both widths.
    pub given: f64,
}

impl PairFit {
    /// The signals, when both are compared themselves.
    fn direct(&self) -> Option<(SignalId, SignalId)> {
        let only = |(relations, signals): &(Vec<RelationId>, Vec<SignalId>)| match signals.as_slice() {
            [signal] if relations.is_empty() => Some(*signal),
            _ => None,
        };
        only(&self.one).zip(only(&self.other))
    }
}

/// A model calibrated.
#[derive(Clone, Debug)]
pub struct Calibration {
    /// How each signal comes, in what is fitted.
    pub rhythms: Vec<Rhythm>,
    /// Every pair that the engine compares.
    pub pairs: Vec<PairFit>,
    /// Every number that could be fitted.
    pub fitted: Vec<Fitted>,
    /// The model with the fitted numbers.
    pub draft: Draft,
    /// What stands behind them.
    pub promise: Promise,
    /// What is said about the part that is not fitted with the model as it was,
    pub before: Verdicts,
    /// and with the fitted one.
    pub after: Verdicts,
    /// How long that part is, in hours.
    pub unseen_hours: f64,
    /// Stretches that look like faults and were not fitted.
    pub unhealthy: Vec<Stretch>,
}

impl Calibration {
    /// Why the fitted numbers must not be used; `None` when nothing speaks against them.
    #[must_use]
    pub fn refusal(&self) -> Option<String> {
        let (before, after) = (self.before, self.after);
        if after.failed > before.failed {
            return Some(format!(
                "in the part that it has not seen, the fitted model calls {} healthy signals failed, and the model as it is {}",
                after.failed, before.failed
            ));
        }
        let least = fewest_expected(after.alarms) / self.unseen_hours.max(1e-9);
        if after.alarms > before.alarms && least > self.promise.alarms_per_hour {
            return Some(format!(
                "in the part that it has not seen, the fitted model gives {} alarms in {:.2} h, and the model as it is {}: more than \
                 the promised {} an hour can be",
                after.alarms, self.unseen_hours, before.alarms, self.promise.alarms_per_hour
            ));
        }
        (after.suspected > before.suspected).then(|| {
            format!(
                "in the part that it has not seen, the fitted model suspects {} healthy signals, and the model as it is {}",
                after.suspected, before.suspected
            )
        })
    }
}

/// How many are expected at least where so many were seen, with 95 % confidence: half the 5 % quantile of the chi-square
/// distribution with twice as many degrees of freedom (F. Garwood 1936, doi:10.1093/biomet/28.3-4.437).
#[must_use]
pub fn fewest_expected(seen: usize) -> f64 {
    bisected(seen as f64, |expected| 1.0 - fewer_than(seen, expected) < 0.05)
}

/// How many are expected at most where so many were seen, with 95 % confidence: 3.00 for none, 4.74 for one.
#[must_use]
pub fn most_expected(seen: usize) -> f64 {
    bisected(seen as f64 + 10.0 + 6.0 * (seen as f64).sqrt(), |expected| {
        fewer_than(seen + 1, expected) > 0.05
    })
}

/// The probability of fewer than so many where these are expected.
fn fewer_than(count: usize, expected: f64) -> f64 {
    let mut term = (-expected).exp();
    let mut sum = 0.0;
    for number in 0..count {
        sum += term;
        term *= expected / (number + 1) as f64;
    }
    sum
}

/// The highest up to `most` for which a number is below.
fn bisected(most: f64, is_below: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (0.0, most);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        *(if is_below(middle) { &mut low } else { &mut high }) = middle;
    }
    high
}

/// Fits errors and delays to sessions, and tests them on others.
///
/// Sessions are healthy, the observations of each in the order of reception, and the draft builds without errors. Delays come
/// first: of each pair the shift with the least spread, of each signal the median over its pairs. Then how far signals and
/// relations scatter; then the one factor of these deviations with which the engine keeps the promise over surrogate
/// recordings: the sessions with what is left of their values drawn anew. Time: some dozen runs of the engine over
/// [`Options::most_observations`].
///
/// # Errors
/// When there is nothing to compare.
pub fn calibrate(
    draft: &Draft,
    fitted: &[Session],
    unseen: &[Session],
    options: &Options<'_>,
) -> Result<Calibration, Problem> {
    let knowledge = edit::built(draft)?;
    let ways = engine::to_watch(&knowledge, &Graph::new(&knowledge), engine::WatchBudget::default());
    let fit = Fit::new(draft, &knowledge, &ways, fitted, options);
    let trial = Trial::new(&fit.parameters, &knowledge);
    let (pairs, compared) = fit.watch(&trial)?;
    match compared.iter().flatten().map(Vec::len).sum::<usize>() {
        _ if pairs.is_empty() => return Err(Problem::NoPairs),
        0 => return Err(Problem::NotObserved { pairs: pairs.len() }),
        _ => {}
    }
    let odd = |session| unhealthy::unhealthy(&pairs, &compared, session);
    let unhealthy: Vec<Stretch> =
        if options.fits_all { Vec::new() } else { (0..fitted.len()).flat_map(odd).collect() };
    let healthy = |(number, session): (usize, &Session)| {
        let own = unhealthy.iter().filter(|it| it.session == number);
        session.without(&own.map(|it| (it.from, it.to)).collect::<Vec<_>>())
    };
    let healthy: Vec<Session> = fitted.iter().enumerate().map(healthy).collect();
    Fit::new(draft, &knowledge, &ways, &healthy, options).calibration(trial, unseen, unhealthy)
}

/// What all steps need.
struct Fit<'a> {
    draft: &'a Draft,
    knowledge: &'a KnowledgeBase,
    ways: &'a [Way],
    sessions: &'a [Session],
    options: &'a Options<'a>,
    parameters: Vec<Parameter>,
    pairs: Vec<PairFit>,
}

/// The signals that ways read, then the relations that they use.
fn parameters(knowledge: &KnowledgeBase, ways: &[Way]) -> Vec<Parameter> {
    let signals = ways.iter().flat_map(Way::inputs).map(Parameter::Signal);
    let has_formula = |relation: &RelationId| !knowledge.relations()[*relation].formulas.is_empty();
    let relations = ways.iter().flat_map(|way| way.substitution.relations()).filter(has_formula);
    let all: BTreeSet<Parameter> = signals.chain(relations.map(Parameter::Relation)).collect();
    all.into_iter().collect()
}

impl<'a> Fit<'a> {
    fn new(
        draft: &'a Draft,
        knowledge: &'a KnowledgeBase,
        ways: &'a [Way],
        sessions: &'a [Session],
        options: &'a Options<'a>,
    ) -> Fit<'a> {
        let parameters = parameters(knowledge, ways);
        Fit { draft, knowledge, ways, sessions, options, parameters, pairs: Vec::new() }
    }

    fn calibration(
        mut self,
        mut trial: Trial,
        unseen: &[Session],
        unhealthy: Vec<Stretch>,
    ) -> Result<Calibration, Problem> {
        let late = self.delays(&trial)?;
        trial.delays = self.signal_delays(&late);
        let (pairs, compared) = self.watch(&trial)?;
        self.pairs = pairs;
        for (pair, late) in self.pairs.iter_mut().zip(&late) {
            pair.late = late.map(|it| (it.late_s, it.left));
        }
        (self.options.progress)();
        let delayed = edit::built(&trial.ungated(self.draft))?;
        let parts = Parts::of(&delayed, self.sessions);
        let scales = self.scales(&parts, &compared);
        let between = self.between_sessions(&parts, &scales);
        let gains = self.gains(&trial, &|signal| scales[signal].deviation)?;
        let shares = self.shares(&parts, &scales, between, &compared, &gains);
        let rhythms = Rhythm::of_all(self.knowledge, self.sessions);
        let limited = edit::limited(self.draft, &rhythms, self.knowledge);
        let floors = self.floors(&rhythms);
        let with = |factor: f64| {
            let error = |(share, floor): (&Option<Share>, &f64)| {
                share.map(|it| (it.offset + factor * it.spread).max(*floor))
            };
            Trial { errors: shares.iter().zip(&floors).map(error).collect(), ..trial.clone() }
        };
        let apart = IdVec::filled(self.knowledge.signals().len(), |signal: SignalId| {
            let number = self.parameters.iter().position(|it| *it == Parameter::Signal(signal))?;
            shares[number]?;
            Some(between * scales[signal].deviation)
        });
        let source = Source::new(&delayed, &parts, apart);
        // What is not shown to hold says nothing about the promise, however it is.
        let watched = |factor: f64| {
            let trial = with(factor);
            let errors = trial.errors.iter().zip(&self.parameters).map(|(error, parameter)| {
                let is_relation = matches!(parameter, Parameter::Relation(_));
                error.or(is_relation.then_some(VACUOUS))
            });
            Trial { errors: errors.collect(), ..trial.clone() }
        };
        let noisy = |draft: Draft, noise: Option<f64>| {
            let deviation = |number: usize| {
                shares[number]?;
                Some(noise? * scales[self.parameters[number].signal()?].deviation)
            };
            edit::with_noise(draft, &self.parameters, deviation)
        };
        let tried = |factor: f64, noise: Option<f64>| noisy(watched(factor).applied(&limited), noise);
        let mut promise = self.promise(&source, between, &tried)?;
        let chosen = with(promise.factor);
        let before = told(self.draft, unseen)?;
        let mut draft = noisy(chosen.applied(&limited), promise.noise);
        let mut after = told(&draft, unseen)?;
        if promise.noise.is_some() && after.alarms > before.alarms {
            // Noise that was another one later is none that accuses; the bounds stand the test by themselves, or do not.
            promise.noise = None;
            draft = chosen.applied(&limited);
            after = told(&draft, unseen)?;
        }
        for (pair, gains) in self.pairs.iter_mut().zip(&gains) {
            let given = gains.iter().filter_map(|(at, gain)| Some(gain * chosen.errors[*at]?));
            pair.given = given.sum();
        }
        self.count_unseen(&trial, unseen)?;
        let steps = self.steps(&draft, &chosen)?;
        let fitted = (0..self.parameters.len())
            .map(|number| self.fitted(number, &chosen, &shares, &scales, &steps))
            .collect();
        let unseen_hours = unseen.iter().map(|it| it.duration().seconds()).sum::<f64>() / 3600.0;
        let pairs = self.pairs;
        Ok(Calibration { rhythms, pairs, fitted, draft, promise, before, after, unseen_hours, unhealthy })
    }

    /// All pairs, and what they compare in each session.
    fn watch(&self, trial: &Trial) -> Result<(Vec<PairFit>, Compared), Problem> {
        let knowledge = edit::built(&trial.ungated(self.draft))?;
        let over = |session: &Session| {
            Watched::over(&knowledge, self.ways, session.stretches().iter().map(Vec::as_slice))
        };
        let watched: Vec<Watched> = self.sessions.iter().map(over).collect();
        let Some(first) = watched.first() else { return Ok((Vec::new(), Vec::new())) };
        let of = |at: usize| -> Vec<_> { watched.iter().map(|it| it.comparisons[at].clone()).collect() };
        let compared: Compared = (0..first.monitor.residuals().len()).map(of).collect();
        let pairs = first.monitor.residuals().iter().zip(&compared).map(|(pair, compared)| {
            let (one, other) = first.sides(pair);
            pair_fit(one, other, compared)
        });
        Ok((pairs.collect(), compared))
    }

    /// How much later the slower way of each pair is: in the longest session.
    fn delays(&self, trial: &Trial) -> Result<Vec<Option<Delay>>, Problem> {
        let knowledge = edit::built(&trial.ungated(self.draft))?;
        let longest = self.sessions.iter().flat_map(Session::stretches).max_by_key(|it| it.len());
        let watched = Watched::over(&knowledge, self.ways, longest.map(Vec::as_slice));
        let curves: Vec<Curve> = watched.outputs.iter().map(|outputs| Curve::new(outputs)).collect();
        let pairs = watched.monitor.residuals().iter().zip(&watched.comparisons);
        let late = pairs.map(|(pair, comparisons)| {
            let period = watched.sides(pair).0.computation.timing().period.unwrap_or(Span::ZERO);
            let most = self.options.most_delay.seconds().max(4.0 * period.seconds());
            delay::between(comparisons, &curves[pair.other.0 as usize], most)
        });
        Ok(late.collect())
    }

    /// How much later each signal tells than the model says: the median over the pairs that compare it itself. Of the two
    /// of a pair, only the later one is moved.
    fn signal_delays(&self, delays: &[Option<Delay>]) -> IdVec<SignalId, Span> {
        let Ok((pairs, _)) = self.watch(&Trial::new(&self.parameters, self.knowledge)) else {
            return IdVec::filled(self.knowledge.signals().len(), |_| Span::ZERO);
        };
        IdVec::filled(self.knowledge.signals().len(), |signal: SignalId| {
            let is_own = |side: &(Vec<RelationId>, Vec<SignalId>)| side.0.is_empty() && side.1 == [signal];
            let late = |(pair, delay): (&PairFit, &Option<Delay>)| {
                let late_s = delay.map_or(0.0, |delay| delay.late_s);
                is_own(&pair.one).then_some(late_s).or_else(|| is_own(&pair.other).then_some(-late_s))
            };
            let late = median(pairs.iter().zip(delays).filter_map(late)).max(0.0);
            // To the millisecond: no recording says more.
            Span::from_millis((late * 1e3).round() as i64)
        })
    }

    /// How much wider each pair becomes for one unit of each parameter, by trying: half a width, in SI.
    fn gains(
        &self,
        trial: &Trial,
        deviation: &dyn Fn(SignalId) -> f64,
    ) -> Result<Vec<Vec<(usize, f64)>>, Problem> {
        let longest = self.sessions.iter().flat_map(Session::stretches).max_by_key(|it| it.len());
        let all = longest.map_or(&[][..], Vec::as_slice);
        let some = &all[..all.len().min(PROBED)];
        let widths = |trial: &Trial| -> Result<Vec<f64>, Problem> {
            let knowledge = edit::built(&trial.ungated(self.draft))?;
            let watched = Watched::over(&knowledge, self.ways, [some]);
            Ok(watched.comparisons.iter().map(|all| median(all.iter().map(|it| it.width))).collect())
        };
        let narrow = widths(trial)?;
        let mut gains = vec![Vec::new(); narrow.len()];
        for (number, parameter) in self.parameters.iter().enumerate() {
            let probe = match parameter {
                Parameter::Signal(signal) => edit::rounded_up(deviation(*signal).max(1e-9)),
                Parameter::Relation(_) => 1e-3,
            };
            let mut tried = trial.clone();
            tried.errors[number] = Some(probe);
            let wide = widths(&tried)?;
            for (gains, (wide, narrow)) in gains.iter_mut().zip(wide.iter().zip(&narrow)) {
                let gain = 0.5 * (wide - narrow) / probe;
                if gain > 1e-12 {
                    gains.push((number, gain));
                }
            }
        }
        Ok(gains)
    }

    /// The least error of each parameter: what single precision tells apart.
    fn floors(&self, rhythms: &[Rhythm]) -> Vec<f64> {
        let floor = |parameter: &Parameter| match parameter {
            Parameter::Relation(_) => 0.0,
            Parameter::Signal(signal) => {
                let range = rhythms.get(signal.index()).and_then(|it| it.range).unwrap_or_default();
                RESOLUTION * range.0.abs().max(range.1.abs())
            }
        };
        self.parameters.iter().map(floor).collect()
    }

    /// Counts the comparisons in what is not fitted.
    fn count_unseen(&mut self, trial: &Trial, unseen: &[Session]) -> Result<(), Problem> {
        let knowledge = edit::built(&trial.ungated(self.draft))?;
        let stretches = unseen.iter().flat_map(Session::stretches).map(Vec::as_slice);
        let watched = Watched::over(&knowledge, self.ways, stretches);
        for (pair, compared) in self.pairs.iter_mut().zip(&watched.comparisons) {
            pair.compared.1 = compared.len();
        }
        Ok(())
    }

    fn steps(&self, draft: &Draft, chosen: &Trial) -> Result<IdVec<SignalId, Option<f64>>, Problem> {
        let count = self.knowledge.signals().len();
        if !self.options.finds_steps {
            return Ok(IdVec::filled(count, |_| None));
        }
        let first = IdVec::filled(count, |signal: SignalId| {
            let number = self.parameters.iter().position(|it| *it == Parameter::Signal(signal));
            number.and_then(|at| chosen.errors[at]).unwrap_or(1.0)
        });
        self.smallest_steps(draft, self.sessions, &first)
    }

    fn fitted(
        &self,
        number: usize,
        chosen: &Trial,
        shares: &[Option<Share>],
        scales: &IdVec<SignalId, scales::Scale>,
        steps: &IdVec<SignalId, Option<f64>>,
    ) -> Fitted {
        let parameter = self.parameters[number];
        let share = shares[number].unwrap_or_default();
        let (noise, delay, smallest_bias) = match parameter {
            Parameter::Relation(_) => (None, Span::ZERO, None),
            Parameter::Signal(signal) => {
                (Some(scales[signal].deviation), chosen.delays[signal], steps[signal])
            }
        };
        Fitted {
            parameter,
            error: chosen.errors[number].map(edit::rounded_up),
            offset: share.offset,
            spread: share.spread,
            noise,
            delay,
            smallest_bias,
        }
    }
}

/// What a model says of sessions.
fn told(draft: &Draft, sessions: &[Session]) -> Result<Verdicts, Problem> {
    let stretches = sessions.iter().flat_map(Session::stretches).map(Vec::as_slice);
    Ok(Verdicts::over(&edit::built(draft)?, stretches))
}

/// What one pair is, and how it differs.
fn pair_fit(
    one: &WatchedWay,
    other: &WatchedWay,
    compared: &[Vec<crate::calibration::comparison::Comparison>],
) -> PairFit {
    let side = |way: &WatchedWay| {
        let way = way.computation.way();
        (way.substitution.relations(), way.inputs().collect::<Vec<SignalId>>())
    };
    let apart: Vec<f64> = compared.iter().flatten().map(|it| it.value - it.known).collect();
    let unexplained = scales::unexplained(compared);
    let (one_side, other_side) = (side(one), side(other));
    let is_direct = one_side.0.is_empty() && other_side.0.is_empty();
    PairFit {
        variable: one.variable(),
        one: one_side,
        other: other_side,
        compared: (apart.len(), 0),
        offset: median(apart.iter().copied()),
        spread: spread(&apart),
        unexplained,
        holds: is_direct || unexplained <= scales::UNEXPLAINED,
        late: None,
        given: 0.0,
    }
}
