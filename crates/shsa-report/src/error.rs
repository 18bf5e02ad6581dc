//! Why there is no report.

use shsa_model::Report;
use thiserror::Error;

/// Why there is no report.
#[derive(Debug, Error)]
pub enum ReportError {
    /// Nothing happens in a story.
    #[error("nothing happens in this story")]
    NothingHappens,
    /// A decision about a need is to be explained, and no signal was decided about before it.
    #[error("decision {0} is about a need, and no signal was decided about before it")]
    OnlyNeeds(usize),
    /// The run has fewer decisions.
    #[error("there is no decision {number}: the run has {decisions}")]
    NoDecision {
        /// The number that was asked for, from 1.
        number: usize,
        /// How many decisions there are, in words.
        decisions: String,
    },
    /// A list of all decisions was asked for where one signal is to be explained.
    #[error("no signal is asked about")]
    NoSubject,
    /// The model of the asked moment lacks the signal.
    #[error("the model at that time has no signal '{0}'")]
    NoSignal(String),
    /// The run ends before the asked moment; both in seconds from its beginning.
    #[error("the run ends at {end_s:.3} s, before {at_s:.3} s")]
    Ended {
        /// The end of the run.
        end_s: f64,
        /// The asked moment.
        at_s: f64,
    },
    /// No need of the model demands anything.
    #[error("no need demands anything: give it a contract with `asks`, or an `integrity`")]
    NothingDemanded,
    /// Certificates contradict themselves.
    #[error("these certificates cannot be composed: {0}")]
    Certificates(String),
    /// A moment names evidence that nobody has: the problems with their places.
    #[error("{}", .0.render(false))]
    Moment(Report),
}
