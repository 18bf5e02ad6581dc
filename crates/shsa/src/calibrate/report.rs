//! A calibration for people, and as one JSON object.

use crate::show::{self, Paint, paint};
use serde_json::{Value, json};
use shsa_core::knowledge::{Bounds, Draft, KnowledgeBase, RelationId, Signal, SignalId, Text};
use shsa_core::time::{Span, Time};
use shsa_lab::calibration::{
    Calibration, Fitted, PairFit, Parameter, Stretch, Verdicts, fewest_expected, most_expected,
};
use shsa_lab::campaign::Smallest;

/// A calibration, and what it is about.
pub(super) struct Report<'a> {
    pub(super) draft: &'a Draft,
    pub(super) knowledge: &'a KnowledgeBase,
    pub(super) found: &'a Calibration,
    /// The smallest faults of each kind that are seen, when they were looked for.
    pub(super) smallest: Option<&'a Smallest>,
    /// When each session begins.
    pub(super) firsts: &'a [Time],
    pub(super) split: Span,
    pub(super) duration: Span,
    /// Why the fitted numbers are not to be used.
    pub(super) refusal: Option<&'a str>,
}

/// A number with three digits that count.
pub(super) fn number(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let below = 2 - value.abs().log10().floor() as i32;
    if (0..=9).contains(&below) {
        let text = format!("{value:.*}", below as usize);
        return if below > 0 { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text };
    }
    if below < 0 && below > -6 { format!("{value:.0}") } else { format!("{value:.2e}") }
}

fn optional(value: Option<f64>) -> String {
    value.map_or_else(|| "-".to_owned(), number)
}

/// An error as it is written.
fn bounds(bounds: Option<&Bounds>) -> String {
    match bounds {
        None => "-".to_owned(),
        Some(Bounds::One(text)) => text.text.clone(),
        Some(Bounds::Two(lo, hi)) => format!("[{}, {}]", lo.text, hi.text),
    }
}

impl Report<'_> {
    pub(super) fn signal(&self, signal: SignalId) -> &str {
        &self.knowledge.signals()[signal].name
    }

    /// The unit of a signal as it is written, with a blank before it.
    pub(super) fn unit(&self, signal: SignalId) -> String {
        let signal = &self.knowledge.signals()[signal];
        let own =
            self.draft.signals.iter().find(|it| it.name.text == signal.name).and_then(|it| it.unit.as_ref());
        let name = &self.knowledge.variables()[signal.variable].name;
        let unit = own.map(|unit| unit.text.clone()).or_else(|| self.unit_of(name));
        unit.map_or_else(String::new, |unit| format!(" {unit}"))
    }

    fn unit_of(&self, variable: &str) -> Option<String> {
        let draft = self.draft.variables.iter().find(|it| it.name.text == variable)?;
        draft.unit.as_ref().map(|unit| unit.text.clone())
    }

    /// A difference of a pair's variable from SI to its own unit.
    fn in_own_unit(&self, pair: &PairFit, value: f64) -> f64 {
        let unit = self.knowledge.variables()[pair.variable].unit.as_ref();
        unit.map_or(value, |unit| value / unit.to_si_difference(1.0))
    }

    pub(super) fn way(&self, (relations, signals): &(Vec<RelationId>, Vec<SignalId>)) -> String {
        let signals: Vec<&str> = signals.iter().map(|signal| self.signal(*signal)).collect();
        let relations: Vec<&str> =
            relations.iter().map(|relation| self.knowledge.relations()[*relation].name.as_str()).collect();
        match relations.as_slice() {
            [] => signals.join(", "),
            relations => format!("{} of {}", relations.join(", "), signals.join(", ")),
        }
    }

    pub(super) fn pair(&self, pair: &PairFit) -> String {
        format!("{} and {}", self.way(&pair.one), self.way(&pair.other))
    }

    pub(super) fn name(&self, parameter: Parameter) -> &str {
        match parameter {
            Parameter::Signal(signal) => self.signal(signal),
            Parameter::Relation(relation) => &self.knowledge.relations()[relation].name,
        }
    }

    fn error<'d>(&self, draft: &'d Draft, parameter: Parameter) -> Option<&'d Bounds> {
        let name = self.name(parameter);
        match parameter {
            Parameter::Signal(_) => {
                draft.signals.iter().find(|it| it.name.text == name)?.value_error.as_ref()
            }
            Parameter::Relation(_) => draft.relations.iter().find(|it| it.name.text == name)?.error.as_ref(),
        }
    }

    /// The value in the unit of the pair's variable, as it is shown.
    pub(super) fn amount(&self, pair: &PairFit, value: f64) -> String {
        let unit = self.unit_of(&self.knowledge.variables()[pair.variable].name);
        let shown = number(self.in_own_unit(pair, value));
        unit.map_or_else(|| shown.clone(), |unit| format!("{shown} {unit}"))
    }

    pub(super) fn to_text(&self) -> String {
        let remarks = self.remarks();
        let mut parts =
            vec![show::wrapped(&self.promised(), 0), self.rhythms(), self.pairs(), self.numbers()];
        parts.extend(self.smallest.map(|smallest| self.faults(smallest)));
        if !remarks.is_empty() {
            parts.push(remarks.iter().map(|remark| show::wrapped(remark, 0)).collect::<Vec<_>>().join("\n"));
        }
        parts.push(self.verdicts());
        parts.join("\n\n")
    }

    /// What the numbers rest on.
    pub(super) fn promised(&self) -> String {
        let promise = self.found.promise;
        let sessions = if promise.is_measured {
            format!("recordings differ by {} deviations of a signal", number(promise.between))
        } else {
            "how much recordings differ is assumed, not measured: by one deviation of a signal".to_owned()
        };
        let recordings = match self.firsts.len() {
            1 => "a recording".to_owned(),
            count => format!("{count} recordings together"),
        };
        format!(
            "Fitted to the first {} s of {recordings} of {} s, for at most {} false alarms of the whole model an hour on data not \
             seen, with 95 % confidence: every error is what is there all the time and {} deviations; {} alarms in {} surrogate \
             hours, and {sessions}.",
            number(self.split.seconds()),
            number(self.duration.seconds()),
            number(promise.alarms_per_hour),
            number(promise.factor),
            promise.alarms,
            number(promise.hours),
        )
    }

    /// What the part that was not fitted says.
    pub(super) fn tested(&self) -> String {
        let told =
            |it: Verdicts| format!("{} failed, {} suspected, {} silent", it.failed, it.suspected, it.silent);
        let (found, after) = (self.found, self.found.after);
        let wanted = found.promise.alarms_per_hour;
        let (least, most) = (fewest_expected(after.alarms), most_expected(after.alarms));
        let says = if least / found.unseen_hours > wanted {
            "not compatible with what is promised"
        } else if most / found.unseen_hours <= wanted {
            "shows what is promised"
        } else {
            "too short to show what is promised, and compatible with it"
        };
        format!(
            "in the {} h that were not fitted: {} with the fitted model, {} with the model as it is; {} alarms, {says}",
            number(found.unseen_hours),
            told(after),
            told(found.before),
            after.alarms
        )
    }

    /// What should be known besides the numbers.
    pub(super) fn remarks(&self) -> Vec<String> {
        let pairs = self.found.pairs.iter().filter_map(|pair| self.remark(pair));
        let promise = self.found.promise;
        let remaining = (promise.remaining_per_hour > 0.0).then(|| {
            format!(
                "{} alarms an hour remain however wide the errors are: of values that change too fast, of relations that are not \
                 fitted, or of limits that healthy data exceed",
                number(promise.remaining_per_hour)
            )
        });
        let followed = (promise.extrapolated > 10.0).then(|| {
            format!(
                "the factor is followed beyond the {} surrogate hours that were watched, to a rate {} times lower",
                number(promise.hours),
                number(promise.extrapolated)
            )
        });
        let noise = promise.noise.is_none().then(|| {
            "noise is not declared, as scatter and drift of healthy signals would be alarms, there or in the part that is not \
             fitted: only bounds accuse"
                .to_owned()
        });
        self.unhealthy()
            .into_iter()
            .chain(noise)
            .chain(remaining)
            .chain(followed)
            .chain(self.limits())
            .chain(pairs)
            .collect()
    }

    /// Limits of the model that healthy data exceed, and new ones.
    fn limits(&self) -> Vec<String> {
        let (old, new) = (self.draft, &self.found.draft);
        let text = |it: &Option<Text>| it.as_ref().map_or_else(|| "none".to_owned(), |it| it.text.clone());
        let signals = old.signals.iter().zip(&new.signals).filter(|(old, new)| old.timeout != new.timeout);
        let timeouts = signals.map(|(old, new)| {
            format!(
                "{}: away for longer than its time-out although all is well: {} instead of {}",
                old.name.text,
                text(&new.timeout),
                text(&old.timeout)
            )
        });
        let variables =
            old.variables.iter().zip(&new.variables).filter(|(old, new)| old.max_rate != new.max_rate);
        let rates = variables.map(|(old, new)| {
            format!(
                "{}: changes faster than its max_rate although all is well: {} instead of {}",
                old.name.text,
                text(&new.max_rate),
                text(&old.max_rate)
            )
        });
        let signals =
            old.signals.iter().zip(&new.signals).filter(|(old, new)| old.frozen_after != new.frozen_after);
        let frozen = signals.map(|(old, new)| {
            let name = &old.name.text;
            match &old.frozen_after {
                None => format!(
                    "{name}: no healthy reading is repeated for long: frozen after {}",
                    text(&new.frozen_after)
                ),
                Some(_) => format!(
                    "{name}: says the same for longer than its frozen_after although all is well: {} instead of {}",
                    text(&new.frozen_after),
                    text(&old.frozen_after)
                ),
            }
        });
        timeouts.chain(rates).chain(frozen).collect()
    }

    fn rhythms(&self) -> String {
        let row = |(signal, it): (SignalId, &shsa_lab::calibration::Rhythm)| {
            let unit = self.unit(signal);
            let range = it
                .range
                .map_or_else(|| "-".to_owned(), |(lo, hi)| format!("{} to {}{unit}", number(lo), number(hi)));
            let milliseconds =
                |seconds: Option<f64>| optional(seconds.map(|seconds| (seconds * 1e6).round() / 1e3));
            let name = self.signal(signal).to_owned();
            let fastest = it.fastest.map_or_else(|| "-".to_owned(), |it| format!("{}{unit}", number(it)));
            vec![
                name,
                it.count.to_string(),
                optional(it.rate_hz),
                milliseconds(it.jitter_s),
                milliseconds(it.longest_gap_s),
                range,
                fastest,
            ]
        };
        let head = [
            "signal",
            "observations",
            "rate (Hz)",
            "jitter (ms)",
            "longest gap (ms)",
            "range",
            "fastest a second",
        ];
        show::table(&head, self.knowledge.signals().ids().zip(&self.found.rhythms).map(row).collect())
    }

    fn pairs(&self) -> String {
        let row = |pair: &PairFit| {
            let amount = |value: f64| self.amount(pair, value);
            vec![
                self.way(&pair.one),
                self.way(&pair.other),
                pair.compared.0.to_string(),
                amount(pair.offset),
                amount(pair.spread),
                if pair.holds { "yes".to_owned() } else { "not shown".to_owned() },
                amount(pair.given),
                pair.compared.1.to_string(),
            ]
        };
        let head = ["way", "other way", "compared", "offset", "spread", "holds", "gets", "compared later"];
        show::table(&head, self.found.pairs.iter().map(row).collect())
    }

    fn numbers(&self) -> String {
        let row = |fitted: &Fitted| {
            let (before, after) =
                (self.error(self.draft, fitted.parameter), self.error(&self.found.draft, fitted.parameter));
            let delay = if fitted.delay > Span::ZERO {
                format!("+{} ms", number(fitted.delay.seconds() * 1e3))
            } else {
                "-".to_owned()
            };
            let bias = match (fitted.smallest_bias, fitted.parameter) {
                (Some(bias), Parameter::Signal(signal)) => format!("{}{}", number(bias), self.unit(signal)),
                _ => "-".to_owned(),
            };
            vec![
                self.name(fitted.parameter).to_owned(),
                bounds(before),
                bounds(after),
                number(fitted.offset),
                number(fitted.spread),
                optional(fitted.noise),
                delay,
                bias,
            ]
        };
        let head =
            ["error of", "now", "fitted", "always", "deviation", "noise", "delay", "smallest step told"];
        show::table(&head, self.found.fitted.iter().map(row).collect())
    }

    /// What is seen of each signal, by kind.
    fn faults(&self, smallest: &Smallest) -> String {
        let kinds = smallest.kinds();
        let row = |(id, signal): (SignalId, &Signal)| {
            let cells = kinds.iter().map(|kind| smallest.told(signal, id, *kind));
            std::iter::once(signal.name.clone()).chain(cells).collect()
        };
        let head: Vec<&str> =
            std::iter::once("smallest seen").chain(kinds.iter().map(|kind| kind.name())).collect();
        let onsets: Vec<String> = smallest.onsets.iter().map(|at| number(at.seconds())).collect();
        let moments = format!(
            "smallest faults that give an alarm in the fitted part, beginning at {} s; a drift by what it reaches in {} s",
            onsets.join(", "),
            number(smallest.duration.seconds())
        );
        let table = show::table(&head, self.knowledge.signals().enumerate().map(row).collect());
        format!("{}\n{table}", show::wrapped(&moments, 0))
    }

    /// What should be known of a pair; `None` when nothing.
    pub(super) fn remark(&self, pair: &PairFit) -> Option<String> {
        let name = self.pair(pair);
        if pair.compared.0 == 0 {
            return Some(format!("{name}: never compared before the split"));
        }
        let delay = pair.late.map(|(late_s, left)| {
            let (late, other) =
                if late_s > 0.0 { (&pair.one, &pair.other) } else { (&pair.other, &pair.one) };
            format!(
                "{} is {} ms later than {}: without that delay {:.0} % of the spread is left",
                self.way(late),
                number(late_s.abs() * 1e3),
                self.way(other),
                100.0 * left
            )
        });
        let share = pair.unexplained.min(1.0);
        let holds = (!pair.holds).then(|| {
            let share =
                if pair.unexplained < 1.0 { format!("{:.0} %", 100.0 * share) } else { "all".to_owned() };
            format!(
                "{name}: not shown to hold, the difference varies by {share} of what the value does; its relations are left as they \
                 are where nothing else shows them"
            )
        });
        let words: Vec<String> = holds.into_iter().chain(delay).collect();
        (!words.is_empty()).then(|| words.join("; "))
    }

    fn verdicts(&self) -> String {
        let is_well = self.refusal.is_none() && self.found.after.failed == 0;
        let text = match self.refusal {
            Some(why) => format!("{}\nno patch is written: {why}", self.tested()),
            None => self.tested(),
        };
        paint(if is_well { Paint::Green } else { Paint::Red }, &show::wrapped(&text, 0))
    }

    pub(super) fn to_json(&self) -> Value {
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

    /// Seconds since the beginning of the session that a stretch is in.
    fn since(&self, stretch: &Stretch, time: Time) -> f64 {
        let first = self.firsts.get(stretch.session).copied().unwrap_or(time);
        (time - first).seconds().max(0.0)
    }

    fn stretch_json(&self, stretch: &Stretch) -> Value {
        let at = |time: Time| self.since(stretch, time);
        let names = |signals: &[SignalId]| signals.iter().map(|it| self.signal(*it)).collect::<Vec<_>>();
        json!({ "session": stretch.session, "from_s": at(stretch.from), "to_s": at(stretch.to), "signals": names(&stretch.signals) })
    }

    /// What was not fitted although nobody said so.
    pub(super) fn unhealthy(&self) -> Vec<String> {
        let told = |it: &Stretch| {
            let names: Vec<&str> = it.signals.iter().map(|signal| self.signal(*signal)).collect();
            let at = |time: Time| number(self.since(it, time));
            format!(
                "not fitted: {} s to {} s, in which {} leaves what it agrees with by {:.0} times as much as ever else; --all fits that, too",
                at(it.from),
                at(it.to),
                names.join(", "),
                it.apart / it.usual
            )
        };
        self.found.unhealthy.iter().map(told).collect()
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
        })
    }

    fn fitted_json(&self, fitted: &Fitted) -> Value {
        json!({
            "name": self.name(fitted.parameter),
            "kind": match fitted.parameter { Parameter::Signal(_) => "signal", Parameter::Relation(_) => "relation" },
            "error": fitted.error,
            "offset": fitted.offset,
            "spread": fitted.spread,
            "noise": fitted.noise,
            "delay_s": fitted.delay.seconds(),
            "smallest_bias": fitted.smallest_bias,
        })
    }
}
