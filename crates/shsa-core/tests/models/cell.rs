//! A cell whose resistance is learned, for tests.

use crate::models::{System, built, need, relation, sensors, text, variable};
use shsa_core::knowledge::{Draft, RelationDraft, VariableDraft};
use shsa_core::observation::RawValue;

/// A cell whose resistance is learned: 30 mohm, by two voltmeters, one of them slow, and a current that changes.
pub(crate) fn cell() -> System {
    System { knowledge: built(&cell_draft()), truth: cell_truth }
}

/// The draft of the cell.
pub(crate) fn cell_draft() -> Draft {
    let range = Some((text("15 mohm"), text("60 mohm")));
    let resistance = VariableDraft { range, ..variable("resistance", "ohm", "scalar", "1 mohm/h") };
    let mut draft = Draft {
        variables: vec![
            variable("voltage", "V", "scalar", "1 V/s"),
            variable("rest", "V", "scalar", "0.1 V/s"),
            variable("current", "A", "scalar", "20 A/s"),
            resistance,
        ],
        ..Draft::default()
    };
    let terminal = relation("terminal", "voltage = rest - resistance * current", "voltage", "0.001 V");
    draft.relations = vec![RelationDraft { learn: vec![text("resistance")], ..terminal }];
    draft.signals = sensors(&[
        ("voltage_1", "voltage", "10 Hz", "0.005", "0 ms"),
        ("voltage_2", "voltage", "2 Hz", "0.005", "20 ms"),
        ("rest", "rest", "5 Hz", "0.005", "0 ms"),
        ("current", "current", "10 Hz", "0.1", "0 ms"),
    ]);
    draft.needs = vec![need("voltage", "2 s")];
    draft
}

fn cell_truth(signal: usize, seconds: f64) -> RawValue {
    let seconds = if signal == 1 { seconds - 0.02 } else { seconds };
    let current = 20.0 + 10.0 * (seconds / 5.0).sin();
    RawValue::Number(match signal {
        0 | 1 => 4.0 - 0.030 * current,
        2 => 4.0,
        _ => current,
    })
}
