//! Three signals of one variable, every two compared within their errors: by RTLola's interpreter and by our monitor.
//!
//! Both get the same values in turns, on one core; the fastest of five turns counts. In one case every observation has a moment
//! of its own (RTLola: one event each), in the other three share a moment (RTLola: one event for three). Prints one JSON line.

use rtlola_interpreter::config::OfflineMode;
use rtlola_interpreter::input::ArrayFactory;
use rtlola_interpreter::monitor::{Monitor, TriggerMessages};
use rtlola_interpreter::time::RelativeFloat;
use rtlola_interpreter::{ConfigBuilder, Value};
use shsa_core::engine::{Engine, EventKind, Input, Options, Output};
use shsa_core::knowledge::{Bounds, Draft, SignalDraft, Text, VariableDraft, build};
use shsa_core::observation::{Observation, RawValue};
use shsa_core::time::Time;
use std::convert::Infallible;
use std::error::Error;
use std::time::{Duration, Instant};

type Lola = Monitor<
    ArrayFactory<3, Infallible, [Value; 3]>,
    OfflineMode<RelativeFloat>,
    TriggerMessages,
    RelativeFloat,
>;
type Run<'a> = Box<dyn FnMut(u64) -> Result<usize, Box<dyn Error>> + 'a>;

/// Plus-minus, of each signal.
const ERRORS: [f64; 3] = [0.08, 0.1, 0.15];
/// Observations between two looks at the clock.
const BATCH: u64 = 30_000;
const TURNS: usize = 5;

/// Two intervals are apart when the distance of their middles exceeds the sum of both errors. Each observation is compared with
/// the latest value of the other two signals; their initial value is 2, where the data begin.
fn specification(is_one_event: bool) -> String {
    let [a, b, c] = ERRORS;
    let trigger = |one: char, other: char, apart: f64| match is_one_event {
        true => format!("trigger abs({one} - {other}) > {apart:.3} \"apart\"\n"),
        false => format!(
            "trigger @({one} || {other}) abs({one}.hold(or: 2.0) - {other}.hold(or: 2.0)) > {apart:.3} \"apart\"\n"
        ),
    };
    let triggers = [trigger('a', 'b', a + b), trigger('a', 'c', a + c), trigger('b', 'c', b + c)];
    format!("import math\ninput a: Float64\ninput b: Float64\ninput c: Float64\n{}", triggers.concat())
}

/// The value of an observation and its time: three consecutive ones have equal values, and are a millisecond apart or
/// simultaneous.
fn observed(number: u64, is_one_event: bool, fault: f64) -> (f64, u64) {
    let step = number / 3;
    let wave = 1.0 + (step % 200).abs_diff(100) as f64 / 100.0;
    let moment = if is_one_event { 3 * step } else { number };
    (if number % 3 == 2 { wave + fault } else { wave }, moment * 1_000_000)
}

fn lola(is_one_event: bool) -> Result<Lola, Box<dyn Error>> {
    let built = ConfigBuilder::new()
        .spec_str(&specification(is_one_event))
        .offline::<RelativeFloat>()
        .with_array_events::<3, Infallible, [Value; 3]>()
        .with_verdict::<TriggerMessages>()
        .monitor();
    built.map_err(|error| format!("{error:?}").into())
}

/// Passes observations from number `from` on to RTLola; how many comparisons were apart.
fn run_lola(lola: &mut Lola, is_one_event: bool, from: u64, fault: f64) -> Result<usize, Box<dyn Error>> {
    let mut apart = 0;
    let mut accept = |event: [Value; 3], at_ns: u64| -> Result<(), Box<dyn Error>> {
        let found = lola.accept_event(event, Duration::from_nanos(at_ns));
        apart += found.map_err(|error| format!("{error:?}"))?.event.len();
        Ok(())
    };
    let value = |number: u64| Value::try_from(observed(number, is_one_event, fault).0).unwrap_or(Value::None);
    for number in from..from + BATCH {
        let at_ns = observed(number, is_one_event, fault).1;
        match (is_one_event, number % 3) {
            (true, 0) => accept([0, 1, 2].map(|of| value(number + of)), at_ns)?,
            (true, _) => {}
            (false, which) => {
                let mut event = [Value::None, Value::None, Value::None];
                event[which as usize] = value(number);
                accept(event, at_ns)?;
            }
        }
    }
    Ok(apart)
}

fn ours() -> Engine {
    let text = |text: &str| Text { text: text.to_owned(), ..Text::default() };
    let signal = |(name, error): (&str, f64)| SignalDraft {
        name: text(name),
        variable: Some(text("x")),
        value_error: Some(Bounds::One(text(&error.to_string()))),
        ..SignalDraft::default()
    };
    let (knowledge, problems) = build(&Draft {
        variables: vec![VariableDraft { name: text("x"), ..VariableDraft::default() }],
        signals: ["a", "b", "c"].into_iter().zip(ERRORS).map(signal).collect(),
        ..Draft::default()
    });
    assert!(problems.is_empty(), "{problems:?}");
    Engine::new(knowledge, Options::default())
}

fn run_ours(engine: &mut Engine, is_one_event: bool, from: u64, fault: f64) -> usize {
    let signals: Vec<_> = engine.knowledge().signals().ids().collect();
    let mut failed = 0;
    for number in from..from + BATCH {
        let (value, at_ns) = observed(number, is_one_event, fault);
        let at = Time(at_ns as i64);
        let value = RawValue::Number(value);
        let signal = signals[(number % 3) as usize];
        engine.handle(Input::Observation(Observation { signal, stamp: at, received: at, value }));
        while let Some(output) = engine.poll() {
            failed += usize::from(matches!(output, Output::Event(event) if event.kind == EventKind::Failed));
        }
    }
    failed
}

/// Seconds on the processor, where the system gives them.
fn clock(began: Instant) -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let ran = text.split_whitespace().next().and_then(|ran| ran.parse::<f64>().ok());
    ran.map_or_else(|| began.elapsed().as_secs_f64(), |nanoseconds| nanoseconds / 1e9)
}

/// Observations a second in a turn. The data are healthy, so any finding is an error.
fn turn(run: &mut Run<'_>, from: &mut u64, turn_s: f64) -> Result<f64, Box<dyn Error>> {
    let began = Instant::now();
    let (start, mut count) = (clock(began), 0);
    while clock(began) - start < turn_s {
        let found = run(*from)?;
        assert_eq!(found, 0, "nothing is wrong, but something was found");
        *from += BATCH;
        count += BATCH;
    }
    Ok(count as f64 / (clock(began) - start))
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip_while(|argument| argument != "--turn").skip(1);
    let turn_s: f64 = arguments.next().map_or(Ok(0.5), |text| text.parse())?;
    // Both must find a fault, else their speed means nothing.
    for is_one_event in [false, true] {
        assert!(run_lola(&mut lola(is_one_event)?, is_one_event, 0, 1.0)? > 0, "RTLola finds no fault");
        assert!(run_ours(&mut ours(), is_one_event, 0, 1.0) > 0, "we find no fault");
    }
    let (mut single, mut joint) = ((lola(false)?, ours()), (lola(true)?, ours()));
    let mut runs: [Run<'_>; 4] = [
        Box::new(|from| run_lola(&mut single.0, false, from, 0.0)),
        Box::new(|from| Ok(run_ours(&mut single.1, false, from, 0.0))),
        Box::new(|from| run_lola(&mut joint.0, true, from, 0.0)),
        Box::new(|from| Ok(run_ours(&mut joint.1, true, from, 0.0))),
    ];
    let (mut best, mut from) = ([0.0_f64; 4], [0_u64; 4]);
    for _ in 0..TURNS {
        for ((run, best), from) in runs.iter_mut().zip(&mut best).zip(&mut from) {
            *best = best.max(turn(run, from, turn_s)?);
        }
    }
    let [rtlola, ours, rtlola_joint, ours_joint] = best;
    println!(
        "{{\"rtlola\": {rtlola}, \"ours\": {ours}, \"rtlola_joint\": {rtlola_joint}, \"ours_joint\": {ours_joint}}}"
    );
    Ok(())
}
