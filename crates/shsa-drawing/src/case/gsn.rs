//! Arguments in the YAML of `gsn2x` (version 4): one module per argument, goals `G-`, strategies `S-`, solutions `Sn-`.
//!
//! A claim that is not met stays undeveloped; a refused claim is defeated by a counter solution (`CSn-`). The class of each
//! element is its verdict: `given`, `open`, `circular`, `refused`. Verdicts over time are the layer `over_time`. An [`index`] holds
//! several modules together under one claim, as `gsn2x -c` wants it.

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
    let described = |it: &Stretch| format!("{} {} to {} s", words::verdict(it.verdict), it.from_s, it.to_s);
    stretches.iter().map(described).collect::<Vec<_>>().join(", ")
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
        keys.extend(over_time.get(at).map(|course| format!("over_time: {}", quoted(course))));
        line(format_args!("{}: {{ {} }}", id(at, node), keys.join(", ")));
        if is_defeated {
            let text = quoted("this does not hold now");
            line(format_args!("CSn-{module}-{at}: {{ text: {text}, challenges: {} }}", id(at, node)));
        }
    }
    out
}

/// The module that [`index`] writes. `gsn2x` reads the file `index.gsn.yaml` where no file is named.
pub const INDEX: &str = "index";

/// A module in an [`index`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Listed {
    /// The need or the service that makes the claim of the module; of several claims in a row by the same one, one is enough.
    pub of: String,
    /// The name of the module.
    pub module: String,
    /// The verdict on its claim.
    pub state: Verdict,
}

/// The module over other modules: it claims that each need or service has one module whose claim holds. Their files,
/// `NAME.gsn.yaml`, lie in the same folder. `brief` states the subject and the time. Time: linear in the number of modules.
#[must_use]
pub fn index(listed: &[Listed], brief: &str) -> String {
    let files: Vec<String> = listed.iter().map(|it| quoted(&format!("{}.gsn.yaml", it.module))).collect();
    let module = format!("name: {INDEX}, brief: {}, uses: [{}]", quoted(brief), files.join(", "));
    let mut out = format!("module: {{ {module} }}\n");
    // Writing to memory never fails.
    let mut line = |id: &str, text: &str, by: &[String], state: Verdict| {
        let (by, class) = (by.join(", "), words::verdict(state));
        _ = writeln!(out, "{id}: {{ text: {}, supportedBy: [{by}], classes: [{class}] }}", quoted(text));
    };
    let (mut support, mut worst) = (Vec::new(), Verdict::Holds);
    for (at, alternatives) in listed.chunk_by(|one, other| one.of == other.of).enumerate() {
        let claims: Vec<String> = alternatives.iter().map(|it| format!("G-{}-0", it.module)).collect();
        let best = alternatives.iter().map(|it| it.state).min().unwrap_or(Verdict::Refused);
        worst = worst.max(best);
        if claims.len() == 1 {
            support.extend(claims);
        } else {
            let id = format!("S-{INDEX}-{}", at + 1);
            line(&id, &format!("{}: one of these is enough", alternatives[0].of), &claims, best);
            support.push(id);
        }
    }
    line(&format!("G-{INDEX}-0"), "each need or service has a claim that is given", &support, worst);
    out
}

/// A name for the module and file of each claim: letters, digits and `_`, none twice, none that of the [`INDEX`].
#[must_use]
pub fn modules<'a>(claims: impl IntoIterator<Item = &'a str>) -> Vec<String> {
    let mut names = vec![INDEX.to_owned()];
    for claim in claims {
        let name = identifier(claim);
        let numbered = (2..).map(|number| format!("{name}_{number}"));
        let free = std::iter::once(name.clone()).chain(numbered).find(|it| !names.contains(it));
        names.extend(free);
    }
    names.split_off(1)
}

/// One argument as JSON: its nodes, the claim first, with the ids of its module. `over_time` has the stretches of each node; it is
/// empty where only one moment is known.
#[must_use]
pub fn json(argument: &Argument, name: &str, over_time: &[Vec<Stretch>]) -> Value {
    let module = identifier(name);
    let node = |(at, node): (usize, &Node)| {
        let by = node.supported_by.iter().filter_map(|&by| Some(id(&module, by, argument.nodes.get(by)?)));
        let mut node = json!({
            "id": id(&module, at, node),
            "kind": words::kind(node.kind),
            "text": node.text,
            "verdict": words::verdict(node.state),
            "supported_by": by.collect::<Vec<_>>(),
        });
        if let Some(stretches) = over_time.get(at) {
            node["over_time"] = course_json(stretches);
        }
        node
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_claims_share_a_module() {
        assert_eq!(modules(["/a/b", "a_b", "a b", "c", "index"]), ["a_b", "a_b_2", "a_b_3", "c", "index_2"]);
    }

    #[test]
    fn an_index_claims_one_module_of_each_need() {
        let listed =
            |of: &str, module: &str, state| Listed { of: of.to_owned(), module: module.to_owned(), state };
        let all = [
            listed("/a", "a", Verdict::Refused),
            listed("/a", "a_2", Verdict::Open),
            listed("b", "b", Verdict::Holds),
        ];
        assert_eq!(
            index(&all, "car.yaml"),
            "module: { name: index, brief: \"car.yaml\", uses: [\"a.gsn.yaml\", \"a_2.gsn.yaml\", \"b.gsn.yaml\"] }\n\
             S-index-1: { text: \"/a: one of these is enough\", supportedBy: [G-a-0, G-a_2-0], classes: [open] }\n\
             G-index-0: { text: \"each need or service has a claim that is given\", supportedBy: [S-index-1, G-b-0], classes: [open] }\n"
        );
    }
}
