//! JSON in a single pass, without building or copying anything.
//!
//! `scanner` reads the tokens, `walk` finds the values and their places, `text` decodes and encodes quoted texts.

mod scanner;
mod text;
mod walk;

pub use scanner::{Flaw, Scanner};
pub use text::{push_quoted, unescaped};
pub use walk::{Broken, Kind, Place, Visitor, descend, elements, is_likely, walk};
