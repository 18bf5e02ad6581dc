//! Counts the lines of product code, and holds them below the budgets.
//!
//! Product code is what is published: the Rust sources of `crates/` and `python/`, without tests. A line counts unless it is blank, is a
//! comment, or belongs to an item under `#[cfg(test)]`; files of tests (`tests.rs`, `tests/`) do not count at all. Where such an item ends
//! is read from the indentation, which `cargo fmt` makes.

use crate::workspace::File;
use std::collections::BTreeMap;

/// The crate with a budget of its own.
const CORE: &str = "shsa-core";
/// The attribute of what only tests compile.
const TEST: &str = "#[cfg(test)]";

/// The counted lines of each crate.
struct Lines<'f> {
    crates: BTreeMap<&'f str, usize>,
}

impl<'f> Lines<'f> {
    fn of(files: &'f [File]) -> Lines<'f> {
        let mut crates = BTreeMap::new();
        for file in files {
            if let Some(name) = product(&file.path) {
                *crates.entry(name).or_default() += lines(&file.text);
            }
        }
        Lines { crates }
    }

    /// The lines that a budget is about, and whose they are.
    fn under(&self, budget: &str) -> Option<(String, usize)> {
        match budget {
            "all" => Some(("the product".to_owned(), self.crates.values().sum())),
            "core" => self.crates.get(CORE).map(|lines| (CORE.to_owned(), *lines)),
            "other" => {
                let others = self.crates.iter().filter(|(name, _)| **name != CORE);
                others.max_by_key(|(_, lines)| **lines).map(|(name, lines)| ((*name).to_owned(), *lines))
            }
            _ => None,
        }
    }
}

/// The product's crate that a file belongs to; `None` for other files.
fn product(path: &str) -> Option<&str> {
    let is_test = path.contains("/tests/") || path.ends_with("tests.rs");
    let (name, rest) = match path.strip_prefix("crates/") {
        Some(inside) => inside.split_once('/')?,
        None => ("shsa-python", path.strip_prefix("python/")?),
    };
    (rest.starts_with("src/") && rest.ends_with(".rs") && !is_test).then_some(name)
}

/// The counted lines of a file.
fn lines(text: &str) -> usize {
    let mut all = text.lines();
    let mut count = 0;
    while let Some(line) = all.next() {
        let code = line.trim_start();
        if code.starts_with(TEST) {
            skip_item(&mut all);
        } else if !code.is_empty() && !code.starts_with("//") {
            count += 1;
        }
    }
    count
}

/// Goes on behind the item below an attribute.
fn skip_item<'t>(lines: &mut impl Iterator<Item = &'t str>) {
    let is_before = |line: &&str| line.trim_start().starts_with(['#', '/']);
    let Some(first) = lines.find(|line| !is_before(line)) else { return };
    if first.ends_with([';', ',', '}']) {
        return;
    }
    let indent = indent(first);
    let _ = lines.find(|line| !line.trim().is_empty() && self::indent(line) <= indent);
}

fn indent(line: &str) -> usize {
    line.len() - line.trim_start().len()
}

/// The budgets are kept: `name lines reason` a line, of `all` product code, of the `core`, and of the largest `other` crate.
pub(super) fn problems(files: &[File], budgets: &str) -> Vec<String> {
    let lines = Lines::of(files);
    let listed = budgets.lines().filter(|line| !line.starts_with('#') && !line.trim().is_empty());
    let mut names = vec!["all", "core", "other"];
    let mut problems = Vec::new();
    for line in listed {
        let mut words = line.splitn(3, ' ').map(str::trim);
        let (name, most, reason) = (words.next(), words.next(), words.next());
        let most = most.and_then(|most| most.parse::<usize>().ok());
        let (Some(name), Some(most), Some(_)) = (name, most, reason) else {
            problems.push(format!("workshop/xtask/tidy-budgets.txt: `{line}` is not `name lines reason`"));
            continue;
        };
        names.retain(|wanted| *wanted != name);
        match lines.under(name) {
            Some((whose, found)) if found > most => problems.push(format!(
                "{whose} has {found} lines of code, and its budget is {most}: delete some, or change the budget `{name}` in \
                 workshop/xtask/tidy-budgets.txt in the same commit, with the reason"
            )),
            Some(_) => {}
            None => problems.push(format!("workshop/xtask/tidy-budgets.txt: nothing is named `{name}`")),
        }
    }
    problems.extend(names.iter().map(|name| format!("workshop/xtask/tidy-budgets.txt: no budget `{name}`")));
    problems
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check_lines(text: &str, expected: usize) {
        assert_eq!(lines(text), expected, "{text}");
    }

    #[test]
    fn lines_of_code_are_counted_and_those_of_tests_are_not() {
        check_lines("//! Head.\n\nfn a() {\n    // Why.\n    b();\n}\n", 3);
        check_lines("#[cfg(test)]\nmod tests;\n\nmod a;\n", 1);
        check_lines(
            "mod a;\n\n#[cfg(test)]\n#[expect(x)]\nmod tests {\n    fn a() {\n    }\n}\n\nmod b;\n",
            2,
        );
        check_lines("struct A {\n    #[cfg(test)]\n    seen: u32,\n    b: u32,\n}\n", 3);
        check_lines("impl A {\n    #[cfg(test)]\n    fn a() {\n        b();\n    }\n\n    fn c() {}\n}\n", 3);
    }

    #[test]
    fn the_product_is_the_published_sources() {
        assert_eq!(product("crates/shsa-core/src/a/b.rs"), Some("shsa-core"));
        assert_eq!(product("python/src/lib.rs"), Some("shsa-python"));
        for path in [
            "crates/a/src/tests.rs",
            "crates/a/src/b/tests/c.rs",
            "crates/a/tests/b.rs",
            "crates/a/src/b.yaml",
        ] {
            assert_eq!(product(path), None);
        }
        assert_eq!(product("workshop/xtask/src/main.rs"), None);
    }

    #[track_caller]
    fn check(budgets: &str, expected: &[&str]) {
        let file = |path: &str, lines: usize| File { path: path.into(), text: "a\n".repeat(lines) };
        let files = [
            file("crates/shsa-core/src/lib.rs", 5),
            file("crates/b/src/lib.rs", 2),
            file("crates/c/src/lib.rs", 3),
        ];
        assert_eq!(problems(&files, budgets), expected);
    }

    #[test]
    fn what_passes_its_budget_is_named() {
        check("# Reasons.\nall 10 r\ncore 5 r\nother 3 r\n", &[]);
        let advice = "in workshop/xtask/tidy-budgets.txt in the same commit, with the reason";
        let over = |whose: &str, found: u32, most: u32, name: &str| {
            format!(
                "{whose} has {found} lines of code, and its budget is {most}: delete some, or change the budget `{name}` {advice}"
            )
        };
        check(
            "all 9 r\ncore 4 r\nother 2 r\n",
            &[
                &over("the product", 10, 9, "all"),
                &over("shsa-core", 5, 4, "core"),
                &over("c", 3, 2, "other"),
            ],
        );
        check(
            "all 10 r\ncore 5\nothers 3 r\n",
            &[
                "workshop/xtask/tidy-budgets.txt: `core 5` is not `name lines reason`",
                "workshop/xtask/tidy-budgets.txt: nothing is named `others`",
                "workshop/xtask/tidy-budgets.txt: no budget `core`",
                "workshop/xtask/tidy-budgets.txt: no budget `other`",
            ],
        );
    }
}
