//! What bounds promise: in random sound systems whose variables move as fast as they may, nobody is accused, and each value that is
//! trusted holds the truth of its moment, whatever time errors, means, delays, windows, gaps and conditions leave open.

use crate::trust::{Run, text};
use proptest::prelude::*;
use shsa_core::knowledge::{
    BodyDraft, Bounds, Draft, KnowledgeBase, NeedDraft, RelationDraft, SignalDraft, VariableDraft, build,
};

/// The time between two points of a truth, and how many there are.
const GRID_MS: i64 = 10;
const POINTS: usize = 9_000;

/// The truth of a variable at all points, and the sum of all before each.
struct Truth {
    values: Vec<f64>,
    sums: Vec<f64>,
}

impl Truth {
    fn new(values: Vec<f64>) -> Truth {
        let mut sums = vec![0.0];
        // Between two points the truth is a line.
        values.windows(2).for_each(|pair| sums.push(sums[sums.len() - 1] + 0.5 * (pair[0] + pair[1])));
        Truth { values, sums }
    }

    fn place(ms: i64) -> usize {
        (ms / GRID_MS).clamp(0, POINTS as i64 - 1) as usize
    }

    fn at(&self, ms: i64) -> f64 {
        self.values[Truth::place(ms)]
    }

    /// The integral since a time, in seconds times the variable.
    fn integral(&self, since_ms: i64, ms: i64) -> f64 {
        (self.sums[Truth::place(ms)] - self.sums[Truth::place(since_ms)]) * GRID_MS as f64 / 1e3
    }

    fn mean(&self, from_ms: i64, to_ms: i64) -> f64 {
        let seconds = (to_ms - from_ms) as f64 / 1e3;
        if seconds > 0.0 { self.integral(from_ms, to_ms) / seconds } else { self.at(to_ms) }
    }
}

/// Random numbers in [0, 1).
struct Chance(u64);

impl Chance {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / f64::from(1_u32 << 31)
    }

    fn between(&mut self, lo: f64, hi: f64) -> f64 {
        lo + (hi - lo) * self.next()
    }

    fn of<T: Copy>(&mut self, all: &[T]) -> T {
        all[(self.next() * all.len() as f64) as usize]
    }
}

/// The range of the variables that are seen.
const RANGE: (f64, f64) = (0.0, 20.0);

/// A saw with teeth of one size, or of random ones; or a sine. It moves by at most `max_rate`, within the range.
fn truth(chance: &mut Chance, max_rate: f64) -> Truth {
    let step = max_rate * GRID_MS as f64 / 1e3;
    let (kind, tooth) = (chance.of(&[0, 1, 2]), chance.between(0.2, 15.0) * 1e3 / GRID_MS as f64);
    let (mut value, mut sense, mut left) = (chance.between(RANGE.0, RANGE.1), 1.0, tooth);
    let (amplitude, phase) = (chance.between(0.5, 9.0), chance.between(0.0, 6.0));
    let next = |point: usize| {
        if kind == 2 {
            let angle = max_rate / amplitude * point as f64 * GRID_MS as f64 / 1e3 + phase;
            return 10.0 + amplitude * angle.sin();
        }
        left -= 1.0;
        if left < 0.0 {
            sense = -sense;
            left = if kind == 0 { tooth } else { chance.between(0.1, 2.0) * tooth };
        }
        if !(RANGE.0..=RANGE.1).contains(&(value + sense * step)) {
            sense = -sense;
        }
        value = (value + sense * step).clamp(RANGE.0, RANGE.1);
        value
    };
    Truth::new((0..POINTS).map(next).collect())
}

/// A level that stands, another one meanwhile, each for a while.
fn levels(chance: &mut Chance, low: f64, high: f64) -> Truth {
    let (mut values, mut is_high) = (Vec::new(), false);
    while values.len() < POINTS {
        let level = if is_high { chance.between(0.7, 1.0) * high } else { low };
        let points = chance.between(500.0, 2_000.0) as usize;
        values.extend(std::iter::repeat_n(level, points));
        is_high = !is_high;
    }
    values.truncate(POINTS);
    Truth::new(values)
}

/// A sensor; times in ms.
#[derive(Clone, Copy, Default)]
struct Sensor {
    name: &'static str,
    variable: &'static str,
    period: i64,
    phase: i64,
    error: f64,
    time_error: (i64, i64),
    mean_over: i64,
    delay: i64,
    holds: bool,
    /// When it says nothing.
    silent: (i64, i64),
}

impl Sensor {
    fn draft(&self) -> SignalDraft {
        let ms = |ms: i64| Some(text(&format!("{ms} ms")));
        SignalDraft {
            name: text(self.name),
            variable: Some(text(self.variable)),
            rate: Some(text(&format!("{} Hz", 1e3 / self.period as f64))),
            value_error: Some(Bounds::One(text(&format!("{}", self.error)))),
            time_error: Some(Bounds::Two(ms(self.time_error.0).unwrap(), ms(self.time_error.1).unwrap())),
            mean_over: ms(self.mean_over),
            delay: ms(self.delay),
            hold: self.holds.then(|| text("true")),
            timeout: self.holds.then(|| text("60 s")),
            ..SignalDraft::default()
        }
    }

    /// Its stamps, and the middles of the times of which it speaks.
    fn moments(&self, chance: &mut Chance) -> Vec<(i64, i64)> {
        let begin = self.phase + self.delay + self.mean_over + self.time_error.1.max(-self.time_error.0);
        let stamps = (0..).map(|count| begin + count * self.period);
        let stamps = stamps.take_while(|stamp| stamp + self.mean_over + 5_000 < POINTS as i64 * GRID_MS);
        let stamps = stamps.filter(|stamp| !(self.silent.0..self.silent.1).contains(stamp));
        stamps.map(|stamp| (stamp, stamp - self.delay + grid(chance, self.time_error))).collect()
    }
}

/// A random number of grid steps in ms.
fn grid(chance: &mut Chance, (lo, hi): (i64, i64)) -> i64 {
    (chance.between(lo as f64, hi as f64 + 1.0) as i64 / GRID_MS) * GRID_MS
}

fn variable(name: &str, max_rate: Option<f64>, range: Option<(f64, f64)>) -> VariableDraft {
    VariableDraft {
        name: text(name),
        max_rate: max_rate.map(|rate| text(&format!("{rate}"))),
        range: range.map(|(lo, hi)| (text(&format!("{lo}")), text(&format!("{hi}")))),
        ..VariableDraft::default()
    }
}

fn relation(equation: &str, of: &str, error: f64, condition: Option<&str>) -> RelationDraft {
    RelationDraft {
        directions: Some(vec![text(of)]),
        error: (error > 0.0).then(|| Bounds::One(text(&format!("{error}")))),
        condition: condition.map(text),
        ..RelationDraft::new(text(&format!("to_{of}")), BodyDraft::Equation(text(equation)))
    }
}

fn knowledge(
    variables: Vec<VariableDraft>,
    relations: Vec<RelationDraft>,
    sensors: &[Sensor],
    needed: &str,
) -> KnowledgeBase {
    let need = NeedDraft { variable: text(needed), max_age: Some(text("20 s")), ..NeedDraft::default() };
    let signals = sensors.iter().map(Sensor::draft).collect();
    let (knowledge, problems) =
        build(&Draft { variables, relations, signals, needs: vec![need], ..Draft::default() });
    let errors: Vec<_> = problems.iter().filter(|it| format!("{it:?}").contains("Error")).collect();
    assert!(errors.is_empty(), "{errors:?}");
    knowledge
}

/// What a sensor shows of the time from one moment to another, before its error.
type Shows<'t> = &'t dyn Fn(&Sensor, i64, i64) -> f64;

/// Runs a system; the needed variable's truth at a time in ms. Returns who was accused, and the trusted values beside the truth.
fn run(
    chance: &mut Chance,
    knowledge: KnowledgeBase,
    sensors: &[Sensor],
    shows: Shows<'_>,
    needed: &Truth,
) -> Result<(), String> {
    let mut given = Vec::new();
    for (number, sensor) in sensors.iter().enumerate() {
        for (stamp, middle) in sensor.moments(chance) {
            let half = sensor.mean_over / 2;
            let any = chance.between(-0.99, 0.99);
            let off = chance.of(&[-0.99, 0.99, any]) * sensor.error;
            given.push((stamp, number, shows(sensor, middle - half, middle + half) + off));
        }
    }
    given.sort_by_key(|(stamp, number, _)| (*stamp, *number));
    let mut run = Run::new(knowledge);
    for (stamp, number, value) in given {
        run.pass(stamp * 1_000_000);
        run.give(number, stamp * 1_000_000, stamp * 1_000_000, value);
    }
    let accused = run.accused();
    if !accused.is_empty() {
        let names: Vec<&str> =
            accused.iter().map(|id| sensors[shsa_core::knowledge::Id::index(*id)].name).collect();
        return Err(format!("accused {names:?}"));
    }
    if run.trusted().next().is_none() {
        return Err("nothing is trusted".to_owned());
    }
    for (time, value) in run.trusted() {
        let is_possible = RANGE.0 <= value.lo() && value.hi() <= RANGE.1;
        let (ms, grid) = (time.0 / 1_000_000, GRID_MS * 1_000_000);
        // Between two points of the grid, the truth is between both.
        let truths = [needed.at(ms), needed.at(ms + i64::from(time.0 % grid != 0) * GRID_MS)];
        let holds = truths.iter().any(|truth| value.widened(1e-6).contains(*truth));
        if !is_possible || !holds {
            return Err(format!("{value:?} for {truths:?} at {} s", time.seconds()));
        }
    }
    Ok(())
}

/// Some seconds in which a sensor says nothing, or none.
fn silence(chance: &mut Chance) -> (i64, i64) {
    let from = chance.between(20_000.0, 40_000.0) as i64;
    (from, from + chance.of(&[0, 0, 3_000, 12_000]))
}

const PERIODS: [i64; 5] = [100, 200, 500, 1_000, 2_000];

fn sensor(chance: &mut Chance, name: &'static str, variable: &'static str) -> Sensor {
    let period = chance.of(&PERIODS);
    let phase = grid(chance, (0, period));
    Sensor { name, variable, period, phase, error: chance.of(&[0.02, 0.1, 0.4]), ..Sensor::default() }
}

/// Sensors of one variable, one of which carries means.
fn means(seed: u64) -> Result<(), String> {
    let chance = &mut Chance(seed);
    let max_rate = chance.between(0.2, 4.0);
    let x = truth(chance, max_rate);
    let mean_over = chance.of(&[400, 1_000, 3_000, 5_000]);
    let now = Sensor { silent: silence(chance), ..sensor(chance, "now", "x") };
    let mean =
        Sensor { mean_over, delay: mean_over / 2, silent: silence(chance), ..sensor(chance, "mean", "x") };
    let other = Sensor { mean_over, delay: mean_over / 2, ..sensor(chance, "other", "x") };
    let sensors = if chance.next() < 0.5 { vec![now, mean] } else { vec![now, mean, other] };
    let knowledge = knowledge(vec![variable("x", Some(max_rate), Some(RANGE))], vec![], &sensors, "x");
    run(chance, knowledge, &sensors, &|_, from, to| x.mean(from, to), &x)
}

/// Stamps that are off, values that stand, and a relation.
fn times(seed: u64) -> Result<(), String> {
    let chance = &mut Chance(seed);
    let max_rate = chance.between(0.2, 4.0);
    let x = truth(chance, max_rate);
    let off = |chance: &mut Chance| chance.of(&[(0, 0), (-500, 500), (-2_000, 2_000), (-300, 0), (0, 1_000)]);
    let one = Sensor { time_error: off(chance), silent: silence(chance), ..sensor(chance, "one", "x") };
    let other =
        Sensor { time_error: off(chance), holds: chance.next() < 0.4, ..sensor(chance, "other", "x") };
    let twice = Sensor { time_error: off(chance), ..sensor(chance, "twice", "y") };
    let sensors = [one, other, twice];
    let rated =
        [variable("x", Some(max_rate), Some(RANGE)), variable("y", Some(2.0 * max_rate), Some((0.0, 40.0)))];
    let knowledge = knowledge(rated.to_vec(), vec![relation("x = y / 2", "x", 0.0, None)], &sensors, "x");
    let shows =
        |sensor: &Sensor, at: i64, _: i64| if sensor.variable == "y" { 2.0 * x.at(at) } else { x.at(at) };
    run(chance, knowledge, &sensors, &shows, &x)
}

/// A variable that follows another one later.
fn delays(seed: u64) -> Result<(), String> {
    let chance = &mut Chance(seed);
    let max_rate = chance.between(0.2, 4.0);
    let x = truth(chance, max_rate);
    let delay = chance.of(&[300, 1_000, 2_300, 3_700]);
    let y = Truth::new((0..POINTS).map(|point| x.at((point as i64 * GRID_MS - delay).max(0))).collect());
    let begins = Sensor { phase: 4_000, ..Sensor::default() };
    let before = Sensor { silent: silence(chance), ..sensor(chance, "before", "x") };
    let after = Sensor { phase: begins.phase, silent: silence(chance), ..sensor(chance, "after", "y") };
    let sensors = [before, after];
    let rated = ["x", "y"].map(|name| variable(name, Some(max_rate), Some(RANGE)));
    let equation = format!("y = delay(x, {delay} ms)");
    let knowledge = knowledge(rated.to_vec(), vec![relation(&equation, "y", 0.0, None)], &sensors, "y");
    let shows = |sensor: &Sensor, at: i64, _: i64| if sensor.variable == "y" { y.at(at) } else { x.at(at) };
    run(chance, knowledge, &sensors, &shows, &y)
}

/// A rate beside a level, which is compared over windows; or the level as an integral of the rate.
fn rates(seed: u64) -> Result<(), String> {
    let chance = &mut Chance(seed);
    let max_rate = chance.between(0.2, 4.0);
    let v = truth(chance, max_rate);
    let window = chance.of(&[500, 2_000, 5_000, 10_000]);
    let rate = Sensor { silent: silence(chance), ..sensor(chance, "rate", "v") };
    let level = Sensor { silent: silence(chance), ..sensor(chance, "level", "x") };
    // Some of the comparisons are of means with means.
    let smooth = chance.next() < 0.3;
    let rate = if smooth { Sensor { mean_over: window, delay: window / 2, ..rate } } else { rate };
    // Open: after a silence a derivative is over a shorter time, and a mean over all of it leaves more open than is counted.
    let level = if smooth { Sensor { silent: (0, 0), ..level } } else { level };
    let is_integral = chance.next() < 0.4 && !smooth;
    let sensors = [rate, level];
    let variables = vec![variable("v", Some(max_rate), Some(RANGE)), variable("x", None, None)];
    let relation = match is_integral {
        true => relation("x = integral(v) * 1", "x", 0.0, None),
        false => relation(&format!("v = derivative(x, {window} ms)"), "v", 0.0, None),
    };
    let knowledge = knowledge(variables, vec![relation], &sensors, "v");
    let begin = rate.phase;
    let shows = |sensor: &Sensor, from: i64, to: i64| match sensor.variable {
        "x" => v.integral(begin, to),
        _ => v.mean(from, to),
    };
    run(chance, knowledge, &sensors, &shows, &v)
}

/// A rate without a bound of its change, and a level. Of some times nothing is known of the rate: the sensor is silent, or shows 0
/// below a threshold, where a condition fails.
fn holes(seed: u64) -> Result<(), String> {
    let chance = &mut Chance(seed);
    let is_conditional = chance.next() < 0.5;
    let (low, high) = if is_conditional { (1.0, 20.0) } else { (2.0, 18.0) };
    let flow = levels(chance, low, high);
    let window = chance.of(&[20_000, 30_000]);
    let period = chance.of(&[500, 1_000]);
    let shown = Sensor { period, error: 0.1, silent: silence(chance), ..sensor(chance, "shown", "shown") };
    let total = Sensor { period, error: 0.1, ..sensor(chance, "total", "total") };
    let sensors = [shown, total];
    // A level changes between two values, and is seen up to a period late at each of three changes in a window.
    let error = 4.0 * high * period as f64 / window as f64;
    let variables = [("shown", Some(RANGE)), ("flow", Some(RANGE)), ("total", None)];
    let condition = is_conditional.then_some("shown > 2");
    let relations = vec![
        relation("flow = shown", "flow", 0.0, condition),
        RelationDraft {
            name: text("counted"),
            ..relation(&format!("flow = derivative(total, {window} ms)"), "flow", error, None)
        },
    ];
    let variables = variables.map(|(name, range)| variable(name, None, range)).to_vec();
    let knowledge = knowledge(variables, relations, &sensors, "shown");
    let shows = |sensor: &Sensor, at: i64, _: i64| match (sensor.variable, is_conditional) {
        ("total", _) => flow.integral(0, at),
        (_, true) if flow.at(at) < 2.0 => 0.0,
        _ => flow.at(at),
    };
    // Nothing is asked of the need here.
    let nowhere = Truth::new(vec![0.0; POINTS]);
    match run(chance, knowledge, &sensors, &shows, &nowhere) {
        Err(found) if found.starts_with("accused") => Err(found),
        _ => Ok(()),
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn means_are_bounded_by_the_rate_between_their_samples(seed: u64) {
        prop_assert_eq!(means(seed), Ok(()));
    }

    #[test]
    fn an_error_of_time_is_in_the_bounds(seed: u64) {
        prop_assert_eq!(times(seed), Ok(()));
    }

    #[test]
    fn a_delayed_value_is_bounded_between_samples(seed: u64) {
        prop_assert_eq!(delays(seed), Ok(()));
    }

    #[test]
    fn windows_and_integrals_hold_what_was_possible(seed: u64) {
        prop_assert_eq!(rates(seed), Ok(()));
    }

    #[test]
    fn a_window_with_a_hole_accuses_nobody(seed: u64) {
        prop_assert_eq!(holes(seed), Ok(()));
    }
}
