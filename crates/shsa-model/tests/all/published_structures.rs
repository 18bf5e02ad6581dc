//! The models whose structure was published give the published numbers.

use shsa_core::analysis::structure::{EquationId, EquationSet, LIMITS, Structure};
use shsa_core::plan::StopReason;
use std::collections::BTreeSet;
use std::path::Path;

fn structure(file: &str) -> Structure {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models").join(file);
    let loaded = shsa_model::load_file(&path);
    assert!(loaded.report.ok(), "{file}: {:?}", loaded.report);
    Structure::new(&loaded.knowledge)
}

fn faults(structure: &Structure) -> Vec<EquationId> {
    structure.equations().enumerate().filter(|(_, equation)| equation.may_fail).map(|(id, _)| id).collect()
}

/// Every fault is detectable, and isolable from every other.
#[track_caller]
fn check_isolable(structure: &Structure) {
    let found = structure.isolability(LIMITS);
    assert_eq!(found.stop, StopReason::Complete);
    for one in faults(structure) {
        assert!(found.is_detectable(one));
        for other in faults(structure) {
            assert_eq!(found.is_isolable(one, other), one != other);
        }
    }
}

/// How many equations all MSO and all MTES sets hold together, as version 0.12.5 of the toolbox for Python has it
/// for the same structure.
#[track_caller]
fn check_sizes(structure: &Structure, overdetermined: usize, tests: usize) {
    let size = |sets: &[EquationSet]| sets.iter().map(EquationSet::len).sum::<usize>();
    assert_eq!(size(&structure.overdetermined_sets(LIMITS).sets), overdetermined);
    assert_eq!(size(&structure.test_supports(LIMITS).sets), tests);
}

#[test]
fn the_water_tank_has_17_mso_and_10_mtes_sets() {
    let structure = structure("watertank.yaml");
    assert_eq!(faults(&structure).len(), 6);
    assert!(structure.decomposition().under.variables.is_empty());
    assert!(structure.decomposition().just.is_empty());
    assert_eq!(structure.overdetermined_sets(LIMITS).sets.len(), 17);
    assert_eq!(structure.test_supports(LIMITS).sets.len(), 10);
    check_sizes(&structure, 127, 67);
    check_isolable(&structure);
}

#[test]
fn the_engine_has_94_equations_90_unknowns_and_4496_mso_sets() {
    let structure = structure("engine.yaml");
    let unknowns: BTreeSet<_> =
        structure.equations().iter().flat_map(|equation| &equation.variables).collect();
    assert_eq!((structure.equations().len(), unknowns.len()), (94, 90));
    assert_eq!(faults(&structure).len(), 11);
    assert_eq!(structure.decomposition().redundancy(), 4);
    let found = structure.overdetermined_sets(LIMITS);
    assert_eq!((found.sets.len(), found.stop), (4_496, StopReason::Complete));
    assert_eq!(structure.test_supports(LIMITS).sets.len(), 144);
    check_sizes(&structure, 343_099, 10_613);
    check_isolable(&structure);
}
