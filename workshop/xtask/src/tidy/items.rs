//! Checks functions and types: no tuple parameter may hide two values, and the `impl`s of a type stand in few files.

use crate::workspace::File;
use proc_macro2::{Delimiter, Group, Ident, TokenStream, TokenTree};
use std::collections::{BTreeMap, BTreeSet};

/// The largest number of files with inherent `impl`s of one type without a reason.
const FILES_MAX: usize = 3;

/// Pairs of names that are one thing: a point, an interval, a size, a distribution.
const ONE_THING: [[&str; 2]; 9] = [
    ["x", "y"],
    ["left", "y"],
    ["lo", "hi"],
    ["low", "high"],
    ["from", "to"],
    ["from", "until"],
    ["start", "end"],
    ["width", "height"],
    ["mean", "variance"],
];

/// Tuple parameters that hide two values, and types whose `impl`s are in too many files without a reason.
///
/// `exceptions` lists the permitted types, one a line: `crate::Type files reason`.
pub(super) fn problems(files: &[File], exceptions: &str) -> Vec<String> {
    let mut survey = Survey::default();
    for file in files {
        // The check of the layers reports files that are no Rust.
        if let (Some(place), Ok(tokens)) = (Place::of(&file.path), file.text.parse::<TokenStream>()) {
            survey.walk(tokens, &place);
        }
    }
    let spread = survey.spread(exceptions);
    survey.tuples.into_iter().chain(spread).collect()
}

/// The position of a file.
struct Place<'f> {
    path: &'f str,
    /// The folder of its crate.
    folder: &'f str,
    /// The path of the module's children: `engine/` for `engine.rs` and for `engine/mod.rs`.
    module: String,
}

impl<'f> Place<'f> {
    /// `None` for files that are no source of a crate.
    fn of(path: &'f str) -> Option<Place<'f>> {
        let (folder, inner) = path.strip_suffix(".rs")?.split_once("/src/")?;
        let inner = inner.strip_suffix("mod").unwrap_or(inner);
        let inner = inner.strip_suffix("lib").filter(|rest| rest.is_empty()).unwrap_or(inner);
        let is_folder = inner.is_empty() || inner.ends_with('/');
        let module = if is_folder { inner.to_owned() } else { format!("{inner}/") };
        Some(Place { path, folder, module })
    }
}

/// The results of all files.
#[derive(Default)]
struct Survey {
    tuples: Vec<String>,
    /// The modules that define a type, by crate and name.
    types: BTreeMap<(String, String), Vec<String>>,
    /// The files with inherent `impl`s of a type, each with its module, by crate and name.
    impls: BTreeMap<(String, String), BTreeMap<String, String>>,
}

impl Survey {
    fn walk(&mut self, tokens: TokenStream, place: &Place<'_>) {
        let tokens: Vec<TokenTree> = tokens.into_iter().collect();
        let mut rest = tokens.as_slice();
        while let [first, after @ ..] = rest {
            rest = match (first, after) {
                (TokenTree::Punct(hash), [TokenTree::Group(attribute), item @ ..])
                    if hash.as_char() == '#' && is_cfg_test(attribute) =>
                {
                    item.iter().position(ends_item).and_then(|end| item.get(end + 1..)).unwrap_or_default()
                }
                (TokenTree::Ident(word), [TokenTree::Ident(name), ..])
                    if word == "struct" || word == "enum" =>
                {
                    self.types.entry(place.key(name)).or_default().push(place.module.clone());
                    after
                }
                (TokenTree::Ident(word), after) if word == "impl" => {
                    // Behind an arrow, a colon or a `&` it is a type, not an item.
                    let before = tokens.len().checked_sub(rest.len() + 1).and_then(|at| tokens.get(at));
                    let is_item =
                        before.is_none_or(|it| !matches!(it, TokenTree::Punct(_)) || is_punct(it, ';'));
                    if let Some(name) = inherent(after).filter(|_| is_item) {
                        let files = self.impls.entry(place.key(name)).or_default();
                        files.insert(place.path.to_owned(), place.module.clone());
                    }
                    after
                }
                (TokenTree::Ident(word), [TokenTree::Ident(name), after @ ..]) if word == "fn" => {
                    self.look_at_parameters(name, after, place);
                    after
                }
                (TokenTree::Group(group), after) => {
                    self.walk(group.stream(), place);
                    after
                }
                _ => after,
            };
        }
    }

    fn look_at_parameters(&mut self, function: &Ident, tokens: &[TokenTree], place: &Place<'_>) {
        let is_list = |token: &&TokenTree| matches!(token, TokenTree::Group(group) if group.delimiter() == Delimiter::Parenthesis);
        let Some(TokenTree::Group(list)) = tokens.iter().find(is_list) else { return };
        let list: Vec<TokenTree> = list.stream().into_iter().collect();
        for parameter in list.split(|token| is_punct(token, ',')) {
            let Some(names) = tuple(parameter).filter(|names| !is_one_thing(names)) else { continue };
            self.tuples.push(format!(
                "{}:{}: `({})` of `{function}` hides {} parameters: name each, or make them a type",
                place.path,
                function.span().start().line,
                names.join(", "),
                names.len()
            ));
        }
    }

    /// Types whose `impl`s are spread, without an exception or with an outdated one.
    fn spread(&self, exceptions: &str) -> Vec<String> {
        let listed = exceptions.lines().filter(|line| !line.starts_with('#') && !line.trim().is_empty());
        let mut listed: BTreeMap<&str, &str> =
            listed.map(|line| line.split_once(' ').unwrap_or((line, ""))).collect();
        let mut problems = Vec::new();
        for ((folder, name), count) in self.counts().into_iter().filter(|(_, count)| *count > FILES_MAX) {
            let name = format!("{}::{name}", folder.rsplit('/').next().unwrap_or_default());
            match listed.remove(&*name).map(|rest| rest.split_once(' ').unwrap_or((rest, ""))) {
                Some((files, reason)) if files == count.to_string() && !reason.trim().is_empty() => {}
                Some((files, _)) => problems.push(format!(
                    "{name}: `impl`s in {count} files, the list of exceptions says {files}: it must say so, and why"
                )),
                None => problems.push(format!(
                    "{name}: `impl`s in {count} files, at most {FILES_MAX}: a part of it is a type of its own"
                )),
            }
        }
        problems.extend(listed.keys().map(|name| format!("{name}: take it off the list of exceptions")));
        problems
    }

    /// The number of files with `impl`s for each type. Types of the same name in one crate are counted separately.
    fn counts(&self) -> Vec<((&str, &str), usize)> {
        let mut counts = Vec::new();
        for (key, files) in &self.impls {
            let mut of_type: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
            for (file, module) in files {
                let defined = self.types.get(key).into_iter().flatten();
                let above = defined.filter(|defined| module.starts_with(defined.as_str()));
                let nearest = above.max_by_key(|defined| defined.len()).map_or("", String::as_str);
                of_type.entry(nearest).or_default().insert(file);
            }
            let (folder, name) = key;
            counts.extend(of_type.values().map(|files| ((folder.as_str(), name.as_str()), files.len())));
        }
        counts
    }
}

impl Place<'_> {
    fn key(&self, name: &Ident) -> (String, String) {
        (self.folder.to_owned(), name.to_string())
    }
}

/// The type of an inherent `impl`, from the tokens behind `impl`.
fn inherent(tokens: &[TokenTree]) -> Option<&Ident> {
    let body = tokens.iter().position(ends_item)?;
    let head = outside_angles(tokens.get(..body)?);
    let ends_type = |token: &&TokenTree| matches!(token, TokenTree::Ident(word) if word == "where");
    let head: Vec<&TokenTree> = head.into_iter().take_while(|token| !ends_type(token)).collect();
    let is_of_trait = head.iter().any(|token| matches!(token, TokenTree::Ident(word) if *word == "for"));
    match head.last() {
        Some(TokenTree::Ident(name)) if !is_of_trait => Some(name),
        _ => None,
    }
}

/// The tokens outside of `<..>`.
fn outside_angles(tokens: &[TokenTree]) -> Vec<&TokenTree> {
    let mut depth = 0_usize;
    let mut outside = Vec::new();
    for token in tokens {
        if is_punct(token, '<') {
            depth += 1;
        } else if is_punct(token, '>') {
            depth = depth.saturating_sub(1);
        } else if depth == 0 {
            outside.push(token);
        }
    }
    outside
}

/// The names of a parameter that callers must combine and the function takes apart. A reference is to an existing pair.
fn tuple(parameter: &[TokenTree]) -> Option<Vec<String>> {
    match parameter {
        [TokenTree::Group(names), colon, TokenTree::Group(_), ..]
            if names.delimiter() == Delimiter::Parenthesis && is_punct(colon, ':') =>
        {
            let names = names.stream().into_iter().filter_map(|token| match token {
                TokenTree::Ident(name) if name != "mut" => Some(name.to_string()),
                _ => None,
            });
            Some(names.collect())
        }
        _ => None,
    }
}

fn is_one_thing(names: &[String]) -> bool {
    ONE_THING.iter().any(|thing| thing.iter().eq(names))
}

fn is_cfg_test(attribute: &Group) -> bool {
    attribute.stream().to_string().replace(' ', "") == "cfg(test)"
}

fn ends_item(token: &TokenTree) -> bool {
    let is_body = matches!(token, TokenTree::Group(group) if group.delimiter() == Delimiter::Brace);
    is_body || is_punct(token, ';')
}

fn is_punct(token: &TokenTree, wanted: char) -> bool {
    matches!(token, TokenTree::Punct(punct) if punct.as_char() == wanted)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(files: &[(&str, &str)], exceptions: &str, expected: &[&str]) {
        let file = |(path, text): &(&str, &str)| File {
            path: format!("crates/house/src/{path}"),
            text: (*text).into(),
        };
        let files: Vec<File> = files.iter().map(file).collect();
        let found = problems(&files, exceptions);
        let found: Vec<String> = found.iter().map(|line| line.replace("crates/house/src/", "")).collect();
        assert_eq!(found, expected);
    }

    #[test]
    fn a_tuple_parameter_hides_two() {
        let problem = "a.rs:1: `(age, place)` of `f` hides 2 parameters: name each, or make them a type";
        check(&[("a.rs", "fn f<T>(&self, (age, place): (u8, &str)) {}")], "", &[problem]);
        check(&[("a.rs", "impl A { fn f((age, place): (u8, T)) {} }")], "", &[problem]);
        check(&[("a.rs", "fn f((age, place): &(u8, T), &(a, b): &(u8, u8)) {}")], "", &[]);
        check(&[("a.rs", "fn f((x, y): (f64, f64), place: (u8, u8)) { g(|(a, b): (u8, u8)| a) }")], "", &[]);
        check(&[("a.rs", "#[cfg(test)]\nmod tests { fn f((age, place): (u8, u8)) {} }")], "", &[]);
    }

    const FOUR: [(&str, &str); 4] = [
        ("a.rs", "pub struct A<T>(T); impl<T: B<u8>> A<T> where T: C {}"),
        ("a/b.rs", "impl super::A<u8> { fn b() {} }"),
        ("a/c.rs", "impl<T> A<T> { fn c() -> impl A {} } impl<T> Iterator for A<T> {}"),
        ("a/d/mod.rs", "impl A<u8> {}"),
    ];

    #[test]
    fn a_type_in_many_files_needs_a_reason() {
        check(&FOUR[..3], "", &[]);
        check(&FOUR, "", &["house::A: `impl`s in 4 files, at most 3: a part of it is a type of its own"]);
        check(&FOUR, "# why\nhouse::A 4 each file is one question", &[]);
        let problem = "the list of exceptions says 5: it must say so, and why";
        check(
            &FOUR,
            "house::A 5 each file is one question",
            &[&format!("house::A: `impl`s in 4 files, {problem}")],
        );
        check(&FOUR[..3], "house::A 3 few", &["house::A: take it off the list of exceptions"]);
    }

    #[test]
    fn types_of_one_name_are_told_apart_and_traits_do_not_count() {
        let mut files = FOUR.to_vec();
        files[3] = ("a/d/mod.rs", "pub enum A {} impl A {} impl Drop for A {}");
        files.extend([("a/e.rs", "impl Clone for A<u8> {}"), ("a/d/f.rs", "impl A {}")]);
        check(&files, "", &[]);
    }
}
