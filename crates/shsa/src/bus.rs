//! `--bus ..`: the arguments of every command that uses a bus.

use shsa_bridge::{Address, BusOptions};
use std::path::PathBuf;

/// The arguments of every command that uses a bus.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Bus")]
pub(crate) struct BusArguments {
    /// The middleware: memory (a simulated robot in this process), zenoh, zenoh://HOST:PORT,.. or zenoh://tls/HOST:PORT;
    /// mqtt://HOST:PORT, or mqtts:// for TLS, with settings like ?version=3.1.1&qos=0&session=60. User and password of
    /// MQTT are taken from SHSA_MQTT_USER and SHSA_MQTT_PASSWORD, or ?user=NAME&password-file=FILE.
    /// sparkplug://HOST:PORT/GROUP/NODE or sparkplugs://: edge nodes of Sparkplug B on a broker, and NODE for what is published.
    /// ros2 or ros2://HOST:PORT, the router of rmw_zenoh; ros2-dds (DDS on the loopback interface), ros2-dds://eth0,.. or
    /// ros2-dds://all.
    #[arg(long, value_name = "BUS", default_value = "memory")]
    pub(crate) bus: Address,
    /// Messages of one topic that may wait; the oldest make room for newer ones.
    #[arg(long, value_name = "N", default_value_t = 1024)]
    pub(crate) queue: usize,
    /// A configuration file of Zenoh, JSON5 or YAML.
    #[arg(long, value_name = "FILE")]
    bus_config: Option<PathBuf>,
    /// The address at which others may connect, as tcp/127.0.0.1:7447 (Zenoh); by default, that of the file, or none.
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
    /// The options of the bus that the arguments name.
    pub(crate) fn options(&self) -> BusOptions {
        BusOptions {
            address: self.bus.clone(),
            config: self.bus_config.clone(),
            listen: self.bus_listen.clone(),
            ros_domain: self.ros_domain,
            ros_dds: self.ros_dds,
            ca: self.ca.clone(),
            certificate: self.certificate.clone(),
            key: self.key.clone(),
        }
    }
}
