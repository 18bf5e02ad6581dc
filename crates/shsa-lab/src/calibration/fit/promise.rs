//! The one factor of a model, found by running the engine over surrogate recordings.

use super::surrogate::Source;
use super::{Fit, Problem};
use crate::calibration::chance::Chance;
use crate::campaign::parallel::side_by_side;
use shsa_core::engine::{self, Engine, EventKind, Input, Output, Ticks};
use shsa_core::knowledge::{Draft, KnowledgeBase};
use shsa_core::observation::Observation;
use shsa_core::time::Time;

/// The search range of the factor, and the number of bisection steps.
const FACTORS: (f64, f64) = (0.8, 12.0);
const STEPS: usize = 8;
/// This many alarms in all surrogate hours are few.
const FEW: usize = 3;
/// Alarms beyond this number are not counted, but extrapolated.
const MANY: usize = 300;
/// The surrogate time, in promised alarms.
const ALARMS: f64 = 10.0;
/// Calibrations on other hours differ, so the search aims at the promised rate divided by this.
const RESERVE: f64 = 5.0;
/// A sound signal that fails is worse than a suspected one: at most one failure in this many promised alarms.
const FAILED: f64 = 50_000.0;
/// The limits of the relative growth of the factor for e times fewer alarms.
const SLOPES: (f64, f64) = (0.06, 0.18);
/// The declared noise is the found noise times one of these, if that adds no alarm in these series of surrogate sessions.
const NOISES: [f64; 7] = [1.0, 1.4, 2.0, 2.8, 4.0, 5.6, 8.0];
/// A margin on the sufficient multiple, because other hours differ. The second one is for recordings without a long stretch,
/// where the detectors of noise and drift have not seen the events of hours.
const MARGIN: f64 = 1.4;
const MARGIN_OF_SHORT: f64 = 2.0;
/// The duration in seconds from which on a stretch is long.
const LONG_S: f64 = 1_200.0;
const NOISE_SERIES: [u64; 4] = [100, 101, 102, 103];
/// The largest extrapolation of a factor beyond one that was tried.
const FURTHEST: f64 = 1.85;
/// This many pairs double the cost of an observation.
const PAIRS: f64 = 10.0;
/// While new surrogate hours have more than one alarm, the factor is multiplied by this,
const GROWS: f64 = 1.05;
/// at most this many times.
const ROUNDS: usize = 6;

/// The verdicts of an engine about observations that should all be healthy.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Verdicts {
    /// Signals that failed: false alarms.
    pub failed: usize,
    /// Signals suspected.
    pub suspected: usize,
    /// Signals that became silent.
    pub silent: usize,
    /// Moments at which a signal became suspected or failed.
    pub alarms: usize,
}

impl Verdicts {
    /// Runs one engine for each stretch; ticks come when they are due.
    #[must_use]
    pub fn over<'o>(
        knowledge: &KnowledgeBase,
        stretches: impl IntoIterator<Item = &'o [Observation]>,
    ) -> Verdicts {
        let mut verdicts = Verdicts::default();
        for stretch in stretches {
            verdicts.go_on(knowledge, stretch);
        }
        verdicts
    }

    fn go_on(&mut self, knowledge: &KnowledgeBase, observations: &[Observation]) {
        let mut engine = shsa_estimate::node::engine(knowledge.clone(), engine::Options::default());
        let mut last = None;
        for observation in observations {
            engine.pass(Ticks::before(observation.received));
            engine.handle(Input::Observation(observation.clone()));
            self.take(&mut engine, &mut last);
        }
        if let Some(observation) = observations.last() {
            engine.handle(Input::Tick(observation.received));
            self.take(&mut engine, &mut last);
        }
    }

    fn take(&mut self, engine: &mut Engine, last: &mut Option<Time>) {
        while let Some(output) = engine.poll() {
            let Output::Event(event) = output else { continue };
            match event.kind {
                EventKind::Failed => self.failed += 1,
                EventKind::Suspected => self.suspected += 1,
                EventKind::Silent => self.silent += 1,
                _ => {}
            }
            let is_alarm = matches!(event.kind, EventKind::Failed | EventKind::Suspected);
            if is_alarm && last.replace(event.time) != Some(event.time) {
                self.alarms += 1;
            }
        }
    }
}

/// The promise behind the numbers of a calibrated model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Promise {
    /// The largest rate of alarms, an hour.
    pub alarms_per_hour: f64,
    /// The factor: every error is this many deviations wide.
    pub factor: f64,
    /// The declared noise of signals as a multiple of the found noise; `None` if declaring noise would cost alarms, so that only
    /// bounds accuse.
    pub noise: Option<f64>,
    /// Surrogate hours with the final numbers, which the search has not seen.
    pub hours: f64,
    /// Alarms in these hours.
    pub alarms: usize,
    /// The deviation between sessions, in standard deviations of a signal.
    pub between: f64,
    /// Whether it was measured; with one session, it is assumed.
    pub is_measured: bool,
    /// Alarms an hour that remain however wide the errors are, such as of values that change too fast; 0 for none.
    pub remaining_per_hour: f64,
    /// The extrapolation of the factor beyond the surrogate hours: the ratio between the lowest measured rate and the rate aimed
    /// at.
    pub extrapolated: f64,
}

/// Surrogate recordings, each with its seed.
struct Trials<'a, 'b> {
    fit: &'a Fit<'a>,
    source: &'a Source<'b>,
    draft: &'a (dyn Fn(f64, Option<f64>) -> Draft + Sync),
    sessions: usize,
    hours: f64,
}

/// The result of a factor.
#[derive(Clone, Copy, Debug)]
struct Tried {
    factor: f64,
    alarms: f64,
    failed: f64,
}

impl Fit<'_> {
    /// The factor that keeps the promise. `draft` gives the model with a factor, and with noise declared as a multiple of the
    /// found noise.
    pub(super) fn promise(
        &self,
        source: &Source<'_>,
        between: f64,
        draft: &(dyn Fn(f64, Option<f64>) -> Draft + Sync),
    ) -> Result<Promise, Problem> {
        let trials = Trials::new(self, source, draft);
        let wanted = self.options.alarms_per_hour;
        let mut tried = Vec::new();
        let (mut low, mut high) = FACTORS;
        let most = trials.run(high, None, 0, MANY)?;
        let floor = most.alarms;
        tried.push(most);
        for _ in 0..STEPS {
            let middle = (low * high).sqrt();
            let one = trials.run(middle, None, 0, MANY)?;
            (self.options.progress)();
            tried.push(one);
            *(if one.alarms - floor <= FEW as f64 { &mut high } else { &mut low }) = middle;
        }
        let known = || tried.iter().filter(|it| it.alarms - floor <= MANY as f64 && it.factor < FACTORS.1);
        let (alarms, failed) =
            known().fold((20.0, 1.0), |sum, it| (sum.0 + it.alarms - floor, sum.1 + it.failed));
        let aim = (wanted / RESERVE).min(wanted / FAILED * alarms / failed);
        let few = tried.iter().filter(|it| it.factor == high).map(|it| it.alarms - floor).fold(0.0, f64::max);
        let extrapolated = (few.max(1.0) / trials.hours / aim).max(1.0);
        let mut factor = high * (1.0 + slope(&tried, floor, high) * extrapolated.ln()).min(FURTHEST);
        let mut last = trials.run(factor, None, 1, MANY)?;
        for round in 2..2 + ROUNDS as u64 {
            if last.alarms - floor <= 1.0 || floor > FEW as f64 {
                break;
            }
            factor *= GROWS;
            last = trials.run(factor, None, round, MANY)?;
            (self.options.progress)();
        }
        let noise = trials.noise(factor)?;

        Ok(Promise {
            alarms_per_hour: wanted,
            factor,
            noise,
            hours: trials.hours,
            alarms: last.alarms.round() as usize,
            between,
            is_measured: self.sessions.len() > 1,
            remaining_per_hour: floor / trials.hours,
            extrapolated,
        })
    }
}

/// The relative growth of the factor for e times fewer alarms: least squares of the alarms' logarithm, weighted by the alarms.
fn slope(tried: &[Tried], floor: f64, around: f64) -> f64 {
    let is_known = |it: &&Tried| (1.0..=MANY as f64).contains(&(it.alarms - floor)) && it.factor < FACTORS.1;
    let points: Vec<(f64, f64, f64)> = tried
        .iter()
        .filter(is_known)
        .map(|it| (it.factor, (it.alarms - floor).ln(), (it.alarms - floor).min(20.0)))
        .collect();
    let weight: f64 = points.iter().map(|it| it.2).sum();
    let mean = |of: fn(&(f64, f64, f64)) -> f64| points.iter().map(|it| it.2 * of(it)).sum::<f64>() / weight;
    let (x, y) = (mean(|it| it.0), mean(|it| it.1));
    let (mut both, mut own) = (0.0, 0.0);
    for point in &points {
        both += point.2 * (point.0 - x) * (point.1 - y);
        own += point.2 * (point.0 - x).powi(2);
    }
    let fitted = if both < 0.0 { -own / both / around } else { 0.05 };
    fitted.clamp(SLOPES.0, SLOPES.1)
}

impl<'a, 'b> Trials<'a, 'b> {
    fn new(
        fit: &'a Fit<'a>,
        source: &'a Source<'b>,
        draft: &'a (dyn Fn(f64, Option<f64>) -> Draft + Sync),
    ) -> Trials<'a, 'b> {
        let hours: f64 = fit.sessions.iter().map(|it| it.duration().seconds() / 3600.0).sum();
        let observations: usize = fit.sessions.iter().map(|it| it.observations().count()).sum();
        let count = fit.sessions.len() as f64;
        let wanted = ALARMS / fit.options.alarms_per_hour / hours * count;
        // With more pairs, an observation costs more.
        let cost = observations.max(1) as f64 * (1.0 + fit.pairs.len() as f64 / PAIRS);
        let affordable = fit.options.most_observations as f64 / cost * count;
        let sessions = wanted.min(affordable).ceil().clamp(4.0, 1_000.0);
        Trials { fit, source, draft, sessions: sessions as usize, hours: hours / count * sessions }
    }

    /// The first multiple of the found noise that adds no alarm in surrogate sessions, with a margin.
    fn noise(&self, factor: f64) -> Result<Option<f64>, Problem> {
        let mut without = Vec::with_capacity(NOISE_SERIES.len());
        for series in NOISE_SERIES {
            without.push((series, self.run(factor, None, series, MANY)?.alarms));
        }
        for multiple in NOISES {
            if !self.adds_alarms(factor, multiple, &without)? {
                let is_long = self.source.longest_s() >= LONG_S;
                return Ok(Some(multiple * if is_long { MARGIN } else { MARGIN_OF_SHORT }));
            }
        }
        Ok(None)
    }

    /// Whether a declared noise adds an alarm to those of a series `without` it. The first one decides, so nothing is run after it.
    fn adds_alarms(&self, factor: f64, multiple: f64, without: &[(u64, f64)]) -> Result<bool, Problem> {
        for &(series, alarms) in without {
            if self.run(factor, Some(multiple), series, alarms as usize)?.alarms > alarms {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// The alarms with a factor in the surrogate sessions of a series; beyond `most`, an extrapolation.
    fn run(&self, factor: f64, noise: Option<f64>, series: u64, most: usize) -> Result<Tried, Problem> {
        let knowledge = super::edit::built(&(self.draft)(factor, noise))?;
        let (mut alarms, mut failed) = (0, 0);
        let mut done = 0;
        while done < self.sessions && alarms <= most {
            let threads = self.fit.options.threads.clamp(1, self.sessions - done);
            let all: Vec<Verdicts> = if threads == 1 {
                vec![self.one(&knowledge, done, series)]
            } else {
                let one = |at: usize| self.one(&knowledge, done + at, series);
                side_by_side(threads, one).into_iter().flatten().collect()
            };
            done += threads;
            alarms += all.iter().map(|it| it.alarms).sum::<usize>();
            failed += all.iter().map(|it| it.failed).sum::<usize>();
        }
        let share = self.sessions as f64 / done as f64;
        Ok(Tried { factor, alarms: alarms as f64 * share, failed: failed as f64 * share })
    }

    fn one(&self, knowledge: &KnowledgeBase, number: usize, series: u64) -> Verdicts {
        let mut chance = Chance::new(self.fit.options.seed ^ (series << 32) ^ number as u64);
        let session = number % self.fit.sessions.len();
        let drawn = self.source.drawn(session, &mut chance);
        Verdicts::over(knowledge, drawn.iter().map(Vec::as_slice))
    }
}
