//! Bags of ROS 2 in SQLite files (`.db3`): the file as a sequence of topics and messages.
//!
//! Format: <https://github.com/ros2/rosbag2>, `rosbag2_storage_sqlite3`. Only the file itself is used: names, times and counts of
//! `metadata.yaml` may be wrong or missing. From version 8 on the file has the definitions of its types; before, they are those
//! of the standard types. Messages may be compressed one by one.

use super::sqlite::{Cell, Database, Event};
use super::topic::{Body, Input, Listener, Times, Topic, TopicId};
use super::unpack::{Budget, Packing, UNPACKED_MAX, Unpacker};
use super::{Fields, Files, Place, ReadOptions, RecordingError, ros2};
use shsa_core::time::Time;
use shsa_message::ros::{Types, full_name};
use std::collections::BTreeMap;
use std::io::{self, Read, SeekFrom};
use std::path::PathBuf;
use std::sync::Arc;

/// The largest write-ahead log that is read, bytes.
const LOG_MAX: u64 = 1 << 28;

/// Reports the topics and messages of a file.
pub(super) fn read(
    input: &mut dyn Input,
    options: &ReadOptions,
    listener: &mut dyn Listener,
) -> Result<(), RecordingError> {
    let types = ros2::known(&options.messages).map_err(RecordingError::Definitions)?;
    let budget = Budget::of(input.seek(SeekFrom::End(0)).unwrap_or(0));
    let (definitions, topics) = (BTreeMap::new(), BTreeMap::new());
    let mut bag = Bag { types, budget, unpacker: Unpacker::default(), definitions, topics };
    let read = log(&options.files, listener)
        .and_then(|log| Database::open(input, log))
        .and_then(|mut database| bag.read(&mut database, listener));
    if let Err(failure) = read {
        listener.damaged(Place::Whole, format!("reading stopped: {failure}"));
    }
    Ok(())
}

/// The write-ahead log beside the file; a recorder that was not shut down leaves it.
fn log(files: &Files, listener: &mut dyn Listener) -> io::Result<Vec<u8>> {
    let mut name = listener.file().as_os_str().to_owned();
    name.push("-wal");
    let path = PathBuf::from(name);
    let Ok(file) = files.open(&path) else { return Ok(Vec::new()) };
    let mut bytes = Vec::new();
    file.take(LOG_MAX).read_to_end(&mut bytes)?;
    if !bytes.is_empty() {
        listener.note(Place::Whole, format!("with the newest pages from {}", path.display()));
    }
    Ok(bytes)
}

struct Bag {
    types: Arc<Types>,
    /// What the messages may unpack to.
    budget: Budget,
    unpacker: Unpacker,
    /// The definitions in the file.
    definitions: BTreeMap<String, String>,
    topics: BTreeMap<i64, TopicId>,
}

impl Bag {
    fn read<R: Input>(&mut self, database: &mut Database<R>, listener: &mut dyn Listener) -> io::Result<()> {
        let mut is_damaged = false;
        if !database.has_magic {
            listener.damaged(Place::Offset(0), "the file does not begin as a database does".into());
        }
        let mut report = |event: Event<'_>, listener: &mut dyn Listener| {
            if let Event::Damage(offset, problem) = event {
                is_damaged = true;
                listener.damaged(Place::Offset(offset), problem);
            }
        };
        let tables = database.tables(&mut |event| report(event, listener))?;
        if let Some(root) = tables.get("message_definitions") {
            database.rows(*root, &mut |event| match event {
                Event::Row(_, cells) => self.define(cells),
                damage => report(damage, listener),
            })?;
        }
        if let Some(root) = tables.get("topics") {
            database.rows(*root, &mut |event| match event {
                Event::Row(id, cells) => self.topic(id, cells, listener),
                damage => report(damage, listener),
            })?;
        }
        if self.topics.is_empty() {
            self.find_topics(database, listener)?;
        }
        match tables.get("messages") {
            Some(root) => database.rows(*root, &mut |event| match event {
                Event::Row(_, cells) => self.message(cells, listener),
                damage => report(damage, listener),
            })?,
            None => {
                is_damaged = true;
                listener.damaged(Place::Whole, "there is no table of messages".into());
            }
        }
        // Pages to which no intact page leads may still have rows.
        if is_damaged {
            database.rest(&mut |event| {
                if let Event::Row(_, cells) = event {
                    self.message(cells, listener);
                }
            })?;
        }
        Ok(())
    }

    /// Looks for topics in all pages, where the pages that lead to them are damaged.
    fn find_topics<R: Input>(
        &mut self,
        database: &mut Database<R>,
        listener: &mut dyn Listener,
    ) -> io::Result<()> {
        database.forget();
        database.rest(&mut |event| {
            if let Event::Row(id, cells) = event {
                self.topic(id, cells, listener);
            }
        })?;
        database.forget();
        Ok(())
    }

    /// Reads a row of the table of definitions: number, type, language, definition.
    fn define(&mut self, cells: &[Cell<'_>]) {
        if let [_, Cell::Text(name), Cell::Text(b"ros2msg"), Cell::Text(definition), ..] = cells {
            let name = full_name(&String::from_utf8_lossy(name)).into_owned();
            self.definitions.insert(name, String::from_utf8_lossy(definition).into_owned());
        }
    }

    /// Reads a row of the table of topics: number, name, type, serialisation.
    fn topic(&mut self, id: i64, cells: &[Cell<'_>], listener: &mut dyn Listener) {
        let [_, Cell::Text(name), Cell::Text(kind), Cell::Text(serialisation), ..] = cells else { return };
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        let (name, kind, serialisation) = (text(name), text(kind), text(serialisation));
        let definition = self.definitions.get(&*full_name(&kind)).map_or("", String::as_str);
        let fields = match serialisation.as_str() {
            "cdr" => ros2::fields(&self.types, &kind, definition),
            other => Fields::Unknown(format!("messages serialised as '{other}' cannot be read here")),
        };
        self.topics.insert(id, listener.topic(Topic::new(&name, &kind, fields)));
    }

    /// Reads a row of the table of messages: number, topic, time of reception in nanoseconds, content.
    fn message(&mut self, cells: &[Cell<'_>], listener: &mut dyn Listener) {
        let [_, Cell::Whole(topic), Cell::Whole(received), Cell::Blob(content), ..] = cells else { return };
        let Some(topic) = self.topics.get(topic).filter(|topic| listener.is_wanted(**topic)) else { return };
        let times = Times::at(Time(*received));
        // No message begins like zstd data: the first byte of a message is 0.
        if Packing::of(content) != Some(Packing::Zstd) {
            return listener.message(*topic, times, Body::Bytes(content));
        }
        let mut unpacked = self.unpacker.unpack("zstd", content, UNPACKED_MAX.min(self.budget.left()));
        match unpacked.problem.take().or_else(|| self.budget.take(unpacked.bytes.len() as u64).err()) {
            None => listener.message(*topic, times, Body::Bytes(&unpacked.bytes)),
            Some(problem) => {
                listener.damaged(Place::Whole, format!("the message received at {received} ns: {problem}"));
            }
        }
    }
}
