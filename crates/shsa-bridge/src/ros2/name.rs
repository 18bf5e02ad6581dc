//! ROS 2's names as keys and tokens of Zenoh, and the attachment beside its messages.
//!
//! Source: the design of `rmw_zenoh` (<https://github.com/ros2/rmw_zenoh/blob/rolling/docs/design.md>).

use super::{Node, Wire};
use crate::PublisherId;
use crate::ros::{bare, dds_name};
use shsa_core::time::Time;

/// The hash of nodes before ROS 2 Iron, which have none.
pub(super) const NO_HASH: &str = "TypeHashNotSupported";

/// A type on the wire.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct WireType {
    /// `std_msgs::msg::dds_::Float64_`.
    pub(super) dds: String,
    /// `RIHS01_` and digits.
    pub(super) hash: String,
}

/// The key to publish under.
pub(super) fn key(wire: Wire, domain: u32, topic: &str, wire_type: &WireType) -> String {
    let topic = bare(topic);
    match wire {
        Wire::Rmw => format!("{domain}/{topic}/{}/{}", wire_type.dds, wire_type.hash),
        Wire::Plain => topic.to_owned(),
    }
}

/// A pattern of the topic's keys with any hash; without a type, with any type.
pub(super) fn pattern(wire: Wire, domain: u32, topic: &str, message_type: Option<&str>) -> String {
    let topic = bare(topic);
    match (wire, message_type) {
        (Wire::Plain, _) => topic.to_owned(),
        (Wire::Rmw, None) => format!("{domain}/{topic}/*/*"),
        (Wire::Rmw, Some(message_type)) => format!("{domain}/{topic}/{}/*", dds_name(message_type)),
    }
}

/// The topic, the type and the hash in a key of `rmw_zenoh`.
pub(super) fn parts(key: &str) -> Option<(&str, &str, &str)> {
    let (_domain, rest) = key.split_once('/')?;
    let (rest, hash) = rest.rsplit_once('/')?;
    let (topic, dds) = rest.rsplit_once('/')?;
    dds.contains("::").then_some((topic, dds, hash))
}

/// The entity that a token announces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Entity<'a> {
    Node,
    Publisher(&'a str, &'a WireType),
    Subscription(&'a str, &'a WireType),
}

/// The token for which tools list a node, its publishers and its subscriptions. `number` counts the node's entities.
pub(super) fn token(
    domain: u32,
    session: PublisherId,
    node: &Node,
    number: u32,
    entity: Entity<'_>,
) -> String {
    // The first entity of a node is the node itself.
    let (kind, number) = match entity {
        Entity::Node => ("NN", 0),
        Entity::Publisher(..) => ("MP", number),
        Entity::Subscription(..) => ("MS", number),
    };
    let (space, name) = (mangled(&node.namespace), mangled(&node.name));
    let of_node = format!("@ros2_lv/{domain}/{session}/0/{number}/{kind}/%/{space}/{name}");
    // Reliability (empty: reliable, 2: best effort), durability, history, deadline, lifespan, liveliness.
    let (topic, wire_type, qos) = match entity {
        Entity::Node => return of_node,
        Entity::Publisher(topic, wire_type) => (topic, wire_type, "::,10:,:,:,,"),
        // It accepts every publisher's settings.
        Entity::Subscription(topic, wire_type) => (topic, wire_type, "2::,10:,:,:,,"),
    };
    let topic = mangled(&format!("/{}", bare(topic)));
    format!("{of_node}/{topic}/{}/{}/{qos}", wire_type.dds, wire_type.hash)
}

fn mangled(name: &str) -> String {
    if name.is_empty() { "%".to_owned() } else { name.replace('/', "%") }
}

/// The attachment of a message: its number, its time, its publisher; 33 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Attachment {
    pub(super) sequence: i64,
    pub(super) stamp: Time,
    pub(super) publisher: PublisherId,
}

impl Attachment {
    pub(super) fn write(self) -> Vec<u8> {
        let (sequence, stamp) = (self.sequence.to_le_bytes(), self.stamp.0.to_le_bytes());
        [sequence.as_slice(), &stamp, &[16], &self.publisher.0.to_le_bytes()].concat()
    }

    /// `None` for attachments of others.
    pub(super) fn read(bytes: &[u8]) -> Option<Attachment> {
        let (sequence, rest) = bytes.split_first_chunk()?;
        let (stamp, rest) = rest.split_first_chunk()?;
        let (16, id) = rest.split_first()? else { return None };
        Some(Attachment {
            sequence: i64::from_le_bytes(*sequence),
            stamp: Time(i64::from_le_bytes(*stamp)),
            publisher: PublisherId(u128::from_le_bytes(*id.first_chunk()?)),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn float() -> WireType {
        WireType { dds: dds_name("std_msgs/Float64"), hash: "RIHS01_ab".into() }
    }

    #[test]
    fn keys_name_domain_topic_type_and_hash() {
        assert_eq!(key(Wire::Rmw, 3, "/a/b", &float()), "3/a/b/std_msgs::msg::dds_::Float64_/RIHS01_ab");
        assert_eq!(key(Wire::Plain, 3, "/a/b", &float()), "a/b");
        assert_eq!(pattern(Wire::Rmw, 0, "a", None), "0/a/*/*");
        assert_eq!(pattern(Wire::Rmw, 0, "/a", Some("x/Y")), "0/a/x::msg::dds_::Y_/*");
        assert_eq!(parts("0/a/b/x::msg::dds_::Y_/H"), Some(("a/b", "x::msg::dds_::Y_", "H")));
        for other in ["", "0", "0/a", "0/a/b", "0/a/b/c"] {
            assert_eq!(parts(other), None);
        }
    }

    #[test]
    fn tokens_are_those_of_rmw_zenoh() {
        let node = Node { name: "shsa".into(), namespace: "/robot/front".into() };
        let float = float();
        let token = |entity: Entity<'_>| token(0, PublisherId(0xab), &node, 7, entity);
        assert_eq!(token(Entity::Node), "@ros2_lv/0/ab/0/0/NN/%/%robot%front/shsa");
        assert_eq!(
            token(Entity::Publisher("dmin", &float)),
            "@ros2_lv/0/ab/0/7/MP/%/%robot%front/shsa/%dmin/std_msgs::msg::dds_::Float64_/RIHS01_ab/::,10:,:,:,,"
        );
        assert!(token(Entity::Subscription("/a/b", &float)).contains("/0/7/MS/%/%robot%front/shsa/%a%b/"));
    }

    #[test]
    fn attachments_have_33_bytes() {
        let attachment = Attachment { sequence: 5, stamp: Time(-7), publisher: PublisherId(1 << 120) };
        let bytes = attachment.write();
        assert_eq!((bytes.len(), bytes[16]), (33, 16));
        assert_eq!(Attachment::read(&bytes), Some(attachment));
        for length in 0..33 {
            assert_eq!(Attachment::read(&bytes[..length]), None);
        }
        assert_eq!(Attachment::read(&[7; 33]), None);
    }
}
