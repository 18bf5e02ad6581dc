//! The rover of `shsa-demo` as separate programs on a bus: what each of them does, and how they speak.

mod encoding;
pub mod port;
pub mod process;

pub use encoding::{Encoding, model};
