//! Messages of ROS 2: any bytes as CDR; results are bounded, and written messages can be read again.

use shsa_bridge::payload::{Reader, Writer};
use shsa_bridge::{Message, Payload, Provenance, Quality};
use shsa_core::observation::RawValue;
use shsa_core::time::Time;
use shsa_message::source::Field;

/// Types with some of their fields; the first field is a number.
const TYPES: [(&str, &[&str]); 5] = [
    ("std_msgs/msg/Float64", &["data"]),
    ("sensor_msgs/msg/LaserScan", &["range_max", "ranges", "ranges[3]"]),
    ("sensor_msgs/msg/JointState", &["position[name=left]", "velocity", "position[1]"]),
    ("nav_msgs/msg/Odometry", &["twist.twist.linear.x", "pose.covariance", "header.stamp.sec"]),
    ("std_msgs/msg/String", &["a.b", ""]),
];
const SIZE_LIMIT: usize = 1 << 16;

fn field(path: &str) -> Field {
    Field { path: path.into(), stamp: None }
}

fn message(message_type: &str, bytes: &[u8]) -> Message {
    let payload = Payload::Bytes(bytes.to_vec().into());
    Message { message_type: Some(message_type.into()), ..Message::new("/topic".into(), Time(0), payload) }
}

/// The first byte chooses the type; reads all of its fields at once, then writes a substitute in the form of the message.
///
/// # Panics
/// When a reason is long, or a written number is not read back.
pub fn run(bytes: &[u8]) {
    let Some((kind, bytes)) = bytes.split_first() else { return };
    let (message_type, paths) = TYPES[usize::from(*kind) % TYPES.len()];
    let fields: Vec<Field> = paths.iter().map(|path| field(path)).collect();
    let mut reader = Reader::new(&fields, SIZE_LIMIT).expect("they follow the grammar");
    reader.read(&message(message_type, bytes), |index, reading| match reading {
        Ok(_) => assert!(index < fields.len(), "not asked for"),
        Err(unreadable) => assert!(unreadable.to_string().len() < 300, "a long reason: {unreadable}"),
    });
    take_over(message_type, paths[0], bytes);
}

fn take_over(message_type: &str, path: &str, bytes: &[u8]) {
    let mut writer = Writer::like(field(path), SIZE_LIMIT).expect("they follow the grammar");
    writer.learn_message(&message(message_type, bytes));
    let provenance = Provenance::new(Quality::Substitute, "");
    let one = RawValue::Number(1.0);
    let Ok(Some(written)) = writer.write(Some(&one), Time(0), &provenance) else { return };
    let mut reader = Reader::new(&[field(path)], SIZE_LIMIT * 2).expect("they follow the grammar");
    reader.read(&message(message_type, &written), |_, reading| {
        let value = reading.expect("it could be written").value;
        assert!(value == one, "{value:?}");
    });
}

/// A message of every type.
#[must_use]
pub fn seeds() -> Vec<Vec<u8>> {
    let number = Cdr::new().f64s(&[21.5]);
    let scan = Cdr::new().header("laser").f32s(&[-1.5, 1.5, 0.1, 0.0, 0.1, 0.2, 30.0]);
    let scan = scan.count(4).f32s(&[1.0, f32::NAN, f32::INFINITY, 2.0]).count(0);
    let joints = Cdr::new().header("").count(2).text("left").text("right");
    let joints = joints.count(2).f64s(&[0.5, 1.5]).count(2).f64s(&[0.1, 0.2]).count(0);
    let odometry = Cdr::new().header("odom").text("base_link").f64s(&[0.25; 3 + 4 + 36 + 6 + 36]);
    let text = Cdr::new().text(r#"{"a": {"b": 3}}"#);
    let all = [number, scan, joints, odometry, text];
    all.into_iter().zip(0_u8..).map(|(cdr, kind)| [vec![kind], cdr.0].concat()).collect()
}

/// A message being written; little-endian.
struct Cdr(Vec<u8>);

impl Cdr {
    fn new() -> Cdr {
        Cdr(vec![0, 1, 0, 0])
    }

    /// Alignment counts from behind the four bytes of the encapsulation.
    fn put(mut self, bytes: &[u8], align: usize) -> Cdr {
        let end = 4 + (self.0.len() - 4).next_multiple_of(align);
        self.0.resize(end, 0);
        self.0.extend(bytes);
        self
    }

    fn count(self, count: u32) -> Cdr {
        self.put(&count.to_le_bytes(), 4)
    }

    fn f32s(self, numbers: &[f32]) -> Cdr {
        numbers.iter().fold(self, |cdr, number| cdr.put(&number.to_le_bytes(), 4))
    }

    fn f64s(self, numbers: &[f64]) -> Cdr {
        numbers.iter().fold(self, |cdr, number| cdr.put(&number.to_le_bytes(), 8))
    }

    fn text(self, text: &str) -> Cdr {
        let length = text.len() as u32 + 1;
        self.count(length).put(text.as_bytes(), 1).put(&[0], 1)
    }

    fn header(self, frame: &str) -> Cdr {
        self.count(1_700_000_000).count(5).text(frame)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_seeds_are_messages() {
        for seed in seeds() {
            let (message_type, paths) = TYPES[usize::from(seed[0])];
            let mut reader = Reader::new(&[field(paths[0])], SIZE_LIMIT).unwrap();
            let mut read = 0;
            reader.read(&message(message_type, &seed[1..]), |_, reading| {
                reading.unwrap();
                read += 1;
            });
            assert_eq!(read, 1, "{message_type}");
        }
    }
}
