//! The systems under measurement and the values of their sensors: values move, there is no fault.

use shsa_core::engine::Input;
use shsa_core::knowledge::{
    BodyDraft, Bounds, Draft, KnowledgeBase, NeedDraft, RelationDraft, SignalDraft, SignalId, Text,
    VariableDraft, build,
};
use shsa_core::observation::{Observation, RawValue};
use shsa_core::time::{Span, Time};

/// Variables of the plant, and the signals of each.
const PLANT: (usize, usize) = (2_000, 5);
/// The rate of each signal of the plant.
const PLANT_RATE_HZ: i64 = 10;
/// Beams of the laser scanner, and values in a row of the depth image.
pub(super) const SCAN: [usize; 2] = [720, 320];
/// The rate of both.
const SCAN_RATE_HZ: i64 = 30;

const SECOND: i64 = 1_000_000_000;

/// A knowledge base, and a cycle of observations that is repeated.
pub(super) struct System {
    pub(super) knowledge: KnowledgeBase,
    /// How long a cycle takes.
    pub(super) cycle: Span,
    /// The signals in the order in which they publish within a cycle, with their vector length (`None`: a number).
    pub(super) senders: Vec<Sender>,
    number: fn(SignalId, i64) -> f64,
}

/// One signal of a cycle.
#[derive(Clone, Copy)]
pub(super) struct Sender {
    pub(super) signal: SignalId,
    at: Span,
    length: Option<usize>,
}

impl System {
    /// The observation of one signal in a cycle.
    pub(super) fn observation(&self, sender: &Sender, cycle: i64) -> Observation {
        let stamp = Time(cycle * self.cycle.0) + sender.at;
        let number = (self.number)(sender.signal, cycle);
        let value = match sender.length {
            None => RawValue::Number(number),
            Some(length) => RawValue::Vector((0..length).map(|at| number + (at % 64) as f64 * 0.1).collect()),
        };
        Observation { signal: sender.signal, stamp, received: stamp, value }
    }

    /// All inputs of a cycle.
    pub(super) fn inputs(&self, cycle: i64) -> impl Iterator<Item = Input> + '_ {
        self.senders.iter().map(move |sender| Input::Observation(self.observation(sender, cycle)))
    }
}

/// A triangular wave between 1 and 2 with a period of 200 cycles.
fn wave(cycle: i64) -> f64 {
    1.0 + ((cycle % 200) - 100).abs() as f64 / 100.0
}

/// Three signals carry one variable, as in the generic experiment of the thesis, with its errors and its times in a step of a
/// second.
pub(super) fn generic() -> anyhow::Result<System> {
    let signal = |name: &str, value_error: &str, time_error: &str| SignalDraft {
        time_error: Some(Bounds::One(text(time_error))),
        ..signal(name, "x", value_error)
    };
    let draft = Draft {
        variables: vec![variable("x", false)],
        signals: vec![
            signal("/a/data", "0.08", "500 ms"),
            signal("/b/data", "0.1", "250 ms"),
            signal("/c/data", "0.15", "100 ms"),
        ],
        ..Draft::default()
    };
    system(&draft, SECOND, |at| (Span::from_millis(500 + 150 * at as i64), None), |_, cycle| wave(cycle))
}

/// Two thousand variables, each carried by five signals: four substitutes for every signal.
pub(super) fn plant() -> anyhow::Result<System> {
    let (variables, each) = PLANT;
    let carries = |at: usize| (format!("s{}_{}", at / each, at % each), format!("v{}", at / each));
    let draft = Draft {
        variables: (0..variables).map(|at| variable(&format!("v{at}"), false)).collect(),
        signals: (0..variables * each).map(carries).map(|(name, carried)| rated(&name, &carried)).collect(),
        ..Draft::default()
    };
    plant_system(&draft)
}

/// Two thousand variables, each measured and computed by four relations from four signals of their own.
pub(super) fn computed_plant() -> anyhow::Result<System> {
    let (variables, each) = PLANT;
    let mut draft = Draft::default();
    for at in 0..variables {
        draft.variables.push(variable(&format!("v{at}"), false));
        draft.signals.push(rated(&format!("s{at}_0"), &format!("v{at}")));
        for other in 1..each {
            let input = format!("u{at}_{other}");
            draft.variables.push(variable(&input, false));
            draft.signals.push(rated(&format!("s{at}_{other}"), &input));
            draft.relations.push(relation(
                &format!("r{at}_{other}"),
                &format!("v{at} = 2 * {input} + {other}"),
                &format!("v{at}"),
            ));
        }
    }
    let number = |signal: SignalId, cycle| match usize_of(signal) % PLANT.1 {
        0 => wave(cycle),
        other => (wave(cycle) - other as f64) / 2.0,
    };
    let mut system = plant_system(&draft)?;
    system.number = number;
    Ok(system)
}

/// Each signal publishes at a moment of its own; the moments are evenly spread over a cycle.
fn plant_system(draft: &Draft) -> anyhow::Result<System> {
    let cycle = SECOND / PLANT_RATE_HZ;
    let count = draft.signals.len() as i64;
    system(draft, cycle, |at| (Span(cycle * at as i64 / count), None), |_, cycle| wave(cycle))
}

/// The distance of the nearest obstacle, from a laser scan and from a row of a depth image; a need asks for it.
pub(super) fn scans() -> anyhow::Result<System> {
    let vector = |name: &str, carried: &str| SignalDraft {
        rate: Some(text(&format!("{SCAN_RATE_HZ} Hz"))),
        ..signal(name, carried, "0.1")
    };
    let draft = Draft {
        variables: vec![variable("v_2D", true), variable("v_row", true), variable("v_dmin", false)],
        relations: vec![
            relation("nearest", "v_dmin = min(v_2D)", "v_dmin"),
            relation("nearest_in_row", "v_dmin = min(v_row)", "v_dmin"),
        ],
        signals: vec![vector("/lidar/scan", "v_2D"), vector("/camera/row", "v_row")],
        needs: vec![NeedDraft {
            variable: text("v_dmin"),
            max_age: Some(text("200 ms")),
            ..NeedDraft::default()
        }],
        ..Draft::default()
    };
    let sender = |at: usize| (Span::from_millis(4 * at as i64), SCAN.get(at).copied());
    system(&draft, SECOND / SCAN_RATE_HZ, sender, |_, cycle| wave(cycle))
}

fn system(
    draft: &Draft,
    cycle: i64,
    sender: impl Fn(usize) -> (Span, Option<usize>),
    number: fn(SignalId, i64) -> f64,
) -> anyhow::Result<System> {
    let (knowledge, problems) = build(draft);
    if let Some(problem) = problems.first() {
        anyhow::bail!("a model to measure is wrong: {}", problem.message);
    }
    let senders = knowledge.signals().ids().enumerate();
    let senders = senders.map(|(number, signal)| {
        let (at, length) = sender(number);
        Sender { signal, at, length }
    });
    Ok(System { senders: senders.collect(), knowledge, cycle: Span(cycle), number })
}

fn usize_of(signal: SignalId) -> usize {
    shsa_core::knowledge::Id::index(signal)
}

fn text(text: &str) -> Text {
    Text { text: text.to_owned(), ..Text::default() }
}

fn variable(name: &str, is_vector: bool) -> VariableDraft {
    let max_rate = (!is_vector).then(|| text("2"));
    VariableDraft {
        name: text(name),
        shape: is_vector.then(|| text("vector")),
        max_rate,
        ..VariableDraft::default()
    }
}

fn signal(name: &str, carried: &str, value_error: &str) -> SignalDraft {
    SignalDraft {
        name: text(name),
        variable: Some(text(carried)),
        value_error: Some(Bounds::One(text(value_error))),
        ..SignalDraft::default()
    }
}

/// A signal of the plant.
fn rated(name: &str, carried: &str) -> SignalDraft {
    SignalDraft { rate: Some(text(&format!("{PLANT_RATE_HZ} Hz"))), ..signal(name, carried, "0.1") }
}

fn relation(name: &str, equation: &str, output: &str) -> RelationDraft {
    RelationDraft {
        name: text(name),
        body: BodyDraft::Equation(text(equation)),
        directions: Some(vec![text(output)]),
        condition: None,
        error: None,
        learn: Vec::new(),
        properties: Vec::new(),
    }
}

/// One variable carried by `ways` signals, each of which publishes at a moment of its own.
pub(super) fn crowd(ways: usize) -> anyhow::Result<System> {
    let draft = Draft {
        variables: vec![variable("v", false)],
        signals: (0..ways).map(|at| rated(&format!("s{at}"), "v")).collect(),
        ..Draft::default()
    };
    plant_system(&draft)
}
