//! A disk that can be full.

use crate::scene::system;
use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A file system in memory; dropping it unmounts it.
pub(crate) struct Disk(PathBuf);

impl Disk {
    /// Mounts a file system of `size` MiB.
    ///
    /// # Errors
    /// Why mounting is not allowed here.
    pub(crate) fn mount(place: &Path, size: u32) -> Result<Disk, String> {
        fs::create_dir_all(place).unwrap();
        system(&format!("mount -t tmpfs -o size={size}m tmpfs {}", place.display()))?;
        Ok(Disk(place.to_owned()))
    }

    pub(crate) fn path(&self) -> &Path {
        &self.0
    }

    /// Fills the file system completely.
    pub(crate) fn fill(&self) {
        let mut ballast = File::create(self.0.join("ballast")).unwrap();
        for size in [4096, 1] {
            while ballast.write(&vec![0; size]).is_ok_and(|written| written > 0) {}
        }
    }

    pub(crate) fn free(&self) {
        fs::remove_file(self.0.join("ballast")).unwrap();
    }
}

impl Drop for Disk {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(&self.0).status();
    }
}
