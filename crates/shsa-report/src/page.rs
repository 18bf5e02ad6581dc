//! The common parts of every page for the browser: one file, without scripts and external resources.

use shsa_core::assurance::Verdict;
use shsa_drawing::case::words;
use shsa_drawing::escaped;

/// A page. `title` is escaped already, `kind` is a word for the kind of page, `lead` and `body` are HTML.
pub(crate) fn document(title: &str, kind: &str, lead: &str, body: &str) -> String {
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{title}: {kind}</title>\n<style>\n{css}</style>\n</head>\n<body>\n\
         <header><p class=\"kind\">{kind}</p><h1>{title}</h1>\n<p>{lead}</p></header>\n\
         {body}<footer>shsa {version}</footer>\n</body>\n</html>\n",
        css = include_str!("page.css"),
        version = env!("CARGO_PKG_VERSION"),
    )
}

/// A part of a page with a heading and a sentence about it; empty if `body` is.
pub(crate) fn section(title: &str, about: &str, body: &str) -> String {
    let about = if about.is_empty() { String::new() } else { format!("<p>{about}</p>\n") };
    match body.is_empty() {
        true => String::new(),
        false => format!("<section>\n<h2>{title}</h2>\n{about}{body}</section>\n"),
    }
}

/// A table of texts, which are escaped here; numbers stand to the right. Empty without rows.
pub(crate) fn table(head: &[impl AsRef<str>], rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let is_number =
        |cell: &str| cell.starts_with(|first: char| first.is_ascii_digit() || "-+<>\u{2212}".contains(first));
    let cell = |cell: &String| match is_number(cell) {
        true => format!("<td class=\"number\">{}</td>", escaped(cell)),
        false => format!("<td>{}</td>", escaped(cell)),
    };
    let rows: Vec<Vec<String>> = rows.into_iter().collect();
    let Some(first) = rows.first() else { return String::new() };
    // A heading stands where the cells below it do.
    let heading = |(name, cell): (&str, &String)| {
        let class = if is_number(cell) { " class=\"number\"" } else { "" };
        format!("<th scope=\"col\"{class}>{}</th>", escaped(name))
    };
    let head: String = head.iter().map(AsRef::as_ref).zip(first).map(heading).collect();
    let row = |row: &Vec<String>| format!("<tr>{}</tr>\n", row.iter().map(cell).collect::<String>());
    framed(&head, &rows.iter().map(row).collect::<String>())
}

/// A table of rows that are HTML; the first column holds names. Empty without rows.
pub(crate) fn list(head: &[&str], rows: &[String]) -> String {
    if rows.is_empty() {
        return String::new();
    }
    let head: String = head.iter().map(|cell| format!("<th scope=\"col\">{cell}</th>")).collect();
    framed(&head, &rows.concat())
}

fn framed(head: &str, body: &str) -> String {
    format!(
        "<div class=\"wide\"><table class=\"list\">\n<thead><tr>{head}</tr></thead>\n<tbody>\n{body}</tbody>\n</table></div>\n"
    )
}

/// Paragraphs, which are escaped here.
pub(crate) fn paragraphs(lines: impl IntoIterator<Item = impl AsRef<str>>) -> String {
    lines.into_iter().map(|line| format!("<p>{}</p>\n", escaped(line.as_ref()))).collect()
}

/// A cell with a verdict, shown by a sign as well as by colour.
pub(crate) fn verdict_cell(verdict: Verdict) -> String {
    let (class, sign) = match verdict {
        Verdict::Holds => ("yes", '\u{2713}'),
        Verdict::Open | Verdict::Circular => ("quiet", '?'),
        Verdict::Refused => ("no", '\u{2717}'),
    };
    format!("<td class=\"{class}\">{sign} {}</td>", words::verdict(verdict))
}
