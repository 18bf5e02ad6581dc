//! Drawings are well-formed for every input, contain the expected elements, and stay the same.
//!
//! Each drawing is also written to Cargo's folder for the output of tests, for inspection.
#![cfg(test)]
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::indexing_slicing,
    reason = "tests may fail loudly"
)]

mod xml;
mod plot;
mod heat;
mod bases;
mod graph;

use std::fs;
use std::path::Path;

/// Checks that a drawing is well-formed XML without ids and references, and keeps it for looking.
#[track_caller]
fn keep(name: &str, svg: &str) -> xml::Element {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("drawings");
    fs::create_dir_all(&folder).unwrap();
    fs::write(folder.join(name), svg).unwrap();
    let root = xml::parse(svg).unwrap_or_else(|error| panic!("{name}: {error}"));
    assert_eq!(root.name, "svg");
    for element in root.all() {
        for (key, value) in &element.attributes {
            assert!(!matches!(key.as_str(), "id" | "href" | "onload"), "{name}: {key}");
            let numbers = ["NaN", "inf"].iter().any(|odd| key != "aria-label" && value.contains(odd));
            assert!(!numbers, "{name}: {key}={value}");
        }
        for class in element.attribute("class").into_iter().flat_map(str::split_whitespace) {
            assert!(class.starts_with("shsa-"), "{name}: class {class}");
        }
    }
    root
}
