//! What happens to the programs, and what each act did to the need.

use serde_json::{Value, json};
use shsa_core::time::Time;
use shsa_demos::rover::process::Part;
use shsa_format::text::table;

/// What happens, in seconds after the first value of the need.
const ACTS: [(f64, Act); 4] = [
    (5.0, Act::Kill(Part::Lidar)),
    (11.0, Act::Start(Part::Lidar)),
    (19.0, Act::Start(Part::Attacker)),
    (25.0, Act::Kill(Part::Attacker)),
];
const END_S: f64 = 29.0;
/// How long the effect of an act is watched, at least, before the next one comes earlier than planned; seconds.
const WATCHED_S: f64 = 1.5;

/// Something that happens to the programs.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Act {
    Start(Part),
    Kill(Part),
}

impl Act {
    pub(super) fn describe(self) -> &'static str {
        match self {
            Act::Kill(Part::Attacker) => "the attack ends",
            Act::Kill(_) => "the program of the lidar is killed",
            Act::Start(Part::Attacker) => "an attacker sends scans of 3 m, 100 a second",
            Act::Start(_) => "the program of the lidar is started again",
        }
    }
}

/// What one act did to the need.
struct Effect {
    act: Act,
    at: Time,
    /// The first decision after it: when, and what it says.
    decided: Option<(f64, String)>,
    /// When the need was good again after it, seconds.
    good: Option<f64>,
    /// The longest time without a value, seconds, and the largest excess of a value over the truth, metres.
    gap_s: f64,
    excess_m: f64,
}

/// The acts so far, and what is to come.
pub(super) struct Scenario {
    /// Whether an act comes as soon as the effect of the one before was seen.
    is_brisk: bool,
    began: Option<Time>,
    /// The last value of the need.
    last: Option<Time>,
    effects: Vec<Effect>,
}

impl Scenario {
    pub(super) fn new(is_brisk: bool) -> Scenario {
        Scenario { is_brisk, began: None, last: None, effects: Vec::new() }
    }

    /// The time of the first value of the need.
    pub(super) fn began(&self) -> Option<Time> {
        self.began
    }

    /// The next act, if it is due: it counts as done.
    pub(super) fn due(&mut self, now: Time) -> Option<Act> {
        let (at_s, act) = *ACTS.get(self.effects.len())?;
        let is_due = self.after(now) >= at_s || self.is_brisk && self.is_seen(now);
        is_due.then(|| {
            let (decided, good) = (None, None);
            let effect = Effect { act, at: now, decided, good, gap_s: 0.0, excess_m: 0.0 };
            self.effects.push(effect);
            act
        })
    }

    pub(super) fn is_over(&self, now: Time) -> bool {
        let is_last = self.effects.len() == ACTS.len();
        self.after(now) > END_S || is_last && self.is_brisk && self.is_seen(now)
    }

    /// Seconds since the first value.
    fn after(&self, now: Time) -> f64 {
        self.began.map_or(0.0, |began| (now - began).seconds())
    }

    /// Whether the last act has had its effect, and that for long enough.
    fn is_seen(&self, now: Time) -> bool {
        let Some(effect) = self.effects.last() else { return self.after(now) >= WATCHED_S };
        let seen = match effect.act {
            Act::Start(Part::Lidar) => effect.good,
            Act::Kill(Part::Attacker) => Some(0.0),
            _ => effect.decided.as_ref().map(|(after_s, _)| *after_s),
        };
        seen.is_some_and(|seen_s| (now - effect.at).seconds() >= seen_s + WATCHED_S)
    }

    /// Takes note of a decision.
    pub(super) fn decided(&mut self, now: Time, decision: String) {
        if let Some(effect) = self.effects.last_mut().filter(|it| it.decided.is_none()) {
            effect.decided = Some(((now - effect.at).seconds(), decision));
        }
    }

    /// Takes note that the preferred source serves the need.
    pub(super) fn is_good(&mut self, now: Time) {
        if let Some(effect) = self.effects.last_mut().filter(|it| it.decided.is_some()) {
            effect.good.get_or_insert((now - effect.at).seconds());
        }
    }

    /// Takes note of a value of the need, which is larger than the truth by `excess_m`.
    pub(super) fn served(&mut self, at: Time, excess_m: f64) {
        self.pass(at);
        if let Some(effect) = self.effects.last_mut() {
            effect.excess_m = effect.excess_m.max(excess_m);
        }
        self.last = Some(at);
        self.began.get_or_insert(at);
    }

    /// Takes note of the time without a value.
    pub(super) fn pass(&mut self, now: Time) {
        let gap_s = self.last.map_or(0.0, |last| (now - last).seconds());
        self.effects.last_mut().into_iter().for_each(|effect| effect.gap_s = effect.gap_s.max(gap_s));
    }

    /// Whether the need has a value.
    pub(super) fn is_served(&self, now: Time) -> bool {
        self.last.is_some_and(|last| (now - last).seconds() < 1.0)
    }

    /// The effects as a table.
    pub(super) fn figures(&self) -> String {
        let row = |effect: &Effect| {
            let none = || ("-".to_owned(), "-".to_owned());
            let decided = effect.decided.as_ref();
            let (after, what) =
                decided.map_or_else(none, |(after, what)| (format!("{after:.2} s"), what.clone()));
            let gap = format!("{:.2} s", effect.gap_s);
            vec![effect.act.describe().to_owned(), what, after, gap, format!("{:.2} m", effect.excess_m)]
        };
        let head =
            ["what happened", "first decision", "after", "longest time without dmin", "dmin too large by"];
        table(&head, self.effects.iter().map(row).collect())
    }

    /// The effects as JSON.
    pub(super) fn json(&self) -> Vec<Value> {
        let effect = |effect: &Effect| {
            let (after_s, decision) = effect.decided.clone().unzip();
            json!({
                "what": effect.act.describe(), "decision": decision, "after_s": after_s,
                "longest_gap_s": effect.gap_s, "too_large_m": effect.excess_m,
            })
        };
        self.effects.iter().map(effect).collect()
    }
}
