//! The results of a calibration (`shsa_lab::calibration`): as text, as one JSON object, as a page, and as a change of the model.

mod text;
mod json;
mod page;
mod patch;

use crate::Style;
use shsa_core::knowledge::{Bounds, Draft, Id, KnowledgeBase, RelationId, SignalId};
use shsa_core::time::{Span, Time};
use shsa_lab::calibration::{Calibration, PairFit, Parameter, Stretch};
use shsa_lab::campaign::Smallest;

/// A calibration with its inputs.
///
/// # Example
/// ```
/// use shsa_core::knowledge::{Id, SignalId};
/// use shsa_core::observation::{Observation, RawValue};
/// use shsa_core::time::{Span, Time};
/// use shsa_model::live::{Live, Written};
/// use shsa_lab::calibration::{Options, Session, calibrate};
/// use shsa_report::{Style, calibration::Report};
///
/// let model = "{ shsa: 1, variables: { v: }, signals: { a: { variable: v, rate: 10 Hz }, b: { variable: v, rate: 10 Hz } } }";
/// let (live, _) = Live::load(Written { name: "two.yaml", text: model }).expect("the model is valid");
/// // A minute of two sensors that differ by up to 0.02.
/// let observation = |step: i64| {
///     let at = Time(step / 2 * 100_000_000);
///     let off = 0.01 * ((step * 7_919) as f64).sin();
///     let signal = SignalId::from_index((step % 2) as usize);
///     Observation { signal, stamp: at, received: at, value: RawValue::Number(1.0 + off) }
/// };
/// let half = Time(30_000_000_000);
/// let (fitted, unseen) = Session::new((0..1_200).map(observation).collect(), &[]).split(half);
/// let options = Options { finds_steps: false, most_observations: 10_000, ..Options::default() };
/// let found = calibrate(live.draft(), &[fitted], &[unseen], &options)?;
/// let report = Report {
///     draft: live.draft(),
///     knowledge: live.knowledge(),
///     found: &found,
///     smallest: None,
///     firsts: &[Time(0)],
///     split: Span::from_millis(30_000),
///     duration: Span::from_millis(59_900),
///     refusal: None,
/// };
/// assert!(report.text(Style::PLAIN).starts_with("Fitted to the first 30 s of a recording"));
/// assert_eq!(report.json()["split_s"], 30.0);
/// assert!(report.patch(Style::PLAIN).contains("signals:\n"));
/// # Ok::<(), shsa_lab::calibration::Problem>(())
/// ```
#[derive(Clone, Copy)]
pub struct Report<'a> {
    /// The model as it was written.
    pub draft: &'a Draft,
    /// The same model, checked.
    pub knowledge: &'a KnowledgeBase,
    /// The calibration.
    pub found: &'a Calibration,
    /// The smallest detected faults of each kind, if they were looked for.
    pub smallest: Option<&'a Smallest>,
    /// The beginning of each session.
    pub firsts: &'a [Time],
    /// The total length of the fitted parts.
    pub split: Span,
    /// The total length of all.
    pub duration: Span,
    /// Why the fitted numbers should not be used, if so.
    pub refusal: Option<&'a str>,
}

/// A number with three significant digits.
fn number(value: f64) -> String {
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

impl Report<'_> {
    /// The change of the model as YAML: every changed variable, signal and relation in full, below comments with its evidence, wrapped
    /// at the width of the style.
    #[must_use]
    pub fn patch(&self, style: Style) -> String {
        patch::text(self, style)
    }

    /// The calibration as one page for the browser; `title` is the name of the model's file.
    #[must_use]
    pub fn page(&self, title: &str) -> String {
        page::page(self, title)
    }

    fn signal(&self, signal: SignalId) -> &str {
        &self.knowledge.signals()[signal].name
    }

    /// The unit of a signal as written, after a blank.
    fn unit(&self, signal: SignalId) -> String {
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

    /// Converts a difference of a pair's variable from SI to the variable's unit.
    fn in_own_unit(&self, pair: &PairFit, value: f64) -> f64 {
        let unit = self.knowledge.variables()[pair.variable].unit.as_ref();
        unit.map_or(value, |unit| value / unit.to_si_difference(1.0))
    }

    fn way(&self, (relations, signals): &(Vec<RelationId>, Vec<SignalId>)) -> String {
        let signals: Vec<&str> = signals.iter().map(|signal| self.signal(*signal)).collect();
        let relations: Vec<&str> =
            relations.iter().map(|relation| self.knowledge.relations()[*relation].name.as_str()).collect();
        match relations.as_slice() {
            [] => signals.join(", "),
            relations => format!("{} of {}", relations.join(", "), signals.join(", ")),
        }
    }

    fn pair(&self, pair: &PairFit) -> String {
        format!("{} and {}", self.way(&pair.one), self.way(&pair.other))
    }

    fn name(&self, parameter: Parameter) -> &str {
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

    /// A value as text, in the unit of the pair's variable.
    fn amount(&self, pair: &PairFit, value: f64) -> String {
        let unit = self.unit_of(&self.knowledge.variables()[pair.variable].name);
        let shown = number(self.in_own_unit(pair, value));
        unit.map_or_else(|| shown.clone(), |unit| format!("{shown} {unit}"))
    }

    /// The width of the range of a pair's variable, else of what was seen of it, in SI.
    fn range(&self, pair: &PairFit) -> f64 {
        let seen = |signal: &SignalId| {
            let (lo, hi) = self.found.rhythms.get(signal.index())?.range?;
            let unit = self.knowledge.signals()[*signal].unit.as_ref();
            Some(unit.map_or(hi - lo, |unit| unit.to_si_difference(hi - lo).abs()))
        };
        let declared =
            self.knowledge.variables()[pair.variable].range.map(shsa_core::interval::Interval::width);
        let carriers = self.knowledge.carriers(pair.variable);
        declared.unwrap_or_else(|| carriers.iter().filter_map(seen).fold(0.0, f64::max))
    }

    /// Seconds since the beginning of a stretch's session.
    fn since(&self, stretch: &Stretch, time: Time) -> f64 {
        let first = self.firsts.get(stretch.session).copied().unwrap_or(time);
        (time - first).seconds().max(0.0)
    }
}
