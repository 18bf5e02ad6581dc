//! JSON in a single pass, without building or copying anything.
//!
//! `scanner` reads the tokens, `walk` finds the values and their places, `shapes` does so
//! where a message has the shape of one before, `text` decodes and encodes quoted texts.

mod scanner;
mod text;
mod walk;
mod shapes;

pub use scanner::{Flaw, Scanner};
pub use shapes::Shapes;
pub use text::{push_quoted, unescaped};
pub use walk::{Broken, Kind, Place, Visitor, descend, elements, is_likely, walk};
