//! The structure of messages and recorded rows, for files and middleware alike: the place of a signal in them, and their time.

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
