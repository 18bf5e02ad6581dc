//! The inverses of a table: one for each stretch in which it only rises or only falls.

use super::curve::Point;
use alloc::vec::Vec;

/// The tables whose values are the arguments of a table. A level stretch becomes a jump, and a jump a level stretch. A table that
/// is level everywhere has none. Time: linear in the points.
pub(super) fn inverses(points: &[Point]) -> Vec<Vec<Point>> {
    let mut runs: Vec<Vec<Point>> = Vec::new();
    let mut run: Vec<Point> = Vec::new();
    let mut is_rising = None;
    for point in points {
        let step = run.last().map_or(0.0, |last| point.value.value - last.value.value);
        let turns = step != 0.0 && is_rising.is_some_and(|rising| rising != (step > 0.0));
        if turns {
            let corner = run.last().copied();
            runs.push(inverted(core::mem::take(&mut run), is_rising));
            run.extend(corner);
        }
        if step != 0.0 {
            is_rising = Some(step > 0.0);
        }
        run.push(*point);
    }
    if is_rising.is_some() {
        runs.push(inverted(run, is_rising));
    }
    runs
}

fn inverted(run: Vec<Point>, is_rising: Option<bool>) -> Vec<Point> {
    let mut inverse: Vec<Point> =
        run.into_iter().map(|Point { at, value }| Point { at: value, value: at }).collect();
    if is_rising == Some(false) {
        inverse.reverse();
    }
    inverse
}
