//! The least mean and the least median of numbers of which some may be left out.

use crate::interval::Interval;

/// The least mean of the certain numbers and any of the others, at least one in all; rounded down. `scratch` has room for all.
///
/// Of equally many numbers the smallest have the least mean. Time: n log n.
pub(super) fn least_mean(numbers: impl Iterator<Item = (f64, bool)>, scratch: &mut [f64]) -> f64 {
    let (mut sum, mut count, mut others) = (Interval::point(0.0), 0_usize, 0);
    for (number, is_certain) in numbers {
        if number == f64::NEG_INFINITY {
            return number;
        }
        if is_certain {
            (sum, count) = (sum + Interval::point(number), count + 1);
        } else if let Some(place) = scratch.get_mut(others) {
            *place = number;
            others += 1;
        }
    }
    let others = scratch.get_mut(..others).unwrap_or(&mut []);
    others.sort_unstable_by(f64::total_cmp);
    let mean = |sum: Interval, count: usize| (sum / Interval::point(count as f64)).lo();
    let mut least = if count > 0 { mean(sum, count) } else { f64::INFINITY };
    for other in others.iter() {
        (sum, count) = (sum + Interval::point(*other), count + 1);
        least = least.min(mean(sum, count));
    }
    least
}

/// The least median of the certain numbers and any of the others, at least one in all; rounded down. `scratch` has room for all.
///
/// Of equally many numbers the smallest have the least median, and each number below a median lowers it. Time: n log n.
pub(super) fn least_median(numbers: impl Iterator<Item = (f64, bool)>, scratch: &mut [f64]) -> f64 {
    let (mut front, mut count) = (0, 0);
    for (number, is_certain) in numbers {
        if let Some(place) = scratch.get_mut(count) {
            *place = number;
            if is_certain {
                scratch.swap(front, count);
                front += 1;
            }
            count += 1;
        }
    }
    let Some((certain, others)) = scratch.get_mut(..count).and_then(|all| all.split_at_mut_checked(front))
    else {
        return f64::NEG_INFINITY;
    };
    certain.sort_unstable_by(f64::total_cmp);
    others.sort_unstable_by(f64::total_cmp);
    let median = |others: &[f64]| {
        let count = certain.len() + others.len();
        let at = |place| nth(certain, others, place);
        at((count.max(1) - 1) / 2) / 2.0 + at(count / 2) / 2.0
    };
    let (mut from, mut to) = (usize::from(certain.is_empty()), others.len());
    while from < to {
        let middle = from.midpoint(to);
        let lowers =
            others.get(middle).is_some_and(|other| *other < median(others.get(..middle).unwrap_or(&[])));
        if lowers { from = middle + 1 } else { to = middle }
    }
    // Halving and adding round by less than two steps.
    median(others.get(..from).unwrap_or(&[])).next_down().next_down()
}

/// The number at a place of two ascending lists together. Time: linear.
fn nth(one: &[f64], other: &[f64], place: usize) -> f64 {
    let (mut left, mut right) = (one.iter().peekable(), other.iter().peekable());
    let mut next = || match (left.peek(), right.peek()) {
        (Some(own), Some(its)) if its < own => right.next(),
        (Some(_), _) => left.next(),
        (None, _) => right.next(),
    };
    (0..place).for_each(|_| {
        next();
    });
    next().copied().unwrap_or(f64::NAN)
}
