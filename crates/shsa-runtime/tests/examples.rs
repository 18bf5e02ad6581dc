//! The example does what it shows.

#[path = "../examples/own_bus.rs"]
mod own_bus;

#[test]
fn a_program_with_its_own_bus_is_healed_from_within() {
    let (healed, decisions) = own_bus::run().unwrap();
    assert_eq!(healed, [5.0, 6.0]);
    assert!(decisions.iter().any(|kind| kind == "ordered"), "{decisions:?}");
    assert!(decisions.iter().any(|kind| kind == "substituted"), "{decisions:?}");
}
