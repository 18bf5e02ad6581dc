//! Fusions when measurements are late, missing or out of order: what they say is the same, and true.

use proptest::prelude::*;
use shsa_core::engine::{Fuse, FusionInput};
use shsa_core::knowledge::{FusionMethod, KnowledgeBase};
use shsa_core::observation::{Observation, RawValue};
use shsa_core::time::{Span, Time};
use shsa_estimate::node::Nodes;
use shsa_model::load;
use std::collections::BTreeMap;

/// Three sensors at different rates, some of whose stamps coincide.
const TANK: &str = "
shsa: 1
variables: { level: { unit: m } }
signals:
  /float: { variable: level, rate: 10 Hz, ERROR }
  /sonar: { variable: level, rate: 5 Hz, ERROR }
  /radar: { variable: level, rate: 4 Hz, ERROR }
fusion:
  tank:
    method: METHOD
    states: { level: { initial: 2, spread: 2, noise: 0.05 } }
    inputs: { level: { measures: level, NOISE } }
    outputs: { fused/level: { value: level, confidence: 95 % } }
    horizon: 2 s
    particles: 200
needs: { level: { max_age: 1 s } }
";
const SENSORS: [(&str, i64); 3] = [("/float", 100), ("/sonar", 200), ("/radar", 250)];
/// The standard deviation of the level's change in a second.
const WALK: f64 = 0.05;
/// The probability that an interval holds the truth.
const CONFIDENCE: f64 = 0.95;
/// Half the width of a normal interval of that probability, in standard deviations.
const REACH: f64 = 1.96;

fn knowledge(method: &str, error: &str) -> KnowledgeBase {
    made(method, error, "")
}

/// The model with a noise of its own for all inputs.
fn made(method: &str, error: &str, noise: &str) -> KnowledgeBase {
    let text = TANK.replace("METHOD", method).replace("ERROR", error).replace("NOISE", noise);
    let loaded = load(&text, "tank.yaml");
    assert!(loaded.report.ok(), "{}", loaded.report.render(false));
    loaded.knowledge
}

/// Methods that intersect intervals.
fn is_of_intervals(method: &str) -> bool {
    matches!(method, "marzullo" | "schmid" | "brooks_iyengar")
}

fn methods() -> impl Iterator<Item = &'static str> {
    FusionMethod::NAMES.into_iter().map(|(word, _)| word)
}

/// Gives a measurement received `now`, and returns the outputs, by the moment that they are of.
fn give(
    nodes: &mut Nodes,
    knowledge: &KnowledgeBase,
    (sensor, stamp, value): Arrival,
    now: Time,
) -> Vec<(Time, f64, f64)> {
    let signal = knowledge.signal(SENSORS[sensor].0).unwrap();
    let observation = Observation { signal, stamp, received: now, value: RawValue::Number(value) };
    let input =
        FusionInput { observation: &observation, is_kept: true, is_repeated: false, is_trusted: true };
    nodes.observe(input, now);
    nodes.settle(now);
    let fused = knowledge.signal("fused/level").unwrap();
    let outputs = std::iter::from_fn(|| nodes.poll()).filter(|it| it.signal == fused);
    outputs
        .map(|it| match it.value {
            RawValue::Interval { lo, hi } => (it.stamp, lo, hi),
            _ => panic!("an output is an interval"),
        })
        .collect()
}

/// A sensor, its stamp, its value.
type Arrival = (usize, Time, f64);

/// The last output, after all arrivals in an order and one more of a later moment; `None` where the values are of too few sensors.
fn last(knowledge: &KnowledgeBase, arrivals: &[Arrival]) -> Option<(f64, f64)> {
    let (mut nodes, end) = (Nodes::new(knowledge), Time(0) + Span::from_millis(2_000));
    for arrival in arrivals {
        give(&mut nodes, knowledge, *arrival, end);
    }
    give(&mut nodes, knowledge, (0, end, 3.0), end).last().map(|(_, lo, hi)| (*lo, *hi))
}

/// All measurements of 1.5 s, with some missing: sorted and shuffled.
fn arrivals() -> impl Strategy<Value = (Vec<Arrival>, Vec<Arrival>)> {
    let all: Vec<(usize, Time)> = SENSORS
        .into_iter()
        .enumerate()
        .flat_map(|(sensor, (_, period))| {
            (1..=1_500 / period).map(move |place| (sensor, Time(0) + Span::from_millis(500 + place * period)))
        })
        .collect();
    prop::collection::vec((-0.2..0.2_f64, prop::bool::weighted(0.8)), all.len()).prop_flat_map(move |drawn| {
        let here = all.iter().zip(drawn).filter(|(_, (_, is_there))| *is_there);
        let mut here: Vec<Arrival> =
            here.map(|((sensor, stamp), (error, _))| (*sensor, *stamp, 3.0 + error)).collect();
        here.sort_by_key(|(sensor, stamp, _)| (*stamp, *sensor));
        here.retain(|(_, stamp, _)| *stamp < Time(0) + Span::from_millis(2_000));
        (Just(here.clone()), Just(here).prop_shuffle())
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    /// Whatever the order of arrival within the horizon, the first measurement included, every method gives the same bits.
    #[test]
    fn the_order_of_arrival_does_not_matter((sorted, shuffled) in arrivals()) {
        for method in methods() {
            let knowledge = knowledge(method, "noise: 0.1");
            prop_assert_eq!(last(&knowledge, &sorted), last(&knowledge, &shuffled), "{}", method);
        }
    }

    /// The same where the noise depends on the state: it is that of the measurement's own time.
    #[test]
    fn neither_where_the_noise_is_a_formula((sorted, shuffled) in arrivals()) {
        for method in methods() {
            let knowledge = made(method, "value_error: 0.2", "noise: 0.02 m + 3 % * abs(level)");
            prop_assert_eq!(last(&knowledge, &sorted), last(&knowledge, &shuffled), "{}", method);
        }
    }

    /// A stamp that is 1 us off, also one of several at the same moment, so that their order is another one, moves the result of every
    /// method by less than a thousandth of its deviation.
    #[test]
    fn a_stamp_a_microsecond_off_moves_next_to_nothing((sorted, shuffled) in arrivals(), at in 0_usize..26, is_late: bool) {
        prop_assume!(!sorted.is_empty());
        let shift = Span(if is_late { 1_000 } else { -1_000 });
        let (sensor, stamp, _) = sorted[at % sorted.len()];
        let mut moved = shuffled;
        moved.iter_mut().filter(|it| (it.0, it.1) == (sensor, stamp)).for_each(|it| it.1 = stamp + shift);
        for method in methods() {
            let knowledge = knowledge(method, "noise: 0.1");
            let (estimate, other) = (last(&knowledge, &sorted), last(&knowledge, &moved));
            prop_assert_eq!(estimate.is_some(), other.is_some(), "{}", method);
            let (Some((lo, hi)), Some((other_lo, other_hi))) = (estimate, other) else { continue };
            let far = (lo - other_lo).abs().max((hi - other_hi).abs());
            prop_assert!(far < (hi - lo) / (2.0 * REACH) / 1000.0, "{method}: {far} of {}", hi - lo);
        }
    }
}

/// A number of a counted stream between 0 and 1.
struct Stream(u64);

impl Stream {
    fn share(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.0 ^ self.0 >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((mixed ^ mixed >> 31) >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        let (one, other) = (1.0 - self.share(), self.share());
        (-2.0 * one.ln()).sqrt() * (std::f64::consts::TAU * other).cos()
    }
}

/// What arrives of a run of 16 s, by the time of reception.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Lost {
    /// Everything arrives in time.
    Nothing,
    /// The fastest sensor is silent for 4 s.
    One,
    /// All sensors are silent for 1.5 s.
    All,
    /// The slowest sensor is 350 ms late.
    Late,
}

impl Lost {
    /// When a measurement arrives; `None` for one that does not.
    fn received(self, sensor: usize, ms: i64) -> Option<i64> {
        match self {
            Lost::One if sensor == 0 && (5_000..9_000).contains(&ms) => None,
            Lost::All if (6_000..7_500).contains(&ms) => None,
            Lost::Late if sensor == 2 => Some(ms + 350),
            _ => Some(ms),
        }
    }
}

/// The number of outputs, and of those that hold the truth, of a run with this seed: the level walks as the model says.
fn held(knowledge: &KnowledgeBase, is_uniform: bool, lost: Lost, seed: u64) -> (u32, u32) {
    const TICK: i64 = 50;
    let mut random = Stream(seed.wrapping_mul(0x5851_F42D_4C95_7F2D));
    let mut truth = vec![2.0 + 2.0 * random.normal()];
    let mut arrivals: BTreeMap<i64, Vec<Arrival>> = BTreeMap::new();
    for tick in 1..=16_000 / TICK {
        let ms = tick * TICK;
        let level = truth[tick as usize - 1] + WALK * (TICK as f64 / 1000.0).sqrt() * random.normal();
        truth.push(level);
        for (sensor, _) in SENSORS.into_iter().enumerate().filter(|(_, (_, period))| ms % period == 0) {
            let error = if is_uniform { 0.2 * (2.0 * random.share() - 1.0) } else { 0.1 * random.normal() };
            if let Some(received) = lost.received(sensor, ms) {
                let at = Time(0) + Span::from_millis(ms);
                arrivals.entry(received).or_default().push((sensor, at, level + error));
            }
        }
    }
    let (mut nodes, mut count, mut holds) = (Nodes::new(knowledge), 0, 0);
    for (received, together) in arrivals {
        let now = Time(0) + Span::from_millis(received);
        for (at, lo, hi) in together.into_iter().flat_map(|it| give(&mut nodes, knowledge, it, now)) {
            let level = truth[(at.0 / 1_000_000 / TICK) as usize];
            (count, holds) = (count + 1, holds + u32::from(lo <= level && level <= hi));
        }
    }
    (count, holds)
}

/// The share of outputs that hold the truth, over many runs.
fn share(method: &str, error: &str, lost: Lost) -> f64 {
    let knowledge = knowledge(method, error);
    let runs = (1..=12).map(|seed| held(&knowledge, error.starts_with("value_error"), lost, seed));
    let (count, holds) = runs.fold((0, 0), |sum, own| (sum.0 + own.0, sum.1 + own.1));
    assert!(count > 12 * 100, "{method}: {count} outputs");
    f64::from(holds) / f64::from(count)
}

/// Intervals of interval fusion hold it surely, and those of others of errors within bounds; of noise, at their confidence, within
/// what 12 runs show; robust filters and particles, which are not exact for normal noise, in 90 % instead of 95 %.
#[test]
fn intervals_hold_the_truth_at_their_confidence_also_after_drops() {
    for method in methods() {
        for lost in [Lost::Nothing, Lost::One, Lost::All, Lost::Late] {
            for error in ["noise: 0.1", "value_error: 0.2"] {
                let share = share(method, error, lost);
                let is_bound = error.starts_with("value_error");
                let least = match method {
                    "average" | "median" | "confidence" | "kalman" if is_bound => 1.0 - f64::EPSILON,
                    _ if is_of_intervals(method) => 0.995,
                    "huber" | "student" | "particle" => 0.9,
                    _ => CONFIDENCE - 0.03,
                };
                assert!(share > least, "{method}, {lost:?}, {error}: {share} hold the truth");
                let is_exact =
                    !is_bound && matches!(method, "average" | "confidence" | "kalman" | "unscented_kalman");
                assert!(
                    !is_exact || share < CONFIDENCE + 0.03,
                    "{method}, {lost:?}, {error}: {share} are too many"
                );
            }
        }
    }
}

/// The outputs of a run of 8 s of a constant level, in which the stamps of one sensor are off by a shift, and its values come later by a
/// delay; those outputs that do not hold the level.
fn shifted(knowledge: &KnowledgeBase, shifted: usize, shift: i64, delay: i64) -> (usize, usize) {
    let mut random = Stream(1);
    let mut arrivals: BTreeMap<(i64, usize), Arrival> = BTreeMap::new();
    for (sensor, (_, period)) in SENSORS.into_iter().enumerate() {
        let (shift, delay) = if sensor == shifted { (shift, delay) } else { (0, 0) };
        for ms in (1..=8_000 / period).map(|place| place * period) {
            let at = Time(0) + Span::from_millis(10_000 + ms + shift);
            arrivals.insert((ms + delay, sensor), (sensor, at, 2.0 + 0.2 * (2.0 * random.share() - 1.0)));
        }
    }
    let mut nodes = Nodes::new(knowledge);
    let all = arrivals.into_iter().flat_map(|((received, _), arrival)| {
        give(&mut nodes, knowledge, arrival, Time(0) + Span::from_millis(10_000 + received))
    });
    let all: Vec<(Time, f64, f64)> = all.collect();
    (all.len(), all.iter().filter(|(_, lo, hi)| !(*lo <= 2.0 && 2.0 <= *hi)).count())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Where the stamps of one sensor are behind or ahead of those of the others, or its values come late, every method that intersects
    /// intervals gives about as many outputs as the slowest sensor has values, and each holds the truth.
    #[test]
    fn an_input_at_other_times_costs_no_outputs(sensor in 0_usize..3, shift in -1_500_i64..1_500, delay in 0_i64..1_500) {
        for method in methods().filter(|method| is_of_intervals(method)) {
            let (count, wrong) = shifted(&knowledge(method, "value_error: 0.2"), sensor, shift, delay);
            // The slowest has 32 values; at first and at last some have no others beside them.
            prop_assert!(count >= 32 - 14, "{method}: {count} outputs");
            prop_assert_eq!(wrong, 0, "{}", method);
        }
    }
}
