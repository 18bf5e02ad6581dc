//! The engine for programs in C and C++: models from text, observations in, published values and decisions out.
//!
//! `border` has the functions that C calls, with all that is unsafe: it makes references of pointers, and stops panics. The modules
//! above it are ordinary Rust: `words` (texts as C has them), `error`, `model`, `output` (what the structs of the header look like),
//! `engine`. `include/shsa.h` is made of this source by cbindgen.

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
