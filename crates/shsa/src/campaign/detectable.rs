//! A model calibrated on the first half of the recording, and the smallest step that is seen of each signal.

use super::grid::Detectable;
use anyhow::{anyhow, bail};
use shsa_core::knowledge::{Id, KnowledgeBase, Severity, SignalId, build};
use shsa_core::observation::Observation;
use shsa_core::time::Span;
use shsa_estimate::{Options, Parameter, calibrate};
use shsa_format::model::live::Live;
use shsa_format::recording::{Recording, Sample};

/// Calibrates as `shsa calibrate` does without further options.
///
/// # Errors
/// When the recording is empty, or nothing in it can be compared.
pub(super) fn calibrated(live: &Live, recording: &Recording) -> anyhow::Result<(KnowledgeBase, Detectable)> {
    let samples = &recording.samples;
    let (Some(first), Some(last)) = (recording.first(), samples.last()) else { bail!("nothing recorded") };
    let half = Span((last.received - first).0 / 2);
    let observation = |sample: &Sample| Observation {
        signal: SignalId::from_index(sample.wanted),
        stamp: sample.time,
        received: sample.received,
        value: sample.value.clone(),
    };
    let observations: Vec<Observation> = samples.iter().map(observation).collect();
    let found = calibrate(live.draft(), &observations, first + half, &Options::default())?;
    let (knowledge, remarks) = build(&found.draft);
    if let Some(error) = remarks.into_iter().find(|it| it.severity == Severity::Error) {
        return Err(anyhow!("the calibrated model has an error: {}", error.message));
    }
    let mut biases = vec![None; knowledge.signals().len()];
    for fitted in &found.fitted {
        if let Parameter::Signal(signal) = fitted.parameter
            && let Some(bias) = biases.get_mut(signal.index())
        {
            *bias = fitted.smallest_bias;
        }
    }
    Ok((knowledge, Detectable { from: half, biases }))
}
