//! Checks that every crate in what is shipped has a permissive licence, by the list in `deny.toml`.

use crate::command;
use crate::workspace::{Edge, Metadata, Package};
use anyhow::{Context, Result, bail};
use serde::Deserialize;
use spdx::{Expression, Licensee, ParseMode};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;

/// The crates of which something is shipped: the command, the library for C, the packages for Python and for npm.
const SHIPPED: [&str; 4] = ["shsa", "shsa-c", "shsa-python", "shsa-wasm"];

/// The crates that other programs depend on, where `[patch]` has no effect.
const LIBRARIES: [&str; 13] = [
    "shsa-core",
    "shsa-message",
    "shsa-model",
    "shsa-recording",
    "shsa-format",
    "shsa-drawing",
    "shsa-foreign",
    "shsa-bridge",
    "shsa-lab",
    "shsa-report",
    "shsa-runtime",
    "shsa-demo",
    "shsa-c",
];

/// The part of `deny.toml` that is used here; cargo-deny uses the rest.
#[derive(Deserialize)]
struct Deny {
    licenses: Licenses,
}

#[derive(Deserialize)]
struct Licenses {
    allow: Vec<String>,
}

/// Checks every crate in what is shipped, on any platform; also runs cargo-deny, if it is installed.
///
/// # Errors
/// When a crate's licence is absent, unreadable or not allowed.
pub(crate) fn check() -> Result<()> {
    let allowed = allowed(&fs::read_to_string("deny.toml").context("reading deny.toml")?)?;
    let metadata = Metadata::read()?;
    let shipped = shipped(&metadata, &SHIPPED)?;
    let problems: Vec<String> = shipped.iter().filter_map(|package| problem(package, &allowed)).collect();
    if !problems.is_empty() {
        bail!("{}", problems.join("\n"));
    }
    println!("{} crates are shipped, each under a licence of deny.toml", shipped.len());
    let patched = patched(&fs::read_to_string("Cargo.toml").context("reading Cargo.toml")?)?;
    for library in LIBRARIES {
        let tree = ["cargo", "tree", "--locked", "--package", library, "--edges", "normal,build"];
        let tree = command::output(&[&tree[..], &["--prefix", "none", "--format", "{p}"]].concat())?;
        if let Some(name) = patched.iter().find(|name| rests_on(&tree, name)) {
            bail!("{library} rests on {name} without any feature: who depends on it gets the unpatched one");
        }
    }
    if command::succeeds(&["cargo", "deny", "--version"]) {
        command::run(&["cargo", "deny", "check", "licenses", "bans", "sources"])?;
    }
    Ok(())
}

fn allowed(deny: &str) -> Result<Vec<Licensee>> {
    let deny: Deny = toml::from_str(deny).context("reading deny.toml")?;
    let parse = |name: &String| Licensee::parse(name).with_context(|| format!("deny.toml: licence `{name}`"));
    deny.licenses.allow.iter().map(parse).collect()
}

/// The names of the crates that `[patch]` replaces.
fn patched(manifest: &str) -> Result<Vec<String>> {
    let manifest: toml::Table = toml::from_str(manifest).context("reading Cargo.toml")?;
    let patches = manifest.get("patch").and_then(|patch| patch.get("crates-io")?.as_table());
    Ok(patches.into_iter().flat_map(|patches| patches.keys().cloned()).collect())
}

/// Whether a line of `cargo tree`'s output is about a crate.
fn rests_on(tree: &str, name: &str) -> bool {
    tree.lines().any(|line| line.split(' ').next() == Some(name))
}

/// The crates that are in what is shipped of these crates or build it, without the dependencies of tests.
fn shipped<'m>(metadata: &'m Metadata, names: &[&str]) -> Result<Vec<&'m Package>> {
    let root = |name: &&str| {
        let found = metadata.members().find(|package| package.name == **name);
        found.map(|package| &*package.id).with_context(|| format!("no crate `{name}`"))
    };
    let roots: Vec<&str> = names.iter().map(root).collect::<Result<_>>()?;
    let edges: BTreeMap<&str, &[Edge]> =
        metadata.resolve.nodes.iter().map(|node| (&*node.id, &*node.deps)).collect();
    let mut seen: BTreeSet<&str> = roots.iter().copied().collect();
    let mut open = roots;
    while let Some(id) = open.pop() {
        let edges = edges.get(id).copied().unwrap_or_default();
        let ids = edges.iter().filter(|edge| is_shipped(edge)).map(|edge| &*edge.pkg);
        open.extend(ids.filter(|id| seen.insert(id)));
    }
    Ok(metadata.packages.iter().filter(|package| seen.contains(&*package.id)).collect())
}

fn is_shipped(edge: &Edge) -> bool {
    edge.dep_kinds.iter().any(|kind| kind.kind.as_deref() != Some("dev"))
}

fn problem(package: &Package, allowed: &[Licensee]) -> Option<String> {
    let name = format!("{} {}", package.name, package.version);
    let Some(licence) = &package.license else { return Some(format!("{name} names no licence")) };
    match Expression::parse_mode(licence, ParseMode::LAX) {
        Err(error) => Some(format!("{name}: licence `{licence}`: {}", error.reason)),
        Ok(expression) if expression.evaluate(|wanted| allowed.iter().any(|l| l.satisfies(wanted))) => None,
        Ok(_) => Some(format!("{name}: licence `{licence}` is not allowed by deny.toml")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DENY: &str = r#"licenses.allow = ["MIT", "Apache-2.0 WITH LLVM-exception", "Unicode-3.0"]"#;

    #[track_caller]
    fn check(licence: Option<&str>, expected: Option<&str>) {
        let package = Package {
            id: "x".into(),
            name: "x".into(),
            version: "1.0.0".into(),
            license: licence.map(Into::into),
            dependencies: Vec::new(),
        };
        let problem = problem(&package, &allowed(DENY).unwrap());
        assert_eq!(problem.as_deref(), expected);
    }

    #[test]
    fn what_is_patched_is_found_in_a_tree() {
        let manifest = "[patch.crates-io]\ndirs = { path = 'patches/dirs' }\n";
        assert_eq!(patched(manifest).unwrap(), ["dirs"]);
        assert_eq!(patched("").unwrap(), [""; 0]);
        assert!(rests_on("shsa-bridge v0.1.0\ndirs v6.0.0 (/patches/dirs)\n", "dirs"));
        assert!(!rests_on("shsa-bridge v0.1.0\ndirs-sys v1.0.0\n", "dirs"));
    }

    #[test]
    fn expressions_are_evaluated() {
        check(Some("MIT"), None);
        check(Some("MIT/Apache-2.0"), None);
        check(Some("GPL-3.0-only OR MIT"), None);
        check(Some("(MIT OR Apache-2.0) AND Unicode-3.0"), None);
        check(Some("Apache-2.0 WITH LLVM-exception"), None);
    }

    #[test]
    fn what_is_not_allowed_is_refused() {
        check(Some("AGPL-3.0-only"), Some("x 1.0.0: licence `AGPL-3.0-only` is not allowed by deny.toml"));
        check(
            Some("MIT AND GPL-2.0"),
            Some("x 1.0.0: licence `MIT AND GPL-2.0` is not allowed by deny.toml"),
        );
        check(Some("Apache-2.0"), Some("x 1.0.0: licence `Apache-2.0` is not allowed by deny.toml"));
        check(None, Some("x 1.0.0 names no licence"));
    }

    #[test]
    fn what_only_tests_use_is_not_shipped() {
        let package = |name: &str| {
            format!(
                r#"{{"id": "{name}", "name": "{name}", "version": "1.0.0", "license": null, "dependencies": []}}"#
            )
        };
        let edge = |to: &str, kind: &str| format!(r#"{{"pkg": "{to}", "dep_kinds": [{{"kind": {kind}}}]}}"#);
        let node = |id: &str, deps: [String; 2]| format!(r#"{{"id": "{id}", "deps": [{}]}}"#, deps.join(","));
        let metadata = format!(
            r#"{{"packages": [{}], "workspace_members": ["shsa"], "resolve": {{"nodes": [{}, {}]}}}}"#,
            ["shsa", "linked", "builder", "tester"].map(package).join(","),
            node("shsa", [edge("linked", "null"), edge("tester", "\"dev\"")]),
            node("linked", [edge("builder", "\"build\""), edge("shsa", "\"dev\"")]),
        );
        let metadata: Metadata = serde_json::from_str(&metadata).unwrap();
        let names: Vec<_> =
            shipped(&metadata, &["shsa"]).unwrap().iter().map(|package| &*package.name).collect();
        assert_eq!(names, ["shsa", "linked", "builder"]);
        assert!(shipped(&metadata, &["shsa", "gone"]).is_err());
    }
}
