//! Relations of three and four signals beyond plain sums and products: two terms of which one may have a constant with a unit,
//! products of three, the larger or smaller of two, lengths, and sources that a mode selects.

use crate::learning::form::{Design, deviation, fit, root_mean_square};
use crate::learning::gears::{self, levels};
use crate::learning::pairs::TRENDING;
use crate::learning::rows::Rows;
use crate::learning::shape::{Mode, Relation, Shape};
use crate::learning::signal::Seen;
use crate::learning::{BEATS_TIME, MOST_UNEXPLAINED};
use shsa_core::unit::Dimension;

/// The moments at which a candidate is tested before a fit, and the share that it may leave there.
const MOMENTS: usize = 200;
const PROMISING: f64 = 1.5 * MOST_UNEXPLAINED;

/// The most signals of which products of three are tried, and the most of one unit of which pairs are tried.
const MOST_OF_THREE: usize = 60;
const MOST_OF_TWO: usize = 40;

/// The share of the error without one of its terms that a relation leaves at most: each term is needed.
const NEEDED: f64 = 0.4;

/// The most terms of which all pairs are tried.
const MOST_TERMS: usize = 60;

/// The relations of these forms that hold for a target, with every term needed.
pub(crate) fn of(
    seen: &Seen<'_>,
    signals: &[usize],
    target: usize,
    is_same: &dyn Fn(usize, usize) -> bool,
) -> Vec<Relation> {
    let others: Vec<usize> =
        signals.iter().copied().filter(|it| *it != target && !is_same(*it, target)).collect();
    let mut found: Vec<Relation> = two_terms(seen, target, &others).into_iter().collect();
    found.extend(products_of_three(seen, target, &others));
    found.extend(of_two(seen, target, &others));
    found.extend(projections(seen, target, &others));
    found.extend(modes(seen, target, &others));
    found
}

/// A term: signals with their powers, and whether its constant needs a unit.
#[derive(Clone, Debug)]
struct Term {
    powers: Vec<(usize, i8)>,
    has_unit: bool,
}

impl Term {
    fn signals(&self) -> impl Iterator<Item = usize> + '_ {
        self.powers.iter().map(|it| it.0)
    }
}

/// The terms that a target may have: other signals, their squares, and products whose units match.
fn terms(seen: &Seen<'_>, target: usize, others: &[usize]) -> Vec<Term> {
    let Some(own) = seen.dimension(target) else { return Vec::new() };
    let is_amount = |signal: &usize| !is_point(seen, *signal) && seen.dimension(*signal).is_some();
    let mut terms = Vec::new();
    for &one in others.iter().filter(|it| seen.dimension(**it).is_some()) {
        terms.push(Term { powers: vec![(one, 1)], has_unit: seen.dimension(one) != Some(own) });
    }
    for (at, &one) in others.iter().enumerate().filter(|it| is_amount(it.1)) {
        for &other in others[at + 1..].iter().filter(|it| is_amount(it)) {
            if times(seen, one, other, 1) == Some(own) {
                terms.push(Term { powers: vec![(one, 1), (other, 1)], has_unit: false });
            }
            for (upper, lower) in [(one, other), (other, one)] {
                if times(seen, upper, lower, -1) == Some(own) {
                    terms.push(Term { powers: vec![(upper, 1), (lower, -1)], has_unit: false });
                }
            }
        }
        let has_unit = times(seen, one, one, 1) != Some(own);
        terms.push(Term { powers: vec![(one, 2)], has_unit });
    }
    terms
}

fn is_point(seen: &Seen<'_>, signal: usize) -> bool {
    seen.signals[signal].unit.as_ref().is_some_and(|unit| unit.is_affine())
}

fn times(seen: &Seen<'_>, one: usize, other: usize, power: i8) -> Option<Dimension> {
    seen.dimension(one)?.times(seen.dimension(other)?.power(power)?)
}

/// Sums of two terms, or of a product and a constant: the best of each set of signals.
fn two_terms(seen: &Seen<'_>, target: usize, others: &[usize]) -> Option<Relation> {
    let terms = terms(seen, target, others);
    let rows = Rows::new(seen, target, others, MOMENTS)?;
    let columns: Vec<Vec<f64>> = terms.iter().map(|term| rows.of(&term.powers)).collect();
    let kept = rows.nearest(&columns, MOST_TERMS);
    let mut rated: Vec<(f64, Vec<usize>)> = Vec::new();
    for (at, &one) in kept.iter().enumerate() {
        if terms[one].powers.len() > 1 {
            rated.push((rows.left(&columns, &[one]), vec![one]));
        }
        for &other in &kept[at + 1..] {
            if may_join(&terms[one], &terms[other]) {
                rated.push((rows.left(&columns, &[one, other]), vec![one, other]));
            }
        }
    }
    rated.retain(|it| it.0 < PROMISING);
    rated.sort_by(|one, other| one.0.total_cmp(&other.0));
    let best = rated.into_iter().take(3).filter_map(|(_, chosen)| {
        let chosen: Vec<&Term> = chosen.iter().map(|it| &terms[*it]).collect();
        needed(seen, target, &chosen)
    });
    best.min_by(|one, other| one.score.all().total_cmp(&other.score.all()))
}

/// Whether two terms make a sum that is searched here.
fn may_join(one: &Term, other: &Term) -> bool {
    let is_square = |term: &Term| term.powers.len() == 1 && term.powers[0].1 == 2;
    let is_plain = |term: &Term| term.powers.len() == 1 && term.powers[0].1 == 1;
    let count: usize = {
        let mut all: Vec<usize> = one.signals().chain(other.signals()).collect();
        all.sort_unstable();
        all.dedup();
        all.len()
    };
    // Sums of plain signals of one unit are searched elsewhere; a polynomial of one signal, too.
    let is_sum = is_plain(one) && is_plain(other) && !one.has_unit && !other.has_unit;
    count > 1 && !is_sum && !(is_square(one) && is_square(other))
}

/// The fit of a sum of which each term is needed, and which says more than time.
fn needed(seen: &Seen<'_>, target: usize, terms: &[&Term]) -> Option<Relation> {
    let found = fit_terms(seen, target, terms).filter(|it| it.score.worst() <= MOST_UNEXPLAINED)?;
    let design = Design::new(seen, target, &found.inputs, &found.shape);
    let by_time = design.left_by_time();
    if by_time < TRENDING || design.left(&found.shape, &found.numbers) > BEATS_TIME * by_time {
        return None;
    }
    let is_needed = |left_out: usize| {
        let rest: Vec<&Term> =
            terms.iter().enumerate().filter(|it| it.0 != left_out).map(|it| *it.1).collect();
        rest.is_empty()
            || fit_terms(seen, target, &rest).is_none_or(|it| found.score.all() < NEEDED * it.score.all())
    };
    (0..terms.len()).all(is_needed).then_some(found)
}

fn fit_terms(seen: &Seen<'_>, target: usize, terms: &[&Term]) -> Option<Relation> {
    let mut inputs: Vec<usize> = terms.iter().flat_map(|term| term.signals()).collect();
    inputs.sort_unstable();
    inputs.dedup();
    let power = |term: &Term, input: usize| term.powers.iter().find(|it| it.0 == input).map_or(0, |it| it.1);
    let powers = terms.iter().map(|term| inputs.iter().map(|input| power(term, *input)).collect()).collect();
    fit(seen, target, &inputs, &Shape::Terms(powers))
}

/// Products of three with powers of 1 and -1 whose units match.
fn products_of_three(seen: &Seen<'_>, target: usize, others: &[usize]) -> Vec<Relation> {
    let Some(own) = seen.dimension(target).filter(|_| !is_point(seen, target)) else { return Vec::new() };
    let others: Vec<usize> =
        others.iter().copied().filter(|it| !is_point(seen, *it) && seen.dimension(*it).is_some()).collect();
    let Some(rows) = Rows::new(seen, target, &others, MOMENTS).filter(|_| others.len() <= MOST_OF_THREE)
    else {
        return Vec::new();
    };
    let mut found = Vec::new();
    for (at, &one) in others.iter().enumerate() {
        for (next, &two) in others.iter().enumerate().skip(at + 1) {
            for &three in &others[next + 1..] {
                for signs in
                    [[1, 1, 1], [1, 1, -1], [1, -1, 1], [-1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]
                {
                    let powers: Vec<(usize, i8)> = [one, two, three].into_iter().zip(signs).collect();
                    let dimension = powers.iter().try_fold(Dimension::PLAIN, |of, (signal, power)| {
                        of.times(seen.dimension(*signal)?.power(*power)?)
                    });
                    let cancels = || {
                        let of = |sign: i8| powers.iter().filter(move |it| it.1 == sign);
                        of(1).any(|one| of(-1).any(|other| seen.dimension(one.0) == seen.dimension(other.0)))
                    };
                    if cancels() {
                        continue;
                    }
                    if dimension != Some(own) || !rows.is_multiple(&rows.of(&powers), PROMISING) {
                        continue;
                    }
                    found.extend(
                        fit(seen, target, &[one, two, three], &Shape::Product(signs.to_vec()))
                            .filter(|it| it.score.worst() <= MOST_UNEXPLAINED),
                    );
                }
            }
        }
    }
    found
}

/// The larger, the smaller, and the length of two.
fn of_two(seen: &Seen<'_>, target: usize, others: &[usize]) -> Vec<Relation> {
    let alike: Vec<usize> = others.iter().copied().filter(|it| seen.is_addable(*it, target)).collect();
    let Some(rows) = Rows::new(seen, target, &alike, MOMENTS) else { return Vec::new() };
    let columns: Vec<Vec<f64>> = alike.iter().map(|it| rows.value(*it).to_vec()).collect();
    let alike: Vec<usize> = rows.nearest(&columns, MOST_OF_TWO).into_iter().map(|it| alike[it]).collect();
    let mut found = Vec::new();
    for (at, &one) in alike.iter().enumerate() {
        for &other in &alike[at + 1..] {
            let pair = |of: fn(f64, f64) -> f64| rows.apart(one, other, of) < PROMISING;
            let is_choice = |of: fn(f64, f64) -> f64| pair(of) && rows.takes_both(one, other, of);
            let mut shapes = Vec::new();
            if is_choice(f64::max) {
                shapes.push(Shape::Largest);
            }
            if is_choice(f64::min) {
                shapes.push(Shape::Smallest);
            }
            if !is_point(seen, target) && pair(f64::hypot) {
                shapes.push(Shape::Norm);
            }
            let fitted = shapes.iter().filter_map(|shape| fit(seen, target, &[one, other], shape));
            found.extend(fitted.filter(|it| {
                it.score.worst() <= MOST_UNEXPLAINED && both_needed(seen, it, target, [one, other])
            }));
        }
    }
    found
}

/// Products with the cosine or the sine of an angle.
fn projections(seen: &Seen<'_>, target: usize, others: &[usize]) -> Vec<Relation> {
    let is_angle = |signal: &usize| {
        let unit = seen.signals[*signal].unit.as_ref();
        unit.is_some_and(|unit| unit.dimension == Dimension::ANGLE)
    };
    let lengths = || others.iter().copied().filter(|it| seen.is_addable(*it, target) && !is_point(seen, *it));
    let mut found = Vec::new();
    for &angle in others.iter().filter(|it| is_angle(it)) {
        for length in lengths().filter(|it| *it != angle) {
            let Some(rows) = Rows::new(seen, target, &[length, angle], MOMENTS) else { continue };
            for is_sine in [false, true] {
                let of = |length: f64, angle: f64| length * if is_sine { angle.sin() } else { angle.cos() };
                let pairs = rows.value(length).iter().zip(rows.value(angle));
                let column: Vec<f64> = pairs.map(|(length, angle)| of(*length, *angle)).collect();
                if rows.is_multiple(&column, PROMISING) {
                    let shape = Shape::Projected { is_sine };
                    found.extend(
                        fit(seen, target, &[length, angle], &shape)
                            .filter(|it| it.score.worst() <= MOST_UNEXPLAINED),
                    );
                }
            }
        }
    }
    found
}

/// Whether a relation of two leaves much less than either of them alone.
fn both_needed(seen: &Seen<'_>, found: &Relation, target: usize, inputs: [usize; 2]) -> bool {
    let is_worse = |input: usize| {
        fit(seen, target, &[input], &Shape::Line { lag_s: 0.0 })
            .is_none_or(|alone| found.score.all() < NEEDED * alone.score.all())
    };
    inputs.into_iter().all(is_worse)
}

/// Sources that a signal with few levels selects: for each level the input that the target equals but for a factor.
fn modes(seen: &Seen<'_>, target: usize, others: &[usize]) -> Vec<Relation> {
    let mut found = Vec::new();
    for &chooser in others {
        let Some(levels) = levels(seen, chooser) else { continue };
        let alike: Vec<usize> =
            others.iter().copied().filter(|it| *it != chooser && seen.is_addable(*it, target)).collect();
        let best = |level: &f64| {
            let of = |input: &usize| Some((*input, left_at(seen, target, *input, chooser, *level)?));
            alike.iter().filter_map(of).min_by(|one, other| one.1.total_cmp(&other.1))
        };
        let chosen: Option<Vec<(usize, f64)>> = levels.iter().map(best).collect();
        let Some(chosen) = chosen.filter(|it| it.iter().all(|it| it.1 < 2.0 * PROMISING)) else { continue };
        let mut inputs: Vec<usize> = chosen.iter().map(|it| it.0).collect();
        inputs.sort_unstable();
        inputs.dedup();
        if inputs.len() < 2 {
            continue;
        }
        let place = |input: usize| inputs.iter().position(|it| *it == input).unwrap_or(0);
        let modes: Vec<Mode> = levels
            .iter()
            .zip(&chosen)
            .map(|(level, (input, _))| Mode { level: *level, input: place(*input) })
            .collect();
        inputs.push(chooser);
        let shape = Shape::Modes(modes);
        found.extend(fit(seen, target, &inputs, &shape).filter(|it| gears::holds(seen, it)));
    }
    found
}

/// The share that a multiple of an input leaves of the target while another signal has a level.
fn left_at(seen: &Seen<'_>, target: usize, input: usize, chooser: usize, level: f64) -> Option<f64> {
    let clock = seen.slowest([target, input, chooser]);
    let is_on = |row: &usize| seen.curves[chooser].nearest(clock.times[*row]) == Some(level);
    let rows: Vec<(f64, f64)> = (0..clock.times.len())
        .filter(is_on)
        .map(|row| (clock.values[target][row], clock.values[input][row]))
        .filter(|it| it.0.is_finite() && it.1.is_finite())
        .collect();
    let (together, size) =
        rows.iter().fold((0.0, 0.0), |(together, size), it| (together + it.0 * it.1, size + it.1 * it.1));
    let mut left: Vec<f64> = rows.iter().map(|it| (it.0 - together / size * it.1).abs()).collect();
    left.sort_unstable_by(f64::total_cmp);
    // The samples around each change are wrong.
    left.truncate(left.len() * 9 / 10);
    let moves = deviation(rows.iter().map(|it| it.0));
    (rows.len() >= 20 && moves > 0.0).then(|| root_mean_square(&left) / moves)
}
