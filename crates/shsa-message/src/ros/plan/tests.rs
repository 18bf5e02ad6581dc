//! Plans, and paths that lead nowhere.

use super::*;
use crate::path::Path;

fn plan(types: &Types, message_type: &str, path: &str) -> Result<Plan, MessageError> {
    Plan::of_value(types, Layout::Cdr, message_type, &Path::parse(path).unwrap().steps)
}

#[track_caller]
fn check(message_type: &str, path: &str, expected: &str) {
    let shown = match plan(&Types::standard(), message_type, path) {
        Ok(plan) => format!("{:?} {:?} {:?}", plan.steps, plan.target, plan.count),
        Err(problem) => problem.to_string(),
    };
    assert_eq!(shown, expected);
}

#[test]
fn plans_are_short() {
    check("std_msgs/msg/Float64", "", "[] Primitive(F64) One");
    check(
        "nav_msgs/msg/Odometry",
        "twist.twist.linear.x",
        "[Skip(8), Text, Text, Align(8), Skip(344)] Primitive(F64) One",
    );
    let skips = "[Skip(8), Text, Align(4), Skip(28)] Primitive(F32) Free(None)";
    check("sensor_msgs/msg/LaserScan", "ranges", skips);
    check("sensor_msgs/msg/NavSatFix", "header.stamp", "[] Time One");
    check(
        "tf2_msgs/msg/TFMessage",
        "transforms[2].transform.translation.z",
        "[Enter { count: Free(None), index: 2, element: [Align(4), Skip(8), Text, Text, Align(8), Skip(56)] }, \
         Align(4), Skip(8), Text, Text, Align(8), Skip(16)] Primitive(F64) One",
    );
}

#[test]
fn what_is_not_there_is_said() {
    check(
        "nav_msgs/msg/Odometry",
        "twist.linear.x",
        "no field 'linear' in geometry_msgs/msg/TwistWithCovariance (there is: twist, covariance)",
    );
    check("nav_msgs/msg/Odometry", "twits", "no field 'twits' in nav_msgs/msg/Odometry; is it twist?");
    check(
        "nav_msgs/msg/Odometry",
        "pose.pose.position",
        "'position' is a geometry_msgs/msg/Point; name one of its fields: x, y, z",
    );
    check("nav_msgs/msg/Odometry", "child_frame_id.x", "'child_frame_id' has no parts");
    check(
        "tf2_msgs/msg/TFMessage",
        "transforms.transform",
        "'transforms' is a list; say which element, transforms[0], or take all of them, transforms[]",
    );
    check("std_msgs/msg/Float64", "data[0]", "'data' is no list");
    check("bot/msg/None", "x", "the message type bot/msg/None is not known");
}

#[test]
fn malicious_definitions_end() {
    let mut types = Types::default();
    types.add("m/A", "A again\nint8 last");
    assert_eq!(plan(&types, "m/msg/A", "last"), Err(MessageError::TooDeep));
    for level in 0..9 {
        types.add(&format!("m/L{level}"), &format!("L{} x\n", level + 1).repeat(100));
    }
    types.add("m/L9", "string x");
    types.add("m/Deep", "L0 x\nint8 last");
    assert_eq!(plan(&types, "m/msg/Deep", "last"), Err(MessageError::TooLarge));
    types.add("m/Wide", "Big[4294967295] a\nint8 last");
    types.add("m/Big", "Bigger[4294967295] a");
    types.add("m/Bigger", "int64[4294967295] a");
    assert_eq!(plan(&types, "m/msg/Wide", "last"), Err(MessageError::TooLarge));
    types.add("m/Void", "");
    types.add("m/Voids", "Void[] a\nint8 last");
    let voids = plan(&types, "m/msg/Voids", "last").unwrap();
    let body = Body::cdr(&[0, 1, 0, 0, 255, 255, 255, 255, 0, 5]).unwrap();
    assert_eq!(voids.locate(body), None);
    let body = Body::cdr(&[0, 1, 0, 0, 1, 0, 0, 0, 0, 5]).unwrap();
    assert_eq!(voids.locate(body), Some(Place { at: 5, count: 1 }));
}
