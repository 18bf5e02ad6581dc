//! What cargo and git know about this workspace: its crates, what they rest on, its files.

use crate::command;
use anyhow::{Context, Result};
use serde::Deserialize;
use std::path::Path;

/// The workspace's folder.
pub(crate) fn root() -> &'static Path {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().unwrap_or(here)
}

/// The part of `cargo metadata` that the checks read.
#[derive(Deserialize)]
pub(crate) struct Metadata {
    /// Every crate of the workspace and every crate that it rests on, on any platform.
    pub(crate) packages: Vec<Package>,
    /// Ids of the workspace's own crates.
    pub(crate) workspace_members: Vec<String>,
    /// Who rests on whom, after features and versions are settled.
    pub(crate) resolve: Resolve,
}

/// One crate.
#[derive(Deserialize)]
pub(crate) struct Package {
    pub(crate) id: String,
    pub(crate) name: String,
    pub(crate) version: String,
    /// As an SPDX expression.
    pub(crate) license: Option<String>,
    /// What its manifest asks for, tests included.
    pub(crate) dependencies: Vec<Dependency>,
}

/// A line of a manifest's dependencies.
#[derive(Deserialize)]
pub(crate) struct Dependency {
    pub(crate) name: String,
}

/// The graph of crates.
#[derive(Deserialize)]
pub(crate) struct Resolve {
    pub(crate) nodes: Vec<Node>,
}

/// A crate in the graph, by id.
#[derive(Deserialize)]
pub(crate) struct Node {
    pub(crate) id: String,
    pub(crate) deps: Vec<Edge>,
}

/// What a crate rests on, and for what.
#[derive(Deserialize)]
pub(crate) struct Edge {
    pub(crate) pkg: String,
    pub(crate) dep_kinds: Vec<EdgeKind>,
}

/// `None` for the crate itself, else `build` or `dev`.
#[derive(Deserialize)]
pub(crate) struct EdgeKind {
    pub(crate) kind: Option<String>,
}

impl Metadata {
    /// Asks cargo.
    ///
    /// # Errors
    /// When cargo fails: `Cargo.lock` is behind the manifests, say.
    pub(crate) fn read() -> Result<Metadata> {
        let text = command::output(&["cargo", "metadata", "--format-version", "1", "--locked"])?;
        serde_json::from_str(&text).context("reading the output of `cargo metadata`")
    }

    /// The workspace's own crates.
    pub(crate) fn members(&self) -> impl Iterator<Item = &Package> {
        self.packages.iter().filter(|package| self.workspace_members.contains(&package.id))
    }
}

/// A text file of the project.
pub(crate) struct File {
    /// Relative to the workspace's folder, with `/`.
    pub(crate) path: String,
    pub(crate) text: String,
}

/// Every text file that is tracked or would be by `git add`; files that are not UTF-8 are left out.
///
/// # Errors
/// When git is not there, or this is no clone.
pub(crate) fn files() -> Result<Vec<File>> {
    let list = command::output(&["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"])?;
    let paths = list.split('\0').filter(|path| !path.is_empty());
    Ok(paths.filter_map(|path| Some(File { path: path.into(), text: text_of(path)? })).collect())
}

/// `None` for what is deleted but still listed, and for what is no text.
fn text_of(path: &str) -> Option<String> {
    String::from_utf8(std::fs::read(path).ok()?).ok()
}
