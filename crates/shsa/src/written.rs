//! The output files of a command: checked, or opened, before it begins, so that an error comes before any work.

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
    ensure_free(paths.into_iter().flatten(), read)?;
    let mut made = Vec::new();
    let mut files = [const { None }; N];
    for (file, path) in files.iter_mut().zip(paths) {
        let Some(path) = path else { continue };
        let is_new = !path.exists();
        let opened = OpenOptions::new().write(true).create(true).truncate(false).open(path);
        if is_new && opened.is_ok() {
            made.push(path);
        }
        if opened.is_err() {
            made.iter().for_each(|path| drop(std::fs::remove_file(path)));
        }
        *file = Some(opened.with_context(|| format!("{} cannot be written", path.display()))?);
    }
    files.iter().flatten().try_for_each(empty)?;
    Ok(files.map(|file| file.map(BufWriter::new)))
}

/// Checks, before any work, that later output files can be told apart from each other and from those that are `read`, and that their
/// folders are there.
///
/// # Errors
/// When a file is named twice, is among those that are read, or is in no folder.
pub(crate) fn ensure_free<'p>(
    paths: impl IntoIterator<Item = &'p Path>,
    read: &[&PathBuf],
) -> anyhow::Result<()> {
    let mut taken: Vec<PathBuf> = read.iter().filter_map(|path| path.canonicalize().ok()).collect();
    for path in paths {
        let place = place(path).with_context(|| format!("{} cannot be written", path.display()))?;
        if taken.contains(&place) {
            bail!("{} is in use by this run already; name another file to write to", path.display());
        }
        taken.push(place);
    }
    Ok(())
}

/// The path, without links, of a file that is there or that is to be made.
fn place(path: &Path) -> std::io::Result<PathBuf> {
    path.canonicalize().or_else(|_| {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        Ok(folder.canonicalize()?.join(path.file_name().unwrap_or_default()))
    })
}

/// Only regular files have a length to set: `/dev/stdout` has none.
fn empty(file: &File) -> std::io::Result<()> {
    if file.metadata()?.is_file() { file.set_len(0) } else { Ok(()) }
}
