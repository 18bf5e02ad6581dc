//! What is subscribed to, and under which names it is delivered.

use crate::ros::{bare, dds_name};
use std::collections::BTreeMap;
use std::sync::Arc;

/// The subscriptions of a bridge.
#[derive(Debug, Default)]
pub(super) struct Subscriptions {
    /// By the topic without its leading slash.
    named: BTreeMap<String, Vec<Subscription>>,
    is_all: bool,
}

/// A subscription, and the type on the wire if it names one.
#[derive(Debug, PartialEq, Eq)]
struct Subscription {
    name: Arc<str>,
    dds_type: Option<String>,
}

impl Subscription {
    fn takes(&self, dds_type: &str) -> bool {
        self.dds_type.as_ref().is_none_or(|wanted| wanted == dds_type)
    }
}

impl Subscriptions {
    /// Adds one; `false`: it was there.
    pub(super) fn add(&mut self, name: &str, message_type: Option<&str>) -> bool {
        let subscription = Subscription { name: name.into(), dds_type: message_type.map(dds_name) };
        let all = self.named.entry(bare(name).to_owned()).or_default();
        let is_new = !all.contains(&subscription);
        if is_new {
            all.push(subscription);
        }
        is_new
    }

    /// Adds all topics; `false`: they were there.
    pub(super) fn add_all(&mut self) -> bool {
        !std::mem::replace(&mut self.is_all, true)
    }

    /// Whether messages of this type under this topic, without its leading slash, are wanted.
    pub(super) fn wants(&self, topic: &str, dds_type: &str) -> bool {
        self.named.get(topic).map_or(self.is_all, |all| all.iter().any(|one| one.takes(dds_type)))
    }

    /// The topics that are subscribed to with a type: both.
    pub(super) fn typed(&self) -> impl Iterator<Item = (&str, &str)> {
        self.named.iter().flat_map(|(topic, all)| {
            all.iter().filter_map(move |one| Some((topic.as_str(), one.dds_type.as_deref()?)))
        })
    }

    /// The names under which messages of this type are delivered.
    pub(super) fn names(&self, topic: &str, dds_type: &str) -> Vec<Arc<str>> {
        match self.named.get(topic) {
            Some(all) => all.iter().filter(|one| one.takes(dds_type)).map(|one| one.name.clone()).collect(),
            None if self.is_all => vec![format!("/{topic}").into()],
            None => Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_are_delivered_under_the_names_that_were_asked_for() {
        let mut all = Subscriptions::default();
        let (float, imu) = ("std_msgs::msg::dds_::Float64_", "sensor_msgs::msg::dds_::Imu_");
        assert!(all.add("/a", Some("std_msgs/Float64")) && !all.add("/a", Some("std_msgs/msg/Float64")));
        assert!(all.add("b/c", None));
        let names = |all: &Subscriptions, topic: &str, dds_type: &str| {
            assert_eq!(all.wants(topic, dds_type), !all.names(topic, dds_type).is_empty());
            all.names(topic, dds_type).join(" ")
        };
        assert_eq!(all.typed().collect::<Vec<_>>(), [("a", float)]);
        for (topic, dds_type, expected) in
            [("a", float, "/a"), ("a", imu, ""), ("b/c", imu, "b/c"), ("d", float, "")]
        {
            assert_eq!(names(&all, topic, dds_type), expected);
        }
        assert!(all.add_all() && !all.add_all() && all.add("a", None));
        for (topic, dds_type, expected) in [("a", float, "/a a"), ("a", imu, "a"), ("d", float, "/d")] {
            assert_eq!(names(&all, topic, dds_type), expected);
        }
    }
}
