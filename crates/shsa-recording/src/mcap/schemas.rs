//! How the messages of a channel are decoded, by its encoding and its schema.

use super::records::{Channel, Schema};
use crate::ros2;
use crate::topic::{Fields, Topic};
use shsa_message::MessageError;
use shsa_message::protobuf;
use shsa_message::ros::{Layout, Types};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::str;
use std::sync::Arc;

/// The schemas of a file.
pub(super) struct Schemas {
    known: BTreeMap<u16, Known>,
    /// The ROS 2 types that are known without the file.
    types: Arc<Types>,
}

struct Known {
    name: String,
    encoding: String,
    data: Vec<u8>,
}

impl Schemas {
    /// An empty set; `folders` have further ROS 2 types.
    pub(super) fn new(folders: &[PathBuf]) -> Result<Schemas, MessageError> {
        Ok(Schemas { known: BTreeMap::new(), types: ros2::known(folders)? })
    }

    /// Adds a schema; of two with the same number the first counts.
    pub(super) fn add(&mut self, schema: &Schema<'_>) {
        self.known.entry(schema.id).or_insert_with(|| Known {
            name: schema.name.to_owned(),
            encoding: schema.encoding.to_owned(),
            data: schema.data.to_vec(),
        });
    }

    pub(super) fn topic<'t>(&'t self, channel: &Channel<'t>) -> Topic<'t> {
        let schema = self.known.get(&channel.schema);
        let kind = schema.map_or("", |schema| schema.name.as_str());
        Topic::new(channel.topic, kind, self.fields(channel.encoding, schema))
    }

    fn fields(&self, encoding: &str, schema: Option<&Known>) -> Fields {
        let (name, language) = schema.map_or(("", ""), |it| (it.name.as_str(), it.encoding.as_str()));
        let data = schema.map_or(&[][..], |schema| schema.data.as_slice());
        match (encoding, language) {
            ("json", _) => Fields::Json,
            ("ros1", _) | (_, "ros1msg") => {
                let types = Arc::new(Types::of_bag(name, &text(data)));
                Fields::Ros { types, kind: name.to_owned(), layout: Layout::Packed }
            }
            ("cdr", "ros2msg") => ros2::fields(&self.types, name, &text(data)),
            ("cdr", "ros2idl" | "") => ros2::fields(&self.types, name, ""),
            ("protobuf", _) => {
                Fields::Protobuf(Arc::new(protobuf::Types::of_descriptors(data)), name.to_owned())
            }
            (encoding, language) => Fields::Unknown(format!(
                "messages encoded as '{encoding}' with a schema of '{language}' cannot be read here"
            )),
        }
    }
}

/// A definition as a text. Nearly all of them are one, which is quicker to find out than to repair.
fn text(data: &[u8]) -> Cow<'_, str> {
    str::from_utf8(data).map_or_else(|_| String::from_utf8_lossy(data), Cow::Borrowed)
}
