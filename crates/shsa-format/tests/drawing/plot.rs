//! Charts: what is shown, what is left out, and hostile input.

use crate::keep;
use proptest::prelude::*;
use shsa_format::drawing::{Axis, Chart, Point, Scale, Series};

fn axis(label: &str, unit: &str, scale: Scale) -> Axis {
    Axis { label: label.into(), unit: unit.into(), scale }
}

/// As a benchmark over depth: times that grow exponentially, with spread.
fn searches() -> Chart {
    let engines = [
        "best_first",
        "property_guided",
        "ontology",
        "depth_first, all",
        "exhaustive",
        "breadth-first visit",
    ];
    let series = engines.iter().enumerate().map(|(at, name)| {
        let factor = 1.6 + 0.35 * at as f64;
        let last = if at == 4 { 6 } else { 10 };
        let point = |depth: i32| {
            let y = 2e-7 * (1.0 + at as f64) * factor.powi(depth);
            Point { x: f64::from(depth), low: y * 0.7, y, high: y * (1.3 + 0.2 * at as f64) }
        };
        Series { name: (*name).into(), points: (1..=last).map(point).collect() }
    });
    Chart {
        title: "ex2: time to the first answer by depth".into(),
        x: axis("depth of the tree", "", Scale::Linear),
        y: axis("time of a search", "s", Scale::Log),
        series: series.collect(),
    }
}

#[test]
fn a_chart_shows_each_point_with_its_tooltip() {
    let root = keep("searches.svg", &searches().svg());
    let tooltips = root.texts("title");
    assert_eq!(tooltips[0], "ex2: time to the first answer by depth");
    assert!(tooltips.contains(&"best_first at 1: 320 ns (224 ns to 416 ns)"), "{tooltips:?}");
    let points = tooltips.iter().filter(|title| title.contains(" at ")).count();
    assert_eq!(points, 5 * 10 + 6);
    let texts = root.texts("text");
    for text in ["100 µs", "depth of the tree", "time of a search", "depth_first, all"] {
        assert!(texts.contains(&text), "{text} is not in {texts:?}");
    }
}

#[test]
fn only_what_is_narrow_shrinks_with_its_page() {
    let short = keep("searches.svg", &searches().svg());
    assert_eq!(short.attribute("style"), Some("max-width:100%;height:auto"));
    let long = Chart { title: "a title ".repeat(40), ..searches() };
    assert_eq!(keep("wide.svg", &long.svg()).attribute("style"), None);
}

#[test]
fn growth_over_four_decades() {
    let point = |exponent: i32, base: f64| Point::exact(10f64.powi(exponent), base * 10f64.powi(exponent));
    let series = |name: &str, base: f64| Series {
        name: name.into(),
        points: (3..=6).map(|exponent| point(exponent, base)).collect(),
    };
    let chart = Chart {
        title: "Memory by size".into(),
        x: axis("relations", "", Scale::Log),
        y: axis("peak memory", "B", Scale::Log),
        series: vec![series("resident", 900.0), series("file", 110.0)],
    };
    let root = keep("memory.svg", &chart.svg());
    for text in ["1,000,000", "1 MB", "100 MB"] {
        assert!(root.texts("text").contains(&text), "{text}");
    }
}

#[test]
fn what_an_axis_cannot_show_is_told() {
    let points = [0.0, -1.0, f64::NAN, f64::INFINITY, 5.0].map(|y| Point::exact(1.0, y)).to_vec();
    let series = vec![Series { name: "odd".into(), points }];
    let y = axis("y", "", Scale::Log);
    let root = keep("odd.svg", &Chart { title: "Odd".into(), x: Axis::default(), y, series }.svg());
    assert!(root.texts("text").contains(&"4 of 5 values have no place on these axes and are left out"));
    let root = keep("empty.svg", &Chart { title: "Nothing".into(), ..Chart::default() }.svg());
    assert!(root.texts("text").contains(&"no values"));
}

#[test]
fn many_series_and_linear_axes() {
    let series = (0..16).map(|at| {
        let point = |x: i32| Point::exact(f64::from(x), f64::from(x * (at + 1)).sqrt());
        Series { name: format!("series number {at} of a long name"), points: (0..12).map(point).collect() }
    });
    let chart = Chart {
        title: "Many".into(),
        x: axis("x", "", Scale::Linear),
        y: axis("distance", "m", Scale::Linear),
        series: series.collect(),
    };
    keep("many.svg", &chart.svg());
}

fn value() -> impl Strategy<Value = f64> {
    prop_oneof![any::<f64>(), -10.0..10.0, Just(0.0), Just(f64::MAX), Just(f64::MIN_POSITIVE), Just(1e16)]
}

proptest! {
    #[test]
    fn any_chart_is_well_formed(
        title in ".*", label in ".*", unit in ".{0,3}", x_log: bool, y_log: bool,
        series in prop::collection::vec((".*", prop::collection::vec((value(), value(), value(), value()), 0..6)), 0..9),
    ) {
        let scale = |log| if log { Scale::Log } else { Scale::Linear };
        let points = |values: Vec<(f64, f64, f64, f64)>| {
            values.into_iter().map(|(x, low, y, high)| Point { x, low, y, high }).collect()
        };
        let series = series.into_iter().map(|(name, values)| Series { name, points: points(values) });
        let chart = Chart {
            title,
            x: Axis { label: label.clone(), unit: unit.clone(), scale: scale(x_log) },
            y: Axis { label, unit, scale: scale(y_log) },
            series: series.collect(),
        };
        let svg = chart.svg();
        keep("random.svg", &svg);
        prop_assert_eq!(svg, chart.svg());
    }
}
