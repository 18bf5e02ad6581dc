//! The wheel in a clean environment: what users call, the examples of the documentation, and the types.
//!
//! The wheel is put together of the library that cargo has just built, as maturin does, so that nothing is built twice.

use std::env;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

fn here() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Runs a command in the folder of the project, which must succeed; returns what it prints.
#[track_caller]
fn run(command: &mut Command) -> String {
    let output = command.current_dir(here().join("..")).output();
    let output = output.unwrap_or_else(|error| panic!("{command:?}: {error}"));
    let (printed, problems) =
        (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{command:?}: {}\n{printed}{problems}", output.status);
    format!("{printed}{problems}")
}

/// The Python with the packages of `workshop/xtask/python.txt`.
fn with_packages() -> PathBuf {
    here().join("../target/python/bin/python")
}

/// A Python in which the wheel is installed, and nothing else.
fn clean() -> &'static Path {
    static PYTHON: OnceLock<PathBuf> = OnceLock::new();
    PYTHON.get_or_init(|| {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("wheel");
        let library = env::current_exe().unwrap().with_file_name("lib_shsa.so");
        let wheel =
            run(Command::new(with_packages()).arg(here().join("tests/wheel.py")).args([&library, &folder]));
        let environment = folder.join("environment");
        run(Command::new(with_packages()).args(["-m", "venv", "--clear", "--without-pip"]).arg(&environment));
        let python = environment.join("bin/python");
        let pip = ["-m", "pip", "--disable-pip-version-check", "--python"];
        let mut install = Command::new(with_packages());
        install.args(pip).arg(&python).args(["install", "--quiet", "--no-index", "--no-deps"]);
        run(install.arg(wheel.trim()));
        python
    })
}

/// Runs a program with the wheel, and with the packages of `workshop/xtask/python.txt` behind it.
#[track_caller]
fn with_tables(arguments: &[&str]) -> String {
    let packages = run(Command::new(with_packages())
        .args(["-c", "import sysconfig; print(sysconfig.get_paths()['purelib'])"]));
    let mut command = Command::new(clean());
    command.env("PYTHONPATH", packages.trim());
    // The workers of Spark run the same Python, and nothing listens on other addresses.
    command.env("PYSPARK_PYTHON", clean()).env("SPARK_LOCAL_IP", "127.0.0.1");
    run(command.args(arguments))
}

#[test]
fn alone_it_needs_nothing_else() {
    run(Command::new(clean()).args(["python/tests/alone.py"]));
}

#[test]
fn every_function_does_what_it_says() {
    let printed = with_tables(&["-m", "unittest", "discover", "-v", "-s", "python/tests"]);
    println!("{printed}");
    assert!(printed.contains("\nOK") && !printed.contains("panicked"), "{printed}");
}

#[test]
fn the_examples_of_its_documentation_hold() {
    let printed = with_tables(&["python/tests/examples.py"]);
    assert!(printed.contains(" examples hold"), "{printed}");
}

#[test]
fn the_notebooks_run() {
    let printed = with_tables(&["python/tests/notebooks.py"]);
    assert!(printed.contains("3 notebooks run"), "{printed}");
}

#[test]
fn recordings_and_streams_by_a_cluster_give_what_one_machine_gives() {
    let printed = with_tables(&["python/tests/spark_cluster.py"]);
    println!("{printed}");
    assert!(printed.contains("\nOK") && !printed.contains("panicked"), "{printed}");
}

#[test]
fn its_types_are_strict() {
    with_tables(&[
        "-m",
        "mypy",
        "--strict",
        "--config-file",
        "python/pyproject.toml",
        "--cache-dir",
        concat!(env!("CARGO_TARGET_TMPDIR"), "/mypy"),
        "python/package/shsa",
        "python/tests/typed.py",
    ]);
}
