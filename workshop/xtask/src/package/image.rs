//! The files of a container's image: the command with the libraries of this machine that it needs, and nothing else.

use super::{put, text};
use crate::command;
use anyhow::{Context, Result};
use std::fs;
use std::path::{Path, PathBuf};

/// The user of the container, which owns its state.
const USER: &str = "65532";
/// Files of the package that are in the image, too.
const FILES: [&str; 3] = ["usr/bin/shsa", "usr/share/doc/shsa/copyright", "usr/share/doc/shsa/sbom.cdx.json"];
/// The folder that the container's user may write.
const STATE: &str = "var/lib/shsa";

/// Writes `image.tar` for `deploy/Containerfile`, of the package's files in `stage`; all files are as old as the sources.
///
/// # Errors
/// When a library is missing, or the file cannot be written.
pub(super) fn write(stage: &Path, out: &Path, source_date: &str) -> Result<()> {
    let root = out.join("image");
    if root.exists() {
        fs::remove_dir_all(&root).context("clearing the files of an earlier image")?;
    }
    for file in FILES {
        put(&stage.join(file), &root.join(file), if file.contains("/bin/") { 0o755 } else { 0o644 })?;
    }
    for library in libraries(&command::output(&["ldd", &shown(&stage.join("usr/bin/shsa"))])?) {
        let place = root.join(library.strip_prefix("/").context("a library without a path")?);
        put(&library, &place, 0o755)?;
    }
    text(&root.join("etc/passwd"), &format!("shsa:x:{USER}:{USER}::/{STATE}:/usr/sbin/nologin\n"))?;
    text(&root.join("etc/group"), &format!("shsa:x:{USER}:\n"))?;
    text(&root.join("etc/nsswitch.conf"), "hosts: files dns\n")?;
    fs::create_dir_all(root.join("etc/shsa"))?;
    fs::create_dir_all(root.join(STATE))?;
    packed(&root, &out.join("image.tar"), source_date)?;
    Ok(fs::remove_dir_all(&root)?)
}

/// The paths in the output of `ldd`: `NAME => PATH (ADDRESS)`, or for the loader `PATH (ADDRESS)`.
fn libraries(listed: &str) -> Vec<PathBuf> {
    let path = |line: &str| {
        let found = line.rsplit("=>").next().unwrap_or(line).trim();
        found.split(' ').next().filter(|path| path.starts_with('/')).map(PathBuf::from)
    };
    listed.lines().filter_map(path).collect()
}

/// Packs a folder in the order of names: the state belongs to the container's user, all else to root.
fn packed(root: &Path, tar: &Path, source_date: &str) -> Result<()> {
    let (root, tar, date) = (shown(root), shown(tar), format!("--mtime=@{source_date}"));
    let same = ["--sort=name", "--numeric-owner", "--format=gnu", &date, "--directory", &root];
    let first = ["tar", "--create", "--file", &tar, "--owner=0", "--group=0", "--exclude", STATE];
    command::run(&[&first[..], &same, &["."]].concat())?;
    let [owner, group] = ["owner", "group"].map(|name| format!("--{name}={USER}"));
    command::run(&[&["tar", "--append", "--file", &tar, &owner, &group][..], &same, &[STATE]].concat())
}

fn shown(path: &Path) -> String {
    path.display().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn libraries_are_those_with_a_path() {
        let listed = "\tlinux-vdso.so.1 (0x7ffc)\n\tlibm.so.6 => /lib/x86_64-linux-gnu/libm.so.6 (0x7f)\n\
            \t/lib64/ld-linux-x86-64.so.2 (0x7f)\n";
        let expected = ["/lib/x86_64-linux-gnu/libm.so.6", "/lib64/ld-linux-x86-64.so.2"];
        assert_eq!(libraries(listed), expected.map(PathBuf::from));
        assert!(libraries("\tstatically linked\n").is_empty());
    }
}
