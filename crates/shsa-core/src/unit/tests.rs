//! Tests of units.

use super::*;
use std::string::ToString;

/// Checks that `text` is this many SI units of a dimension.
#[track_caller]
fn check(text: &str, scale: f64, dimension: &str) {
    let unit = Unit::parse(text).unwrap_or_else(|error| panic!("{text}: {error}"));
    assert!((unit.scale / scale - 1.0).abs() < 1e-14, "{text} is {} SI units", unit.scale);
    assert_eq!(unit.dimension.to_string(), dimension, "of {text}");
    assert_eq!(unit.to_string(), text.trim());
}

#[track_caller]
fn check_error(text: &str, expected: &str) {
    let error = Unit::parse(text).expect_err(text);
    assert_eq!(error.to_string(), expected);
}

#[test]
fn units_of_engineers() {
    check("m/s^2", 1.0, "m/s^2");
    check("m/s²", 1.0, "m/s^2");
    check("m s⁻²", 1.0, "m/s^2");
    check("km/h", 1.0 / 3.6, "m/s");
    check("deg", core::f64::consts::PI / 180.0, "rad");
    check("°", core::f64::consts::PI / 180.0, "rad");
    check("deg/s", core::f64::consts::PI / 180.0, "rad/s");
    check("rpm", core::f64::consts::PI / 30.0, "rad/s");
    check("%", 0.01, "1");
    check("ppm", 1e-6, "1");
    check("1", 1.0, "1");
    check("1/s", 1.0, "1/s");
    check("Hz", 1.0, "1/s");
    check("V", 1.0, "V");
    check("µV", 1e-6, "V");
    check("Ah", 3600.0, "A*s");
    check("mAh", 3.6, "A*s");
    check("kPa", 1e3, "Pa");
    check("hPa", 100.0, "Pa");
    check("mbar", 100.0, "Pa");
    check("bar", 1e5, "Pa");
    check("psi", 6_894.757_293_168_361, "Pa");
    check("kg*m^2", 1.0, "kg*m^2");
    check("N m", 1.0, "J");
    check("kWh", 3.6e6, "J");
    check("J/(kg K)", 1.0, "m^2/s^2/K");
    check("ohm", 1.0, "ohm");
    check("kΩ", 1e3, "ohm");
    check("F", 1.0, "F");
    check("lx", 1.0, "cd/m^2");
    check("g", 1e-3, "kg");
    check("min", 60.0, "s");
    check("ms", 1e-3, "s");
    check("mph", 0.44704, "m/s");
    check("kn", 1852.0 / 3600.0, "m/s");
    check("ft", 0.3048, "m");
    check("inch", 0.0254, "m");
    check("l", 1e-3, "m^3");
    check(" m / s ", 1.0, "m/s");
    check("mm^2", 1e-6, "m^2");
}

#[test]
fn temperatures_convert_and_their_rates_have_no_offset() {
    let celsius = Unit::parse("degC").unwrap();
    assert_eq!(celsius.to_si(20.0), 293.15);
    assert_eq!(celsius.to_si_difference(20.0), 20.0);
    assert_eq!(Unit::parse("°C").unwrap(), celsius);
    let fahrenheit = Unit::parse("degF").unwrap();
    assert!((fahrenheit.to_si(212.0) - 373.15).abs() < 1e-9);
    assert!((fahrenheit.from_si(273.15) - 32.0).abs() < 1e-9);
    for rate in ["degC/s", "W/degC", "degC^2", "1/degC", "degC m"] {
        assert_eq!(Unit::parse(rate).unwrap().offset, 0.0, "{rate}");
    }
}

#[test]
fn intervals_convert_outward_and_exactly_in_si() {
    let third = Interval::new(0.1, 1.0 / 3.0);
    assert_eq!(Unit::parse("m/s").unwrap().to_si_interval(third), third);
    assert_eq!(Unit::parse("km").unwrap().to_si_interval(Interval::point(3.0)), Interval::point(3000.0));
    for text in ["km/h", "deg", "degC", "degF", "mm", "psi"] {
        let unit = Unit::parse(text).unwrap();
        let si = unit.to_si_interval(third);
        assert!(si.contains(unit.to_si(0.2)), "{text}");
        let back = unit.from_si_interval(si);
        assert!(back.contains(0.1) && back.contains(1.0 / 3.0) && back.width() < 0.234, "{text}: {back:?}");
    }
}

#[test]
fn errors_name_the_nearest_unit() {
    check_error("meter", "`meter` is no unit known here; did you mean `m`?");
    check_error("Degrees", "`Degrees` is no unit known here; did you mean `deg`?");
    check_error("furlong", "`furlong` is no unit known here");
    check_error("Deg", "`Deg` is no unit known here; did you mean `deg`?");
    check_error("dge", "`dge` is no unit known here; did you mean `deg`?");
    check_error("m/sek", "`sek` is no unit known here");
    check_error("kpa", "`kpa` is no unit known here; did you mean `kPa`?");
    check_error("", "a unit is missing: ``");
    check_error("m/", "a unit's name is missing: `m/`");
    check_error("m^", "this exponent is no whole number up to 127: `m^`");
    check_error("m^99 m^99", "the exponents of this unit are too large: `m^99 m^99`");
    check_error("(m", "a `)` is missing in this unit: `(m`");
    check_error("Ym", "`Ym` is no unit known here; did you mean `m`?");
    assert_eq!(Unit::parse("m/sek").expect_err("no unit").span, 2..5);
}

#[test]
fn every_name_in_the_table_reads_back() {
    for name in table::names() {
        assert!(Unit::parse(name).is_ok(), "{name}");
        assert!(name.chars().all(is_unit_char), "{name}");
    }
}

#[test]
fn the_nearest_word() {
    assert_eq!(
        nearest("lateral_aceleration", ["speed", "lateral_acceleration"]),
        Some("lateral_acceleration")
    );
    assert_eq!(nearest("sped", ["speed", "spend"]), Some("speed"));
    assert_eq!(nearest("psede", ["speed"]), None);
    assert_eq!(nearest("", ["a", "ab"]), None);
    assert_eq!(nearest("xy", ["yx"]), Some("yx"));
}

proptest::proptest! {
    #[test]
    fn any_text_is_a_unit_or_an_error(text in "[a-zA-Z0-9µ°%Ω²⁻()*/^ -]{0,30}|\\PC{0,40}") {
        if let Ok(unit) = Unit::parse(&text) {
            proptest::prop_assert!(unit.scale > 0.0 && unit.scale.is_finite());
        }
    }
}
