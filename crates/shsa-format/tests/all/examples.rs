//! The examples do what they show, and the recordings of `examples/` are those that their program makes.

#[path = "../../examples/drives.rs"]
mod drives;
#[path = "../../examples/own_loop.rs"]
mod own_loop;

use std::path::Path;

#[test]
fn an_engine_in_a_loop_of_ones_own_names_the_wrong_float_and_heals_the_level() {
    let (decisions, error) = own_loop::run();
    let kinds: Vec<&str> = decisions.iter().filter_map(|decision| decision.split(' ').next()).collect();
    assert!(kinds.contains(&"failed") && kinds.contains(&"substituted"), "{decisions:?}");
    assert!(error < 0.05, "{error}");
}

#[test]
fn the_recordings_are_those_of_the_program() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples");
    let mut size = 0;
    for (file, text) in drives::files() {
        let stored = std::fs::read_to_string(root.join(&file)).unwrap_or_default();
        assert!(stored == text, "{file}: `cargo run -p shsa-format --example drives` writes another one");
        size += text.len();
    }
    assert!(size < 200_000, "{size} bytes");
}
