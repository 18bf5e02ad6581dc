//! Whether some inputs determine what a left-out one shows, or two explanations of them differ in it.
//!
//! Two ranges to a point are as good as none about a third one: two points fit them. The covariance of a filter does not show that: it is
//! that of the point at which the filter has arrived. So a run of the model is drawn, and what the inputs measure in it is explained by
//! the most probable run (Levenberg and Marquardt; D. Marquardt 1963, doi:10.1137/0111030), from several begins. The states may be as
//! far from the initial ones as they get while a reckoning bears witness. Where two explanations are both plausible, and one is sure
//! of a value of the left-out input that the other contradicts, the inputs do not determine it. An input on which
//! the explanations agree is determined, whatever the states. States that nothing observes make the explanation unsure, and are
//! no second one.
//!
//! A linear model has one explanation, and is not searched. Time otherwise: up to [`TRUTHS`] [`STARTS`] [`ITERATIONS`] steps of a filter
//! over [`STEPS`] moments.

use crate::continuous::Continuous;
use crate::matrix::{Matrix, at, put};
use crate::random::Random;
use crate::system::{System, wrapped};
use shsa_core::knowledge::Fusion;
use shsa_core::time::Span;

/// How many runs are drawn, and from how many begins each is explained.
const TRUTHS: usize = 4;
const STARTS: usize = 5;
const ITERATIONS: usize = 30;
/// Moments of a run, a second apart: a motion shows at two, what changes it at three.
const STEPS: usize = 3;
const STEP_S: f64 = 1.0;
/// Two explanations are both plausible if their costs, in squared standard deviations, differ by no more: by more than this, one in
/// ten thousand right measurements is off.
const PLAUSIBLE: f64 = 15.137;
/// The squared number of standard deviations from which on an explanation contradicts a value.
const CONTRADICTS: f64 = 9.0;
/// The standard deviation of an input whose noise is not known at design time, as a share of what the states make of it.
const UNKNOWN: f64 = 0.01;
/// Derivatives that differ by less than this share are the same.
const SAME: f64 = 1e-9;

/// The search for second explanations in a model.
pub(super) struct Search {
    system: Continuous,
    inputs: usize,
    controls: Vec<f64>,
    mean: Vec<f64>,
    /// How far each state may be from the mean: one standard deviation.
    reach: Vec<f64>,
    is_linear: bool,
    random: Random,
}

/// The most probable run near a begin.
struct Explanation {
    /// The first states, in standard deviations from the mean.
    begin: Vec<f64>,
    cost: f64,
    covariance: Matrix,
}

/// What an input shows at a moment: its value, the derivatives by the first states, and the variance of its noise.
struct Shown {
    input: usize,
    value: f64,
    gradient: Vec<f64>,
    variance: f64,
}

impl Search {
    /// The search in the model of a fusion, whose states may move for a time.
    pub(super) fn new(mut system: Continuous, fusion: &Fusion, within: Span) -> Search {
        let controls: Vec<f64> = (0..fusion.controls.len()).map(|place| 0.23 + 0.11 * place as f64).collect();
        let mean: Vec<f64> = fusion.states.iter().map(|state| state.initial).collect();
        let reach = reach(&mut system, fusion, &mean, &controls, within);
        let mut search = Search {
            system,
            inputs: fusion.inputs.len(),
            controls,
            mean,
            reach,
            is_linear: false,
            random: Random::new(1),
        };
        search.is_linear = search.is_linear();
        search
    }

    /// Whether the inputs without some leave open what one of these shows.
    pub(super) fn is_open(&mut self, without: &[usize]) -> bool {
        if self.is_linear {
            return false;
        }
        self.random = Random::new(1);
        (0..TRUTHS).any(|_| {
            let truth = self.draw();
            self.has_second(&truth, without)
        })
    }

    fn draw(&mut self) -> Vec<f64> {
        (0..self.mean.len()).map(|_| self.random.normal()).collect()
    }

    fn has_second(&mut self, truth: &[f64], without: &[usize]) -> bool {
        let measured = self.run(truth);
        let Some(first) = self.explain(truth.to_vec(), &measured, without) else { return false };
        let expected = self.run(&first.begin);
        (0..STARTS).any(|_| {
            let start = self.draw();
            let second = self.explain(start, &measured, without);
            second.is_some_and(|second| {
                let other = self.run(&second.begin);
                (second.cost - first.cost).abs() <= PLAUSIBLE
                    && (self.contradicts(&first, &expected, &other, without)
                        || self.contradicts(&second, &other, &expected, without))
            })
        })
    }

    /// Whether an explanation is sure of a value of a left-out input that is not that of another run.
    fn contradicts(&self, own: &Explanation, shown: &[Shown], other: &[Shown], without: &[usize]) -> bool {
        let left_out = shown.iter().zip(other).filter(|(shown, _)| without.contains(&shown.input));
        left_out.into_iter().any(|(shown, other)| {
            let gradient = Matrix::from_column_slice(shown.gradient.len(), 1, &shown.gradient);
            let variance = at(&(gradient.transpose() * &own.covariance * &gradient), 0, 0);
            let apart = wrapped(shown.value - other.value, self.system.turn(shown.input));
            apart * apart > CONTRADICTS * (variance + shown.variance + other.variance)
        })
    }

    /// What all inputs show in the run from a begin.
    fn run(&mut self, begin: &[f64]) -> Vec<Shown> {
        let n = self.mean.len();
        let pairs = self.mean.iter().zip(&self.reach).zip(begin);
        let mut state: Vec<f64> = pairs.map(|((mean, reach), begin)| mean + reach * begin).collect();
        let mut since =
            Matrix::from_fn(
                n,
                n,
                |i, j| {
                    if i == j { self.reach.get(i).copied().unwrap_or(0.0) } else { 0.0 }
                },
            );
        let (mut next, mut jacobian, mut gradient) = (vec![0.0; n], Matrix::zeros(n, n), vec![0.0; n]);
        let mut shown = Vec::with_capacity(STEPS * self.inputs);
        for _ in 0..STEPS {
            for input in 0..self.inputs {
                let value = self.system.gradient(input, &state, &self.controls, &mut gradient);
                let by_begin = since.tr_mul(&Matrix::from_column_slice(n, 1, &gradient));
                let declared = self.system.covariance(input, input, &state, &self.controls);
                let made: f64 = by_begin.iter().map(|it| it * it).sum();
                let variance = if declared > 0.0 { declared } else { UNKNOWN * UNKNOWN * made };
                shown.push(Shown { input, value, gradient: by_begin.as_slice().to_vec(), variance });
            }
            self.system.linearised(&state, &self.controls, STEP_S, &mut next, &mut jacobian);
            since = &jacobian * since;
            state.copy_from_slice(&next);
        }
        shown
    }

    /// The cost of a begin, and the matrix and vector of the normal equations of its improvement.
    fn normal_equations(
        &mut self,
        begin: &[f64],
        measured: &[Shown],
        without: &[usize],
    ) -> (f64, Matrix, Matrix) {
        let n = begin.len();
        let (mut matrix, mut vector) = (Matrix::identity(n, n), -Matrix::from_column_slice(n, 1, begin));
        let mut cost: f64 = begin.iter().map(|it| it * it).sum();
        let shown = self.run(begin);
        for (shown, measured) in shown.iter().zip(measured).filter(|(it, _)| !without.contains(&it.input)) {
            let apart = wrapped(measured.value - shown.value, self.system.turn(shown.input));
            // The noise of the drawn run: a begin cannot lower its cost by being where noise is large.
            let inverse = 1.0 / measured.variance;
            if !inverse.is_finite() {
                continue;
            }
            let gradient = Matrix::from_column_slice(n, 1, &shown.gradient);
            cost += apart * apart * inverse;
            vector += &gradient * (apart * inverse);
            matrix += &gradient * gradient.transpose() * inverse;
        }
        (cost, matrix, vector)
    }

    /// The most probable run that is found from a begin; `None` where the model has no value.
    fn explain(&mut self, mut begin: Vec<f64>, measured: &[Shown], without: &[usize]) -> Option<Explanation> {
        let (mut cost, mut matrix, mut vector) = self.normal_equations(&begin, measured, without);
        let mut damping = 1e-3;
        for _ in 0..ITERATIONS {
            let mut damped = matrix.clone();
            (0..begin.len()).for_each(|i| put(&mut damped, i, i, (1.0 + damping) * at(&matrix, i, i)));
            let Some(factors) = damped.cholesky() else { break };
            let step = factors.solve(&vector);
            let moved: Vec<f64> = begin.iter().zip(step.iter()).map(|(begin, step)| begin + step).collect();
            let found = self.normal_equations(&moved, measured, without);
            if found.0 < cost {
                let gain = cost - found.0;
                (begin, (cost, matrix, vector), damping) = (moved, found, damping / 10.0);
                if gain < SAME {
                    break;
                }
            } else if damping < 1.0 / SAME {
                damping *= 10.0;
            } else {
                break;
            }
        }
        let covariance = matrix.try_inverse().filter(|_| cost.is_finite())?;
        Some(Explanation { begin, cost, covariance })
    }

    /// Whether all derivatives are the same at several states.
    fn is_linear(&mut self) -> bool {
        let draws: Vec<Vec<f64>> = (0..STARTS).map(|_| self.draw()).collect();
        let runs: Vec<Vec<Shown>> = draws.iter().map(|draw| self.run(draw)).collect();
        let Some((first, others)) = runs.split_first() else { return true };
        let same = |one: &Shown, other: &Shown| {
            let pairs = one.gradient.iter().zip(&other.gradient);
            pairs.into_iter().all(|(one, other)| (one - other).abs() <= SAME * one.abs())
        };
        others.iter().all(|run| first.iter().zip(run).all(|(one, other)| same(one, other)))
    }
}

/// How far each state may be from its initial value after a time: one standard deviation.
fn reach(system: &mut Continuous, fusion: &Fusion, mean: &[f64], controls: &[f64], within: Span) -> Vec<f64> {
    let n = mean.len();
    let (mut jacobian, mut noise, mut next) = (Matrix::identity(n, n), Matrix::zeros(n, n), vec![0.0; n]);
    system.linearised(mean, controls, within.seconds(), &mut next, &mut jacobian);
    system.noise(mean, controls, within.seconds(), &mut noise);
    let spread = Matrix::from_fn(n, n, |i, j| {
        let own = fusion.states.get(i).map_or(0.0, |state| state.spread);
        if i == j { own * own } else { 0.0 }
    });
    let grown = &jacobian * &spread * jacobian.transpose() + noise;
    let reach = |state: usize| at(&grown, state, state).max(at(&spread, state, state)).sqrt();
    (0..n).map(reach).map(|reach| if reach.is_finite() { reach } else { 0.0 }).collect()
}
