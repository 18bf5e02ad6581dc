//! The records of a data group, reported as messages or as frames of a bus.

use super::super::Place;
use super::super::can::Bus;
use super::super::topic::{Body, Field, Fields, Listener, Times, Topic, TopicId, Value};
use super::super::unpack::Budget;
use super::block::Blocks;
use super::channel::{Channel, Role};
use super::frame::Recorded;
use super::variable::AllValues;
use super::walk::Met;
use super::{DataGroup, Group};
use shsa_core::time::{Span, Time};

/// How many channels that are not read are named.
const NAMED_MAX: usize = 8;

/// Reports the records of a file.
pub(super) struct Reporter<'a> {
    start: Time,
    bus: Option<Bus>,
    /// How many values may be read, as many as bytes may be unpacked: channels may share their bytes.
    values: Budget,
    /// Whether that was reported to be too little.
    is_full: bool,
    lost: Lost,
    listener: &'a mut dyn Listener,
}

/// The numbers of records that are left out.
#[derive(Default)]
struct Lost {
    /// Frames whose bytes are not there.
    without_data: u64,
    /// Records without a time.
    untimed: u64,
    /// Records with a time that is too far away.
    too_late: u64,
}

/// The values of a channel.
enum Cell {
    Missing,
    Number(f64),
    List(Vec<f64>),
}

impl<'a> Reporter<'a> {
    /// For a file of this many bytes, whose times count from `start`.
    pub(super) fn new(
        start: Time,
        bus: Option<Bus>,
        length: u64,
        listener: &'a mut dyn Listener,
    ) -> Reporter<'a> {
        let lost = Lost::default();
        Reporter { start, bus, values: Budget::of(length), is_full: false, lost, listener }
    }

    /// Reports what was left out.
    pub(super) fn finish(self) {
        if let Some(bus) = self.bus {
            bus.finish(self.listener);
        }
    }

    /// Reports all records of a data group.
    pub(super) fn report_all(&mut self, all: &mut DataGroup, blocks: &mut Blocks<'_>, is_finished: bool) {
        let mut values = AllValues::of(all, blocks, is_finished, &mut |at, problem| {
            self.listener.damaged(Place::Offset(at), problem);
        });
        let DataGroup { data, layout, groups, .. } = all;
        layout.walk(*data, blocks, is_finished, &mut |met| match met {
            Met::Record(id, record) => {
                if let Some(group) = groups.get_mut(&id) {
                    self.record(group, record, &mut values, *data);
                }
            }
            Met::Lost(at, problem) => self.listener.damaged(Place::Offset(at), problem),
        });
        let missing = groups.values().filter(|group| group.count == 0 && group.stated > 0 && is_finished);
        for Group { full, stated, .. } in missing.filter(|group| !group.channels.is_empty()) {
            let problem = format!("group {full}: none of its {stated} records can be found");
            self.listener.damaged(Place::Offset(*data), problem);
        }
        self.report_lost(*data);
    }

    /// Reports how many records of a data group were left out.
    fn report_lost(&mut self, data: u64) {
        let Lost { without_data, untimed, too_late } = std::mem::take(&mut self.lost);
        let told = [
            (without_data, "frames of a bus have no bytes in the file"),
            (untimed, "records have no time that is read here"),
            (too_late, "records have times beyond the year 2262, which are not read here"),
        ];
        for (count, what) in told.into_iter().filter(|(count, _)| *count > 0) {
            self.listener.damaged(Place::Offset(data), format!("{count} {what}; left out"));
        }
    }

    /// Whether so many values of a record may still be read; reports the first time that they may not.
    fn has_room(&mut self, values: usize, data: u64) -> bool {
        if !self.is_full
            && let Err(problem) = self.values.take(values as u64)
        {
            self.listener.damaged(Place::Offset(data), format!("the other records are left out: {problem}"));
            self.is_full = true;
        }
        !self.is_full
    }

    fn record(&mut self, group: &mut Group, record: &[u8], values: &mut AllValues, data: u64) {
        if group.channels.is_empty() {
            return;
        }
        let number = group.count;
        group.count += 1;
        let since_s = match group.time {
            Some(at) => group.channels.get(at).and_then(|it| it.value(record, number, group.data_length)),
            None if group.is_timed_elsewhere => None,
            // In a group without a time, records are a second apart.
            None => Some(number as f64),
        };
        let Some(since_s) = since_s.filter(|since| since.is_finite()) else {
            self.lost.untimed += 1;
            return;
        };
        let Some(time) = later(self.start, since_s) else {
            self.lost.too_late += 1;
            return;
        };
        if let (Some(frame), Some(bus)) = (&group.frame, &mut self.bus) {
            let recorded = Recorded { record, time };
            let is_reported = frame.report(group, recorded, values, bus, self.listener);
            return self.lost.without_data += u64::from(!is_reported);
        }
        let topic = match group.topic {
            Some(topic) => topic,
            None => *group.topic.insert(report_topic(group, self.listener)),
        };
        if self.listener.is_wanted(topic) && self.has_room(group.values, data) {
            let cells: Vec<Cell> = group
                .channels
                .iter()
                .filter(|channel| is_shown(channel))
                .map(|channel| Cell::of(channel, record, number, group.data_length))
                .collect();
            let values: Vec<Value<'_>> = cells.iter().map(Cell::value).collect();
            self.listener.message(topic, Times::at(time), Body::Values(&values));
        }
    }
}

impl Cell {
    fn of(channel: &Channel, record: &[u8], number: u64, data_length: usize) -> Cell {
        if channel.array.is_some() {
            return Cell::List(channel.elements(record, number, data_length));
        }
        channel.value(record, number, data_length).map_or(Cell::Missing, Cell::Number)
    }

    fn value(&self) -> Value<'_> {
        match self {
            Cell::Missing => Value::Missing,
            Cell::Number(number) => Value::Number(*number),
            Cell::List(numbers) => Value::List(numbers),
        }
    }
}

/// So many seconds after the start; `None` where the nanoseconds since 1970 are too many for 64 bits.
fn later(start: Time, since_s: f64) -> Option<Time> {
    let since = Span::from_seconds(since_s);
    let is_near = since.0 != i64::MAX && since.0 != i64::MIN;
    start.0.checked_add(since.0).filter(|_| is_near).map(Time)
}

/// Whether a channel is a field, that is, numbers.
fn is_shown(channel: &Channel) -> bool {
    channel.role != Role::Other
}

fn report_topic(group: &Group, listener: &mut dyn Listener) -> TopicId {
    let field = |channel: &Channel| {
        let unit = (!channel.unit.is_empty()).then(|| channel.unit.clone());
        Field { name: channel.name.clone(), unit }
    };
    let refused: Vec<String> = group
        .channels
        .iter()
        .filter_map(|channel| Some(format!("{} ({})", channel.name, channel.refused.as_ref()?)))
        .collect();
    if !refused.is_empty() {
        let rest = refused.len().saturating_sub(NAMED_MAX);
        let more = if rest > 0 { format!(", and {rest} more") } else { String::new() };
        let named = refused.get(..NAMED_MAX).unwrap_or(&refused).join(", ");
        listener.note(Place::Whole, format!("group {}: not read are the channels {named}{more}", group.full));
    }
    if group.time.is_none() {
        let what = "has no time; its records are taken as a second apart";
        listener.note(Place::Whole, format!("group {} {what}", group.full));
    }
    let fields = Fields::named(group.channels.iter().filter(|channel| is_shown(channel)).map(field));
    listener.topic(Topic { full: &group.full, ..Topic::new(&group.name, "MDF channel group", fields) })
}
