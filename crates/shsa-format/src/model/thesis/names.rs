//! Names of the thesis's files as names of ours: formulas must be able to use those of variables.

use shsa_core::expression::{Node, is_reserved, parse_expression};
use shsa_core::knowledge::Text;
use std::collections::{BTreeMap, BTreeSet};

/// Variables by the names of the file, in the order of their first use.
#[derive(Default)]
pub(super) struct Names {
    ours: BTreeMap<String, String>,
    taken: Taken,
    order: Vec<(Text, String)>,
}

impl Names {
    /// Our name of a variable; made from its own when formulas cannot use that.
    pub(super) fn add(&mut self, name: &Text) -> String {
        if let Some(ours) = self.ours.get(&name.text) {
            return ours.clone();
        }
        let ours = self.taken.unique(&legal(&name.text));
        self.ours.insert(name.text.clone(), ours.clone());
        self.order.push((name.clone(), ours.clone()));
        ours
    }

    /// Our name of a variable that is known.
    pub(super) fn find(&self, name: &str) -> Option<&str> {
        self.ours.get(name).map(String::as_str)
    }

    /// Every variable as it first stands in the file, with our name.
    pub(super) fn all(&self) -> &[(Text, String)] {
        &self.order
    }
}

/// Names that must differ.
#[derive(Default)]
pub(super) struct Taken {
    names: BTreeSet<String>,
    /// From which number on there may be free ones, so that many equal names stay cheap.
    next: BTreeMap<String, u64>,
}

impl Taken {
    /// The name itself, or with a number behind it when it is taken; it is taken then.
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

/// The nearest name that a formula can use.
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
