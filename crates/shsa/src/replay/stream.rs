//! Replays recordings that are too long for the memory: reads them during the replay.

mod clean;

use super::source::{only, without_effect};
use super::{Arguments, Onlookers, Record, finish, made, written};
use crate::outcome::Outcome;
use crate::progress::Observations;
use crate::show;
use clean::Clean;
use shsa_core::knowledge::{KnowledgeBase, SignalId};
use shsa_core::observation::Observation;
use shsa_format::drive::{Era, Given, Run};
use shsa_format::journal::{JournalWriter, is_journal_file};
use shsa_recording::{self, Parting, ReadOptions, RecordingError, Sample, Session, Stream, Survey, Wanted};
use shsa_report::Source;
use shsa_report::recorded::{Injection, Stage, breaking, wanted};
use shsa_report::replay::{NeedErrors, Part, Recorder, ValueWriter, write_event_table};
use std::cell::RefCell;
use std::fs::{self, File};
use std::io::BufWriter;
use std::path::Path;
use std::time::Instant;

/// Recordings of this size in bytes are streamed if possible. Smaller ones are read only once.
const LONG: u64 = 1 << 20;

/// Replays long recordings. Returns `None` if they are short, or must be kept in memory: because the model changes, or too many files
/// are of the same time.
pub(super) fn run(arguments: &Arguments, knowledge: &KnowledgeBase) -> anyhow::Result<Option<Outcome>> {
    let is_long = || arguments.recordings.iter().map(|path| size(path)).sum::<u64>() >= LONG;
    if !arguments.source.reload.is_empty()
        || arguments.recordings.iter().any(|path| is_journal_file(path))
        || !(arguments.stream || is_long())
    {
        return Ok(None);
    }
    let wanted = wanted(knowledge);
    let stages = [Stage::first(knowledge.clone())];
    let injections = arguments.source.injections(&stages, &wanted)?;
    let options = arguments.reading.options();
    let survey = shsa_recording::survey(&arguments.recordings, &wanted, &options)?;
    if !survey.can_stream || survey.count == 0 {
        return Ok(None);
    }
    let long = Long { arguments, knowledge, wanted, options, survey, injections };
    show::recording(&long.survey.recording);
    long.replay().map(Some)
}

/// A recording that is read again and again, and never kept.
struct Long<'a> {
    arguments: &'a Arguments,
    knowledge: &'a KnowledgeBase,
    wanted: Vec<Wanted>,
    options: ReadOptions,
    survey: Survey,
    injections: Vec<Injection<'a>>,
}

impl Long<'_> {
    fn replay(&self) -> anyhow::Result<Outcome> {
        let arguments = self.arguments;
        let sessions = self.sessions()?;
        super::only_one_is_written(arguments, sessions.len())?;
        let [mut journal, mut record, mut layout, output, events, page] = written(arguments)?;
        let mut values = output.map(|file| arguments.values(file)).transpose()?;
        let made = made(arguments)?;
        let mut recorders: Vec<Recorder> =
            page.iter().flat_map(|_| &sessions).map(|_| Recorder::new()).collect();
        let mut pages = recorders.iter_mut();
        let began = Instant::now();
        let mut struck = vec![false; self.injections.len()];
        let mut played = Vec::new();
        for (number, session) in (1..).zip(&sessions) {
            let record = record.take().map(|file| Record { file, layout: layout.take(), made: &made });
            let outputs = Outputs {
                onlookers: Onlookers { journal: journal.take(), record, page: pages.next() },
                values: values.as_mut(),
                number: (sessions.len() > 1).then_some(number),
            };
            let (run, errors) = self.play(session, outputs, &mut struck)?;
            played.push((run, errors, self.source(session)));
        }
        values.as_mut().map_or(Ok(()), ValueWriter::finish)?;
        let unstruck = self.injections.iter().zip(struck).filter(|(_, struck)| !struck);
        unstruck.for_each(|(injection, _)| without_effect(injection));
        let parts: Vec<Part<'_>> = played
            .iter()
            .map(|(run, errors, source)| Part { run, errors: errors.as_ref(), source })
            .collect();
        events.map_or(Ok(()), |events| write_event_table(&parts, events))?;
        let page = page.map(|file| (file, &*recorders));
        finish(arguments, &parts, began.elapsed(), page)
    }

    /// The samples of a whole session.
    fn samples(&self, session: usize) -> Result<Stream, RecordingError> {
        shsa_recording::stream(&self.arguments.recordings, &self.wanted, &self.options, &self.survey, session)
    }

    /// The sessions to replay: those of the recording, or the parts of them that are left. For these, the recording is passed over.
    ///
    /// # Errors
    /// When nothing is left, when the session that is asked for is missing, and when the recording cannot be read.
    fn sessions(&self) -> anyhow::Result<Vec<Session>> {
        let whole = &self.survey.recording.sessions;
        let cuts = self.arguments.cut.cuts();
        let mut sessions = Vec::new();
        if cuts.is_empty() {
            sessions.clone_from(whole);
        } else {
            cuts.beyond(whole).iter().for_each(show::warn);
            for (number, session) in whole.iter().enumerate() {
                let mut parting = Parting::new(session, &cuts);
                for sample in self.samples(number)? {
                    parting.see(&sample?);
                }
                sessions.extend(parting.sessions(0));
            }
        }
        only(&mut sessions, self.arguments.source.session)?;
        Ok(sessions)
    }

    /// The run over one session, whose values are not kept, with the errors of its needs where there are faults. Sets which of the
    /// faults have struck.
    fn play(
        &self,
        session: &Session,
        outputs: Outputs<'_>,
        struck: &mut [bool],
    ) -> anyhow::Result<(Run, Option<NeedErrors>)> {
        let Long { arguments, knowledge, injections, .. } = self;
        let is_broken = !injections.is_empty();
        let clean = is_broken.then(|| Clean::new(knowledge, session, arguments.options(), struck));
        let clean = RefCell::new(clean);
        let signals: Vec<SignalId> = knowledge.signals().ids().collect();
        let samples = self.samples(session.recording)?.inspect(|sample| {
            if let (Ok(sample), Some(clean)) = (sample, clean.borrow_mut().as_mut()) {
                clean.take(sample, &signals, injections);
            }
        });
        let samples = breaking(samples, injections, session.origin, arguments.source.seed);
        let since = |sample: &Sample| sample.received - session.origin;
        let is_kept = |sample: &Result<Sample, RecordingError>| {
            sample.as_ref().map_or(true, |sample| session.part.holds(session.origin, sample))
        };
        let is_before_end = |sample: &Result<Sample, RecordingError>| {
            sample.as_ref().map_or(true, |sample| since(sample) < session.part.to)
        };
        let samples = samples.take_while(is_before_end).filter(is_kept);
        let observations = samples.filter_map(|sample| match sample {
            Ok(sample) => Some(Ok(observation(&signals, sample)?)),
            Err(error) => Some(Err(anyhow::Error::from(error))),
        });
        let run = self.drive(session, observations, outputs, &clean)?;
        Ok((run, clean.into_inner().map(Clean::end)))
    }

    /// The run over the observations of a session, and what is written of it.
    fn drive(
        &self,
        session: &Session,
        observations: impl Iterator<Item = anyhow::Result<Observation>>,
        outputs: Outputs<'_>,
        clean: &RefCell<Option<Clean<'_>>>,
    ) -> anyhow::Result<Run> {
        let knowledge = self.knowledge;
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
            clean.borrow_mut().iter_mut().for_each(|clean| clean.compare(run));
            let values = values.as_mut();
            values.map_or(Ok(()), |values| {
                let mut publications = run.publications.iter();
                Ok(publications.try_for_each(|it| values.write(knowledge, it, number))?)
            })
        };
        let run =
            Run::streamed(knowledge, session.span, self.arguments.options(), observations, record, look)?;
        recorder.into_iter().for_each(|recorder| recorder.end(&run));
        drop(bar);
        mcap.into_inner().map_or(Ok(()), |mcap| mcap.finish(&run))?;
        journal.as_mut().map_or(Ok(()), JournalWriter::flush)?;
        Ok(run)
    }

    /// The facts about the recording for the report.
    fn source(&self, session: &Session) -> Source {
        let Long { knowledge, survey, .. } = self;
        let names = knowledge.signals().iter().map(|signal| signal.name.clone());
        let missing = survey.recording.found.iter().map(|found| found.missing);
        Source {
            eras: vec![Era::only((*knowledge).clone(), Vec::new())],
            clean: (!self.injections.is_empty()).then(Vec::new),
            span: Some(session.span),
            origin: Some(session.origin),
            session: Some(session.clone()),
            missing: names.zip(missing).collect(),
            degraded: survey.recording.degraded,
        }
    }
}

/// What is written during the run over a session.
struct Outputs<'a> {
    onlookers: Onlookers<'a>,
    values: Option<&'a mut ValueWriter<BufWriter<File>>>,
    /// The number of the session, if it is one of several.
    number: Option<usize>,
}

fn observation(signals: &[SignalId], sample: Sample) -> Option<Observation> {
    let signal = *signals.get(sample.wanted)?;
    Some(Observation { signal, stamp: sample.time, received: sample.received, value: sample.value })
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
