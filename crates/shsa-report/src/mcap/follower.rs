//! Records a run that goes on elsewhere, from its inputs alone.

use super::layout::layout;
use super::{MessageRecorder, Sink};
use serde_json::Value;
use shsa_core::engine::Options;
use shsa_core::knowledge::KnowledgeBase;
use shsa_core::time::Time;
use shsa_format::drive::{Given, Run};
use std::io;

/// Records a run that goes on elsewhere. The same inputs give the same decisions, so an engine of its own follows them, and the
/// engine of the run is not asked. Memory does not grow with the length of the run.
pub struct Follower<S: Sink> {
    recorder: MessageRecorder<S>,
    run: Run,
    has_begun: bool,
}

impl<S: Sink> Follower<S> {
    /// Begins with a run that begins with this model and these options.
    ///
    /// # Errors
    /// Errors of the output.
    pub fn new(sink: S, known: &KnowledgeBase, options: Options) -> io::Result<Follower<S>> {
        let recorder = MessageRecorder::new(sink, known)?;
        Ok(Follower { recorder, run: Run::with(known, options, Time(0)), has_begun: false })
    }

    /// Records an input of the run, and what follows from it. Inputs come in order, ticks included.
    ///
    /// # Errors
    /// Errors of the output.
    pub fn follow(&mut self, given: Given<'_>) -> io::Result<()> {
        if !std::mem::replace(&mut self.has_begun, true) {
            let first = given.time();
            (self.run.first, self.run.last) = (first, first);
        }
        self.recorder.input(given)?;
        self.run.give(given);
        self.recorder.look(&self.run, 0)?;
        self.recorder.forget(&mut self.run);
        Ok(())
    }

    /// Writes out what is buffered: the file can be read up to here from then on.
    ///
    /// # Errors
    /// Errors of the output.
    pub fn flush(&mut self) -> io::Result<()> {
        self.recorder.flush()
    }

    /// A layout for Foxglove that shows the run as it is now.
    #[must_use]
    pub fn layout(&self) -> Value {
        layout(&self.run.engine)
    }

    /// Ends the file. Returns a layout for Foxglove; it is in the file, too.
    ///
    /// # Errors
    /// Errors of the output.
    pub fn finish(&mut self) -> io::Result<Value> {
        self.recorder.finish(&self.run)
    }
}
