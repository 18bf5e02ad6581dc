//! What is wrong in a recording (`shsa_lab::doctor`): as text, as one JSON object, and as a page.

mod words;
mod text;
mod json;
mod charts;
mod page;

use serde_json::Value;
use shsa_lab::doctor::Diagnosis;
use shsa_lab::drafting::Columns;

/// A diagnosis with the columns that were examined.
///
/// # Example
/// ```
/// use shsa_lab::doctor::examine;
/// use shsa_lab::drafting::{Columns, Series};
/// use shsa_report::{Style, doctor::Report};
///
/// // Three thermometers for a quarter of an hour; one reads 2 too much for a minute.
/// let noise = |step: i32, of: i32| 0.05 * (f64::from(step * 37 + of * 101) * 12.9898).sin();
/// let value = |step: i32, of: i32| {
///     let wrong = if of == 1 && (300..360).contains(&step) { 2.0 } else { 0.0 };
///     20.0 + 3.0 * (0.02 * f64::from(step)).sin() + noise(step, of) + wrong
/// };
/// let series = (0..3).map(|of| Series {
///     topic: "hall".to_owned(),
///     path: format!("temperature_{of}"),
///     source: format!("hall#temperature_{of}"),
///     points: (0..900).map(|step| (f64::from(step), value(step, of))).collect(),
/// });
/// let mut columns = Columns::of_series(series.collect());
/// let diagnosis = examine(&mut columns, "hall", &())?;
/// let report = Report { columns: &columns, diagnosis: &diagnosis };
/// assert!(report.text(Style::PLAIN).contains("temperature_1 reads 1.98 too much"));
/// assert_eq!(report.json()["findings"][0]["signals"][0], "temperature_1");
/// # Ok::<(), shsa_lab::LabError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Report<'a> {
    /// The columns.
    pub columns: &'a Columns,
    /// What was found out about them.
    pub diagnosis: &'a Diagnosis,
}

impl Report<'_> {
    /// One JSON object; `docs/json.md` lists its fields.
    #[must_use]
    pub fn json(&self) -> Value {
        json::json(self)
    }

    /// The diagnosis as one page for the browser; `title` is the name of the recording.
    #[must_use]
    pub fn page(&self, title: &str) -> String {
        page::page(self, title)
    }

    /// What a page draws of the findings, the largest first: words, and values around each stretch, in seconds of its session.
    #[must_use]
    pub fn charts(&self) -> Value {
        charts::json(self)
    }

    /// The values of all columns, thinned to the lowest and the highest of so many stretches of time.
    #[must_use]
    pub fn columns(&self, stretches: usize) -> Value {
        charts::columns(self.columns, stretches)
    }

    fn name(&self, column: usize) -> &str {
        self.columns.about.get(column).map_or("", |it| it.signal.as_str())
    }

    fn names(&self, columns: &[usize]) -> Vec<&str> {
        columns.iter().map(|it| self.name(*it)).collect()
    }

    /// The unit of a column after a blank; empty where it is unknown.
    fn unit(&self, column: usize) -> String {
        let unit = self.columns.columns.get(column).and_then(|it| it.signal.unit.as_ref());
        unit.map_or_else(String::new, |it| format!(" {it}"))
    }
}
