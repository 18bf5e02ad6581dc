//! Associations that are read, and their errors.

use super::*;
use shsa_core::time::Time;
use shsa_estimate::association::Track;

const WHOLE: &str = "
associations:
  border:
    sensors:
      entering:
        { tracks: /radar/2, x: 'tracks[].x', y: 'tracks[].y', speed_x: 'tracks[].v', error: [1.2, 0.6], time: t*1ms, output: /entering }
      told: { tracks: /vehicles, id: id, x: x, y: y, speed_y: v, max_age: 600 ms, error: [1, 0.5] }
    misplaced: [3, 0.7]
    gate: 0.99
    region: x > 100
    inner: x > 120
    near: [150, 2]
    count_over: 4 s
    pause: 400 ms
    objects: /border/objects
";

#[test]
fn an_association_is_read() {
    let mut read = Associations::read(WHOLE, "border.yaml").unwrap();
    let border = &mut read.associations[0];
    let [entering, vehicles] = border.sensors.as_slice() else { panic!("{:?}", border.sensors) };
    assert_eq!((border.name.as_str(), border.objects.as_deref()), ("border", Some("/border/objects")));
    let path = |text: &str| text.to_owned();
    assert_eq!(
        entering.fields,
        [(Part::X, path("tracks[].x")), (Part::Y, path("tracks[].y")), (Part::SpeedX, path("tracks[].v"))]
    );
    let step = Some(Span::from_millis(1));
    assert_eq!(entering.time, Some(StampField { path: "t".into(), step }));
    assert_eq!(entering.max_age, Span::from_millis(1_000));
    assert_eq!((vehicles.max_age, &vehicles.output), (Span::from_millis(600), &None));
    assert!(vehicles.fields.contains(&(Part::Id, path("id"))));
    let track = |x: f64| Track { at: Time(0), position: [x, 0.0], velocity: [0.0, 0.0] };
    let found = border.associator.associate(&[Some(&[track(99.0), track(110.0)]), Some(&[])], Time(0));
    assert_eq!((found.objects.len(), found.counts), (1, vec![Some(0.0), Some(0.0)]));
}

/// The first problem: where, what, and the help.
#[track_caller]
fn check_wrong(text: &str, expected: &str) {
    let report = Associations::read(text, "border.yaml").unwrap_err();
    let first = &report.diagnostics[0];
    let help = first.help.clone().unwrap_or_default();
    let found = format!("{}:{} {}; {help}", first.line, first.column, first.message);
    assert!(found.starts_with(expected), "{found}");
}

#[test]
fn what_is_wrong_is_reported_with_its_place() {
    let with = |old: &str, new: &str| {
        assert!(WHOLE.contains(old));
        WHOLE.replace(old, new)
    };
    check_wrong("", "1:1 there are no associations");
    check_wrong("associations: {}", "1:15 there are no associations; write them like");
    check_wrong("associations: { a: {} }", "1:17 `a` has no sensors; write them like");
    check_wrong("associations: { a: { sensors: {} } }", "1:31 from 1 to 16 sensors are expected, found 0");
    check_wrong(&with("near:", "nearby:"), "12:5 unknown key `nearby`; did you mean `near`?");
    check_wrong(&with("time:", "tim:"), "6:");
    check_wrong(
        &with("error: [1, 0.5]", "error: [1 m, 0.5]"),
        "7:91 `1 m` is no number; numbers have no units",
    );
    check_wrong(&with("error: [1, 0.5]", "error: 1"), "7:90 expected two numbers, found one value");
    check_wrong(&with(", error: [1, 0.5]", ""), "7:7 the sensor `told` has no `error`; write it like");
    check_wrong(
        &with("error: [1, 0.5]", "error: [0, 0.5]"),
        "3:3 in `border`, an error is 0, and must be above 0",
    );
    check_wrong(&with("region: x > 100", "region: x"), "10:13 the formula of a region `x`");
    check_wrong(
        &with("region: x > 100", "region: a > 1"),
        "10:13 the formula of a region `a > 1`: `a` is not defined",
    );
    check_wrong(&with("pause: 400 ms", "pause: 400"), "14:12 '400' has no unit of time");
    check_wrong(&with("x: x", "x: a..b"), "7:45 `a..b` names nothing between two dots");
}
