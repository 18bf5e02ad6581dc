//! The bill of materials of the command: every crate in it, with version, licence, checksum and dependencies, as `CycloneDX`.
//!
//! <https://cyclonedx.org/docs/1.5/json/>. The same sources give the same text: it has no time and no serial number.

use crate::command;
use crate::workspace::{Metadata, Package, RELEASED};
use anyhow::{Context, Result};
use serde::Deserialize;
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;

/// The used part of `Cargo.lock`.
#[derive(Deserialize)]
struct Lock {
    package: Vec<Locked>,
}

#[derive(Deserialize)]
struct Locked {
    name: String,
    version: String,
    /// SHA-256 of the crate's archive; the workspace's own crates have none.
    checksum: Option<String>,
}

/// A crate by name and version, of which a build has each once.
type Crate<'a> = (&'a str, &'a str);

/// The bill of a crate of the workspace with the features of what is released, on this platform.
///
/// # Errors
/// When cargo fails, or the crate or its lock is missing.
pub(crate) fn of(name: &str) -> Result<String> {
    let line = ["cargo", "tree", "--locked", "--package", name, "--edges", "normal", "--prefix", "none"];
    let tree = command::output(&[&line[..], &["--features", RELEASED, "--format", "{p}"]].concat())?;
    let metadata = Metadata::read()?;
    let lock = toml::from_str(&fs::read_to_string("Cargo.lock").context("reading Cargo.lock")?)?;
    let bill = bill(name, &linked(&tree), &metadata, &lock)?;
    Ok(format!("{}\n", serde_json::to_string_pretty(&bill)?))
}

/// The crates in the output of `cargo tree`.
fn linked(tree: &str) -> BTreeSet<Crate<'_>> {
    let crates = tree.lines().filter_map(|line| {
        let mut words = line.split(' ');
        words.next().zip(words.next()?.strip_prefix('v'))
    });
    crates.collect()
}

fn bill(name: &str, linked: &BTreeSet<Crate<'_>>, metadata: &Metadata, lock: &Lock) -> Result<Value> {
    let checksums: BTreeMap<Crate<'_>, &str> = lock
        .package
        .iter()
        .filter_map(|it| Some(((&*it.name, &*it.version), it.checksum.as_deref()?)))
        .collect();
    let is_linked = |package: &&Package| linked.contains(&(&*package.name, &*package.version));
    let packages: BTreeMap<&str, &Package> =
        metadata.packages.iter().filter(is_linked).map(|package| (&*package.id, package)).collect();
    let own = metadata.members().find(|package| package.name == name);
    let own = own.with_context(|| format!("no crate `{name}`"))?;
    let components = packages.values().filter(|package| package.id != own.id).map(|package| {
        let checksum = checksums.get(&(&*package.name, &*package.version));
        component("library", package, checksum.copied())
    });
    let edges = metadata.resolve.nodes.iter().filter(|node| packages.contains_key(&*node.id));
    let dependencies = edges.map(|node| {
        let normal = node.deps.iter().filter(|edge| edge.dep_kinds.iter().any(|kind| kind.kind.is_none()));
        let on: BTreeSet<String> =
            normal.filter_map(|edge| packages.get(&*edge.pkg)).map(|package| url(package)).collect();
        json!({"ref": packages.get(&*node.id).map(|package| url(package)), "dependsOn": on})
    });
    Ok(json!({
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "version": 1,
        "metadata": {"component": component("application", own, None)},
        "components": components.collect::<Vec<_>>(),
        "dependencies": dependencies.collect::<Vec<_>>(),
    }))
}

fn component(kind: &str, package: &Package, checksum: Option<&str>) -> Value {
    let mut component = json!({
        "type": kind,
        "bom-ref": url(package),
        "name": package.name,
        "version": package.version,
        "purl": url(package),
    });
    if let Some(licence) = &package.license {
        // Older crates separate alternatives by a slash.
        component["licenses"] = json!([{"expression": licence.replace('/', " OR ")}]);
    }
    if let Some(checksum) = checksum {
        component["hashes"] = json!([{"alg": "SHA-256", "content": checksum}]);
    }
    component
}

/// The name of a crate by the scheme of package URLs.
fn url(package: &Package) -> String {
    format!("pkg:cargo/{}@{}", package.name, package.version)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_and_the_crates_in_it_are_listed() {
        let tree = "shsa v0.1.0 (/w/crates/shsa)\nlibm v0.2.15\nlibm v0.2.15 (*)\n";
        let package = |id: &str, version: &str, licence: &str| {
            format!(
                r#"{{"id": "{id}#1", "name": "{id}", "version": "{version}", "license": "{licence}", "dependencies": []}}"#
            )
        };
        let metadata = format!(
            r#"{{"packages": [{}, {}, {}], "workspace_members": ["shsa#1"], "resolve": {{"nodes": [
                {{"id": "shsa#1", "deps": [{{"pkg": "libm#1", "dep_kinds": [{{"kind": null}}]}},
                    {{"pkg": "cc#1", "dep_kinds": [{{"kind": "build"}}]}}]}},
                {{"id": "libm#1", "deps": []}}, {{"id": "cc#1", "deps": []}}]}}}}"#,
            package("shsa", "0.1.0", "MIT OR Apache-2.0"),
            package("libm", "0.2.15", "MIT/Apache-2.0"),
            package("cc", "1.0.0", "MIT"),
        );
        let lock = "[[package]]\nname = 'libm'\nversion = '0.2.15'\nchecksum = 'ab'\n[[package]]\nname = 'shsa'\nversion = '0.1.0'\n";
        let metadata: Metadata = serde_json::from_str(&metadata).unwrap();
        let bill = bill("shsa", &linked(tree), &metadata, &toml::from_str(lock).unwrap()).unwrap();
        assert_eq!(bill["metadata"]["component"]["purl"], "pkg:cargo/shsa@0.1.0");
        assert_eq!(
            bill["components"],
            json!([{
                "type": "library", "bom-ref": "pkg:cargo/libm@0.2.15", "name": "libm", "version": "0.2.15",
                "purl": "pkg:cargo/libm@0.2.15", "licenses": [{"expression": "MIT OR Apache-2.0"}],
                "hashes": [{"alg": "SHA-256", "content": "ab"}]
            }])
        );
        let on_libm = json!({"ref": "pkg:cargo/shsa@0.1.0", "dependsOn": ["pkg:cargo/libm@0.2.15"]});
        assert!(bill["dependencies"].as_array().unwrap().contains(&on_libm), "{bill}");
    }
}
