//! The deviations of healthy signals and relations: variance components of all comparisons.

use super::edit;
use super::parts::Parts;
use super::surrogate::{period, quantum};
use super::{Fit, Parameter};
use crate::calibration::comparison::Comparison;
use crate::calibration::rhythm::Rhythm;
use crate::calibration::widening::{Demand, least_widening};
use crate::order::{median, quantile, sorted, variance, winsorised};
use shsa_core::knowledge::{Id, IdVec, SignalId};

/// The quantile at which a distribution is compared with the normal one, and the latter's value there.
const WIDTH_AT: f64 = 0.99;
const NORMAL_WIDTH: f64 = 2.576;
/// The limits of the ratio.
const SHAPES: (f64, f64) = (0.6, 4.0);
/// The number of passes over all pairs of a variable.
const PASSES: usize = 200;
/// Signals of one kind share a variance if the ratio of the largest to the smallest is at most this.
const SAME: f64 = 1.5;
/// Two rates are of one kind if their ratio is at most this.
const SAME_RATE: f64 = 1.1;
/// The assumed deviation between sessions, in standard deviations of a signal, and its weight in degrees of freedom.
const ASSUMED: (f64, f64) = (1.0, 4.0);
/// A pair needs the standard deviation of its difference times this, because two equal signals give each other their own ones.
const PAIR: f64 = std::f64::consts::SQRT_2;
/// The number of comparisons in a block, by which it is checked whether a relation holds.
const TOGETHER: usize = 31;
/// The least number of blocks.
const FEWEST_BLOCKS: usize = 10;
/// Above this share of the values' own variation, nothing shows that two ways measure the same.
pub(super) const UNEXPLAINED: f64 = 0.5;

/// The resolution of single precision, as a share of the largest reading.
const RESOLUTION: f64 = f32::EPSILON as f64;

/// The deviation of one signal, in the signal's unit.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Scale {
    /// The standard deviation.
    pub(super) deviation: f64,
    /// How much wider than a normal distribution the values are at the quantile where comparisons disagree.
    pub(super) shape: f64,
}

/// The components of an error, in the unit of its parameter.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Share {
    /// The constant part.
    pub(super) offset: f64,
    /// The part that the factor of the model multiplies.
    pub(super) spread: f64,
}

/// The comparisons by pair, then by session.
pub(super) type Compared = Vec<Vec<Vec<Comparison>>>;

impl Fit<'_> {
    /// The deviation of each signal; 0 of one that is exact.
    pub(super) fn scales(
        &self,
        parts: &Parts<'_>,
        compared: &Compared,
        exact: &IdVec<SignalId, bool>,
    ) -> IdVec<SignalId, Scale> {
        let count = self.knowledge.signals().len();
        let mut variances: IdVec<SignalId, f64> = IdVec::filled(count, |signal| parts.noise(signal));
        for variable in self.knowledge.variables().ids() {
            self.components(variable, compared, exact, &mut variances);
            self.share_kinds(parts, variable, &mut variances);
        }
        IdVec::filled(count, |signal: SignalId| {
            if exact[signal] {
                return Scale { deviation: 0.0, shape: 1.0 };
            }
            let rounding = quantum(parts, signal) / 12.0_f64.sqrt();
            let rests = parts.rests(signal);
            let deviation = variance(&rests).sqrt();
            let wide = quantile(&sorted(rests.iter().map(|it| it.abs())), WIDTH_AT).unwrap_or(0.0);
            let shape = if deviation > 0.0 { wide / NORMAL_WIDTH / deviation } else { 1.0 };
            Scale {
                deviation: variances[signal].sqrt().max(rounding),
                shape: shape.clamp(SHAPES.0, SHAPES.1),
            }
        })
    }

    /// Variances of a variable's signals from the variances of their differences: least squares, none below 0 (F. E. Grubbs 1948,
    /// doi:10.1080/01621459.1948.10483261). Each of two signals gets half, and all beside an exact one.
    fn components(
        &self,
        variable: shsa_core::knowledge::VariableId,
        compared: &Compared,
        exact: &IdVec<SignalId, bool>,
        variances: &mut IdVec<SignalId, f64>,
    ) {
        let known: Vec<(SignalId, SignalId, f64)> = (self.pairs.iter().zip(compared))
            .filter(|(pair, _)| pair.variable == variable)
            .filter_map(|(pair, compared)| {
                let (one, other) = pair.direct()?;
                let apart = apart(compared);
                (apart.len() > TOGETHER).then(|| (one, other, winsorised(&apart)))
            })
            .collect();
        let base = |signal: SignalId| edit::scale(self.knowledge, signal).powi(2);
        let signals = self.knowledge.carriers(variable);
        let of = |signal: SignalId| {
            known.iter().filter(move |(one, other, _)| *one == signal || *other == signal).copied()
        };
        let mut found: Vec<(SignalId, f64)> = signals
            .iter()
            .filter(|signal| !exact[**signal])
            .filter_map(|&signal| Some((signal, of(signal).map(|it| 0.5 * it.2).reduce(f64::min)?)))
            .collect();
        for _ in 0..PASSES {
            for at in 0..found.len() {
                let signal = found[at].0;
                let (mut sum, mut weights) = (0.0, 0.0);
                for (one, other, it) in of(signal) {
                    let partner = if one == signal { other } else { one };
                    let other = found.iter().find(|(it, _)| *it == partner).map_or(0.0, |(_, it)| *it);
                    let weight = (it * it).max(f64::MIN_POSITIVE).recip().min(1e300);
                    sum += weight * (it - other);
                    weights += weight;
                }
                found[at].1 = (sum / weights).max(0.0);
            }
        }
        for (signal, it) in found {
            // A part of the signal's own variance remains: no signal is perfect because others are worse.
            let least = 0.1 * of(signal).map(|it| it.2).reduce(f64::min).unwrap_or(0.0);
            variances[signal] = it.max(least) / base(signal);
        }
    }

    /// Gives signals of one kind a common variance, if theirs do not differ much.
    fn share_kinds(
        &self,
        parts: &Parts<'_>,
        variable: shsa_core::knowledge::VariableId,
        variances: &mut IdVec<SignalId, f64>,
    ) {
        let signals = self.knowledge.carriers(variable);
        let is_same = |one: SignalId, other: SignalId| {
            let (one_s, other_s) = (period(parts, one), period(parts, other));
            let units = |signal| edit::scale(self.knowledge, signal);
            units(one) == units(other)
                && one_s.max(other_s) <= SAME_RATE * one_s.min(other_s)
                && quantum(parts, one) == quantum(parts, other)
        };
        for &signal in signals {
            let kind: Vec<SignalId> = signals.iter().copied().filter(|it| is_same(signal, *it)).collect();
            let of: Vec<f64> = kind.iter().map(|it| variances[*it]).collect();
            let (least, most) =
                (of.iter().fold(f64::INFINITY, |a, b| a.min(*b)), of.iter().fold(0.0, |a: f64, b| a.max(*b)));
            if kind.len() > 1 && most <= SAME * least {
                let mean = crate::order::mean(&of);
                kind.iter().for_each(|it| variances[*it] = mean);
            }
        }
    }

    /// The least error of each parameter: the resolution of single precision.
    pub(super) fn floors(&self, rhythms: &[Rhythm]) -> Vec<f64> {
        let floor = |parameter: &Parameter| match parameter {
            Parameter::Relation(_) => 0.0,
            Parameter::Signal(signal) => {
                let range = rhythms.get(signal.index()).and_then(|it| it.range).unwrap_or_default();
                RESOLUTION * range.0.abs().max(range.1.abs())
            }
        };
        self.parameters.iter().map(floor).collect()
    }

    /// Whether the model declares an error of a relation.
    fn has_error(&self, number: usize) -> bool {
        let Parameter::Relation(relation) = self.parameters[number] else { return false };
        self.draft.relations.get(relation.index()).is_some_and(|it| it.error.is_some())
    }

    /// The deviation between sessions, in standard deviations of each signal: measured, combined with the assumed one.
    pub(super) fn between_sessions(&self, parts: &Parts<'_>, scales: &IdVec<SignalId, Scale>) -> f64 {
        let sessions = parts.offsets.len();
        let (assumed, worth) = ASSUMED;
        let (mut sum, mut freedom) = (worth * assumed * assumed, worth);
        for variable in self.knowledge.variables().ids() {
            let signals = self.knowledge.carriers(variable);
            for &signal in signals.iter().filter(|_| signals.len() > 1 && sessions > 1) {
                let of: Vec<f64> = parts.offsets.iter().map(|it| it[signal]).collect();
                let squares = sessions as f64 * variance(&of) / scales[signal].deviation.max(1e-300).powi(2);
                sum += squares.min(1e6);
                freedom += (sessions - 1) as f64 * (signals.len() - 1) as f64 / signals.len() as f64;
            }
        }
        (sum / freedom).sqrt()
    }

    /// The components of each parameter's error; `None` if nothing shows them.
    ///
    /// `gains` are the widenings of each pair by each parameter, in SI. Relations get the part of a pair that its signals do not
    /// explain.
    pub(super) fn shares(
        &self,
        parts: &Parts<'_>,
        scales: &IdVec<SignalId, Scale>,
        between: f64,
        compared: &Compared,
        gains: &[Vec<(usize, f64)>],
    ) -> Vec<Option<Share>> {
        let mut shares: Vec<Option<Share>> = vec![None; self.parameters.len()];
        // What only decides whether a relation holds widens nothing, and nothing shows an error of it.
        let is_shown = |number: usize, signal: SignalId| {
            let reads = |it: &super::PairFit| it.one.1.contains(&signal) || it.other.1.contains(&signal);
            let widens =
                |gains: &[(usize, f64)]| gains.is_empty() || gains.iter().any(|(at, _)| *at == number);
            let mut pairs = self.pairs.iter().zip(gains).filter(|(it, _)| it.holds && it.compared.0 > 0);
            pairs.any(|(it, gains)| reads(it) && widens(gains))
        };
        for (number, parameter) in self.parameters.iter().enumerate() {
            if let Some(signal) = parameter.signal().filter(|it| is_shown(number, *it)) {
                let scale = scales[signal];
                let spread = scale.deviation * (scale.shape.powi(2) + between * between).sqrt();
                shares[number] = (spread > 0.0).then(|| Share { offset: parts.offset(signal).abs(), spread });
            }
        }
        let is_relation = |at: usize| matches!(self.parameters[at], Parameter::Relation(_));
        let (mut spreads, mut offsets) = (Vec::new(), Vec::new());
        for (pair, (compared, gains)) in self.pairs.iter().zip(compared.iter().zip(gains)) {
            let mut own: Vec<(usize, f64)> =
                gains.iter().copied().filter(|(at, _)| is_relation(*at)).collect();
            // If the model declares some of these relations as inexact, the others are exact.
            if own.iter().any(|(at, _)| self.has_error(*at)) {
                own.retain(|(at, _)| self.has_error(*at));
            }
            if own.is_empty() || !pair.holds || compared.iter().all(Vec::is_empty) {
                continue;
            }
            let by_signals = |of: fn(&Share) -> f64| -> f64 {
                let known = gains.iter().filter_map(|(at, gain)| Some(gain * of(shares[*at].as_ref()?)));
                known.sum()
            };
            let all: Vec<f64> = compared.iter().flatten().map(Comparison::beyond).collect();
            let middle = median(all.iter().copied());
            let wide = quantile(&sorted(all.iter().map(|it| (it - middle).abs())), WIDTH_AT).unwrap_or(0.0);
            if wide <= 0.0 && middle == 0.0 {
                // The relation holds as it is: what it leaves open covers all differences.
                continue;
            }
            let needed = PAIR * (wide / NORMAL_WIDTH).max(0.5 * variance(&all).sqrt());
            let least = (needed - by_signals(|it| it.spread)).max(0.05 * needed);
            spreads.push(Demand { gains: own.clone(), least });
            let least = middle.abs() - by_signals(|it| it.offset);
            if least > 0.0 {
                offsets.push(Demand { gains: own, least });
            }
        }
        let solved = |demands: &[Demand]| {
            least_widening(&vec![1.0; self.parameters.len()], &normalised(demands, self.parameters.len()))
        };
        let units = units(&spreads, self.parameters.len());
        let (spreads, offsets) = (solved(&spreads), solved(&offsets));
        for (number, share) in shares.iter_mut().enumerate().filter(|(at, _)| is_relation(*at)) {
            let spread = spreads[number] * units[number];
            *share = (spread > 0.0).then(|| Share { offset: offsets[number] * units[number], spread });
        }
        shares
    }
}

/// The unit of each parameter in which its largest gain is 1.
fn units(demands: &[Demand], count: usize) -> Vec<f64> {
    let largest = |number: usize| {
        let gains = demands.iter().flat_map(|it| it.gains.iter()).filter(|(at, _)| *at == number);
        gains.map(|(_, gain)| *gain).fold(0.0, f64::max)
    };
    (0..count).map(|number| if largest(number) > 0.0 { largest(number).recip() } else { 1.0 }).collect()
}

fn normalised(demands: &[Demand], count: usize) -> Vec<Demand> {
    let units = units(demands, count);
    let one = |it: &Demand| Demand {
        gains: it.gains.iter().map(|(at, gain)| (*at, gain * units[*at])).collect(),
        least: it.least,
    };
    demands.iter().map(one).collect()
}

/// The differences of a pair, minus the mean of each session.
pub(super) fn apart(compared: &[Vec<Comparison>]) -> Vec<f64> {
    let of = |session: &Vec<Comparison>| {
        let all: Vec<f64> = session.iter().map(|it| it.value - it.known).collect();
        let middle = crate::order::mean(&all);
        all.into_iter().map(move |it| it - middle)
    };
    compared.iter().flat_map(of).collect()
}

/// The spread of two ways' difference as a share of the first way's variation, both for means over several comparisons: for
/// relations between noisy signals, only means show anything.
pub(super) fn unexplained(compared: &[Vec<Comparison>]) -> f64 {
    let means = |of: fn(&Comparison) -> f64, size: usize| -> Vec<f64> {
        let blocks = compared.iter().flat_map(|session| session.chunks_exact(size));
        blocks.map(|block| block.iter().map(of).sum::<f64>() / size as f64).collect()
    };
    let count: usize = compared.iter().map(Vec::len).sum();
    let size = TOGETHER.min(count / FEWEST_BLOCKS).max(1);
    let (apart, values) = (means(|it| it.value - it.known, size), means(|it| it.value, size));
    let (apart, values) = (crate::order::spread(&apart), crate::order::spread(&values));
    if values > 0.0 {
        apart / values
    } else if apart > 0.0 {
        f64::INFINITY
    } else {
        0.0
    }
}
