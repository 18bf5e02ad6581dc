//! Calibrates a model: finds errors with which the whole loop keeps its promise, and tests them on an unseen part.

mod found;
mod edit;
mod parts;
mod tail;
mod surrogate;
mod scales;
mod exact;
mod promise;
mod covering;
mod unhealthy;
mod smallest;
mod power;

pub use found::{Calibration, Fitted, PairFit, Parameter};
pub use power::{Open, Unfaulted};
pub use promise::{Promise, Verdicts};
pub use unhealthy::Stretch;

use crate::calibration::comparison::Watched;
use crate::calibration::delay::{self, Delay};
use crate::calibration::{rhythm::Rhythm, session::Session};
use crate::curve::Curve;
use crate::order::median;
use edit::Trial;
use found::pair_fit;
use scales::{Compared, Share};
use shsa_core::engine;
use shsa_core::knowledge::{Bounds, Draft, IdVec, KnowledgeBase, RelationId, SignalId};
use shsa_core::plan::Graph;
use shsa_core::substitution::Way;
use shsa_core::time::Span;
use smallest::smallest_steps;
use std::collections::BTreeSet;
use surrogate::Source;

/// An error that makes a relation say nothing.
const VACUOUS: f64 = 1e12;

/// The number of observations that is enough to find how an error widens a pair.
const PROBED: usize = 20_000;

/// The options of a calibration.
pub struct Options<'a> {
    /// Accepted alarms of the whole model an hour on healthy recordings, above 0.
    pub alarms_per_hour: f64,
    /// The longest delay that is searched for.
    pub most_delay: Span,
    /// Whether stretches that look unhealthy are fitted, too.
    pub fits_all: bool,
    /// Whether the smallest steps are found, too.
    pub finds_steps: bool,
    /// The most observations of surrogate recordings with which one factor is tried.
    pub most_observations: usize,
    /// The seed of random numbers.
    pub seed: u64,
    /// The number of threads that share the surrogate recordings.
    pub threads: usize,
    /// Called periodically, at least [`STEPS`] times.
    pub progress: &'a (dyn Fn() + Sync),
}

/// The least number of calls of [`Options::progress`].
pub const STEPS: usize = 10;

impl Default for Options<'_> {
    /// One alarm in two hours; delays up to 2 s.
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

/// Why a calibration is impossible.
#[derive(Clone, Debug, thiserror::Error)]
pub enum Problem {
    /// The model, or the fitted model, has an error.
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

/// Fits errors and delays to sessions, and tests them on other sessions.
///
/// The sessions must be healthy, the observations of each in the order of reception, and the draft free of errors. First come the
/// delays: for each pair the shift with the least spread, for each signal the median over its pairs. Then the deviations of
/// signals and relations. Then the one factor of these deviations with which the engine keeps the promise over surrogate
/// recordings, which are the sessions with their residuals drawn anew. Time: some dozen runs of the engine over
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

/// The common inputs of all steps.
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
        let compared = self.begin(&mut trial)?;
        (self.options.progress)();
        let delayed = edit::built(&trial.ungated(self.draft))?;
        let (parts, scales, gains) = exact::scaled(&self, &trial, &delayed, &compared)?;
        let between = self.between_sessions(&parts, &scales);
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
        // A relation that is not shown to hold must not influence the promise.
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
        let narrow = with(promise.factor);
        let chosen = covering::widened(&self.pairs, &narrow, &compared, &gains);
        let before = verdicts(self.draft, unseen)?;
        let mut draft = noisy(chosen.applied(&limited), promise.noise);
        let mut after = verdicts(&draft, unseen)?;
        if promise.noise.is_some() && after.alarms > before.alarms {
            // If the noise was different later, it is not declared, so that only bounds accuse; whether the bounds pass the test
            // is their own matter.
            promise.noise = None;
            draft = chosen.applied(&limited);
            after = verdicts(&draft, unseen)?;
        }
        self.count_unseen(&trial, unseen)?;
        power::tell_pairs(&mut self, &draft, &chosen, &gains)?;
        let before_fitted = verdicts(self.draft, self.sessions)?.alarms;
        let steps = smallest_steps(&self, &draft, &chosen)?;
        let fitted = (0..self.parameters.len())
            .map(|number| self.fitted(number, &narrow, &chosen, &shares, &scales, &steps))
            .collect();
        let unseen_hours = power::hours(unseen);
        let pairs = self.pairs.into_iter().filter(|pair| !pair.is_with_range()).collect();
        Ok(Calibration {
            rhythms,
            pairs,
            fitted,
            before_fitted: Unfaulted { alarms: before_fitted, hours: power::hours(self.sessions) },
            draft,
            promise,
            before,
            after,
            unseen_hours,
            unhealthy,
        })
    }

    /// Finds the delays and the pairs; returns the comparisons.
    fn begin(&mut self, trial: &mut Trial) -> Result<Compared, Problem> {
        let late = self.delays(trial)?;
        trial.delays = self.signal_delays(&late);
        let (pairs, compared) = self.watch(trial)?;
        self.pairs = pairs;
        for (pair, late) in self.pairs.iter_mut().zip(&late) {
            pair.late = late.map(|it| (it.late_s, it.left));
        }
        Ok(compared)
    }

    /// All pairs, and their comparisons in each session.
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

    /// The delay of each pair's slower way, from the longest session.
    fn delays(&self, trial: &Trial) -> Result<Vec<Option<Delay>>, Problem> {
        let knowledge = edit::built(&trial.ungated(self.draft))?;
        let longest = self.sessions.iter().flat_map(Session::stretches).max_by_key(|it| it.len());
        let watched = Watched::over(&knowledge, self.ways, longest.map(Vec::as_slice));
        let curves: Vec<Curve> = watched.outputs.iter().map(|outputs| delay::curve(outputs)).collect();
        let pairs = watched.monitor.residuals().iter().zip(&watched.comparisons);
        let late = pairs.map(|(pair, comparisons)| {
            let period = watched.sides(pair).0.computation.timing().period.unwrap_or(Span::ZERO);
            let most = self.options.most_delay.seconds().max(4.0 * period.seconds());
            delay::between(comparisons, &curves[pair.other.0 as usize], most)
        });
        Ok(late.collect())
    }

    /// The delay of each signal beyond that of the model: the median over the pairs that compare the signal itself. Of the two
    /// signals of a pair, only the later one is delayed.
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
            // Rounded to the millisecond: recordings are no more exact.
            Span::from_millis((late * 1e3).round() as i64)
        })
    }

    /// The widening of each pair by one unit of each parameter, found by trying: half a width, in SI.
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

    /// Counts the comparisons in the part that is not fitted.
    fn count_unseen(&mut self, trial: &Trial, unseen: &[Session]) -> Result<(), Problem> {
        let knowledge = edit::built(&trial.ungated(self.draft))?;
        let stretches = unseen.iter().flat_map(Session::stretches).map(Vec::as_slice);
        let watched = Watched::over(&knowledge, self.ways, stretches);
        for (pair, compared) in self.pairs.iter_mut().zip(&watched.comparisons) {
            pair.compared.1 = compared.len();
        }
        Ok(())
    }

    fn fitted(
        &self,
        number: usize,
        narrow: &Trial,
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
            singles: chosen.errors[number].unwrap_or(0.0) - narrow.errors[number].unwrap_or(0.0),
            noise,
            delay,
            smallest_bias,
        }
    }
}

/// The verdicts of a model about sessions.
fn verdicts(draft: &Draft, sessions: &[Session]) -> Result<Verdicts, Problem> {
    let stretches = sessions.iter().flat_map(Session::stretches).map(Vec::as_slice);
    Ok(Verdicts::over(&edit::built(draft)?, stretches))
}
