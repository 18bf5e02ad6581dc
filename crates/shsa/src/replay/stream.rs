//! Replays recordings that are too long for the memory: reads them during the replay.

use super::{Arguments, Record, finish, made, written};
use crate::outcome::Outcome;
use crate::progress::Observations;
use crate::show;
use shsa_core::knowledge::{KnowledgeBase, SignalId};
use shsa_core::observation::Observation;
use shsa_format::drive::{Era, Given, Run};
use shsa_format::journal::{JournalWriter, is_journal_file};
use shsa_format::recording::{self, Sample, Survey};
use shsa_report::Source;
use shsa_report::replay::{Part, Recorder, ValueWriter, write_event_table};
use std::cell::RefCell;
use std::fs;
use std::path::Path;
use std::time::Instant;

/// Recordings of this size in bytes are streamed if possible.
const LONG: u64 = 64 << 20;

/// Replays long recordings. Returns `None` if they are short, or must be kept in memory: because of faults, a change of the
/// model, a selected part, several sessions, or an order other than that of reception.
pub(super) fn run(arguments: &Arguments, knowledge: &KnowledgeBase) -> anyhow::Result<Option<Outcome>> {
    let must_keep =
        arguments.source.changes() || arguments.source.session.is_some() || !arguments.cut.cuts().is_empty();
    let is_long = || arguments.recordings.iter().map(|path| size(path)).sum::<u64>() >= LONG;
    if must_keep
        || arguments.recordings.iter().any(|path| is_journal_file(path))
        || !(arguments.stream || is_long())
    {
        return Ok(None);
    }
    let wanted = super::wanted(knowledge);
    let options = arguments.source.reading.options();
    let survey = recording::survey(&arguments.recordings, &wanted, &options)?;
    let (true, Some(span)) = (survey.can_stream, survey.span) else { return Ok(None) };
    show::recording(&survey.recording);
    let [journal, record, layout, output, events, page] = written(arguments)?;
    let mut values = output.map(|file| arguments.values(file)).transpose()?;
    let made = made(arguments)?;
    let mcap = record.map(|file| Record { file, layout, made: &made }.begin(knowledge)).transpose()?;
    // Both closures below write to it.
    let mcap = RefCell::new(mcap);
    let mut recorder = page.is_some().then(Recorder::new);
    let mut journal = journal.map(|file| JournalWriter::new(file, knowledge)).transpose()?;
    let began = Instant::now();
    let signals: Vec<SignalId> = knowledge.signals().ids().collect();
    let samples = recording::stream(&arguments.recordings, &wanted, &options, &survey)?;
    let observations = samples.filter_map(|sample| match sample {
        Ok(sample) => Some(Ok(observation(&signals, sample)?)),
        Err(error) => Some(Err(anyhow::Error::from(error))),
    });
    let mut bar = Observations::new(survey.count);
    let record = |given: Given<'_>| -> anyhow::Result<()> {
        bar.count(&given);
        mcap.borrow_mut().as_mut().map_or(Ok(()), |mcap| mcap.recorder.input(given))?;
        Ok(journal.as_mut().map_or(Ok(()), |journal| journal.record(given))?)
    };
    let look = |run: &mut Run| -> anyhow::Result<()> {
        recorder.as_mut().into_iter().for_each(|recorder| recorder.look(run, 0));
        mcap.borrow_mut().as_mut().map_or(Ok(()), |mcap| mcap.recorder.look(run, 0))?;
        let values = values.as_mut();
        values.map_or(Ok(()), |values| {
            let mut publications = run.publications.iter();
            Ok(publications.try_for_each(|it| values.write(knowledge, it, None))?)
        })
    };
    let run = Run::streamed(knowledge, span, arguments.options(), observations, record, look)?;
    recorder.as_mut().into_iter().for_each(|recorder| recorder.end(&run));
    drop(bar);
    mcap.into_inner().map_or(Ok(()), |mcap| mcap.finish(&run))?;
    if let Some(mut journal) = journal {
        journal.flush()?;
    }
    values.as_mut().map_or(Ok(()), ValueWriter::finish)?;
    let source = source(knowledge, survey);
    let parts = [Part { run: &run, clean: None, source: &source }];
    events.map_or(Ok(()), |events| write_event_table(&parts, events))?;
    let page = page.zip(recorder.as_ref().map(std::slice::from_ref));
    finish(arguments, &parts, began.elapsed(), page).map(Some)
}

fn observation(signals: &[SignalId], sample: Sample) -> Option<Observation> {
    let signal = *signals.get(sample.wanted)?;
    Some(Observation { signal, stamp: sample.time, received: sample.received, value: sample.value })
}

/// The facts about the recording for the report.
fn source(knowledge: &KnowledgeBase, survey: Survey) -> Source {
    let names = knowledge.signals().iter().map(|signal| signal.name.clone());
    let missing = survey.recording.found.iter().map(|found| found.missing);
    Source {
        eras: vec![Era::only(knowledge.clone(), Vec::new())],
        span: survey.span,
        missing: names.zip(missing).collect(),
        degraded: survey.recording.degraded,
        ..Source::default()
    }
}

/// The bytes of a file, or of the files in a folder; 0 for standard input.
fn size(path: &Path) -> u64 {
    if path == Path::new("-") {
        return LONG;
    }
    let length = |path: &Path| fs::metadata(path).map_or(0, |found| found.len());
    match path.read_dir() {
        Ok(entries) => entries.flatten().map(|entry| length(&entry.path())).sum(),
        Err(_) => length(path),
    }
}
