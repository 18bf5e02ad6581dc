//! What messages and recorded rows are made of, the same for files and for middleware: where in them a signal is found, and
//! when it was true.

mod error;
pub mod stamp;
pub mod zone;
pub mod moment;
pub mod span;
pub mod path;
pub mod source;
pub mod json;
pub mod ros;
pub mod protobuf;

pub use error::MessageError;
