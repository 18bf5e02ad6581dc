//! What messages carry: fields of plain numbers and JSON read by path, and values written the way consumers read them.
//!
//! `payload -> places of the wanted fields, in one walk -> Reading or Unreadable, each with its reason`
//!
//! A payload is a stranger's: any bytes are survived, the size and the depth are bounded, and what cannot be read says why
//! in a few words. Scalars are read without allocation.

mod unreadable;
mod wanted;
mod typed;
mod reader;
mod writer;
mod explore;

pub use explore::{Content, FIELDS_MAX, Leaf, explore};
pub use reader::{Reader, Reading, SIZE_LIMIT};
pub use unreadable::Unreadable;
pub use writer::{Writer, plain};

#[cfg(test)]
mod tests;
