//! The Debian package: the command with its manual pages, completions, unit, monitoring files, and bill of materials.
//!
//! The same sources give the same bytes, in whichever folder they are built: no time of the build is in the package, and the compilers
//! write no path of the machine into the program. Beside the package lie the files of a container's image. The
//! program alone is built without a package.

mod alone;
mod image;
mod twice;

use crate::workspace::RELEASED;
use crate::{command, sbom};
use anyhow::{Context, Result, bail, ensure};
use std::env;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

/// The output folder without `--out`.
const OUT: &str = "target/package";
/// Files that are copied: from the project's folder, to the path on the machine, with these permissions.
const FILES: [(&str, &str, u32); 7] = [
    ("deploy/shsa.service", "usr/lib/systemd/system/shsa.service", 0o644),
    ("deploy/prometheus-alerts.yaml", "usr/share/shsa/prometheus-alerts.yaml", 0o644),
    ("deploy/grafana-dashboard.json", "usr/share/shsa/grafana-dashboard.json", 0o644),
    ("docs/model.schema.json", "usr/share/shsa/model.schema.json", 0o644),
    ("README.md", "usr/share/doc/shsa/README.md", 0o644),
    ("docs/deployment.md", "usr/share/doc/shsa/deployment.md", 0o644),
    // The file may contain a password, so others may not read it.
    ("deploy/debian/environment", "etc/shsa/environment", 0o640),
];
/// The scripts that run when the package is installed or removed.
const SCRIPTS: [&str; 3] = ["postinst", "prerm", "postrm"];
/// Each shell, with the path of its completions.
const SHELLS: [(&str, &str); 3] = [
    ("bash", "usr/share/bash-completion/completions/shsa"),
    ("zsh", "usr/share/zsh/vendor-completions/_shsa"),
    ("fish", "usr/share/fish/vendor_completions.d/shsa.fish"),
];

/// The arguments behind the command.
struct Arguments {
    /// A program that is already built; without it, a release is built.
    program: Option<PathBuf>,
    out: PathBuf,
    /// Two builds are compared.
    twice: bool,
    /// The program alone is built, without libraries of the machine.
    is_static: bool,
}

impl Arguments {
    fn read(mut words: impl Iterator<Item = String>) -> Result<Arguments> {
        let mut arguments = Arguments { program: None, out: OUT.into(), twice: false, is_static: false };
        while let Some(word) = words.next() {
            let mut path = || words.next().with_context(|| format!("{word} wants a path"));
            match &*word {
                "--program" => arguments.program = Some(path()?.into()),
                "--out" => arguments.out = path()?.into(),
                "--twice" => arguments.twice = true,
                "--static" => arguments.is_static = true,
                _ => bail!("no option `{word}`: --program FILE, --out FOLDER, --twice, --static"),
            }
        }
        let kinds = [arguments.program.is_some(), arguments.twice, arguments.is_static];
        ensure!(
            kinds.into_iter().filter(|it| *it).count() < 2,
            "--twice and --static build the program themselves, each alone"
        );
        Ok(arguments)
    }
}

/// Writes `shsa.deb` and `image.tar`, and prints their paths.
///
/// # Errors
/// When the program does not build, or the package cannot be written.
pub(crate) fn write(words: impl Iterator<Item = String>) -> Result<()> {
    let Arguments { program, out, twice, is_static } = Arguments::read(words)?;
    if twice {
        return twice::check(&out);
    }
    if is_static {
        return alone::write(&out);
    }
    let program = program.map_or_else(|| built(None), Ok)?;
    let stage = out.join("stage");
    if stage.exists() {
        fs::remove_dir_all(&stage).context("clearing the folder of an earlier package")?;
    }
    put(&program, &stage.join("usr/bin/shsa"), 0o755)?;
    for (from, to, rights) in FILES {
        put(Path::new(from), &stage.join(to), rights)?;
    }
    pages(&program, &stage)?;
    text(&stage.join("usr/share/doc/shsa/copyright"), &licences()?)?;
    text(&stage.join("usr/share/doc/shsa/sbom.cdx.json"), &sbom::of("shsa")?)?;
    control(&stage)?;
    let package = out.join("shsa.deb");
    let [from, to] = [&stage, &package].map(|path| path.display().to_string());
    // All files are as old as the sources.
    let date = source_date()?;
    let epoch = format!("SOURCE_DATE_EPOCH={date}");
    command::output(&[
        "env",
        &epoch,
        "dpkg-deb",
        "--root-owner-group",
        "-Zgzip",
        "-z6",
        "--build",
        &from,
        &to,
    ])?;
    image::write(&stage, &out, &date)?;
    fs::remove_dir_all(&stage)?;
    println!("{to}\n{}", out.join("image.tar").display());
    Ok(())
}

/// Builds the command, for another target than the machine's own if it is given; apart from other builds, as with other options of the
/// compiler everything is built anew.
fn built(other: Option<&str>) -> Result<PathBuf> {
    let target = env::var_os("CARGO_TARGET_DIR").map_or_else(|| PathBuf::from("target"), PathBuf::from);
    let target = target.join("packaged");
    command::run(&["cargo", "fetch", "--locked"])?;
    let hidden = hidden_paths(&target)?;
    let as_options = |option: &str| -> Vec<String> {
        hidden.iter().map(|(path, name)| format!("{option}={}={name}", path.display())).collect()
    };
    // Some crates have parts in C.
    let c = format!("CFLAGS={}", as_options("-ffile-prefix-map").join(" "));
    let options = as_options("--remap-path-prefix");
    let options = format!("build.rustflags={options:?}");
    let line = ["cargo", "build", "--release", "--locked", "--package", "shsa", "--features", RELEASED];
    let target_dir = target.display().to_string();
    let settings = ["--config", &options, "--target-dir", &target_dir];
    // Options of the environment would count in the place of these.
    let begin = ["env", "--unset=RUSTFLAGS", "--unset=CARGO_ENCODED_RUSTFLAGS", &c];
    let other: Vec<&str> = other.into_iter().flat_map(|other| ["--target", other]).collect();
    command::run(&[&begin[..], &line, &settings, &other].concat())?;
    Ok(other.last().map_or(target.clone(), |other| target.join(other)).join("release/shsa"))
}

/// Folders of this machine that the compiler would write into the program, and what it writes instead. The last one that fits counts.
fn hidden_paths(target: &Path) -> Result<Vec<(PathBuf, &'static str)>> {
    let home = env::var_os("HOME").map(PathBuf::from).context("HOME is not set")?;
    let cargo = env::var_os("CARGO_HOME").map_or_else(|| home.join(".cargo"), PathBuf::from);
    let here = env::current_dir()?;
    let mut paths = vec![(here.clone(), "shsa"), (here.join(target), "target"), (cargo.clone(), "cargo")];
    let registries = fs::read_dir(cargo.join("registry/src")).into_iter().flatten().flatten();
    // They are named after the host from which the crates came.
    paths.extend(registries.map(|registry| (registry.path(), "crates")));
    Ok(paths)
}

/// Seconds since 1970: as the environment says, else of the last commit.
fn source_date() -> Result<String> {
    match env::var("SOURCE_DATE_EPOCH") {
        Ok(given) => Ok(given),
        Err(_) => Ok(command::output(&["git", "log", "-1", "--format=%ct"])?.trim().to_owned()),
    }
}

/// Writes manual pages and completions by the command itself.
fn pages(program: &Path, stage: &Path) -> Result<()> {
    let program = program.display().to_string();
    let manual = stage.join("usr/share/man/man1");
    command::run(&[&program, "man", &manual.display().to_string()])?;
    for page in fs::read_dir(&manual)? {
        // Without a name and a time, so that the same command gives the same package.
        command::run(&["gzip", "-9n", &page?.path().display().to_string()])?;
    }
    for (shell, place) in SHELLS {
        text(&stage.join(place), &command::output(&[&program, "completions", shell])?)?;
    }
    Ok(())
}

/// Writes the package's description, its configuration files and its scripts.
fn control(stage: &Path) -> Result<()> {
    let version = env!("CARGO_PKG_VERSION");
    let architecture = command::output(&["dpkg", "--print-architecture"])?;
    let library = command::output(&["getconf", "GNU_LIBC_VERSION"])?;
    let (_, library) = library.trim().split_once(' ').context("a version of glibc")?;
    let control = format!(
        "Package: shsa\nVersion: {version}\nArchitecture: {}\nMaintainer: The shsa contributors\nSection: utils\n\
         Priority: optional\nDepends: libc6 (>= {library})\n\
         Description: heals the information that flows through a machine\n \
         From one model of the variables of a system and their relations it detects a signal\n \
         that is wrong or silent, names it, and provides the needed values from the others.\n",
        architecture.trim()
    );
    text(&stage.join("DEBIAN/control"), &control)?;
    text(&stage.join("DEBIAN/conffiles"), "/etc/shsa/environment\n")?;
    for script in SCRIPTS {
        put(&Path::new("deploy/debian").join(script), &stage.join("DEBIAN").join(script), 0o755)?;
    }
    Ok(())
}

fn licences() -> Result<String> {
    let read = |name: &str| fs::read_to_string(name).with_context(|| format!("reading {name}"));
    let (mit, apache) = (read("LICENSE-MIT")?, read("LICENSE-APACHE")?);
    ensure!(!mit.is_empty() && !apache.is_empty(), "a licence is empty");
    Ok(format!("shsa may be used under either of these licences.\n\n{mit}\n\n{apache}"))
}

/// Copies a file to a path, and makes its folders.
fn put(from: &Path, to: &Path, rights: u32) -> Result<()> {
    place(to)?;
    fs::copy(from, to).with_context(|| format!("copying {} to {}", from.display(), to.display()))?;
    Ok(fs::set_permissions(to, fs::Permissions::from_mode(rights))?)
}

fn text(to: &Path, text: &str) -> Result<()> {
    place(to)?;
    fs::write(to, text).with_context(|| format!("writing {}", to.display()))?;
    Ok(fs::set_permissions(to, fs::Permissions::from_mode(0o644))?)
}

/// Makes the folders of a file with access for everyone, whatever the caller's umask.
fn place(file: &Path) -> Result<()> {
    let folder = file.parent().context("a file without a folder")?;
    fs::create_dir_all(folder).with_context(|| format!("making {}", folder.display()))?;
    Ok(fs::set_permissions(folder, fs::Permissions::from_mode(0o755))?)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(words: &[&str]) -> Result<Arguments> {
        Arguments::read(words.iter().map(|word| (*word).to_owned()))
    }

    #[test]
    fn the_line_says_what_is_packed_and_where_to() {
        let arguments = read(&["--out", "a", "--program", "b"]).unwrap();
        assert_eq!((arguments.out, arguments.program), ("a".into(), Some("b".into())));
        assert_eq!(read(&[]).unwrap().out, Path::new(OUT));
        assert!(read(&["--out"]).is_err() && read(&["--other", "a"]).is_err());
        assert!(read(&["--twice"]).unwrap().twice && read(&["--static"]).unwrap().is_static);
        assert!(read(&["--twice", "--program", "b"]).is_err() && read(&["--twice", "--static"]).is_err());
    }
}
