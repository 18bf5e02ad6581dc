//! The structure of messages and recorded rows, for files and middleware alike: the place of a signal in them, and their time.
//!
//! A recording and a bus carry the same messages, so the readers of files and the bridges to middleware share this crate. A
//! [`source`] is the text in a model that says where a signal is found; a [`path`](mod@path) within it leads to a field. The modules are
//! listed in reading order: times as text first, then places, then the encodings ([`json`], [`ros`], [`protobuf`], [`sparkplug`]).
//!
//! Messages come from outside: no byte sequence makes a reader panic, and depth and work are bounded.
//!
//! # Example
//!
//! ```
//! use shsa_message::source::Source;
//!
//! let source: Source = "odom#twist.twist.linear.x@header.stamp".parse()?;
//! assert_eq!(source.file.as_deref(), Some("odom"));
//! assert_eq!(source.field, "twist.twist.linear.x");
//! assert_eq!(source.time.map(|time| time.path).as_deref(), Some("header.stamp"));
//! # Ok::<(), String>(())
//! ```

mod error;
pub mod stamp;
pub mod zone;
pub mod number;
pub mod moment;
pub mod span;
pub mod path;
pub mod source;
pub mod json;
pub mod ros;
mod wire;
pub mod protobuf;
pub mod sparkplug;

pub use error::MessageError;
