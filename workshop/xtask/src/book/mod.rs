//! The documents as a site, made by mdBook: read the pages' links, arrange them below the four doors, build, check every link.
//!
//! No list of the pages is kept by hand: `contents` reads it from the links of the pages, as a reader on a forge follows them, and `site`
//! reads the finished HTML again. Run `cargo xtask book`, then open `target/book/site/index.html`.

mod contents;
mod site;

use crate::{command, needs, workspace};
use anyhow::{Context, Result, ensure};
use contents::Contents;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// What mdBook reads: copies of the pages and of the files that they show or link, at the same relative paths.
const SOURCE: &str = "target/book/src";
/// What it writes.
const SITE: &str = "target/book/site";
/// The preprocessors stay off: they rename each README and would expand braces that are part of a text. The printed page is off, as it
/// joins all pages in one, in which their anchors collide.
const CONFIGURATION: &str = r##"[book]
title = "shsa"
src = "src"
language = "en"

[build]
build-dir = "site"
create-missing = false
use-default-preprocessors = false

[output.html]
additional-css = ["wide.css"]
smart-punctuation = false
input-404 = ""

[output.html.print]
enable = false

[output.html.fold]
enable = true
level = 1

[output.html.search]
limit-results = 30
boost-title = 4
"##;
/// Tables of the reference have long cells: pages are wider than mdBook's 750 px.
const STYLE: &str = ":root { --content-max-width: 960px; }\n";

/// Builds the site and checks its links.
///
/// # Errors
/// When mdBook is absent and cannot be installed, a page cannot be reached from a door, or a link leads nowhere.
pub(crate) fn write() -> Result<()> {
    needs::provide_for_book()?;
    let texts = pages()?;
    let contents = Contents::read(&texts)?;
    copy(&contents, &texts)?;
    let mdbook = ["target/book-tools/bin/mdbook", "build", "target/book"];
    command::run(&mdbook)?;
    let checked = site::check(Path::new(SITE))?;
    println!("{} pages and {checked} links; open {SITE}/index.html", contents.paths().count());
    Ok(())
}

/// The text of each Markdown file of the project, by its path.
fn pages() -> Result<BTreeMap<String, String>> {
    let files = workspace::files()?.into_iter();
    let pages = files.filter(|file| Path::new(&file.path).extension().is_some_and(|it| it == "md"));
    Ok(pages.map(|file| (file.path, file.text)).collect())
}

/// Lays out what mdBook reads, without anything of an earlier build.
fn copy(contents: &Contents, texts: &BTreeMap<String, String>) -> Result<()> {
    let _ = fs::remove_dir_all("target/book");
    place("../book.toml", CONFIGURATION.as_bytes())?;
    place("../wide.css", STYLE.as_bytes())?;
    place("SUMMARY.md", contents.summary().as_bytes())?;
    for path in contents.paths() {
        let text = texts.get(path).with_context(|| format!("{path}: no such page"))?;
        place(path, text.as_bytes())?;
        for (file, _) in contents::targets(path, text).filter(|(file, _)| !texts.contains_key(file)) {
            ensure!(Path::new(&file).is_file(), "{path} links {file}, which is not a file");
            place(&file, &fs::read(&file).with_context(|| format!("reading {file}"))?)?;
        }
    }
    Ok(())
}

/// Writes a file below the source folder.
fn place(path: &str, bytes: &[u8]) -> Result<()> {
    let to = Path::new(SOURCE).join(path);
    let folder = to.parent().context("a file is in a folder")?;
    fs::create_dir_all(Path::new(SOURCE))
        .and_then(|()| fs::create_dir_all(folder))
        .context("making a folder")?;
    fs::write(&to, bytes).with_context(|| format!("writing {}", to.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_page_of_the_project_stands_below_a_door() {
        let texts = pages().unwrap();
        let contents = Contents::read(&texts).unwrap();
        let summary = contents.summary();
        let indent = |path: &str| {
            let line = summary.lines().find(|line| line.ends_with(&format!("({path})"))).unwrap();
            line.len() - line.trim_start().len()
        };
        assert_eq!(indent("docs/proven.md"), 2);
        for path in texts.keys().filter(|path| path.starts_with(contents::MEASURED.folder)) {
            assert_eq!(indent(path), 4, "{path} is not behind {}", contents::MEASURED.page);
        }
    }
}
