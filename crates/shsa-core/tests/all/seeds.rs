//! How many random cases are tried.
//!
//! Cases are drawn from seeds that do not change, so that what passed once passes again: more of them find something only where the
//! code has changed. `SHSA_SEEDS=10000 cargo test --release -p shsa-core --test all` tries more, and `SHSA_SEEDS=10000..20000` others.

use std::ops::Range;

/// The seeds of a test: those of `SHSA_SEEDS`, else as many as are usual for it, from 0 on.
pub(crate) fn seeds(usual: u64) -> Range<u64> {
    let Ok(text) = std::env::var("SHSA_SEEDS") else { return 0..usual };
    let number = |text: &str| text.parse().expect("SHSA_SEEDS=COUNT or FIRST..LAST");
    text.split_once("..").map_or_else(|| 0..number(&text), |(first, last)| number(first)..number(last))
}
