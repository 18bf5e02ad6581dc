//! Three signals of one variable, and 10,000 signals of 2,000 variables: for counting the cost of an observation.

use crate::models::{Sensor, System, built, sensors, variable};
use shsa_core::knowledge::Draft;
use shsa_core::observation::RawValue;

/// Variables of the plant, and the signals of each.
const PLANT: (usize, usize) = (2_000, 5);

/// The three signals of the thesis's generic experiment.
pub(crate) fn generic() -> System {
    let signals = sensors(&[
        ("a", "x", "1 Hz", "0.08", "0 ms"),
        ("b", "x", "1 Hz", "0.1", "0 ms"),
        ("c", "x", "1 Hz", "0.15", "0 ms"),
    ]);
    let variables = vec![variable("x", "1", "scalar", "1")];
    System { knowledge: built(&Draft { variables, signals, ..Draft::default() }), truth }
}

/// Each variable is carried by five signals at 10 Hz.
pub(crate) fn plant() -> System {
    let (variables, each) = PLANT;
    let names: Vec<(String, String)> =
        (0..variables * each).map(|at| (format!("s{at}"), format!("v{}", at / each))).collect();
    let sensor = |(name, carried): &'static (String, String)| -> Sensor<'static> {
        (name, carried, "10 Hz", "0.1", "0 ms")
    };
    let names: &'static [_] = names.leak();
    let draft = Draft {
        variables: (0..variables).map(|at| variable(&format!("v{at}"), "1", "scalar", "1")).collect(),
        signals: sensors(&names.iter().map(sensor).collect::<Vec<_>>()),
        ..Draft::default()
    };
    System { knowledge: built(&draft), truth }
}

fn truth(_: usize, seconds: f64) -> RawValue {
    RawValue::Number(1.0 + 0.5 * (seconds / 8.0).sin())
}
