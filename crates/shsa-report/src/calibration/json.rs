//! A calibration as one JSON object.

use super::Report;
use serde_json::{Value, json};
use shsa_core::knowledge::SignalId;
use shsa_core::time::Time;
use shsa_lab::calibration::{Fitted, PairFit, Parameter, Stretch, Verdicts};

impl Report<'_> {
    /// One object.
    #[must_use]
    pub fn json(&self) -> Value {
        let rhythm = |(signal, it): (SignalId, &shsa_lab::calibration::Rhythm)| {
            let value = json!({
                "count": it.count, "rate_hz": it.rate_hz, "jitter_s": it.jitter_s, "longest_gap_s": it.longest_gap_s,
                "range": it.range.map(|(lo, hi)| [lo, hi]), "fastest": it.fastest, "longest_hold_s": it.longest_hold_s,
                "frozen_after_s": it.frozen_after_s,
            });
            (self.signal(signal).to_owned(), value)
        };
        let rhythms: serde_json::Map<String, Value> =
            self.knowledge.signals().ids().zip(&self.found.rhythms).map(rhythm).collect();
        let verdicts =
            |it: Verdicts| json!({ "failed": it.failed, "suspected": it.suspected, "silent": it.silent });
        json!({
            "split_s": self.split.seconds(),
            "duration_s": self.duration.seconds(),
            "signals": rhythms,
            "pairs": self.found.pairs.iter().map(|pair| self.pair_json(pair)).collect::<Vec<_>>(),
            "fitted": self.found.fitted.iter().map(|fitted| self.fitted_json(fitted)).collect::<Vec<_>>(),
            "smallest_faults": self.smallest.map(|smallest| smallest.to_json(self.knowledge)),
            "unhealthy": self.found.unhealthy.iter().map(|it| self.stretch_json(it)).collect::<Vec<_>>(),
            "before": verdicts(self.found.before),
            "after": verdicts(self.found.after),
            "promise": self.promise_json(),
            "refused": self.refusal,
        })
    }

    fn promise_json(&self) -> Value {
        let promise = self.found.promise;
        json!({
            "alarms_per_hour": promise.alarms_per_hour,
            "confidence": 0.95,
            "factor": promise.factor,
            "noise": promise.noise,
            "surrogate_hours": promise.hours,
            "surrogate_alarms": promise.alarms,
            "between_sessions": promise.between,
            "between_is_measured": promise.is_measured,
            "remaining_per_hour": promise.remaining_per_hour,
            "unseen_hours": self.found.unseen_hours,
            "unseen_alarms": self.found.after.alarms,
        })
    }

    fn stretch_json(&self, stretch: &Stretch) -> Value {
        let at = |time: Time| self.since(stretch, time);
        let names = |signals: &[SignalId]| signals.iter().map(|it| self.signal(*it)).collect::<Vec<_>>();
        json!({ "session": stretch.session, "from_s": at(stretch.from), "to_s": at(stretch.to), "signals": names(&stretch.signals) })
    }

    fn pair_json(&self, pair: &PairFit) -> Value {
        let in_unit = |value: f64| self.in_own_unit(pair, value);
        json!({
            "variable": self.knowledge.variables()[pair.variable].name,
            "one": self.way(&pair.one),
            "other": self.way(&pair.other),
            "compared": pair.compared.0,
            "compared_later": pair.compared.1,
            "offset": in_unit(pair.offset),
            "spread": in_unit(pair.spread),
            "unexplained": pair.unexplained.is_finite().then_some(pair.unexplained),
            "late_s": pair.late.map(|(late_s, _)| late_s),
            "holds": pair.holds,
            "given": in_unit(pair.given),
            "open_now": in_unit(pair.open.now),
            "open_then": in_unit(pair.open.then),
        })
    }

    fn fitted_json(&self, fitted: &Fitted) -> Value {
        json!({
            "name": self.name(fitted.parameter),
            "kind": match fitted.parameter { Parameter::Signal(_) => "signal", Parameter::Relation(_) => "relation" },
            "error": fitted.error,
            "offset": fitted.offset,
            "spread": fitted.spread,
            "singles": fitted.singles,
            "noise": fitted.noise,
            "delay_s": fitted.delay.seconds(),
            "smallest_bias": fitted.smallest_bias,
        })
    }
}
