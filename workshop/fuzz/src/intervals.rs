//! Intervals: whatever the bounds, no bound is NaN, and hull and intersection contain the right values.

use shsa_core::interval::Interval;

/// Bounds that are critical for arithmetic.
const BOUNDS: [f64; 12] = [
    0.0,
    -0.0,
    1.0,
    -1.5,
    5e-324,
    f64::MIN_POSITIVE,
    f64::MAX,
    f64::MIN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    f64::NAN,
    core::f64::consts::PI,
];

/// Reads the bytes as numbers, five at a time: the bounds of two intervals, and a point.
pub fn run(bytes: &[u8]) {
    let (numbers, _) = bytes.as_chunks::<8>();
    let numbers: Vec<f64> = numbers.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect();
    let (cases, _) = numbers.as_chunks::<5>();
    for [a, b, c, d, point] in cases {
        check(Interval::new(*a, *b), Interval::new(*c, *d), *point);
        check(Interval::point(*a), Interval::new(*b, *c), *a);
    }
}

fn check(a: Interval, b: Interval, point: f64) {
    let (hull, common) = (a.hull(b), a.intersection(b));
    for interval in [a, b, hull, common] {
        assert!(!interval.lo().is_nan() && !interval.hi().is_nan(), "a bound is no number: {interval:?}");
        assert_eq!(interval.is_empty(), interval == Interval::EMPTY, "two kinds of empty: {interval:?}");
    }
    let (in_a, in_b) = (a.contains(point), b.contains(point));
    assert!(hull.contains(point) || !(in_a || in_b), "{point} is in {a:?} or {b:?}, but not in {hull:?}");
    assert!(
        common.contains(point) || !(in_a && in_b),
        "{point} is in {a:?} and {b:?}, but not in {common:?}"
    );
    assert_eq!(a.overlaps(b), !common.is_empty());
    assert_eq!(b.hull(a), hull);
    assert_eq!(b.intersection(a), common);
}

/// Every bound with its neighbours in the list.
#[must_use]
pub fn seeds() -> Vec<Vec<u8>> {
    BOUNDS.windows(5).map(|bounds| bounds.iter().flat_map(|bound| bound.to_le_bytes()).collect()).collect()
}
