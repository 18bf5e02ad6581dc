//! Models that are changed while they are in use: edits, parts, and an engine that goes on.

mod drafts;
mod edits;
mod parts;
mod reload;

/// The first place at which two runs differ, and what each says from there on: all that they say fills a book.
pub(super) fn difference<T: PartialEq + core::fmt::Debug>(one: &[T], other: &[T]) -> Option<String> {
    let at = (0..one.len().max(other.len())).find(|&at| one.get(at) != other.get(at))?;
    let rest = |said: &[T]| format!("{:#?}", said.iter().skip(at).take(3).collect::<Vec<_>>());
    Some(format!("at {at}: {} and {}", rest(one), rest(other)))
}
