//! What the tests need besides Rust: each is probed, installed if absent, or named with the command that installs it.

use crate::command;
use anyhow::{Result, bail};

/// A tool that must be present before the checks and tests run.
struct Need {
    /// Its name in messages.
    name: &'static str,
    /// A command that succeeds if it is present.
    probe: &'static [&'static str],
    /// The command that installs it.
    install: &'static [&'static str],
}

/// Checks that every wheel pinned in `xtask/python.txt` is installed in this version.
const PINNED_WHEELS_ARE_THERE: &str = "from importlib.metadata import version; \
     assert all(version(name) == pin for name, pin in (line.split('==') for line in open('xtask/python.txt').read().split()))";

/// A toolchain of the minimal profile has neither of the first two; programs in C and C++ are compiled against the library; SWI-Prolog answers beside our searches,
/// valgrind counts instructions, Mosquitto is the broker that the MQTT bridge is tested with, Prometheus
/// reads the figures of a run, libfaketime steps a clock that is not the machine's, iproute2 lays and cuts cables between network namespaces,
/// Chromium looks at the live page, axe-core at whether everyone can use it, and the clients and routers that are not ours
/// are Python's, as are the packages that the wheel works with.
const NEEDS: [Need; 13] = [
    Need {
        name: "rustfmt",
        probe: &["cargo", "fmt", "--version"],
        install: &["rustup", "component", "add", "rustfmt"],
    },
    Need {
        name: "clippy",
        probe: &["cargo", "clippy", "--version"],
        install: &["rustup", "component", "add", "clippy"],
    },
    Need {
        name: "a compiler of C++",
        probe: &["c++", "--version"],
        install: &["sh", "-c", "apt-get update && apt-get install -y --no-install-recommends g++"],
    },
    Need {
        name: "pkg-config",
        probe: &["pkg-config", "--version"],
        install: &["sh", "-c", "apt-get update && apt-get install -y --no-install-recommends pkg-config"],
    },
    Need {
        name: "SWI-Prolog",
        probe: &["swipl", "--version"],
        install: &["sh", "-c", "apt-get update && apt-get install -y --no-install-recommends swi-prolog-nox"],
    },
    Need {
        name: "Mosquitto",
        probe: &["sh", "-c", "PATH=$PATH:/usr/sbin command -v mosquitto && command -v mosquitto_passwd"],
        install: &["sh", "-c", "apt-get update && apt-get install -y --no-install-recommends mosquitto"],
    },
    Need {
        name: "Prometheus",
        probe: &["promtool", "--version"],
        install: &["sh", "-c", "apt-get update && apt-get install -y --no-install-recommends prometheus"],
    },
    Need {
        name: "libfaketime",
        probe: &["sh", "-c", "ls /usr/lib/*/faketime/libfaketime.so.1"],
        install: &["sh", "-c", "apt-get update && apt-get install -y --no-install-recommends libfaketime"],
    },
    Need {
        name: "iproute2",
        probe: &["sh", "-c", "PATH=$PATH:/usr/sbin:/sbin command -v ip"],
        install: &["sh", "-c", "apt-get update && apt-get install -y --no-install-recommends iproute2"],
    },
    Need {
        name: "Chromium",
        probe: &["chromium", "--version"],
        install: &["sh", "-c", "apt-get update && apt-get install -y --no-install-recommends chromium"],
    },
    Need {
        name: "axe-core in target/npm",
        probe: &["sh", "-c", "grep -q 'axe v4.14.1' target/npm/package/axe.min.js"],
        install: &[
            "sh",
            "-c",
            "mkdir -p target/npm && cd target/npm && npm pack --silent axe-core@4.14.1 && tar xzf axe-core-4.14.1.tgz",
        ],
    },
    Need {
        name: "the Python environment in target/python",
        probe: &["target/python/bin/python", "-c", PINNED_WHEELS_ARE_THERE],
        install: &[
            "sh",
            "-c",
            "python3 -m venv target/python && target/python/bin/pip install --quiet --no-compile --disable-pip-version-check -r xtask/python.txt",
        ],
    },
    Need {
        name: "valgrind",
        probe: &["valgrind", "--version"],
        install: &["sh", "-c", "apt-get update && apt-get install -y --no-install-recommends valgrind"],
    },
];

/// Provides everything that is needed.
///
/// # Errors
/// When something is absent and cannot be installed.
pub(crate) fn provide() -> Result<()> {
    NEEDS.iter().try_for_each(|need| provide_one(need, command::succeeds, |line| command::run(line).is_ok()))
}

fn provide_one(
    need: &Need,
    succeeds: impl Fn(&[&str]) -> bool,
    install: impl FnOnce(&[&str]) -> bool,
) -> Result<()> {
    if succeeds(need.probe) {
        return Ok(());
    }
    let line = shown(need.install);
    println!("{} is absent: `{line}`", need.name);
    if install(need.install) && succeeds(need.probe) {
        return Ok(());
    }
    bail!("{} is absent and could not be installed; run `{line}`, then try again", need.name)
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
    use std::cell::Cell;

    const NEED: Need = Need { name: "tool", probe: &["tool", "--version"], install: &["get", "tool"] };

    #[test]
    fn commands_are_shown_as_they_can_be_copied() {
        assert_eq!(shown(&["sh", "-c", "a && b"]), "sh -c 'a && b'");
    }

    #[test]
    fn what_is_there_is_not_installed() {
        assert!(provide_one(&NEED, |_| true, |_| panic!("installed again")).is_ok());
    }

    #[test]
    fn what_is_absent_is_installed() {
        let there = Cell::new(false);
        let install = |line: &[&str]| {
            assert_eq!(line, ["get", "tool"]);
            there.set(true);
            true
        };
        assert!(provide_one(&NEED, |_| there.get(), install).is_ok());
    }

    #[test]
    fn what_cannot_be_installed_is_named_with_its_command() {
        for installed in [false, true] {
            let error = provide_one(&NEED, |_| false, |_| installed).unwrap_err();
            assert!(error.to_string().contains("run `get tool`"), "{error}");
        }
    }
}
