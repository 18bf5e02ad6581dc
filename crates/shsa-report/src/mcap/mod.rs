//! A run as messages: inputs, values of all ways of knowing, verdicts, decisions, needs, and the knowledge graph as a drawing. They go into an
//! MCAP file (<https://mcap.dev/spec>), which Foxglove, Rerun and PlotJuggler open, or to another [`Sink`].
//!
//! Messages are JSON with a JSON Schema. Values are in the units of the model. The channel [`shsa_format::journal::TOPIC`] has the
//! inputs of the run, so that it replays to the same decisions.

mod kind;
mod sink;
mod file;
mod scene;
mod layout;
mod follower;

pub use file::McapFile;
pub use follower::Follower;
pub use kind::Kind;
pub use sink::{Message, Sink};

use crate::bands::BandSource;
use core::ops::Bound;
use scene::Scene;
use serde_json::{Value, json};
use shsa_core::engine::{Engine, EventKind, Input, Publication, PublishedValue, Severity};
use shsa_core::interval::Interval;
use shsa_core::knowledge::{KnowledgeBase, SignalId};
use shsa_core::monitor::{Symptom, WayIndex};
use shsa_core::substitution::Way;
use shsa_core::time::{Span, Time};
use shsa_core::unit::Unit;
use shsa_format::drive::{Given, Run};
use shsa_format::journal::{self, JournalWriter};
use shsa_format::{event, words};
use std::collections::BTreeMap;
use std::io::{self, Seek, Write};

/// The topics of the decisions, as data and as lines of a log, and of the graph.
const DECISIONS: &str = "/shsa/decisions";
const LOG: &str = "/shsa/log";
const GRAPH: &str = "/shsa/graph";

/// The most ways of a variable that are recorded.
const MOST_WAYS: usize = 32;

/// What a file is written to: indices at its end need its positions.
pub trait Seekable: Write + Seek {}

impl<W: Write + Seek> Seekable for W {}

/// Tells a sink of a run, as it goes. Memory does not grow with the length of the run.
///
/// # Example
/// ```
/// use shsa_core::engine::Options;
/// use shsa_format::drive::Run;
/// use shsa_report::Source;
/// use shsa_report::mcap::{McapFile, MessageRecorder};
/// use shsa_report::replay::Provenance;
/// use std::io::Cursor;
///
/// let text = std::fs::read_to_string("../../stories/02-fallback-by-value.yaml")?;
/// let story = shsa_format::story::load(&text, "02.yaml", std::path::Path::new(".")).story.expect("a story");
/// let source = Source::of_story(&story);
/// let made = Provenance { model: "02.yaml".to_owned(), text, hash: String::new(), command: String::new() };
/// let mut file = Vec::new();
/// let mcap = McapFile::new(Cursor::new(&mut file), &made)?;
/// let mut recorder = MessageRecorder::new(mcap, &source.eras[0].knowledge)?;
/// let run = Run::of(&source.eras, source.span, Options::default(), |run, given| {
///     recorder.input(given)?;
///     let published = run.publications.len();
///     run.give(given);
///     recorder.look(run, published)
/// })?;
/// recorder.finish(&run)?;
/// drop(recorder);
/// assert!(file.starts_with(b"\x89MCAP0\r\n"));
/// # Ok::<(), std::io::Error>(())
/// ```
pub struct MessageRecorder<S: Sink> {
    sink: S,
    journal: JournalWriter<Vec<u8>>,
    ways: Vec<Recorded>,
    scene: Scene,
    /// The version of the model that is followed.
    version: Option<u64>,
    /// The decisions that are recorded, of those that the run has.
    events: usize,
    /// The signal of an observation whose reading is not yet recorded, with the time of its reception.
    observed: Option<(SignalId, Time)>,
}

/// A way of knowing whose values are recorded.
struct Recorded {
    source: BandSource,
    topic: String,
    words: String,
    unit: Option<Unit>,
    last: Option<Time>,
}

impl<S: Sink> MessageRecorder<S> {
    /// Begins with a run that begins with this model.
    ///
    /// # Errors
    /// Errors of the output.
    pub fn new(sink: S, known: &KnowledgeBase) -> io::Result<MessageRecorder<S>> {
        let journal = JournalWriter::new(Vec::new(), known)?;
        let (ways, scene) = (Vec::new(), Scene::default());
        Ok(MessageRecorder { sink, journal, ways, scene, version: None, events: 0, observed: None })
    }

    /// Records an input; call it before the input is given to the run.
    ///
    /// # Errors
    /// Errors of the output.
    pub fn input(&mut self, given: Given<'_>) -> io::Result<()> {
        self.journal.record(given)?;
        if let Given::Input(Input::Observation(observation)) = given {
            self.observed = Some((observation.signal, observation.received));
        }
        let time = given.time();
        let lines = std::mem::take(self.journal.output_mut());
        for line in lines.split(|byte| *byte == b'\n').filter(|line| !line.is_empty()) {
            let (topic, kind, about) = (journal::TOPIC, Kind::Journal, &BTreeMap::new);
            self.sink.write(&Message { topic, kind, time, data: line, about })?;
        }
        Ok(())
    }

    /// Records what has followed from the last inputs; call it after each observation, with the number of publications that are
    /// recorded already.
    ///
    /// # Errors
    /// Errors of the output.
    pub fn look(&mut self, run: &Run, publications: usize) -> io::Result<()> {
        let version = run.engine.knowledge().version();
        if self.version.replace(version) != Some(version) {
            self.follow(run);
            for signal in run.engine.knowledge().signals().ids() {
                self.verdict(run, signal)?;
            }
        }
        if let Some((signal, received)) = self.observed.take() {
            self.reading(run, signal, received)?;
        }
        for (known, publication) in run.publications_with_models(publications) {
            self.need(known, publication)?;
        }
        for number in self.events..run.events.len() {
            self.events = number + 1;
            self.decision(run, number)?;
        }
        self.draw(run, false)?;
        self.news_of_ways(run)
    }

    /// Drops the outputs of the run that are recorded, so that a run without end needs no more memory.
    pub fn forget(&mut self, run: &mut Run) {
        run.forget();
        self.events = 0;
    }

    /// Writes out what is buffered: the file can be read up to here from then on.
    ///
    /// # Errors
    /// Errors of the output.
    pub fn flush(&mut self) -> io::Result<()> {
        self.sink.flush()
    }

    /// Ends the file. Returns a layout for Foxglove that shows needs, ways, verdicts and decisions; it is in the file, too.
    ///
    /// # Errors
    /// Errors of the output.
    pub fn finish(&mut self, run: &Run) -> io::Result<Value> {
        self.draw(run, true)?;
        let layout = layout::layout(&run.engine);
        self.sink.finish(&layout)?;
        Ok(layout)
    }

    /// Follows another model, whose ways have other numbers; topics with the same name continue.
    fn follow(&mut self, run: &Run) {
        self.scene.follow(&run.engine);
        let known = run.engine.knowledge();
        let before = std::mem::take(&mut self.ways);
        for (index, way) in recorded_ways(&run.engine) {
            let variable = &known.variables()[way.substitution.sink];
            let words = way.describe(known);
            let topic = way_topic(known, way);
            let last = before.iter().find(|it| it.topic == topic).and_then(|it| it.last);
            let source = BandSource::Way(index, way.clone());
            self.ways.push(Recorded { source, topic, words, unit: variable.unit.clone(), last });
        }
    }

    fn reading(&mut self, run: &Run, id: SignalId, time: Time) -> io::Result<()> {
        let signal = &run.engine.knowledge().signals()[id];
        let port = run.engine.monitor().ports().find(id);
        let Some(value) = port.and_then(|port| port.hull()) else { return Ok(()) };
        let message = Value::Object(interval(value, signal.unit.as_ref()));
        let about = || about("signal", &signal.name, signal.unit.as_ref());
        let topic = topic("signals", &signal.name);
        tell(&mut self.sink, &topic, Kind::Interval, time, &message.to_string(), &about)
    }

    fn need(&mut self, known: &KnowledgeBase, publication: &Publication) -> io::Result<()> {
        let need = &known.needs()[publication.need];
        let PublishedValue::Scalar(value) = &publication.value else { return Ok(()) };
        let unit = known.variables()[need.variable].unit.as_ref();
        let mut message = interval(*value, unit);
        message.insert("quality".to_owned(), json!(publication.quality.name()));
        message.insert("source".to_owned(), json!(words::served_by(&publication.source)));
        let message = Value::Object(message).to_string();
        let about = || about("need", &need.signal, unit);
        let topic = topic("needs", &need.signal);
        tell(&mut self.sink, &topic, Kind::Need, publication.time, &message, &about)
    }

    fn verdict(&mut self, run: &Run, id: SignalId) -> io::Result<()> {
        let engine = &run.engine;
        let signal = &engine.knowledge().signals()[id];
        let message = json!({
            "verdict": event::verdict(engine.absence(id), engine.verdict(id)),
            "symptom": engine.fault(id).map(Symptom::name),
        });
        let about = || about("signal", &signal.name, None);
        let topic = topic("verdicts", &signal.name);
        tell(&mut self.sink, &topic, Kind::Verdict, run.last, &message.to_string(), &about)
    }

    fn decision(&mut self, run: &Run, number: usize) -> io::Result<()> {
        let Some((known, decided)) = run.events_with_models().nth(number) else { return Ok(()) };
        let fields = event::fields(known, decided);
        let because = words::reasons(&decided.because);
        let subject = ["signal", "relation", "need", "variable"];
        let subject =
            subject.iter().find_map(|key| fields.get(*key)?.as_str()).unwrap_or_default().to_owned();
        let log = json!({
            "timestamp": { "sec": decided.time.0.div_euclid(1_000_000_000), "nsec": decided.time.0.rem_euclid(1_000_000_000) },
            "level": level(decided.kind),
            "message": format!("{} {subject}: {because}", decided.kind.name()),
            "name": subject,
            "file": "",
            "line": 0,
        });
        let data = Value::Object(fields).to_string();
        self.scene.note();
        let sink = &mut self.sink;
        tell(sink, DECISIONS, Kind::Decision, decided.time, &data, &BTreeMap::new)?;
        tell(sink, LOG, Kind::Log, decided.time, &log.to_string(), &BTreeMap::new)?;
        let present = decided.signal.and_then(|id| run.engine.knowledge().signal(&known.signals()[id].name));
        present.map_or(Ok(()), |signal| self.verdict(run, signal))
    }

    /// Draws the graph where it may have changed.
    fn draw(&mut self, run: &Run, is_last: bool) -> io::Result<()> {
        let Some(drawn) = self.scene.news(&run.engine, run.last, is_last) else { return Ok(()) };
        tell(&mut self.sink, GRAPH, Kind::Graph, run.last, &drawn.to_string(), &BTreeMap::new)
    }

    fn news_of_ways(&mut self, run: &Run) -> io::Result<()> {
        let MessageRecorder { sink, ways, .. } = self;
        for way in ways {
            let from = way.last.map_or(Bound::Included(run.first), Bound::Excluded);
            let mut result = Ok(());
            let Recorded { source, topic, words, unit, last } = way;
            source.news(&run.engine, from, Time::MAX, |sample| {
                *last = Some(sample.validity.to);
                let middle = sample.validity.from + Span(sample.validity.length().0 / 2);
                let message = Value::Object(interval(sample.value, unit.as_ref())).to_string();
                let about = || about("way", words, unit.as_ref());
                if result.is_ok() {
                    result = tell(sink, topic, Kind::Interval, middle, &message, &about);
                }
            });
            result?;
        }
        Ok(())
    }
}

fn tell(
    sink: &mut impl Sink,
    topic: &str,
    kind: Kind,
    time: Time,
    data: &str,
    about: &dyn Fn() -> BTreeMap<String, String>,
) -> io::Result<()> {
    sink.write(&Message { topic, kind, time, data: data.as_bytes(), about })
}

/// The level of a decision in a log: 2 information, 3 warning, 4 error.
fn level(kind: EventKind) -> u8 {
    match kind.severity() {
        Severity::Info => 2,
        Severity::Warning => 3,
        Severity::Error => 4,
    }
}

/// A value in a unit; an infinite bound is null.
fn interval(value: Interval, unit: Option<&Unit>) -> serde_json::Map<String, Value> {
    let shown = |si: f64| unit.map_or(si, |unit| unit.from_si(si));
    let (lo, hi) = (shown(value.lo()), shown(value.hi()));
    let number = |value: f64| if value.is_finite() { json!(value) } else { Value::Null };
    let fields = [("lo", lo), ("mid", lo / 2.0 + hi / 2.0), ("hi", hi), ("width", hi - lo)];
    fields.into_iter().map(|(name, value)| (name.to_owned(), number(value))).collect()
}

/// A topic under `/shsa`. Viewers cannot address names with other characters.
fn topic(kind: &str, name: &str) -> String {
    let is_plain = |character: char| character.is_alphanumeric() || "_/-".contains(character);
    let name: String =
        name.chars().map(|character| if is_plain(character) { character } else { '_' }).collect();
    format!("/shsa/{kind}/{}", name.trim_start_matches('/').replace("//", "/"))
}

/// The ways whose values are recorded.
fn recorded_ways(engine: &Engine) -> impl Iterator<Item = (WayIndex, &Way)> {
    let mut count: BTreeMap<_, usize> = BTreeMap::new();
    let all = (0..).map(WayIndex).zip(engine.monitor().ways());
    all.filter_map(move |(index, watched)| {
        let of_variable = count.entry(watched.variable()).or_default();
        *of_variable += 1;
        (*of_variable <= MOST_WAYS).then(|| (index, watched.computation.way()))
    })
}

fn way_topic(known: &KnowledgeBase, way: &Way) -> String {
    let variable = &known.variables()[way.substitution.sink];
    topic("ways", &format!("{}/{}", variable.name, way.describe(known)))
}

/// The facts about a channel.
fn about(what: &str, name: &str, unit: Option<&Unit>) -> BTreeMap<String, String> {
    let named = [(what.to_owned(), name.to_owned())];
    named.into_iter().chain(unit.map(|unit| ("unit".to_owned(), unit.to_string()))).collect()
}
