//! What the tests need besides Rust: each is probed, installed if absent, or named with the command that installs it.

use crate::command;
use anyhow::{Result, bail};

/// A tool that must be present before the checks or the tests run.
struct Need {
    /// Its name in messages.
    name: &'static str,
    /// A command that succeeds if it is present.
    probe: &'static [&'static str],
    install: Install,
}

/// How a tool is installed.
enum Install {
    /// By the package of Debian with this name.
    Debian(&'static str),
    /// By a command.
    Command(&'static [&'static str]),
}

/// Checks that every wheel pinned in `workshop/xtask/python.txt` is installed in this version.
const PINNED_WHEELS_ARE_THERE: &str = "from importlib.metadata import version; \
     assert all(version(name) == pin for name, pin in (line.split()[0].split('==') for line in open('workshop/xtask/python.txt')))";

/// A toolchain of the minimal profile has neither.
const TOOLCHAIN: [Need; 2] = [
    Need {
        name: "rustfmt",
        probe: &["cargo", "fmt", "--version"],
        install: Install::Command(&["rustup", "component", "add", "rustfmt"]),
    },
    Need {
        name: "clippy",
        probe: &["cargo", "clippy", "--version"],
        install: Install::Command(&["rustup", "component", "add", "clippy"]),
    },
];

/// Programs in C and C++ are compiled against the library; SWI-Prolog answers beside our searches, valgrind counts instructions,
/// Mosquitto is the broker that the MQTT bridge is tested with, Prometheus reads the figures of a run, libfaketime steps a clock that
/// is not the machine's, iproute2 lays and cuts cables between network namespaces, Chromium looks at the live page, axe-core at
/// whether everyone can use it, Java runs Apache Spark, and the clients and routers that are not ours are Python's, as are the packages
/// that the wheel works with.
const TESTS: [Need; 12] = [
    Need { name: "a compiler of C++", probe: &["c++", "--version"], install: Install::Debian("g++") },
    Need { name: "pkg-config", probe: &["pkg-config", "--version"], install: Install::Debian("pkg-config") },
    Need { name: "SWI-Prolog", probe: &["swipl", "--version"], install: Install::Debian("swi-prolog-nox") },
    Need {
        name: "Mosquitto",
        probe: &["sh", "-c", "PATH=$PATH:/usr/sbin command -v mosquitto && command -v mosquitto_passwd"],
        install: Install::Debian("mosquitto"),
    },
    Need { name: "Prometheus", probe: &["promtool", "--version"], install: Install::Debian("prometheus") },
    Need {
        name: "libfaketime",
        probe: &["sh", "-c", "ls /usr/lib/*/faketime/libfaketime.so.1"],
        install: Install::Debian("libfaketime"),
    },
    Need {
        name: "iproute2",
        probe: &["sh", "-c", "PATH=$PATH:/usr/sbin:/sbin command -v ip"],
        install: Install::Debian("iproute2"),
    },
    Need { name: "Chromium", probe: &["chromium", "--version"], install: Install::Debian("chromium") },
    Need {
        name: "axe-core in target/npm",
        probe: &["sh", "-c", "grep -q 'axe v4.14.1' target/npm/package/axe.min.js"],
        install: Install::Command(&[
            "sh",
            "-c",
            "mkdir -p target/npm && cd target/npm && npm pack --silent axe-core@4.14.1 && tar xzf axe-core-4.14.1.tgz",
        ]),
    },
    Need {
        // Spark comes as source: pip packs its 480 MB into a wheel, uncompressed as the file asks, and unpacks that.
        name: "the Python environment in target/python",
        probe: &["target/python/bin/python", "-c", PINNED_WHEELS_ARE_THERE],
        install: Install::Command(&[
            "sh",
            "-c",
            "python3 -m venv target/python && target/python/bin/pip install --quiet --no-compile --disable-pip-version-check -r workshop/xtask/python.txt",
        ]),
    },
    Need { name: "Java", probe: &["java", "-version"], install: Install::Debian("openjdk-17-jre-headless") },
    Need { name: "valgrind", probe: &["valgrind", "--version"], install: Install::Debian("valgrind") },
];

/// The version is fixed, as the configuration is written for it. It builds for some minutes.
const BOOK: [Need; 1] = [Need {
    name: "mdBook in target/book-tools",
    probe: &["sh", "-c", "target/book-tools/bin/mdbook --version | grep -q 'v0.5.4'"],
    install: Install::Command(&[
        "cargo",
        "install",
        "mdbook",
        "--version",
        "0.5.4",
        "--locked",
        "--root",
        "target/book-tools",
    ]),
}];

/// Provides what the quick checks and the build need.
///
/// # Errors
/// When something is absent and cannot be installed.
pub(crate) fn provide_toolchain() -> Result<()> {
    provide(&TOOLCHAIN, command::succeeds, |line| command::run(line).is_ok())
}

/// Provides what the tests need.
///
/// # Errors
/// When something is absent and cannot be installed.
pub(crate) fn provide_for_tests() -> Result<()> {
    provide(&TESTS, command::succeeds, |line| command::run(line).is_ok())
}

/// Provides what the site of the documents is made by.
///
/// # Errors
/// When it is absent and cannot be installed.
pub(crate) fn provide_for_book() -> Result<()> {
    provide(&BOOK, command::succeeds, |line| command::run(line).is_ok())
}

/// Installs what is absent: all packages of Debian by one command, as each one reads all lists of packages again.
fn provide(
    needs: &[Need],
    succeeds: impl Fn(&[&str]) -> bool,
    mut install: impl FnMut(&[&str]) -> bool,
) -> Result<()> {
    let absent: Vec<&Need> = needs.iter().filter(|need| !succeeds(need.probe)).collect();
    let packages: Vec<&str> = absent.iter().filter_map(|need| need.package()).collect();
    let debian =
        format!("apt-get update && apt-get install -y --no-install-recommends {}", packages.join(" "));
    let debian = ["sh", "-c", &debian];
    let others = absent.iter().filter_map(|need| need.command());
    let lines: Vec<&[&str]> =
        (!packages.is_empty()).then_some(&debian[..]).into_iter().chain(others).collect();
    for need in &absent {
        println!("{} is absent", need.name);
    }
    for line in lines {
        println!("installing: `{}`", shown(line));
        if !install(line) {
            bail!("`{}` failed; run it, then try again", shown(line));
        }
    }
    match absent.iter().find(|need| !succeeds(need.probe)) {
        Some(need) => bail!("{} is absent after its installation: `{}` fails", need.name, shown(need.probe)),
        None => Ok(()),
    }
}

impl Need {
    fn package(&self) -> Option<&'static str> {
        match self.install {
            Install::Debian(package) => Some(package),
            Install::Command(_) => None,
        }
    }

    fn command(&self) -> Option<&'static [&'static str]> {
        match self.install {
            Install::Debian(_) => None,
            Install::Command(line) => Some(line),
        }
    }
}

/// A command, ready for a shell.
fn shown(line: &[&str]) -> String {
    let words =
        line.iter().map(|word| if word.contains(' ') { format!("'{word}'") } else { (*word).to_owned() });
    words.collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::{Cell, RefCell};

    const NEEDS: [Need; 3] = [
        Need { name: "one", probe: &["one", "--version"], install: Install::Debian("libone") },
        Need { name: "two", probe: &["two"], install: Install::Command(&["get", "two"]) },
        Need { name: "three", probe: &["three"], install: Install::Debian("three") },
    ];

    #[test]
    fn commands_are_shown_as_they_can_be_copied() {
        assert_eq!(shown(&["sh", "-c", "a && b"]), "sh -c 'a && b'");
    }

    #[test]
    fn what_is_there_is_not_installed() {
        assert!(provide(&NEEDS, |_| true, |_| panic!("installed again")).is_ok());
    }

    #[test]
    fn what_is_absent_is_installed_the_packages_at_once() {
        let lines = RefCell::new(Vec::new());
        let install = |line: &[&str]| {
            lines.borrow_mut().push(line.join(" "));
            true
        };
        assert!(provide(&NEEDS, |_| lines.borrow().len() == 2, install).is_ok());
        let packages = "sh -c apt-get update && apt-get install -y --no-install-recommends libone three";
        assert_eq!(lines.into_inner(), [packages, "get two"]);
        let there = Cell::new(false);
        let install = |line: &[&str]| {
            assert_eq!(line, ["get", "two"]);
            there.set(true);
            true
        };
        assert!(provide(&NEEDS, |probe| probe != ["two"] || there.get(), install).is_ok());
    }

    #[test]
    fn what_cannot_be_installed_is_named_with_its_command() {
        let error = provide(&NEEDS[1..2], |_| false, |_| false).unwrap_err();
        assert_eq!(error.to_string(), "`get two` failed; run it, then try again");
        let error = provide(&NEEDS[1..2], |_| false, |_| true).unwrap_err();
        assert_eq!(error.to_string(), "two is absent after its installation: `two` fails");
    }
}
