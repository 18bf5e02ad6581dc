//! Lists of objects, of which each element gives a number.

use super::{check, check_stamped};

#[test]
fn a_member_of_each_element_is_a_list() {
    let tracks = r#"{"t": 5, "tracks": [{"pose": {"x": 1.5}}, {"pose": {"x": null}}, {"at": [4, 2]}]}"#;
    check_stamped("tracks[].pose.x", "t", tracks, "[1.5, NaN, NaN] at 5000000000");
    check("tracks[].at[1]", tracks, "[NaN, NaN, 2.0]");
    check("[].x", r#"[{"x": 1}, {"y": 2, "x": "3"}]"#, "[1.0, 3.0]");
    check("tracks[].x", r#"{"tracks": []}"#, "[]");
    check("tracks[].x", r#"{"tracks": [{"x": [1]}]}"#, "? element 0 of `tracks[].x` is a list, no number");
    check("tracks[].x", r#"{"tracks": {"x": 1}}"#, "? `tracks[].x` is an object, no list");
    check("tracks[].x", r#"{"tracks": 1}"#, "? `tracks[].x` is a number, no list");
    check("tracks[].x[0]", r#"{"tracks": [{"x": [1]}, {"x": "[2]"}, "[3]"]}"#, "[1.0, NaN, NaN]");
    check("tracks[].x", "{}", "? `tracks[].x` is absent");
    check("tracks[].x[names=b]", r#"{"names": ["a", "b"], "tracks": [{"x": 1}, {"x": 2}]}"#, "2");
}

#[test]
fn a_chosen_element_may_be_a_text() {
    let valves = r#"{"names": ["a", "b"], "open": ["off", "on"], "flow": ["0.5", "1.5"]}"#;
    check("open[names=b]", valves, "1");
    check("flow[names=b]", valves, "1.5");
}
