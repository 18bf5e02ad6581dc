//! ROS 2 over Zenoh: as a node among nodes of `rmw_zenoh`, or at the keys of `zenoh-bridge-ros2dds`.
//!
//! Received payloads are CDR; the key has the type, or else the subscription. A value is published as `std_msgs/msg/Float64` (a
//! list as `Float64MultiArray`) unless the topic was [advertised](Bridge::advertise) with another type, as `TYPE#FIELD` if the
//! value is not its field `data`. A text is published as `std_msgs/msg/String`. A topic that was received before keeps its type.
//!
//! A message of ROS cannot carry its provenance.

mod name;
mod discovery;
mod outlet;

use crate::cdr::type_hash;
use crate::ros::{Form, bare, check_name, dds_name, publish_diagnostics, type_for, unknown};
use crate::zenoh::{self, Connection, Liveliness, Pace, Token};
use crate::{
    Answer, Attendance, Bridge, BridgeError, Channel, Diagnostic, Inbox, Link, Outgoing, Payload,
    PublisherId, Server, Taker,
};
use ::zenoh::Wait;
use ::zenoh::bytes::Encoding;
use ::zenoh::key_expr::KeyExpr;
use ::zenoh::sample::Sample;
use bytes::Bytes;
use discovery::Discovery;
use name::{Attachment, Entity, NO_HASH, WireType};
use outlet::Outlet;
use shsa_core::time::Time;
use shsa_message::ros::{Types, full_name};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, PoisonError, RwLock};
use std::time::Duration;

/// The naming scheme of keys and attachments.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wire {
    /// Of `rmw_zenoh`: the nodes themselves speak Zenoh.
    Rmw,
    /// Of `zenoh-bridge-ros2dds`: the nodes speak DDS, and a bridge translates. The keys have no types: subscribe with one.
    Plain,
}

/// The name under which tools list this bridge.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Node {
    /// Its own name.
    pub name: String,
    /// With a leading slash; `/` is the root.
    pub namespace: String,
}

/// How to join the network.
#[derive(Clone, Debug)]
pub struct Options {
    /// How to reach the network. Nodes of `rmw_zenoh` expect a router at `tcp/127.0.0.1:7447`.
    pub zenoh: zenoh::Options,
    /// The naming scheme.
    pub wire: Wire,
    /// `ROS_DOMAIN_ID` of the nodes.
    pub domain: u32,
    /// The name under which we are listed.
    pub node: Node,
    /// Whether the nodes' names have hashes of types: since Iron, not in Humble.
    pub has_hashes: bool,
    /// The known message types.
    pub types: Arc<Types>,
}

impl Options {
    /// The node `/shsa` of domain 0, among nodes of `rmw_zenoh` with the standard messages.
    #[must_use]
    pub fn new(zenoh: zenoh::Options) -> Options {
        let node = Node { name: "shsa".into(), namespace: "/".into() };
        Options { zenoh, wire: Wire::Rmw, domain: 0, node, has_hashes: true, types: Types::standard() }
    }
}

/// A node of ROS 2.
#[derive(Debug)]
pub struct Ros2Bridge {
    // Declared before the connection, to be dropped first: a publisher that outlives its session complains.
    outlets: BTreeMap<String, Outlet>,
    tokens: Vec<Token>,
    connection: Connection,
    pace: Pace,
    inbox: Inbox,
    options: Options,
    subscribed: BTreeSet<(String, Option<String>)>,
    /// The names of topics that have a subscription of their own, without the leading slash.
    named: Arc<RwLock<BTreeSet<String>>>,
    discovery: Discovery,
    is_all: bool,
    entities: u32,
    /// The number of service calls.
    calls: i64,
}

impl Ros2Bridge {
    /// Connects; an unreachable network is tried again in the background ([`Bridge::link`] shows the state).
    ///
    /// # Errors
    /// When the options cannot be used, an address cannot be listened on, or the other side refuses us.
    pub fn open(options: &Options, inbox: Inbox) -> Result<Ros2Bridge, BridgeError> {
        check_name("node", &options.node.name)?;
        if options.node.namespace != "/" {
            check_name("namespace", &options.node.namespace)?;
        }
        let mut bridge = Ros2Bridge {
            outlets: BTreeMap::new(),
            tokens: Vec::new(),
            connection: Connection::open(&options.zenoh)?,
            pace: Pace::default(),
            inbox: inbox.clone(),
            options: options.clone(),
            subscribed: BTreeSet::new(),
            named: Arc::default(),
            discovery: Discovery::new(options.wire, inbox),
            is_all: false,
            entities: 0,
            calls: 0,
        };
        bridge.announce(Entity::Node)?;
        Ok(bridge)
    }

    /// The liveliness tokens of this network.
    #[must_use]
    pub fn liveliness(&self) -> Liveliness<'_> {
        Liveliness::new(&self.connection, &self.inbox)
    }

    /// Announces an entity, so that tools list it.
    fn announce(&mut self, entity: Entity<'_>) -> Result<(), BridgeError> {
        if self.options.wire == Wire::Plain {
            return Ok(());
        }
        self.entities += 1;
        let Options { domain, node, .. } = &self.options;
        let token = name::token(*domain, self.connection.publisher(), node, self.entities, entity);
        let token = self.liveliness().declare(&token)?;
        self.tokens.push(token);
        Ok(())
    }

    /// The name of a type on the wire.
    fn wire_type(&self, message_type: &str) -> Result<WireType, BridgeError> {
        let hash = match self.options.wire {
            Wire::Rmw if self.options.has_hashes => type_hash(message_type, &self.options.types),
            _ => Some(NO_HASH.to_owned()),
        };
        let hash = hash.ok_or_else(|| unknown(message_type))?;
        Ok(WireType { dds: dds_name(message_type), hash })
    }

    /// The outlet of a topic: as advertised, else with the type received under this name, else with a type that fits the payload.
    fn outlet(&mut self, topic: &str, payload: &Payload) -> Result<&mut Outlet, BridgeError> {
        if !self.outlets.contains_key(topic) {
            match self.discovery.found(bare(topic)) {
                Some((wire_type, message_type)) => self.open_outlet(topic, &message_type, wire_type, "")?,
                None => self.advertise(topic, type_for(topic, payload)?)?,
            }
        }
        let Options { wire, domain, .. } = self.options;
        let outlet = self.outlets.get_mut(topic).ok_or_else(|| zenoh::not_open(&self.connection))?;
        if outlet.publisher.is_none() {
            let session = self.connection.session().ok_or_else(|| zenoh::not_open(&self.connection))?;
            let key = zenoh::key_of(&name::key(wire, domain, topic, &outlet.wire_type))?;
            outlet.publisher = Some(zenoh::declare_publisher(session, key)?);
        }
        Ok(outlet)
    }

    fn open_outlet(
        &mut self,
        topic: &str,
        message_type: &str,
        wire_type: WireType,
        field: &str,
    ) -> Result<(), BridgeError> {
        check_name("topic", topic)?;
        let form = Form::new(message_type, field, self.options.types.clone())?;
        self.announce(Entity::Publisher(topic, &wire_type))?;
        let outlet = Outlet { publisher: None, wire_type, form, sequence: 0 };
        self.outlets.insert(topic.to_owned(), outlet);
        Ok(())
    }
}

impl Bridge for Ros2Bridge {
    fn publisher(&self) -> PublisherId {
        self.connection.publisher()
    }

    fn channel(&self) -> Channel {
        self.connection.channel()
    }

    fn inbox(&self) -> &Inbox {
        &self.inbox
    }

    fn subscribe(&mut self, topic: &str, message_type: Option<&str>) -> Result<(), BridgeError> {
        check_name("topic", topic)?;
        if !self.subscribed.insert((topic.to_owned(), message_type.map(str::to_owned))) {
            return Ok(());
        }
        let Options { wire, domain, .. } = self.options;
        let key = pattern(&name::pattern(wire, domain, topic, message_type))?;
        if let Some(message_type) = message_type {
            // A topic of an unknown type is received, but not listed.
            if let Ok(wire_type) = self.wire_type(message_type) {
                self.announce(Entity::Subscription(topic, &wire_type))?;
                self.discovery.expect(bare(topic), &wire_type);
            }
        }
        self.named.write().unwrap_or_else(PoisonError::into_inner).insert(bare(topic).to_owned());
        let (name, discovery): (Arc<str>, _) = (topic.into(), self.discovery.clone());
        let declared_type = message_type.map(|message_type| Arc::from(full_name(message_type)));
        let deliver =
            move |sample: Sample| discovery.deliver(&sample, declared_type.as_ref(), |_| Some(name.clone()));
        zenoh::subscribe(&self.connection, key, deliver);
        Ok(())
    }

    fn subscribe_all(&mut self) -> Result<(), BridgeError> {
        if std::mem::replace(&mut self.is_all, true) {
            return Ok(());
        }
        let key = match self.options.wire {
            Wire::Rmw => pattern(&format!("{}/**", self.options.domain))?,
            Wire::Plain => pattern("**")?,
        };
        let (named, discovery) = (self.named.clone(), self.discovery.clone());
        let name = move |topic: &str| {
            // A named topic has a subscription of its own.
            let is_named = named.read().unwrap_or_else(PoisonError::into_inner).contains(topic);
            (!is_named).then(|| format!("/{topic}").into())
        };
        let deliver = move |sample: Sample| discovery.deliver(&sample, None, &name);
        zenoh::subscribe(&self.connection, key, deliver);
        Ok(())
    }

    /// `TYPE`, or `TYPE#FIELD` to write values to another field than `data`.
    fn advertise(&mut self, topic: &str, message_type: &str) -> Result<(), BridgeError> {
        let (message_type, field) = message_type.split_once('#').unwrap_or((message_type, ""));
        if self.outlets.contains_key(topic) {
            return Ok(());
        }
        let wire_type = match self.discovery.found(bare(topic)) {
            // The name that its other publishers use.
            Some((wire_type, known)) if *known == *full_name(message_type) => wire_type,
            _ => self.wire_type(message_type)?,
        };
        self.open_outlet(topic, message_type, wire_type, field)
    }

    fn publish(&mut self, message: Outgoing<'_>) -> Result<(), BridgeError> {
        let (publisher, wire) = (self.connection.publisher(), self.options.wire);
        let outlet = self.outlet(message.topic, &message.payload)?;
        let bytes = outlet.form.encode(&message)?;
        outlet.sequence += 1;
        let beside = Attachment { sequence: outlet.sequence, stamp: message.stamp, publisher };
        self.pace.take(bytes.len() + message.topic.len());
        let outlet = self.outlets.get(message.topic);
        let Some(to) = outlet.and_then(|outlet| outlet.publisher.as_ref()) else { return Ok(()) };
        let put = to.put(bytes).encoding(Encoding::APPLICATION_CDR);
        let put = if wire == Wire::Rmw { put.attachment(beside.write()) } else { put };
        put.wait().map_err(zenoh::lost)
    }

    fn diagnose(
        &mut self,
        stamp: Time,
        states: &mut dyn FnMut() -> Vec<Diagnostic>,
    ) -> Result<(), BridgeError> {
        publish_diagnostics(self, stamp, &states())
    }

    fn link(&self) -> Link {
        self.connection.link()
    }

    /// Under the plain key: the asker is a client of Zenoh and no node.
    fn serve(&mut self, name: &str, answers: &str, server: Server) -> Result<(), BridgeError> {
        zenoh::serve(&self.connection, name, answers, server)
    }

    fn ask(&self, name: &str, longest: usize, take: Taker) -> Result<(), BridgeError> {
        zenoh::ask(&self.connection, &self.inbox, name, longest, take)
    }

    fn attend(&self, name: &str) -> Result<Option<Box<dyn Send>>, BridgeError> {
        Ok(Some(Box::new(self.liveliness().declare(name)?)))
    }

    fn attendance(&self, pattern: &str) -> Result<Option<Attendance>, BridgeError> {
        Ok(Some(self.liveliness().watch(pattern)?.into()))
    }

    /// A call of a service of any type, in CDR.
    fn request(&mut self, to: &str, payload: Bytes, within: Duration) -> Result<Answer, BridgeError> {
        check_name("service", to)?;
        let Options { wire, domain, .. } = self.options;
        let key = pattern(&name::pattern(wire, domain, to, None))?;
        self.calls += 1;
        let stamp = self.inbox.clock().by_wall(self.inbox.clock().now());
        let beside = Attachment { sequence: self.calls, stamp, publisher: self.connection.publisher() };
        let beside = (wire == Wire::Rmw).then(|| beside.write());
        zenoh::request::request(&self.connection, key, payload, beside, within)
    }
}

fn pattern(text: &str) -> Result<KeyExpr<'static>, BridgeError> {
    KeyExpr::try_from(text.to_owned()).map_err(zenoh::lost)
}
