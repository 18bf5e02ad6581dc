//! The results of a replay as one page for the browser, without scripts and external resources.

use super::bands::chart;
use super::cases::cases;
use super::needs::NeedReport;
use super::picture::{NeedRecord, Recorder, Stretches};
use super::strip::{Look, Piece, key, strip};
use super::{Part, Report, difference_from_si, verdict};
use crate::events::subject;
use crate::explanation::listed_items;
use crate::page::{document, section};
use shsa_core::engine::{Event, EventKind, Severity};
use shsa_core::knowledge::KnowledgeBase;
use shsa_core::time::{Time, Validity};
use shsa_drawing::escaped;
use shsa_format::text::counted;
use shsa_format::words;
use std::fmt::Write;

/// The most events, and the most changes of a need's source, that are listed.
const MOST_EVENTS: usize = 2_000;
pub(super) const MOST_CHANGES: usize = 100;

const NEEDS: &str = "What had to be known, and how much of the time it was: a value that is older than the need allows does not \
    count. Below each strip stand the bands of all ways of knowing it; hatched is where two of them cannot both be right.";
const SIGNALS: &str = "Every input, how often it came, and when it was not trusted.";
const CASES: &str = "Which contracts let each value out, and the argument for it: claims that rest on claims of others and on \
    evidence, each as it stands at the end and as it stood over time. Nothing rests on itself, and what is not known supports nothing.";
const EVENTS: &str = "Every decision, with what spoke for and against it.";

/// The looks of the strips: how a need is served, and how a signal is accused.
const SERVED: [(Look, &str); 4] = [
    (Look::Good, "from its own source"),
    (Look::Substitute, "from a substitute"),
    (Look::Doubtful, "uncertain"),
    (Look::Bad, "not served"),
];
const ACCUSED: [(Look, &str); 2] = [(Look::Doubtful, "suspected"), (Look::Bad, "failed or silent")];

/// Of what, and how a page was made.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Provenance {
    /// The name of the model's file.
    pub model: String,
    /// Its text.
    pub text: String,
    /// The SHA-256 of its bytes, in hexadecimal digits.
    pub hash: String,
    /// The command, ready for a shell.
    pub command: String,
}

/// The page of a report.
pub(super) struct Page<'a> {
    pub(super) report: &'a Report<'a>,
}

impl Page<'_> {
    /// Writes the page; there is a recorder for each part.
    pub(super) fn write(&self, recorders: &[Recorder], made: &Provenance) -> String {
        let title = escaped(&made.model);
        let lead = format!(
            "{} over {:.1} s{}: {}.",
            counted(self.report.observations(), "observation"),
            self.report.duration().seconds(),
            if self.report.parts.len() > 1 {
                format!(" in {} sessions", self.report.parts.len())
            } else {
                String::new()
            },
            if self.report.all_met() { "every need was met" } else { "not every need was met" },
        );
        let mut body = self.tiles();
        for (at, (part, recorder)) in self.report.parts.iter().zip(recorders).enumerate() {
            let of = self.report.number(at).map_or(String::new(), |number| format!(" in session {number}"));
            body += &section(&format!("Needs{of}"), NEEDS, &self.needs_of_page(at, part, recorder));
            body += &section(&format!("Assurance{of}"), CASES, &cases(part, recorder));
            body += &section(&format!("Decisions{of}"), EVENTS, &decisions(part, recorder));
            body += &section(&format!("Signals{of}"), SIGNALS, &self.signals_of_page(part));
        }
        body += &section("Remarks", "", &self.remarks());
        body += &section("The model", "", &model(made));
        document(&title, "replay", &escaped(&lead), &body)
    }

    fn tiles(&self) -> String {
        let met = self.report.needs.iter().filter(|need| need.met).count();
        let events: usize = self.report.parts.iter().map(|part| part.run.events.len()).sum();
        let tile =
            |number: &str, of: &str| format!("<div class=\"tile\"><b>{number}</b><span>{of}</span></div>\n");
        let tiles = [
            tile(&format!("{met} of {}", self.report.needs.len()), "needs met all the time"),
            tile(&events.to_string(), "decisions"),
            tile(&self.report.knowledge.signals().len().to_string(), "signals"),
            tile(&format!("{:.1} s", self.report.duration().seconds()), "replayed"),
        ];
        format!("<div class=\"tiles\">\n{}</div>\n", tiles.concat())
    }

    fn needs_of_page(&self, at: usize, part: &Part<'_>, recorder: &Recorder) -> String {
        let reports = self.report.needs_of.get(at).map_or(&[][..], Vec::as_slice);
        let of = |report: &NeedReport| {
            let need = &self.report.knowledge.needs()[report.id];
            let record = recorder.needs.iter().find(|record| record.signal == need.signal)?;
            Some(self.need_of_page(part, report, record) + &self.band_chart(part, recorder, record))
        };
        reports.iter().filter_map(of).collect()
    }

    fn need_of_page(&self, part: &Part<'_>, report: &NeedReport, record: &NeedRecord) -> String {
        let need = &self.report.knowledge.needs()[report.id];
        let unit = self.report.knowledge.variables()[need.variable].unit.as_ref();
        let unit = unit.map_or(String::new(), |unit| format!(" {unit}"));
        let widest = difference_from_si(self.report.knowledge, need.variable, report.widest);
        let availability = record.availability(part.duration()) * 100.0;
        let met = if report.met {
            "<span class=\"yes\">✓ met</span>"
        } else {
            "<span class=\"no\">✗ not met</span>"
        };
        let cells = [
            ("result", met.to_owned()),
            ("available", format!("{availability:.2} %")),
            ("largest gap", words::span(report.longest_gap)),
            ("allowed", words::span(need.max_age)),
            ("values", report.published.to_string()),
            ("widest", escaped(&format!("{}{unit}", rounded(widest)))),
        ];
        let cells: String =
            cells.iter().map(|(name, value)| format!("<div><dt>{name}</dt><dd>{value}</dd></div>")).collect();
        format!(
            "<h3>{}</h3>\n<dl class=\"facts\">{cells}</dl>\n{}{}",
            escaped(self.report.knowledge.need_name(report.id)),
            served(part, record),
            sources(part, record),
        )
    }

    fn band_chart(&self, part: &Part<'_>, recorder: &Recorder, need: &NeedRecord) -> String {
        let variable = recorder.variables.iter().find(|it| it.name == need.variable);
        let drawn = variable.map(|variable| chart(part, need, variable).svg());
        drawn.map_or(String::new(), |svg| format!("<div class=\"graph bands\" tabindex=\"0\">{svg}</div>\n"))
    }

    fn signals_of_page(&self, part: &Part<'_>) -> String {
        let head = "<thead><tr><th class=\"name\">signal</th><th>at the end</th><th class=\"time\">not trusted</th>\
            <th class=\"number\">values</th><th class=\"number\">late</th><th class=\"number\">invalid</th>\
            <th class=\"number\">missing</th></tr></thead>";
        let mut rows = String::new();
        for (id, signal) in self.report.knowledge.signals().enumerate() {
            let counts = self.report.counts(&signal.name, std::slice::from_ref(part));
            let wrong = counts.invalid + counts.out_of_range + counts.too_fast;
            let pieces = accused(part, &signal.name);
            let label = match pieces.len() {
                0 => format!("{} was never accused", signal.name),
                count => format!("{}: {}", signal.name, counted(count, "stretch of doubt")),
            };
            let _ = writeln!(
                rows,
                "<tr><th class=\"name\" scope=\"row\">{}</th><td>{}</td><td class=\"time\">{}</td><td class=\"number\">{}</td>\
                 <td class=\"number\">{}</td><td class=\"number\">{wrong}</td><td class=\"number\">{}</td></tr>",
                escaped(&signal.name),
                signed(verdict(part.run, &signal.name)),
                strip(&pieces, part.duration().seconds(), &label),
                counts.accepted,
                counts.late,
                self.report.missing(id),
            );
        }
        format!(
            "<div class=\"wide\" tabindex=\"0\"><table class=\"list\">{head}<tbody>\n{rows}</tbody></table></div>\n{}",
            key(&ACCUSED)
        )
    }

    fn remarks(&self) -> String {
        let notes = self.report.notes.iter().map(shsa_format::comparisons::Noted::text);
        let items: String = self
            .report
            .warnings
            .iter()
            .cloned()
            .chain(notes)
            .map(|text| format!("<li>{}</li>\n", escaped(&text)))
            .collect();
        if items.is_empty() { items } else { format!("<ul>\n{items}</ul>\n") }
    }
}

/// A verdict with a sign, so that it does not depend on colour.
fn signed(verdict: &str) -> String {
    let (class, sign) = match verdict {
        "healthy" => ("yes", "✓"),
        "suspect" => ("no", "?"),
        "failed" => ("no", "✗"),
        "silent" => ("no", "○"),
        _ => ("quiet", "·"),
    };
    format!("<span class=\"{class}\">{sign} {verdict}</span>")
}

/// When and how a need was served.
fn served(part: &Part<'_>, record: &NeedRecord) -> String {
    let of = |stretches: Vec<Validity>, (look, name): (Look, &'static str)| {
        let begins = part.run.first;
        stretches.into_iter().map(move |each| Piece {
            from: (each.from - begins).seconds(),
            to: (each.to - begins).seconds(),
            look,
            name: name.to_owned(),
        })
    };
    let stretches = [&record.good, &record.substitute, &record.uncertain, &record.outages];
    let pieces: Vec<Piece> = stretches
        .into_iter()
        .map(Stretches::get)
        .zip(SERVED)
        .flat_map(|(all, shown)| of(all, shown))
        .collect();
    let outages = record.outages.get().len();
    let label = format!("{} over time: {} without a value", record.signal, counted(outages, "stretch"));
    strip(&pieces, part.duration().seconds(), &label) + &key(&SERVED)
}

/// The sources of a need, with their times.
fn sources(part: &Part<'_>, record: &NeedRecord) -> String {
    let end = part.run.last;
    let ends = record.sources.iter().skip(1).map(|(at, _)| *at).chain([end]);
    let mut rows = String::new();
    for ((from, source), to) in record.sources.iter().zip(ends).take(MOST_CHANGES) {
        let source = source.as_deref().map_or("<span class=\"no\">✗ nothing</span>".to_owned(), escaped);
        let (from_s, to_s) = (part.since(*from), part.since(to));
        let _ = writeln!(
            rows,
            "<tr><td class=\"number\">{from_s:.3} s</td><td class=\"number\">{to_s:.3} s</td><td class=\"name server\">{source}</td></tr>"
        );
    }
    if rows.is_empty() {
        return "<p class=\"note\">It was served by nothing.</p>\n".to_owned();
    }
    let more = (record.sources.len() + record.more_sources).saturating_sub(MOST_CHANGES);
    let more = if more > 0 {
        format!("<p class=\"note\">and {}</p>", counted(more, "more change"))
    } else {
        String::new()
    };
    format!(
        "<div class=\"wide\" tabindex=\"0\"><table class=\"list\"><thead><tr><th class=\"number\">from</th><th class=\"number\">to</th><th class=\"name server\">served by</th></tr></thead>\
         <tbody>\n{rows}</tbody></table></div>{more}\n"
    )
}

/// The stretches in which a signal was accused: each event lasts until the next one about the signal.
fn accused(part: &Part<'_>, name: &str) -> Vec<Piece> {
    let is_about = |known: &KnowledgeBase, event: &Event| {
        event.signal.is_some_and(|signal| known.signals()[signal].name == name)
    };
    let about: Vec<(Time, EventKind)> = part
        .run
        .events_with_models()
        .filter(|(known, event)| is_about(known, event))
        .map(|(_, event)| (event.time, event.kind))
        .collect();
    let begins = part.run.first;
    let ends = about.iter().skip(1).map(|(at, _)| *at).chain([part.run.last]);
    let piece = |((from, kind), to): (&(Time, EventKind), Time)| {
        let look = match kind.severity() {
            _ if !kind.accuses() => return None,
            Severity::Error => Look::Bad,
            Severity::Warning | Severity::Info => Look::Doubtful,
        };
        let (from, to) = ((*from - begins).seconds(), (to - begins).seconds());
        Some(Piece { from, to, look, name: kind.name().to_owned() })
    };
    about.iter().zip(ends).filter_map(piece).collect()
}

/// Every decision; for an accusation, with the evidence for and against it.
fn decisions(part: &Part<'_>, recorder: &Recorder) -> String {
    let all = part.run.events.len();
    if all == 0 {
        return "<p>No decisions: nothing failed, nothing was substituted.</p>\n".to_owned();
    }
    let decision = |(number, (known, event)): (usize, (&KnowledgeBase, &Event))| {
        let because = escaped(&words::reasons(&event.because));
        let source = event.substitution.as_ref().map_or(String::new(), |source| {
            format!("<div>now served by {}</div>", escaped(&words::served_by(source)))
        });
        let explained = recorder.explained.iter().find(|(it, _)| *it == number);
        let explained = explained.map_or(String::new(), |(_, sections)| {
            let parts: String = sections
                .iter()
                .map(|it| format!("<h4>{}</h4>\n{}", it.title, listed_items(&it.items)))
                .collect();
            format!("<details><summary>who spoke for and against it</summary>{parts}</details>")
        });
        let subject = subject(known, event);
        format!(
            "<li id=\"decision-{}\"><div class=\"when\">{:.3} s</div><div class=\"kind\">{}</div>\
             <div class=\"what\"><b>{}</b><div>{because}</div>{source}{explained}</div></li>\n",
            number + 1,
            part.since(event.time),
            kind(event.kind),
            escaped(subject),
        )
    };
    let list: String = part.run.events_with_models().enumerate().take(MOST_EVENTS).map(decision).collect();
    let more = all.saturating_sub(MOST_EVENTS);
    let more = if more > 0 {
        format!("<p class=\"note\">and {}</p>\n", counted(more, "more decision"))
    } else {
        String::new()
    };
    format!("<ol class=\"timeline\">\n{list}</ol>\n{more}")
}

fn kind(kind: EventKind) -> String {
    let class = match kind.severity() {
        Severity::Error => "no",
        Severity::Warning => "doubt",
        Severity::Info => "yes",
    };
    let sign = match kind {
        EventKind::Failed | EventKind::Unhealable | EventKind::Refused => "✗",
        EventKind::Suspected => "?",
        EventKind::Silent => "○",
        EventKind::Substituted => "⇄",
        EventKind::Restored => "✓",
        EventKind::Ageing => "↗",
        EventKind::Outlier | EventKind::Restarted => "·",
    };
    format!("<span class=\"{class}\">{sign} {}</span>", kind.name())
}

fn model(made: &Provenance) -> String {
    let row = |name: &str, value: &str| {
        format!("<div><dt>{name}</dt><dd><code>{}</code></dd></div>", escaped(value))
    };
    let (version, hash) = (env!("CARGO_PKG_VERSION"), &made.hash);
    format!(
        "<dl class=\"facts lines\">{}{}{}{}</dl>\n<details><summary>the model as it was</summary>\
         <pre class=\"wide\" tabindex=\"0\">{}</pre></details>\n",
        row("file", &made.model),
        row("SHA-256", hash),
        row("shsa", version),
        row("made by", &made.command),
        escaped(&made.text),
    )
}

/// A value with four significant digits.
fn rounded(value: f64) -> String {
    let digits = if value == 0.0 || !value.is_finite() { 0.0 } else { 3.0 - value.abs().log10().floor() };
    format!("{value:.*}", digits.clamp(0.0, 9.0) as usize)
}
