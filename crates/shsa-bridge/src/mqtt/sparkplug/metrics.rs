//! The metrics of our own edge node: their present values, and the changes that wait to be sent.

use crate::clock::Uptime;
use crate::{BridgeError, Outgoing, Payload, Provenance, Quality};
use shsa_core::observation::RawValue;
use shsa_message::sparkplug::{DataType, NewMetric, NewValue, Property, QUALITY, Writer, quality};
use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

/// The number of changes that may wait for the connection; the oldest make room for newer ones.
const CHANGES_MAX: usize = 1024;
/// The number of changes in one message.
const AT_ONCE: usize = 256;

/// A value as it is sent.
#[derive(Clone, Debug, PartialEq)]
enum Content {
    Number(f64),
    Numbers(Vec<f64>),
    Text(String),
}

/// A value with what is said of it.
#[derive(Clone, Debug, PartialEq)]
struct Stated {
    /// `None`: there was none yet.
    content: Option<Content>,
    /// The bounds of a number.
    bounds: Option<(f64, f64)>,
    provenance: Arc<Provenance>,
}

/// A change of a metric.
#[derive(Clone, Debug)]
struct Change {
    name: Arc<str>,
    stated: Stated,
    /// When the value was true, milliseconds since 1970.
    timestamp: u64,
    /// After this time the value is useless.
    until: Option<Uptime>,
}

/// A metric.
#[derive(Clone, Debug)]
struct Own {
    unit: Option<String>,
    /// The model that publishes it; `None`: none has announced it.
    owner: Option<String>,
    /// The type that the last birth has given.
    data_type: DataType,
    stated: Stated,
    timestamp: u64,
}

/// The metrics of the node by their names.
#[derive(Debug, Default)]
pub(super) struct OwnMetrics {
    all: BTreeMap<Arc<str>, Own>,
    changes: VecDeque<Change>,
    /// Whether the next message must be a birth: the metrics are others than those of the last one.
    pub(super) needs_birth: bool,
}

impl OwnMetrics {
    /// The metrics of this owner are those with these names and units.
    pub(super) fn announce<'n>(
        &mut self,
        owner: &str,
        names: impl Iterator<Item = (&'n str, Option<String>)>,
        timestamp: u64,
    ) {
        let mut before: BTreeMap<Arc<str>, Own> = BTreeMap::new();
        for (name, own) in std::mem::take(&mut self.all) {
            let is_of_owner = own.owner.as_deref() == Some(owner);
            let to = if is_of_owner { &mut before } else { &mut self.all };
            to.insert(name, own);
        }
        for (name, unit) in names {
            let name = metric_name(name);
            let own = before.remove(name).unwrap_or_else(|| {
                self.needs_birth = true;
                Own::new(timestamp)
            });
            self.needs_birth |= own.unit != unit;
            self.all.insert(name.into(), Own { unit, owner: Some(owner.to_owned()), ..own });
        }
        self.needs_birth |= !before.is_empty();
    }

    /// Takes in a value. A value that says what the one before has said is no change.
    ///
    /// # Errors
    /// When the payload is neither a value nor a text.
    pub(super) fn publish(
        &mut self,
        message: &Outgoing<'_>,
        timestamp: u64,
        until: Option<Uptime>,
    ) -> Result<(), BridgeError> {
        let (content, bounds) = content(&message.payload)?;
        let name = metric_name(message.topic);
        let own = self.own(name, timestamp);
        let same = message.provenance.is_some_and(|it| *it == *own.stated.provenance);
        let provenance = match message.provenance {
            Some(provenance) if !same => Arc::new(provenance.clone()),
            _ => own.stated.provenance.clone(),
        };
        self.update(name, Stated { content: Some(content), bounds, provenance }, timestamp, until);
        Ok(())
    }

    /// Takes in a quality that has changed without a value.
    pub(super) fn rate(&mut self, name: &str, quality: Quality, timestamp: u64) {
        let name = metric_name(name);
        let Some(own) = self.all.get(name).filter(|own| own.stated.provenance.quality != quality) else {
            return;
        };
        let provenance = Arc::new(Provenance { quality, ..(*own.stated.provenance).clone() });
        let stated = Stated { provenance, ..own.stated.clone() };
        self.update(name, stated, timestamp, None);
    }

    fn own(&mut self, name: &str, timestamp: u64) -> &mut Own {
        if !self.all.contains_key(name) {
            self.needs_birth = true;
        }
        self.all.entry(name.into()).or_insert_with(|| Own::new(timestamp))
    }

    fn update(&mut self, name: &str, stated: Stated, timestamp: u64, until: Option<Uptime>) {
        let Some((key, before)) = self.all.get_key_value(name).filter(|(_, own)| own.stated != stated) else {
            return;
        };
        let key = key.clone();
        let data_type = stated.content.as_ref().map_or(before.data_type, Content::data_type);
        self.needs_birth |= data_type != before.data_type;
        if let Some(own) = self.all.get_mut(name) {
            (own.data_type, own.stated, own.timestamp) = (data_type, stated.clone(), timestamp);
        }
        if self.changes.len() == CHANGES_MAX {
            self.changes.pop_front();
        }
        self.changes.push_back(Change { name: key, stated, timestamp, until });
    }

    /// The changes do not have to be sent: a birth has the present values.
    pub(super) fn forget_changes(&mut self) {
        self.changes.clear();
    }

    /// Appends all metrics as a birth has them.
    pub(super) fn write_all(&self, writer: &mut Writer) {
        for (name, own) in &self.all {
            own.stated.write(name, own.timestamp, Some((own.data_type, own.unit.as_deref())), writer);
        }
    }

    /// Whether there are changes.
    pub(super) fn has_changed(&self) -> bool {
        !self.changes.is_empty()
    }

    /// Appends changes, the oldest first; returns their number, and when the first of them is useless.
    pub(super) fn write_changes(&mut self, writer: &mut Writer, now: Uptime) -> (usize, Option<Uptime>) {
        self.changes.retain(|change| change.until.is_none_or(|until| until > now));
        let some = self.changes.iter().take(AT_ONCE);
        some.clone().for_each(|change| change.stated.write(&change.name, change.timestamp, None, writer));
        (some.len(), some.filter_map(|change| change.until).min())
    }

    /// The oldest changes were sent.
    pub(super) fn sent(&mut self, count: usize) {
        self.changes.drain(..count.min(self.changes.len()));
    }
}

impl Own {
    fn new(timestamp: u64) -> Own {
        let provenance = Arc::new(Provenance::new(Quality::Bad, ""));
        let stated = Stated { content: None, bounds: None, provenance };
        Own { unit: None, owner: None, data_type: DataType::DOUBLE, stated, timestamp }
    }
}

impl Content {
    fn data_type(&self) -> DataType {
        self.value().data_type()
    }

    fn value(&self) -> NewValue<'_> {
        match self {
            Content::Number(number) => NewValue::Number(*number),
            Content::Numbers(numbers) => NewValue::Numbers(numbers),
            Content::Text(text) => NewValue::Text(text),
        }
    }
}

impl Stated {
    /// Appends a metric; a birth gives its type and unit.
    fn write(
        &self,
        name: &str,
        timestamp: u64,
        birth: Option<(DataType, Option<&str>)>,
        writer: &mut Writer,
    ) {
        let Provenance { quality, source, admission } = &*self.provenance;
        let mut properties =
            vec![(QUALITY, Property::Whole(code(*quality))), ("status", Property::Text(quality.name()))];
        if let Some(unit) = birth.and_then(|(_, unit)| unit) {
            properties.push(("engUnit", Property::Text(unit)));
        }
        if let Some((lo, hi)) = self.bounds {
            properties.extend([("lo", Property::Number(lo)), ("hi", Property::Number(hi))]);
        }
        if !source.is_empty() {
            properties.push(("source", Property::Text(source)));
        }
        if let Some(admission) = admission {
            let rank = i32::try_from(admission.rank).unwrap_or(i32::MAX);
            properties.push(("admitted", Property::Text(admission.ground.name())));
            properties.extend(admission.level.as_deref().map(|level| ("level", Property::Text(level))));
            properties.push(("rank", Property::Whole(rank)));
        }
        writer.push(&NewMetric {
            name,
            timestamp,
            data_type: birth.map(|(data_type, _)| data_type),
            value: self.content.as_ref().map(Content::value),
            properties: &properties,
        });
    }
}

/// The code of Sparkplug for a quality: a substitute is within its bounds, so it can be used.
fn code(quality: Quality) -> i32 {
    match quality {
        Quality::Good | Quality::Substitute => quality::GOOD,
        Quality::LastUsable => quality::STALE,
        Quality::Uncertain | Quality::Bad => quality::BAD,
    }
}

/// The name of a metric has no slash at its beginning: slashes separate its folders.
fn metric_name(name: &str) -> &str {
    name.trim_start_matches('/')
}

/// The content of a payload, with the bounds of an interval.
fn content(payload: &Payload) -> Result<(Content, Option<(f64, f64)>), BridgeError> {
    Ok(match payload {
        Payload::Value(RawValue::Number(number)) => (Content::Number(*number), None),
        Payload::Value(RawValue::Interval { lo, hi }) => {
            (Content::Number(if lo == hi { *lo } else { lo / 2.0 + hi / 2.0 }), Some((*lo, *hi)))
        }
        Payload::Value(RawValue::Vector(numbers)) => (Content::Numbers(numbers.clone()), None),
        Payload::Bytes(bytes) => match std::str::from_utf8(bytes) {
            Ok(text) => (Content::Text(text.to_owned()), None),
            Err(_) => {
                let why = "a metric of Sparkplug is a value: publish the need in the form `plain`";
                return Err(BridgeError::Refused(why.to_owned()));
            }
        },
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use shsa_message::sparkplug::Payload as Read;

    fn shown(write: impl FnOnce(&mut Writer)) -> String {
        let mut writer = Writer::new(9, Some(1));
        write(&mut writer);
        let bytes = writer.finish();
        let metric = |metric: shsa_message::sparkplug::Metric<'_>| {
            let value = metric.number().map_or_else(|| format!("{:?}", metric.value), |it| it.to_string());
            let properties =
                ["status", "source", "engUnit"].map(|key| metric.text_property(key).unwrap_or("-"));
            let data_type = metric.data_type.map(|it| it.0);
            let (name, at) = (metric.name.unwrap_or_default(), metric.timestamp.unwrap_or(0));
            format!("{name}={value}@{at} {data_type:?} {} {}", metric.quality(), properties.join(","))
        };
        Read::read(&bytes).unwrap().metrics().map(metric).collect::<Vec<_>>().join(" | ")
    }

    fn changes(metrics: &mut OwnMetrics) -> String {
        let mut count = 0;
        let text = shown(|writer| count = metrics.write_changes(writer, Uptime::now()).0);
        metrics.sent(count);
        text
    }

    fn publish(metrics: &mut OwnMetrics, value: RawValue, provenance: &Provenance, timestamp: u64) {
        let message = Outgoing::new("/stop/dmin", shsa_core::time::Time(0), Payload::Value(value));
        metrics.publish(&Outgoing { provenance: Some(provenance), ..message }, timestamp, None).unwrap();
    }

    #[test]
    fn values_go_out_with_their_quality_and_only_changes_do() {
        let mut metrics = OwnMetrics::default();
        metrics.announce("car", [("/stop/dmin", Some("m".to_owned())), ("speed", None)].into_iter(), 1);
        assert!(std::mem::take(&mut metrics.needs_birth));
        let birth = shown(|writer| metrics.write_all(writer));
        assert_eq!(birth, "speed=Absent@1 Some(10) 0 Bad,-,- | stop/dmin=Absent@1 Some(10) 0 Bad,-,m");
        let good = Provenance::new(Quality::Good, "lidar");
        let substitute = Provenance::new(Quality::Substitute, "sonar");
        let value = || RawValue::Interval { lo: 1.0, hi: 2.0 };
        publish(&mut metrics, value(), &good, 2);
        publish(&mut metrics, value(), &good, 3);
        publish(&mut metrics, value(), &substitute, 4);
        assert_eq!(
            changes(&mut metrics),
            "stop/dmin=1.5@2 None 192 Good,lidar,- | stop/dmin=1.5@4 None 192 UncertainSubstituteValue,sonar,-"
        );
        metrics.rate("/stop/dmin", Quality::LastUsable, 5);
        metrics.rate("/stop/dmin", Quality::Bad, 6);
        metrics.rate("/stop/dmin", Quality::Bad, 7);
        assert_eq!(
            changes(&mut metrics),
            "stop/dmin=1.5@5 None 500 UncertainLastUsableValue,sonar,- | stop/dmin=1.5@6 None 0 Bad,sonar,-"
        );
        assert!(!metrics.needs_birth && !metrics.has_changed());
    }

    #[test]
    fn other_metrics_and_other_types_need_a_birth() {
        let mut metrics = OwnMetrics::default();
        let mut announced = |names: &[&str]| {
            metrics.announce("car", names.iter().map(|name| (*name, None)), 1);
            std::mem::take(&mut metrics.needs_birth)
        };
        assert_eq!(
            [announced(&["a"]), announced(&["a"]), announced(&["a", "b"]), announced(&["b"])],
            [true, false, true, true]
        );
        let list = Payload::Value(RawValue::Vector(vec![1.0, 2.0]));
        metrics.publish(&Outgoing::new("b", shsa_core::time::Time(0), list), 2, None).unwrap();
        assert!(std::mem::take(&mut metrics.needs_birth));
        let garbage = Payload::Bytes(vec![0xff].into());
        assert!(metrics.publish(&Outgoing::new("b", shsa_core::time::Time(0), garbage), 2, None).is_err());
        let text = Payload::Bytes("{}".into());
        metrics.publish(&Outgoing::new("c", shsa_core::time::Time(0), text), 2, None).unwrap();
        assert!(metrics.needs_birth);
        let birth = shown(|writer| metrics.write_all(writer));
        assert!(birth.contains("c=Text(\"{}\")@2 Some(12)") && birth.contains("Some(31)"), "{birth}");
    }

    #[test]
    fn what_waits_is_bounded_and_what_is_useless_is_not_sent() {
        let mut metrics = OwnMetrics::default();
        let (value, now) = (|it: f64| Payload::Value(RawValue::Number(it)), Uptime::now());
        for number in 0..3_000 {
            metrics
                .publish(&Outgoing::new("a", shsa_core::time::Time(0), value(number.into())), 2, None)
                .unwrap();
        }
        assert_eq!(metrics.changes.len(), CHANGES_MAX);
        metrics.forget_changes();
        metrics.publish(&Outgoing::new("a", shsa_core::time::Time(0), value(-1.0)), 2, Some(now)).unwrap();
        assert_eq!(changes(&mut metrics), "");
    }
}
