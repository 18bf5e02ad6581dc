//! Programs in C11 and C++17 with the built library: under sanitizers, under valgrind, by pkg-config; and the header is that of the source.

use shsa_c::shsa_version;
use std::env;
use std::ffi::CStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

/// The flags with which nothing may be said about the programs.
const STRICT: [&str; 5] = ["-Wall", "-Wextra", "-Wpedantic", "-Werror", "-g"];

const SANITIZED: [&str; 3] = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-O1"];

fn here() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Runs a command, which must succeed; returns what it prints.
#[track_caller]
fn run(command: &mut Command) -> String {
    let output = command.output().unwrap_or_else(|error| panic!("{command:?}: {error}"));
    let (printed, told) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{command:?}: {}\n{printed}{told}", output.status);
    printed.into_owned()
}

/// A folder in which the library is installed, made by the script that users run.
fn installed() -> &'static Path {
    static PREFIX: OnceLock<PathBuf> = OnceLock::new();
    PREFIX.get_or_init(|| {
        let prefix = Path::new(env!("CARGO_TARGET_TMPDIR")).join("prefix");
        let tests = env::current_exe().unwrap();
        run(Command::new(here().join("install.sh")).arg(&prefix).arg(tests.parent().unwrap()));
        prefix
    })
}

fn pkg_config(arguments: &[&str]) -> Vec<String> {
    let mut command = Command::new("pkg-config");
    command.env("PKG_CONFIG_PATH", installed().join("lib/pkgconfig")).args(arguments).arg("shsa");
    run(&mut command).split_whitespace().map(str::to_owned).collect()
}

/// Compiles a program against the installed library; returns its path.
#[track_caller]
fn compiled(compiler: &[&str], source: &str, is_static: bool, flags: &[&str]) -> PathBuf {
    let name = format!("{}-{}-{}", source.replace('/', "-"), is_static, flags.len());
    let program = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let mut command = Command::new(compiler[0]);
    command.args(&compiler[1..]).args(STRICT).args(flags).arg(here().join(source));
    command.args(pkg_config(&["--cflags"])).arg("-o").arg(&program);
    if is_static {
        command.arg(installed().join("lib/libshsa.a"));
        let private = pkg_config(&["--static", "--libs"]);
        command.args(private.iter().filter(|flag| *flag != "-lshsa"));
    } else {
        command.args(pkg_config(&["--libs"])).arg("-lm");
    }
    run(&mut command);
    program
}

/// A command that finds the shared library.
fn with_library(program: impl AsRef<std::ffi::OsStr>) -> Command {
    let mut command = Command::new(program);
    command.env("LD_LIBRARY_PATH", installed().join("lib"));
    command
}

#[test]
fn the_header_is_that_of_the_source() {
    let config = cbindgen::Config::from_file(here().join("cbindgen.toml")).unwrap();
    let sources = ["error", "model", "output", "engine", "border"];
    let builder = sources.iter().fold(cbindgen::Builder::new().with_config(config), |builder, name| {
        builder.with_src(here().join(format!("src/{name}.rs")))
    });
    let mut made = Vec::new();
    builder.generate().unwrap().write(&mut made);
    let (made, path) = (String::from_utf8(made).unwrap(), here().join("include/shsa.h"));
    if env::var_os("SHSA_WRITE").is_some() {
        fs::write(&path, &made).unwrap();
    }
    let committed = fs::read_to_string(path).unwrap();
    assert!(committed == made, "SHSA_WRITE=1 cargo test --package shsa-c --test c writes it anew\n{made}");
}

#[test]
fn a_program_in_c_holds_under_sanitizers_with_the_static_library() {
    let program = compiled(&["cc", "-std=c11"], "tests/c/engine.c", true, &SANITIZED);
    assert_eq!(run(&mut Command::new(program)), "all hold\n");
}

#[test]
fn a_program_in_cpp_holds_under_sanitizers_with_the_shared_library() {
    let program = compiled(&["c++", "-std=c++17"], "tests/c/engine.cpp", false, &SANITIZED);
    assert_eq!(run(&mut with_library(program)), "all hold\n");
}

#[test]
fn valgrind_finds_nothing() {
    let program = compiled(&["cc", "-std=c11"], "tests/c/engine.c", false, &[]);
    let mut command = with_library("valgrind");
    command.args([
        "--quiet",
        "--error-exitcode=9",
        "--leak-check=full",
        "--errors-for-leak-kinds=definite,possible",
    ]);
    assert_eq!(run(command.arg(program)), "all hold\n");
}

#[test]
fn beside_a_control_loop_nothing_is_allocated() {
    let flags = ["-O2", "-DCOUNT_ALLOCATIONS"];
    let program = compiled(&["cc", "-std=c11"], "examples/loop.c", false, &flags);
    let printed = run(with_library(program).arg("3"));
    assert!(printed.contains("3000 steps of 3 observations: median "), "{printed}");
    assert!(
        printed.contains("\n0 allocations in steps without a decision, after the first one\n"),
        "{printed}"
    );
    assert!(printed.contains("float_1 says "), "{printed}");
}

#[test]
fn all_versions_are_the_same() {
    // SAFETY: the text is a constant.
    #[expect(unsafe_code, reason = "C gives pointers")]
    let version = unsafe { CStr::from_ptr(shsa_version()) };
    assert_eq!(version.to_str(), Ok(env!("CARGO_PKG_VERSION")));
    assert_eq!(pkg_config(&["--modversion"]), [env!("CARGO_PKG_VERSION")]);
    let library = installed().join("lib/libshsa.so.0.1");
    assert!(library.exists(), "{} is what programs look for", library.display());
}
