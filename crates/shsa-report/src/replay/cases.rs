//! The assurance cases of a replay: how each need was admitted over time, and how each claim stood.

use super::Part;
use super::picture::{Admissions, Course, NeedCase, Recorder, WayCase};
use super::strip::{Look, Piece, key, strip};
use crate::page::verdict_cell;
use shsa_core::assurance::{Admitted, Ground, Verdict};
use shsa_core::time::{Time, Validity};
use shsa_drawing::case::{Node, words};
use shsa_drawing::escaped;
use shsa_format::text::counted;

const ADMITTED: [(Look, &str); 3] = [
    (Look::Good, "what is asked is given"),
    (Look::Doubtful, "it was given, and is not known to be now"),
    (Look::Substitute, "less is given, and goes out all the same"),
];
const STANDS: [(Look, &str); 3] =
    [(Look::Good, "given"), (Look::Doubtful, "open or circular"), (Look::Bad, "refused")];

/// The cases of all needs under contract; empty without such needs.
pub(super) fn cases(part: &Part<'_>, recorder: &Recorder) -> String {
    recorder.cases.needs.iter().map(|case| of_need(part, recorder, case)).collect()
}

fn of_need(part: &Part<'_>, recorder: &Recorder, case: &NeedCase) -> String {
    let record = recorder.needs.iter().find(|record| record.signal == case.signal);
    let admitted = record.map_or(String::new(), |record| admitted(part, &case.signal, &record.admissions));
    let any_has_served = case.ways.iter().any(|way| way.has_served);
    let is_shown = |(at, way): &(usize, &WayCase)| way.has_served || !any_has_served && *at == 0;
    let shown = case.ways.iter().enumerate().filter(is_shown);
    let arguments: String = shown.map(|(_, way)| argument(part, way)).collect();
    let more = match case.more_ways {
        0 => String::new(),
        more => format!("<p class=\"note\">and {}</p>\n", counted(more, "more way")),
    };
    format!("<h3>{}</h3>\n{admitted}{}{more}{arguments}", escaped(&case.signal), ways(part, case))
}

/// On which ground a need was served over time, and at which level.
fn admitted(part: &Part<'_>, signal: &str, admissions: &Admissions) -> String {
    let scales = part.run.engine.knowledge().contracts().scales();
    let piece = |(stretch, admitted): &(Validity, Admitted)| {
        let level = admitted.level.map_or("no level".to_owned(), |level| scales.written(level));
        let look = match admitted.ground {
            Ground::Undemanded | Ground::Met => Look::Good,
            Ground::Lapsing => Look::Doubtful,
            Ground::Degraded | Ground::Warned | Ground::Overridden => Look::Substitute,
        };
        piece(part, *stretch, look, format!("{}, {level}", admitted.ground.name()))
    };
    let pieces: Vec<Piece> = admissions.all.iter().map(piece).collect();
    let label = format!("{signal}: {} of admission", counted(pieces.len(), "stretch"));
    let rows: String = pieces
        .iter()
        .take(super::page::MOST_CHANGES)
        .map(|piece| {
            let times = [piece.from, piece.to].map(|at| format!("<td class=\"number\">{at:.3} s</td>"));
            format!("<tr>{}<td class=\"name server\">{}</td></tr>\n", times.concat(), escaped(&piece.name))
        })
        .collect();
    let hidden = pieces.len().saturating_sub(super::page::MOST_CHANGES) + admissions.more;
    let more = match hidden {
        0 => String::new(),
        more => format!("<p class=\"note\">and {}</p>\n", counted(more, "more change")),
    };
    let head =
        "<th class=\"number\">from</th><th class=\"number\">to</th><th class=\"name server\">goes out</th>";
    format!(
        "{}{}{}{more}",
        strip(&pieces, part.duration().seconds(), &label),
        key(&ADMITTED),
        table(head, &rows)
    )
}

/// How each way stood over time.
fn ways(part: &Part<'_>, case: &NeedCase) -> String {
    let row = |way: &WayCase| {
        let served = if way.has_served { "yes" } else { "no" };
        let strip = way.courses.first().map(|course| course_strip(part, &way.name, course));
        format!(
            "<tr><th class=\"name\" scope=\"row\">{}</th><td>{served}</td>{}<td class=\"time\">{}</td></tr>\n",
            escaped(&way.name),
            verdict_cell(way.argument.state()),
            strip.unwrap_or_default()
        )
    };
    let rows: String = case.ways.iter().map(row).collect();
    let head =
        "<th class=\"name\">way</th><th>has served</th><th>at the end</th><th class=\"time\">over time</th>";
    table(head, &rows) + &key(&STANDS)
}

/// The drawing of a case, and its nodes over time.
fn argument(part: &Part<'_>, way: &WayCase) -> String {
    let row = |(node, course): (&Node, &Course)| {
        format!(
            "<tr><td>{}</td><td class=\"name\">{}</td>{}<td class=\"time\">{}</td></tr>\n",
            words::kind(node.kind),
            escaped(&node.text),
            verdict_cell(node.state),
            course_strip(part, &node.text, course)
        )
    };
    let drawn = match shsa_drawing::argument(&way.argument) {
        Ok(svg) => format!("<div class=\"graph\" tabindex=\"0\">{svg}</div>\n"),
        Err(too_large) => format!("<p>Not drawn: {}.</p>\n", escaped(&too_large.to_string())),
    };
    let rows: String = way.argument.nodes.iter().zip(&way.courses).map(row).collect();
    let head =
        "<th></th><th class=\"name\">what is said</th><th>at the end</th><th class=\"time\">over time</th>";
    format!("<h4>{}</h4>\n{drawn}{}", escaped(&way.name), table(head, &rows))
}

fn course_strip(part: &Part<'_>, of: &str, course: &Course) -> String {
    let stretches = course.stretches();
    let piece = |(stretch, verdict): &(Validity, Verdict)| {
        let look = match verdict {
            Verdict::Holds => Look::Good,
            Verdict::Open | Verdict::Circular => Look::Doubtful,
            Verdict::Refused => Look::Bad,
        };
        piece(part, *stretch, look, words::verdict(*verdict).to_owned())
    };
    let pieces: Vec<Piece> = stretches.iter().map(piece).collect();
    strip(&pieces, part.duration().seconds(), &format!("{of}: {}", counted(pieces.len(), "stretch")))
}

fn piece(part: &Part<'_>, stretch: Validity, look: Look, name: String) -> Piece {
    let since = |time: Time| (time - part.run.first).seconds();
    Piece { from: since(stretch.from), to: since(stretch.to.min(part.run.last)), look, name }
}

fn table(head: &str, rows: &str) -> String {
    if rows.is_empty() {
        return String::new();
    }
    format!(
        "<div class=\"wide\" tabindex=\"0\"><table class=\"list\"><thead><tr>{head}</tr></thead>\n<tbody>\n{rows}</tbody></table></div>\n"
    )
}
