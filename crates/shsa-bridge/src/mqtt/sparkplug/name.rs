//! The names of edge nodes and devices, and the topics of their messages.

use crate::BridgeError;
use std::fmt;
use std::str::FromStr;

/// The first level of every topic.
pub(super) const NAMESPACE: &str = "spBv1.0";

/// An edge node, or a device of one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Place {
    pub(super) node: NodeName,
    pub(super) device: Option<String>,
}

/// The name of an edge node: its group, and its own name within the group.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct NodeName {
    /// The group.
    pub group: String,
    /// The name within the group.
    pub node: String,
}

/// The kinds of messages that edge nodes send.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    NodeBirth,
    NodeData,
    NodeDeath,
    DeviceBirth,
    DeviceData,
    DeviceDeath,
}

/// The topic of a message of an edge node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Heading<'a> {
    pub(super) kind: Kind,
    pub(super) group: &'a str,
    pub(super) node: &'a str,
    pub(super) device: Option<&'a str>,
}

impl fmt::Display for NodeName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.group, self.node)
    }
}

impl NodeName {
    /// The topic of messages of a type from or to the node.
    pub(super) fn topic(&self, message_type: &str) -> String {
        format!("{NAMESPACE}/{}/{message_type}/{}", self.group, self.node)
    }

    /// The pattern of all topics of the node and of its devices.
    pub(super) fn pattern(&self) -> String {
        format!("{NAMESPACE}/{}/+/{}/#", self.group, self.node)
    }
}

impl FromStr for NodeName {
    type Err = BridgeError;

    /// Reads `GROUP/NODE`.
    ///
    /// # Errors
    /// [`BridgeError::Configuration`] for another form.
    fn from_str(text: &str) -> Result<NodeName, BridgeError> {
        match Place::read(text) {
            Some(Place { node, device: None }) => Ok(node),
            _ => Err(BridgeError::Configuration(format!(
                "`{text}` is no edge node; write GROUP/NODE, without `+` and `#`"
            ))),
        }
    }
}

impl Place {
    /// The place that a topic of the model names.
    pub(super) fn parse(topic: &str) -> Result<Place, BridgeError> {
        Place::read(topic).ok_or_else(|| {
            BridgeError::Refused(format!(
                "`{topic}` is no edge node and no device of Sparkplug; a source is GROUP/NODE#METRIC or GROUP/NODE/DEVICE#METRIC"
            ))
        })
    }

    /// Reads `GROUP/NODE`, `GROUP/NODE/DEVICE`, or the whole topic of a message.
    fn read(topic: &str) -> Option<Place> {
        if topic.contains(['+', '#', '\0']) {
            return None;
        }
        let levels: Vec<&str> = topic.trim_start_matches('/').split('/').collect();
        let (group, node, device) = match levels[..] {
            [NAMESPACE, group, _, node] => (group, node, None),
            [NAMESPACE, group, _, node, device] => (group, node, Some(device)),
            [group, node] => (group, node, None),
            [group, node, device] => (group, node, Some(device)),
            _ => return None,
        };
        let is_named = levels.iter().all(|level| !level.is_empty()) && group != NAMESPACE;
        let name = NodeName { group: group.to_owned(), node: node.to_owned() };
        is_named.then(|| Place { node: name, device: device.map(str::to_owned) })
    }
}

impl<'a> Heading<'a> {
    /// Reads the topic of a message; `None`: it is none of an edge node.
    pub(super) fn read(topic: &'a str) -> Option<Heading<'a>> {
        let mut levels = topic.strip_prefix(NAMESPACE)?.strip_prefix('/')?.split('/');
        let (group, message_type, node) = (levels.next()?, levels.next()?, levels.next()?);
        let device = levels.next();
        let kind = match (message_type, device) {
            ("NBIRTH", None) => Kind::NodeBirth,
            ("NDATA", None) => Kind::NodeData,
            ("NDEATH", None) => Kind::NodeDeath,
            ("DBIRTH", Some(_)) => Kind::DeviceBirth,
            ("DDATA", Some(_)) => Kind::DeviceData,
            ("DDEATH", Some(_)) => Kind::DeviceDeath,
            _ => return None,
        };
        levels.next().is_none().then_some(Heading { kind, group, node, device })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sources_name_nodes_and_devices() {
        #[track_caller]
        fn check(topic: &str, expected: Option<(&str, Option<&str>)>) {
            let place = Place::parse(topic).ok().map(|place| (place.node.to_string(), place.device));
            assert_eq!(
                place.as_ref().map(|(node, device)| (&**node, device.as_deref())),
                expected,
                "{topic}"
            );
        }
        check("Plant 1/Press", Some(("Plant 1/Press", None)));
        check("/Plant/Press/Drive", Some(("Plant/Press", Some("Drive"))));
        check("spBv1.0/Plant/NDATA/Press", Some(("Plant/Press", None)));
        check("spBv1.0/Plant/DDATA/Press/Drive", Some(("Plant/Press", Some("Drive"))));
        for wrong in ["speed", "a/b/c/d", "a//b", "a/+", "a/b#", "spBv1.0/a/NDATA", ""] {
            check(wrong, None);
        }
        assert!("a/b/c".parse::<NodeName>().is_err());
    }

    #[test]
    fn topics_tell_kind_node_and_device() {
        let heading = |kind, device| Heading { kind, group: "G", node: "N", device };
        for (topic, expected) in [
            ("spBv1.0/G/NBIRTH/N", Some(heading(Kind::NodeBirth, None))),
            ("spBv1.0/G/DDATA/N/D", Some(heading(Kind::DeviceData, Some("D")))),
            ("spBv1.0/G/NBIRTH/N/D", None),
            ("spBv1.0/G/DBIRTH/N", None),
            ("spBv1.0/G/NCMD/N", None),
            ("spBv1.0/STATE/host", None),
            ("spBv1.0/G/DDATA/N/D/E", None),
            ("spAv1.0/G/NDATA/N", None),
        ] {
            assert_eq!(Heading::read(topic), expected, "{topic}");
        }
    }
}
