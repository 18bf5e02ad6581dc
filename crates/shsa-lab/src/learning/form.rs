//! The fit of relations and their errors.

use crate::learning::MOST_UNEXPLAINED;
use crate::learning::least_squares::solve;
use crate::learning::regressors::Regressors;
use crate::learning::saturation;
use crate::learning::sessions::Place;
use crate::learning::shape::{Relation, Score, Shape};
use crate::learning::signal::{Part, Seen};

/// The share of samples that may be wrong in relations with steps: those around each step.
const TRIMMED: f64 = 0.05;

/// In a part in which the target moves by less than this share of its whole movement, errors are related to the latter.
const STILL: f64 = 0.5;

/// The window of an integral's rate, as a share of the recording.
const INTEGRAL_WINDOW: f64 = 0.05;

/// How much the error may grow by a plain number (no offset, a factor of 1 or -1), and which error counts as zero.
const PLAIN: f64 = 1.02;
const LEAST_LEFT: f64 = 1e-4;

/// A form with its data: the target, the term with the factor 1, and the columns whose factors are fitted.
pub(crate) struct Design {
    parts: Vec<Part>,
    places: Vec<Place>,
    target: Vec<f64>,
    fixed: Vec<f64>,
    columns: Vec<Vec<f64>>,
}

impl Design {
    /// The rows at which all signals have a value.
    pub(crate) fn new(seen: &Seen<'_>, target: usize, inputs: &[usize], shape: &Shape) -> Design {
        Design::of_every(1, seen, target, inputs, shape)
    }

    /// Some of these rows, evenly.
    fn of_every(every: usize, seen: &Seen<'_>, target: usize, inputs: &[usize], shape: &Shape) -> Design {
        let clock = seen.slowest(inputs.iter().copied().chain([target]));
        let regressors = Regressors::new(&seen.curves, inputs, shape);
        let mut design =
            Design { parts: vec![], places: vec![], target: vec![], fixed: vec![], columns: vec![] };
        for (row, &time) in clock.times.iter().enumerate().step_by(every) {
            let value = |signal: usize| clock.values[signal].get(row).copied();
            let predicted = match shape {
                Shape::Rate { window_s } => seen.curves[target].at(time - window_s, time),
                _ => value(target),
            };
            let (Some(predicted), Some((fixed, regressors))) = (predicted, regressors.at(time, value)) else {
                continue;
            };
            if !(predicted.is_finite() && fixed.is_finite() && regressors.iter().all(|it| it.is_finite())) {
                continue;
            }
            design.parts.push(clock.parts[row]);
            design.places.push(clock.places[row]);
            design.target.push(predicted);
            design.fixed.push(fixed);
            design.columns.resize_with(regressors.len(), Vec::new);
            design.columns.iter_mut().zip(regressors).for_each(|(column, it)| column.push(it));
        }
        if shape.takes_steps() {
            design.part_each_gear();
        }
        if *shape == Shape::Integral && !design.is_one_session() {
            design.begin_anew();
        }
        design
    }

    /// The best constants over some parts.
    fn fit(&self, shape: &Shape, is_used: impl Fn(Part) -> bool) -> Option<Vec<f64>> {
        let rest: Vec<f64> =
            self.target.iter().zip(&self.fixed).map(|(target, fixed)| target - fixed).collect();
        let is_used = |row: usize| is_used(self.parts[row]);
        match shape {
            Shape::Saturated => saturation::fit(&self.columns, &rest, is_used),
            Shape::Gears(_) | Shape::Modes(_) => self.fit_gears(shape, &rest, &is_used),
            Shape::Norm => {
                let squares: Vec<f64> = self.target.iter().map(|it| it * it).collect();
                solve(&self.columns, &squares, is_used)
            }
            _ => solve(&self.columns, &rest, is_used),
        }
    }

    /// Replaces constants by plain ones (no offset, a factor of 1 or -1) where that hardly increases the error, and fits the
    /// others again.
    fn plain(&self, shape: &Shape, numbers: Vec<f64>) -> Vec<f64> {
        let offset = match shape {
            Shape::Polynomial(_)
            | Shape::Saturated
            | Shape::Table(_)
            | Shape::Gears(_)
            | Shape::Modes(_)
            | Shape::Norm => {
                return numbers;
            }
            Shape::Rate { .. } | Shape::Product(_) | Shape::Power(_) | Shape::Projected { .. } => None,
            _ => numbers.len().checked_sub(1),
        };
        let most = PLAIN * self.left(shape, &numbers) + LEAST_LEFT;
        let mut held: Vec<Option<f64>> = vec![None; numbers.len()];
        let mut numbers = numbers;
        for place in 0..numbers.len() {
            held[place] = Some(if Some(place) == offset { 0.0 } else { numbers[place].signum() });
            match self.fit_others(&held).filter(|it| self.left(shape, it) <= most) {
                Some(plain) => numbers = plain,
                None => held[place] = None,
            }
        }
        numbers
    }

    /// The best constants when some are given.
    fn fit_others(&self, held: &[Option<f64>]) -> Option<Vec<f64>> {
        let given = |row: usize| {
            self.columns
                .iter()
                .zip(held)
                .map(|(column, it)| it.map_or(0.0, |it| it * column[row]))
                .sum::<f64>()
        };
        let rest: Vec<f64> =
            (0..self.target.len()).map(|row| self.target[row] - self.fixed[row] - given(row)).collect();
        let free = self.columns.iter().zip(held).filter(|(_, held)| held.is_none());
        let free: Vec<Vec<f64>> = free.map(|(column, _)| column.clone()).collect();
        let mut fitted = if free.is_empty() { vec![] } else { solve(&free, &rest, |_| true)? }.into_iter();
        held.iter().map(|it| it.or_else(|| fitted.next())).collect()
    }

    /// Divides the time of each gear into parts, as some gears are used late only.
    fn part_each_gear(&mut self) {
        for column in 0..self.columns.len() {
            let is_on = |row: &usize| self.columns[column][*row] != 0.0;
            let rows: Vec<usize> = (0..self.target.len()).filter(is_on).collect();
            self.divide(rows);
        }
    }

    /// Divides the time of each piece of a saturated line into parts, as some limits are reached late only.
    fn part_each_piece(&mut self, shape: &Shape) -> Option<()> {
        let numbers = self.fit(shape, |_| true)?;
        let pieces = saturation::pieces(&self.columns, &numbers);
        pieces.into_iter().for_each(|rows| self.divide(rows));
        Some(())
    }

    /// Divides these rows into parts, by their order within the sessions.
    fn divide(&mut self, mut rows: Vec<usize>) {
        self.by_share(&mut rows);
        for (rank, row) in rows.iter().enumerate() {
            self.parts[*row] = Part::at(rank as f64 / rows.len() as f64);
        }
    }

    /// Puts rows into the order in which they come within the sessions.
    fn by_share(&self, rows: &mut [usize]) {
        rows.sort_by(|one, other| self.places[*one].share.total_cmp(&self.places[*other].share));
    }

    fn is_one_session(&self) -> bool {
        self.places.windows(2).all(|pair| pair[0].session == pair[1].session)
    }

    /// Takes the mean of its fitted part from each session: an integral begins in each with another value. So the factor is the one
    /// beside an offset for each session.
    fn begin_anew(&mut self) {
        let mut rows: Vec<usize> = (0..self.target.len()).collect();
        for of in rows.chunk_by_mut(|one, next| self.places[*one].session == self.places[*next].session) {
            for values in [&mut self.target].into_iter().chain(self.columns.first_mut()) {
                let fitted = of.iter().filter(|row| self.parts[**row] == Part::Fitted);
                let middle = crate::order::mean(&fitted.map(|row| values[*row]).collect::<Vec<_>>());
                of.iter().for_each(|row| values[*row] -= middle);
            }
        }
    }

    /// The factors of the gears, fitted without the samples around each change.
    fn fit_gears(&self, shape: &Shape, rest: &[f64], is_used: &impl Fn(usize) -> bool) -> Option<Vec<f64>> {
        let first = solve(&self.columns, rest, is_used)?;
        let errors = self.errors(shape, &first);
        let most =
            most_of(errors.iter().enumerate().filter(|(row, _)| is_used(*row)).map(|(_, it)| it.abs()));
        solve(&self.columns, rest, |row| is_used(row) && errors[row].abs() <= most)
    }

    /// The differences between the target and the relation.
    fn errors(&self, shape: &Shape, numbers: &[f64]) -> Vec<f64> {
        let row = |row: usize| {
            let predicted =
                self.columns.iter().zip(numbers).map(|(column, number)| column[row] * number).sum::<f64>();
            let predicted = match (shape, numbers) {
                (Shape::Saturated, [_, _, low, high]) => predicted.clamp(*low, *high),
                (Shape::Norm, _) => predicted.max(0.0).sqrt(),
                _ => predicted,
            };
            self.target[row] - self.fixed[row] - predicted
        };
        (0..self.target.len()).map(row).collect()
    }

    fn score(&self, shape: &Shape, numbers: &[f64]) -> Option<Score> {
        let errors = self.errors(shape, numbers);
        let all = deviation(self.target.iter().copied());
        let share = |part: Part| {
            let of_part = |values: &[f64]| -> Vec<f64> {
                values
                    .iter()
                    .zip(&self.parts)
                    .filter(|(_, it)| **it == part)
                    .map(|(value, _)| *value)
                    .collect()
            };
            let mut own = of_part(&errors);
            if shape.takes_steps() {
                let most = most_of(own.iter().map(|it| it.abs()));
                own.retain(|it| it.abs() <= most);
            }
            let moves = deviation(of_part(&self.target).into_iter()).max(STILL * all);
            (own.len() >= 10 && moves > 0.0).then(|| root_mean_square(&own) / moves)
        };
        let [fitted, chosen, unseen] = Part::ALL.map(share);
        Some(Score { fitted: fitted?, chosen: chosen?, unseen: unseen? })
    }

    /// The share of the target that these constants leave unexplained.
    pub(crate) fn left(&self, shape: &Shape, numbers: &[f64]) -> f64 {
        root_mean_square(&self.errors(shape, numbers)) / deviation(self.target.iter().copied())
    }

    /// The share of the target that a curve over the middle of its input leaves at the ends of it: what only looks like the curve
    /// leaves more there, and still more on another day. The input is the column with this place.
    pub(crate) fn left_at_ends(&self, input: usize) -> f64 {
        /// The share of the samples at either end.
        const END: f64 = 0.15;
        let Some(column) = self.columns.get(input) else { return f64::INFINITY };
        let sorted = crate::order::sorted(column.iter().copied());
        let end = |share: f64| crate::order::quantile(&sorted, share).unwrap_or(0.0);
        let (low, high) = (end(END), end(1.0 - END));
        let is_inside = |row: usize| low <= column[row] && column[row] <= high;
        let Some(numbers) = solve(&self.columns, &self.target, is_inside) else { return f64::INFINITY };
        let predicted =
            |row: usize| self.columns.iter().zip(&numbers).map(|(it, number)| it[row] * number).sum::<f64>();
        let outside = (0..self.target.len()).filter(|row| !is_inside(*row));
        let left: Vec<f64> = outside.map(|row| self.target[row] - predicted(row)).collect();
        root_mean_square(&left) / deviation(self.target.iter().copied())
    }

    /// The share of the target that a parabola in time leaves unexplained.
    pub(crate) fn left_by_time(&self) -> f64 {
        let columns = self.time();
        let Some(numbers) = solve(&columns, &self.target, |_| true) else { return 1.0 };
        let predicted = |row: usize| {
            columns.iter().zip(&numbers).map(|(column, number)| column[row] * number).sum::<f64>()
        };
        let left: Vec<f64> = (0..self.target.len()).map(|row| self.target[row] - predicted(row)).collect();
        root_mean_square(&left) / deviation(self.target.iter().copied())
    }

    /// The factor of the first column beside a parabola in time, in either half.
    pub(crate) fn factors_beside_time(&self) -> Option<[f64; 2]> {
        let columns: Vec<Vec<f64>> = self.columns.first().cloned().into_iter().chain(self.time()).collect();
        let mut rows: Vec<usize> = (0..self.target.len()).collect();
        self.by_share(&mut rows);
        let mut is_early = vec![false; rows.len()];
        rows.iter().take(rows.len() / 2).for_each(|row| is_early[*row] = true);
        let early = solve(&columns, &self.target, |row| is_early[row])?;
        let late = solve(&columns, &self.target, |row| !is_early[row])?;
        Some([early[0], late[0]])
    }

    /// A parabola over all sessions, and where there are several, one that is the same in each.
    fn time(&self) -> Vec<Vec<f64>> {
        let rows = 0..self.target.len();
        let whole = |row: usize| row as f64 / self.target.len() as f64;
        let parabola = [0, 1, 2].map(|power| rows.clone().map(|row| whole(row).powi(power)).collect());
        let mut columns = Vec::from(parabola);
        if !self.is_one_session() {
            let within = |power: i32| self.places.iter().map(|it| it.share.powi(power)).collect();
            columns.extend([1, 2].map(within));
        }
        columns
    }
}

/// Fits the first part, computes the errors on the others, and then fits all data.
pub(crate) fn fit(seen: &Seen<'_>, target: usize, inputs: &[usize], shape: &Shape) -> Option<Relation> {
    if !promises(seen, target, inputs, shape) {
        return None;
    }
    let mut design = Design::new(seen, target, inputs, shape);
    if *shape == Shape::Saturated {
        design.part_each_piece(shape)?;
    }
    let early = design.fit(shape, |part| part == Part::Fitted)?;
    let score = design.score(shape, &early)?;
    let numbers = design.plain(shape, design.fit(shape, |_| true)?);
    let window_s = (*shape == Shape::Integral).then_some(INTEGRAL_WINDOW * seen.duration_s);
    Some(Relation { target, inputs: inputs.to_vec(), shape: shape.clone(), numbers, window_s, score })
}

/// Whether a form leaves little enough of some rows to be worth a fit to all.
fn promises(seen: &Seen<'_>, target: usize, inputs: &[usize], shape: &Shape) -> bool {
    /// The number of rows, and the share that it may leave there.
    const ROWS: usize = 200;
    const LEFT: f64 = 3.0 * MOST_UNEXPLAINED;
    let count = seen.slowest(inputs.iter().copied().chain([target])).times.len();
    if count < 2 * ROWS || shape.takes_steps() {
        return true;
    }
    let design = Design::of_every(count / ROWS, seen, target, inputs, shape);
    let left = |numbers: Vec<f64>| design.left(shape, &numbers);
    design.target.len() < ROWS / 2 || design.fit(shape, |_| true).is_none_or(|numbers| left(numbers) < LEFT)
}

/// What 99.9 % of the errors do not exceed in the target's own unit; of an integral, those of its rate.
pub(crate) fn tolerance(seen: &Seen<'_>, relation: &Relation) -> f64 {
    /// The share of errors within the tolerance.
    const WITHIN: f64 = 0.999;
    let (shape, numbers) = (&relation.shape, &relation.numbers);
    let (target, inputs, shape, numbers) = match (shape, relation.window_s) {
        (Shape::Integral, Some(window_s)) => {
            (relation.inputs[0], vec![relation.target], &Shape::Rate { window_s }, vec![1.0 / numbers[0]])
        }
        _ => (relation.target, relation.inputs.clone(), shape, numbers.clone()),
    };
    let design = Design::new(seen, target, &inputs, shape);
    let errors = crate::order::sorted(design.errors(shape, &numbers).into_iter().map(f64::abs));
    let scale = seen.signals[target].unit.as_ref().map_or(1.0, |unit| unit.scale);
    crate::order::quantile(&errors, WITHIN).unwrap_or(0.0) / scale
}

/// The share of the target's standard deviation that a relation leaves unexplained in other data of the same signals, with its
/// offset fitted again; `None` where the data have no values for it.
pub(crate) fn share_elsewhere(seen: &Seen<'_>, relation: &Relation) -> Option<f64> {
    let design = Design::new(seen, relation.target, &relation.inputs, &relation.shape);
    let errors = design.errors(&relation.shape, &relation.numbers);
    let moves = deviation(design.target.iter().copied());
    (errors.len() >= 10 && moves > 0.0).then(|| deviation(errors.iter().copied()) / moves)
}

/// The largest size without the trimmed share.
fn most_of(sizes: impl Iterator<Item = f64>) -> f64 {
    crate::order::quantile(&crate::order::sorted(sizes), 1.0 - TRIMMED).unwrap_or(f64::INFINITY)
}

pub(crate) fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|it| it * it).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

pub(crate) fn deviation(values: impl Iterator<Item = f64>) -> f64 {
    crate::order::variance(&values.collect::<Vec<f64>>()).sqrt()
}
