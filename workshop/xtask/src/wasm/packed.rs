//! The files of the npm package and of the studio, put together.

use super::FOLDER;
use crate::command;
use anyhow::{Context, Result, ensure};
use std::fs;
use std::path::Path;

/// The files of the engine that both have.
const GLUE: [&str; 2] = ["shsa.js", "shsa_bg.wasm"];
/// The packages as files.
const TARBALLS: [&str; 3] =
    ["shsa-engine-0.1.0.tgz", "signalk-shsa-0.1.0.tgz", "node-red-contrib-shsa-0.1.0.tgz"];
/// The tests of the packages.
const TESTS: [&str; 3] = [
    "engine/test/package.test.js",
    "signalk-shsa/test/server.test.mjs",
    "node-red-contrib-shsa/test/flow.test.mjs",
];

/// Packs the packages as npm publishes them: the engine, and the plugins of servers.
///
/// # Errors
/// When a file cannot be copied, or npm fails.
pub(super) fn pack() -> Result<()> {
    for name in ["engine", "signalk-shsa", "node-red-contrib-shsa"] {
        let package = format!("{FOLDER}/{name}");
        fresh(&package)?;
        copy_all(&format!("packages/{name}"), &package)?;
        if name == "engine" {
            glue(&package)?;
        }
        for licence in ["LICENSE-MIT", "LICENSE-APACHE"] {
            copy(licence, &format!("{package}/{licence}"))?;
        }
        command::run(&["sh", "-c", &format!("cd {package} && npm pack --silent --pack-destination ..")])?;
    }
    Ok(())
}

/// Installs the packed packages where their tests run.
///
/// # Errors
/// When npm fails.
pub(super) fn install() -> Result<()> {
    let folder = format!("{FOLDER}/test");
    fresh(&folder)?;
    for test in TESTS {
        let name = Path::new(test).file_name().context("a file")?.to_string_lossy();
        copy(&format!("packages/{test}"), &format!("{folder}/{name}"))?;
    }
    let manifest = format!("{folder}/package.json");
    fs::write(&manifest, "{ \"private\": true, \"type\": \"module\" }\n")
        .with_context(|| manifest.clone())?;
    let options = "--silent --no-audit --no-fund --offline";
    let tarballs = TARBALLS.map(|name| format!("../{name}")).join(" ");
    let install = format!("cd {folder} && npm install {options} {tarballs}");
    command::run(&["sh", "-c", &install])
}

/// Puts the studio together: its own files, the style of the live page, the engine and the example.
///
/// # Errors
/// When a file cannot be copied.
pub(super) fn studio() -> Result<()> {
    let studio = format!("{FOLDER}/studio");
    fresh(&studio)?;
    copy_all("packages/studio/page", &studio)?;
    let engine = format!("{studio}/engine");
    for file in ["api.js", "browser.js", "engine.js"] {
        copy(&format!("packages/engine/{file}"), &format!("{engine}/{file}"))?;
    }
    glue(&engine)?;
    for file in ["page.css", "icon.svg"] {
        copy(&format!("crates/shsa-web/assets/{file}"), &format!("{studio}/{file}"))?;
    }
    for file in ["gnss.csv", "radar.csv", "wheel.csv"] {
        copy(&format!("examples/monday/{file}"), &format!("{studio}/examples/car/{file}"))?;
    }
    copy("examples/car.yaml", &format!("{studio}/examples/car/car.yaml"))
}

/// Prints how large the engine is, as it is and as servers pack it.
///
/// # Errors
/// When the file cannot be read, or node is missing.
pub(super) fn sizes() -> Result<()> {
    let script = "const bytes = require('fs').readFileSync(process.argv[1]); \
        console.log(`${bytes.length} bytes, by brotli ${require('zlib').brotliCompressSync(bytes).length}`)";
    command::run(&["node", "-e", script, &format!("{FOLDER}/engine/wasm/shsa_bg.wasm")])?;
    println!("the packages are {}, the studio is studio, all in {FOLDER}", TARBALLS.join(", "));
    Ok(())
}

/// The modules of the engine and its code.
fn glue(folder: &str) -> Result<()> {
    GLUE.iter().try_for_each(|file| copy(&format!("{FOLDER}/glue/{file}"), &format!("{folder}/wasm/{file}")))
}

/// An empty folder.
fn fresh(folder: &str) -> Result<()> {
    if Path::new(folder).exists() {
        fs::remove_dir_all(folder).with_context(|| format!("emptying {folder}"))?;
    }
    fs::create_dir_all(folder).with_context(|| format!("making {folder}"))
}

fn copy(from: &str, to: &str) -> Result<()> {
    let folder = Path::new(to).parent().context("a folder")?;
    fs::create_dir_all(folder).with_context(|| format!("making {}", folder.display()))?;
    fs::copy(from, to).with_context(|| format!("copying {from} to {to}"))?;
    Ok(())
}

/// Copies a folder with what is in it.
fn copy_all(from: &str, to: &str) -> Result<()> {
    ensure!(Path::new(from).is_dir(), "{from} is missing");
    for entry in fs::read_dir(from).with_context(|| format!("reading {from}"))? {
        let entry = entry.with_context(|| format!("reading {from}"))?;
        let name = entry.file_name().to_string_lossy().into_owned();
        let (from, to) = (format!("{from}/{name}"), format!("{to}/{name}"));
        if entry.path().is_dir() { copy_all(&from, &to)? } else { copy(&from, &to)? }
    }
    Ok(())
}
