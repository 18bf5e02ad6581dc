//! The table of contents, read from the links of the pages.
//!
//! The README's section on doors names the chapters. From there the pages are visited breadth first, and each page becomes a part of the
//! page that links it first. A link to a heading refers to a part of a page and lists nothing. So a page moves in the site when a reader's
//! way to it moves, and nobody has to keep a second list.
//!
//! ```text
//! README.md  "* **[Use](docs/use.md)** it on recordings"     - [Use](docs/use.md)
//! docs/use.md  "| [the tutorial](tutorial.md) |"               - [From a CSV file to an alarm](docs/tutorial.md)
//! ```

use anyhow::{Context, Result, ensure};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fmt::Write as _;

/// The first page.
const HOME: &str = "README.md";
/// The heading of the home page above the list of doors.
const DOORS: &str = "## Four doors";

/// A folder whose pages belong to one page, whoever else links them.
pub(super) struct Behind {
    pub(super) folder: &'static str,
    pub(super) page: &'static str,
}

/// Measured documents.
pub(super) const MEASURED: Behind = Behind { folder: "workshop/measured/", page: "docs/proven.md" };
/// The folders of which every page has to be in the site.
const WHOLE: [&str; 2] = ["docs/", MEASURED.folder];

/// The pages of the site in reading order.
pub(super) struct Contents {
    pages: Vec<Page>,
}

struct Page {
    path: String,
    title: String,
    /// 0 for a door.
    depth: usize,
}

impl Contents {
    /// Arranges the pages, given by their paths.
    ///
    /// # Errors
    /// When there is no home page with doors, a linked page has no title, or no door leads to a page that has to be in the site.
    pub(super) fn read(texts: &BTreeMap<String, String>) -> Result<Contents> {
        let home = texts.get(HOME).with_context(|| format!("there is no {HOME}"))?;
        let doors = doors(home);
        ensure!(!doors.is_empty(), "{HOME} has no list of links below `{DOORS}`");
        let parts = visit(&doors, texts);
        let mut contents = Contents { pages: Vec::new() };
        for door in &doors {
            contents.place(door, 0, &parts, texts)?;
        }
        let placed: BTreeSet<&str> = contents.paths().collect();
        let lonely = texts.keys().filter(|path| WHOLE.iter().any(|folder| path.starts_with(folder)));
        let lonely: Vec<&str> = lonely.map(String::as_str).filter(|path| !placed.contains(path)).collect();
        ensure!(lonely.is_empty(), "no door leads to {}", lonely.join(", "));
        Ok(contents)
    }

    /// A page with all its parts below it.
    fn place(
        &mut self,
        path: &str,
        depth: usize,
        parts: &BTreeMap<String, Vec<String>>,
        texts: &BTreeMap<String, String>,
    ) -> Result<()> {
        let text = texts.get(path).with_context(|| format!("there is no page {path}"))?;
        let title = text.lines().find_map(|line| line.strip_prefix("# "));
        let title = title.with_context(|| format!("{path}: a page needs a line `# Title`"))?.to_owned();
        self.pages.push(Page { path: path.to_owned(), title, depth });
        for part in parts.get(path).into_iter().flatten() {
            self.place(part, depth + 1, parts, texts)?;
        }
        Ok(())
    }

    /// The paths of all pages, the home page first.
    pub(super) fn paths(&self) -> impl Iterator<Item = &str> {
        [HOME].into_iter().chain(self.pages.iter().map(|page| &*page.path))
    }

    /// The text of mdBook's `SUMMARY.md`.
    pub(super) fn summary(&self) -> String {
        let mut text = format!("# Summary\n\n[shsa]({HOME})\n\n");
        for page in &self.pages {
            let _ = writeln!(text, "{:1$}- [{2}]({3})", "", 2 * page.depth, page.title, page.path);
        }
        text
    }
}

/// The first link of each item of the list of doors.
fn doors(home: &str) -> Vec<String> {
    let items =
        home.lines().skip_while(|line| *line != DOORS).skip(1).take_while(|line| !line.starts_with('#'));
    items
        .filter(|line| line.starts_with("* "))
        .filter_map(|item| Some(targets(HOME, item).next()?.0))
        .collect()
}

/// The parts of each page: those that it links first, breadth first from the doors.
fn visit(doors: &[String], texts: &BTreeMap<String, String>) -> BTreeMap<String, Vec<String>> {
    let mut parts: BTreeMap<String, Vec<String>> = BTreeMap::new();
    let mut seen: BTreeSet<String> = doors.iter().cloned().chain([HOME.to_owned()]).collect();
    let mut waiting: VecDeque<String> = doors.iter().cloned().collect();
    while let Some(page) = waiting.pop_front() {
        let text = texts.get(&page).map_or("", String::as_str);
        for (target, heading) in targets(&page, text) {
            let is_elsewhere = target.starts_with(MEASURED.folder) && page != MEASURED.page;
            if heading.is_none()
                && texts.contains_key(&target)
                && !is_elsewhere
                && seen.insert(target.clone())
            {
                parts.entry(page.clone()).or_default().push(target.clone());
                waiting.push_back(target);
            }
        }
    }
    parts
}

/// What the links of a page lead to within the project, with the heading that they name; code is passed over.
pub(super) fn targets<'t>(page: &'t str, text: &'t str) -> impl Iterator<Item = (String, Option<&'t str>)> {
    let prose = text.split("```").step_by(2).flat_map(|part| part.split('`').step_by(2));
    let links =
        prose.flat_map(|part| part.split("](").skip(1)).filter_map(|rest| Some(rest.split_once(')')?.0));
    let inside = links.filter(|link| !link.contains("://") && !link.starts_with('#'));
    inside.map(move |link| match link.split_once('#') {
        Some((file, heading)) => (beside(page, file), Some(heading)),
        None => (beside(page, link), None),
    })
}

/// The path of a file that is named relative to a page.
fn beside(page: &str, file: &str) -> String {
    let mut parts: Vec<&str> = page.split('/').collect();
    parts.pop();
    for part in file.split('/') {
        match part {
            ".." => drop(parts.pop()),
            "." | "" => {}
            _ => parts.push(part),
        }
    }
    parts.join("/")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(pages: &[(&str, &str)]) -> BTreeMap<String, String> {
        pages.iter().map(|(path, text)| ((*path).to_owned(), (*text).to_owned())).collect()
    }

    const README: (&str, &str) = (
        "README.md",
        "[a](docs/a.md)\n## Four doors\n* [Use](docs/use.md), and [b](docs/b.md)\n* MIT\n* [Do](docs/do.md)\n",
    );

    #[track_caller]
    fn check(pages: &[(&str, &str)], expected: &str) {
        let texts = texts(&[&[README], pages].concat());
        let found = Contents::read(&texts).map_or_else(|error| error.to_string(), |it| it.summary());
        assert_eq!(found.trim_start_matches("# Summary\n\n[shsa](README.md)\n\n"), expected);
    }

    #[test]
    fn a_page_belongs_to_the_page_that_links_it_first() {
        let pages = [
            ("docs/use.md", "# Use\n[a](a.md) [b, a part](b.md#x) [out](https://a.b/docs/c.md) `[c](c.md)`"),
            ("docs/do.md", "# Do\n[b](b.md) [a](a.md) [home](../README.md)"),
            ("docs/a.md", "# A\n[b](b.md) [up](../C.md)"),
            ("docs/b.md", "# B\n[use](use.md)"),
            ("C.md", "# C\n"),
            ("not/linked.md", ""),
        ];
        check(
            &pages,
            "- [Use](docs/use.md)\n  - [A](docs/a.md)\n    - [C](C.md)\n- [Do](docs/do.md)\n  - [B](docs/b.md)\n",
        );
    }

    #[test]
    fn measured_pages_are_behind_the_page_of_proofs() {
        let pages = [
            ("docs/use.md", "# Use\n[m](../workshop/measured/m.md)"),
            ("docs/do.md", "# Do\n[proven](proven.md)"),
            ("docs/proven.md", "# Proven\n[m](../workshop/measured/m.md)"),
            ("workshop/measured/m.md", "# M\n"),
        ];
        let expected = "- [Use](docs/use.md)\n- [Do](docs/do.md)\n  - [Proven](docs/proven.md)\n    - [M](workshop/measured/m.md)\n";
        check(&pages, expected);
    }

    #[test]
    fn a_page_without_a_way_to_it_is_an_error() {
        let doors = [("docs/use.md", "# Use\n"), ("docs/do.md", "# Do\n")];
        check(&[&doors[..], &[("docs/a.md", "# A\n")]].concat(), "no door leads to docs/a.md");
        check(&doors[..1], "there is no page docs/do.md");
        check(&[doors[0], ("docs/do.md", "Do\n")], "docs/do.md: a page needs a line `# Title`");
    }
}
