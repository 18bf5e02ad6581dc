//! `--bus ..`: which middleware, and how to reach it.

use shsa_bridge::memory::MemoryBus;
#[cfg(feature = "mqtt")]
use shsa_bridge::mqtt;
#[cfg(feature = "ros2")]
use shsa_bridge::ros2;
#[cfg(feature = "zenoh")]
use shsa_bridge::zenoh;
use shsa_bridge::{Bridge, BridgeError, Inbox};
use std::fmt;
use std::net::IpAddr;
use std::path::PathBuf;
use std::str::FromStr;
#[cfg(feature = "mqtt")]
use std::time::Duration;

/// Where the bus is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Address {
    /// Within this process.
    Memory,
    /// An MQTT broker, by its address with all settings.
    Mqtt(String),
    /// A Zenoh network, reached at these endpoints, or as a configuration file says.
    Zenoh(Vec<String>),
    /// The nodes of ROS 2 on a Zenoh network, reached at these endpoints.
    Ros2(Vec<String>),
}

impl FromStr for Address {
    type Err = String;

    /// # Errors
    /// Says what an address looks like.
    fn from_str(text: &str) -> Result<Address, String> {
        let (scheme, place) =
            text.split_once("://").map_or((text, None), |(scheme, place)| (scheme, Some(place)));
        match (scheme, place) {
            ("memory", None) => Ok(Address::Memory),
            ("mqtt" | "mqtts", Some(_)) => Ok(Address::Mqtt(text.to_owned())),
            ("zenoh", place) => Ok(Address::Zenoh(endpoints(place.unwrap_or_default()))),
            ("ros2", place) => Ok(Address::Ros2(endpoints(place.unwrap_or(ROUTER)))),
            _ => Err(format!(
                "`{text}` is no bus; write memory, mqtt://HOST:PORT, mqtts://HOST:PORT, zenoh, zenoh://HOST:PORT, ros2, or ros2://HOST:PORT"
            )),
        }
    }
}

/// Where nodes of `rmw_zenoh` expect the router.
const ROUTER: &str = "127.0.0.1:7447";

fn endpoints(places: &str) -> Vec<String> {
    places.split(',').filter(|place| !place.is_empty()).map(endpoint).collect()
}

/// An endpoint of Zenoh; without a protocol it is TCP.
fn endpoint(place: &str) -> String {
    if place.contains('/') { place.to_owned() } else { format!("tcp/{place}") }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Address::Memory => f.write_str("memory"),
            Address::Mqtt(address) => f.write_str(address),
            Address::Zenoh(places) if places.is_empty() => f.write_str("zenoh"),
            Address::Zenoh(places) => write!(f, "zenoh://{}", places.join(",")),
            Address::Ros2(places) => write!(f, "ros2://{}", places.join(",")),
        }
    }
}

/// In what part somebody comes to a bus.
#[derive(Clone, Copy)]
enum Guest<'a> {
    /// Under a name that is the same the next time.
    Member(&'a str),
    /// To look on, and to leave no trace.
    Visitor,
}

/// The arguments of every command that uses a bus.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Bus")]
pub(crate) struct BusArguments {
    /// The middleware: memory (a simulated robot in this process), zenoh, zenoh://HOST:PORT,.. or zenoh://tls/HOST:PORT;
    /// mqtt://HOST:PORT, or mqtts:// for TLS, with settings like ?version=3.1.1&qos=0&session=60. User and password of
    /// MQTT are taken from SHSA_MQTT_USER and SHSA_MQTT_PASSWORD, or ?user=NAME&password-file=FILE.
    /// ros2 or ros2://HOST:PORT, the router of rmw_zenoh.
    #[arg(long, value_name = "BUS", default_value = "memory")]
    pub(crate) bus: Address,
    /// Messages of one topic that may wait; the oldest make room for newer ones.
    #[arg(long, value_name = "N", default_value_t = 1024)]
    pub(crate) queue: usize,
    /// A configuration file of Zenoh, JSON5 or YAML.
    #[arg(long, value_name = "FILE")]
    bus_config: Option<PathBuf>,
    /// Where others may connect, as tcp/127.0.0.1:7447 (Zenoh); nothing listens unless it is said here or in the file.
    #[arg(long, value_name = "ENDPOINT")]
    bus_listen: Vec<String>,
    /// The domain of the nodes of ROS 2.
    #[arg(long, value_name = "N", env = "ROS_DOMAIN_ID", default_value_t = 0)]
    ros_domain: u32,
    /// The nodes of ROS 2 speak DDS, and zenoh-bridge-ros2dds translates; without it they speak Zenoh (rmw_zenoh).
    #[arg(long)]
    ros_dds: bool,
    /// The certificate of the authority that the other side's certificate is checked by (PEM).
    #[arg(long, value_name = "FILE")]
    ca: Option<PathBuf>,
    /// Our certificate, for others that ask for it (PEM).
    #[arg(long, value_name = "FILE", requires = "key")]
    certificate: Option<PathBuf>,
    /// The key of our certificate (PEM).
    #[arg(long, value_name = "FILE", requires = "certificate")]
    key: Option<PathBuf>,
}

impl BusArguments {
    /// As if they had been written: an address and how many messages of a topic may wait, and nothing else.
    pub(crate) fn at(bus: Address, queue: usize) -> BusArguments {
        BusArguments {
            bus,
            queue,
            bus_config: None,
            bus_listen: Vec::new(),
            ros_domain: 0,
            ros_dds: false,
            ca: None,
            certificate: None,
            key: None,
        }
    }

    /// Connects; what arrives waits in `inbox`. The bus in memory is `memory`.
    ///
    /// # Errors
    /// When the address or the configuration cannot be used, or the other side refuses.
    pub(crate) fn open(
        &self,
        name: &str,
        inbox: Inbox,
        memory: &MemoryBus,
    ) -> Result<Box<dyn Bridge>, BridgeError> {
        self.connect(Guest::Member(name), inbox, memory)
    }

    /// As [`BusArguments::open`] for somebody who only looks on, and leaves no trace.
    ///
    /// # Errors
    /// As there.
    pub(crate) fn visit(&self, inbox: Inbox, memory: &MemoryBus) -> Result<Box<dyn Bridge>, BridgeError> {
        self.connect(Guest::Visitor, inbox, memory)
    }

    /// Whether nobody but the other side reads what we send: it stays on this machine, or is encrypted. What a configuration
    /// file says is not looked at.
    pub(crate) fn is_private(&self) -> bool {
        let is_private = |place: &str| {
            let (protocol, host) = place.split_once('/').unwrap_or(("tcp", place));
            matches!(protocol, "tls" | "quic" | "wss") || protocol.starts_with("unix") || is_loopback(host)
        };
        match &self.bus {
            Address::Memory => true,
            Address::Mqtt(address) => {
                let (scheme, place) = address.split_once("://").unwrap_or_default();
                matches!(scheme, "mqtts" | "ssl") || is_loopback(place)
            }
            Address::Zenoh(places) | Address::Ros2(places) => {
                // Without a place, others are found by scouting, wherever they are.
                let mut all = places.iter().chain(&self.bus_listen);
                !(places.is_empty() && self.bus_listen.is_empty()) && all.all(|place| is_private(place))
            }
        }
    }

    fn connect(
        &self,
        guest: Guest<'_>,
        inbox: Inbox,
        memory: &MemoryBus,
    ) -> Result<Box<dyn Bridge>, BridgeError> {
        match &self.bus {
            Address::Memory => Ok(Box::new(memory.join_with(inbox))),
            #[cfg(feature = "mqtt")]
            Address::Mqtt(address) => {
                Ok(Box::new(mqtt::MqttBridge::open(&self.mqtt(address, guest)?, inbox)?))
            }
            #[cfg(not(feature = "mqtt"))]
            Address::Mqtt(_) => Err(not_built("mqtt")),
            #[cfg(feature = "zenoh")]
            Address::Zenoh(places) => Ok(Box::new(zenoh::ZenohBridge::open(&self.zenoh(places), inbox)?)),
            #[cfg(not(feature = "zenoh"))]
            Address::Zenoh(_) => Err(not_built("zenoh")),
            #[cfg(feature = "ros2")]
            Address::Ros2(places) => Ok(Box::new(ros2::Ros2Bridge::open(&self.ros2(places, guest), inbox)?)),
            #[cfg(not(feature = "ros2"))]
            Address::Ros2(_) => Err(not_built("ros2")),
        }
    }

    /// `shsa/NAME/status` says whether it is there.
    #[cfg(feature = "mqtt")]
    fn mqtt(&self, address: &str, guest: Guest<'_>) -> Result<mqtt::Options, BridgeError> {
        let name = match guest {
            Guest::Member(name) => name,
            Guest::Visitor => &format!("shsa-visitor-{}", std::process::id()),
        };
        let mut options =
            mqtt::Options::parse(address, name)?.with_environment(|key| std::env::var(key).ok());
        if let Guest::Visitor = guest {
            options.session = Duration::ZERO;
            options.name = name.to_owned();
        } else {
            let (here, gone) = ("online".into(), "offline".into());
            options.presence = Some(mqtt::Presence { topic: format!("shsa/{name}/status"), here, gone });
        }
        let files = [&self.ca, &self.certificate, &self.key];
        if options.tls.is_none() && files.iter().any(|file| file.is_some()) {
            return Err(BridgeError::Configuration("--ca, --certificate and --key need mqtts://".to_owned()));
        }
        if let Some(tls) = &mut options.tls {
            tls.authorities = tls.authorities.take().or_else(|| self.ca.clone());
            tls.certificate = tls.certificate.take().or_else(|| self.certificate.clone());
            tls.key = tls.key.take().or_else(|| self.key.clone());
        }
        Ok(options)
    }

    #[cfg(feature = "ros2")]
    fn ros2(&self, places: &[String], guest: Guest<'_>) -> ros2::Options {
        let name = match guest {
            Guest::Member(name) => name.replace('-', "_"),
            Guest::Visitor => format!("shsa_visitor_{}", std::process::id()),
        };
        let usual = ros2::Options::new(self.zenoh(places));
        ros2::Options {
            wire: if self.ros_dds { ros2::Wire::Plain } else { ros2::Wire::Rmw },
            domain: self.ros_domain,
            node: ros2::Node { name, ..usual.node.clone() },
            ..usual
        }
    }

    /// Where nobody can connect to us, routers have to pass on what others say: they do so for clients, not for peers.
    #[cfg(feature = "zenoh")]
    fn zenoh(&self, places: &[String]) -> zenoh::Options {
        let mode = match (&self.bus_config, self.bus_listen.is_empty()) {
            (Some(_), _) => None,
            (None, true) => Some(zenoh::Mode::Client),
            (None, false) => Some(zenoh::Mode::Peer),
        };
        zenoh::Options {
            mode,
            connect: places.to_vec(),
            listen: self.bus_listen.clone(),
            config: self.bus_config.clone(),
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

#[cfg(not(all(feature = "mqtt", feature = "ros2", feature = "zenoh")))]
fn not_built(feature: &str) -> BridgeError {
    BridgeError::Configuration(format!("this program was built without its feature `{feature}`"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bus_is_private_on_this_machine_or_encrypted() {
        #[derive(clap::Parser)]
        struct Line {
            #[command(flatten)]
            bus: BusArguments,
        }
        for (line, expected) in [
            ("--bus memory", true),
            ("--bus mqtt://127.0.0.1:1883?qos=0", true),
            ("--bus mqtt://localhost", true),
            ("--bus mqtts://broker", true),
            ("--bus mqtt://broker:1883", false),
            ("--bus mqtt://127.0.0.1.example.org", false),
            ("--bus zenoh", false),
            ("--bus zenoh://127.0.0.1:7447", true),
            ("--bus zenoh://[::1]:7447,tls/router:7447", true),
            ("--bus zenoh://127.0.0.1:7447,router:7447", false),
            ("--bus zenoh --bus-listen tcp/0.0.0.0:7447", false),
            ("--bus zenoh --bus-listen tcp/127.0.0.1:7447", true),
            ("--bus ros2", true),
        ] {
            let words = std::iter::once("shsa").chain(line.split(' '));
            let Line { bus } = clap::Parser::parse_from(words);
            assert_eq!(bus.is_private(), expected, "{line}");
        }
    }

    #[test]
    fn addresses_are_read_and_shown() {
        for (text, shown) in [
            ("memory", "memory"),
            ("mqtt://broker:1883?qos=0", "mqtt://broker:1883?qos=0"),
            ("zenoh", "zenoh"),
            ("ros2", "ros2://tcp/127.0.0.1:7447"),
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
