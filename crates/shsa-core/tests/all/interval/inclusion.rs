//! Inclusion and isotonicity of every operation over wide, subnormal, huge and unbounded intervals.

use super::oracle::{Oracle, encloses, powi};
use core::cell::RefCell;
use core::f64::consts::FRAC_PI_2;
use proptest::prelude::*;
use shsa_core::interval::Interval;

type Operation = fn(Interval, Interval) -> Interval;

/// Operations with the tightest bounds, by the oracle's names for them.
const TIGHT: &[(&str, Operation)] = &[
    ("neg", |x, _| -x),
    ("add", |x, y| x + y),
    ("sub", |x, y| x - y),
    ("mul", |x, y| x * y),
    ("div", |x, y| x / y),
    ("recip", |x, _| x.recip()),
    ("sqr", |x, _| x.sqr()),
    ("sqrt", |x, _| x.sqrt()),
    ("abs", |x, _| x.abs()),
    ("min", Interval::min),
    ("max", Interval::max),
    ("floor", |x, _| x.floor()),
    ("ceil", |x, _| x.ceil()),
    ("round", |x, _| x.round()),
    ("sign", |x, _| x.sign()),
];

/// The other operations: widened by some last digits, so isotonic only up to these.
const WIDENED: &[(&str, Operation)] = &[
    ("hypot", Interval::hypot),
    ("exp", |x, _| x.exp()),
    ("ln", |x, _| x.ln()),
    ("sin", |x, _| x.sin()),
    ("cos", |x, _| x.cos()),
    ("tan", |x, _| x.tan()),
    ("asin", |x, _| x.asin()),
    ("acos", |x, _| x.acos()),
    ("atan", |x, _| x.atan()),
    ("atan2", Interval::atan2),
    ("powf", Interval::powf),
];

/// A finite number of any kind.
fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -10.0..10.0,
        2 => proptest::num::f64::NORMAL,
        1 => proptest::num::f64::SUBNORMAL,
        1 => (-40i32..40).prop_map(f64::from),
        1 => (1i32..40, -3i64..=3, any::<bool>()).prop_map(|(k, steps, negative)| {
            let near = f64::from_bits((f64::from(k) * FRAC_PI_2).to_bits().wrapping_add_signed(steps));
            if negative { -near } else { near }
        }),
        1 => prop_oneof![
            Just(0.0), Just(-0.0), Just(1.0), Just(-1.0), Just(f64::MAX), Just(f64::MIN),
            Just(f64::MIN_POSITIVE), Just(5e-324), Just(-5e-324), Just(1e16), Just(0.5),
        ],
    ]
}

/// A distance from a number to the bound of its interval.
fn margin() -> impl Strategy<Value = f64> {
    prop_oneof![
        2 => Just(0.0),
        4 => 0.0..4.0,
        1 => 0.0..1e-9,
        1 => number().prop_map(f64::abs),
        1 => Just(f64::INFINITY),
    ]
}

/// An interval and one of its members.
fn member() -> impl Strategy<Value = (Interval, f64)> {
    (number(), margin(), margin(), number(), 0.0..=1.0f64).prop_map(|(middle, below, above, any, part)| {
        let x = Interval::new(middle - below, middle + above);
        let between = x.lo() + part * (x.hi() - x.lo());
        let inside = if between.is_finite() { between } else { any };
        (x, inside.clamp(x.lo().max(f64::MIN), x.hi().min(f64::MAX)))
    })
}

thread_local! {
    static ORACLE: RefCell<Oracle> = RefCell::new(Oracle::new());
}

fn exact(name: &str, x: f64, y: f64) -> Option<astro_float_num::BigFloat> {
    ORACLE.with_borrow_mut(|oracle| oracle.value(name, x, y))
}

fn operation() -> impl Strategy<Value = (&'static str, Operation)> {
    proptest::sample::select([TIGHT, WIDENED].concat())
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(10_000) })]

    #[test]
    fn every_result_holds_the_function_of_every_member(
        (name, apply) in operation(), (a, x) in member(), (b, y) in member(),
    ) {
        prop_assert!(a.contains(x) && b.contains(y));
        let result = apply(a, b);
        if let Some(value) = exact(name, x, y) {
            prop_assert!(encloses(result, &value), "{name}({x:?}, {y:?}) = {value} is not in {result:?}");
        }
    }

    #[test]
    fn whole_powers_hold_the_power_of_every_member((a, x) in member(), n in -9i32..=9) {
        if let Some(value) = powi(x, n) {
            let result = a.powi(n);
            prop_assert!(encloses(result, &value), "{x:?}^{n} = {value} is not in {result:?}");
        }
    }

    #[test]
    fn tight_operations_are_isotonic(
        (name, apply) in proptest::sample::select(TIGHT),
        (a, x) in member(), (b, y) in member(), (c, _) in member(),
    ) {
        let whole = apply(a.hull(c), b);
        for part in [apply(a, b), apply(c, b), apply(Interval::point(x), b), apply(a, Interval::point(y))] {
            prop_assert!(whole.encloses(part), "{name}: {part:?} is not in {whole:?}");
        }
    }

    #[test]
    fn nothing_comes_from_nothing((name, apply) in operation(), (a, _) in member()) {
        let binary = ["add", "sub", "mul", "div", "hypot", "min", "max", "atan2", "powf"].contains(&name);
        prop_assert_eq!(apply(Interval::EMPTY, a), Interval::EMPTY, "{}", name);
        prop_assert!(!binary || apply(a, Interval::EMPTY) == Interval::EMPTY, "{}", name);
    }

    #[test]
    fn measures_fit((a, x) in member(), (b, y) in member()) {
        prop_assert!(a.contains(a.midpoint()));
        prop_assert!(a.magnitude() >= x.abs() && x.abs() >= a.mignitude());
        prop_assert!((x - a.lo()).abs() <= a.width());
        prop_assert!(a.distance(b) <= (x - y).abs());
        prop_assert_eq!(a.distance(b) > 0.0, !a.overlaps(b));
        prop_assert!(a.widened(1.5).encloses(a) && a.widened(1e-300).encloses(a));
        prop_assert!(a.hull(b).encloses(a) && a.hull(b).encloses(b));
        prop_assert_eq!(a.intersection(b).contains(x), b.contains(x));
    }

    #[test]
    fn comparisons_hold_for_every_choice((a, x) in member(), (b, y) in member()) {
        let cases = [(a.lt(b), x < y), (a.le(b), x <= y), (a.gt(b), x > y), (a.ge(b), x >= y), (a.eq(b), x == y)];
        for (truth, of_members) in cases {
            prop_assert!(!truth.is_true() || of_members);
            prop_assert!(!truth.is_false() || !of_members);
        }
    }
}
