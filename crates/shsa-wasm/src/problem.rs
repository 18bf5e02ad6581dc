//! Why something cannot be done, as a value that JavaScript makes an error of.

use serde_json::json;
use shsa_core::unit::nearest;
use shsa_model::Report;
use std::fmt::Display;
use wasm_bindgen::JsValue;

/// The most names that are listed in an error.
const MOST_NAMES: usize = 20;

/// Why something cannot be done.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Problem {
    /// In one sentence, with what to do where that is known.
    Told(String),
    /// The problems of a model, with their places.
    Model(Report),
}

impl Problem {
    /// The problem of an error.
    pub(crate) fn of(error: impl Display) -> Problem {
        Problem::Told(error.to_string())
    }

    /// The model has nothing of this name.
    pub(crate) fn unknown<'a>(what: &str, name: &str, known: impl Iterator<Item = &'a str>) -> Problem {
        let known: Vec<&str> = known.collect();
        let help = match nearest(name, known.iter().copied()) {
            Some(near) => format!("; did you mean '{near}'?"),
            None if (1..=MOST_NAMES).contains(&known.len()) => format!("; it has {}", known.join(", ")),
            None => String::new(),
        };
        Problem::Told(format!("the model has no {what} '{name}'{help}"))
    }
}

impl From<Report> for Problem {
    fn from(report: Report) -> Problem {
        Problem::Model(report)
    }
}

/// `{"message": .., "diagnostics": [..]}`, with file, line, column and help in each diagnostic.
impl From<Problem> for JsValue {
    fn from(problem: Problem) -> JsValue {
        let told = match problem {
            Problem::Told(message) => json!({ "message": message, "diagnostics": [] }),
            Problem::Model(report) => {
                json!({ "message": report.without_notes().render(false), "diagnostics": report.diagnostics })
            }
        };
        JsValue::from_str(&told.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_name_comes_with_the_nearest_one() {
        let of = |name| match Problem::unknown("signal", name, ["wheel_1", "gnss"].into_iter()) {
            Problem::Told(message) => message,
            Problem::Model(_) => String::new(),
        };
        assert_eq!(of("wheel_2"), "the model has no signal 'wheel_2'; did you mean 'wheel_1'?");
        assert_eq!(of("zzzzzzz"), "the model has no signal 'zzzzzzz'; it has wheel_1, gnss");
    }
}
