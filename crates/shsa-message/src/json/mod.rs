//! JSON gone through once, without building or copying anything.
//!
//! `scanner` knows the tokens, `walk` the values and where they stand, `text` what stands between quotes.

mod scanner;
mod walk;
mod text;

pub use scanner::{Flaw, Scanner};
pub use text::{push_quoted, unescaped};
pub use walk::{Broken, Kind, Place, Visitor, elements, is_likely, walk};
