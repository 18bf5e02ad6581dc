//! Methods without a model: intervals, windows, averages by confidence.

use super::{is_near, number};
use crate::oracle::Compared;
use serde::Deserialize;
use shsa_core::interval::Interval;
use shsa_estimate::average::{Certain, Filling, MovingAverage, Window, by_confidence};
use shsa_estimate::interval_fusion::{Regions, best, brooks_iyengar, marzullo, schmid};

/// The largest difference of two numbers.
const TOLERANCE: f64 = 1e-12;

#[derive(Deserialize)]
pub(super) struct Intervals {
    intervals: Vec<[f64; 2]>,
    f: usize,
    truth: f64,
    marzullo: Option<[f64; 2]>,
    schmid: Option<[f64; 2]>,
    brooks_iyengar: Option<BrooksIyengar>,
    best: Best,
    guaranteed: bool,
}

#[derive(Deserialize)]
struct BrooksIyengar {
    estimate: f64,
    regions: Vec<[f64; 3]>,
}

#[derive(Deserialize)]
struct Best {
    count: usize,
    regions: Vec<[f64; 2]>,
}

/// All rules on all cases; one answer a case.
pub(super) fn compare_intervals(cases: &[Intervals], compared: &mut Compared) {
    for (place, case) in cases.iter().enumerate() {
        compared.answer(interval_differences(&format!("intervals {place}"), case));
    }
}

fn interval_differences(label: &str, case: &Intervals) -> Vec<String> {
    let all: Vec<Interval> = case.intervals.iter().map(|[lo, hi]| Interval::new(*lo, *hi)).collect();
    let mut differences = Vec::new();
    let tolerant = marzullo(&all, case.f);
    for (what, found, wanted) in
        [("marzullo", tolerant, case.marzullo), ("schmid", schmid(&all, case.f), case.schmid)]
    {
        let ends = found.map(|it| [it.lo(), it.hi()]);
        if !are_near(&ends.unwrap_or_default(), &wanted.unwrap_or_default())
            || ends.is_some() != wanted.is_some()
        {
            differences.push(format!("{label}: {what} is {ends:?}, not {wanted:?}"));
        }
    }
    if case.guaranteed && !tolerant.is_some_and(|it| it.contains(case.truth)) {
        differences.push(format!("{label}: {tolerant:?} does not hold {}", case.truth));
    }
    let mut regions = Regions::new(all.len());
    brooks_iyengar(&all, case.f, &mut regions);
    let wanted = case.brooks_iyengar.as_ref();
    differences.extend(number(
        label,
        "the estimate",
        regions.estimate(),
        wanted.map(|it| it.estimate),
        TOLERANCE,
    ));
    let found: Vec<[f64; 3]> =
        regions.regions().iter().map(|(it, count)| [it.lo(), it.hi(), *count as f64]).collect();
    let wanted = wanted.map_or(&[][..], |it| &it.regions);
    if !are_near(found.as_flattened(), wanted.as_flattened()) {
        differences.push(format!("{label}: regions are {found:?}, not {wanted:?}"));
    }
    let count = best(&all, &mut regions);
    let found: Vec<[f64; 2]> = regions.regions().iter().map(|(it, _)| [it.lo(), it.hi()]).collect();
    if count != case.best.count || !are_near(found.as_flattened(), case.best.regions.as_flattened()) {
        differences.push(format!("{label}: best are {count} in {found:?}, not {:?}", case.best.regions));
    }
    differences
}

fn are_near(found: &[f64], wanted: &[f64]) -> bool {
    found.len() == wanted.len()
        && found.iter().zip(wanted).all(|(found, wanted)| is_near(Some(*found), Some(*wanted), TOLERANCE))
}

#[derive(Deserialize)]
pub(super) struct Moving {
    window: usize,
    weights_newest_first: Option<Vec<f64>>,
    values: Vec<Option<f64>>,
    average: Vec<Option<f64>>,
    average_full_windows_only: Vec<Option<f64>>,
    average_echo_until_full: Vec<Option<f64>>,
    median: Vec<Option<f64>>,
    median_lower: Vec<Option<f64>>,
    median_upper: Vec<Option<f64>>,
}

/// Moving averages and medians; one answer a value.
pub(super) fn compare_moving(case: &Moving, compared: &mut Compared) -> anyhow::Result<()> {
    let weights = case.weights_newest_first.clone().unwrap_or(vec![1.0; case.window]);
    let mut partial = MovingAverage::new(&weights, Filling::Partial)?;
    let mut echo = MovingAverage::new(&weights, Filling::Echo)?;
    let mut window = Window::new(case.window);
    // A missing value changes nothing.
    let (mut average, mut echoed) = (None, None);
    for (place, value) in case.values.iter().enumerate() {
        if let Some(value) = value {
            average = Some(partial.push(*value));
            echoed = Some(echo.push(*value));
            window.push(*value);
        }
        let (lower, upper) = window.middle().unzip();
        let label = format!("window {} value {place}", case.window);
        let differences = [
            ("average", average, case.average[place]),
            ("full", average.filter(|_| window.is_full()), case.average_full_windows_only[place]),
            ("echo", echoed, case.average_echo_until_full[place]),
            ("median", window.median(), case.median[place]),
            ("lower", lower, case.median_lower[place]),
            ("upper", upper, case.median_upper[place]),
        ];
        let differences = differences.into_iter();
        compared.answer(
            differences
                .filter_map(|(what, found, wanted)| number(&label, what, found, wanted, TOLERANCE))
                .collect(),
        );
    }
    Ok(())
}

#[derive(Deserialize)]
pub(super) struct Recursive {
    in_weights_newest_first: Vec<f64>,
    out_weights_newest_first: Vec<f64>,
    values: Vec<f64>,
    output: Vec<f64>,
}

/// Recursive moving averages; one answer a value.
pub(super) fn compare_recursive(case: &Recursive, compared: &mut Compared) -> anyhow::Result<()> {
    let (weights, output_weights) = (&case.in_weights_newest_first, &case.out_weights_newest_first);
    let mut average = MovingAverage::recursive(weights, output_weights, Filling::Echo)?;
    for (value, wanted) in case.values.iter().zip(&case.output) {
        let found = Some(average.push(*value));
        let difference = number("recursive average", "the output", found, Some(*wanted), TOLERANCE);
        compared.answer(difference.into_iter().collect());
    }
    Ok(())
}

#[derive(Deserialize)]
pub(super) struct Weighted {
    values: Vec<Option<f64>>,
    variances: Vec<f64>,
    value: f64,
    variance: f64,
    chi_square: f64,
    dof: usize,
}

/// Averages by confidence; one answer a case.
pub(super) fn compare_weighted(cases: &[Weighted], compared: &mut Compared) {
    for (place, case) in cases.iter().enumerate() {
        let label = format!("weighted {place}");
        let pairs: Vec<_> = case.values.iter().copied().zip(case.variances.iter().copied()).collect();
        let found = by_confidence(&pairs, Certain::Refused).ok();
        let numbers = [
            ("value", found.map(|it| it.value), case.value),
            ("variance", found.map(|it| it.variance), case.variance),
            ("chi-square", found.map(|it| it.chi_square), case.chi_square),
            ("dof", found.map(|it| it.count as f64 - 1.0), case.dof as f64),
        ];
        let numbers = numbers.into_iter();
        compared.answer(
            numbers
                .filter_map(|(what, found, wanted)| number(&label, what, found, Some(wanted), TOLERANCE))
                .collect(),
        );
    }
}
