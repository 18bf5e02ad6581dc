//! The engine for programs in C and C++: models from text, observations in, published values and decisions out.
//!
//! `border` has the functions that C calls, with all unsafe code: it turns pointers into references, and stops panics. The modules
//! above it are ordinary Rust: `words` (texts in the form of C), `error`, `model`, `output` (the structs of the header),
//! `engine`. cbindgen makes `include/shsa.h` from this source. `examples/loop.c` is a program that uses it.

mod words;
mod error;
mod model;
mod output;
mod engine;
mod border;

pub use border::*;
pub use engine::{Engine, Verdict};
pub use error::{Error, Status};
pub use model::{Element, Model, NO_ID};
pub use output::{Event, EventKind, Output, OutputKind, Publication, Quality, Range};
