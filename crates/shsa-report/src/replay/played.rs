//! Sessions replayed one after the other, each also without its faults.

use super::{NeedErrors, Part, Recorder};
use crate::Source;
use shsa_core::engine::Options;
use shsa_format::drive::{Era, Given, Run};

/// Replayed sessions.
pub struct Played {
    /// The inputs of each.
    pub sources: Vec<Source>,
    /// The runs.
    pub runs: Vec<Run>,
    /// The errors against the runs without the injected faults.
    pub errors: Vec<Option<NeedErrors>>,
    /// What a page draws of the runs.
    pub recorders: Vec<Recorder>,
}

impl Played {
    /// Replays sessions; `look` sees every input, those of the runs without faults, too.
    ///
    /// # Errors
    /// Those of `look`, which end the replay.
    pub fn of<E>(
        sources: Vec<Source>,
        options: Options,
        mut look: impl FnMut(Given<'_>) -> Result<(), E>,
    ) -> Result<Played, E> {
        let mut recorders: Vec<Recorder> = sources.iter().map(|_| Recorder::new()).collect();
        let mut runs = Vec::new();
        for (source, recorder) in sources.iter().zip(&mut recorders) {
            let run = Run::of(&source.eras, source.span, options, |run, given| {
                look(given)?;
                let published = run.publications.len();
                run.give(given);
                recorder.look(run, published);
                Ok(())
            })?;
            recorder.end(&run);
            runs.push(run);
        }
        let mut clean = |source: &Source, eras: &[Era]| {
            Run::of(eras, source.span, options, |run, given| {
                look(given)?;
                run.give(given);
                Ok(())
            })
        };
        let errors = sources.iter().zip(&runs).map(|(source, run)| match &source.clean {
            Some(eras) => Ok(Some(NeedErrors::between(run, &clean(source, eras)?))),
            None => Ok(None),
        });
        let errors = errors.collect::<Result<_, E>>()?;
        Ok(Played { sources, runs, errors, recorders })
    }

    /// The parts of a report.
    #[must_use]
    pub fn parts(&self) -> Vec<Part<'_>> {
        let played = self.sources.iter().zip(&self.runs).zip(&self.errors);
        played.map(|((source, run), errors)| Part { run, errors: errors.as_ref(), source }).collect()
    }
}
