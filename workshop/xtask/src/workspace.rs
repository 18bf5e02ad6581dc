//! Facts of cargo and git about this workspace: its crates, their dependencies, its files.

use crate::command;
use anyhow::{Context, Result};
use serde::Deserialize;
use std::path::Path;

/// The features of released programs beside the default ones.
pub(crate) const RELEASED: &str = "shsa/ros2-dds";
/// Those of all that is tested.
pub(crate) const TESTED: &str = "shsa/ros2-dds,shsa-demos/ros2-dds";

/// The workspace's folder.
pub(crate) fn root() -> &'static Path {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.ancestors().nth(2).unwrap_or(here)
}

/// The used part of `cargo metadata`.
#[derive(Deserialize)]
pub(crate) struct Metadata {
    /// Every crate of the workspace and all dependencies, on any platform.
    pub(crate) packages: Vec<Package>,
    /// Ids of the workspace's own crates.
    pub(crate) workspace_members: Vec<String>,
    /// The dependencies after features and versions are resolved.
    pub(crate) resolve: Resolve,
}

/// One crate.
#[derive(Deserialize)]
pub(crate) struct Package {
    pub(crate) id: String,
    pub(crate) name: String,
    pub(crate) version: String,
    /// An SPDX expression.
    pub(crate) license: Option<String>,
    /// The dependencies in its manifest, including those of tests.
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

/// A dependency of a crate, with its kinds.
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
    /// Runs `cargo metadata` with the features of what is released.
    ///
    /// # Errors
    /// When cargo fails, for example because `Cargo.lock` is out of date.
    pub(crate) fn read() -> Result<Metadata> {
        let line = ["cargo", "metadata", "--format-version", "1", "--locked", "--features", RELEASED];
        let text = command::output(&line)?;
        serde_json::from_str(&text).context("reading the output of `cargo metadata`")
    }

    /// The workspace's own crates.
    pub(crate) fn members(&self) -> impl Iterator<Item = &Package> {
        self.packages.iter().filter(|package| self.workspace_members.contains(&package.id))
    }
}

/// A text file of the project.
pub(crate) struct File {
    /// The path relative to the workspace's folder, with `/`.
    pub(crate) path: String,
    pub(crate) text: String,
}

/// Every text file that is tracked or that `git add` would track; files that are not UTF-8 are left out.
///
/// # Errors
/// When git is missing, or this is no clone.
pub(crate) fn files() -> Result<Vec<File>> {
    let root = root().to_str().context("the workspace's folder has a name that is not UTF-8")?;
    let list = command::output(&[
        "git",
        "-C",
        root,
        "ls-files",
        "-z",
        "--cached",
        "--others",
        "--exclude-standard",
    ])?;
    let paths = list.split('\0').filter(|path| !path.is_empty());
    Ok(paths.filter_map(|path| Some(File { path: path.into(), text: text_of(path)? })).collect())
}

/// `None` for a deleted file that is still listed, and for a file that is no text.
fn text_of(path: &str) -> Option<String> {
    String::from_utf8(std::fs::read(root().join(path)).ok()?).ok()
}
