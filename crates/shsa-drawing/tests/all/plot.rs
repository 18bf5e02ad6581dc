//! Charts: what is shown, what is left out, and hostile input.

use super::keep;
use proptest::prelude::*;
use shsa_drawing::{Axis, Band, Chart, Mark, Point, Scale, Series, Slice, Timeline};

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
fn what_an_axis_cannot_show_is_reported() {
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

fn slice(at: f64, low: f64, high: f64) -> Slice {
    Slice { at, low, high }
}

/// Two witnesses, and one that leaves them at 12 s.
fn lie() -> Timeline {
    let band = |name: &str, is_accused, value: fn(f64) -> f64, every: usize| Band {
        name: name.into(),
        is_accused,
        slices: (0..200)
            .step_by(every)
            .map(|tenth| f64::from(tenth) / 10.0)
            .map(|at| slice(at, value(at) - 0.4, value(at) + 0.4))
            .collect(),
    };
    let truth = |at: f64| 12.0 + (at / 3.0).sin();
    Timeline {
        title: "wheel_1 failed at 12.4 s: speed".into(),
        span: (5.0, 20.0),
        y: axis("speed (m/s)", "", Scale::Linear),
        bands: vec![
            band("wheel_1", true, |at| 12.0 + (at / 3.0).sin() + if at > 12.0 { 2.0 } else { 0.0 }, 1),
            band("wheel_2", false, truth, 1),
            band("gnss", false, truth, 5),
        ],
        shaded: vec![(12.0, 20.0)],
        shade: "disagreement".into(),
        marks: ["onset", "failed", "substituted"]
            .iter()
            .zip([12.1, 12.4, 12.45])
            .map(|(name, at)| Mark { at, name: (*name).into() })
            .collect(),
        notes: vec!["two more ways are not drawn".into()],
    }
}

#[test]
fn a_timeline_shows_bands_shades_and_marks() {
    let root = keep("timeline.svg", &lie().svg());
    let texts = root.texts("text");
    for text in ["onset 12.1 s", "failed 12.4 s", "substituted 12.45 s", "disagreement", "time (s)", "gnss"] {
        assert!(texts.contains(&text), "{text} is not in {texts:?}");
    }
    let width: f64 = root.attribute("width").and_then(|width| width.parse().ok()).unwrap();
    assert!((700.0..=920.0).contains(&width), "{width}");
}

#[test]
fn a_band_is_broken_where_nothing_came() {
    let with_gap = |from: f64, to: f64| {
        let mut timeline = lie();
        timeline.bands.truncate(1);
        timeline.bands[0].slices.retain(|slice| slice.at < from || slice.at > to);
        keep("gap.svg", &timeline.svg())
            .all()
            .into_iter()
            .filter(|each| each.attribute("class") == Some("shsa-strong"))
            .count()
    };
    // One for the band, one for the legend.
    assert_eq!(with_gap(9.0, 9.0), 2);
    assert_eq!(with_gap(9.0, 11.0), 3);
}

#[test]
fn a_timeline_of_nothing_says_so() {
    let root = keep("timeless.svg", &Timeline::default().svg());
    assert!(root.texts("text").contains(&"no values"));
}

proptest! {
    #[test]
    fn any_timeline_is_well_formed(
        title in ".*", span in (value(), value()), shaded in prop::collection::vec((value(), value()), 0..4),
        bands in prop::collection::vec((".*", any::<bool>(), prop::collection::vec((value(), value(), value()), 0..6)), 0..9),
        marks in prop::collection::vec((value(), ".*"), 0..6),
    ) {
        let slices = |values: Vec<(f64, f64, f64)>| values.into_iter().map(|(at, low, high)| slice(at, low, high)).collect();
        let timeline = Timeline {
            title: title.clone(),
            span,
            y: axis(&title, "", Scale::Linear),
            bands: bands.into_iter().map(|(name, is_accused, values)| Band { name, is_accused, slices: slices(values) }).collect(),
            shaded,
            shade: title,
            marks: marks.into_iter().map(|(at, name)| Mark { at, name }).collect(),
            notes: Vec::new(),
        };
        keep("random-timeline.svg", &timeline.svg());
    }
}
