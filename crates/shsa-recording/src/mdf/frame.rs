//! Frames of a CAN bus as the records of a group: `CAN_DataFrame.ID`, `CAN_DataFrame.DataBytes`, and others.

use super::super::can::{Bus, EXTENDED, Frame};
use super::super::topic::Listener;
use super::Group;
use super::channel::{Bits, Channel};
use super::variable::AllValues;
use shsa_core::time::Time;

/// The lengths of CAN FD frames by their codes from 9 on.
const LENGTHS_FD: [usize; 7] = [12, 16, 20, 24, 32, 48, 64];

/// The channels of a bus frame.
pub(super) struct FrameChannels {
    id: usize,
    bytes: usize,
    is_extended: Option<usize>,
    bus: Option<usize>,
    length: Option<usize>,
    /// The code of the length, where the length itself is not there.
    code: Option<usize>,
    /// Where the bytes are, where each frame has a number of its own.
    pub(super) variable: Option<u64>,
}

/// A record of a frame, and its time.
#[derive(Clone, Copy)]
pub(super) struct Recorded<'a> {
    pub(super) record: &'a [u8],
    pub(super) time: Time,
}

impl FrameChannels {
    /// Those of a group of frames; `None` for any other group.
    pub(super) fn of(channels: &[Channel]) -> Option<FrameChannels> {
        let find = |end: &str| channels.iter().position(|channel| channel.name.ends_with(end));
        let is_bus = channels.iter().any(|channel| channel.name.starts_with("CAN_DataFrame"));
        let (id, bytes) = find(".ID").zip(find(".DataBytes")).filter(|_| is_bus)?;
        Some(FrameChannels {
            id,
            bytes,
            is_extended: find(".IDE"),
            bus: find(".BusChannel"),
            length: find(".DataLength"),
            code: find(".DLC"),
            variable: channels.get(bytes)?.variable,
        })
    }

    /// Reports a frame; `false` where its bytes are not there.
    pub(super) fn report(
        &self,
        group: &Group,
        recorded: Recorded<'_>,
        values: &mut AllValues,
        bus: &mut Bus,
        listener: &mut dyn Listener,
    ) -> bool {
        let Recorded { record, time } = recorded;
        let value = |at: usize| {
            group.channels.get(at).and_then(|it| it.value(record, group.count, group.data_length))
        };
        let whole = |at: Option<usize>| at.and_then(value).map(|value| value as u32);
        let code = whole(self.code).map(|code| code as usize);
        let by_code =
            code.map(|code| code.checked_sub(9).and_then(|at| LENGTHS_FD.get(at)).copied().unwrap_or(code));
        let length = whole(self.length).map(|length| length as usize).or(by_code);
        let Some(id) = whole(Some(self.id)) else { return false };
        let Some(bytes) = group.channels.get(self.bytes) else { return false };
        let stored = match self.variable {
            Some(link) => bytes.offset(record).and_then(|at| values.value(link, at)),
            None => record.get(bytes.byte..).and_then(|rest| rest.get(..room(bytes)?)),
        };
        let Some(data) = stored else { return false };
        let data = length.and_then(|length| data.get(..length)).unwrap_or(data);
        let is_extended = whole(self.is_extended).map_or(id > 0x7ff, |flag| flag == 1);
        let id = if is_extended { id | EXTENDED } else { id };
        let channel = whole(self.bus).map_or(group.name.clone(), |number| number.to_string());
        bus.report(&Frame { time, channel: &channel, id, data }, listener);
        true
    }
}

/// How many bytes of a frame a record has room for; `None` where they are no bytes.
fn room(bytes: &Channel) -> Option<usize> {
    match bytes.array {
        Some(array) => (bytes.length == 8 && array.step == 1).then_some(array.count),
        None => (bytes.bits == Bits::Bytes).then_some(bytes.length / 8),
    }
}
