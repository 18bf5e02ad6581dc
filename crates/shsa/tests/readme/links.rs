//! Every page of `docs/` and every measured one is reached from the README by links, and no link leads nowhere.

use crate::ROOT;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// The targets of the links of a page that stay within the project, without those in code blocks.
fn links(text: &str) -> Vec<String> {
    let outside = text.split("```").step_by(2).flat_map(|part| part.split('`').step_by(2));
    let targets = outside.flat_map(|part| part.split("](").skip(1)).filter_map(|rest| rest.split(')').next());
    targets.filter(|target| !target.contains("://")).map(str::to_owned).collect()
}

/// The anchor of a heading, as forges make it.
fn anchor(heading: &str) -> String {
    let kept = heading.trim().to_lowercase().replace(' ', "-");
    kept.chars().filter(|char| char.is_alphanumeric() || "-_".contains(*char)).collect()
}

fn has_anchor(text: &str, wanted: &str) -> bool {
    text.lines()
        .filter(|line| line.starts_with('#'))
        .any(|line| anchor(line.trim_start_matches('#')) == wanted)
}

/// Follows the links of a page, and those of the pages that they lead to.
fn follow(page: &Path, reached: &mut BTreeSet<PathBuf>) {
    if !reached.insert(page.to_owned()) {
        return;
    }
    let text = std::fs::read_to_string(page).expect("a page is text");
    for link in links(&text) {
        let (file, wanted) = link.split_once('#').map_or((&*link, None), |(file, at)| (file, Some(at)));
        let target =
            if file.is_empty() { page.to_owned() } else { page.parent().expect("a folder").join(file) };
        let target = target.canonicalize();
        let target = target.unwrap_or_else(|_| panic!("{}: no file {link}", page.display()));
        if target.extension().is_none_or(|ending| ending != "md") {
            continue;
        }
        let there = std::fs::read_to_string(&target).expect("a page is text");
        let is_there = wanted.is_none_or(|wanted| has_anchor(&there, wanted));
        assert!(is_there, "{}: no heading {link}", page.display());
        follow(&target, reached);
    }
}

#[test]
fn every_page_is_reached_from_the_readme() {
    let root = Path::new(ROOT).canonicalize().expect("the project is there");
    let mut reached = BTreeSet::new();
    follow(&root.join("README.md"), &mut reached);
    let pages = ["docs", "workshop/measured"]
        .map(|folder| std::fs::read_dir(root.join(folder)).expect("there are documents"));
    let pages = pages.into_iter().flatten().map(|entry| entry.expect("an entry").path());
    let lonely: Vec<PathBuf> = pages
        .filter(|path| path.extension().is_some_and(|it| it == "md") && !reached.contains(path))
        .collect();
    assert!(lonely.is_empty(), "no link leads to {lonely:?}");
}

#[test]
fn the_readme_and_the_page_of_proofs_are_short() {
    for (page, most) in [("README.md", 90), ("docs/proven.md", 60)] {
        let text = std::fs::read_to_string(format!("{ROOT}/{page}")).expect("it is there");
        assert!(text.lines().count() <= most, "{page}: {} lines", text.lines().count());
    }
}

/// Each row of the README's comparison names a page; its figures stand there, too.
#[test]
fn figures_of_the_readme_stand_in_the_pages_that_it_names() {
    let readme = std::fs::read_to_string(format!("{ROOT}/README.md")).expect("there is a README");
    let table = readme.split("## Is it for you?").nth(1).expect("there is a comparison");
    let mut count = 0;
    for row in table.split("\n## ").next().expect("it ends").lines().filter(|line| line.contains("](")) {
        let page = &links(row)[0];
        let there = std::fs::read_to_string(format!("{ROOT}/{page}")).expect("the page is there");
        for figure in row.split(|char: char| !char.is_ascii_digit() && char != '.') {
            let figure = figure.trim_matches('.');
            if figure.contains('.') {
                assert!(there.contains(figure), "{page} has no {figure}: {row}");
                count += 1;
            }
        }
    }
    assert!(count >= 5, "{count} figures");
}
