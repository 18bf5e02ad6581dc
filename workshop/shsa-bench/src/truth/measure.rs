//! Calibrates one plant and watches it; compares the smallest detected steps with those of the best possible detector.

use super::plant::{Healthy, Plant, Sensor};
use serde_json::{Value, json};
use shsa_core::engine::{self, Engine, EventKind, Input, Output, Ticks};
use shsa_core::knowledge::{Id, KnowledgeBase, SignalId, build};
use shsa_core::observation::{Observation, RawValue};
use shsa_core::time::{Span, Time};
use shsa_format::event;
use shsa_lab::calibration::{Options, Session, Verdicts, calibrate, fewest_expected};

/// How a plant is recorded for calibration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Recorded {
    /// One session of an hour.
    Hour,
    /// Four of a quarter of an hour.
    Quarters,
}

impl Recorded {
    pub(super) const ALL: [Recorded; 2] = [Recorded::Hour, Recorded::Quarters];

    pub(super) fn name(self) -> &'static str {
        match self {
            Recorded::Hour => "1 h",
            Recorded::Quarters => "4 x 15 min",
        }
    }
}

/// The results of one calibration.
#[derive(Clone, Debug)]
pub(super) struct Measured {
    pub(super) plant: u64,
    pub(super) recorded: Recorded,
    pub(super) signals: usize,
    pub(super) factor: f64,
    /// The reason why no patch would be written.
    pub(super) refused: Option<String>,
    pub(super) hours: f64,
    pub(super) verdicts: Verdicts,
    /// The event of each signal that was wrongly suspected or failed.
    pub(super) false_alarms: Vec<Value>,
    /// Whether the promise is not refuted: the lower 95 % bound of the rate does not exceed the promised rate.
    pub(super) holds: bool,
    /// For signals of a variable that other signals carry, too: the smallest detected step, divided by the smallest one that the
    /// likelihood ratio detects with as many false alarms, from few values and from many.
    pub(super) steps: Vec<(f64, f64)>,
    /// Seconds that calibration took.
    pub(super) seconds: f64,
}

/// The numbers of the watched sessions begin here; fitted sessions have smaller numbers.
const WATCHED: u64 = 1_000;
/// The engine runs this many seconds before a step.
const BEFORE_S: f64 = 900.0;
/// A step counts as detected within this many seconds.
const WITHIN_S: f64 = 120.0;
/// The longest window of a detector of lasting steps, and of one that is as quick as the engine, in values.
const LASTING: usize = 64;
const QUICK: usize = 4;
/// How many errors an accusation's report lists.
const ERRORS: usize = 40;
/// The number of moments at which a step begins, in separate runs of the session.
const ONSETS: usize = 3;

/// Calibrates a plant and watches it for `hours` sessions of an hour.
pub(super) fn measure(number: u64, recorded: Recorded, hours: u64, promised: f64) -> Option<Measured> {
    let plant = Plant::random(number);
    let draft = plant.model();
    let (count, seconds) = match recorded {
        Recorded::Hour => (1, 3600.0),
        Recorded::Quarters => (4, 900.0),
    };
    // As in `shsa calibrate`: the second half of each session is not fitted.
    let sessions: Vec<(Session, Session)> = (0..count)
        .map(|it| plant.session(it, seconds).session.split(Time::from_seconds(0.5 * seconds)))
        .collect();
    let (fitted, unseen): (Vec<Session>, Vec<Session>) = sessions.into_iter().unzip();
    let options = Options {
        alarms_per_hour: promised,
        finds_steps: false,
        seed: number,
        most_observations: 300_000,
        ..Options::default()
    };
    let began = std::time::Instant::now();
    let found = calibrate(&draft, &fitted, &unseen, &options).ok()?;
    let seconds = began.elapsed().as_secs_f64();
    let (knowledge, _) = build(&found.draft);
    let watched: Vec<Healthy> = (0..hours).map(|it| plant.session(WATCHED + it, 3600.0)).collect();
    let stretches = watched.iter().flat_map(|it| it.session.stretches()).map(Vec::as_slice);
    let verdicts = Verdicts::over(&knowledge, stretches);
    let false_alarms =
        if verdicts.alarms > 0 { false_alarms(&plant, &knowledge, &watched) } else { Vec::new() };
    let holds = fewest_expected(verdicts.alarms) / hours as f64 <= promised;
    let steps = steps(&plant, &knowledge, &watched, promised);
    Some(Measured {
        plant: number,
        recorded,
        signals: plant.sensors.len(),
        factor: found.promise.factor,
        refused: found.refusal(),
        hours: hours as f64,
        verdicts,
        false_alarms,
        holds,
        steps,
        seconds,
    })
}

/// The events against signals in healthy sessions.
fn false_alarms(plant: &Plant, knowledge: &KnowledgeBase, watched: &[Healthy]) -> Vec<Value> {
    let mut found = Vec::new();
    for (session, healthy) in watched.iter().enumerate() {
        for stretch in healthy.session.stretches() {
            let mut engine = Engine::new(knowledge.clone(), engine::Options::default());
            for observation in stretch {
                engine.pass(Ticks::before(observation.received));
                engine.handle(Input::Observation(observation.clone()));
                while let Some(output) = engine.poll() {
                    let Output::Event(event) = output else { continue };
                    if matches!(event.kind, EventKind::Suspected | EventKind::Failed) {
                        let mut fields = event::fields(knowledge, &event);
                        fields.insert("session".to_owned(), json!(session));
                        fields.insert("time".to_owned(), json!(event.time.seconds()));
                        if let Some(signal) = event.signal {
                            let sensor = plant.sensors[signal.index()];
                            fields.insert("noise".to_owned(), json!(format!("{:?}", sensor.noise)));
                            fields.insert("rate_hz".to_owned(), json!(sensor.rate_hz));
                            fields.insert(
                                "errors".to_owned(),
                                json!(last_errors(healthy, signal, event.time, sensor)),
                            );
                        }
                        found.push(Value::Object(fields));
                    }
                }
            }
        }
    }
    found
}

/// The last errors of a signal before a moment, in standard deviations of its sensor.
fn last_errors(healthy: &Healthy, signal: SignalId, until: Time, sensor: Sensor) -> Vec<f64> {
    let of_signal = healthy.errors.iter().filter(|it| it.1 == signal.index() && it.0 <= until);
    let mut errors: Vec<f64> = of_signal.rev().take(ERRORS).map(|it| it.2 / sensor.deviation).collect();
    errors.reverse();
    errors
}

/// The smallest detected steps, divided by those of the likelihood ratio: from few values and from many.
fn steps(plant: &Plant, knowledge: &KnowledgeBase, watched: &[Healthy], promised: f64) -> Vec<(f64, f64)> {
    let Some(first) = watched.first() else { return Vec::new() };
    let Some(all) = first.session.stretches().first() else { return Vec::new() };
    let rivals: Vec<Rival> = (0..plant.sensors.len()).filter_map(|signal| Rival::of(plant, signal)).collect();
    let alarms = (promised * watched.len() as f64 / rivals.len().max(1) as f64).floor() as usize;
    let of = |rival: &Rival| {
        let mut best = [QUICK, LASTING].map(|most| rival.smallest(watched, all, most, alarms));
        best.sort_by(|one, other| other.total_cmp(one));
        let [quick, lasting] = best;
        let own = smallest(knowledge, all, rival.signal, quick)?;
        Some((own / quick, own / lasting))
    };
    rivals.iter().filter_map(of).collect()
}

/// The smallest step that the engine detects in both directions and at each onset.
fn smallest(knowledge: &KnowledgeBase, all: &[Observation], signal: usize, first: f64) -> Option<f64> {
    let is_detected = |step: f64| onsets(all).all(|onset| is_detected(knowledge, all, signal, step, onset));
    bisected(first, |step| is_detected(step) && is_detected(-step))
}

/// The smallest size for which a condition holds, to a sixteenth.
fn bisected(first: f64, is_so: impl Fn(f64) -> bool) -> Option<f64> {
    let mut high = first.max(1e-12);
    let mut doublings = 0;
    while !is_so(high) {
        high *= 2.0;
        doublings += 1;
        if doublings > 10 {
            return None;
        }
    }
    let mut low = if doublings > 0 { 0.5 * high } else { 0.0 };
    for _ in 0..4 {
        let middle = 0.5 * (low + high);
        *(if is_so(middle) { &mut high } else { &mut low }) = middle;
    }
    Some(high)
}

fn onsets(all: &[Observation]) -> impl Iterator<Item = Time> {
    let lasts =
        all.first().zip(all.last()).map_or(Span::ZERO, |(first, last)| last.received - first.received);
    let first = all.first().map_or(Time::MIN, |it| it.received);
    (0..ONSETS as i64).map(move |at| first + Span(lasts.0 * (at + 1) / (ONSETS as i64 + 1)))
}

fn is_detected(
    knowledge: &KnowledgeBase,
    all: &[Observation],
    signal: usize,
    step: f64,
    onset: Time,
) -> bool {
    let within = Span::from_seconds(WITHIN_S);
    let from = all.partition_point(|it| it.received < onset - Span::from_seconds(BEFORE_S));
    let to = all.partition_point(|it| it.received < onset + within);
    let mut engine = Engine::new(knowledge.clone(), engine::Options::default());
    for observation in all.get(from..to).unwrap_or_default() {
        let mut observation = observation.clone();
        if let RawValue::Number(value) = &mut observation.value {
            let is_wrong = observation.signal.index() == signal && observation.received >= onset;
            *value += if is_wrong { step } else { 0.0 };
        }
        engine.pass(Ticks::before(observation.received));
        engine.handle(Input::Observation(observation));
        while let Some(output) = engine.poll() {
            let Output::Event(event) = output else { continue };
            let is_alarm = matches!(event.kind, EventKind::Suspected | EventKind::Failed);
            if is_alarm && event.time >= onset && event.signal == Some(SignalId::from_index(signal)) {
                return true;
            }
        }
    }
    false
}

/// The likelihood ratio of a step of one sensor when all distributions are known. It compares the sensor with the best mean of
/// the other sensors of its variable, over windows of every length up to a largest one.
struct Rival {
    signal: usize,
    deviation: f64,
    /// The other sensors, with their weights.
    others: Vec<(usize, f64)>,
}

impl Rival {
    fn of(plant: &Plant, signal: usize) -> Option<Rival> {
        let Sensor { variable, deviation, .. } = plant.sensors[signal];
        let is_other = |(at, sensor): &(usize, &Sensor)| *at != signal && sensor.variable == variable;
        let others: Vec<(usize, f64)> = (plant.sensors.iter().enumerate())
            .filter(is_other)
            .map(|(at, it)| (at, it.deviation.powi(-2)))
            .collect();
        let sum: f64 = others.iter().map(|it| it.1).sum();
        let others: Vec<(usize, f64)> = others.into_iter().map(|(at, it)| (at, it / sum)).collect();
        (!others.is_empty()).then_some(Rival { signal, deviation, others })
    }

    /// The sensor's errors minus the mean of the others' last errors.
    fn rests(&self, errors: &[(Time, usize, f64)]) -> Vec<(Time, f64)> {
        let mut last: Vec<Option<f64>> = vec![None; self.others.len()];
        let mut rests = Vec::new();
        for (time, signal, error) in errors {
            if let Some(place) = self.others.iter().position(|it| it.0 == *signal) {
                last[place] = Some(*error);
            } else if *signal == self.signal && last.iter().all(Option::is_some) {
                let others = self.others.iter().zip(&last).map(|(it, last)| it.1 * last.unwrap_or(0.0));
                rests.push((*time, error - others.sum::<f64>()));
            }
        }
        rests
    }

    /// The square root of the largest likelihood ratio over all windows of up to `most` values.
    fn largest(rests: &[(Time, f64)], most: usize) -> f64 {
        let mut sums = vec![0.0];
        for (_, rest) in rests {
            sums.push(sums.last().copied().unwrap_or(0.0) + rest);
        }
        let ends = 1..sums.len();
        let of = |end: usize| {
            let windows = (0..).map(|power| 1_usize << power).take_while(|it| *it <= most && *it <= end);
            windows
                .map(|size| (sums[end] - sums[end - size]).abs() / (size as f64).sqrt())
                .fold(0.0, f64::max)
        };
        ends.map(of).fold(0.0, f64::max)
    }

    /// The smallest step that this detector sees when its threshold gives `alarms` false alarms in the watched sessions.
    fn smallest(&self, watched: &[Healthy], all: &[Observation], most: usize, alarms: usize) -> f64 {
        let of = |it: &Healthy| Rival::largest(&self.rests(&it.errors), most);
        let mut quiet: Vec<f64> = watched.iter().map(of).collect();
        quiet.sort_by(|one, other| other.total_cmp(one));
        let threshold =
            quiet.get(alarms.min(quiet.len().saturating_sub(1))).copied().unwrap_or(f64::INFINITY);
        let rests = watched.first().map_or(Vec::new(), |it| self.rests(&it.errors));
        let sees = |step: f64| {
            onsets(all).all(|onset| {
                let from = rests.partition_point(|it| it.0 < onset);
                let to = rests.partition_point(|it| it.0 < onset + Span::from_seconds(WITHIN_S));
                let after: Vec<(Time, f64)> =
                    rests.get(from..to).unwrap_or_default().iter().map(|it| (it.0, it.1 + step)).collect();
                Rival::largest(&after, most) > threshold
            })
        };
        bisected(self.deviation, |step| sees(step) && sees(-step)).unwrap_or(f64::INFINITY)
    }
}
