//! The transport alone, for comparison. A relay receives one topic and publishes its messages under another, by nothing but the
//! client library. A router of Zenoh forwards messages. Each is a process of its own that ends when its standard input ends.

use super::middleware::Kind;
use crate::Outcome;
use anyhow::Context;
#[cfg(any(feature = "mqtt", feature = "zenoh"))]
use std::io::{Read, stdin};
use std::process::{Child, Command, Stdio};

/// Arguments of the hidden commands.
#[derive(clap::Subcommand)]
pub(super) enum Arguments {
    /// Publishes the values of one name again under another.
    #[command(hide = true)]
    Relay {
        /// Which middleware.
        kind: Kind,
        /// Its port on this machine.
        port: u16,
        /// The topics to subscribe to.
        from: String,
        /// What to say.
        to: String,
    },
    /// A router of Zenoh.
    #[command(hide = true)]
    Router {
        /// Its port on this machine.
        port: u16,
    },
}

/// Starts one of the hidden commands in a process of its own.
///
/// # Errors
/// When it cannot be started.
pub(super) fn command(which: &str, arguments: &[&str]) -> anyhow::Result<Child> {
    let program = std::env::current_exe().context("cannot find this program")?;
    let mut command = Command::new(program);
    command.args(["live", which]).args(arguments);
    command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::inherit());
    command.spawn().with_context(|| format!("cannot start a {which}"))
}

/// Runs one of the hidden commands until standard input ends.
///
/// # Errors
/// When the middleware refuses.
pub(super) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    match arguments {
        Arguments::Router { port } => router(*port)?,
        Arguments::Relay { kind: Kind::Memory, .. } => {}
        Arguments::Relay { kind: Kind::Mqtt, port, from, to } => mqtt_relay(*port, from, to)?,
        Arguments::Relay { kind: Kind::Zenoh, port, from, to } => zenoh_relay(*port, from, to)?,
    }
    Ok(Outcome::Done)
}

/// Standard input ends when the starting process ends or closes it.
#[cfg(any(feature = "mqtt", feature = "zenoh"))]
fn wait_for_the_end() {
    let _ = stdin().lock().read_to_end(&mut Vec::new());
}

#[cfg(feature = "mqtt")]
fn mqtt_relay(port: u16, from: &str, to: &str) -> anyhow::Result<()> {
    use rumqttc::NetworkOptions;
    use rumqttc::v5::mqttbytes::QoS;
    use rumqttc::v5::mqttbytes::v5::{Packet, PublishProperties};
    use rumqttc::v5::{Client, Event, MqttOptions};

    std::thread::spawn(|| {
        wait_for_the_end();
        std::process::exit(0);
    });
    let mut options = MqttOptions::new("bench-relay", "127.0.0.1", port);
    let mut network = NetworkOptions::new();
    network.set_tcp_nodelay(true);
    options.set_network_options(network);
    let (client, mut connection) = Client::new(options, 1024);
    client.subscribe(from, QoS::AtLeastOnce)?;
    for event in connection.iter() {
        let Event::Incoming(Packet::Publish(message)) = event? else { continue };
        let user_properties =
            message.properties.map(|properties| properties.user_properties).unwrap_or_default();
        let properties = PublishProperties { user_properties, ..PublishProperties::default() };
        client.try_publish_with_properties(to, QoS::AtLeastOnce, false, message.payload, properties)?;
    }
    Ok(())
}

#[cfg(not(feature = "mqtt"))]
fn mqtt_relay(_: u16, _: &str, _: &str) -> anyhow::Result<()> {
    anyhow::bail!("this program was built without its feature `mqtt`")
}

#[cfg(feature = "zenoh")]
fn zenoh_session(mode: &str, side: &str, port: u16) -> anyhow::Result<zenoh::Session> {
    use zenoh::Wait;

    let mut config = zenoh::Config::default();
    let endpoints = format!("[\"tcp/127.0.0.1:{port}\"]");
    for (key, value) in [
        ("mode", format!("\"{mode}\"")),
        ("scouting/multicast/enabled", "false".to_owned()),
        ("listen/endpoints", "[]".to_owned()),
        (side, endpoints),
        ("transport/link/tx/queue/size/real_time", "16".to_owned()),
        ("transport/link/tx/queue/congestion_control/drop/wait_before_drop", "2000000".to_owned()),
    ] {
        config.insert_json5(key, &value).map_err(|problem| anyhow::anyhow!("{key}: {problem}"))?;
    }
    zenoh::open(config).wait().map_err(|problem| anyhow::anyhow!("{problem}"))
}

#[cfg(feature = "zenoh")]
fn router(port: u16) -> anyhow::Result<()> {
    let _session = zenoh_session("router", "listen/endpoints", port)?;
    wait_for_the_end();
    Ok(())
}

#[cfg(feature = "zenoh")]
fn zenoh_relay(port: u16, from: &str, to: &str) -> anyhow::Result<()> {
    use zenoh::Wait;
    use zenoh::qos::{CongestionControl, Priority};
    use zenoh::sample::Sample;

    let wrong = |problem| anyhow::anyhow!("{problem}");
    let session = zenoh_session("client", "connect/endpoints", port)?;
    let publisher = session.declare_publisher(to.to_owned());
    let publisher = publisher.priority(Priority::RealTime).congestion_control(CongestionControl::Drop);
    let publisher = publisher.wait().map_err(wrong)?;
    let relay = move |sample: Sample| {
        let put = publisher.put(sample.payload().clone()).attachment(sample.attachment().cloned());
        // A message that cannot be sent is missing at the consumer, and counted there.
        let _ = put.wait();
    };
    let _subscriber = session.declare_subscriber(from).callback(relay).wait().map_err(wrong)?;
    wait_for_the_end();
    Ok(())
}

#[cfg(not(feature = "zenoh"))]
fn router(_: u16) -> anyhow::Result<()> {
    anyhow::bail!("this program was built without its feature `zenoh`")
}

#[cfg(not(feature = "zenoh"))]
fn zenoh_relay(port: u16, _: &str, _: &str) -> anyhow::Result<()> {
    router(port)
}
