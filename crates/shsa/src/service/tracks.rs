//! The tracks of a sensor, as its messages bring them.

use shsa_bridge::payload::{Reader, SIZE_LIMIT};
use shsa_bridge::{Clock, Message};
use shsa_core::observation::RawValue;
use shsa_core::time::Time;
use shsa_estimate::association::{TRACKS_MAX, Track};
use shsa_format::association::{Part, TrackSensor};
use shsa_message::source::Field;
use std::sync::Arc;

/// The latest tracks of a sensor.
pub(super) struct Tracks {
    sensor: TrackSensor,
    topic: Arc<str>,
    reader: Reader,
    tracks: Vec<Track>,
    /// The numbers of the objects, where each has messages of its own.
    ids: Vec<f64>,
    newest: Option<Time>,
}

/// The values of a message by the parts of its tracks, and their time.
struct Read {
    parts: Vec<(Part, Vec<f64>)>,
    stamp: Time,
}

impl Tracks {
    /// # Errors
    /// When a field cannot be read.
    pub(super) fn new(sensor: TrackSensor) -> anyhow::Result<Tracks> {
        let field = |(_, path): &(Part, String)| Field { path: path.clone(), stamp: sensor.time.clone() };
        let fields: Vec<Field> = sensor.fields.iter().map(field).collect();
        let reader = Reader::new(&fields, SIZE_LIMIT)?;
        let topic = sensor.topic.as_str().into();
        Ok(Tracks { sensor, topic, reader, tracks: Vec::new(), ids: Vec::new(), newest: None })
    }

    pub(super) fn name(&self) -> &str {
        &self.sensor.name
    }

    pub(super) fn topic(&self) -> &Arc<str> {
        &self.topic
    }

    pub(super) fn output(&self) -> Option<&str> {
        self.sensor.output.as_deref()
    }

    /// Whether a message has all of its tracks.
    pub(super) fn is_whole(&self) -> bool {
        self.sensor.fields.iter().all(|(part, _)| *part != Part::Id)
    }

    /// Whether it has not spoken for too long, or never.
    pub(super) fn is_silent(&self, at: Time) -> bool {
        self.newest.is_none_or(|newest| at - newest > self.sensor.max_age)
    }

    /// The tracks at a moment; `None` while the sensor is silent. Who has messages of their own may all be away, which is no silence.
    pub(super) fn at(&mut self, at: Time) -> Option<&[Track]> {
        if self.is_whole() {
            return (!self.is_silent(at)).then_some(&self.tracks);
        }
        let is_fresh = |track: &Track| at - track.at <= self.sensor.max_age;
        let mut kept = self.tracks.iter().map(is_fresh);
        self.ids.retain(|_| kept.next().unwrap_or(false));
        self.tracks.retain(is_fresh);
        self.newest.map(|_| self.tracks.as_slice())
    }

    /// Takes a message in; returns its time by our clock, or `None` when it is of another topic, does not meet a condition of the
    /// fields, or is older than the latest.
    ///
    /// # Errors
    /// Why its tracks cannot be read.
    pub(super) fn receive(&mut self, message: &Message, clock: &Clock) -> Result<Option<Time>, String> {
        if message.topic != self.topic {
            return Ok(None);
        }
        let Read { parts, stamp } = self.read(message, clock)?;
        let is_late = self.is_whole() && self.newest.is_some_and(|newest| newest > stamp);
        if is_late || parts.len() < self.sensor.fields.len() {
            return Ok(None);
        }
        // The moment of such a message would make the tracks of all others too old.
        if stamp - message.received > self.sensor.max_age {
            return Err(format!("the time is {:.3} s ahead", (stamp - message.received).seconds()));
        }
        let count = parts.first().map_or(0, |(_, values)| values.len());
        if let Some((part, values)) = parts.iter().find(|(_, values)| values.len() != count) {
            return Err(format!("{} has {} values and not {count}", key(*part), values.len()));
        }
        if count > TRACKS_MAX {
            return Err(format!("{count} tracks, and at most {TRACKS_MAX} are associated"));
        }
        let value = |of: Part, index: usize| {
            let values = parts.iter().find(|(part, _)| *part == of).map(|(_, values)| values);
            values.map(|values| values.get(index).copied().unwrap_or(f64::NAN))
        };
        let track = |index: usize| Track {
            at: stamp,
            position: [Part::X, Part::Y].map(|part| value(part, index).unwrap_or(f64::NAN)),
            velocity: [Part::SpeedX, Part::SpeedY].map(|part| value(part, index).unwrap_or(0.0)),
        };
        if self.is_whole() {
            self.tracks = (0..count).map(track).collect();
        } else {
            (0..count).for_each(|index| self.keep(value(Part::Id, index).unwrap_or(f64::NAN), track(index)));
        }
        self.newest = self.newest.max(Some(stamp));
        Ok(Some(stamp))
    }

    /// Keeps a track in the place of the older one of the same object; of too many the oldest goes.
    fn keep(&mut self, id: f64, track: Track) {
        let place = self.ids.iter().position(|known| *known == id);
        let oldest = || (0..self.tracks.len()).min_by_key(|index| self.tracks.get(*index).map(|it| it.at));
        let place = place.or_else(|| if self.tracks.len() < TRACKS_MAX { None } else { oldest() });
        let slots = place.and_then(|place| Some((self.ids.get_mut(place)?, self.tracks.get_mut(place)?)));
        match slots {
            Some((known, old)) if *known != id || old.at <= track.at => (*known, *old) = (id, track),
            Some(_) => {}
            None => {
                self.ids.push(id);
                self.tracks.push(track);
            }
        }
    }

    fn read(&mut self, message: &Message, clock: &Clock) -> Result<Read, String> {
        let (mut parts, mut stamp, mut wrong) = (Vec::new(), None, None);
        let fields = &self.sensor.fields;
        self.reader.read(message, |field, reading| match (fields.get(field), reading) {
            (Some((part, _)), Ok(reading)) => {
                stamp = stamp.or(reading.stamp);
                parts.push((*part, numbers(reading.value)));
            }
            (_, Err(why)) => wrong = Some(why.to_string()),
            (None, Ok(_)) => {}
        });
        if let Some(wrong) = wrong {
            return Err(wrong);
        }
        let stamp = stamp.or(message.stamp);
        let stamp = stamp.map_or(message.received, |stamp| clock.steady(stamp, message.received));
        Ok(Read { parts, stamp })
    }
}

fn key(of: Part) -> &'static str {
    Part::ALL.iter().find(|(_, part)| *part == of).map_or("", |(key, _)| key)
}

fn numbers(value: RawValue) -> Vec<f64> {
    match value {
        RawValue::Number(number) => vec![number],
        RawValue::Interval { lo, hi } => vec![lo.midpoint(hi)],
        RawValue::Vector(list) => list.to_vec(),
    }
}
