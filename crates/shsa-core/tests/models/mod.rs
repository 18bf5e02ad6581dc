//! Three small systems and their sensors' values without faults: for tests and benchmarks of the engine.

use shsa_core::engine::Input;
use shsa_core::knowledge::{
    BodyDraft, Bounds, Draft, NeedDraft, RelationDraft, SignalDraft, Text, VariableDraft,
};
use shsa_core::knowledge::{Id, KnowledgeBase, SignalId, build};
use shsa_core::observation::{Observation, RawValue};
use shsa_core::time::{Span, Time};

/// A sensor: its name and variable, rate, error and delay.
pub(crate) type Sensor<'a> = (&'a str, &'a str, &'a str, &'a str, &'a str);

/// A knowledge base and the values of its sensors without faults, at a time in seconds.
pub(crate) struct System {
    /// The knowledge base.
    pub(crate) knowledge: KnowledgeBase,
    /// The value of a signal at a time in seconds.
    pub(crate) truth: fn(usize, f64) -> RawValue,
}

/// Four wheels at 83 Hz and a receiver at 10 Hz know one speed.
pub(crate) fn car() -> System {
    let truth = |signal, seconds: f64| {
        let seconds = if signal == 4 { seconds - 0.17 } else { seconds };
        RawValue::Number(14.0 + 6.0 * (seconds / 8.0).sin() + 0.1 * (signal as f64 - 2.0))
    };
    System { knowledge: built(&car_draft()), truth }
}

/// The draft of the car.
pub(crate) fn car_draft() -> Draft {
    let mut draft =
        Draft { variables: vec![variable("speed", "m/s", "scalar", "6 m/s^2")], ..Draft::default() };
    draft.signals = sensors(&[
        ("wheel_1", "speed", "83 Hz", "0.5 + 0.5 %", "0 ms"),
        ("wheel_2", "speed", "83 Hz", "0.5 + 0.5 %", "0 ms"),
        ("wheel_3", "speed", "83 Hz", "0.5 + 0.5 %", "0 ms"),
        ("wheel_4", "speed", "83 Hz", "0.5 + 0.5 %", "0 ms"),
        ("gnss", "speed", "10 Hz", "0.2 + 0.5 %", "170 ms"),
    ]);
    draft.needs = vec![need("speed", "200 ms")];
    draft
}

/// A height, a climb and their relation by a derivative, and a filter that goes on from its last value.
pub(crate) fn climber() -> System {
    let mut draft = Draft {
        variables: vec![
            variable("height", "m", "scalar", "10 m/s"),
            variable("climb", "m/s", "scalar", "12 m/s^2"),
        ],
        ..Draft::default()
    };
    draft.relations = vec![
        relation("climbing", "climb = derivative(height, 1 s)", "climb", "0.5 m/s"),
        relation("reckoning", "height = previous(height) + climb * dt", "height", "0.1 m"),
    ];
    draft.signals = sensors(&[
        ("barometer", "height", "20 Hz", "0.3", "20 ms"),
        ("climb_1", "climb", "50 Hz", "0.4", "0 ms"),
        ("climb_2", "climb", "10 Hz", "0.4", "30 ms"),
    ]);
    draft.needs = vec![need("height", "300 ms"), need("climb", "1500 ms")];
    let truth = |signal, seconds: f64| {
        RawValue::Number(if signal == 0 {
            100.0 - 4.0 * (seconds / 4.0).cos()
        } else {
            (seconds / 4.0).sin()
        })
    };
    System { knowledge: built(&draft), truth }
}

/// A rover's distance to the nearest obstacle: from a lidar, a sonar ring, a depth image, or by reckoning.
pub(crate) fn rover() -> System {
    let mut draft = Draft {
        variables: vec![
            variable("v_3D", "m", "vector", "20 m/s"),
            variable("v_2D", "m", "vector", "20 m/s"),
            variable("v_dmin", "m", "scalar", "1.5 m/s"),
            variable("speed", "m/s", "scalar", "3 m/s^2"),
        ],
        ..Draft::default()
    };
    draft.relations = vec![
        relation("row", "v_2D = v_3D[192..288]", "v_2D", "0"),
        relation("nearest", "v_dmin = min(v_2D)", "v_dmin", "0"),
        relation("reckoning", "v_dmin = previous(v_dmin) - speed * dt", "v_dmin", "0.1 m"),
    ];
    draft.signals = sensors(&[
        ("lidar", "v_2D", "10 Hz", "0.04", "0 ms"),
        ("sonar", "v_2D", "12.5 Hz", "0.13", "0 ms"),
        ("image", "v_3D", "15 Hz", "0.08", "0 ms"),
        ("odometry", "speed", "20 Hz", "0.03", "0 ms"),
    ]);
    draft.needs = vec![need("v_dmin", "300 ms")];
    let truth = |signal, seconds: f64| {
        let nearest = 5.0 + 2.0 * (seconds / 6.0).cos();
        let scan =
            |length: usize| RawValue::Vector((0..length).map(|at| nearest + (at % 7) as f64).collect());
        match signal {
            0 => scan(181),
            1 => scan(13),
            2 => scan(480),
            _ => RawValue::Number((seconds / 6.0).sin() / 3.0),
        }
    };
    System { knowledge: built(&draft), truth }
}

impl System {
    /// All observations from one second on for a number of seconds, by reception.
    pub(crate) fn inputs(&self, from_s: u32, seconds: u32) -> Vec<Input> {
        let mut inputs: Vec<Input> = Vec::new();
        let signals = self.knowledge.signals();
        for signal in signals.ids() {
            let rate_hz = signals[signal].rate_hz.unwrap_or(1.0);
            let numbers =
                (f64::from(from_s) * rate_hz) as u64..(f64::from(from_s + seconds) * rate_hz) as u64;
            inputs.extend(numbers.map(|number| self.observation(signal, number as f64 / rate_hz)));
        }
        inputs.sort_by_key(Input::time);
        inputs
    }

    fn observation(&self, signal: SignalId, seconds: f64) -> Input {
        // A thousandth of a second of jitter that repeats.
        let late = Span(((seconds * 1e3) as i64 * 7919) % 1_000_000);
        let stamp = Time::from_seconds(seconds) + late;
        let value = (self.truth)(signal.index(), seconds);
        Input::Observation(Observation { signal, stamp, received: stamp, value })
    }
}

pub(crate) fn text(text: &str) -> Text {
    Text { text: text.to_owned(), ..Text::default() }
}

pub(crate) fn variable(name: &str, unit: &str, shape: &str, max_rate: &str) -> VariableDraft {
    let (unit, shape, max_rate) = (Some(text(unit)), Some(text(shape)), Some(text(max_rate)));
    VariableDraft { name: text(name), unit, shape, max_rate, ..VariableDraft::default() }
}

pub(crate) fn sensors(sensors: &[Sensor<'_>]) -> Vec<SignalDraft> {
    let sensor = |&(name, variable, rate, error, delay): &Sensor<'_>| SignalDraft {
        name: text(name),
        variable: Some(text(variable)),
        rate: Some(text(rate)),
        value_error: Some(Bounds::One(text(error))),
        time_error: Some(Bounds::One(text("5 ms"))),
        delay: Some(text(delay)),
        ..SignalDraft::default()
    };
    sensors.iter().map(sensor).collect()
}

pub(crate) fn relation(name: &str, equation: &str, output: &str, error: &str) -> RelationDraft {
    RelationDraft {
        name: text(name),
        body: BodyDraft::Equation(text(equation)),
        directions: Some(vec![text(output)]),
        condition: None,
        error: Some(Bounds::One(text(error))),
        learn: Vec::new(),
        properties: Vec::new(),
    }
}

pub(crate) fn need(variable: &str, max_age: &str) -> NeedDraft {
    NeedDraft { variable: text(variable), max_age: Some(text(max_age)), ..NeedDraft::default() }
}

pub(crate) fn built(draft: &Draft) -> KnowledgeBase {
    let (knowledge, found) = build(draft);
    assert!(found.is_empty(), "{found:?}");
    knowledge
}
