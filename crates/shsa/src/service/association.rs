//! The association of tracks as a service: tracks of several sensors in; out goes what each sensor says of the chosen object, how many
//! objects it sees, and the list of all objects.

use super::timing::{Figures, Pace};
use super::tracks::Tracks;
use super::work::Work;
use serde_json::{Map, Value, json};
use shsa_bridge::{Bridge, Clock, Message, Outgoing, Payload, Provenance, Quality};
use shsa_core::observation::RawValue;
use shsa_core::time::Time;
use shsa_estimate::association::{Associated, Associator, Track};
use shsa_format::association::{Association, Associations};
use std::collections::BTreeSet;
use std::sync::Arc;

/// The associations of a file, at work.
pub(super) struct Working {
    associations: Vec<At>,
    unreadable: u64,
    because: Option<String>,
}

/// An association with the tracks that it knows.
struct At {
    associator: Associator,
    sensors: Vec<Tracks>,
    objects: Option<String>,
    provenance: Provenance,
    /// Whether a sensor that sets the moments has spoken since the last association.
    is_due: bool,
}

impl Working {
    /// # Errors
    /// When a field cannot be read.
    pub(super) fn new(read: Associations) -> anyhow::Result<Working> {
        let associations = read.associations.into_iter().map(At::new).collect::<anyhow::Result<_>>()?;
        Ok(Working { associations, unreadable: 0, because: None })
    }
}

impl Work for Working {
    fn topics(&self) -> BTreeSet<Arc<str>> {
        let sensors = self.associations.iter().flat_map(|association| &association.sensors);
        sensors.map(|sensor| sensor.topic().clone()).collect()
    }

    fn receive(&mut self, message: &Message, clock: &Clock) -> Option<Time> {
        let mut newest = None;
        for association in &mut self.associations {
            for index in 0..association.sensors.len() {
                let Some(sensor) = association.sensors.get_mut(index) else { continue };
                match sensor.receive(message, clock) {
                    Ok(None) => {}
                    Ok(Some(stamp)) => {
                        newest = newest.max(Some(stamp));
                        association.is_due |= association.sets_moments(index, stamp);
                    }
                    Err(why) => {
                        self.unreadable += 1;
                        self.because = Some(format!("{}: {why}", message.topic));
                    }
                }
            }
        }
        newest
    }

    fn is_due(&self, _: Pace) -> bool {
        self.associations.iter().any(|association| association.is_due)
    }

    fn compute(
        &mut self,
        at: Time,
        clock: &Clock,
        bridge: &mut dyn Bridge,
        figures: &mut Figures,
    ) -> anyhow::Result<()> {
        for association in self.associations.iter_mut().filter(|association| association.is_due) {
            association.is_due = false;
            association.compute(at, clock.by_wall(at), bridge, figures)?;
        }
        Ok(())
    }

    fn unreadable(&self) -> (u64, Option<&str>) {
        (self.unreadable, self.because.as_deref())
    }
}

impl At {
    fn new(read: Association) -> anyhow::Result<At> {
        let source = format!("association {}", read.name);
        let sensors = read.sensors.into_iter().map(Tracks::new).collect::<anyhow::Result<_>>()?;
        let provenance = Provenance::new(Quality::Good, source);
        Ok(At { associator: read.associator, sensors, objects: read.objects, provenance, is_due: false })
    }

    /// Whether this sensor sets the moments: the first one that gives all of its tracks at once and is not silent; where none does so, any.
    fn sets_moments(&self, own: usize, at: Time) -> bool {
        let mut whole = self.sensors.iter().enumerate().filter(|(_, sensor)| sensor.is_whole());
        whole.find(|(_, sensor)| !sensor.is_silent(at)).is_none_or(|(first, _)| first == own)
    }

    fn compute(
        &mut self,
        at: Time,
        stamp: Time,
        bridge: &mut dyn Bridge,
        figures: &mut Figures,
    ) -> anyhow::Result<()> {
        let tracks: Vec<Option<&[Track]>> = self.sensors.iter_mut().map(|sensor| sensor.at(at)).collect();
        let found = self.associator.associate(&tracks, at);
        let mut send = |topic: &str, payload: Payload| -> anyhow::Result<()> {
            let message = Outgoing::new(topic, stamp, payload);
            bridge.publish(Outgoing { provenance: Some(&self.provenance), ..message })?;
            figures.published += 1;
            Ok(())
        };
        let chosen = found.chosen.and_then(|chosen| found.objects.get(chosen));
        for (index, sensor) in self.sensors.iter().enumerate() {
            let Some(output) = sensor.output() else { continue };
            let member = chosen.and_then(|object| object.members.get(index).copied().flatten());
            let [x, y] = member.map_or([None; 2], |member| member.track.position.map(Some));
            let count = found.counts.get(index).copied().flatten();
            for (what, value) in [("x", x), ("y", y), ("count", count)] {
                if let Some(value) = value {
                    send(&format!("{output}/{what}"), Payload::Value(RawValue::Number(value)))?;
                }
            }
        }
        if let Some(topic) = &self.objects {
            let text = listed(&found, &self.associator, &self.sensors).to_string();
            send(topic, Payload::Bytes(text.into_bytes().into()))?;
        }
        Ok(())
    }
}

/// All objects as lists: where each is, and its place in the tracks of each sensor.
fn listed(found: &Associated, associator: &Associator, sensors: &[Tracks]) -> Value {
    let places = || found.objects.iter().filter_map(|object| object.place(associator.sensors()));
    let [x, y] = [0, 1].map(|axis| places().map(|place| json!(place.position[axis])).collect::<Vec<_>>());
    let of_sensor = |(index, sensor): (usize, &Tracks)| {
        let member = |object: &shsa_estimate::association::Object| {
            object.members.get(index).copied().flatten().map_or(Value::Null, |member| json!(member.index))
        };
        (sensor.name().to_owned(), Value::Array(found.objects.iter().map(member).collect()))
    };
    let tracks: Map<String, Value> = sensors.iter().enumerate().map(of_sensor).collect();
    json!({ "x": x, "y": y, "chosen": found.chosen, "tracks": tracks })
}
