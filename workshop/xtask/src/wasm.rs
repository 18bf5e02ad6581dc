//! Builds the npm package `@shsa/engine`, the plugins of servers and the studio around it, and tests them.

mod packed;

use crate::command;
use anyhow::{Context, Result, ensure};
use std::fs;
use std::path::Path;
use std::process::Command;

/// Where everything is built.
pub(crate) const FOLDER: &str = "target/wasm";
const TARGET: &str = "wasm32-unknown-unknown";
/// Makes a file of WebAssembly a third smaller; the package of npm has the program for this machine.
const OPTIMISER: &str = "target/npm/binaryen/node_modules/binaryen/bin/wasm-opt";
const INSTALL_OPTIMISER: &str = "mkdir -p target/npm/binaryen && cd target/npm/binaryen && npm install --silent --no-save --no-audit --no-fund binaryen@132.0.0";

/// A server that a plugin is tested in. Servers are as large as everything else that tests need together.
struct Server {
    name: &'static str,
    /// The folder of `target/npm` it is installed in.
    folder: &'static str,
    /// Its package of npm.
    package: &'static str,
    version: &'static str,
    /// The tests of the plugin, and the variable by which they find the server.
    tests: &'static str,
    variable: &'static str,
}

const SERVERS: [Server; 2] = [
    Server {
        name: "the Signal K server",
        folder: "signalk",
        package: "signalk-server",
        // The last version that runs on Node.js 20.
        version: "2.23.0",
        tests: "server.test.mjs",
        variable: "SIGNALK",
    },
    Server {
        name: "Node-RED",
        folder: "node-red",
        package: "node-red",
        version: "4.1.15",
        tests: "flow.test.mjs",
        variable: "NODE_RED",
    },
];

impl Server {
    fn place(&self) -> String {
        format!("target/npm/{}/node_modules/{}", self.folder, self.package)
    }

    fn is_there(&self) -> bool {
        Path::new(&self.place()).exists()
    }

    fn install(&self) -> Result<()> {
        let Server { folder, package, version, .. } = self;
        let options = "--silent --no-save --no-audit --no-fund";
        let folder = format!("target/npm/{folder}");
        let install =
            format!("mkdir -p {folder} && cd {folder} && npm install {options} {package}@{version}");
        command::run(&["sh", "-c", &install])
    }

    /// Runs the tests of its plugin, where it is installed.
    fn test(&self, add: &mut impl FnMut(&str)) -> Result<()> {
        if !self.is_there() {
            let name = self.name;
            println!(
                "SKIPPED: the plugin of {name}: `cargo xtask wasm --servers` installs it, and tests the plugin"
            );
            add("test result: ok. 0 passed; 0 failed; 1 ignored");
            return Ok(());
        }
        run_node(self.tests, &[(self.variable, &self.place())], add)
    }
}

/// Builds the packages as they are published, and the studio.
///
/// # Errors
/// When the target cannot be installed, or something does not build.
pub(crate) fn build() -> Result<()> {
    ensure!(has_target(), "the target {TARGET} cannot be installed by rustup");
    compile("wasm")?;
    optimise()?;
    packed::pack()?;
    packed::studio()?;
    packed::sizes()
}

/// Builds the package without optimising it, and tests it and the studio; passes on closing lines as those of Rust's tests. What
/// cannot be had is named, and skipped.
///
/// # Errors
/// When something does not build, or a test fails.
pub(crate) fn test(mut add: impl FnMut(&str)) -> Result<()> {
    for (name, is_there) in [(TARGET, has_target()), ("Node.js", command::succeeds(&["node", "--version"]))] {
        if !is_there {
            println!("SKIPPED: the npm package and the studio: {name} cannot be had");
            add("test result: ok. 0 passed; 0 failed; 2 ignored");
            return Ok(());
        }
    }
    compile("wasm-test")?;
    packed::pack()?;
    packed::studio()?;
    packed::install()?;
    run_node("package.test.js", &[], &mut add)?;
    SERVERS.iter().try_for_each(|server| server.test(&mut add))?;
    studio(&mut add)
}

/// Names what is not built, and counts it as skipped.
///
/// # Errors
/// Never: the form of [`test`].
pub(crate) fn skip(mut add: impl FnMut(&str)) -> Result<()> {
    println!(
        "SKIPPED: the npm package, the plugins and the studio: `cargo xtask wasm --test` builds and tests them"
    );
    add("test result: ok. 0 passed; 0 failed; 4 ignored");
    Ok(())
}

/// Installs the servers, and tests everything with them.
///
/// # Errors
/// As [`test`], and when a server cannot be installed.
pub(crate) fn test_with_servers(add: impl FnMut(&str)) -> Result<()> {
    SERVERS.iter().filter(|server| !server.is_there()).try_for_each(Server::install)?;
    test(add)
}

/// Runs tests of the installed packages.
fn run_node(file: &str, paths: &[(&str, &str)], add: &mut impl FnMut(&str)) -> Result<()> {
    let root = std::env::current_dir().context("the folder of the workspace")?;
    let installed = root.join(FOLDER).join("test");
    let packages = installed.join("node_modules");
    let mut line = Command::new("node");
    line.args(["--test", "--test-reporter=tap"]).arg(installed.join(file)).current_dir(&installed);
    line.env("SHSA_ROOT", &root).env("SHSA_PACKAGE", packages.join("@shsa/engine"));
    line.env("SHSA_PLUGIN", packages.join("signalk-shsa"));
    line.env("SHSA_NODES", packages.join("node-red-contrib-shsa"));
    line.envs(paths.iter().map(|(name, path)| (*name, root.join(path))));
    let program = root.join("target/debug/shsa");
    if program.is_file() {
        line.env("SHSA_COMMAND", program);
    }
    let output = line.output().context("starting node")?;
    let printed = String::from_utf8_lossy(&output.stdout);
    println!("{printed}{}", String::from_utf8_lossy(&output.stderr));
    add(&closing(&printed));
    ensure!(output.status.success(), "the tests in {file} failed");
    Ok(())
}

/// Looks at the studio in Chromium.
fn studio(add: &mut impl FnMut(&str)) -> Result<()> {
    let python = "target/python/bin/python";
    if !command::succeeds(&["chromium", "--version"])
        || !command::succeeds(&[python, "-c", "import playwright"])
    {
        println!("SKIPPED: the studio: no Chromium to look at it with");
        add("test result: ok. 0 passed; 0 failed; 1 ignored");
        return Ok(());
    }
    command::run(&[python, "packages/studio/test/studio.py", FOLDER])?;
    add("test result: ok. 1 passed; 0 failed; 0 ignored");
    Ok(())
}

/// The closing line of Rust's tests for a report of Node's in the form of TAP.
fn closing(report: &str) -> String {
    let count = |what: &str| {
        let line = report.lines().find_map(|line| line.strip_prefix(&format!("# {what} ")));
        line.and_then(|count| count.trim().parse::<u64>().ok()).unwrap_or(0)
    };
    format!(
        "test result: ok. {} passed; {} failed; {} ignored",
        count("pass"),
        count("fail"),
        count("skipped")
    )
}

/// Whether the target is there, after an attempt to install it.
fn has_target() -> bool {
    let installed = || command::output(&["rustup", "target", "list", "--installed"]);
    let has = || installed().is_ok_and(|list| list.lines().any(|line| line == TARGET));
    has() || (command::succeeds(&["rustup", "target", "add", TARGET]) && has())
}

/// Compiles the engine, and makes its modules.
fn compile(profile: &str) -> Result<()> {
    // Tests that need real time may run beside it.
    let build = ["nice", "-n", "10", "cargo", "build", "--locked", "--package"];
    command::run(&[&build[..], &["shsa-wasm", "--target", TARGET, "--profile", profile]].concat())?;
    command::run(&[&build[..], &["shsa-wasm-glue"]].concat())?;
    let file = format!("target/{TARGET}/{profile}/shsa_wasm.wasm");
    command::run(&["target/debug/wasm-glue", &file, &format!("{FOLDER}/glue")])
}

/// Makes the file smaller, where the optimiser can be had.
fn optimise() -> Result<()> {
    if !Path::new(OPTIMISER).exists() && !command::succeeds(&["sh", "-c", INSTALL_OPTIMISER]) {
        println!("not done: the file is not made smaller, as binaryen cannot be installed by npm");
        return Ok(());
    }
    let file = format!("{FOLDER}/glue/shsa_bg.wasm");
    let smaller = format!("{FOLDER}/smaller.wasm");
    let features = [
        "bulk-memory",
        "nontrapping-float-to-int",
        "sign-ext",
        "mutable-globals",
        "reference-types",
        "multivalue",
    ];
    let features: Vec<String> = features.iter().map(|feature| format!("--enable-{feature}")).collect();
    let mut line = vec![OPTIMISER, "-Os", "--strip-debug", "--strip-producers", &file, "-o", &smaller];
    line.extend(features.iter().map(String::as_str));
    command::run(&line)?;
    fs::rename(&smaller, &file).with_context(|| format!("replacing {file}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_report_of_node_is_counted() {
        let report = "TAP version 13\n# tests 9\n# suites 0\n# pass 7\n# fail 1\n# cancelled 0\n# skipped 1\n# todo 0\n";
        assert_eq!(closing(report), "test result: ok. 7 passed; 1 failed; 1 ignored");
    }
}
