//! A program's port to the bus: what its messages look like, as JSON or as the standard messages of ROS 2.
//!
//! To the programs each message is a list of numbers. JSON messages of the lidar, the sonar ring and the depth camera carry the time
//! of the measurement as `header.stamp`, as messages of ROS do.

use super::encoding::Encoding;
use serde_json::{Value, json};
use shsa_bridge::cdr::{Content, FieldContent, compose};
use shsa_bridge::payload::{Reader, SIZE_LIMIT};
use shsa_bridge::{Bridge, BridgeError, Inbox, Message, Outgoing, Payload};
use shsa_core::observation::RawValue;
use shsa_core::time::Time;
use shsa_demo::rover::{Beams, DEPTH, LIDAR, NEED, ODOMETRY, SONAR, level};
use shsa_message::ros::{Body, Types};
use shsa_message::source::Field;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Where the robot is: x and y in m, the heading in rad, the speed in m/s. It stands for the world that sensors look at.
pub const POSE: &str = "/world/pose";
/// The true distance of the nearest obstacle in m, and how often the robot has hit one.
pub const TRUTH: &str = "/world/truth";
/// The command to the drive: speed in m/s, turn rate in rad/s.
pub const COMMAND: &str = "/drive/command";
/// How fast the operator wants to drive, in m/s.
pub const WISH: &str = "/teleoperation/speed";

/// A `Float64` has no bounds: the need's `max_width` of 0.5 m says that the truth is at most this far from its value, metres.
const HALF_WIDTH_MAX_M: f64 = 0.25;
/// The limits of what a scan reports, metres.
const SCAN_RANGE_M: [f64; 2] = [0.02, 30.0];

/// What has come from the bus.
#[derive(Clone, Debug, PartialEq)]
pub enum Received {
    /// A message of a program.
    Numbers {
        /// Its topic: one of the constants, whatever its name on the bus.
        topic: &'static str,
        /// What it says, in the order in which the topic names it; of the need, the bounds of its value.
        numbers: Vec<f64>,
        /// When it was received.
        received: Time,
    },
    /// A text of `shsa`.
    Text {
        /// The topic.
        topic: Arc<str>,
        /// Its content.
        content: Value,
    },
}

/// The port of one program.
pub struct Port {
    bus: Box<dyn Bridge>,
    encoding: Encoding,
    /// By the name on the bus.
    readers: BTreeMap<String, TopicReader>,
    texts: BTreeSet<String>,
    types: Arc<Types>,
}

/// Reads the messages of one topic.
struct TopicReader {
    topic: &'static str,
    reader: Reader,
}

/// A topic as nodes of ROS 2 know it.
struct Typed {
    name: &'static str,
    message_type: &'static str,
    /// The fields with the numbers.
    fields: &'static [&'static str],
}

const SCAN: &str = "sensor_msgs/msg/LaserScan";
const ODOMETRY_TYPE: &str = "nav_msgs/msg/Odometry";
const TWIST: &str = "geometry_msgs/msg/Twist";

/// The topics of ROS 2. The depth camera's driver is taken to be followed by `depthimage_to_laserscan`.
fn typed(topic: &'static str) -> Typed {
    let of = |name, message_type, fields| Typed { name, message_type, fields };
    match topic {
        POSE => of(
            topic,
            ODOMETRY_TYPE,
            &[
                "pose.pose.position.x",
                "pose.pose.position.y",
                "pose.pose.orientation.z",
                "pose.pose.orientation.w",
                "twist.twist.linear.x",
            ],
        ),
        ODOMETRY => of("/odom", ODOMETRY_TYPE, &["twist.twist.linear.x"]),
        COMMAND => of("/cmd_vel", TWIST, &["linear.x", "angular.z"]),
        WISH => of("/teleoperation/cmd_vel", TWIST, &["linear.x"]),
        DEPTH => of("/depth/scan", SCAN, &["ranges"]),
        LIDAR | SONAR => of(topic, SCAN, &["ranges"]),
        NEED => of(topic, "std_msgs/msg/Float64", &["data"]),
        _ => of(topic, "std_msgs/msg/Float64MultiArray", &["data"]),
    }
}

/// The fields with the numbers of a JSON message.
fn json_fields(topic: &str) -> &'static [&'static str] {
    match topic {
        TRUTH => &["dmin_m", "collisions"],
        LIDAR | SONAR => &["ranges"],
        DEPTH => &["data"],
        _ => &[""],
    }
}

impl Port {
    /// A port whose messages look like this.
    #[must_use]
    pub fn new(bus: Box<dyn Bridge>, encoding: Encoding) -> Port {
        Port { bus, encoding, readers: BTreeMap::new(), texts: BTreeSet::new(), types: Types::standard() }
    }

    /// Where messages wait.
    #[must_use]
    pub fn inbox(&self) -> &Inbox {
        self.bus.inbox()
    }

    /// Subscribes to a topic of the programs.
    ///
    /// # Errors
    /// Errors of the bus.
    pub fn subscribe(&mut self, topic: &'static str) -> Result<(), BridgeError> {
        let typed = typed(topic);
        let (name, message_type, fields) = match self.encoding {
            Encoding::Json => (topic, None, json_fields(topic)),
            Encoding::Ros2 => (typed.name, Some(typed.message_type), typed.fields),
        };
        let fields: Vec<Field> =
            fields.iter().map(|path| Field { path: (*path).to_owned(), stamp: None }).collect();
        let reader = Reader::new(&fields, SIZE_LIMIT)?;
        self.readers.insert(name.to_owned(), TopicReader { topic, reader });
        self.bus.subscribe(name, message_type)
    }

    /// Subscribes to texts of `shsa` in JSON.
    ///
    /// # Errors
    /// Errors of the bus.
    pub fn subscribe_text(&mut self, topic: &str) -> Result<(), BridgeError> {
        self.texts.insert(topic.to_owned());
        let message_type = (self.encoding == Encoding::Ros2).then_some("std_msgs/msg/String");
        self.bus.subscribe(topic, message_type)
    }

    /// The next message that can be read.
    pub fn receive(&mut self) -> Option<Received> {
        while let Some(message) = self.bus.receive() {
            if let Some(received) = self.read(&message) {
                return Some(received);
            }
        }
        None
    }

    fn read(&mut self, message: &Message) -> Option<Received> {
        if self.texts.contains(&*message.topic) {
            let content = serde_json::from_slice(text_of(message)?).ok()?;
            return Some(Received::Text { topic: message.topic.clone(), content });
        }
        let TopicReader { topic, reader } = self.readers.get_mut(&*message.topic)?;
        let mut numbers = Vec::new();
        let mut is_whole = true;
        reader.read(message, |_, reading| match reading.map(|reading| reading.value) {
            Ok(RawValue::Number(number)) => numbers.push(number),
            Ok(RawValue::Interval { lo, hi }) => numbers.extend([lo, hi]),
            Ok(RawValue::Vector(values)) => numbers.extend(values),
            Err(_) => is_whole = false,
        });
        let numbers = is_whole.then(|| understood(topic, self.encoding, numbers))?;
        Some(Received::Numbers { topic, numbers, received: message.received })
    }

    /// Publishes a message; `stamp` is when it was true.
    ///
    /// # Errors
    /// Errors of the bus.
    pub fn publish(&mut self, topic: &'static str, stamp: Time, numbers: &[f64]) -> Result<(), BridgeError> {
        let (name, payload) = match self.encoding {
            Encoding::Json => (topic, json_message(topic, stamp, numbers)),
            Encoding::Ros2 => {
                let typed = typed(topic);
                // Has an effect once: nodes learn the type before the first message.
                self.bus.advertise(typed.name, typed.message_type)?;
                (typed.name, ros_message(topic, &typed, stamp, numbers, &self.types)?)
            }
        };
        self.bus.publish(Outgoing::new(name, stamp, payload))
    }

    /// Sends what was published.
    pub fn flush(&mut self) {
        self.bus.flush();
    }
}

/// The text of a message: its payload, or that of a `std_msgs/msg/String`.
fn text_of(message: &Message) -> Option<&[u8]> {
    let Payload::Bytes(bytes) = &message.payload else { return None };
    match message.message_type.as_deref() {
        Some("std_msgs/msg/String") => Some(Body::cdr(bytes).ok()?.text(0)?.0),
        _ => Some(bytes),
    }
}

/// The numbers of a topic from those of the fields.
fn understood(topic: &str, encoding: Encoding, numbers: Vec<f64>) -> Vec<f64> {
    match (topic, encoding, &numbers[..]) {
        (POSE, Encoding::Ros2, &[x, y, sine, cosine, speed]) => vec![x, y, 2.0 * sine.atan2(cosine), speed],
        (NEED, Encoding::Json, &[number]) => vec![number, number],
        (NEED, Encoding::Ros2, &[number]) => vec![number - HALF_WIDTH_MAX_M, number + HALF_WIDTH_MAX_M],
        _ => numbers,
    }
}

fn json_message(topic: &str, stamp: Time, numbers: &[f64]) -> Payload {
    let second = 1_000_000_000;
    let stamp = json!({ "sec": stamp.0.div_euclid(second), "nanosec": stamp.0.rem_euclid(second) });
    let content = match (topic, numbers) {
        (LIDAR | SONAR, _) => json!({ "header": { "stamp": stamp }, "ranges": numbers }),
        (DEPTH, _) => json!({ "header": { "stamp": stamp }, "data": numbers }),
        (TRUTH, &[dmin_m, collisions]) => json!({ "dmin_m": dmin_m, "collisions": collisions as u64 }),
        (_, &[number]) => json!(number),
        _ => json!(numbers),
    };
    Payload::Bytes(content.to_string().into())
}

fn ros_message(
    topic: &'static str,
    typed: &Typed,
    stamp: Time,
    numbers: &[f64],
    types: &Types,
) -> Result<Payload, BridgeError> {
    let values = match typed.message_type {
        SCAN => scan_fields(topic, level(topic, numbers)),
        _ if topic == TRUTH => vec![("data", RawValue::Vector(numbers.to_vec()))],
        _ => {
            let written = match (topic, numbers) {
                (POSE, &[x, y, heading, speed]) => {
                    vec![x, y, (heading / 2.0).sin(), (heading / 2.0).cos(), speed]
                }
                _ => numbers.to_vec(),
            };
            typed.fields.iter().copied().zip(written.into_iter().map(RawValue::Number)).collect()
        }
    };
    let fields = values.iter().map(|(path, value)| FieldContent { path, content: Content::Value(value) });
    let frames = frames(topic).iter().map(|[path, name]| FieldContent { path, content: Content::Text(name) });
    let fields: Vec<FieldContent<'_>> = fields.chain(frames).collect();
    Ok(Payload::Bytes(compose(typed.message_type, &fields, stamp, types)?))
}

/// The fields of a scan, which is in the frame of the robot.
fn scan_fields(topic: &str, ranges: &[f64]) -> Vec<(&'static str, RawValue)> {
    let beams = Beams::of(topic, ranges.len());
    let last = beams.angles().last().unwrap_or(beams.first);
    let numbers = [
        ("angle_min", beams.first),
        ("angle_max", last),
        ("angle_increment", beams.step),
        ("range_min", SCAN_RANGE_M[0]),
        ("range_max", SCAN_RANGE_M[1]),
    ];
    let numbers = numbers.into_iter().map(|(path, number)| (path, RawValue::Number(number)));
    numbers.chain([("ranges", RawValue::Vector(ranges.to_vec()))]).collect()
}

/// The names of frames in a message, each with its field.
fn frames(topic: &str) -> &'static [[&'static str; 2]] {
    match topic {
        LIDAR | SONAR | DEPTH => &[["header.frame_id", "base_link"]],
        ODOMETRY => &[["header.frame_id", "odom"], ["child_frame_id", "base_link"]],
        POSE => &[["header.frame_id", "map"], ["child_frame_id", "base_link"]],
        _ => &[],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shsa_bridge::Clock;
    use shsa_bridge::memory::MemoryBus;

    /// What is read of a message that was written with these numbers.
    fn carried(topic: &'static str, encoding: Encoding, numbers: &[f64]) -> Vec<f64> {
        let bus = MemoryBus::new(Clock::manual());
        let mut port = Port::new(Box::new(bus.join(4)), encoding);
        port.subscribe(topic).unwrap();
        let typed = typed(topic);
        let (name, message_type, payload) = match encoding {
            Encoding::Json => (topic, None, json_message(topic, Time(7), numbers)),
            Encoding::Ros2 => {
                let payload = ros_message(topic, &typed, Time(7), numbers, &port.types).unwrap();
                (typed.name, Some(typed.message_type.into()), payload)
            }
        };
        let message = Message { message_type, ..Message::new(name.into(), Time(9), payload) };
        match port.read(&message) {
            Some(Received::Numbers { topic: found, numbers, .. }) if found == topic => numbers,
            other => panic!("{topic}: {other:?}"),
        }
    }

    #[track_caller]
    fn check(topic: &'static str, numbers: &[f64], expected: &[f64]) {
        for encoding in [Encoding::Json, Encoding::Ros2] {
            let carried = carried(topic, encoding, numbers);
            assert_eq!(carried.len(), expected.len(), "{topic} {encoding:?}");
            for (carried, expected) in carried.iter().zip(expected) {
                // A scan of ROS has numbers of 32 bits.
                assert!((carried - expected).abs() < 1e-6, "{topic} {encoding:?}: {carried} {expected}");
            }
        }
    }

    /// A number over ROS 2 has no width: a reader assumes the greatest that the need of the model may have.
    #[test]
    fn the_assumed_width_is_the_greatest_of_the_need() {
        let width = format!("max_width: {} m", 2.0 * HALF_WIDTH_MAX_M);
        assert!(crate::rover::model(Encoding::Ros2).contains(&width), "{width}");
    }

    #[test]
    fn messages_say_the_same_in_both_encodings() {
        check(POSE, &[1.5, -2.5, 3.0, 0.25], &[1.5, -2.5, 3.0, 0.25]);
        check(TRUTH, &[0.75, 2.0], &[0.75, 2.0]);
        check(COMMAND, &[0.5, -0.25], &[0.5, -0.25]);
        check(WISH, &[0.3], &[0.3]);
        check(ODOMETRY, &[0.6], &[0.6]);
        check(LIDAR, &[1.1, 2.2, 3.3], &[1.1, 2.2, 3.3]);
        check(SONAR, &[3.0], &[3.0]);
    }

    #[test]
    fn a_depth_image_is_a_scan_of_its_middle_row_over_ros2() {
        let image: Vec<f64> = (0..480).map(f64::from).collect();
        assert_eq!(carried(DEPTH, Encoding::Json, &image), image);
        assert_eq!(carried(DEPTH, Encoding::Ros2, &image), image[192..288]);
    }

    #[test]
    fn a_number_without_bounds_is_as_wide_as_the_need_allows() {
        assert_eq!(carried(NEED, Encoding::Json, &[1.0]), [1.0, 1.0]);
        assert_eq!(carried(NEED, Encoding::Ros2, &[1.0]), [0.75, 1.25]);
    }
}
