//! Joins parts of other instances to a model: which parts, in which order, and which entries each has added.

use super::{Note, Offer};
use crate::healer::Healer;
use shsa_core::knowledge::{self, Draft, Model, Section, Severity};
use shsa_core::time::Time;
use std::collections::{BTreeMap, BTreeSet};

/// A name in its section.
pub(super) type Entry = (Section, String);

/// The parts joined to one of our models.
#[derive(Default)]
pub(super) struct Joins {
    /// The version of our model that the parts were joined to.
    pub(super) version: Option<u64>,
    /// The entries that each part has added.
    pub(super) brought: BTreeMap<String, BTreeSet<Entry>>,
    /// Parts that could not be joined, with the reasons.
    refused: BTreeMap<String, String>,
}

impl Joins {
    /// Joins the offered parts to a healer's own model.
    pub(super) fn settle(
        &mut self,
        healer: &mut Healer,
        offers: &BTreeMap<String, Offer>,
        now: Time,
        notes: &mut Vec<Note>,
    ) {
        let known = offers
            .iter()
            .filter_map(|(name, offer)| Some((name.as_str(), &offer.received_draft.as_ref()?.1)));
        let Settled { whole, brought, refused } = settle(healer.own(), &known.collect());
        let after = entries(&whole);
        if let Err(why) = healer.join(&whole, now) {
            notes.push(("refused", format!("the parts of others are not joined: {why}")));
            return;
        }
        let before: BTreeSet<&Entry> = self.brought.values().flatten().collect();
        for (name, entries) in &brought {
            let new = entries.iter().filter(|entry| !before.contains(entry));
            let text = described(new).map(|new| format!("{new} is known from {name} from now on"));
            notes.extend(text.map(|text| ("joined", text)));
        }
        for (name, entries) in &self.brought {
            let lost = entries.iter().filter(|entry| !after.contains(*entry));
            let text = described(lost)
                .map(|lost| format!("{lost} is not known any more: {name} has gone or changed"));
            notes.extend(text.map(|text| ("parted", text)));
        }
        for (name, why) in refused.iter().filter(|(name, why)| self.refused.get(*name) != Some(why)) {
            notes.push(("refused", format!("the part {name} is not joined: {why}")));
        }
        (self.brought, self.refused) = (brought, refused);
    }
}

/// `signal gnss, relation steered`, and the number of further entries; `None` if there are none.
fn described<'e>(entries: impl DoubleEndedIterator<Item = &'e Entry> + Clone) -> Option<String> {
    const SHOWN: usize = 6;
    let names = entries.clone().rev().take(SHOWN);
    let mut names: Vec<String> =
        names.map(|(section, name)| format!("{} {name}", section.singular())).collect();
    let more = entries.count().saturating_sub(SHOWN);
    if more > 0 {
        names.push(format!("{more} more"));
    }
    (!names.is_empty()).then(|| names.join(", "))
}

/// Our model with the joined parts.
struct Settled {
    whole: Draft,
    brought: BTreeMap<String, BTreeSet<Entry>>,
    refused: BTreeMap<String, String>,
}

/// Joins the parts that share a variable with the model, in the order of their names. It repeats until no part is left that does,
/// because one part may connect another.
fn settle(own: &Draft, parts: &BTreeMap<&str, &Draft>) -> Settled {
    let mut settled = Settled { whole: own.clone(), brought: BTreeMap::new(), refused: BTreeMap::new() };
    let mut left: Vec<(&str, &Draft)> = parts.iter().map(|(name, part)| (*name, *part)).collect();
    loop {
        let known: BTreeSet<&str> = names(&settled.whole);
        let is_related = |(_, part): &(&str, &Draft)| names(part).iter().any(|name| known.contains(name));
        let Some(at) = left.iter().position(is_related) else { return settled };
        let (name, part) = left.remove(at);
        match joined(&settled.whole, part) {
            Ok((_, entries)) if entries.is_empty() => {}
            Ok((whole, entries)) => {
                settled.whole = whole;
                settled.brought.insert(name.to_owned(), entries);
            }
            Err(why) => drop(settled.refused.insert(name.to_owned(), why)),
        }
    }
}

fn names(draft: &Draft) -> BTreeSet<&str> {
    draft.variables.iter().map(|variable| variable.name.text.as_str()).collect()
}

/// The model with a part's new entries, and these entries. Known entries stay unchanged.
fn joined(whole: &Draft, part: &Draft) -> Result<(Draft, BTreeSet<Entry>), String> {
    knowledge::join(&[whole.clone(), part.clone()]).map_err(|found| {
        found.first().map_or_else(String::new, |found| format!("{}; ours stays", found.message))
    })?;
    let known = entries(whole);
    let is_new = |section: Section, name: &str| !known.contains(&(section, name.to_owned()));
    let mut next = whole.clone();
    let Draft { variables, constants, functions, relations, signals, platform, contracts, .. } = part.clone();
    next.variables.extend(variables.into_iter().filter(|it| is_new(Section::Variables, &it.name.text)));
    next.constants.extend(constants.into_iter().filter(|it| is_new(Section::Constants, &it.0.text)));
    next.functions.extend(functions.into_iter().filter(|it| is_new(Section::Functions, head(&it.0.text))));
    next.relations.extend(relations.into_iter().filter(|it| is_new(Section::Relations, &it.name.text)));
    next.signals.extend(signals.into_iter().filter(|it| is_new(Section::Signals, &it.name.text)));
    next.platform.extend(platform.into_iter().filter(|it| is_new(Section::Platform, &it.name.text)));
    next.contracts.extend(contracts.into_iter().filter(|it| is_new(Section::Contracts, &it.name.text)));
    let brought = entries(&next).difference(&known).cloned().collect();
    match Model::new(next.clone()) {
        Ok(_) => Ok((next, brought)),
        Err(found) => {
            let wrong = found.into_iter().find(|found| found.severity == Severity::Error);
            Err(wrong.map_or_else(String::new, |found| found.message))
        }
    }
}

/// Every entry of a draft except needs.
pub(super) fn entries(draft: &Draft) -> BTreeSet<Entry> {
    let variables = draft.variables.iter().map(|it| (Section::Variables, it.name.text.as_str()));
    let constants = draft.constants.iter().map(|it| (Section::Constants, it.0.text.as_str()));
    let functions = draft.functions.iter().map(|it| (Section::Functions, head(&it.0.text)));
    let relations = draft.relations.iter().map(|it| (Section::Relations, it.name.text.as_str()));
    let signals = draft.signals.iter().map(|it| (Section::Signals, it.name.text.as_str()));
    let platform = draft.platform.iter().map(|it| (Section::Platform, it.name.text.as_str()));
    let contracts = draft.contracts.iter().map(|it| (Section::Contracts, it.name.text.as_str()));
    let all = variables.chain(constants).chain(functions).chain(relations).chain(signals);
    let all = all.chain(platform).chain(contracts);
    all.map(|(section, name)| (section, name.to_owned())).collect()
}

/// The name of a function: `clamp` of `clamp(x)`.
fn head(text: &str) -> &str {
    text.split('(').next().unwrap_or_default().trim()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::federation::{MOST_ENTRIES, hash_of, read, without_needs};
    use shsa_model::live::{Live, Written};
    use shsa_model::write;

    const OWN: &str = "
shsa: 1
variables: { speed: { unit: m/s } }
signals: { wheel: { variable: speed, unit: m/s, rate: 10 Hz } }
needs: { speed: { signal: /speed } }
";

    fn draft(text: &str) -> Draft {
        let (live, _) = Live::load(Written { name: "a", text })
            .unwrap_or_else(|report| panic!("{}", report.render(false)));
        without_needs(live.draft())
    }

    fn part(rest: &str) -> Draft {
        draft(&format!("shsa: 1\n{rest}"))
    }

    /// Joins these parts to our model; checks which parts have added entries and which are refused.
    #[track_caller]
    fn check(parts: &[(&str, &Draft)], brought: &[&str], refused: &[(&str, &str)]) -> Settled {
        let settled = settle(&draft(OWN), &parts.iter().copied().collect());
        assert_eq!(settled.brought.keys().collect::<Vec<_>>(), brought, "{:?}", settled.refused);
        assert_eq!(settled.refused.len(), refused.len(), "{:?}", settled.refused);
        for (name, why) in refused {
            assert!(settled.refused[*name].contains(why), "{:?}", settled.refused);
        }
        settled
    }

    #[test]
    fn what_names_a_known_variable_is_joined_with_all_that_hangs_on_it() {
        let near = part(
            "variables: { speed: { unit: m/s }, rpm: { unit: Hz } }\nrelations: { gear: { equation: speed = 0.1 m * rpm } }",
        );
        let far = part(
            "variables: { rpm: { unit: Hz } }\nsignals: { tacho: { variable: rpm, unit: Hz, rate: 10 Hz } }",
        );
        let other = part(
            "variables: { height: { unit: m } }\nsignals: { baro: { variable: height, unit: m, rate: 10 Hz } }",
        );
        // The connecting part comes later by its name.
        let settled = check(&[("a", &far), ("b", &near), ("c", &other)], &["a", "b"], &[]);
        assert_eq!(described(settled.brought["a"].iter()).unwrap(), "signal tacho");
        assert_eq!(described(settled.brought["b"].iter()).unwrap(), "relation gear, variable rpm");
        check(&[("a", &far), ("c", &other)], &[], &[]);
    }

    #[test]
    fn what_contradicts_is_refused_and_ours_stays() {
        let unit = part(
            "variables: { speed: { unit: km/h } }\nsignals: { gnss: { variable: speed, unit: m/s, rate: 10 Hz } }",
        );
        let name = part(
            "variables: { speed: { unit: m/s } }\nsignals: { wheel: { variable: speed, unit: m/s, rate: 99 Hz } }",
        );
        let right = part(
            "variables: { speed: { unit: m/s } }\nsignals: { gnss: { variable: speed, unit: m/s, rate: 10 Hz } }",
        );
        let settled = check(
            &[("a", &unit), ("b", &name), ("c", &right)],
            &["c"],
            &[("a", "`speed` differently"), ("b", "`wheel` differently")],
        );
        assert!(
            write::yaml(&settled.whole)
                .starts_with(write::yaml(&draft(OWN)).split("signals:").next().unwrap())
        );
    }

    #[test]
    fn a_part_adds_no_detail_to_what_is_known() {
        let more = part(
            "variables: { speed: { unit: m/s, range: [0, 1] } }\nsignals: { gnss: { variable: speed, unit: m/s, rate: 10 Hz } }",
        );
        let settled = check(&[("a", &more)], &["a"], &[]);
        assert!(settled.whole.variables[0].range.is_none());
    }

    #[test]
    fn the_same_parts_give_the_same_knowledge_in_whatever_order_they_came() {
        let one = part(
            "variables: { speed: { unit: m/s } }\nsignals: { one: { variable: speed, unit: m/s, rate: 10 Hz } }",
        );
        let two = part(
            "variables: { speed: { unit: m/s } }\nsignals: { two: { variable: speed, unit: m/s, rate: 10 Hz } }",
        );
        let text = |parts: &[(&str, &Draft)]| write::yaml(&check(parts, &["a", "b"], &[]).whole);
        assert_eq!(text(&[("a", &one), ("b", &two)]), text(&[("b", &two), ("a", &one)]));
    }

    #[test]
    fn strangers_texts_are_bounded_and_checked() {
        let many: String = (0..=MOST_ENTRIES).map(|n| format!("v{n}: {{}}, ")).collect();
        let many = format!("shsa: 1\nvariables: {{ {many} }}");
        for (text, why) in [
            ("", "nothing in it"),
            ("shsa: 1\nvariables: 7", ""),
            ("shsa: 1\nvariables: { a: {} }\nsignals: { s: { variable: b } }", "b"),
            (many.as_str(), "entries, more than"),
        ] {
            let refused = read("a", &hash_of(text), text.as_bytes()).map(|_| ()).unwrap_err();
            assert!(refused.contains(why), "{refused}");
        }
        let text = write::yaml(&draft(OWN));
        assert!(read("a", "0", text.as_bytes()).unwrap_err().contains("not the one that was announced"));
        assert!(read("a", &hash_of(&text), text.as_bytes()).is_ok());
    }
}
