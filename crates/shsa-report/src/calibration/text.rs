//! A calibration as text for people.

use super::{Report, number};
use crate::style::{Paint, Style};
use shsa_core::knowledge::{Bounds, Signal, SignalId, Text};
use shsa_core::time::{Span, Time};
use shsa_lab::calibration::{Fitted, PairFit, Parameter, Stretch, Verdicts, fewest_expected, most_expected};
use shsa_lab::campaign::Smallest;

/// A table without its looks.
pub(super) struct Columns {
    pub(super) head: Vec<String>,
    pub(super) rows: Vec<Vec<String>>,
}

impl Columns {
    fn text(self, style: Style) -> String {
        let head: Vec<&str> = self.head.iter().map(String::as_str).collect();
        style.table(&head, self.rows)
    }
}

impl Report<'_> {
    /// The promise, tables of rhythms, comparisons and numbers, remarks, and the result in the part that was not fitted.
    #[must_use]
    pub fn text(&self, style: Style) -> String {
        let remarks = self.remarks();
        let mut parts = vec![
            style.wrapped(&self.promised(), 0),
            self.rhythms().text(style),
            self.pairs().text(style),
            self.numbers().text(style),
        ];
        parts.extend(self.smallest.map(|smallest| {
            format!("{}\n{}", style.wrapped(&moments(smallest), 0), self.faults(smallest).text(style))
        }));
        if !remarks.is_empty() {
            parts.push(remarks.iter().map(|remark| style.wrapped(remark, 0)).collect::<Vec<_>>().join("\n"));
        }
        parts.push(self.verdicts(style));
        parts.join("\n\n")
    }

    /// The promise of the calibration.
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
             seen, with 95 % confidence: every error is what is there all the time and {} deviations, or as wide as single values need; {} alarms in {} \
             surrogate hours, and {sessions}.",
            number(self.split.seconds()),
            number(self.duration.seconds()),
            number(promise.alarms_per_hour),
            number(promise.factor),
            promise.alarms,
            number(promise.hours),
        )
    }

    /// The results in the test part.
    pub(super) fn tested(&self) -> String {
        let description =
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
            description(after),
            description(found.before),
            after.alarms
        )
    }

    /// Remarks about the calibration.
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

    /// Limits of the model that healthy data exceed, and the new limits.
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

    pub(super) fn rhythms(&self) -> Columns {
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
        let rows = self.knowledge.signals().ids().zip(&self.found.rhythms).map(row).collect();
        Columns { head: head.map(str::to_owned).into(), rows }
    }

    pub(super) fn pairs(&self) -> Columns {
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
                amount(pair.open.now),
                amount(pair.open.then),
                pair.compared.1.to_string(),
            ]
        };
        let head = [
            "way",
            "other way",
            "compared",
            "offset",
            "spread",
            "holds",
            "gets",
            "open now",
            "open then",
            "compared later",
        ];
        Columns { head: head.map(str::to_owned).into(), rows: self.found.pairs.iter().map(row).collect() }
    }

    pub(super) fn numbers(&self) -> Columns {
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
        Columns { head: head.map(str::to_owned).into(), rows: self.found.fitted.iter().map(row).collect() }
    }

    /// The smallest detected faults of each signal, by kind.
    pub(super) fn faults(&self, smallest: &Smallest) -> Columns {
        let kinds = smallest.kinds();
        let row = |(id, signal): (SignalId, &Signal)| {
            let cells = kinds.iter().map(|kind| smallest.described(signal, id, *kind));
            std::iter::once(signal.name.clone()).chain(cells).collect()
        };
        let head = std::iter::once("smallest seen").chain(kinds.iter().map(|kind| kind.name()));
        Columns {
            head: head.map(str::to_owned).collect(),
            rows: self.knowledge.signals().enumerate().map(row).collect(),
        }
    }

    /// The remark about a pair, if there is one.
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
        let range = self.range(pair);
        let never = pair.never_contradicts(range).then(|| {
            format!(
                "{name}: can never contradict, its errors leave open {}, and the values range over {}",
                self.amount(pair, pair.open.then),
                self.amount(pair, range)
            )
        });
        let words: Vec<String> = holds.into_iter().chain(delay).chain(never).collect();
        (!words.is_empty()).then(|| words.join("; "))
    }

    fn verdicts(&self, style: Style) -> String {
        let is_well = self.refusal.is_none() && self.found.after.failed == 0;
        let text = match self.refusal {
            Some(why) => format!("{}\nthe fitted numbers are not used: {why}", self.tested()),
            None => self.tested(),
        };
        style.paint(if is_well { Paint::Green } else { Paint::Red }, &style.wrapped(&text, 0))
    }

    /// Stretches that were not fitted because they look unhealthy.
    pub(super) fn unhealthy(&self) -> Vec<String> {
        let description = |it: &Stretch| {
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
        self.found.unhealthy.iter().map(description).collect()
    }
}

/// When the faults of a search began, and how long they lasted.
pub(super) fn moments(smallest: &Smallest) -> String {
    let onsets: Vec<String> = smallest.onsets.iter().map(|at| number(at.seconds())).collect();
    format!(
        "smallest faults that give an alarm in the fitted part, beginning at {} s; a drift by what it reaches in {} s",
        onsets.join(", "),
        number(smallest.duration.seconds())
    )
}

fn optional(value: Option<f64>) -> String {
    value.map_or_else(|| "-".to_owned(), number)
}

/// An error in the notation of a model.
fn bounds(bounds: Option<&Bounds>) -> String {
    match bounds {
        None => "-".to_owned(),
        Some(Bounds::One(text)) => text.text.clone(),
        Some(Bounds::Two(lo, hi)) => format!("[{}, {}]", lo.text, hi.text),
    }
}
