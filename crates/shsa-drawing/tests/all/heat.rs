//! Heat maps: each cell with its value, what is missing, and hostile input.

use super::keep;
use proptest::prelude::*;
use shsa_drawing::Heat;

/// As of a campaign: shares of faults healed, by kind and size.
fn campaign(columns: &[&str]) -> Heat {
    let rows =
        ["bias", "drift", "stuck", "drop", "noise", "spike", "a kind of fault with a very long name indeed"];
    let value = |row: usize, column: usize| {
        let share = 1.15 - 0.1 * row as f64 - 0.22 * column as f64;
        (row + column != 7).then_some(share.clamp(0.0, 1.0))
    };
    let cells = |row| (0..columns.len()).map(|column| value(row, column)).collect();
    Heat {
        title: "Faults healed in time".into(),
        row: "kind".into(),
        column: "size of the fault".into(),
        rows: rows.map(str::to_owned).into(),
        columns: columns.iter().map(|name| (*name).to_owned()).collect(),
        cells: (0..rows.len()).map(cells).collect(),
        full: 1.0,
    }
}

#[test]
fn each_cell_has_its_value_and_tooltip() {
    let root = keep("heat.svg", &campaign(&["4 σ", "3 σ", "2 σ", "1 σ", "0.5 σ"]).svg());
    let tooltips = root.texts("title");
    for tooltip in ["bias, 4 σ: 1", "drift, 2 σ: 0.61", "spike, 2 σ: no value"] {
        assert!(tooltips.contains(&tooltip), "{tooltip} is not in {tooltips:?}");
    }
    assert_eq!(root.count("shsa-value"), 7 * 5);
    keep(
        "heat-names.svg",
        &campaign(&["/wheel/front/left", "/wheel/front/right", "/imu", "/gnss/velocity"]).svg(),
    );
}

proptest! {
    #[test]
    fn any_table_is_well_formed(
        title in ".*", row in ".*", column in ".*",
        rows in prop::collection::vec(".*", 0..4), columns in prop::collection::vec(".*", 0..4),
        cells in prop::collection::vec(prop::collection::vec(any::<Option<f64>>(), 0..5), 0..5),
    ) {
        keep("random-heat.svg", &Heat { title, row, column, rows, columns, cells, full: 1.0 }.svg());
    }
}
