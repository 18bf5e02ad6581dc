//! Records a run that goes on elsewhere, from its inputs alone.

use super::{McapRecorder, Seekable};
use crate::replay::Provenance;
use serde_json::Value;
use shsa_core::engine::Options;
use shsa_core::knowledge::KnowledgeBase;
use shsa_core::time::Time;
use shsa_format::drive::{Given, Run};
use std::io;

/// Records a run that goes on elsewhere. The same inputs give the same decisions, so an engine of its own follows them, and the
/// engine of the run is not asked. Memory does not grow with the length of the run.
pub struct Follower<W: Seekable> {
    recorder: McapRecorder<W>,
    run: Run,
    has_begun: bool,
}

impl<W: Seekable> Follower<W> {
    /// Begins a file for a run that begins with this model and these options.
    ///
    /// # Errors
    /// Errors of the output.
    pub fn new(
        output: W,
        known: &KnowledgeBase,
        options: Options,
        provenance: &Provenance,
    ) -> io::Result<Follower<W>> {
        let recorder = McapRecorder::new(output, known, provenance)?;
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

    /// Ends the file. Returns a layout for Foxglove; it is in the file, too.
    ///
    /// # Errors
    /// Errors of the output.
    pub fn finish(&mut self) -> io::Result<Value> {
        self.recorder.finish(&self.run)
    }
}
