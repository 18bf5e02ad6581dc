//! The engine alone in a loop of the caller: no file, no bus, no clock. One of three floats in a tank is wrong from 10 s on.

use shsa_core::engine::{Engine, Input, Options, Output, PublishedValue, Ticks};
use shsa_core::observation::{Observation, RawValue};
use shsa_core::time::Time;
use shsa_format::words;

const TANK: &str = "
shsa: 1
variables: { level: { unit: m, range: [0, 10] } }
signals:
  float_1: { variable: level, unit: m, rate: 5 Hz, value_error: 0.05 }
  float_2: { variable: level, unit: m, rate: 5 Hz, value_error: 0.05 }
  float_3: { variable: level, unit: m, rate: 5 Hz, value_error: 0.05 }
needs: { level: { signal: healed_level, max_age: 1 s } }
";

fn reading(float: &str, second: f64) -> f64 {
    let level = 5.0 + 2.0 * (second / 10.0).sin();
    if float == "float_1" && second >= 10.0 { level + 0.5 } else { level }
}

/// The decisions, and the error of the healed level at the end.
pub(crate) fn run() -> (Vec<String>, f64) {
    let loaded = shsa_model::load(TANK, "tank.yaml");
    assert!(loaded.report.ok(), "{}", loaded.report.render(false));
    let mut engine = Engine::new(loaded.knowledge, Options::default());
    let (mut decisions, mut error) = (Vec::new(), f64::NAN);
    for step in 0..100 {
        let (now, second) = (Time(step * 200_000_000), step as f64 / 5.0);
        engine.pass(Ticks::before(now));
        let signals: Vec<_> =
            engine.knowledge().signals().enumerate().map(|(id, it)| (id, it.name.clone())).collect();
        for (signal, name) in signals {
            let value = RawValue::Number(reading(&name, second));
            engine.handle(Input::Observation(Observation { signal, stamp: now, received: now, value }));
        }
        engine.pass(Ticks::up_to(now));
        while let Some(output) = engine.poll() {
            match output {
                Output::Event(event) => {
                    decisions.push(format!("{} {}", event.kind.name(), words::reasons(&event.because)));
                }
                Output::Publication(publication) => {
                    let PublishedValue::Scalar(level) = publication.value else { continue };
                    error = (level.midpoint() - reading("float_2", second)).abs();
                }
                Output::Task { .. } | Output::Reloaded(_) => {}
            }
        }
    }
    (decisions, error)
}

#[cfg_attr(test, allow(dead_code, reason = "the test runs what it does"))]
fn main() {
    let (decisions, error) = run();
    println!("{}\nAt the end the healed level is {error:.3} m off.", decisions.join("\n"));
}
