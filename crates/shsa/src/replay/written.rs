//! The output files of a replay: opened before it begins, so that an error comes before any work.

use anyhow::{Context, bail};
use std::fs::{File, OpenOptions};
use std::io::BufWriter;
use std::path::{Path, PathBuf};

/// Opens the output files, all or none; their old content is deleted only when all are open.
///
/// # Errors
/// When a file cannot be written, is named twice, or is among those that are `read`.
pub(crate) fn open<const N: usize>(
    paths: [Option<&Path>; N],
    read: &[&PathBuf],
) -> anyhow::Result<[Option<BufWriter<File>>; N]> {
    let mut taken: Vec<PathBuf> = read.iter().filter_map(|path| path.canonicalize().ok()).collect();
    let mut made = Vec::new();
    let mut files = [const { None }; N];
    for (file, path) in files.iter_mut().zip(paths) {
        let Some(path) = path else { continue };
        let is_new = !path.exists();
        let opened = open_one(path, &mut taken);
        if is_new && opened.is_ok() {
            made.push(path);
        }
        if opened.is_err() {
            made.iter().for_each(|path| drop(std::fs::remove_file(path)));
        }
        *file = Some(opened?);
    }
    files.iter().flatten().try_for_each(empty)?;
    Ok(files.map(|file| file.map(BufWriter::new)))
}

/// Checks, before any work, that a later output file is not among those that are `read`.
///
/// # Errors
/// When the file is among them.
pub(crate) fn ensure_free(path: &Path, read: &[&PathBuf]) -> anyhow::Result<()> {
    let taken: Vec<PathBuf> = read.iter().filter_map(|path| path.canonicalize().ok()).collect();
    ensure_none_of(path, &taken)
}

fn ensure_none_of(path: &Path, taken: &[PathBuf]) -> anyhow::Result<()> {
    if path.canonicalize().is_ok_and(|path| taken.contains(&path)) {
        bail!("{} is in use by this run already; name another file to write to", path.display());
    }
    Ok(())
}

fn open_one(path: &Path, taken: &mut Vec<PathBuf>) -> anyhow::Result<File> {
    ensure_none_of(path, taken)?;
    let options = OpenOptions::new().write(true).create(true).truncate(false).open(path);
    let file = options.with_context(|| format!("{} cannot be written", path.display()))?;
    taken.extend(path.canonicalize());
    Ok(file)
}

/// Only regular files have a length to set: `/dev/stdout` has none.
fn empty(file: &File) -> std::io::Result<()> {
    if file.metadata()?.is_file() { file.set_len(0) } else { Ok(()) }
}
