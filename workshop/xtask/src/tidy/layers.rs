//! Checks that the core's modules stand in reading order, and that each uses only those above it.
//!
//! The check reads the tokens of each file, so that macros count, and comments and strings do not; tests are left out. A module
//! may use items that its parents define themselves, and a parent may use all of its children.

use crate::workspace::File;
use proc_macro2::{Delimiter, Ident, Spacing, TokenStream, TokenTree};
use std::collections::BTreeMap;

/// The folder of the modules.
const SOURCE: &str = "crates/shsa-core/src/";

/// The path of a module or an item: the names from the crate's root down.
type ModulePath = Vec<String>;

/// Every use of a module below its user.
pub(super) fn problems(files: &[File]) -> Vec<String> {
    let mut survey = Survey::default();
    let unread: Vec<String> = files.iter().filter_map(|file| survey.read(file).err()).collect();
    unread.into_iter().chain(survey.problems()).collect()
}

/// The results of all files.
#[derive(Default)]
struct Survey {
    /// Each module's children, in the order of declaration.
    order: BTreeMap<ModulePath, Vec<String>>,
    /// Modules that exist in tests only.
    tests: Vec<ModulePath>,
    uses: Vec<Use>,
}

/// A path in the code.
struct Use {
    /// File and line, for messages.
    place: String,
    from: ModulePath,
    to: ModulePath,
}

impl Survey {
    fn read(&mut self, file: &File) -> Result<(), String> {
        let Some(module) = module_of(&file.path) else { return Ok(()) };
        let tokens: TokenStream = file.text.parse().map_err(|_| format!("{}: is no Rust", file.path))?;
        Reader { file: &file.path, survey: self }.walk(tokens, &module);
        Ok(())
    }

    fn problems(&self) -> impl Iterator<Item = String> {
        self.uses.iter().filter(|used| !self.is_test(&used.from)).filter_map(|used| self.problem(used))
    }

    fn is_test(&self, module: &ModulePath) -> bool {
        self.tests.iter().any(|test| module.starts_with(test))
    }

    /// Compares the two branches at which user and used diverge; within one branch there is nothing to compare.
    fn problem(&self, used: &Use) -> Option<String> {
        let shared = used.from.iter().zip(&used.to).take_while(|(a, b)| a == b).count();
        let (user, target) = (used.from.get(shared)?, used.to.get(shared)?);
        let siblings = self.order.get(used.from.get(..shared)?)?;
        let rank = |name: &String| siblings.iter().position(|sibling| sibling == name);
        let is_below = rank(target)? > rank(user)?;
        is_below.then(|| format!("{}: `{user}` uses `{target}`, which is declared below it", used.place))
    }
}

/// `None` for files outside of the core.
fn module_of(path: &str) -> Option<ModulePath> {
    let path = path.strip_prefix(SOURCE)?.strip_suffix(".rs")?;
    let mut names: ModulePath = path.split('/').map(Into::into).collect();
    names.pop_if(|last| last == "mod" || (last == "lib" && path == "lib"));
    Some(names)
}

/// Reads one file into the survey.
struct Reader<'a> {
    file: &'a str,
    survey: &'a mut Survey,
}

impl Reader<'_> {
    fn walk(&mut self, tokens: TokenStream, module: &[String]) {
        let tokens: Vec<TokenTree> = tokens.into_iter().collect();
        let mut rest = tokens.as_slice();
        while let [first, after @ ..] = rest {
            rest = match (first, after) {
                (TokenTree::Punct(hash), [TokenTree::Group(attribute), item @ ..])
                    if hash.as_char() == '#' && is_cfg_test(attribute.stream()) =>
                {
                    self.skip_test(item, module)
                }
                (TokenTree::Ident(word), [TokenTree::Ident(name), ..]) if word == "mod" => {
                    self.declare(module, name);
                    self.enter(after, module)
                }
                (TokenTree::Ident(word), after) if let Some(path) = after_colons(after) => {
                    let place = format!("{}:{}", self.file, word.span().start().line);
                    match start_of(word, module) {
                        Some(start) => self.path(start, path, &place, module),
                        None => after,
                    }
                }
                (TokenTree::Group(group), after) => {
                    self.walk(group.stream(), module);
                    after
                }
                _ => after,
            };
        }
    }

    fn declare(&mut self, module: &[String], name: &Ident) {
        self.survey.order.entry(module.to_vec()).or_default().push(name.to_string());
    }

    /// Reads on behind a module's name, including its body if it has one here.
    fn enter<'t>(&mut self, tokens: &'t [TokenTree], module: &[String]) -> &'t [TokenTree] {
        match tokens {
            [TokenTree::Ident(name), TokenTree::Group(body), after @ ..] => {
                self.walk(body.stream(), &child(module, name));
                after
            }
            tokens => tokens.get(1..).unwrap_or_default(),
        }
    }

    /// Skips an item that exists in tests only.
    fn skip_test<'t>(&mut self, item: &'t [TokenTree], module: &[String]) -> &'t [TokenTree] {
        let end = item.iter().position(ends_item).map_or(item.len(), |end| end + 1);
        let (item, after) = item.split_at(end);
        for pair in item.windows(2) {
            if let [TokenTree::Ident(word), TokenTree::Ident(name)] = pair
                && word == "mod"
            {
                self.survey.tests.push(child(module, name));
            }
        }
        after
    }

    /// Follows a path, or a tree of paths, from the tokens before its next name; returns the tokens behind it.
    fn path<'t>(
        &mut self,
        mut path: ModulePath,
        tokens: &'t [TokenTree],
        place: &str,
        from: &[String],
    ) -> &'t [TokenTree] {
        if let [TokenTree::Group(group), after @ ..] = tokens
            && group.delimiter() == Delimiter::Brace
        {
            let branches: Vec<TokenTree> = group.stream().into_iter().collect();
            for branch in branches.split(|token| is_punct(token, ',')) {
                self.path(path.clone(), branch, place, from);
            }
            return after;
        }
        let [TokenTree::Ident(name), after @ ..] = tokens else {
            self.note(place, from, path);
            return tokens;
        };
        step(&mut path, name);
        match after_colons(after) {
            Some(deeper) => self.path(path, deeper, place, from),
            None => {
                self.note(place, from, path);
                after
            }
        }
    }

    fn note(&mut self, place: &str, from: &[String], to: ModulePath) {
        self.survey.uses.push(Use { place: place.into(), from: from.to_vec(), to });
    }
}

/// The start of a path that begins with this word; `None` for paths into other crates and to own children.
fn start_of(word: &Ident, module: &[String]) -> Option<ModulePath> {
    let mut start = if word == "crate" { Vec::new() } else { module.to_vec() };
    if word == "super" {
        start.pop();
    }
    (word == "crate" || word == "self" || word == "super").then_some(start)
}

fn step(path: &mut ModulePath, name: &Ident) {
    if name == "super" {
        path.pop();
    } else if name != "self" {
        path.push(name.to_string());
    }
}

fn child(module: &[String], name: &Ident) -> ModulePath {
    module.iter().cloned().chain([name.to_string()]).collect()
}

/// The tokens behind `::`.
fn after_colons(tokens: &[TokenTree]) -> Option<&[TokenTree]> {
    match tokens {
        [TokenTree::Punct(first), second, after @ ..]
            if first.as_char() == ':' && first.spacing() == Spacing::Joint && is_punct(second, ':') =>
        {
            Some(after)
        }
        _ => None,
    }
}

fn ends_item(token: &TokenTree) -> bool {
    let is_body = matches!(token, TokenTree::Group(group) if group.delimiter() == Delimiter::Brace);
    is_body || is_punct(token, ';')
}

fn is_punct(token: &TokenTree, wanted: char) -> bool {
    matches!(token, TokenTree::Punct(punct) if punct.as_char() == wanted)
}

fn is_cfg_test(attribute: TokenStream) -> bool {
    attribute.to_string().replace(' ', "") == "cfg(test)"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(files: &[(&str, &str)], expected: &[&str]) {
        let file =
            |(path, text): &(&str, &str)| File { path: format!("{SOURCE}{path}"), text: (*text).into() };
        let files: Vec<File> = files.iter().map(file).collect();
        let found: Vec<String> = problems(&files).iter().map(|line| line.replace(SOURCE, "")).collect();
        assert_eq!(found, expected);
    }

    const ROOT: (&str, &str) = ("lib.rs", "pub mod time;\npub mod plan;\npub mod engine;");

    #[test]
    fn what_stands_above_may_be_used() {
        check(
            &[ROOT, ("plan/mod.rs", "use crate::time::Time;\nuse self::limits::Limits;\nmod limits;")],
            &[],
        );
        check(&[ROOT, ("time.rs", "// crate::engine::X\nconst TEXT: &str = \"crate::engine::X\";")], &[]);
        check(&[ROOT, ("plan.rs", "pub(crate) fn plan(engine: ::engine::X) { core::engine::y() }")], &[]);
    }

    #[test]
    fn what_stands_below_may_not() {
        check(
            &[ROOT, ("time.rs", "\nuse crate::engine::Engine;")],
            &["time.rs:2: `time` uses `engine`, which is declared below it"],
        );
        check(
            &[ROOT, ("plan/mod.rs", "use crate::{time::Time, engine::{self, Input}};")],
            &[
                "plan/mod.rs:1: `plan` uses `engine`, which is declared below it",
                "plan/mod.rs:1: `plan` uses `engine`, which is declared below it",
            ],
        );
        check(
            &[ROOT, ("plan.rs", "fn f() { assert!(super::engine::run::<u8>()) }")],
            &["plan.rs:1: `plan` uses `engine`, which is declared below it"],
        );
        check(
            &[ROOT, ("plan.rs", "mod inner { use super::super::engine::*; }")],
            &["plan.rs:1: `plan` uses `engine`, which is declared below it"],
        );
    }

    #[test]
    fn the_order_holds_within_a_folder_too() {
        let parent = ("plan/mod.rs", "mod limits;\nmod best_first;\npub struct Plan;");
        check(
            &[
                ROOT,
                parent,
                ("plan/best_first.rs", "use super::{Plan, limits::Limits};\nuse crate::time::Time;"),
            ],
            &[],
        );
        check(
            &[ROOT, parent, ("plan/limits.rs", "use super::best_first::Node;\nuse crate::engine::Input;")],
            &[
                "plan/limits.rs:1: `limits` uses `best_first`, which is declared below it",
                "plan/limits.rs:2: `plan` uses `engine`, which is declared below it",
            ],
        );
    }

    #[test]
    fn tests_may_use_all() {
        check(
            &[
                ROOT,
                (
                    "time.rs",
                    "#[cfg(test)]\nuse crate::engine::X;\n#[cfg(test)]\nmod tests { use crate::plan::Y; }",
                ),
            ],
            &[],
        );
        check(
            &[ROOT, ("time.rs", "#[cfg(test)]\nmod tests;"), ("time/tests.rs", "use crate::engine::X;")],
            &[],
        );
        check(
            &[ROOT, ("time.rs", "#[cfg(test)]\nmod tests {}\nuse crate::engine::X;")],
            &["time.rs:3: `time` uses `engine`, which is declared below it"],
        );
    }

    #[test]
    fn a_file_that_is_no_rust_is_named() {
        check(&[("time.rs", "fn {")], &["time.rs: is no Rust"]);
    }
}
