//! Reads the HTML of the finished site: every link leads to a file of the site, and to an anchor in it.

use anyhow::{Context, Result, bail};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Component, Path, PathBuf};

/// What a page has that links are about.
#[derive(Default)]
struct Page {
    anchors: BTreeSet<String>,
    /// As they are written.
    links: Vec<String>,
}

/// Checks the links of all pages below a folder; returns how many there are.
///
/// # Errors
/// Names every link that leads nowhere, with its page.
pub(super) fn check(site: &Path) -> Result<usize> {
    let mut files = BTreeSet::new();
    list(site, &mut files)?;
    let mut pages = BTreeMap::new();
    for path in files.iter().filter(|path| path.extension().is_some_and(|it| it == "html")) {
        let text = fs::read_to_string(path).with_context(|| format!("reading {}", path.display()))?;
        pages.insert(path.clone(), read(&text));
    }
    let links = || pages.iter().flat_map(|(path, page)| page.links.iter().map(move |link| (path, link)));
    let broken = links().filter(|(path, link)| !leads_somewhere(path, link, &files, &pages));
    let broken: Vec<String> = broken.map(|(path, link)| format!("{}: {link}", path.display())).collect();
    if !broken.is_empty() {
        bail!("{} links lead nowhere:\n{}", broken.len(), broken.join("\n"));
    }
    Ok(links().count())
}

/// All files below a folder.
fn list(folder: &Path, files: &mut BTreeSet<PathBuf>) -> Result<()> {
    for entry in fs::read_dir(folder).with_context(|| format!("reading the folder {}", folder.display()))? {
        let path = entry?.path();
        if path.is_dir() {
            list(&path, files)?;
        } else {
            files.insert(path);
        }
    }
    Ok(())
}

/// The anchors and links of a page. Between tags, mdBook writes `"` and `<` as entities, so only attributes are found.
fn read(html: &str) -> Page {
    let mut page = Page::default();
    for tag in html.split('<').skip(1).filter_map(|rest| Some(rest.split_once('>')?.0)) {
        let mut parts = tag.split('"');
        while let (Some(name), Some(value)) = (parts.next(), parts.next()) {
            match name.trim_start().rsplit(' ').next() {
                Some("id=" | "name=") => drop(page.anchors.insert(value.to_owned())),
                Some("href=" | "src=") => page.links.push(value.replace("&amp;", "&")),
                _ => {}
            }
        }
    }
    page
}

/// Whether a link leaves the site, or leads to a file or a heading in it.
fn leads_somewhere(
    path: &Path,
    link: &str,
    files: &BTreeSet<PathBuf>,
    pages: &BTreeMap<PathBuf, Page>,
) -> bool {
    if link.contains("://") || ["data:", "mailto:"].iter().any(|start| link.starts_with(start)) {
        return true;
    }
    let (file, anchor) = link.split_once('#').unwrap_or((link, ""));
    let target = if file.is_empty() { path.to_owned() } else { beside(path, &plain(file)) };
    let has_anchor = || pages.get(&target).is_some_and(|page| page.anchors.contains(&plain(anchor)));
    files.contains(&target) && (anchor.is_empty() || has_anchor())
}

/// The path of a file that is named relative to a page.
fn beside(page: &Path, file: &str) -> PathBuf {
    let mut path = page.parent().unwrap_or(Path::new("")).to_owned();
    for part in Path::new(file).components() {
        match part {
            Component::ParentDir => drop(path.pop()),
            Component::CurDir => {}
            other => path.push(other),
        }
    }
    path
}

/// The text behind `%41`; what is not such a code stays.
fn plain(text: &str) -> String {
    let mut bytes = Vec::new();
    let mut rest = text.as_bytes();
    while let [first, tail @ ..] = rest {
        let code = tail.get(..2).filter(|_| *first == b'%').and_then(|digits| str::from_utf8(digits).ok());
        let code = code.and_then(|digits| u8::from_str_radix(digits, 16).ok());
        bytes.push(code.unwrap_or(*first));
        rest = if code.is_some() { tail.get(2..).unwrap_or_default() } else { tail };
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The links that lead nowhere on a page `docs/a.html` of a site with a page `b.html` and a picture.
    #[track_caller]
    fn check(html: &str, expected: &[&str]) {
        let at = |path: &str| Path::new("site").join(path);
        let page = read(html);
        let links = page.links.clone();
        let other = read("<h2 id=\"one\">One</h2><h2 id=\"größe\">Größe</h2>");
        let pages = BTreeMap::from([(at("docs/a.html"), page), (at("b.html"), other)]);
        let files = BTreeSet::from([at("docs/a.html"), at("b.html"), at("docs/it is.png")]);
        let leads = |link: &&String| leads_somewhere(&at("docs/a.html"), link, &files, &pages);
        let broken: Vec<&String> = links.iter().filter(|link| !leads(link)).collect();
        assert_eq!(broken, expected);
    }

    #[test]
    fn links_to_pages_anchors_and_pictures_lead_somewhere() {
        check("<a class=\"x\" href=\"../b.html#one\">one</a> <img src=\"it%20is.png\" alt=\"\">", &[]);
        check("<h1 id=\"top\"><a href=\"#top\">a</a></h1> <a href=\"../b.html#gr%C3%B6%C3%9Fe\">b</a>", &[]);
        check("<a href=\"https://example.com/x.html\">c</a> <a href=\"./../docs/./a.html\">d</a>", &[]);
    }

    #[test]
    fn links_that_lead_nowhere_are_named() {
        check("<a href=\"b.html\">a</a> <a href=\"../b.html#two\">b</a>", &["b.html", "../b.html#two"]);
        check("<a href=\"#top\">a</a> <a href=\"../b.md\">b</a>", &["#top", "../b.md"]);
        check("<script src=\"no.js\"></script> <code>href=&quot;x&quot;</code>", &["no.js"]);
        check("<a href=\"../docs\">a folder</a>", &["../docs"]);
    }
}
