//! CDR, the encoding of ROS 2's messages: reads fields by path, writes values, hashes types.

mod reader;
#[cfg_attr(
    not(any(feature = "ros2", feature = "ros2-dds")),
    allow(dead_code, reason = "only ROS 2 carries what it writes")
)]
mod writer;
pub mod call;
#[cfg(feature = "ros2")]
mod hash;

#[cfg(feature = "ros2")]
pub use hash::type_hash;

pub(crate) use reader::Reader;
pub(crate) use writer::Writer;
#[cfg(any(feature = "ros2", feature = "ros2-dds"))]
pub(crate) use writer::{HEADER, text_message, time_parts};

#[cfg(test)]
mod tests;
