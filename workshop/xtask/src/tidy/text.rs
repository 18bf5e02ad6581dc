//! Checks of a file's text: its head, its length, forbidden words.

use crate::workspace::File;
use std::collections::BTreeMap;

/// The largest length; a longer file is split by theme.
const LINES_MAX: usize = 400;

/// Words of unfinished work, written in two parts because this file is checked, too.
const UNFINISHED: [&str; 4] =
    [concat!("TO", "DO"), concat!("FIX", "ME"), concat!("todo", "!"), concat!("unimplemented", "!")];

/// The first folders of paths that exist on one machine only.
const MACHINE: [&str; 5] = [
    concat!("/ho", "me/"),
    concat!("/ro", "ot/"),
    concat!("/wo", "rk/"),
    concat!("/t", "mp/"),
    concat!("/Us", "ers/"),
];

/// A Rust file begins with a sentence about its purpose.
pub(super) fn head(file: &File) -> Option<String> {
    if !is_rust(file) {
        return None;
    }
    let head =
        file.text.lines().map_while(|line| line.strip_prefix("//!")).take_while(|line| !line.is_empty());
    let sentence = head.collect::<String>();
    let problem = if sentence.is_empty() {
        "must open with a `//!` sentence of purpose"
    } else if !sentence.contains(['.', ':']) {
        "its `//!` head is no sentence: it never ends"
    } else {
        return None;
    };
    Some(format!("{}:1: {problem}", file.path))
}

/// A file that may exceed the length.
struct Exception<'t> {
    path: &'t str,
    lines: &'t str,
    reason: &'t str,
}

impl<'t> Exception<'t> {
    /// Reads `path lines reason`; missing parts are empty.
    fn read(line: &'t str) -> Exception<'t> {
        let mut words = line.splitn(3, ' ').map(str::trim);
        let mut next = || words.next().unwrap_or_default();
        Exception { path: next(), lines: next(), reason: next() }
    }
}

/// A Rust file is short, or is in the list of exceptions with its exact length (so that the list only shrinks) and the reason for
/// being whole.
pub(super) fn lengths(files: &[File], exceptions: &str) -> Vec<String> {
    let listed = exceptions.lines().filter(|line| !line.starts_with('#') && !line.trim().is_empty());
    let mut exceptions: BTreeMap<&str, Exception<'_>> =
        listed.map(Exception::read).map(|exception| (exception.path, exception)).collect();
    let mut problems: Vec<String> = files
        .iter()
        .filter(|file| is_rust(file))
        .filter_map(|file| length(file, exceptions.remove(&*file.path)))
        .collect();
    problems.extend(
        exceptions.keys().map(|path| format!("{path}: no such file: take it off the list of exceptions")),
    );
    problems
}

fn length(file: &File, exception: Option<Exception<'_>>) -> Option<String> {
    let lines = file.text.lines().count();
    let problem = match exception {
        None if lines <= LINES_MAX => return None,
        None => format!("at most {LINES_MAX}: split it by theme"),
        Some(_) if lines <= LINES_MAX => "take it off the list of exceptions".into(),
        Some(Exception { lines: exact, .. }) if exact != lines.to_string() => {
            format!("the list of exceptions says {exact}: it must not grow, and the list follows it down")
        }
        Some(Exception { reason: "", .. }) => "the list of exceptions does not say why".into(),
        Some(_) => return None,
    };
    Some(format!("{}: {lines} lines, {problem}", file.path))
}

/// No tracked file contains unfinished work or a path of one machine.
pub(super) fn words(file: &File) -> Vec<String> {
    let place =
        |number: usize, word: &str| format!("{}:{}: `{word}` must not be here", file.path, number + 1);
    let lines = file.text.lines().enumerate();
    lines.filter_map(|(number, line)| Some(place(number, forbidden(line)?))).collect()
}

fn forbidden(line: &str) -> Option<&'static str> {
    let unfinished = UNFINISHED.into_iter().find(|word| line.contains(word));
    unfinished.or_else(|| MACHINE.into_iter().find(|folder| starts_a_path(line, folder)))
}

/// Whether a path begins with this folder: in `../home/x` or `example.org/home/` it is only a part.
fn starts_a_path(line: &str, folder: &str) -> bool {
    let is_part = |before: &str| before.ends_with(|c: char| c.is_alphanumeric() || "._~-}".contains(c));
    line.match_indices(folder).any(|(at, _)| !line.get(..at).is_some_and(is_part))
}

fn is_rust(file: &File) -> bool {
    file.path.ends_with(".rs")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(path: &str, text: &str) -> File {
        File { path: path.into(), text: text.into() }
    }

    #[test]
    fn a_head_is_a_sentence() {
        let check = |text: &str| head(&file("a.rs", text)).unwrap_or_default();
        assert_eq!(check("//! Points in time,\n//! never measured.\n"), "");
        assert_eq!(check("use x;\n"), "a.rs:1: must open with a `//!` sentence of purpose");
        assert_eq!(check("// Points in time.\n"), "a.rs:1: must open with a `//!` sentence of purpose");
        assert_eq!(check("//!\n//! Points.\n"), "a.rs:1: must open with a `//!` sentence of purpose");
        assert_eq!(check("//! Points\n"), "a.rs:1: its `//!` head is no sentence: it never ends");
        assert_eq!(head(&file("a.toml", "[package]\n")), None);
    }

    #[test]
    fn a_long_file_is_an_exception_of_exact_length_with_a_reason() {
        let files = [
            file("long.rs", &"x\n".repeat(401)),
            file("short.rs", "x\n"),
            file("long.csv", &"x\n".repeat(401)),
        ];
        let check = |exceptions: &str| lengths(&files, exceptions).join("; ");
        assert_eq!(check("# why\n\nlong.rs 401 one table\n"), "");
        assert_eq!(check(""), "long.rs: 401 lines, at most 400: split it by theme");
        let follows = "the list of exceptions says 800: it must not grow, and the list follows it down";
        assert_eq!(check("long.rs 800 one table"), format!("long.rs: 401 lines, {follows}"));
        let unexplained = "long.rs: 401 lines, the list of exceptions does not say why";
        assert_eq!([check("long.rs 401"), check("long.rs 401 ")], [unexplained, unexplained]);
        assert_eq!(
            check("long.rs 401 one table\nshort.rs 1 one line"),
            "short.rs: 1 lines, take it off the list of exceptions"
        );
        assert_eq!(
            check("long.rs 401 one table\ngone.rs 9 one type"),
            "gone.rs: no such file: take it off the list of exceptions"
        );
    }

    #[test]
    fn unfinished_work_is_found() {
        for word in UNFINISHED {
            let problems = words(&file("a.md", &format!("fine\n// {word}(x)\n")));
            assert_eq!(problems, [format!("a.md:2: `{word}` must not be here")]);
        }
    }

    #[test]
    fn paths_of_a_machine_are_found() {
        for folder in MACHINE {
            assert_eq!(words(&file("a.toml", &format!("path = \"{folder}x\""))).len(), 1);
            assert_eq!(words(&file("a.toml", &format!("path = \"..{folder}x\""))).len(), 0);
            assert_eq!(words(&file("a.md", &format!("https://example.org{folder}x"))).len(), 0);
        }
    }
}
