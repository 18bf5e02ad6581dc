//! The grammar of `source` in `docs/recordings.md`: what it derives is understood, part by part.

use super::document::Document;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use shsa_message::path::Path;
use shsa_message::source::Source;
use shsa_message::span::TIME_UNITS;
use std::collections::{BTreeMap, BTreeSet};

/// What stands on the right of a rule.
enum Part {
    Word(String),
    Rule(String),
    Choice(Vec<Vec<Part>>),
    /// In brackets: none or one; in braces: none to two.
    Perhaps(Vec<Vec<Part>>, u32),
}

/// The rules of the page by their names.
fn rules(text: &str) -> BTreeMap<String, Part> {
    let rule = |line: &str| {
        let (name, right) = line.split_once(" = ").unwrap_or_else(|| panic!("{line}"));
        let mut words = words(right).into_iter().peekable();
        (name.trim().to_owned(), Part::Choice(choice(&mut words)))
    };
    text.lines().map(rule).collect()
}

/// Signs, names and texts in quotes.
fn words(text: &str) -> Vec<String> {
    let mut words = Vec::new();
    let mut rest = text.trim();
    while !rest.is_empty() {
        let end = match rest.strip_prefix('"') {
            Some(quoted) => quoted.find('"').unwrap() + 2,
            None => rest.find(' ').unwrap_or(rest.len()),
        };
        words.push(rest[..end].to_owned());
        rest = rest[end..].trim_start();
    }
    words
}

fn choice(words: &mut std::iter::Peekable<std::vec::IntoIter<String>>) -> Vec<Vec<Part>> {
    let mut all = vec![Vec::new()];
    while let Some(word) = words.next_if(|word| !["]", "}"].contains(&word.as_str())) {
        if word == "|" {
            all.push(Vec::new());
            continue;
        }
        let part = match word.as_str() {
            "[" | "{" => {
                let inner = choice(words);
                words.next();
                Part::Perhaps(inner, if word == "[" { 1 } else { 2 })
            }
            quoted if quoted.starts_with('"') => Part::Word(quoted.trim_matches('"').to_owned()),
            name => Part::Rule(name.to_owned()),
        };
        all.last_mut().unwrap().push(part);
    }
    all
}

/// Derives texts.
struct Deriver {
    rules: BTreeMap<String, Part>,
    random: ChaCha8Rng,
    used: BTreeSet<String>,
}

impl Deriver {
    fn below(&mut self, count: usize) -> usize {
        self.random.next_u32() as usize % count
    }

    fn rule(&mut self, name: &str) -> String {
        let few = |deriver: &mut Deriver, of: &[&str]| of[deriver.below(of.len())].to_owned();
        self.used.insert(name.to_owned());
        match name {
            "name" => few(self, &["speed", "wheel_1", "Pose2D", "x"]),
            "number" => few(self, &["1", "3", "17"]),
            "unit" => few(self, &["m/s", "%", "degC"]),
            "text" => few(self, &["left wheel", "1.5", "T1"]),
            "unit_of_time" => {
                let units = TIME_UNITS.iter().flat_map(|(names, _)| names.iter().copied());
                let units: Vec<&str> = units.collect();
                few(self, &units)
            }
            _ => {
                let rules = std::mem::take(&mut self.rules);
                let part = rules.get(name).unwrap_or_else(|| panic!("`{name}` has no rule"));
                let text = self.part_of(part, &rules);
                self.rules = rules;
                text
            }
        }
    }

    fn part_of(&mut self, part: &Part, rules: &BTreeMap<String, Part>) -> String {
        match part {
            Part::Word(word) => word.clone(),
            Part::Rule(name) => match rules.get(name) {
                Some(part) => {
                    self.used.insert(name.clone());
                    self.part_of(part, rules)
                }
                None => self.rule(name),
            },
            Part::Choice(all) => {
                let chosen = &all[self.below(all.len())];
                chosen.iter().map(|part| self.part_of(part, rules)).collect()
            }
            Part::Perhaps(all, most) => {
                let times = self.below(*most as usize + 1);
                (0..times)
                    .map(|_| {
                        let chosen = &all[self.below(all.len())];
                        chosen.iter().map(|part| self.part_of(part, rules)).collect::<String>()
                    })
                    .collect()
            }
        }
    }
}

#[test]
fn what_the_grammar_of_sources_derives_is_understood() {
    let text = Document::read("recordings.md").section("Source").blocks("ebnf").remove(0);
    let rules = rules(&text);
    let names: BTreeSet<String> = rules.keys().cloned().collect();
    let mut deriver = Deriver { rules, random: ChaCha8Rng::seed_from_u64(1), used: BTreeSet::new() };
    for _ in 0..2_000 {
        let (place, field, filter) = (deriver.rule("place"), deriver.rule("field"), deriver.rule("filter"));
        let (time, step) = (deriver.rule("time"), deriver.rule("step"));
        let text = format!("{place}#{field}{filter}@{time}*{step}!changed");
        let source: Source = text.parse().unwrap_or_else(|problem| panic!("{text}: {problem}"));
        assert_eq!(source.file.as_deref(), Some(place.as_str()), "{text}");
        assert_eq!(source.field, field, "{text}");
        assert!(source.filters.len() == 1 && source.changed, "{text}");
        let stamp = source.time.unwrap();
        assert!(stamp.path == time && stamp.step.is_some(), "{text}");
        let derived = deriver.rule("source");
        let whole: Result<Source, String> = derived.parse();
        assert!(whole.is_ok(), "{derived}: {whole:?}");
        let path = deriver.rule("path");
        assert!(Path::parse(&path).is_ok(), "{path}");
    }
    let unused: Vec<&String> = names.difference(&deriver.used).collect();
    assert!(unused.is_empty(), "{unused:?} are derived by nothing");
}
