//! Stories as texts: their results, and the reports of mistakes in them.

use super::{Loaded, load};
use shsa_core::engine::Input;
use shsa_core::observation::RawValue;
use std::path::Path;

/// Two thermometers, and a trace and expectations to be filled in.
const MODEL: &str = "\
story: s
why: w
model:
  shsa: 1
  variables: { room: { unit: degC, max_rate: 1 K/s } }
  signals:
    /a: { variable: room, unit: degC, rate: 2 Hz, value_error: 0.5 }
    /b: { variable: room, unit: degC, rate: 1 Hz, value_error: 0.5 }
  needs: { room: { signal: /room } }
";

fn of_trace(trace: &str, expect: &str) -> Loaded {
    load(&format!("{MODEL}trace: {trace}\nexpect: {expect}\n"), "s.yaml", Path::new("."))
}

/// Compares the samples of a trace, each as signal:stamp>reception=value.
#[track_caller]
fn check_trace(trace: &str, expected: &str) {
    let loaded = of_trace(trace, "[]");
    let story = loaded.story.unwrap_or_else(|| panic!("{}", loaded.report.render(false)));
    let shown = |input: Input| match input {
        Input::Observation(seen) => {
            let name = &story.knowledge.signals()[seen.signal].name;
            let RawValue::Number(value) = seen.value else { panic!("only numbers are observed here") };
            format!("{name}:{}>{}={value:.2}", seen.stamp.seconds(), seen.received.seconds())
        }
        other => panic!("there are only observations in this trace: {other:?}"),
    };
    let seen: Vec<String> = story.trace.inputs(&story.knowledge).into_iter().map(shown).collect();
    assert_eq!(seen.join(" "), expected);
}

#[test]
fn formulas_are_sampled_as_the_sensors_would() {
    check_trace("{ duration: 1 s, signals: { /b: { value: 20 } } }", "/b:0>0=20.00");
    check_trace(
        "{ duration: 2 s, signals: { /a: { value: 20 + t / (1 s), from: 500 ms, to: 1.6 s, delay: 250 ms } } }",
        "/a:0.5>0.5=20.25 /a:1>1=20.75 /a:1.5>1.5=21.25",
    );
    check_trace("{ duration: 1 s, signals: { /b: { value: 293.15 K, latency: 40 ms } } }", "/b:0>0.04=20.00");
    check_trace(
        "{ duration: 1 s, truth: { warm: 2 K, hot: 2 * warm }, signals: { /b: { value: 300 K + hot } } }",
        "/b:0>0=30.85",
    );
}

#[test]
fn rows_and_faults_count_from_the_beginning() {
    check_trace(
        "{ duration: 3 s, signals: { /b: { value: 20, from: 1 s } }, faults: [\"bias=1:/b@2s..\"], \
         rows: [{ signal: /a, time: 1.5 s, received: 2.5 s, value: 7 }] }",
        "/b:1>1=20.00 /b:2>2=21.00 /a:1.5>2.5=7.00",
    );
}

#[test]
fn noise_stays_within_its_bounds_and_repeats_with_its_seed() {
    let values = |seed: u32| {
        let trace =
            format!("{{ duration: 60 s, seed: {seed}, signals: {{ /a: {{ value: 20, noise: 0.5 K }} }} }}");
        let story = of_trace(&trace, "[]").story.expect("a story");
        let value = |input: Input| match input {
            Input::Observation(seen) => match seen.value {
                RawValue::Number(value) => value,
                _ => f64::NAN,
            },
            _ => f64::NAN,
        };
        story.trace.inputs(&story.knowledge).into_iter().map(value).collect::<Vec<f64>>()
    };
    let noisy = values(1);
    assert_eq!(noisy, values(1));
    assert_ne!(noisy, values(2));
    assert!(noisy.iter().all(|value| (19.5..=20.5).contains(value)));
    assert!(noisy.iter().any(|value| *value < 19.7) && noisy.iter().any(|value| *value > 20.3));
}

const CALM: &str =
    "{ duration: 20 s, truth: { room: 20 }, signals: { /a: { value: room }, /b: { value: room } } }";
const SPLIT: &str = "{ duration: 20 s, truth: { room: 20 }, signals: { /a: { value: room }, /b: { value: room } }, \
     faults: [\"bias=5:/b@10s..\"] }";

/// Compares the result of one expectation: whether it is met, and the observation.
#[track_caller]
fn check(trace: &str, expectation: &str, expected: &str) {
    let loaded = of_trace(trace, &format!("[{expectation}]"));
    let story = loaded.story.unwrap_or_else(|| panic!("{}", loaded.report.render(false)));
    let outcome = story.run();
    let found = &outcome.checks[0];
    assert_eq!(format!("{}: {}", if found.met { "yes" } else { "no" }, found.found), expected);
    assert_eq!((found.expected.as_str(), found.line), (expectation, 11));
}

#[test]
fn events_are_found_and_missed() {
    let seen = "suspected /a at 12.00 s, suspected /b at 12.00 s";
    check(SPLIT, "{ event: suspected, between: [10 s, 12 s], times: 2 }", &format!("yes: {seen}"));
    check(SPLIT, "{ event: suspected, times: 1 }", &format!("no: {seen}"));
    check(SPLIT, "{ event: suspected, between: [0 s, 10 s] }", &format!("no: {seen}"));
    check(SPLIT, "{ never: suspected, signal: /a }", "no: suspected /a at 12.00 s");
    check(SPLIT, "{ event: suspected, signal: /a, because: [/a says, moon] }", "no: no such event");
    check(SPLIT, "{ event: suspected, signal: /a, because: /b says }", "yes: suspected /a at 12.00 s");
    check(SPLIT, "{ never: failed }", "yes: no such event");
    check(SPLIT, "{ event: unhealable, variable: room }", "yes: unhealable room at 12.00 s");
    check(CALM, "{ never: anything }", "yes: no such event");
}

#[test]
fn verdicts_sources_and_values_are_found_and_missed() {
    check(CALM, "{ verdict: healthy, signal: /a, at: 9 s }", "yes: healthy");
    check(SPLIT, "{ verdict: healthy, signal: /a, at: 19 s }", "no: suspect");
    check(SPLIT, "{ need: room, source: /a, at: 5 s }", "yes: /a");
    check(SPLIT, "{ need: room, source: /b, at: 5 s }", "no: /a");
    check(SPLIT, "{ need: room, source: nothing, at: 19 s }", "yes: nothing");
    check(
        CALM,
        "{ need: room, longest_gap: 600 ms, between: [1 s, 3 s] }",
        "yes: 5 values, longest gap 500 ms",
    );
    check(CALM, "{ need: room, values: none, between: [1 s, 3 s] }", "no: 5 values");
    check(SPLIT, "{ need: room, values: none, between: [13 s, 20 s] }", "yes: 0 values");
    check(
        CALM,
        "{ need: room, largest_jump: 0.1 K, largest_error: 0.1 K, truth: room, between: [1 s, 3 s] }",
        "yes: 5 values, largest jump 0.000 degC at 3.00 s, largest error 0.000 degC at 3.00 s",
    );
}

/// The first problem of a story, with its place and help.
#[track_caller]
fn refuse(trace: &str, expect: &str, expected: &str) {
    let loaded = of_trace(trace, expect);
    assert!(loaded.story.is_none());
    let first = &loaded.report.diagnostics[0];
    let help = first.help.as_deref().unwrap_or_default();
    let text = format!("{}:{}: {}; {help}", first.line, first.column, first.message);
    assert!(text.starts_with(expected), "{text}");
}

#[test]
fn mistakes_are_reported_with_their_places() {
    refuse("{ durations: 5 s }", "[]", "10:8: `duration` is missing");
    refuse("{ duration: 5 }", "[]", "10:20: `5` is no time");
    refuse("{ duration: 5 s, sead: 4 }", "[]", "10:25: unknown key `sead`; did you mean `seed`?");
    refuse(
        "{ duration: 5 s, signals: { /c: { value: 5 } } }",
        "[]",
        "10:36: there is no signal `/c`; did you mean",
    );
    refuse(
        "{ duration: 5 s, signals: { /a: { value: 5 m } } }",
        "[]",
        "10:49: this formula does not count in `degC`",
    );
    refuse("{ duration: 5 s, signals: { /a: { value: 5 + roam } } }", "[]", "10:53: ");
    refuse(
        "{ duration: 5 s, signals: { /a: { value: 5, rate: 1 GHz } } }",
        "[]",
        "10:58: these are more than",
    );
    refuse(
        "{ duration: 5 s, signals: { /a: { value: dt / (1 s) } } }",
        "[]",
        "10:49: a formula of time gives one",
    );
    refuse("{ duration: 5 s, truth: { t: 5 } }", "[]", "10:34: `t` has a meaning already");
    refuse("{ duration: 5 s, faults: [\"bias:/a\"] }", "[]", "10:35: fault 'bias:/a': bias needs an amount");
    refuse(
        "{ duration: 5 s, rows: [{ signal: /a, time: 5 s, value: x }] }",
        "[]",
        "10:64: this is no observed value",
    );
    refuse(CALM, "[{ event: fialed }]", "11:19: there is no event `fialed`; did you mean `failed`?");
    refuse(
        CALM,
        "[{ verdict: fine, signal: /a, at: 5 s }]",
        "11:21: there is no verdict `fine`; known here: unknown,",
    );
    refuse(CALM, "[{ verdict: failed, signal: /a, at: 50 s }]", "11:45: the story is over by then");
    refuse(CALM, "[{ need: room }]", "11:10: nothing is expected of these values");
    refuse(
        CALM,
        "[{ need: room, largest_error: 1 m, truth: room }]",
        "11:39: `1 m` does not count in `degC`",
    );
    refuse(CALM, "[{ need: room, largest_error: 1 }]", "11:39: an error is a distance from a truth");
    refuse(CALM, "[5]", "11:10: expected an expectation, found one value");
    refuse(CALM, "5", "11:9: expected a list of expectations");
}

#[test]
fn problems_of_a_separate_model_name_its_file() {
    let text = "story: s\nwhy: w\nmodel: nowhere.yaml\ntrace: { duration: 1 s }\nexpect: []\n";
    let loaded = load(text, "s.yaml", Path::new("/no/folder"));
    assert!(loaded.story.is_none());
    let first = &loaded.report.diagnostics[0];
    assert!(first.file.ends_with("nowhere.yaml") && first.message.starts_with("cannot read the model"));
}

#[test]
fn problems_of_a_model_are_reported_with_their_line_in_the_story() {
    let text =
        MODEL.replace("variable: room, unit: degC, rate: 1 Hz", "variable: roam, unit: degC, rate: 1 Hz");
    let loaded = load(&format!("{text}trace: {{ duration: 1 s }}\nexpect: []\n"), "s.yaml", Path::new("."));
    let first = &loaded.report.diagnostics[0];
    assert_eq!((first.file.as_str(), first.line), ("s.yaml", 8));
    assert_eq!(first.help.as_deref(), Some("did you mean `room`?"));
}
