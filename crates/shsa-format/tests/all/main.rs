//! What the formats promise, from outside. One program, as each of them takes as long to build; what counts allocations has its
//! own.
#![cfg(test)]
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::indexing_slicing,
    reason = "tests may fail loudly"
)]

mod examples;
mod reference;

mod restart;
mod sealed;
mod sound;
mod stories;
