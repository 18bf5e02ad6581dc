//! The first draft of a model: that of `shsa draft` for the numbers that were received, and what else is on the bus.

use super::Scan;
use super::text::rate;
use super::topic_record::TopicRecord;
use crate::show;
use anyhow::anyhow;
use shsa_bridge::payload::{Content, Leaf, Reader, SIZE_LIMIT};
use shsa_core::observation::RawValue;
use shsa_core::time::Time;
use shsa_lab::drafting::{Columns, Series, checked_text, draft, variable_names};
use shsa_lab::naming::{quoted, unique, unit, variable};
use shsa_message::source::{Field, StampField};
use shsa_model::live::Written;
use shsa_model::patch;
use std::collections::BTreeSet;
use std::fmt::Write as _;

/// The usual fields of time stamps.
const STAMPS: [&str; 7] = ["stamp_ns", "stamp", "timestamp", "time", "ts", "t", "header.stamp"];
/// A field counts as a stamp if it differs from the clock by no more than this, nanoseconds.
const STAMP_ERROR: u64 = 3_600_000_000_000;

/// A received field that can be a signal, and that the given model does not have.
struct Received<'s> {
    topic: &'s str,
    record: &'s TopicRecord,
    leaf: &'s Leaf,
    stamp: Option<&'static str>,
}

/// The model of all fields that the given model does not have. Numbers that change are drafted as those of a recording; lists, and
/// numbers that stood still, are signals with what little is known of them.
///
/// # Errors
/// When a thread panics, or the draft is no valid model.
pub(crate) fn drafted(scan: &Scan) -> anyhow::Result<String> {
    let received = received(scan);
    let origin = format!("{} s of {}", scan.seconds, scan.bus);
    let (moving, others): (Vec<Received<'_>>, Vec<Received<'_>>) =
        received.into_iter().partition(Received::moves);
    let start = moving.iter().flat_map(|one| one.values().first()).map(|first| first.0.0).min().unwrap_or(0);
    let mut columns = Columns::of_series(moving.iter().map(|one| one.series(start)).collect());
    let mut drafted = draft(&columns.columns, &columns.joints, &())?;
    if drafted.groups.is_empty() {
        return Ok(plain(&origin, &others.into_iter().chain(moving).collect::<Vec<_>>()));
    }
    let text = checked_text(&mut columns, &mut drafted, &origin)?;
    columns.warnings.iter().for_each(show::warn);
    if others.is_empty() {
        return Ok(text);
    }
    let mut names: BTreeSet<String> = variable_names(&columns, &drafted).into_iter().collect();
    let written = |name, text| Written { name, text };
    let rest = listed(&others, &mut names);
    patch::patched(written("draft", &text), written("received", &rest)).map_err(|report| {
        anyhow!("the draft has an error, which is a defect of this program: {}", report.render(false))
    })
}

fn received(scan: &Scan) -> Vec<Received<'_>> {
    let mut received = Vec::new();
    for (topic, record) in &scan.topics {
        let stamp = stamp_of(record);
        let is_signal = |leaf: &&Leaf| {
            let is_stamp =
                stamp.is_some_and(|stamp| leaf.path == stamp || leaf.path.starts_with(&format!("{stamp}.")));
            let is_known = scan
                .matched
                .as_ref()
                .is_some_and(|known| !known.carried(topic, record, &leaf.path).is_empty());
            matches!(leaf.content, Content::Value(_)) && !is_stamp && !is_known
        };
        let fields = record.fields.iter().filter(is_signal);
        received.extend(fields.map(|leaf| Received { topic, record, leaf, stamp }));
    }
    received
}

/// A model without figures.
fn plain(origin: &str, received: &[Received<'_>]) -> String {
    let head = format!(
        "# Drafted by `shsa draft` from {origin}.\n# To be done: units, value_error and timeout of the signals, relations, needs; \
         one variable for the signals that measure the same.\nshsa: 1\n"
    );
    match received {
        [] => format!("{head}# Nothing new was heard.\nvariables: {{}}\n"),
        received => format!("{head}{}", listed(received, &mut BTreeSet::new())),
    }
}

/// Variables and signals, each variable under a name that is not taken.
fn listed(received: &[Received<'_>], names: &mut BTreeSet<String>) -> String {
    let (mut variables, mut signals) = (String::new(), String::new());
    for one in received {
        let name = unique(&variable(one.topic, &one.leaf.path), names);
        let is_list = matches!(one.leaf.content, Content::Value(RawValue::Vector(_)));
        let shape = if is_list { " shape: vector " } else { "" };
        let guessed =
            unit(&one.leaf.path, one.topic).map_or("# unit: ?".to_owned(), |unit| format!("# unit: {unit}?"));
        let _cannot_fail = writeln!(variables, "  {name}: {{{shape}}}   {guessed}");
        let _cannot_fail = writeln!(signals, "{}", one.signal(&name));
    }
    format!("variables:\n{variables}signals:\n{signals}")
}

impl Received<'_> {
    /// When its numbers were received, with their values.
    fn values(&self) -> &[(Time, f64)] {
        self.record.values(&self.leaf.path)
    }

    fn moves(&self) -> bool {
        self.values().windows(2).any(|pair| pair[0].1 != pair[1].1)
    }

    /// The values over the seconds since a moment in nanoseconds.
    fn series(&self, start: i64) -> Series {
        let points = self.values().iter().map(|(time, value)| ((time.0 - start) as f64 * 1e-9, *value));
        let (topic, path) = (self.topic.to_owned(), self.leaf.path.clone());
        Series { topic, path, source: self.source(), points: points.collect() }
    }

    fn name(&self) -> String {
        match &*self.leaf.path {
            "" => self.topic.to_owned(),
            path => format!("{}#{path}", self.topic),
        }
    }

    fn source(&self) -> String {
        let name = self.name();
        self.stamp.map_or_else(|| name.clone(), |stamp| format!("{name}@{stamp}"))
    }

    fn signal(&self, variable: &str) -> String {
        let (name, source) = (quoted(&self.name()), quoted(&self.source()));
        let rate = self.record.rate_hz().map_or(String::new(), |hz| format!(", rate: {}", rate(hz)));
        let last = match &self.leaf.content {
            Content::Value(RawValue::Number(number)) => format!("   # last {number}"),
            Content::Value(RawValue::Vector(values)) => format!("   # {} elements", values.len()),
            _ => String::new(),
        };
        format!("  {name}: {{ variable: {variable}, source: {source}{rate} }}{last}")
    }
}

/// The field with the stamp of a topic's messages.
fn stamp_of(topic_record: &TopicRecord) -> Option<&'static str> {
    let message = topic_record.last_message.as_ref()?;
    STAMPS.into_iter().find(|stamp| {
        let value = topic_record.fields.iter().find(|leaf| matches!(leaf.content, Content::Value(_)));
        let path = value.map(|leaf| leaf.path.clone()).unwrap_or_default();
        let field = Field { path, stamp: Some(StampField { path: (*stamp).to_owned(), step: None }) };
        let Ok(mut reader) = Reader::new(&[field], SIZE_LIMIT) else { return false };
        let mut is_near = false;
        reader.read(message, |_, reading| {
            let stamp = reading.ok().and_then(|reading| reading.stamp);
            is_near = stamp.is_some_and(|stamp| stamp.0.abs_diff(message.received.0) < STAMP_ERROR);
        });
        is_near
    })
}
