//! One interface to both versions of the protocol: requests go in, events come out.
//!
//! A new client is made for each connection. [`Client::unfinished`] gives what the previous one had not finished; its other state
//! is dropped.

mod failure;

pub(super) use failure::Failure;

use super::options::{Delivery, Options, Version};
use super::outbox::Publication;
use super::profile::Will;
use crate::clock::Uptime;
use crate::{BridgeError, PublisherId};
use bytes::Bytes;
use failure::{failure_v4, failure_v5};
use rumqttc::v5::mqttbytes::v5::RetainForwardRule::{OnEverySubscribe, OnNewSubscribe};
use rumqttc::{NetworkOptions, QoS, Transport, v5};
use std::time::Duration;

/// The number of requests that may wait for the connection; a flood of one topic delays others by no more.
const REQUESTS_MAX: usize = 128;
/// The number of publications without an acknowledgement of the broker.
const UNACKNOWLEDGED_MAX: u16 = 256;
/// The bytes of a message beside its payload: topic, properties, header.
const ENVELOPE_MAX: usize = 1 << 16;
/// The largest message of the protocol in bytes, with its header.
const PROTOCOL_MAX: usize = 268_435_455 + 5;

/// What a subscription is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Purpose {
    /// Values, which the broker may keep during our absence.
    Values,
    /// Questions: those from the time of our absence are useless.
    Questions,
    /// The claims of all clients.
    Claims,
    /// What a profile follows.
    Profile,
}

/// Takes requests.
#[derive(Clone, Debug)]
pub(super) enum Sender {
    V4(rumqttc::AsyncClient, QoS),
    V5(v5::AsyncClient, v5::mqttbytes::QoS, PublisherId),
}

/// The connection, which must be polled.
pub(super) enum Client {
    V4(Box<rumqttc::EventLoop>),
    V5(Box<v5::EventLoop>),
}

/// An event of the connection.
pub(super) enum Happening {
    /// `has_kept`: the broker has a session of an earlier connection.
    Connected {
        has_kept: bool,
    },
    Arrived(Arrived),
    /// A subscription has gone out under this number.
    Subscribing(u16),
    /// The broker's answer to the subscription, with the reason of a refusal.
    Subscribed(u16, Option<String>),
    /// A publication was sent under this number; 0 for one without acknowledgement.
    Publishing(u16),
    /// The publication with this number was refused, for this reason.
    Refused(u16, String),
    Other,
}

/// A message.
pub(super) struct Arrived {
    pub(super) topic: Bytes,
    pub(super) payload: Bytes,
    pub(super) retained: bool,
    pub(super) duplicate: bool,
    /// User properties; none in 3.1.1.
    pub(super) properties: Vec<(String, String)>,
    /// The topic for an answer, and the correlation data of the asker; none in 3.1.1.
    pub(super) response_topic: Option<String>,
    pub(super) correlation: Option<Bytes>,
}

/// A client that is not yet connected, with the will of its connection.
pub(super) fn new(
    options: &Options,
    publisher: PublisherId,
    will: Option<Will>,
) -> Result<(Sender, Client), BridgeError> {
    let transport =
        options.tls.as_ref().map(|tls| tls.configuration().map(Transport::tls_with_config)).transpose()?;
    let transport = transport.unwrap_or_else(Transport::tcp);
    let mut network = NetworkOptions::new();
    network.set_tcp_nodelay(true);
    Ok(match options.version {
        Version::V311 => new_v4(options, transport, network, will),
        Version::V5 => new_v5(options, transport, network, publisher, will),
    })
}

fn new_v4(
    options: &Options,
    transport: Transport,
    network: NetworkOptions,
    will: Option<Will>,
) -> (Sender, Client) {
    let mut mqtt = rumqttc::MqttOptions::new(&options.name, &options.host, options.port);
    mqtt.set_transport(transport)
        .set_keep_alive(keep_alive(options))
        .set_clean_session(!options.is_kept())
        .set_inflight(UNACKNOWLEDGED_MAX)
        .set_pending_throttle(Duration::ZERO)
        // A message that is too large must be taken from the broker, else the broker sends it again and again.
        .set_max_packet_size(PROTOCOL_MAX, options.size_limit.saturating_add(ENVELOPE_MAX));
    if let Some(credentials) = &options.credentials {
        mqtt.set_credentials(&credentials.user, &credentials.password);
    }
    if let Some(Will { topic, payload, retain }) = will {
        mqtt.set_last_will(rumqttc::LastWill::new(topic, payload, QoS::AtLeastOnce, retain));
    }
    let qos = qos_v4(options.delivery);
    let (client, mut connection) = rumqttc::AsyncClient::new(mqtt, REQUESTS_MAX);
    connection.set_network_options(network);
    (Sender::V4(client, qos), Client::V4(Box::new(connection)))
}

fn new_v5(
    options: &Options,
    transport: Transport,
    network: NetworkOptions,
    publisher: PublisherId,
    will: Option<Will>,
) -> (Sender, Client) {
    use v5::mqttbytes::QoS;
    let mut mqtt = v5::MqttOptions::new(&options.name, &options.host, options.port);
    let packet_max = options.size_limit.saturating_add(ENVELOPE_MAX).min(PROTOCOL_MAX);
    mqtt.set_transport(transport)
        .set_keep_alive(keep_alive(options))
        .set_clean_start(!options.is_kept())
        .set_session_expiry_interval(Some(u32::try_from(options.session.as_secs()).unwrap_or(u32::MAX)))
        // The broker does not send larger messages.
        .set_max_packet_size(u32::try_from(packet_max).ok())
        .set_pending_throttle(Duration::ZERO)
        .set_network_options(network);
    mqtt.set_outgoing_inflight_upper_limit(UNACKNOWLEDGED_MAX);
    if let Some(credentials) = &options.credentials {
        mqtt.set_credentials(&credentials.user, &credentials.password);
    }
    if let Some(Will { topic, payload, retain }) = will {
        let will = v5::mqttbytes::v5::LastWill::new(topic, payload, QoS::AtLeastOnce, retain, None);
        mqtt.set_last_will(will);
    }
    let qos = qos_v5(options.delivery);
    let (client, connection) = v5::AsyncClient::new(mqtt, REQUESTS_MAX);
    (Sender::V5(client, qos, publisher), Client::V5(Box::new(connection)))
}

fn qos_v4(delivery: Delivery) -> QoS {
    match delivery {
        Delivery::AtMostOnce => QoS::AtMostOnce,
        Delivery::AtLeastOnce => QoS::AtLeastOnce,
    }
}

fn qos_v5(delivery: Delivery) -> v5::mqttbytes::QoS {
    match delivery {
        Delivery::AtMostOnce => v5::mqttbytes::QoS::AtMostOnce,
        Delivery::AtLeastOnce => v5::mqttbytes::QoS::AtLeastOnce,
    }
}

/// With a shorter time, the library panics.
fn keep_alive(options: &Options) -> Duration {
    options.keep_alive.max(Duration::from_secs(5))
}

impl Sender {
    /// Whether the request was accepted; the queue may be full.
    pub(super) fn publish(&self, publication: &Publication) -> bool {
        let Publication { topic, payload, retain, profiled, .. } = publication;
        match self {
            Sender::V4(client, qos) => {
                let qos = profiled.map_or(*qos, qos_v4);
                client.try_publish(&**topic, qos, *retain, &**payload).is_ok()
            }
            Sender::V5(client, qos, publisher) => {
                let qos = profiled.map_or(*qos, qos_v5);
                let properties = match profiled {
                    None => properties(publication, *publisher),
                    Some(_) => v5::mqttbytes::v5::PublishProperties::default(),
                };
                client
                    .try_publish_with_properties(&**topic, qos, *retain, payload.clone(), properties)
                    .is_ok()
            }
        }
    }

    /// Whether the request was accepted.
    pub(super) fn subscribe(&self, topic: &str, purpose: Purpose) -> bool {
        let delivery = match purpose {
            Purpose::Values => None,
            Purpose::Questions | Purpose::Claims => Some(Delivery::AtMostOnce),
            Purpose::Profile => Some(Delivery::AtLeastOnce),
        };
        match self {
            Sender::V4(client, qos) => client.try_subscribe(topic, delivery.map_or(*qos, qos_v4)).is_ok(),
            Sender::V5(client, qos, _) => {
                let qos = delivery.map_or(*qos, qos_v5);
                let mut filter = v5::mqttbytes::v5::Filter::new(topic, qos);
                // After a break, retained messages are not wanted again, except the present states of clients including our own.
                filter.nolocal = matches!(purpose, Purpose::Values | Purpose::Questions);
                filter.retain_forward_rule = if filter.nolocal { OnNewSubscribe } else { OnEverySubscribe };
                client.try_subscribe_many([filter]).is_ok()
            }
        }
    }

    /// Whether the request was accepted.
    pub(super) fn unsubscribe(&self, topic: &str) -> bool {
        match self {
            Sender::V4(client, _) => client.try_unsubscribe(topic).is_ok(),
            Sender::V5(client, ..) => client.try_unsubscribe(topic).is_ok(),
        }
    }

    /// Disconnects after all earlier requests.
    pub(super) fn leave(&self) {
        let _gone_already = match self {
            Sender::V4(client, _) => client.try_disconnect().is_ok(),
            Sender::V5(client, ..) => client.try_disconnect().is_ok(),
        };
    }

    /// Whether the broker does not send messages back to their publisher.
    pub(super) fn has_no_echo(&self) -> bool {
        matches!(self, Sender::V5(..))
    }
}

/// Provenance as user properties of MQTT 5.
fn properties(publication: &Publication, publisher: PublisherId) -> v5::mqttbytes::v5::PublishProperties {
    let mut user_properties = vec![
        ("publisher".into(), publisher.to_string()),
        ("stamp_ns".into(), publication.stamp.0.to_string()),
    ];
    if let Some(provenance) = &publication.provenance {
        user_properties.extend(provenance.words());
    }
    let seconds = |until: Uptime| until.saturating_duration_since(Uptime::now()).as_secs() + 1;
    let expires = |until| u32::try_from(seconds(until)).unwrap_or(u32::MAX);
    v5::mqttbytes::v5::PublishProperties {
        // In whole seconds; without one, the message does not expire.
        message_expiry_interval: publication.until.map(expires),
        user_properties,
        response_topic: publication.answers.as_ref().map(|topic| topic.to_string()),
        correlation_data: publication.correlation.clone(),
        ..Default::default()
    }
}

impl Client {
    pub(super) async fn poll(&mut self) -> Result<Happening, Failure> {
        match self {
            Client::V4(connection) => {
                connection.poll().await.map(happening_v4).map_err(|error| failure_v4(&error))
            }
            Client::V5(connection) => {
                connection.poll().await.map(happening_v5).map_err(|error| failure_v5(&error))
            }
        }
    }

    /// The events from before the connection broke that were not reported yet: an answer may arrive together with the end.
    pub(super) fn left_over(&mut self) -> Vec<Happening> {
        match self {
            Client::V4(connection) => connection.state.events.drain(..).map(happening_v4).collect(),
            Client::V5(connection) => connection.state.events.drain(..).map(happening_v5).collect(),
        }
    }

    /// The topics of publications that may not have arrived.
    pub(super) fn unfinished(&mut self) -> Vec<String> {
        match self {
            Client::V4(connection) => {
                connection.clean();
                let publish = |request| match request {
                    rumqttc::Request::Publish(publish) => Some(publish.topic),
                    _ => None,
                };
                let collided = connection.state.collision.take().map(|publish| publish.topic);
                connection.pending.drain(..).filter_map(publish).chain(collided).collect()
            }
            Client::V5(connection) => {
                connection.clean();
                let name = |topic: Bytes| String::from_utf8_lossy(&topic).into_owned();
                let publish = |request| match request {
                    v5::Request::Publish(publish) => Some(name(publish.topic)),
                    _ => None,
                };
                let collided = connection.state.collision.take().map(|publish| name(publish.topic));
                connection.pending.drain(..).filter_map(publish).chain(collided).collect()
            }
        }
    }
}

fn happening_v4(event: rumqttc::Event) -> Happening {
    use rumqttc::{Event, Outgoing, Packet, SubscribeReasonCode};
    match event {
        Event::Incoming(Packet::ConnAck(answer)) => Happening::Connected { has_kept: answer.session_present },
        Event::Incoming(Packet::Publish(publish)) => Happening::Arrived(Arrived {
            topic: publish.topic.into(),
            payload: publish.payload,
            retained: publish.retain,
            duplicate: publish.dup,
            properties: Vec::new(),
            response_topic: None,
            correlation: None,
        }),
        Event::Incoming(Packet::SubAck(answer)) => {
            let is_refused = answer.return_codes.contains(&SubscribeReasonCode::Failure);
            Happening::Subscribed(answer.pkid, is_refused.then(|| "the broker gives no reason".into()))
        }
        Event::Outgoing(Outgoing::Subscribe(number)) => Happening::Subscribing(number),
        Event::Outgoing(Outgoing::Publish(number)) => Happening::Publishing(number),
        _ => Happening::Other,
    }
}

fn happening_v5(event: v5::Event) -> Happening {
    use rumqttc::Outgoing;
    use v5::mqttbytes::v5::{Packet, PubAckReason, SubscribeReasonCode};
    match event {
        v5::Event::Incoming(Packet::ConnAck(answer)) => {
            Happening::Connected { has_kept: answer.session_present }
        }
        v5::Event::Incoming(Packet::Publish(publish)) => {
            let beside = publish.properties.unwrap_or_default();
            Happening::Arrived(Arrived {
                topic: publish.topic,
                payload: publish.payload,
                retained: publish.retain,
                duplicate: publish.dup,
                properties: beside.user_properties,
                response_topic: beside.response_topic,
                correlation: beside.correlation_data,
            })
        }
        v5::Event::Incoming(Packet::SubAck(answer)) => {
            let is_refusal = |code: &&SubscribeReasonCode| !matches!(code, SubscribeReasonCode::Success(_));
            let refusal = answer.return_codes.iter().find(is_refusal).map(|code| format!("{code:?}"));
            Happening::Subscribed(answer.pkid, refusal)
        }
        v5::Event::Incoming(Packet::PubAck(answer))
            if !matches!(answer.reason, PubAckReason::Success | PubAckReason::NoMatchingSubscribers) =>
        {
            Happening::Refused(answer.pkid, format!("{:?}", answer.reason))
        }
        v5::Event::Outgoing(Outgoing::Subscribe(number)) => Happening::Subscribing(number),
        v5::Event::Outgoing(Outgoing::Publish(number)) => Happening::Publishing(number),
        _ => Happening::Other,
    }
}
