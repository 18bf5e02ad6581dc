//! Names of the thesis's files as names of ours, which formulas must be able to use.

use shsa_core::expression::{Node, is_reserved, parse_expression};
use shsa_core::knowledge::Text;
use std::collections::{BTreeMap, BTreeSet};

/// The variables by their names in the file, in the order of their first use.
#[derive(Default)]
pub(super) struct Names {
    ours: BTreeMap<String, String>,
    taken: Taken,
    order: Vec<(Text, String)>,
}

impl Names {
    /// Our name of a variable: its own, or a similar name when formulas cannot use that.
    pub(super) fn add(&mut self, name: &Text) -> String {
        if let Some(ours) = self.ours.get(&name.text) {
            return ours.clone();
        }
        let ours = self.taken.unique(&legal(&name.text));
        self.ours.insert(name.text.clone(), ours.clone());
        self.order.push((name.clone(), ours.clone()));
        ours
    }

    /// Our name of a known variable.
    pub(super) fn find(&self, name: &str) -> Option<&str> {
        self.ours.get(name).map(String::as_str)
    }

    /// Every variable at its first place in the file, with our name.
    pub(super) fn all(&self) -> &[(Text, String)] {
        &self.order
    }
}

/// Names that must differ.
#[derive(Default)]
pub(super) struct Taken {
    names: BTreeSet<String>,
    /// The number from which on names may be free, so that many equal names stay cheap.
    next: BTreeMap<String, u64>,
}

impl Taken {
    /// Takes the name itself, or the name with a number when it is taken.
    pub(super) fn unique(&mut self, name: &str) -> String {
        let mut free = name.to_owned();
        while self.names.contains(&free) {
            let number = self.next.entry(name.to_owned()).or_insert(1);
            *number += 1;
            free = format!("{name}_{number}");
        }
        self.names.insert(free.clone());
        free
    }
}

/// The most similar name that a formula can use.
fn legal(name: &str) -> String {
    if is_name(name) {
        return name.to_owned();
    }
    let plain: String = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    let named =
        if plain.starts_with(|c: char| c.is_ascii_alphabetic()) { plain } else { format!("v_{plain}") };
    if is_name(&named) { named } else { format!("{named}_") }
}

fn is_name(text: &str) -> bool {
    !is_reserved(text)
        && matches!(parse_expression(text), Ok(read) if matches!(&read.node, Node::Name(name) if name == text))
}
