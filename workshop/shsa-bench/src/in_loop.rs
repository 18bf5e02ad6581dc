//! A model in the whole loop over a recording, with a fault: what its needs are served with.

use anyhow::{Context, bail};
use shsa_core::engine::{Engine, Event, Input, Options, Output, PublishedValue, Ticks};
use shsa_core::interval::Interval;
use shsa_core::knowledge::{KnowledgeBase, SignalId};
use shsa_core::observation::Observation;
use shsa_core::time::Time;
use shsa_format::fault::Fault;
use shsa_model::load;
use shsa_recording::{ReadOptions, Sample, Wanted, read};
use std::path::Path;

/// A model with the recording of its signals.
pub(crate) struct Recorded {
    knowledge: KnowledgeBase,
    signals: Vec<SignalId>,
    samples: Vec<Sample>,
}

/// What a run has shown.
pub(crate) struct Shown<const N: usize> {
    /// What each need was served with.
    pub(crate) served: [Vec<Served>; N],
    /// The first signal that was accused or found silent, how, and when.
    pub(crate) accused: Option<(Time, String)>,
}

/// A value of a need.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Served {
    /// When the value was true.
    pub(crate) at: Time,
    pub(crate) value: Interval,
}

impl Recorded {
    /// Reads a recording by the sources of a model's signals.
    ///
    /// # Errors
    /// The model has errors, or the recording cannot be read.
    pub(crate) fn new(model: &str, recording: &Path) -> anyhow::Result<Recorded> {
        let loaded = load(model, "the model");
        if !loaded.report.ok() {
            bail!("{}", loaded.report.render(false));
        }
        let knowledge = loaded.knowledge;
        let ids = knowledge.signals().ids().filter(|id| !knowledge.is_computed(*id));
        let signals: Vec<SignalId> = ids.collect();
        let wanted: Vec<Wanted> = signals
            .iter()
            .map(|id| Wanted::new(&knowledge.signals()[*id].name, &knowledge.signals()[*id].source))
            .collect();
        let samples = read(&[recording.to_owned()], &wanted, &ReadOptions::default())?.samples;
        Ok(Recorded { knowledge, signals, samples })
    }

    /// When the recording begins and ends.
    ///
    /// # Errors
    /// It has no values.
    pub(crate) fn span(&self) -> anyhow::Result<(Time, Time)> {
        let ends = self.samples.first().zip(self.samples.last());
        let (first, last) = ends.context("the recording has none of the signals")?;
        Ok((first.received, last.received))
    }

    /// Runs the engine with a fault in the notation of `shsa replay --inject`, and returns what the needs with these names were
    /// served with.
    ///
    /// # Errors
    /// The fault or a need is unknown.
    pub(crate) fn serve<const N: usize>(
        &self,
        fault: Option<&str>,
        needs: [&str; N],
    ) -> anyhow::Result<Shown<N>> {
        let mut samples = self.samples.clone();
        if let Some(fault) = fault {
            self.inject(&fault.parse()?, &mut samples)?;
        }
        let mut engine = shsa_estimate::node::engine(self.knowledge.clone(), Options::default());
        let mut shown = Shown { served: needs.map(|_| Vec::new()), accused: None };
        for sample in samples {
            let Some(signal) = self.signals.get(sample.wanted).copied() else { continue };
            let Sample { time: stamp, received, value, .. } = sample;
            engine.pass(Ticks::before(received));
            engine.handle(Input::Observation(Observation { signal, stamp, received, value }));
            self.collect(&mut engine, needs, &mut shown);
        }
        Ok(shown)
    }

    fn inject(&self, fault: &Fault, samples: &mut Vec<Sample>) -> anyhow::Result<()> {
        let name = |id: &SignalId| self.knowledge.signals()[*id].name == fault.signal;
        let place = self.signals.iter().position(name).context("the fault is of no signal")?;
        let scaling = self.knowledge.signals()[self.signals[place]].scaling;
        fault.inject(samples, place, scaling, self.span()?.0, 1);
        Ok(())
    }

    fn collect<const N: usize>(&self, engine: &mut Engine, needs: [&str; N], shown: &mut Shown<N>) {
        while let Some(output) = engine.poll() {
            match output {
                Output::Publication(publication) => {
                    let name = &self.knowledge.needs()[publication.need].signal;
                    let place = needs.iter().position(|need| need == name);
                    if let (Some(place), PublishedValue::Scalar(value)) = (place, publication.value) {
                        shown.served[place].push(Served { at: publication.validity.centre(), value });
                    }
                }
                Output::Event(event) if shown.accused.is_none() => shown.accused = self.accused(&event),
                _ => {}
            }
        }
    }

    fn accused(&self, event: &Event) -> Option<(Time, String)> {
        let is_accused = event.kind.accuses();
        let signal = event.signal.filter(|_| is_accused)?;
        Some((event.time, format!("{} {}", self.knowledge.signals()[signal].name, event.kind.name())))
    }
}
