//! The score: the results of the run, measured against the truth, which only the simulator knows.

use super::faults::Fault;
use crate::healer::Decision;
use crate::trial::Provision;
use serde_json::{Value, json};
use shsa_core::engine::EventKind;
use shsa_core::time::{Span, Time};
use std::collections::VecDeque;
use std::fmt;

/// How long the truth is remembered for late values.
const MEMORY: Span = Span::from_millis(2_000);

/// Counts over a stretch of time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Tally {
    /// Largest difference between a published `dmin` and the truth at its time stamp, metres; `None` when none
    /// was published.
    pub(super) worst_error: Option<f64>,
    /// Longest time without a new `dmin`.
    pub(super) longest_gap: Span,
    /// How often the robot ran into something.
    pub(super) collisions: u32,
}

/// The results for one fault.
#[derive(Clone, Debug)]
pub(super) struct FaultScore {
    pub(super) fault: Fault,
    /// Until the faulty signal was called silent or failed.
    pub(super) detected_after: Option<Span>,
    /// Until the first `dmin` that no longer rests on the faulty signal, which was suspected, silent or failed before.
    pub(super) healed_after: Option<Span>,
    /// Whether the faulty signal is out of use.
    distrusted: bool,
    /// From the beginning of the fault to its end.
    pub(super) during: Tally,
    /// Largest error of `dmin` from healing to the end of the fault, metres.
    pub(super) healed_error: Option<f64>,
}

/// The results of a trial. `Display` writes them as a table with a row for each fault.
#[derive(Clone, Debug)]
pub struct Score {
    pub(super) faults: Vec<FaultScore>,
    pub(super) overall: Tally,
    /// Smallest distance between body and obstacle, metres.
    pub(super) closest: f64,
    /// Way that the robot has driven, metres.
    pub(super) driven: f64,
    /// How often the robot stopped before an obstacle.
    pub(super) stops: u32,
    /// Decisions that call a healthy signal silent or failed.
    pub(super) false_alarms: u32,
    now: Time,
    truth: VecDeque<(Time, f64)>,
    last_dmin: Option<Time>,
}

impl Score {
    pub(super) fn new(faults: &[Fault]) -> Score {
        let score = |&fault: &Fault| FaultScore {
            fault,
            detected_after: None,
            healed_after: None,
            distrusted: false,
            during: Tally::default(),
            healed_error: None,
        };
        Score {
            faults: faults.iter().map(score).collect(),
            overall: Tally::default(),
            closest: f64::INFINITY,
            driven: 0.0,
            stops: 0,
            false_alarms: 0,
            now: Time(0),
            truth: VecDeque::new(),
            last_dmin: None,
        }
    }

    /// Sets the present time, and the true `dmin` in metres.
    pub(super) fn truth(&mut self, now: Time, dmin: f64) {
        self.now = now;
        self.truth.push_back((now, dmin));
        while self.truth.front().is_some_and(|&(time, _)| now - time > MEMORY) {
            self.truth.pop_front();
        }
    }

    /// Takes in the metres driven since the last call, and the gap to the nearest obstacle in metres.
    pub(super) fn moved(&mut self, driven: f64, gap: f64) {
        self.driven += driven;
        self.closest = self.closest.min(gap);
    }

    /// Counts a collision at the present time.
    pub(super) fn collision(&mut self) {
        self.closest = self.closest.min(0.0);
        self.tally(self.now, self.now, |tally| tally.collisions += 1);
    }

    /// Takes in a published `dmin`.
    pub(super) fn published(&mut self, stamp: Time, dmin: f64) {
        self.close_gap();
        self.last_dmin = Some(self.now);
        let error = (dmin - self.truth_at(stamp)).abs();
        self.tally(self.now, self.now, |tally| tally.worst_error = worse(tally.worst_error, error));
        let now = self.now;
        for score in self.faults.iter_mut().filter(|score| score.distrusted && score.fault.is_active(now)) {
            score.healed_after.get_or_insert(now - score.fault.from);
            score.healed_error = worse(score.healed_error, error);
        }
    }

    /// Takes in a decision.
    pub(super) fn decided(&mut self, decision: &Decision) {
        let named = matches!(decision.kind, EventKind::Failed | EventKind::Silent);
        let distrusted = named || decision.kind == EventKind::Suspected;
        let about =
            |fault: &Fault| fault.is_active(decision.time) && decision.signal.as_deref() == Some(fault.topic);
        self.false_alarms += u32::from(named && !self.faults.iter().any(|score| about(&score.fault)));
        for score in self.faults.iter_mut().filter(|score| about(&score.fault)) {
            score.distrusted |= distrusted;
            if named {
                score.detected_after.get_or_insert(decision.time - score.fault.from);
            }
        }
    }

    /// Ends the run: a gap that is still open counts, too.
    pub(super) fn close_gap(&mut self) {
        let (Some(last), now) = (self.last_dmin, self.now) else { return };
        self.tally(last, now, |tally| tally.longest_gap = tally.longest_gap.max(now - last));
    }

    /// Counts for the whole run, and for every fault that was active between `from` and `to`.
    fn tally(&mut self, from: Time, to: Time, count: impl Fn(&mut Tally)) {
        count(&mut self.overall);
        for score in &mut self.faults {
            if score.fault.from <= to && from < score.fault.to {
                count(&mut score.during);
            }
        }
    }

    fn truth_at(&self, stamp: Time) -> f64 {
        let later = self.truth.partition_point(|&(time, _)| time <= stamp);
        let at = self.truth.get(later.saturating_sub(1)).or(self.truth.back());
        at.map_or(f64::NAN, |&(_, dmin)| dmin)
    }

    /// How often the robot ran into something.
    #[must_use]
    pub fn collisions(&self) -> u32 {
        self.overall.collisions
    }

    /// The results as one JSON object, for the seed and the provision of the trial: times in seconds, distances in metres, `null`
    /// for what did not happen.
    #[must_use]
    pub fn json(&self, seed: u64, provision: Provision) -> Value {
        let fault = |score: &FaultScore| {
            json!({
                "fault": score.fault.name(),
                "detected_after_s": score.detected_after.map(seconds),
                "healed_after_s": score.healed_after.map(seconds),
                "worst_error_m": score.during.worst_error.map(millimetres),
                "worst_error_after_healing_m": score.healed_error.map(millimetres),
                "longest_gap_s": seconds(score.during.longest_gap),
                "collisions": score.during.collisions,
            })
        };
        json!({
            "seed": seed,
            "with_shsa": provision == Provision::Healed,
            "duration_s": seconds(self.now - Time(0)),
            "faults": self.faults.iter().map(fault).collect::<Vec<_>>(),
            "worst_error_m": self.overall.worst_error.map(millimetres),
            "longest_gap_s": seconds(self.overall.longest_gap),
            "collisions": self.overall.collisions,
            "closest_approach_m": millimetres(self.closest),
            "driven_m": millimetres(self.driven),
            "stops": self.stops,
            "false_alarms": self.false_alarms,
        })
    }
}

impl fmt::Display for Score {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let after =
            |span: Option<Span>| span.map_or("never".to_string(), |span| format!("{:.2} s", span.seconds()));
        let row = |f: &mut fmt::Formatter<'_>, cells: [&str; 7]| {
            let [name, detected, healed, error, healed_error, gap, collisions] = cells;
            let left = format!("{name:<29}{detected:>9}{healed:>8}{error:>8}{healed_error:>8}");
            writeln!(f, "{}", format!("{left}{gap:>9}{collisions:>8}").trim_end())
        };
        row(f, ["", "detected", "healed", "worst", "error", "longest", ""])?;
        row(f, ["fault", "after", "after", "error", "healed", "gap", "crashes"])?;
        for score in &self.faults {
            let healed_error = metres(score.healed_error);
            let times = [after(score.detected_after), after(score.healed_after)];
            let [error, gap, collisions] = score.during.cells();
            row(f, [&score.fault.name(), &times[0], &times[1], &error, &healed_error, &gap, &collisions])?;
        }
        let [error, gap, collisions] = self.overall.cells();
        row(f, ["whole run", "", "", &error, "", &gap, &collisions])?;
        let way = format!("driven {:.1} m, stopped {} times", self.driven, self.stops);
        let closest = format!("never nearer than {:.2} m to an obstacle", self.closest.max(0.0));
        writeln!(f, "\n{way}, {closest}, {} false alarms", self.false_alarms)?;
        writeln!(f, "error: dmin as published against the truth of the simulator")
    }
}

impl Tally {
    fn cells(&self) -> [String; 3] {
        let gap = format!("{:.2} s", self.longest_gap.seconds());
        [metres(self.worst_error), gap, self.collisions.to_string()]
    }
}

/// Seconds, rounded to milliseconds for files.
fn seconds(span: Span) -> f64 {
    (span.seconds() * 1e3).round() / 1e3
}

/// Metres, rounded to millimetres for files.
fn millimetres(metres: f64) -> f64 {
    (metres * 1e3).round() / 1e3
}

fn worse(worst: Option<f64>, error: f64) -> Option<f64> {
    Some(worst.map_or(error, |worst| worst.max(error)))
}

fn metres(error: Option<f64>) -> String {
    error.map_or("-".to_string(), |error| format!("{error:.2} m"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(seconds: f64) -> Time {
        Time::from_seconds(seconds)
    }

    fn decision(seconds: f64, kind: EventKind, signal: &str) -> Decision {
        let signal = Some(signal.to_string());
        Decision {
            time: at(seconds),
            kind,
            signal,
            variable: None,
            because: String::new(),
            substitution: None,
        }
    }

    /// Checks when the first fault was detected and healed, and the false alarms; each decision is followed by a `dmin`.
    #[track_caller]
    fn check(decisions: &[Decision], expected: &str) {
        let mut score = Score::new(&Fault::schedule());
        for decision in decisions {
            score.decided(decision);
            score.truth(decision.time + Span::from_millis(250), 1.0);
            score.published(decision.time, 1.0);
        }
        let text = |span: Option<Span>| span.map_or("never".to_string(), |span| span.seconds().to_string());
        let [first, _] = &score.faults[..] else { panic!("there are two faults") };
        let (detected, healed) = (text(first.detected_after), text(first.healed_after));
        assert_eq!(format!("detected {detected}, healed {healed}, false {}", score.false_alarms), expected);
    }

    #[test]
    fn a_fault_is_detected_when_its_signal_is_named_and_healed_with_the_next_dmin() {
        let named = decision(12.25, EventKind::Silent, "/lidar/scan");
        check(&[named.clone(), named], "detected 0.25, healed 0.5, false 0");
    }

    #[test]
    fn a_suspicion_heals_but_names_nobody() {
        let suspicions = [
            decision(12.25, EventKind::Suspected, "/sonar/ranges"),
            decision(12.5, EventKind::Suspected, "/lidar/scan"),
        ];
        check(&suspicions, "detected never, healed 0.75, false 0");
    }

    #[test]
    fn naming_a_healthy_signal_is_a_false_alarm() {
        let early = decision(11.0, EventKind::Failed, "/lidar/scan");
        let wrong = decision(12.5, EventKind::Failed, "/sonar/ranges");
        check(&[early, wrong], "detected never, healed never, false 2");
    }

    #[test]
    fn errors_are_those_at_the_time_stamp_and_gaps_belong_to_the_fault() {
        let mut score = Score::new(&Fault::schedule());
        for (seconds, truth, published) in [(11.0, 1.0, 1.5), (11.5, 2.0, 1.0), (13.0, 3.0, 2.25)] {
            score.truth(at(seconds), truth);
            score.moved(0.25, 0.5);
            score.published(at(seconds - 0.25), published);
        }
        score.collision();
        assert_eq!(
            (score.overall.worst_error, score.overall.longest_gap),
            (Some(0.5), Span::from_millis(1_500))
        );
        assert_eq!(score.faults[0].during.worst_error, Some(0.25));
        assert_eq!(score.faults[0].during.longest_gap, Span::from_millis(1_500));
        assert_eq!((score.faults[0].during.collisions, score.closest, score.driven), (1, 0.0, 0.75));
        assert_eq!(score.faults[1].during, Tally::default());
    }
}
