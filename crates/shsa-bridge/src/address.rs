//! The address of a bus: the middleware, and how to connect to it.

#[cfg(feature = "ros2-dds")]
use crate::dds;
use crate::memory::MemoryBus;
#[cfg(feature = "mqtt")]
use crate::mqtt::{self, sparkplug, sparkplug::SparkplugBridge};
#[cfg(feature = "ros2")]
use crate::ros2;
#[cfg(feature = "zenoh")]
use crate::zenoh;
use crate::{Bridge, BridgeError, Inbox};
use std::fmt;
use std::net::IpAddr;
use std::path::PathBuf;
use std::str::FromStr;
#[cfg(feature = "mqtt")]
use std::time::Duration;

/// The address of a bus.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Address {
    /// Within this process.
    Memory,
    /// An MQTT broker, by its address with all settings.
    Mqtt(String),
    /// The edge nodes of Sparkplug on an MQTT broker, by its address with our own edge node and all settings.
    Sparkplug(String),
    /// A Zenoh network, reached at these endpoints, or as a configuration file says.
    Zenoh(Vec<String>),
    /// The nodes of ROS 2 on a Zenoh network, reached at these endpoints.
    Ros2(Vec<String>),
    /// The nodes of ROS 2 on DDS, on the interfaces with these names or addresses: none is the loopback interface, `all` is all.
    Ros2Dds(Vec<String>),
}

impl FromStr for Address {
    type Err = String;

    /// # Errors
    /// Describes the form of an address.
    fn from_str(text: &str) -> Result<Address, String> {
        let (scheme, place) =
            text.split_once("://").map_or((text, None), |(scheme, place)| (scheme, Some(place)));
        match (scheme, place) {
            ("memory", None) => Ok(Address::Memory),
            ("mqtt" | "mqtts", Some(_)) => Ok(Address::Mqtt(text.to_owned())),
            ("sparkplug" | "sparkplugs", Some(_)) => Ok(Address::Sparkplug(text.to_owned())),
            ("zenoh", place) => Ok(Address::Zenoh(endpoints(place.unwrap_or_default()))),
            ("ros2", place) => Ok(Address::Ros2(endpoints(place.unwrap_or(ROUTER)))),
            ("ros2-dds", place) => {
                Ok(Address::Ros2Dds(listed(place.unwrap_or_default()).map(str::to_owned).collect()))
            }
            _ => Err(format!(
                "`{text}` is no bus; write memory, mqtt://HOST:PORT, mqtts://HOST:PORT, sparkplug://HOST:PORT/GROUP/NODE, zenoh, zenoh://HOST:PORT, ros2, ros2://HOST:PORT, ros2-dds, or ros2-dds://INTERFACE"
            )),
        }
    }
}

/// Where nodes of `rmw_zenoh` expect the router.
const ROUTER: &str = "127.0.0.1:7447";

/// The word for every interface.
#[cfg_attr(not(feature = "ros2-dds"), allow(dead_code, reason = "only DDS has interfaces"))]
const ALL: &str = "all";

fn listed(places: &str) -> impl Iterator<Item = &str> {
    places.split(',').filter(|place| !place.is_empty())
}

fn endpoints(places: &str) -> Vec<String> {
    listed(places).map(endpoint).collect()
}

/// An endpoint of Zenoh; without a protocol it is TCP.
fn endpoint(place: &str) -> String {
    if place.contains('/') { place.to_owned() } else { format!("tcp/{place}") }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Address::Memory => f.write_str("memory"),
            Address::Mqtt(address) | Address::Sparkplug(address) => f.write_str(address),
            Address::Zenoh(places) if places.is_empty() => f.write_str("zenoh"),
            Address::Zenoh(places) => write!(f, "zenoh://{}", places.join(",")),
            Address::Ros2(places) => write!(f, "ros2://{}", places.join(",")),
            Address::Ros2Dds(places) if places.is_empty() => f.write_str("ros2-dds"),
            Address::Ros2Dds(places) => write!(f, "ros2-dds://{}", places.join(",")),
        }
    }
}

/// The role of a client on a bus.
#[cfg_attr(not(any(feature = "mqtt", feature = "ros2")), allow(dead_code, reason = "only they take a name"))]
#[derive(Clone, Copy)]
enum ClientRole<'a> {
    /// A participant under this name, which stays the same in later runs.
    Member(&'a str),
    /// An observer that leaves no trace.
    Visitor,
}

/// A bus, and how to connect to it.
#[derive(Clone, Debug)]
pub struct BusOptions {
    /// Its address.
    pub address: Address,
    /// A configuration file of Zenoh, JSON5 or YAML.
    pub config: Option<PathBuf>,
    /// Endpoints to listen on, as `tcp/127.0.0.1:7447` (Zenoh); nothing listens without one here or in the file.
    pub listen: Vec<String>,
    /// The domain of the nodes of ROS 2.
    pub ros_domain: u32,
    /// Whether the nodes of ROS 2 use DDS, translated by `zenoh-bridge-ros2dds`; else they use Zenoh (`rmw_zenoh`).
    pub ros_dds: bool,
    /// The certificate of the authority that must have signed the other side's certificate (PEM).
    pub ca: Option<PathBuf>,
    /// Our certificate, for the other side (PEM).
    pub certificate: Option<PathBuf>,
    /// The key of our certificate (PEM).
    pub key: Option<PathBuf>,
}

impl BusOptions {
    /// The bus at this address, with default settings.
    #[must_use]
    pub fn at(address: Address) -> BusOptions {
        BusOptions {
            address,
            config: None,
            listen: Vec::new(),
            ros_domain: 0,
            ros_dds: false,
            ca: None,
            certificate: None,
            key: None,
        }
    }

    /// Connects; received messages wait in `inbox`. The bus in memory is `memory`.
    ///
    /// `name` is our name on the bus, the same in later runs.
    ///
    /// # Errors
    /// When the address or the configuration cannot be used, the other side refuses, or this build lacks the middleware's
    /// feature.
    pub fn open(&self, name: &str, inbox: Inbox, memory: &MemoryBus) -> Result<Box<dyn Bridge>, BridgeError> {
        self.connect(ClientRole::Member(name), inbox, memory)
    }

    /// As [`BusOptions::open`] for an observer, which leaves no trace.
    ///
    /// # Errors
    /// As [`BusOptions::open`].
    pub fn visit(&self, inbox: Inbox, memory: &MemoryBus) -> Result<Box<dyn Bridge>, BridgeError> {
        self.connect(ClientRole::Visitor, inbox, memory)
    }

    /// Whether only the other side can read our messages: they stay on this machine, or are encrypted. The contents of a
    /// configuration file are not considered.
    #[must_use]
    pub fn is_private(&self) -> bool {
        let is_private = |place: &str| {
            let (protocol, host) = place.split_once('/').unwrap_or(("tcp", place));
            matches!(protocol, "tls" | "quic" | "wss") || protocol.starts_with("unix") || is_loopback(host)
        };
        match &self.address {
            Address::Memory => true,
            Address::Mqtt(address) | Address::Sparkplug(address) => {
                let (scheme, place) = address.split_once("://").unwrap_or_default();
                matches!(scheme, "mqtts" | "ssl" | "sparkplugs") || is_loopback(place)
            }
            // Sockets of DDS take datagrams from everywhere.
            Address::Ros2Dds(_) => false,
            Address::Zenoh(places) | Address::Ros2(places) => {
                // Without an endpoint, peers anywhere are found by scouting.
                let mut all = places.iter().chain(&self.listen);
                !(places.is_empty() && self.listen.is_empty()) && all.all(|place| is_private(place))
            }
        }
    }

    fn connect(
        &self,
        role: ClientRole<'_>,
        inbox: Inbox,
        memory: &MemoryBus,
    ) -> Result<Box<dyn Bridge>, BridgeError> {
        match &self.address {
            Address::Memory => Ok(Box::new(memory.join_with(inbox))),
            #[cfg(feature = "mqtt")]
            Address::Mqtt(address) => {
                Ok(Box::new(mqtt::MqttBridge::open(&self.mqtt(address, role)?, inbox)?))
            }
            #[cfg(feature = "mqtt")]
            Address::Sparkplug(address) => {
                Ok(Box::new(SparkplugBridge::open(&self.sparkplug(address, role)?, inbox)?))
            }
            #[cfg(not(feature = "mqtt"))]
            Address::Mqtt(_) | Address::Sparkplug(_) => Err(not_built("mqtt", role)),
            #[cfg(feature = "zenoh")]
            Address::Zenoh(places) => Ok(Box::new(zenoh::ZenohBridge::open(&self.zenoh(places), inbox)?)),
            #[cfg(not(feature = "zenoh"))]
            Address::Zenoh(_) => Err(not_built("zenoh", role)),
            #[cfg(feature = "ros2")]
            Address::Ros2(places) => Ok(Box::new(ros2::Ros2Bridge::open(&self.ros2(places, role), inbox)?)),
            #[cfg(not(feature = "ros2"))]
            Address::Ros2(_) => Err(not_built("ros2", role)),
            #[cfg(feature = "ros2-dds")]
            Address::Ros2Dds(places) => Ok(Box::new(dds::DdsBridge::open(&self.dds(places), inbox)?)),
            #[cfg(not(feature = "ros2-dds"))]
            Address::Ros2Dds(_) => Err(not_built("ros2-dds", role)),
        }
    }

    /// `shsa/NAME/status` tells whether the client is connected, `shsa/NAME/claims` lists its claims.
    #[cfg(feature = "mqtt")]
    fn mqtt(&self, address: &str, role: ClientRole<'_>) -> Result<mqtt::Options, BridgeError> {
        let name = match role {
            ClientRole::Member(name) => name,
            ClientRole::Visitor => &format!("shsa-visitor-{}", std::process::id()),
        };
        let mut options =
            mqtt::Options::parse(address, name)?.with_environment(|key| std::env::var(key).ok());
        if let ClientRole::Visitor = role {
            options.session = Duration::ZERO;
            options.name = name.to_owned();
        } else {
            let (here, gone) = ("online".into(), "offline".into());
            options.claims = Some(name.to_owned());
            options.presence = Some(mqtt::Presence { topic: format!("shsa/{name}/status"), here, gone });
        }
        self.secure(&mut options)?;
        Ok(options)
    }

    /// Sets the files of TLS that the address does not name.
    #[cfg(feature = "mqtt")]
    fn secure(&self, options: &mut mqtt::Options) -> Result<(), BridgeError> {
        let files = [&self.ca, &self.certificate, &self.key];
        if options.tls.is_none() && files.iter().any(|file| file.is_some()) {
            let why = "--ca, --certificate and --key need mqtts:// or sparkplugs://";
            return Err(BridgeError::Configuration(why.to_owned()));
        }
        if let Some(tls) = &mut options.tls {
            tls.authorities = tls.authorities.take().or_else(|| self.ca.clone());
            tls.certificate = tls.certificate.take().or_else(|| self.certificate.clone());
            tls.key = tls.key.take().or_else(|| self.key.clone());
        }
        Ok(())
    }

    /// An observer has no edge node, and announces itself to nobody.
    #[cfg(feature = "mqtt")]
    fn sparkplug(&self, address: &str, role: ClientRole<'_>) -> Result<sparkplug::Options, BridgeError> {
        let mut options = match role {
            ClientRole::Member(name) => sparkplug::Options::parse(address, name)?,
            ClientRole::Visitor => {
                let name = format!("shsa-visitor-{}", std::process::id());
                let mut options = sparkplug::Options::observer(address, &name)?;
                (options.mqtt.name, options.host) = (name, None);
                options
            }
        };
        options.mqtt = options.mqtt.with_environment(|key| std::env::var(key).ok());
        self.secure(&mut options.mqtt)?;
        Ok(options)
    }

    #[cfg(feature = "ros2")]
    fn ros2(&self, places: &[String], role: ClientRole<'_>) -> ros2::Options {
        let name = match role {
            ClientRole::Member(name) => name.replace('-', "_"),
            ClientRole::Visitor => format!("shsa_visitor_{}", std::process::id()),
        };
        let usual = ros2::Options::new(self.zenoh(places));
        ros2::Options {
            wire: if self.ros_dds { ros2::Wire::Plain } else { ros2::Wire::Rmw },
            domain: self.ros_domain,
            node: ros2::Node { name, ..usual.node.clone() },
            ..usual
        }
    }

    #[cfg(feature = "ros2-dds")]
    fn dds(&self, places: &[String]) -> dds::Options {
        let interfaces = match places {
            [] => dds::Interfaces::Loopback,
            [all] if all == ALL => dds::Interfaces::All,
            names => dds::Interfaces::Named(names.to_vec()),
        };
        dds::Options { interfaces, domain: self.ros_domain, ..dds::Options::default() }
    }

    /// If nobody can connect to us, routers must forward the messages of others; they do this for clients, not for peers.
    #[cfg(feature = "zenoh")]
    fn zenoh(&self, places: &[String]) -> zenoh::Options {
        let mode = match (&self.config, self.listen.is_empty()) {
            (Some(_), _) => None,
            (None, true) => Some(zenoh::Mode::Client),
            (None, false) => Some(zenoh::Mode::Peer),
        };
        zenoh::Options {
            mode,
            connect: places.to_vec(),
            listen: self.listen.clone(),
            config: self.config.clone(),
            ca: self.ca.clone(),
            identity: self.certificate.clone().zip(self.key.clone()),
            ..zenoh::Options::default()
        }
    }
}

/// Whether `HOST:PORT`, with settings or without, is this machine.
fn is_loopback(place: &str) -> bool {
    let place = place.split(['/', '?', '#']).next().unwrap_or_default();
    let host = match place.strip_prefix('[') {
        Some(rest) => rest.split(']').next().unwrap_or_default(),
        None => place.split(':').next().unwrap_or_default(),
    };
    host == "localhost" || host.parse::<IpAddr>().is_ok_and(|address| address.is_loopback())
}

#[cfg(not(all(feature = "mqtt", feature = "ros2", feature = "ros2-dds", feature = "zenoh")))]
fn not_built(feature: &str, _: ClientRole<'_>) -> BridgeError {
    BridgeError::Configuration(format!("this program was built without its feature `{feature}`"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check_private(address: &str, listen: &[&str], expected: bool) {
        let listen = listen.iter().map(|place| (*place).to_owned()).collect();
        let bus = BusOptions { listen, ..BusOptions::at(address.parse().unwrap()) };
        assert_eq!(bus.is_private(), expected, "{address}");
    }

    #[test]
    fn a_bus_is_private_on_this_machine_or_encrypted() {
        for (address, expected) in [
            ("memory", true),
            ("mqtt://127.0.0.1:1883?qos=0", true),
            ("mqtt://localhost", true),
            ("mqtts://broker", true),
            ("mqtt://broker:1883", false),
            ("sparkplug://127.0.0.1/Plant/healer", true),
            ("sparkplug://broker/Plant", false),
            ("sparkplugs://broker/Plant", true),
            ("mqtt://127.0.0.1.example.org", false),
            ("zenoh", false),
            ("zenoh://127.0.0.1:7447", true),
            ("zenoh://[::1]:7447,tls/router:7447", true),
            ("zenoh://127.0.0.1:7447,router:7447", false),
            ("ros2", true),
            ("ros2-dds", false),
        ] {
            check_private(address, &[], expected);
        }
        check_private("zenoh", &["tcp/0.0.0.0:7447"], false);
        check_private("zenoh", &["tcp/127.0.0.1:7447"], true);
    }

    #[test]
    fn addresses_are_read_and_shown() {
        for (text, shown) in [
            ("memory", "memory"),
            ("mqtt://broker:1883?qos=0", "mqtt://broker:1883?qos=0"),
            ("sparkplug://broker/Plant/healer?host=a", "sparkplug://broker/Plant/healer?host=a"),
            ("zenoh", "zenoh"),
            ("ros2", "ros2://tcp/127.0.0.1:7447"),
            ("ros2-dds", "ros2-dds"),
            ("ros2-dds://eth0,10.0.0.7", "ros2-dds://eth0,10.0.0.7"),
            ("zenoh://127.0.0.1:7447", "zenoh://tcp/127.0.0.1:7447"),
            ("zenoh://tls/router:7447,[::1]:7448", "zenoh://tls/router:7447,tcp/[::1]:7448"),
        ] {
            assert_eq!(text.parse::<Address>().unwrap().to_string(), shown);
        }
        for wrong in ["", "zenho", "memory://x", "carrier-pigeon://here"] {
            assert!(wrong.parse::<Address>().unwrap_err().contains("is no bus"), "{wrong}");
        }
    }
}
