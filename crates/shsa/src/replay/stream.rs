//! Replays recordings that are too long for the memory: reads them during the replay.

use super::{Arguments, Onlookers, Record, finish, made, written};
use crate::outcome::Outcome;
use crate::progress::Observations;
use crate::show;
use shsa_core::engine::Options;
use shsa_core::knowledge::{KnowledgeBase, SignalId};
use shsa_core::observation::Observation;
use shsa_format::drive::{Era, Given, Run};
use shsa_format::journal::{JournalWriter, is_journal_file};
use shsa_format::recording::{self, Sample, Session, Survey};
use shsa_report::Source;
use shsa_report::recorded::wanted;
use shsa_report::replay::{Part, Recorder, ValueWriter, write_event_table};
use std::cell::RefCell;
use std::fs::{self, File};
use std::io::BufWriter;
use std::path::Path;
use std::time::Instant;

/// Recordings of this size in bytes are streamed if possible. Smaller ones are read only once.
const LONG: u64 = 1 << 20;

/// Replays long recordings. Returns `None` if they are short, or must be kept in memory: because of faults, a change of the
/// model, a selected part, or a clock that may have been set.
pub(super) fn run(arguments: &Arguments, knowledge: &KnowledgeBase) -> anyhow::Result<Option<Outcome>> {
    let must_keep = arguments.source.changes() || !arguments.cut.cuts().is_empty();
    let is_long = || arguments.recordings.iter().map(|path| size(path)).sum::<u64>() >= LONG;
    if must_keep
        || arguments.recordings.iter().any(|path| is_journal_file(path))
        || !(arguments.stream || is_long())
    {
        return Ok(None);
    }
    let wanted = wanted(knowledge);
    let options = arguments.source.reading.options();
    let survey = recording::survey(&arguments.recordings, &wanted, &options)?;
    let sessions = chosen(arguments, &survey);
    if !survey.can_stream || sessions.is_empty() {
        return Ok(None);
    }
    show::recording(&survey.recording);
    super::only_one_is_written(arguments, sessions.len())?;
    let [mut journal, mut record, mut layout, output, events, page] = written(arguments)?;
    let mut values = output.map(|file| arguments.values(file)).transpose()?;
    let made = made(arguments)?;
    let mut recorders: Vec<Recorder> = page.iter().flat_map(|_| &sessions).map(|_| Recorder::new()).collect();
    let mut pages = recorders.iter_mut();
    let began = Instant::now();
    let signals: Vec<SignalId> = knowledge.signals().ids().collect();
    let mut played = Vec::new();
    for (number, (index, session)) in (1..).zip(&sessions) {
        let samples = recording::stream(&arguments.recordings, &wanted, &options, &survey, *index)?;
        let record = record.take().map(|file| Record { file, layout: layout.take(), made: &made });
        let outputs = Outputs {
            onlookers: Onlookers { journal: journal.take(), record, page: pages.next() },
            values: values.as_mut(),
            number: (sessions.len() > 1).then_some(number),
        };
        let observations = samples.filter_map(|sample| match sample {
            Ok(sample) => Some(Ok(observation(&signals, sample)?)),
            Err(error) => Some(Err(anyhow::Error::from(error))),
        });
        let run = play(knowledge, session, arguments.options(), observations, outputs)?;
        played.push((run, source(knowledge, &survey, session)));
    }
    values.as_mut().map_or(Ok(()), ValueWriter::finish)?;
    let parts: Vec<Part<'_>> = played.iter().map(|(run, source)| Part { run, clean: None, source }).collect();
    events.map_or(Ok(()), |events| write_event_table(&parts, events))?;
    let page = page.map(|file| (file, &*recorders));
    finish(arguments, &parts, began.elapsed(), page).map(Some)
}

/// The sessions to replay, with their numbers from 0; none where the one that is asked for is missing.
fn chosen<'s>(arguments: &Arguments, survey: &'s Survey) -> Vec<(usize, &'s Session)> {
    let asked = arguments.source.session.map(|number| number.get() - 1);
    let sessions = survey.recording.sessions.iter().enumerate();
    sessions.filter(|(index, _)| asked.is_none_or(|asked| asked == *index)).collect()
}

/// What is written during the run over a session.
struct Outputs<'a> {
    onlookers: Onlookers<'a>,
    values: Option<&'a mut ValueWriter<BufWriter<File>>>,
    /// The number of the session, if it is one of several.
    number: Option<usize>,
}

/// The run over one session, whose values are not kept.
fn play(
    knowledge: &KnowledgeBase,
    session: &Session,
    options: Options,
    observations: impl Iterator<Item = anyhow::Result<Observation>>,
    outputs: Outputs<'_>,
) -> anyhow::Result<Run> {
    let Outputs { onlookers: Onlookers { journal, record, page: mut recorder }, mut values, number } =
        outputs;
    let mcap = record.map(|record| record.begin(knowledge)).transpose()?;
    // Both closures below write to it.
    let mcap = RefCell::new(mcap);
    let mut journal = journal.map(|file| JournalWriter::new(file, knowledge)).transpose()?;
    let mut bar = Observations::new(session.samples.len());
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
            Ok(publications.try_for_each(|it| values.write(knowledge, it, number))?)
        })
    };
    let run = Run::streamed(knowledge, session.span, options, observations, record, look)?;
    recorder.into_iter().for_each(|recorder| recorder.end(&run));
    drop(bar);
    mcap.into_inner().map_or(Ok(()), |mcap| mcap.finish(&run))?;
    journal.as_mut().map_or(Ok(()), JournalWriter::flush)?;
    Ok(run)
}

fn observation(signals: &[SignalId], sample: Sample) -> Option<Observation> {
    let signal = *signals.get(sample.wanted)?;
    Some(Observation { signal, stamp: sample.time, received: sample.received, value: sample.value })
}

/// The facts about the recording for the report.
fn source(knowledge: &KnowledgeBase, survey: &Survey, session: &Session) -> Source {
    let names = knowledge.signals().iter().map(|signal| signal.name.clone());
    let missing = survey.recording.found.iter().map(|found| found.missing);
    Source {
        eras: vec![Era::only(knowledge.clone(), Vec::new())],
        span: Some(session.span),
        origin: Some(session.origin),
        session: Some(session.clone()),
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
