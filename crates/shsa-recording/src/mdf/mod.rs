//! MDF 4 (ASAM), also as `.mf4` of loggers: groups of channels, each with its time; compressed or not, finished or not.
//!
//! Layout: ASAM MDF 4.1, as `asammdf` and `mdfreader` read it. A topic is a channel group, named after its acquisition, and its
//! fields are the channels. Frames of a CAN bus (`CAN_DataFrame`) are reported like those of other bus recordings. Groups are
//! reported one after the other. Memory: the definitions, and one block of data.

mod block;
mod algebra;
mod conversion;
mod channel;
mod data;
mod walk;
mod variable;
mod frame;
mod records;

use super::can::Bus;
use super::topic::{Input, Listener, TopicId};
use super::{Place, ReadOptions, RecordingError, stamp};
use block::{Block, Blocks, Unread};
use channel::Channel;
use frame::FrameChannels;
use records::Reporter;
use shsa_core::time::Time;
use std::collections::{BTreeMap, BTreeSet};
use walk::{Layout, Length};

/// The first bytes of a file, and of one that was not finished.
pub(super) const MAGICS: [&[u8]; 2] = [b"MDF     4", b"UnFinMF 4"];

/// The first bytes of files of earlier versions, which have only the name in common with version 4.
pub(super) const OLD_MAGICS: [&[u8]; 3] = [b"MDF     3", b"UnFinMF 3", b"MDF     2"];

/// Where the first block stands.
const FIRST_BLOCK: u64 = 64;

/// The most channels of a group.
const CHANNELS_MAX: usize = 1 << 14;

/// The most channels of a file.
const ALL_CHANNELS_MAX: usize = 1 << 17;

/// Channel groups whose records are stored together.
struct DataGroup {
    data: u64,
    layout: Layout,
    groups: BTreeMap<u64, Group>,
    /// The numbers of the groups by the places of their blocks.
    places: BTreeMap<u64, u64>,
}

/// A channel group.
struct Group {
    name: String,
    full: String,
    channels: Vec<Channel>,
    /// The time channel.
    time: Option<usize>,
    /// Whether the time is in another group.
    is_timed_elsewhere: bool,
    data_length: usize,
    frame: Option<FrameChannels>,
    /// The number of records so far.
    count: u64,
    /// The number of records by the definition.
    stated: u64,
    /// The number of values in a record.
    values: usize,
    topic: Option<TopicId>,
}

/// Reads all groups.
pub(super) fn read(
    input: &mut dyn Input,
    options: &ReadOptions,
    listener: &mut dyn Listener,
) -> Result<(), RecordingError> {
    let defined = Blocks::new(input).map_err(Unread::from).and_then(|mut blocks| {
        let defined = Definitions::of(&mut blocks, listener)?;
        Ok((blocks, defined))
    });
    let (mut blocks, defined) = match defined {
        Ok(found) => found,
        Err(problem) => {
            listener.damaged(Place::Whole, format!("reading stopped: {problem}"));
            return Ok(());
        }
    };
    let has_frames =
        defined.groups.iter().flat_map(|all| all.groups.values()).any(|group| group.frame.is_some());
    let bus = if has_frames { Some(Bus::new(options, listener)?) } else { None };
    let mut start = defined.start;
    if defined.is_local {
        let (time, said) = stamp::of_place(start, &options.zone);
        start = time;
        said.into_iter().for_each(|what| listener.note(Place::Whole, what));
    }
    let mut reporter = Reporter::new(start, bus, blocks.length, listener);
    for mut group in defined.groups {
        reporter.report_all(&mut group, &mut blocks, defined.is_finished);
    }
    reporter.finish();
    Ok(())
}

/// The definitions of a file.
struct Definitions {
    start: Time,
    /// Whether the start is a local time.
    is_local: bool,
    is_finished: bool,
    groups: Vec<DataGroup>,
}

impl Definitions {
    fn of(blocks: &mut Blocks<'_>, listener: &mut dyn Listener) -> Result<Definitions, Unread> {
        let is_finished = !blocks.bytes(0, 8)?.starts_with(b"UnFin");
        let head = blocks.of_name(FIRST_BLOCK, b"HD")?;
        let start = i64::try_from(head.u64(0)).map_or(Time(0), Time);
        if i64::try_from(head.u64(0)).is_err() {
            let problem =
                "the file begins after the year 2262, which is not read here; times count from 1970";
            listener.damaged(Place::Whole, problem.to_owned());
        }
        let mut groups = Vec::new();
        let (mut next, mut count, mut channels) = (head.link(0), 0, 0);
        let mut passed = BTreeSet::new();
        while next != 0 && channels < ALL_CHANNELS_MAX {
            let block = if passed.insert(next) { blocks.of_name(next, b"DG") } else { Err(Unread::TooMany) };
            let group =
                block.and_then(|block| Ok((block.link(0), DataGroup::of(&block, blocks, &mut count)?)));
            let (after, group) = match group {
                Ok(found) => found,
                Err(problem) => {
                    let problem = format!("a data group is lost, and those behind it: {problem}");
                    listener.damaged(Place::Offset(next), problem);
                    break;
                }
            };
            next = after;
            channels += group.groups.values().map(|group| group.channels.len()).sum::<usize>();
            groups.push(group);
        }
        distinguish(&mut groups);
        Ok(Definitions { start, is_local: head.u8(12) & 1 == 1, is_finished, groups })
    }
}

/// Adds numbers to groups of the same name.
fn distinguish(groups: &mut [DataGroup]) {
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for group in groups.iter().flat_map(|all| all.groups.values()) {
        *counts.entry(group.name.clone()).or_insert(0) += 1;
    }
    let mut numbers: BTreeMap<String, usize> = BTreeMap::new();
    for group in groups.iter_mut().flat_map(|all| all.groups.values_mut()) {
        let number = numbers.entry(group.name.clone()).or_insert(0);
        group.full = match counts.get(&group.name) {
            Some(0 | 1) | None => group.name.clone(),
            Some(_) => format!("{}[{number}]", group.name),
        };
        *number += 1;
    }
}

impl DataGroup {
    fn of(block: &Block, blocks: &mut Blocks<'_>, count: &mut usize) -> Result<DataGroup, Unread> {
        let (mut groups, mut places, mut lengths) = (BTreeMap::new(), BTreeMap::new(), BTreeMap::new());
        let mut next = block.link(1);
        while next != 0 {
            let found = blocks.of_name(next, b"CG")?;
            let name = blocks.text(found.link(2));
            let name = if name.is_empty() { format!("group_{count}") } else { name };
            let id = found.u64(0);
            groups.insert(id, Group::of(&found, blocks, name)?);
            lengths.insert(id, Length::of(&found));
            places.insert(next, id);
            *count += 1;
            next = found.link(0);
        }
        let layout = Layout { id_length: usize::from(block.u8(0)), lengths };
        Ok(DataGroup { data: block.link(2), layout, groups, places })
    }
}

impl Group {
    fn of(block: &Block, blocks: &mut Blocks<'_>, name: String) -> Result<Group, Unread> {
        let mut channels = Vec::new();
        collect(block.link(1), 0, blocks, &mut channels)?;
        Ok(Group {
            full: name.clone(),
            name,
            time: channels.iter().position(|channel| channel.is_time),
            is_timed_elsewhere: block.u16(16) & 8 != 0,
            frame: FrameChannels::of(&channels),
            values: channels.iter().map(Channel::count).sum(),
            data_length: block.u32(24) as usize,
            channels,
            count: 0,
            stated: block.u64(8),
            topic: None,
        })
    }
}

/// Collects the channels of a list, and those of which they are composed.
fn collect(
    first: u64,
    depth: usize,
    blocks: &mut Blocks<'_>,
    channels: &mut Vec<Channel>,
) -> Result<(), Unread> {
    let mut next = first;
    while next != 0 && channels.len() < CHANNELS_MAX {
        let block = blocks.of_name(next, b"CN")?;
        let mut channel = Channel::of(&block, blocks)?;
        let composition = block.link(1);
        let parts = if composition == 0 { None } else { blocks.block(composition).ok() };
        let is_structure = parts.as_ref().is_some_and(|parts| parts.name == *b"CN");
        match parts {
            // The parts are read, each for itself.
            Some(_) if is_structure => channel.refused = None,
            Some(parts) if parts.name == *b"CA" => channel = channel.of_arrays(&parts),
            Some(_) => channel = channel.refuse(Some("parts of an unknown kind".to_owned())),
            None => {}
        }
        channels.push(channel);
        if is_structure && depth < 4 {
            collect(composition, depth + 1, blocks, channels)?;
        }
        next = block.link(0);
    }
    Ok(())
}

#[cfg(test)]
mod tests;
