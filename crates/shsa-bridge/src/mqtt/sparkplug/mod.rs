//! Sparkplug B 3.0.0 on MQTT, as a host application and as an edge node.
//!
//! `edge nodes -> broker -> host application -> inbox`, `metrics -> our edge node -> broker -> consumers`
//!
//! The host application follows the edge nodes and devices that the model names, `GROUP/NODE` or `GROUP/NODE/DEVICE`; the fields
//! of their messages are metrics. What is published becomes metrics of an edge node of our own. Each of the two has a connection
//! with a will of its own; one thread drives both. Topics that begin with `shsa/` are ordinary ones of MQTT, on the host
//! application's connection.

mod name;
mod followed;
mod host;
mod metrics;
mod edge_node;
mod options;

pub use name::NodeName;
pub use options::Options;

use super::{Companion, MqttBridge};
use crate::{
    Answer, Bridge, BridgeError, Channel, Inbox, Link, Message, Offered, Outage, Outgoing, PublisherId,
    Quality, Server,
};
use bytes::Bytes;
use edge_node::EdgeNode;
use host::{Host, HostOptions};
use shsa_core::time::Time;
use std::sync::Arc;
use std::time::Duration;

/// The first level of ordinary topics.
const ORDINARY: &str = "shsa/";

/// A host application with an edge node of its own.
pub struct SparkplugBridge {
    mqtt: MqttBridge,
    host: Arc<Host>,
    /// `None`: an observer publishes nothing.
    node: Option<Arc<EdgeNode>>,
}

impl SparkplugBridge {
    /// Connects; received messages wait in `inbox`. Returns when the first attempt of the host application has ended, or its time
    /// has passed. An unreachable broker is no error: the bridge keeps trying, and [`Bridge::link`] shows the state.
    ///
    /// # Errors
    /// As [`MqttBridge::open`].
    pub fn open(options: &Options, inbox: Inbox) -> Result<SparkplugBridge, BridgeError> {
        let Options { mqtt, node, host, reorder } = options;
        let host_options = HostOptions {
            id: host.clone(),
            reorder: *reorder,
            own: node.clone(),
            size_limit: mqtt.size_limit,
        };
        let host = Arc::new(Host::new(host_options, inbox.clone()));
        let node = node.as_ref().map(|name| Arc::new(EdgeNode::new(name, inbox.clock().clone())));
        let companion = node.clone().map(|node| Companion { options: options.of_node(), profile: node });
        let mqtt = MqttBridge::open_with(mqtt, inbox, Some(host.clone()), companion)?;
        Ok(SparkplugBridge { mqtt, host, node })
    }

    fn node(&self) -> Result<&EdgeNode, BridgeError> {
        self.node
            .as_deref()
            .ok_or_else(|| BridgeError::Configuration("an observer publishes nothing".to_owned()))
    }
}

impl Bridge for SparkplugBridge {
    fn publisher(&self) -> PublisherId {
        self.mqtt.publisher()
    }

    fn channel(&self) -> Channel {
        self.mqtt.channel()
    }

    fn inbox(&self) -> &Inbox {
        self.mqtt.inbox()
    }

    fn subscribe(&mut self, topic: &str, message_type: Option<&str>) -> Result<(), BridgeError> {
        if topic.starts_with(ORDINARY) {
            return self.mqtt.subscribe(topic, message_type);
        }
        let request = self.host.follow(topic)?;
        self.mqtt.shared.follow_profile(request);
        Ok(())
    }

    fn subscribe_all(&mut self) -> Result<(), BridgeError> {
        self.host.follow_all();
        self.mqtt.shared.follow_profile(None);
        Ok(())
    }

    fn offer(&mut self, owner: &str, offered: &[Offered<'_>]) {
        if let Some(node) = &self.node {
            node.announce(owner, offered);
            self.mqtt.has_published = true;
        }
    }

    fn publish(&mut self, message: Outgoing<'_>) -> Result<(), BridgeError> {
        if message.topic.starts_with(ORDINARY) {
            return self.mqtt.publish(message);
        }
        self.node()?.publish(&message, self.mqtt.until(message.expires))?;
        self.mqtt.has_published = true;
        Ok(())
    }

    fn rate(&mut self, topic: &str, stamp: Time, quality: Quality) {
        if let Some(node) = &self.node {
            node.rate(topic, quality, stamp);
            self.mqtt.has_published = true;
        }
    }

    fn flush(&mut self) {
        if self.mqtt.has_published {
            self.mqtt.companion.iter().for_each(|companion| companion.pump());
        }
        self.mqtt.flush();
    }

    fn link(&self) -> Link {
        let of_node = self.mqtt.companion.as_ref().map_or(Link::Up, |companion| companion.link());
        match self.mqtt.link() {
            Link::Up => of_node,
            down => down,
        }
    }

    fn outage(&self) -> Option<Outage> {
        self.mqtt.outage()
    }

    fn request(&mut self, to: &str, payload: Bytes, within: Duration) -> Result<Answer, BridgeError> {
        self.mqtt.request(to, payload, within)
    }

    /// The bounds of a metric are properties of it, and an uncertain value has the quality `bad`: nobody takes its middle for the value.
    fn carries_bounds(&self) -> bool {
        self.node.is_some()
    }

    /// The messages of an edge node do not name their sender.
    fn knows_own(&self) -> bool {
        false
    }

    fn serve(&mut self, name: &str, answers: &str, server: Server) -> Result<(), BridgeError> {
        self.mqtt.serve(name, answers, server)
    }

    fn troubles(&mut self) -> Vec<BridgeError> {
        let of_node = self.mqtt.companion.iter().flat_map(|companion| companion.troubles());
        let mut all: Vec<BridgeError> = of_node.chain(self.host.troubles()).collect();
        all.extend(self.mqtt.troubles());
        all
    }

    fn receive(&mut self) -> Option<Message> {
        self.mqtt.receive().or_else(|| {
            let requests = self.host.pass();
            if !requests.is_empty() {
                self.mqtt.shared.follow_profile(requests);
            }
            self.mqtt.receive()
        })
    }
}
