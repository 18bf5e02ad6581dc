//! CDR, the encoding of ROS 2's messages: reads fields by path, writes values and whole messages, hashes types.

mod reader;
mod encoding;
mod compose;
#[cfg_attr(
    not(any(feature = "ros2", feature = "ros2-dds")),
    allow(dead_code, reason = "only ROS 2 carries what it writes")
)]
mod writer;
pub mod call;
#[cfg(feature = "ros2")]
mod hash;

pub use compose::{Content, FieldContent, compose};
#[cfg(feature = "ros2")]
pub use hash::type_hash;

#[cfg(any(feature = "ros2", feature = "ros2-dds"))]
pub(crate) use encoding::{HEADER, time_parts};
pub(crate) use reader::Reader;
pub(crate) use writer::Writer;
#[cfg(any(feature = "ros2", feature = "ros2-dds"))]
pub(crate) use writer::text_message;

#[cfg(test)]
mod tests;
