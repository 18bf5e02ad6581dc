//! The common parts of every page for the browser: one file, without scripts and external resources.

use shsa_core::assurance::Verdict;
use shsa_format::case::words;

/// A page. `title` is escaped already, `kind` is a word for the kind of page, `lead` and `body` are HTML.
pub(crate) fn document(title: &str, kind: &str, lead: &str, body: &str) -> String {
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{title}: {kind}</title>\n<style>\n{css}</style>\n</head>\n<body>\n\
         <header><h1>{title}</h1>\n<p>{lead}</p></header>\n\
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

/// A cell with a verdict, shown by a sign as well as by colour.
pub(crate) fn verdict_cell(verdict: Verdict) -> String {
    let (class, sign) = match verdict {
        Verdict::Holds => ("yes", '\u{2713}'),
        Verdict::Open | Verdict::Circular => ("quiet", '?'),
        Verdict::Refused => ("no", '\u{2717}'),
    };
    format!("<td class=\"{class}\">{sign} {}</td>", words::verdict(verdict))
}
