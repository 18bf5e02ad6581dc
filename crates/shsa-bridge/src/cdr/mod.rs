//! CDR, the form of ROS 2's messages: fields read by path, values written, types hashed.
//!
//! `types` knows what fields a message has, `plan` finds one of them, `reader` and `writer` use plans.

mod types;
mod plan;
mod reader;
#[cfg_attr(not(feature = "ros2"), allow(dead_code, reason = "only ROS 2 carries what it writes"))]
mod writer;
pub mod call;
#[cfg(feature = "ros2")]
mod hash;

#[cfg(feature = "ros2")]
pub use hash::type_hash;
pub use types::{Types, full_name};

pub(crate) use plan::text;
pub(crate) use reader::{Reader, body};
pub(crate) use writer::Writer;
#[cfg(feature = "ros2")]
pub(crate) use writer::text_message;

#[cfg(test)]
mod tests;
