//! Fusions in the loop: every method by one word, any order within a moment, without allocating.

use shsa_core::engine::{Engine, Input, Options, Output, Publication, PublishedValue, Ticks};
use shsa_core::knowledge::{FusionMethod, KnowledgeBase};
use shsa_core::observation::{Observation, RawValue};
use shsa_core::time::{Span, Time};
use shsa_model::load;

const TANK: &str = "
shsa: 1
variables: { level: { unit: m } }
signals:
  /float: { variable: level, rate: 10 Hz, value_error: 0.1 }
  /sonar: { variable: level, rate: 10 Hz, value_error: 0.2 }
  /radar: { variable: level, rate: 10 Hz, value_error: 0.15 }
fusion:
  tank:
    method: METHOD
    states: { level: { initial: 2, spread: 2, noise: 0.05 } }
    inputs: { level: level }
    outputs: { fused/level: { value: level, properties: { accuracy: 1 } } }
    particles: 300
needs: { level: { signal: /tank/level, max_age: 1 s } }
";

fn knowledge(method: &str) -> KnowledgeBase {
    let loaded = load(&TANK.replace("METHOD", method), "tank.yaml");
    assert!(loaded.report.ok(), "{}", loaded.report.render(false));
    loaded.knowledge
}

/// Evenly between -1 and 1, the same each time.
fn scatter(number: i64) -> f64 {
    let mixed = (number as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    (mixed ^ mixed >> 29).wrapping_mul(0xBF58_476D_1CE4_E5B9) as f64 / u64::MAX as f64 * 2.0 - 1.0
}

const TRUTH: f64 = 3.0;
const STEP: Span = Span(100_000_000);

/// What three sensors say at one moment.
fn moment(knowledge: &KnowledgeBase, number: i64) -> Vec<Observation> {
    let at = Time(0) + STEP.times(number);
    let observed = |(place, name, error): (i64, &str, f64)| Observation {
        signal: knowledge.signal(name).unwrap(),
        stamp: at,
        received: at,
        value: RawValue::Number(TRUTH + error * scatter(3 * number + place)),
    };
    [(0, "/float", 0.09), (1, "/sonar", 0.18), (2, "/radar", 0.14)].map(observed).to_vec()
}

fn engine(knowledge: &KnowledgeBase) -> Engine {
    shsa_estimate::node::engine(knowledge.clone(), Options::default())
}

fn feed(engine: &mut Engine, observations: Vec<Observation>) {
    for observation in observations {
        engine.pass(Ticks::before(observation.received));
        engine.handle(Input::Observation(observation));
    }
}

/// What has been published, after each moment in an order that `order` makes of it.
fn published(method: &str, order: impl Fn(&mut Vec<Observation>)) -> Vec<Publication> {
    let knowledge = knowledge(method);
    let (mut engine, mut all) = (engine(&knowledge), Vec::new());
    for number in 0..100 {
        let mut observations = moment(&knowledge, number);
        order(&mut observations);
        feed(&mut engine, observations);
        all.extend(std::iter::from_fn(|| engine.poll()).filter_map(|output| match output {
            Output::Publication(publication) => Some(publication),
            _ => None,
        }));
    }
    all
}

#[test]
fn every_method_serves_a_need_by_its_word() {
    for (word, _) in FusionMethod::NAMES {
        let all = published(word, |_| ());
        assert!(all.len() > 90, "{word}: {}", all.len());
        let values = all.iter().skip(20).map(|publication| match publication.value {
            PublishedValue::Scalar(value) => value,
            PublishedValue::Vector(_) => panic!("a level is a number"),
        });
        let wrong = values.clone().map(|value| (value.midpoint() - TRUTH).abs()).fold(0.0, f64::max);
        // The middle of a fault-tolerant interval moves by as much as the inputs' own intervals allow.
        let limit = if matches!(word, "marzullo" | "schmid" | "brooks_iyengar") { 0.3 } else { 0.12 };
        assert!(wrong < limit, "{word} is {wrong} m off");
        let missed = values.filter(|value| !value.contains(TRUTH)).count();
        assert!(missed <= 4, "{word}: the truth lies outside of {missed} of 80 intervals");
    }
}

#[test]
fn the_order_within_a_moment_does_not_matter() {
    for (word, _) in FusionMethod::NAMES {
        let straight = published(word, |_| ());
        assert_eq!(straight, published(word, |all| all.reverse()), "{word}");
        assert_eq!(straight, published(word, |all| all.rotate_left(1)), "{word}");
    }
}

#[test]
fn nothing_is_allocated_for_an_observation() {
    let knowledge = knowledge("kalman");
    let mut engine = engine(&knowledge);
    for number in 0..200 {
        feed(&mut engine, moment(&knowledge, number));
        while engine.poll().is_some() {}
    }
    let prepared: Vec<Observation> = (200..400).flat_map(|number| moment(&knowledge, number)).collect();
    let counted = allocation_counter::measure(|| {
        for observation in prepared {
            engine.pass(Ticks::before(observation.received));
            engine.handle(Input::Observation(observation));
            while engine.poll().is_some() {}
        }
    });
    assert_eq!(counted.count_total, 0);
}

/// The clock of one sensor is set by an hour, forth and back: the other sensors continue, and the sensor is used again when its
/// clock is right.
#[test]
fn a_clock_that_jumps_stops_nothing() {
    let hour = Span(3_600_000_000_000);
    let knowledge = knowledge("kalman");
    let mut engine = engine(&knowledge);
    let radar = knowledge.signal("/radar").unwrap();
    let (mut published, mut last) = (0, Time(0));
    for number in 0..600 {
        let mut observations = moment(&knowledge, number);
        for observation in observations.iter_mut().filter(|it| it.signal == radar) {
            match number {
                100..150 => observation.stamp = observation.stamp + hour,
                200..250 => observation.stamp = observation.stamp - hour,
                _ => {}
            }
        }
        feed(&mut engine, observations);
        while let Some(output) = engine.poll() {
            let Output::Publication(Publication { time, value: PublishedValue::Scalar(value), .. }) = output
            else {
                continue;
            };
            assert!((value.midpoint() - TRUTH).abs() < 0.12 || number < 20, "{value:?} at {number}");
            assert!(time - last < Span(400_000_000), "a gap before {number}");
            (published, last) = (published + 1, time);
        }
    }
    assert!(published > 550, "{published}");
    let measured = engine.measurements(0, 2);
    assert!(measured.used > 300 && measured.restarts == 0, "{measured:?}");
}

/// A stamp seconds ahead of its reception does not advance the time: the values of the other sensors still count.
#[test]
fn a_stamp_in_the_future_makes_nothing_else_too_late() {
    let knowledge = knowledge("kalman");
    let radar = knowledge.signal("/radar").unwrap();
    for ahead in [Span(700_000_000), Span(9_000_000_000)] {
        let mut engine = engine(&knowledge);
        for number in 0..100 {
            let mut observations = moment(&knowledge, number);
            // The very first one, too.
            for observation in observations.iter_mut().filter(|it| it.signal == radar && number % 50 == 0) {
                observation.stamp = observation.stamp + ahead;
            }
            observations.reverse();
            feed(&mut engine, observations);
        }
        let measured = [0, 1, 2].map(|input| engine.measurements(0, input));
        assert!(measured.iter().all(|it| it.too_late == 0 && it.restarts == 0), "{measured:?}");
        // Once the usual delay is known, the engine refuses a stamp that is far ahead before the fusion does.
        let refused = measured[2].ahead + measured[2].rejected;
        assert_eq!((measured[0].used, measured[1].used, refused), (100, 100, 2), "{measured:?}");
    }
}

/// When the clocks of all sensors run ahead, the fusion follows them.
#[test]
fn clocks_that_all_run_ahead_are_followed() {
    let knowledge = knowledge("kalman");
    let mut engine = engine(&knowledge);
    for number in 0..100 {
        let mut observations = moment(&knowledge, number);
        observations.iter_mut().for_each(|it| it.stamp = it.stamp + Span(3_000_000_000));
        feed(&mut engine, observations);
    }
    let measured = engine.measurements(0, 0);
    assert!(measured.used > 90 && measured.ahead < 6 && measured.restarts == 1, "{measured:?}");
}

const COURSE: &str = "
shsa: 1
variables: { heading: { unit: deg, wraps: 360 deg } }
signals:
  /compass: { variable: heading, rate: 10 Hz, noise: 1 }
  /stars: { variable: heading, rate: 10 Hz, noise: 1 }
fusion:
  course:
    method: METHOD
    states: { heading: { spread: 180, noise: 60 } }
    inputs: { heading: heading }
    outputs: { fused/heading: heading }
    period: 500 ms
    unknown_after: 30 s
    particles: 300
needs: { heading: { signal: /rover/heading, max_age: 1 s } }
";

/// The widest published heading, in turns, and when the last one was published: both sensors speak for 2 s, and never again.
fn widest(method: &str) -> (f64, Time) {
    let loaded = load(&COURSE.replace("METHOD", method), "course.yaml");
    let (mut engine, mut widest, mut last) = (engine(&loaded.knowledge), 0.0_f64, Time(0));
    for number in 0..300 {
        let at = Time(0) + STEP.times(number);
        for name in ["/compass", "/stars"].into_iter().filter(|_| number < 20) {
            let signal = loaded.knowledge.signal(name).unwrap();
            let value = RawValue::Number(350.0 + number as f64);
            feed(&mut engine, vec![Observation { signal, stamp: at, received: at, value }]);
        }
        engine.pass(Ticks::before(at));
        for output in std::iter::from_fn(|| engine.poll()) {
            if let Output::Publication(Publication { value: PublishedValue::Scalar(value), time, .. }) =
                output
            {
                widest = widest.max(value.width() / std::f64::consts::TAU);
                last = time;
            }
        }
    }
    (widest, last)
}

#[test]
fn what_may_be_anywhere_on_the_circle_is_not_reported() {
    for method in
        ["marzullo", "schmid", "brooks_iyengar", "confidence", "kalman", "unscented_kalman", "student"]
    {
        let (widest, last) = widest(method);
        assert!(widest > 0.3 && widest < 1.0, "{method}: {widest} turns");
        assert!(Time(2_000_000_000) < last && last < Time(20_000_000_000), "{method}: {last:?}");
    }
}
