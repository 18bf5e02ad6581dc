//! Results of analyses, replays, explanations, assurance cases, campaigns, calibrations and learned relations, as text, JSON, Markdown, drawings and
//! pages.
//!
//! A report is made of a result and its model, and written in the wanted form. Texts take a [`Style`]: with colours and wrapped
//! for a terminal, or [`Style::PLAIN`]. A page is one file without scripts and external resources. Nothing here reads a file or prints, so a
//! program that embeds the engine shows the same as the command.
//!
//! # Example
//!
//! ```
//! use shsa_core::analysis::{Options, analyze};
//! use shsa_report::{Style, analysis::Report};
//!
//! let model = "{ shsa: 1, variables: { v: { unit: m/s } }, signals: { /a: { variable: v }, /b: { variable: v } } }";
//! let knowledge = shsa_model::load(model, "two.yaml").knowledge;
//! let (options, analysis) = (Options::default(), analyze(&knowledge, Options::default()));
//! let report = Report::new(&knowledge, &analysis, options, "two.yaml");
//! assert!(report.text(Style::PLAIN).contains("Faults that cannot be told apart:\n  /a, /b"));
//! assert!(report.page().starts_with("<!DOCTYPE html>"));
//! ```

mod error;
mod style;
mod page;
mod events;
mod source;
pub mod recorded;
pub mod substitution;
pub mod shortfall;
mod bands;
pub mod analysis;
pub mod check;
pub mod info;
pub mod explanation;
pub mod replay;
pub mod mcap;
pub mod assurance;
pub mod campaign;
pub mod calibration;
pub mod learning;
pub mod maintenance;
pub mod doctor;

pub use error::ReportError;
pub use events::{event_text, paint_of};
pub use source::Source;
pub use style::{Paint, Style};
