//! What the language of models promises, from outside. One program, as each of them takes as long to build; what counts allocations has
//! its own.
#![cfg(test)]
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::indexing_slicing,
    reason = "tests may fail loudly"
)]

mod fusion;
mod fusion_arrivals;
mod fusion_chains;
mod fusion_uniqueness;
mod round_trip;
mod published_structures;

mod live;
