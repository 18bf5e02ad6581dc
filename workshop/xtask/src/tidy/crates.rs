//! Checks the dependencies between crates, the inherited parts of their manifests, and the licence's texts.

use crate::workspace::{File, Package};

/// The permitted dependencies between crates of the workspace: `shsa -> {demo, report, lab, runtime} -> {format, drawing, bridge} ->
/// {model, recording} -> {estimate, message} -> core`.
///
/// A new crate or a new arrow is a change of this table, so that it is seen.
const ARROWS: [(&str, &[&str]); 24] = [
    ("shsa-core", &[]),
    ("shsa-estimate", &["shsa-core"]),
    ("shsa-message", &["shsa-core"]),
    ("shsa-recording", &["shsa-core", "shsa-message"]),
    ("shsa-model", &["shsa-core", "shsa-estimate", "shsa-message"]),
    ("shsa-format", &["shsa-core", "shsa-estimate", "shsa-message", "shsa-model", "shsa-recording"]),
    // Its tests draw models from files.
    ("shsa-drawing", &["shsa-core", "shsa-model"]),
    // Its tests read a story, and make rules of certificates.
    ("shsa-foreign", &["shsa-core", "shsa-message", "shsa-model", "shsa-format", "shsa-drawing"]),
    ("shsa-bridge", &["shsa-core", "shsa-message"]),
    (
        "shsa-lab",
        &["shsa-core", "shsa-estimate", "shsa-message", "shsa-model", "shsa-recording", "shsa-format"],
    ),
    // Foreign: the example of its report on certificates reads some.
    (
        "shsa-report",
        &[
            "shsa-core",
            "shsa-estimate",
            "shsa-model",
            "shsa-recording",
            "shsa-format",
            "shsa-drawing",
            "shsa-foreign",
            "shsa-lab",
        ],
    ),
    ("shsa-c", &["shsa-core", "shsa-estimate", "shsa-model", "shsa-format"]),
    ("shsa-web", &[]),
    (
        "shsa-wasm",
        &[
            "shsa-core",
            "shsa-estimate",
            "shsa-message",
            "shsa-model",
            "shsa-recording",
            "shsa-format",
            "shsa-drawing",
            "shsa-lab",
            "shsa-report",
        ],
    ),
    ("shsa-wasm-glue", &[]),
    (
        "shsa-demo",
        &["shsa-core", "shsa-estimate", "shsa-message", "shsa-model", "shsa-format", "shsa-bridge"],
    ),
    (
        "shsa-runtime",
        &[
            "shsa-core",
            "shsa-estimate",
            "shsa-message",
            "shsa-model",
            "shsa-format",
            "shsa-bridge",
            "shsa-web",
        ],
    ),
    (
        "shsa",
        &[
            "shsa-core",
            "shsa-estimate",
            "shsa-message",
            "shsa-model",
            "shsa-recording",
            "shsa-format",
            "shsa-foreign",
            "shsa-drawing",
            "shsa-bridge",
            "shsa-lab",
            "shsa-report",
            "shsa-runtime",
            "shsa-demo",
        ],
    ),
    (
        "shsa-bench",
        &[
            "shsa-core",
            "shsa-estimate",
            "shsa-message",
            "shsa-model",
            "shsa-recording",
            "shsa-format",
            "shsa-drawing",
            "shsa-bridge",
            "shsa-lab",
            "shsa-runtime",
            "shsa-demo",
        ],
    ),
    (
        "shsa-demos",
        &[
            "shsa-core",
            "shsa-estimate",
            "shsa-message",
            "shsa-model",
            "shsa-format",
            "shsa-bridge",
            "shsa-runtime",
            "shsa-demo",
        ],
    ),
    (
        "shsa-python",
        &[
            "shsa-bridge",
            "shsa-core",
            "shsa-estimate",
            "shsa-model",
            "shsa-recording",
            "shsa-format",
            "shsa-lab",
            "shsa-message",
            "shsa-report",
            "shsa-runtime",
        ],
    ),
    (
        "shsa-fuzz",
        &[
            "shsa-core",
            "shsa-estimate",
            "shsa-message",
            "shsa-model",
            "shsa-recording",
            "shsa-format",
            "shsa-foreign",
            "shsa-bridge",
        ],
    ),
    ("shsa-ratchet", &["shsa-core"]),
    ("xtask", &[]),
];

/// Keys that only the workspace's manifest sets.
const INHERITED: [&str; 4] = ["version", "edition", "rust-version", "license"];

/// The only files that may be unsafe, each of a crate whose lints deny unsafe code elsewhere; ARCHITECTURE.md says why.
const UNSAFE: [&str; 1] = ["crates/shsa-c/src/border.rs"];

/// What switches that lint off, written in two parts because this file is checked, too.
const SWITCHES: [&str; 2] = [concat!("expect(", "unsafe_code"), concat!("allow(", "unsafe_code")];

/// The texts of the workspace's licence.
const LICENCES: [&str; 2] = ["LICENSE-MIT", "LICENSE-APACHE"];

/// A crate depends only on crates that the table permits; its tests, too.
pub(super) fn arrows(package: &Package) -> Vec<String> {
    let Some((name, allowed)) = ARROWS.iter().find(|(name, _)| *name == package.name) else {
        return vec![format!(
            "crate `{}` is not in the table of workshop/xtask/src/tidy/crates.rs",
            package.name
        )];
    };
    let is_ours = |to: &str| ARROWS.iter().any(|(name, _)| *name == to);
    let names = package.dependencies.iter().map(|dependency| &*dependency.name);
    let wrong = names.filter(|to| is_ours(to) && !allowed.contains(to));
    wrong.map(|to| format!("crate `{name}` must not rest on `{to}`")).collect()
}

/// A crate's manifest inherits the common version and licence, and its lints forbid unsafe code; a crate that is a workspace of
/// its own inherits nothing.
pub(super) fn manifest(file: &File) -> Vec<String> {
    if !file.path.ends_with("/Cargo.toml") {
        return Vec::new();
    }
    let manifest: toml::Table = match file.text.parse() {
        Ok(manifest) => manifest,
        Err(error) => return vec![format!("{}: {error}", file.path)],
    };
    let at = |path: &[&str]| look_up(&manifest, path);
    if at(&["workspace"]).is_some() {
        return Vec::new();
    }
    let inherits =
        |key: &str| at(&["package", key, "workspace"]).and_then(toml::Value::as_bool) == Some(true);
    let mut problems: Vec<String> = INHERITED
        .iter()
        .filter(|key| !inherits(key))
        .map(|key| format!("{}: `{key}` must be the workspace's: `{key}.workspace = true`", file.path))
        .collect();
    let lints = at(&["lints", "workspace"]).and_then(toml::Value::as_bool) == Some(true);
    let level = at(&["lints", "rust", "unsafe_code"]).and_then(toml::Value::as_str);
    let has_exception = UNSAFE.iter().any(|path| path.starts_with(file.path.trim_end_matches("Cargo.toml")));
    if !lints && level != Some("forbid") && !(has_exception && level == Some("deny")) {
        problems.push(format!("{}: nothing forbids unsafe code: `lints.workspace = true`", file.path));
    }
    problems
}

/// No source of a crate, other than the exceptions, switches the lint against unsafe code off; tests may.
pub(super) fn unsafe_code(file: &File) -> Option<String> {
    let switches = |line: &str| SWITCHES.iter().any(|switch| line.contains(switch));
    let is_source = file.path.contains("/src/") && file.path.ends_with(".rs");
    if !is_source || UNSAFE.contains(&&*file.path) {
        return None;
    }
    let number = file.text.lines().position(switches)? + 1;
    Some(format!("{}:{number}: only {} may be unsafe", file.path, UNSAFE.join(", ")))
}

fn look_up<'a>(table: &'a toml::Table, path: &[&str]) -> Option<&'a toml::Value> {
    let (first, rest) = path.split_first()?;
    rest.iter().try_fold(table.get(*first)?, |value, key| value.get(key))
}

/// Both texts of the licence are present.
pub(super) fn licence_files(files: &[File]) -> Vec<String> {
    let is_there = |name: &str| files.iter().any(|file| file.path == name && !file.text.is_empty());
    LICENCES.iter().filter(|name| !is_there(name)).map(|name| format!("{name} is absent")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::workspace::Dependency;

    #[track_caller]
    fn check_arrows(name: &str, dependencies: &[&str], expected: &[&str]) {
        let package = Package {
            id: name.into(),
            name: name.into(),
            version: "0.1.0".into(),
            license: None,
            dependencies: dependencies.iter().map(|name| Dependency { name: (*name).into() }).collect(),
        };
        assert_eq!(arrows(&package), expected);
    }

    #[test]
    fn arrows_point_down_only() {
        check_arrows("shsa", &["shsa-format", "shsa-core", "clap"], &[]);
        check_arrows("shsa-format", &["shsa-core", "serde"], &[]);
        check_arrows(
            "shsa-format",
            &["shsa-bridge"],
            &["crate `shsa-format` must not rest on `shsa-bridge`"],
        );
        check_arrows("shsa-core", &["shsa-format"], &["crate `shsa-core` must not rest on `shsa-format`"]);
        check_arrows(
            "shsa-utils",
            &[],
            &["crate `shsa-utils` is not in the table of workshop/xtask/src/tidy/crates.rs"],
        );
    }

    #[track_caller]
    fn check_manifest(text: &str, expected: &[&str]) {
        assert_eq!(manifest(&File { path: "a/Cargo.toml".into(), text: text.into() }), expected);
    }

    #[test]
    fn a_manifest_inherits() {
        let package = "[package]\nname = \"a\"\nedition.workspace = true\nrust-version.workspace = true\nlicense.workspace = true\n";
        let version = "version.workspace = true\n";
        check_manifest(&format!("{package}{version}[lints]\nworkspace = true"), &[]);
        check_manifest("[workspace]\n[package]\nname = \"a\"\nversion = \"0.2.0\"", &[]);
        check_manifest(&format!("{package}{version}[lints.rust]\nunsafe_code = \"forbid\""), &[]);
        check_manifest(
            &format!("{package}version = \"0.2.0\"\nlints.rust.unsafe_code = \"deny\""),
            &[
                "a/Cargo.toml: `version` must be the workspace's: `version.workspace = true`",
                "a/Cargo.toml: nothing forbids unsafe code: `lints.workspace = true`",
            ],
        );
    }

    #[test]
    fn unsafe_code_stands_in_the_named_files_only() {
        let check = |path: &str, text: &str| {
            unsafe_code(&File { path: path.into(), text: text.into() }).unwrap_or_default()
        };
        let switch = format!("//! Fast.\n#![{}, reason = \"speed\")]\n", SWITCHES[0]);
        assert_eq!(check("crates/shsa-c/src/border.rs", &switch), "");
        assert_eq!(check("crates/shsa-c/tests/c.rs", &switch), "");
        assert_eq!(check("crates/a/src/lib.rs", "//! Slow.\n"), "");
        let problem = "crates/a/src/lib.rs:2: only crates/shsa-c/src/border.rs may be unsafe";
        assert_eq!(check("crates/a/src/lib.rs", &switch), problem);
    }

    #[test]
    fn the_crate_of_an_exception_denies_unsafe_code() {
        let manifest_of = |folder: &str| {
            let package = "[package]\nname = \"a\"\nedition.workspace = true\nrust-version.workspace = true\nlicense.workspace = true\n";
            let text = format!("{package}version.workspace = true\n[lints.rust]\nunsafe_code = \"deny\"\n");
            manifest(&File { path: format!("crates/{folder}/Cargo.toml"), text })
        };
        assert_eq!(manifest_of("shsa-c"), [""; 0]);
        assert_eq!(manifest_of("shsa-core").len(), 1);
    }

    #[test]
    fn both_licences_are_there() {
        let file = |path: &str, text: &str| File { path: path.into(), text: text.into() };
        assert!(licence_files(&[file("LICENSE-MIT", "x"), file("LICENSE-APACHE", "x")]).is_empty());
        assert_eq!(
            licence_files(&[file("LICENSE-MIT", "")]),
            ["LICENSE-MIT is absent", "LICENSE-APACHE is absent"]
        );
    }
}
