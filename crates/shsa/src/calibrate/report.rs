//! A calibration for people, and as one JSON object.

use crate::campaign::smallest::Smallest;
use crate::show::{self, Paint, paint};
use serde_json::{Value, json};
use shsa_core::knowledge::{Bounds, Draft, KnowledgeBase, RelationId, Signal, SignalId};
use shsa_core::time::{Span, Time};
use shsa_estimate::{Calibration, Fitted, PairFit, Parameter, Stretch, Support, Verdicts};

/// Above this share of what the values themselves vary, nothing shows that two ways tell the same.
const UNEXPLAINED: f64 = 0.5;

/// A calibration, and what it is about.
pub(super) struct Report<'a> {
    pub(super) draft: &'a Draft,
    pub(super) knowledge: &'a KnowledgeBase,
    pub(super) found: &'a Calibration,
    /// The smallest faults of each kind that are seen, when they were looked for.
    pub(super) smallest: Option<&'a Smallest>,
    pub(super) first: Time,
    pub(super) split: Span,
    pub(super) duration: Span,
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
        let split = format!(
            "fitted to the first {} s, tested on the other {} s",
            number(self.split.seconds()),
            number((self.duration - self.split).seconds())
        );
        let remarks = self.found.pairs.iter().filter_map(|pair| self.remark(pair));
        let remarks: Vec<String> = self.unhealthy().into_iter().chain(remarks).collect();
        let mut parts = vec![split, self.rhythms(), self.pairs(), self.numbers()];
        parts.extend(self.smallest.map(|smallest| self.faults(smallest)));
        if !remarks.is_empty() {
            parts.push(remarks.iter().map(|remark| show::wrapped(remark, 0)).collect::<Vec<_>>().join("\n"));
        }
        parts.push(self.verdicts());
        parts.join("\n\n")
    }

    fn rhythms(&self) -> String {
        let row = |(signal, it): (SignalId, &shsa_estimate::Rhythm)| {
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
            let blocks = match pair.support {
                None => "-".to_owned(),
                Some(Support::Counted { rank, of }) => format!("number {rank} of {of}"),
                Some(Support::Extrapolated { of, largest }) => {
                    format!("{} in {of}, tail", number(self.in_own_unit(pair, largest)))
                }
            };
            vec![
                self.way(&pair.one),
                self.way(&pair.other),
                pair.compared.0.to_string(),
                amount(pair.offset),
                amount(pair.spread),
                amount(pair.needed),
                blocks,
                amount(pair.given),
                format!("{} in {}", pair.conflicts, pair.compared.1),
            ]
        };
        let head = [
            "way",
            "other way",
            "compared",
            "offset",
            "spread",
            "needs",
            "from blocks",
            "gets",
            "later conflicts",
        ];
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
            let time_error = match fitted.time_error {
                Span::ZERO => "-".to_owned(),
                error => format!("{} ms", number(error.seconds() * 1e3)),
            };
            let bias = match (fitted.smallest_bias, fitted.parameter) {
                (Some(bias), Parameter::Signal(signal)) => format!("{}{}", number(bias), self.unit(signal)),
                _ => "-".to_owned(),
            };
            let lasting = self.lasting(fitted).unwrap_or_else(|| "-".to_owned());
            vec![
                self.name(fitted.parameter).to_owned(),
                bounds(before),
                bounds(after),
                time_error,
                delay,
                bias,
                fitted.seen_by.map_or_else(|| "-".to_owned(), |pair| self.pair(&self.found.pairs[pair])),
                lasting,
            ]
        };
        let head = [
            "error of",
            "now",
            "fitted",
            "of time",
            "delay",
            "smallest bias seen",
            "by comparing",
            "together, if it lasts",
        ];
        show::table(&head, self.found.fitted.iter().map(row).collect())
    }

    /// The smallest bias of a signal that many comparisons show together, and how long that takes.
    pub(super) fn lasting(&self, fitted: &Fitted) -> Option<String> {
        let Parameter::Signal(signal) = fitted.parameter else { return None };
        let (bias, span) = fitted.lasting_bias?;
        Some(format!("{}{} in {} s", number(bias), self.unit(signal), number(span.seconds())))
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
        let holds = (share > UNEXPLAINED).then(|| {
            let share =
                if pair.unexplained < 1.0 { format!("{:.0} %", 100.0 * share) } else { "all".to_owned() };
            format!("{name}: not shown to hold, the difference varies by {share} of what the value does")
        });
        let words: Vec<String> = holds.into_iter().chain(delay).collect();
        (!words.is_empty()).then(|| words.join("; "))
    }

    fn verdicts(&self) -> String {
        let told =
            |it: Verdicts| format!("{} failed, {} suspected, {} silent", it.failed, it.suspected, it.silent);
        let (before, after) = (self.found.before, self.found.after);
        let paint_by = if after.failed > 0 { Paint::Red } else { Paint::Green };
        let text = format!(
            "in the part that was not fitted: {} with the fitted model, {} with the model as it is",
            told(after),
            told(before)
        );
        paint(paint_by, &text)
    }

    pub(super) fn to_json(&self) -> Value {
        let rhythm = |(signal, it): (SignalId, &shsa_estimate::Rhythm)| {
            let value = json!({
                "count": it.count, "rate_hz": it.rate_hz, "jitter_s": it.jitter_s, "longest_gap_s": it.longest_gap_s,
                "range": it.range.map(|(lo, hi)| [lo, hi]), "fastest": it.fastest,
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
        })
    }

    fn stretch_json(&self, stretch: &Stretch) -> Value {
        let at = |time: Time| (time - self.first).seconds().max(0.0);
        let names = |signals: &[SignalId]| signals.iter().map(|it| self.signal(*it)).collect::<Vec<_>>();
        json!({ "from_s": at(stretch.from), "to_s": at(stretch.to), "signals": names(&stretch.signals) })
    }

    /// What was not fitted although nobody said so.
    pub(super) fn unhealthy(&self) -> Vec<String> {
        let told = |it: &Stretch| {
            let names: Vec<&str> = it.signals.iter().map(|signal| self.signal(*signal)).collect();
            let at = |time: Time| number((time - self.first).seconds().max(0.0));
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
        let support = pair.support.map(|support| match support {
            Support::Counted { rank, of } => json!({ "rank": rank, "blocks": of }),
            Support::Extrapolated { largest, of } => json!({ "largest": in_unit(largest), "blocks": of }),
        });
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
            "needed": in_unit(pair.needed),
            "support": support,
            "block_s": pair.block.seconds(),
            "given": in_unit(pair.given),
            "conflicts_later": pair.conflicts,
            "smallest_bias": pair.smallest_bias.map(in_unit),
        })
    }

    fn fitted_json(&self, fitted: &Fitted) -> Value {
        let of_pair = |pair: Option<usize>| pair.map(|pair| self.pair(&self.found.pairs[pair]));
        json!({
            "name": self.name(fitted.parameter),
            "kind": match fitted.parameter { Parameter::Signal(_) => "signal", Parameter::Relation(_) => "relation" },
            "error": fitted.error,
            "percent": fitted.percent,
            "offset": fitted.offset,
            "time_error_s": fitted.time_error.seconds(),
            "delay_s": fitted.delay.seconds(),
            "smallest_bias": fitted.smallest_bias,
            "seen_by": of_pair(fitted.seen_by),
            "smallest_lasting_bias": fitted.lasting_bias.map(|(bias, _)| bias),
            "lasting_s": fitted.lasting_bias.map(|(_, span)| span.seconds()),
            "asked_by": of_pair(fitted.asked_by),
        })
    }
}
