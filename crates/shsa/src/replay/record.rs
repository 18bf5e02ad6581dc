//! The record of a replay as a file of MCAP, with its layout for Foxglove.

use shsa_core::knowledge::KnowledgeBase;
use shsa_format::drive::Run;
use shsa_report::mcap::{McapFile, MessageRecorder};
use shsa_report::replay::Provenance;
use std::fs::File;
use std::io::{BufWriter, Write};

/// The files of a record.
pub(super) struct Record<'a> {
    pub(super) file: BufWriter<File>,
    pub(super) layout: Option<BufWriter<File>>,
    pub(super) made: &'a Provenance,
}

impl<'a> Record<'a> {
    /// Begins the record of a run with this model.
    pub(super) fn begin(self, known: &KnowledgeBase) -> anyhow::Result<OpenRecord> {
        let recorder = MessageRecorder::new(McapFile::new(self.file, self.made)?, known)?;
        Ok(OpenRecord { recorder, layout: self.layout })
    }
}

/// A record that is being written.
pub(super) struct OpenRecord {
    pub(super) recorder: MessageRecorder<McapFile<BufWriter<File>>>,
    layout: Option<BufWriter<File>>,
}

impl OpenRecord {
    pub(super) fn finish(mut self, run: &Run) -> anyhow::Result<()> {
        let layout = self.recorder.finish(run)?;
        let Some(mut file) = self.layout else { return Ok(()) };
        file.write_all(layout.to_string().as_bytes())?;
        Ok(file.flush()?)
    }
}
