//! Arguments in the YAML of `gsn2x` (version 4): one module per argument, goals `G-`, strategies `S-`, solutions `Sn-`.
//!
//! A claim that is not met stays undeveloped; a refused claim is defeated by a counter solution (`CSn-`). The class of each
//! element is its verdict: `given`, `open`, `circular`, `refused`.

use super::argument::{Argument, Kind, Node};
use super::words;
use shsa_core::assurance::Verdict;
use std::fmt::Write as _;

/// One argument as a module.
///
/// `name` is the name of the module. The ids contain its letters and digits, so that ids are unique in a case whose module names
/// are unique. `brief` states the subject and the time. Time: linear in the argument.
#[must_use]
pub fn write(argument: &Argument, name: &str, brief: &str) -> String {
    let module = identifier(name);
    let id = |at: usize, node: &Node| format!("{}-{module}-{at}", prefix(node.kind));
    let mut out = format!("module: {{ name: {}, brief: {} }}\n", quoted(&module), quoted(brief));
    // Writing to memory never fails.
    let mut line = |text: std::fmt::Arguments<'_>| _ = writeln!(out, "{text}");
    for (at, node) in argument.nodes.iter().enumerate() {
        let supports: Vec<String> =
            node.supported_by.iter().filter_map(|&by| Some(id(by, argument.nodes.get(by)?))).collect();
        let mut keys = vec![format!("text: {}", quoted(&node.text))];
        if !supports.is_empty() {
            keys.push(format!("supportedBy: [{}]", supports.join(", ")));
        }
        if node.is_undeveloped {
            keys.push("undeveloped: true".to_owned());
        }
        let is_defeated = node.is_undeveloped && node.state == Verdict::Refused;
        if is_defeated {
            keys.push("defeated: true".to_owned());
        }
        keys.push(format!("classes: [{}]", words::verdict(node.state)));
        line(format_args!("{}: {{ {} }}", id(at, node), keys.join(", ")));
        if is_defeated {
            let text = quoted("this does not hold now");
            line(format_args!("CSn-{module}-{at}: {{ text: {text}, challenges: {} }}", id(at, node)));
        }
    }
    out
}

const fn prefix(kind: Kind) -> &'static str {
    match kind {
        Kind::Goal => "G",
        Kind::Strategy => "S",
        Kind::Solution => "Sn",
    }
}

/// A name reduced to letters, digits and `_`.
fn identifier(name: &str) -> String {
    let letters = name.trim_matches('/').chars();
    letters.map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect()
}

/// In double quotes, as YAML and JSON read it.
fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}
