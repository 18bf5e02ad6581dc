//! What is wrong in recordings, without a model.

use crate::Problem;
use crate::progress::Told;
use shsa_lab::doctor::{Diagnosis, examine};
use shsa_lab::drafting::Columns;
use shsa_report::Style;
use shsa_report::doctor::Report;
use wasm_bindgen::prelude::wasm_bindgen;

/// The findings about recordings.
#[wasm_bindgen]
pub struct Doctor {
    columns: Columns,
    diagnosis: Diagnosis,
    names: String,
}

impl Doctor {
    pub(crate) fn of(mut columns: Columns, names: String, told: &Told) -> Result<Doctor, Problem> {
        let diagnosis = examine(&mut columns, &names, told).map_err(Problem::of)?;
        Ok(Doctor { columns, diagnosis, names })
    }

    fn report(&self) -> Report<'_> {
        Report { columns: &self.columns, diagnosis: &self.diagnosis }
    }
}

#[wasm_bindgen]
impl Doctor {
    /// What `shsa doctor --json` prints.
    #[must_use]
    pub fn json(&self) -> String {
        self.report().json().to_string()
    }

    /// What `shsa doctor` prints.
    #[must_use]
    pub fn text(&self) -> String {
        self.report().text(Style::PLAIN)
    }

    /// The page that `shsa doctor --html` writes.
    #[must_use]
    pub fn page(&self) -> String {
        self.report().page(&self.names)
    }

    /// The model that was found out, ready to edit.
    #[must_use]
    pub fn model(&self) -> String {
        self.diagnosis.model.clone()
    }

    /// The findings with their drawings, as JSON.
    #[must_use]
    pub fn charts(&self) -> String {
        self.report().charts().to_string()
    }

    /// All columns over time, thinned to so many stretches, as JSON.
    #[must_use]
    pub fn columns(&self, stretches: usize) -> String {
        self.report().columns(stretches).to_string()
    }

    /// What there is to know of the recordings, one line each.
    #[must_use]
    pub fn warnings(&self) -> Vec<String> {
        self.columns.warnings.clone()
    }
}
