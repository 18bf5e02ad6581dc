//! Arguments in the YAML of `gsn2x` (version 4): one module per argument, goals `G-`, strategies `S-`, solutions `Sn-`.
//!
//! A claim that is not met stays undeveloped; a refused claim is defeated by a counter solution (`CSn-`). The class of each
//! element is its verdict: `given`, `open`, `circular`, `refused`. Verdicts over time are the layer `over_time`.

use super::argument::{Argument, Kind, Node};
use super::words;
use serde_json::{Value, json};
use shsa_core::assurance::Verdict;
use std::fmt::Write as _;

/// A time during which a node had one verdict, in seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stretch {
    /// When it began.
    pub from_s: f64,
    /// When it ended.
    pub to_s: f64,
    /// The verdict.
    pub verdict: Verdict,
}

/// The verdicts of a node over time in words: `given 0 to 15 s, refused 15 to 36 s`.
#[must_use]
pub fn course(stretches: &[Stretch]) -> String {
    let told = |it: &Stretch| format!("{} {} to {} s", words::verdict(it.verdict), it.from_s, it.to_s);
    stretches.iter().map(told).collect::<Vec<_>>().join(", ")
}

/// The verdicts of a node over time as JSON.
#[must_use]
pub fn course_json(stretches: &[Stretch]) -> Value {
    let one =
        |it: &Stretch| json!({ "from_s": it.from_s, "to_s": it.to_s, "verdict": words::verdict(it.verdict) });
    stretches.iter().map(one).collect()
}

/// One argument as a module.
///
/// `name` is the name of the module. The ids contain its letters and digits, so that ids are unique in a case whose module names
/// are unique. `brief` states the subject and the time. `over_time` states in words how each node stood over time; it is empty
/// where only one moment is known. Time: linear in the argument.
#[must_use]
pub fn write(argument: &Argument, name: &str, brief: &str, over_time: &[String]) -> String {
    let module = identifier(name);
    let id = |at: usize, node: &Node| id(&module, at, node);
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
        keys.extend(over_time.get(at).map(|told| format!("over_time: {}", quoted(told))));
        line(format_args!("{}: {{ {} }}", id(at, node), keys.join(", ")));
        if is_defeated {
            let text = quoted("this does not hold now");
            line(format_args!("CSn-{module}-{at}: {{ text: {text}, challenges: {} }}", id(at, node)));
        }
    }
    out
}

/// One argument as JSON: its nodes, the claim first, with the ids of its module. `over_time` has the stretches of each node; it is
/// empty where only one moment is known.
#[must_use]
pub fn json(argument: &Argument, name: &str, over_time: &[Vec<Stretch>]) -> Value {
    let module = identifier(name);
    let node = |(at, node): (usize, &Node)| {
        let by = node.supported_by.iter().filter_map(|&by| Some(id(&module, by, argument.nodes.get(by)?)));
        let mut told = json!({
            "id": id(&module, at, node),
            "kind": words::kind(node.kind),
            "text": node.text,
            "verdict": words::verdict(node.state),
            "supported_by": by.collect::<Vec<_>>(),
        });
        if let Some(stretches) = over_time.get(at) {
            told["over_time"] = course_json(stretches);
        }
        told
    };
    argument.nodes.iter().enumerate().map(node).collect()
}

/// The id of a node: `G-dmin-0`.
fn id(module: &str, at: usize, node: &Node) -> String {
    format!("{}-{module}-{at}", prefix(node.kind))
}

const fn prefix(kind: Kind) -> &'static str {
    match kind {
        Kind::Goal => "G",
        Kind::Strategy => "S",
        Kind::Solution => "Sn",
    }
}

/// A name reduced to letters, digits and `_`, for files and ids.
#[must_use]
pub fn identifier(name: &str) -> String {
    let letters = name.trim_matches('/').chars();
    letters.map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect()
}

/// In double quotes, as YAML and JSON read it.
fn quoted(text: &str) -> String {
    Value::from(text).to_string()
}
