//! What disagrees, what is silent, what is out of range.

pub mod pair;
pub mod thesis;
