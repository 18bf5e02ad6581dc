//! What takes the messages of a run: a file, or viewers that are connected.

use super::Kind;
use serde_json::Value;
use shsa_core::time::Time;
use std::collections::BTreeMap;
use std::io;

/// A message, and the channel to which it belongs.
pub struct Message<'a> {
    /// The name of the channel.
    pub topic: &'a str,
    /// The kind of all messages of the channel.
    pub kind: Kind,
    /// When it held; nanoseconds since 1970, or since the beginning of the recording.
    pub time: Time,
    /// The content, JSON.
    pub data: &'a [u8],
    /// The facts about the channel, such as the unit.
    pub about: &'a dyn Fn() -> BTreeMap<String, String>,
}

/// Takes the messages of a run, in the order of their making.
pub trait Sink {
    /// Takes a message. The first one of a topic begins the channel.
    ///
    /// # Errors
    /// Why nothing more can be taken.
    fn write(&mut self, message: &Message<'_>) -> io::Result<()>;

    /// Passes on what is buffered.
    ///
    /// # Errors
    /// Why nothing more can be taken.
    fn flush(&mut self) -> io::Result<()>;

    /// The run is over. `layout` shows it in Foxglove.
    ///
    /// # Errors
    /// Why the end cannot be taken.
    fn finish(&mut self, layout: &Value) -> io::Result<()>;
}

impl<S: Sink + ?Sized> Sink for Box<S> {
    fn write(&mut self, message: &Message<'_>) -> io::Result<()> {
        (**self).write(message)
    }

    fn flush(&mut self) -> io::Result<()> {
        (**self).flush()
    }

    fn finish(&mut self, layout: &Value) -> io::Result<()> {
        (**self).finish(layout)
    }
}

/// All of them take every message; the first error ends it for all.
impl<S: Sink> Sink for Vec<S> {
    fn write(&mut self, message: &Message<'_>) -> io::Result<()> {
        self.iter_mut().try_for_each(|sink| sink.write(message))
    }

    fn flush(&mut self) -> io::Result<()> {
        self.iter_mut().try_for_each(Sink::flush)
    }

    fn finish(&mut self, layout: &Value) -> io::Result<()> {
        self.iter_mut().try_for_each(|sink| sink.finish(layout))
    }
}
