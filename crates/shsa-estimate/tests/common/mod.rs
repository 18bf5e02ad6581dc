//! What several tests use.

use shsa_estimate::formulas::{Draft, Formulas, Sensor, Vocabulary};

/// A system by names of states, transition, the upper triangle of the noise, and sensors with variance and turn.
pub(crate) fn system(
    states: &[&str],
    transition: &[&str],
    noise: &[&str],
    sensors: &[(&str, &str, Option<f64>)],
) -> Formulas {
    let mut words = Vocabulary::default();
    states.iter().for_each(|state| {
        words.add_number(*state);
    });
    let formula = |text: &&str| words.formula("a test", text).unwrap();
    let sensor = |(text, variance, turn): &(&str, &str, Option<f64>)| Sensor {
        name: (*text).into(),
        formula: formula(text),
        variance: formula(variance),
        turn: *turn,
    };
    Formulas::new(Draft {
        transition: transition.iter().map(formula).collect(),
        controls: 0,
        noise: noise.iter().map(formula).collect(),
        sensors: sensors.iter().map(sensor).collect(),
    })
    .unwrap()
}
