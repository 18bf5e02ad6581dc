//! Models in the forms of other programs, from outside.
#![cfg(test)]
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::indexing_slicing,
    reason = "tests may fail loudly"
)]

mod prolog;
mod round_trip;
mod radars;
