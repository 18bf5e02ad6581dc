//! Two builds of the package, in folders, time zones and locales that differ: they must give the same bytes.

use crate::command;
use anyhow::{Context, Result, bail};
use std::env;
use std::fs;
use std::path::{Path, PathBuf};

/// A build: the folder of the sources, that of what is built, the time zone and the locale.
struct Build {
    sources: PathBuf,
    built: PathBuf,
    zone: &'static str,
    locale: &'static str,
}

/// What must be the same.
const COMPARED: [&str; 2] = ["shsa.deb", "image.tar"];

/// Builds the last commit twice, and puts one of the packages into `out`. Takes twice as long as a build, and about 4 GB.
///
/// # Errors
/// When a build fails, or the two differ; their folders stay there then.
pub(super) fn check(out: &Path) -> Result<()> {
    let here = env::current_dir()?;
    let place = here.join(out).join("twice");
    if place.exists() {
        fs::remove_dir_all(&place).context("clearing earlier builds")?;
    }
    let builds = [
        Build { sources: place.join("a"), built: place.join("a/target"), zone: "UTC", locale: "C.UTF-8" },
        Build {
            sources: place.join("another/folder"),
            built: place.join("elsewhere"),
            zone: "Pacific/Kiritimati",
            locale: "C",
        },
    ];
    let [one, other] = &builds;
    for build in [one, other] {
        build.run(&here)?;
    }
    for name in COMPARED {
        let [a, b] = [one, other].map(|build| build.package().join(name));
        if let Some(difference) = difference(&fs::read(&a)?, &fs::read(&b)?) {
            bail!("{} and {} differ {difference}", a.display(), b.display());
        }
        fs::copy(&a, out.join(name)).with_context(|| format!("copying {name}"))?;
        println!("both builds give the same bytes: {}", out.join(name).display());
    }
    Ok(fs::remove_dir_all(&place)?)
}

impl Build {
    /// Clones the sources, and packs what they give.
    fn run(&self, from: &Path) -> Result<()> {
        let [from, sources, built] =
            [from, &self.sources, &self.built].map(|path| path.display().to_string());
        command::run(&["git", "clone", "--quiet", &from, &sources])?;
        let [chdir, target, zone, locale] = [
            format!("--chdir={sources}"),
            format!("CARGO_TARGET_DIR={built}"),
            format!("TZ={}", self.zone),
            format!("LC_ALL={}", self.locale),
        ];
        command::run(&["env", &chdir, &target, &zone, &locale, "cargo", "xtask", "package"])
    }

    /// The folder of its package.
    fn package(&self) -> PathBuf {
        self.sources.join(super::OUT)
    }
}

/// Where two texts begin to differ; `None`: they are the same.
fn difference(one: &[u8], other: &[u8]) -> Option<String> {
    let first = one.iter().zip(other).position(|(a, b)| a != b);
    match first {
        Some(first) => Some(format!("from byte {first} on")),
        None if one.len() != other.len() => {
            Some(format!("in their lengths: {} and {} bytes", one.len(), other.len()))
        }
        None => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_difference_is_named() {
        assert_eq!(difference(b"same", b"same"), None);
        assert_eq!(difference(b"same", b"some").as_deref(), Some("from byte 1 on"));
        assert_eq!(difference(b"same", b"sam").as_deref(), Some("in their lengths: 4 and 3 bytes"));
    }
}
