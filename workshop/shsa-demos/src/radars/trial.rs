//! A trial: traffic under four radars, one of which is faulty from half-way on, with the engine or without, measured against the truth.

use super::MODEL;
use super::border::{Border, Counts, Seen};
use super::faults::Fault;
use super::radar::Track;
use super::road::{Road, STEP};
use super::score::Score;
use shsa_core::engine::{Options, Publication};
use shsa_core::knowledge::{NeedId, SignalId};
use shsa_core::observation::RawValue;
use shsa_core::time::{Span, Time};
use shsa_demo::DemoError;
use shsa_demo::{Happening, Provision};
use shsa_demo::{Healed, Healer, middle, scalar};
use std::collections::{BTreeMap, VecDeque};

/// A position that is older is not known.
const FRESH: Span = Span::from_millis(500);
/// For how long what was true is remembered.
const MEMORY: usize = 40;

/// A trial. The same arguments give the same trial.
///
/// # Example
/// ```
/// use shsa_demo::Provision;
/// use shsa_demos::radars::{Fault, Trial};
///
/// let mut trial = Trial::new(1, Fault::Blind, Provision::Healed, 120)?;
/// while !trial.is_over() {
///     trial.step();
/// }
/// assert!(trial.finish().is_good(Fault::Blind));
/// # Ok::<(), shsa_demo::DemoError>(())
/// ```
pub struct Trial {
    step: u64,
    steps: u64,
    fault: Fault,
    road: Road,
    borders: Vec<Place>,
    healer: Option<Healer>,
    score: Score,
}

/// A border with its signals.
struct Place {
    border: Border,
    signals: BTreeMap<&'static str, SignalId>,
    need: Option<NeedId>,
    /// What was true of the vehicle at the border, and when.
    truth: VecDeque<(Time, f64)>,
    known: Time,
}

impl Place {
    fn new(radar: usize, border: Border, healer: Option<&Healer>) -> Place {
        let name = |what: &str| match what.split_once('/') {
            Some(("vehicles", what)) => format!("/vehicles/{}/{what}", radar + 1),
            Some(("entering", _)) => format!("/radar/{}/{what}", radar + 2),
            _ => format!("/radar/{}/{what}", radar + 1),
        };
        let id = |what: &'static str| {
            let mut sources = healer?.sources();
            sources.find(|(_, source)| *source == name(what)).map(|(id, _)| (what, id))
        };
        let variable = format!("x_{}", radar + 1);
        Place {
            border,
            signals: SAID.into_iter().filter_map(id).collect(),
            need: healer
                .and_then(|healer| healer.needs().find(|(_, name)| *name == variable).map(|(id, _)| id)),
            truth: VecDeque::new(),
            known: Time(0),
        }
    }
}

/// What a border says: position and count by the radar that is left, by the radar that is entered, and by the vehicles.
const SAID: [&str; 8] = [
    "leaving/x",
    "leaving/y",
    "leaving/count",
    "entering/x",
    "entering/y",
    "entering/count",
    "vehicles/x",
    "vehicles/count",
];

/// The values of all that a border says, in the order of [`SAID`].
fn said(seen: Seen, counts: Counts) -> [Option<f64>; 8] {
    let x = |track: Option<Track>| track.map(|track| track.x);
    let y = |track: Option<Track>| track.map(|track| track.y);
    [
        x(seen.left),
        y(seen.left),
        Some(counts.left),
        x(seen.entered),
        y(seen.entered),
        Some(counts.entered),
        x(seen.told),
        Some(counts.told),
    ]
}

impl Trial {
    /// How long a whole trial takes, in seconds.
    pub const END_S: u64 = 300;

    /// A trial of some seconds, with traffic and noise of its own for each seed.
    ///
    /// # Errors
    /// [`DemoError::Model`] when the model has errors, which tests exclude.
    pub fn new(seed: u64, fault: Fault, provision: Provision, seconds: u64) -> Result<Trial, DemoError> {
        let healer = match provision {
            Provision::Healed => Some(Healer::new(MODEL, "models/radars.yaml", Options::default())?),
            Provision::SensorsAlone => None,
        };
        let borders = Border::all()?.into_iter().enumerate();
        Ok(Trial {
            step: 0,
            steps: seconds * 1_000_000_000 / STEP.0 as u64,
            fault,
            road: Road::new(seed),
            borders: borders.map(|(radar, border)| Place::new(radar, border, healer.as_ref())).collect(),
            healer,
            score: Score::default(),
        })
    }

    /// Whether the trial is over.
    #[must_use]
    pub fn is_over(&self) -> bool {
        self.step >= self.steps
    }

    /// The time since the beginning.
    #[must_use]
    pub fn now(&self) -> Time {
        Time(self.step as i64 * STEP.0)
    }

    /// Goes on by 50 ms; returns what has happened.
    pub fn step(&mut self) -> Vec<Happening<Fault>> {
        self.step += 1;
        let mut happened = Vec::new();
        if self.step == self.steps / 2 {
            self.score.fault = Some((self.fault, self.now()));
            self.road.set_fault(self.fault);
            happened.push(Happening::FaultBegins(self.fault));
        }
        self.road.step();
        for border in 0..self.borders.len() {
            if self.road.is_scanning(border + 1) {
                self.hand_over(border);
            }
        }
        happened.extend(self.heal());
        self.watch();
        happened
    }

    /// Ends the trial.
    #[must_use]
    pub fn finish(self) -> Score {
        self.score
    }

    fn hand_over(&mut self, index: usize) {
        let now = self.now();
        let told: Vec<Track> = self.road.told().collect();
        let [left, entered] = [index, index + 1].map(|radar| self.road.tracks(radar));
        let Some(border) = self.borders.get_mut(index) else { return };
        let (seen, counts) = border.border.take(left, entered, &told, now.seconds());
        if let Some((one, other)) = seen.left.zip(seen.entered) {
            self.score.pairs += 1;
            self.score.wrong_pairs += u32::from(one.of != other.of);
        }
        if let Some(vehicle) = self.road.vehicle(seen.of()) {
            border.truth.push_back((now, vehicle.x));
        }
        if border.truth.len() > MEMORY {
            border.truth.pop_front();
        }
        match &mut self.healer {
            Some(healer) => {
                for (what, value) in SAID.iter().zip(said(seen, counts)) {
                    if let (Some(&signal), Some(value)) = (border.signals.get(what), value) {
                        healer.observe(signal, now, now, RawValue::Number(value));
                    }
                }
            }
            None => {
                if let Some(track) = seen.left {
                    self.positioned(index, now, track.x);
                }
            }
        }
    }

    fn heal(&mut self) -> Vec<Happening<Fault>> {
        let now = self.now();
        let Some(healer) = &mut self.healer else { return Vec::new() };
        healer.pass(now);
        let healed: Vec<Healed> = std::iter::from_fn(|| healer.poll()).collect();
        let mut happened = Vec::new();
        for healed in healed {
            match healed {
                Healed::Value(publication) => self.published(&publication),
                Healed::Decision(decision) => {
                    self.score.decided(&decision);
                    happened.push(Happening::Decided(decision));
                }
            }
        }
        happened
    }

    fn published(&mut self, publication: &Publication) {
        let border = self.borders.iter().position(|border| border.need == Some(publication.need));
        if let (Some(border), Some(value)) = (border, scalar(&publication.value)) {
            self.positioned(border, middle(publication.validity), value.midpoint());
        }
    }

    /// The position at a border is known.
    fn positioned(&mut self, border: usize, at: Time, x: f64) {
        let Some(border) = self.borders.get_mut(border) else { return };
        border.known = border.known.max(at);
        let truth = border.truth.iter().rev().find(|(time, _)| *time == at);
        if let Some((_, truth)) = truth.filter(|_| at >= Road::FILLED) {
            self.score.errors().erred(x - truth);
        }
    }

    /// Counts for how long positions are not known, while there is a vehicle.
    fn watch(&mut self) {
        let now = self.now();
        if now < Road::FILLED {
            return;
        }
        for border in &self.borders {
            if border.truth.back().is_some_and(|(time, _)| now - *time < STEP.times(2)) {
                self.score.errors().there(now - border.known <= FRESH, STEP.seconds());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::score::Errors;
    use super::*;

    fn score(seed: u64, fault: Fault, provision: Provision) -> Score {
        let mut trial = Trial::new(seed, fault, provision, 240).unwrap();
        while !trial.is_over() {
            trial.step();
        }
        trial.finish()
    }

    /// Twenty seeds with a fault each. The second half begins with an empty road behind the vehicles that are there.
    fn trials() -> impl Iterator<Item = (u64, Fault)> {
        (1..=20).zip(Fault::ALL.into_iter().cycle())
    }

    #[track_caller]
    fn check(seed: u64, fault: Fault) -> Option<Span> {
        let score = score(seed, fault, Provision::Healed);
        let known = |errors: &Errors| errors.unknown_s <= 0.15 * errors.there_s;
        // Of the last radar, no more can be said until a vehicle tells where it is.
        let is_soon = score.named_after.is_none_or(|after| after.seconds() < 45.0) || !fault.is_between();
        let is_right = score.before.rms_m() < 0.5
            && score.after.rms_m() < 0.6
            && known(&score.before)
            && known(&score.after);
        let is_good = score.is_good(fault) && is_soon && is_right && score.wrong_pairs * 500 < score.pairs;
        assert!(is_good, "seed {seed}: {fault:?}: {score:?}");
        score.named_after
    }

    #[test]
    fn with_shsa_the_radar_is_named_and_nobody_else_and_positions_stay_known() {
        for (seed, fault) in trials() {
            check(seed, fault);
        }
    }

    /// `SHSA_SEEDS=100` judges each fault with as many seeds.
    #[test]
    fn with_shsa_each_radar_is_named() {
        let seeds = std::env::var("SHSA_SEEDS").ok().and_then(|count| count.parse().ok()).unwrap_or(0);
        for fault in Fault::ALL {
            let named: Vec<Option<Span>> = (101..101 + seeds).map(|seed| check(seed, fault)).collect();
            let mut named_s: Vec<f64> = named.into_iter().flatten().map(Span::seconds).collect();
            named_s.sort_by(f64::total_cmp);
            let (median_s, longest_s) = (named_s.get(named_s.len() / 2), named_s.last());
            println!("{fault:?}: {} of {seeds}, {median_s:.1?}, {longest_s:.1?}", named_s.len());
        }
    }

    #[test]
    fn without_shsa_positions_are_wrong_or_unknown() {
        for (seed, fault) in trials() {
            let score = score(seed, fault, Provision::SensorsAlone);
            let errors = score.until_named;
            let is_wrong = match fault {
                Fault::Blind => errors.unknown_s > 0.2 * errors.there_s,
                Fault::Shifted | Fault::Delayed | Fault::FirstShifted => errors.rms_m() > 2.5,
                Fault::Nothing | Fault::LastBlind => true,
            };
            assert!(is_wrong, "seed {seed}: {fault:?}: {score:?}");
        }
    }
}
