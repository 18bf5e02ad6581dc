//! Changes of models in use: edits, parts, and an engine that goes on.

mod drafts;
mod edits;
mod parts;
mod reload;

/// The first difference of two runs, with a few of the following elements: full lists would be too long to read.
pub(super) fn difference<T: PartialEq + core::fmt::Debug>(one: &[T], other: &[T]) -> Option<String> {
    let at = (0..one.len().max(other.len())).find(|&at| one.get(at) != other.get(at))?;
    let rest = |output: &[T]| format!("{:#?}", output.iter().skip(at).take(3).collect::<Vec<_>>());
    Some(format!("at {at}: {} and {}", rest(one), rest(other)))
}
