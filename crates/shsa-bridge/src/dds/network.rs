//! The interfaces that are used, and the participant of DDS on them.

use super::raw::Raw;
use crate::BridgeError;
use bytes::Bytes;
use rustdds::no_key::{DataWriter, SimpleDataReader};
use rustdds::policy::{Durability, History, ResourceLimits};
use rustdds::{
    DomainParticipant, DomainParticipantBuilder, Duration, Publisher, QosPolicies, QosPolicyBuilder,
    RTPSEntity, Subscriber, Topic, TopicKind,
};
use shsa_message::ros::{Count, Kind, Types};
use std::net::{IpAddr, Ipv4Addr};

/// In a higher domain, the numbers of ports do not suffice for all participants of a machine.
const DOMAIN_MAX: u16 = 231;
/// The messages that are kept of a topic, also after they were read.
const KEPT: i32 = 512;
/// The same, of messages with lists: clouds of points and pictures are large.
const KEPT_LARGE: i32 = 16;
/// The messages of a topic that may wait for the acknowledgement of a reliable reader.
const UNACKNOWLEDGED_MAX: i32 = 4096;
/// How long a message may wait for room, milliseconds.
const WAIT_MS: i64 = 100;
/// How many messages deep types of messages are looked into.
const DEPTH_MAX: u32 = 16;

/// A reader of whole messages.
pub(super) type Reader = SimpleDataReader<Bytes, Raw>;
/// A writer of whole messages.
pub(super) type Writer = DataWriter<Bytes, Raw>;

/// Where to be found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Interfaces {
    /// On this machine only.
    Loopback,
    /// On these, by their names or addresses.
    Named(Vec<String>),
    /// On all.
    All,
}

impl Interfaces {
    /// The addresses; `None`: all.
    fn addresses(&self) -> Result<Option<Vec<IpAddr>>, BridgeError> {
        match self {
            Interfaces::Loopback => Ok(Some(vec![Ipv4Addr::LOCALHOST.into()])),
            Interfaces::Named(names) => {
                let found: Result<Vec<_>, _> = names.iter().map(|name| addresses_of(name)).collect();
                Ok(Some(found?.concat()))
            }
            Interfaces::All => Ok(None),
        }
    }
}

/// The addresses of the interface with this name or address. RustDDS sends over IPv4 only.
fn addresses_of(name: &str) -> Result<Vec<IpAddr>, BridgeError> {
    let mut all = Vec::new();
    for interface in netdev::get_interfaces() {
        let addresses: Vec<IpAddr> = interface.ipv4.iter().map(|net| net.addr().into()).collect();
        if interface.name == name && !addresses.is_empty() {
            return Ok(addresses);
        }
        if let Some(address) = addresses.iter().find(|address| address.to_string() == name) {
            return Ok(vec![*address]);
        }
        all.extend(addresses.iter().map(|address| format!("{} ({address})", interface.name)));
    }
    let problem =
        format!("no network interface '{name}' with an IPv4 address; there are: {}", all.join(", "));
    Err(BridgeError::Configuration(problem))
}

/// A participant, and what its readers and writers are made with.
pub(super) struct Participant {
    pub(super) domain: DomainParticipant,
    publisher: Publisher,
    subscriber: Subscriber,
}

impl Participant {
    pub(super) fn open(domain: u32, interfaces: &Interfaces) -> Result<Participant, BridgeError> {
        let number = u16::try_from(domain).ok().filter(|number| *number <= DOMAIN_MAX);
        let too_high = || {
            BridgeError::Configuration(format!(
                "domain {domain} is too high for DDS: the highest is {DOMAIN_MAX}"
            ))
        };
        let builder = DomainParticipantBuilder::new(number.ok_or_else(too_high)?);
        let builder = match interfaces.addresses()? {
            Some(addresses) => builder.with_only_networks(addresses),
            None => builder,
        };
        let domain = builder.build().map_err(refused)?;
        let qos = QosPolicies::default();
        let publisher = domain.create_publisher(&qos).map_err(refused)?;
        let subscriber = domain.create_subscriber(&qos).map_err(refused)?;
        Ok(Participant { domain, publisher, subscriber })
    }

    pub(super) fn guid(&self) -> [u8; 16] {
        self.domain.guid().to_bytes()
    }

    /// What the identities of all its readers and writers begin with.
    pub(super) fn prefix(&self) -> [u8; 12] {
        self.domain.guid().prefix.as_ref().try_into().unwrap_or_default()
    }

    fn topic(&self, name: &str, dds_type: &str, qos: &QosPolicies) -> Result<Topic, BridgeError> {
        let (name, dds_type) = (format!("{TOPICS}{name}"), dds_type.to_owned());
        self.domain.create_topic(name, dds_type, qos, TopicKind::NoKey).map_err(refused)
    }

    /// A reader that accepts every writer's settings.
    pub(super) fn reader(&self, topic: &str, dds_type: &str, types: &Types) -> Result<Reader, BridgeError> {
        let qos = common(dds_type, types).best_effort().build();
        let topic = self.topic(topic, dds_type, &qos)?;
        self.subscriber.create_simple_datareader_no_key(&topic, Some(qos)).map_err(refused)
    }

    /// A writer that reliable and other readers accept.
    pub(super) fn writer(&self, topic: &str, dds_type: &str, types: &Types) -> Result<Writer, BridgeError> {
        let limits = ResourceLimits {
            max_samples: UNACKNOWLEDGED_MAX,
            max_instances: 1,
            max_samples_per_instance: UNACKNOWLEDGED_MAX,
        };
        let qos = common(dds_type, types).reliable(Duration::from_millis(WAIT_MS)).resource_limits(limits);
        let qos = qos.build();
        let topic = self.topic(topic, dds_type, &qos)?;
        self.publisher.create_datawriter_no_key(&topic, Some(qos)).map_err(refused)
    }
}

/// What stands before the names of ROS 2's topics.
pub(super) const TOPICS: &str = "rt/";

fn common(dds_type: &str, types: &Types) -> QosPolicyBuilder {
    let depth = if is_small(dds_type, types, DEPTH_MAX) { KEPT } else { KEPT_LARGE };
    QosPolicyBuilder::new().durability(Durability::Volatile).history(History::KeepLast { depth })
}

/// Whether a type is known and has no list of any length.
fn is_small(message_type: &str, types: &Types, depth: u32) -> bool {
    let name = shsa_message::ros::full_name(message_type);
    let Ok(members) = types.members(&name) else { return false };
    depth > 0
        && members.iter().all(|member| {
            let is_list = matches!(member.count, Count::Free(_));
            let is_inner = |inner: &str| is_small(inner, types, depth - 1);
            !is_list && if let Kind::Message(inner) = &member.kind { is_inner(inner) } else { true }
        })
}

fn refused(error: rustdds::dds::CreateError) -> BridgeError {
    BridgeError::Lost(format!("DDS: {error}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn interfaces_are_found_by_name_and_by_address() {
        let home: Vec<IpAddr> = vec![Ipv4Addr::LOCALHOST.into()];
        assert_eq!(Interfaces::Loopback.addresses().unwrap(), Some(home.clone()));
        assert_eq!(Interfaces::Named(vec!["127.0.0.1".into()]).addresses().unwrap(), Some(home));
        assert_eq!(Interfaces::All.addresses().unwrap(), None);
        let wrong = Interfaces::Named(vec!["nowhere0".into()]).addresses().unwrap_err().to_string();
        assert!(
            wrong.starts_with("no network interface 'nowhere0'") && wrong.contains("127.0.0.1"),
            "{wrong}"
        );
    }

    #[test]
    fn a_domain_without_ports_is_refused() {
        let refused = Participant::open(232, &Interfaces::Loopback).err().map(|error| error.to_string());
        assert_eq!(refused.as_deref(), Some("domain 232 is too high for DDS: the highest is 231"));
    }

    #[test]
    fn messages_with_lists_count_as_large() {
        let types = Types::standard();
        for (name, small) in [
            ("std_msgs::msg::dds_::Float64_", true),
            ("std_msgs::msg::dds_::String_", true),
            ("sensor_msgs::msg::dds_::Imu_", true),
            ("sensor_msgs::msg::dds_::PointCloud2_", false),
            ("diagnostic_msgs::msg::dds_::DiagnosticArray_", false),
            ("unknown::msg::dds_::Type_", false),
        ] {
            assert_eq!(is_small(name, &types, DEPTH_MAX), small, "{name}");
        }
    }
}
