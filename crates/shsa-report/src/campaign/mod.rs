//! The results of a campaign of faults (`shsa_lab::campaign`): as text, as Markdown, and as a page with heat maps.
//!
//! # Example
//! ```
//! use shsa_core::observation::RawValue;
//! use shsa_core::time::Time;
//! use shsa_recording::Sample;
//! use shsa_lab::campaign::{Baseline, Campaign, Grid, GridSpec, Kind, Recorded, measure};
//! use shsa_report::{Style, campaign};
//! use std::collections::BTreeMap;
//!
//! let signal = "{ variable: v, rate: 10 Hz, value_error: 0.1 }";
//! let model = format!("{{ shsa: 1, variables: {{ v: }}, signals: {{ a: {signal}, b: {signal}, c: {signal} }} }}");
//! let knowledge = shsa_model::load(&model, "three.yaml").knowledge;
//! // Half a minute of three sensors that say the same.
//! let sample = |step: i64| {
//!     let at = Time(step / 3 * 100_000_000);
//!     Sample { wanted: (step % 3) as usize, time: at, received: at, value: RawValue::Number(1.0) }
//! };
//! let samples: Vec<Sample> = (0..900).map(sample).collect();
//! let recorded = [Recorded { origin: Time(0), samples: &samples }];
//! let signals: Vec<_> = knowledge.signals().ids().collect();
//! let spec = GridSpec {
//!     kinds: &[Kind::Bias],
//!     multiples: &[8.0],
//!     signals: &signals,
//!     onsets: 1,
//!     seeds: 1,
//!     duration: None,
//!     detectable: None,
//!     instead: &BTreeMap::new(),
//! };
//! let grid = Grid::new(&knowledge, &recorded, &spec)?;
//! let baselines = [Baseline::new(&knowledge, Time(0), &samples).expect("there are samples")];
//! let results = measure(&baselines, &grid, None, &())?;
//! let found = Campaign { baselines: &baselines, knowledge: &knowledge, grid: &grid, seeds: 1, results };
//! assert!(campaign::text(&found, None, Style::PLAIN).contains("Detected 3 of 3 runs (100.0 %)"));
//! assert!(campaign::markdown(&found, "three", "shsa campaign ..", None).starts_with("## three"));
//! assert!(campaign::page(&found, "three.yaml", None).starts_with("<!DOCTYPE html>"));
//! # Ok::<(), shsa_lab::LabError>(())
//! ```

mod text;
mod page;
mod markdown;

pub use markdown::markdown;
pub use page::page;
pub use text::text;
