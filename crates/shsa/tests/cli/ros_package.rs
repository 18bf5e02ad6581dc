//! The package of ROS 2 in `deploy/ros`, as far as it can be checked without an installation of ROS.

use crate::real::python;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::Command;

const PACKAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../deploy/ros");

/// What Python finds in the package; `launches` are the arguments of launches.
fn read(python: &Path, prefix: &Path, launches: &Value) -> Value {
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/python/ros_package.py");
    let output =
        Command::new(python).arg(script).arg(PACKAGE).arg(prefix).arg(launches.to_string()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// An empty folder of this test.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}-{}", std::process::id()));
    let _absent = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

#[test]
fn package_xml_keeps_the_rules_and_the_launch_file_starts_the_command() {
    let Some(python) = python() else { return };
    let prefix = folder("ros-prefix");
    let others = prefix.join("others.yaml");
    let text = "shsa: {ros__parameters: {model: one.yaml, bus: ros2, http: off, state: /s}}";
    std::fs::write(&others, text).unwrap();
    let model = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/car.yaml");
    let launches = json!([
        {},
        {"model": model},
        {"model": "a.yaml,b.yaml", "bus": "ros2-dds://eth0", "name": "front", "http": "off", "state": "/s", "journal": "/j"},
        {"params_file": others, "bus": "zenoh"},
    ]);
    let package = read(&python, &prefix, &launches);
    assert_eq!(package["warnings"], json!([]));
    assert_eq!(
        [&package["name"], &package["version"], &package["format"], &package["build_type"]],
        [&json!("shsa"), &json!(env!("CARGO_PKG_VERSION")), &json!(3), &json!("ament_cmake")]
    );
    let depends = ["ament_cmake", "ament_index_python", "launch", "python3-yaml", "ros2launch"];
    assert_eq!(package["depends"], json!(depends));
    let started = &package["launches"];
    assert!(started[0].as_str().is_some_and(|why| why.starts_with("no model: write model:=")), "{started}");
    let line = |at: usize| {
        let words = started[at].as_array().unwrap().iter().map(|word| word.as_str().unwrap());
        words.collect::<Vec<_>>().join(" ")
    };
    let usual = format!("shsa run {model} --bus ros2-dds --name shsa --http 127.0.0.1:7410");
    assert_eq!(line(1), usual);
    assert_eq!(
        line(2),
        "shsa run a.yaml b.yaml --bus ros2-dds://eth0 --name front --http off --state /s --journal /j"
    );
    assert_eq!(line(3), "shsa run one.yaml --bus zenoh --http off --state /s");
    // The command takes these arguments.
    let words = line(2).replace("shsa run a.yaml b.yaml", "run");
    let help =
        Command::new(env!("CARGO_BIN_EXE_shsa")).args(words.split(' ')).arg("--help").output().unwrap();
    assert!(help.status.success(), "{}", String::from_utf8_lossy(&help.stderr));
    // A command of the package itself goes before another one.
    let own = prefix.join("lib/shsa/shsa");
    std::fs::create_dir_all(own.parent().unwrap()).unwrap();
    std::os::unix::fs::symlink(env!("CARGO_BIN_EXE_shsa"), &own).unwrap();
    let started = read(&python, &prefix, &json!([{"model": model}]));
    assert_eq!(started["launches"][0][0], json!(own));
    std::fs::remove_dir_all(prefix).unwrap();
}

/// `ament_cmake` itself is not on PyPI; of it, the package uses `find_package` and `ament_package`.
#[test]
fn cmake_installs_the_launch_file_and_the_parameters() {
    let Some(cmake) = python().map(|python| python.with_file_name("cmake")).filter(|cmake| cmake.exists())
    else {
        return eprintln!("SKIPPED: cmake is absent in target/python; `cargo xtask test` installs it");
    };
    let folder = folder("ros-cmake");
    let place = |name: &str| folder.join(name).display().to_string();
    std::fs::create_dir_all(place("stub")).unwrap();
    std::fs::write(folder.join("stub/ament_cmakeConfig.cmake"), "macro(ament_package)\nendmacro()\n")
        .unwrap();
    let run = |arguments: &[&str]| {
        let output = Command::new(&cmake).args(arguments).output().unwrap();
        let said = [output.stdout, output.stderr].concat();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&said));
        String::from_utf8_lossy(&said).into_owned()
    };
    let stub = format!("-Dament_cmake_DIR={}", place("stub"));
    let prefix = format!("-DCMAKE_INSTALL_PREFIX={}", place("installed"));
    // Nothing is built here, so no program for it is needed.
    let builder = "-DCMAKE_MAKE_PROGRAM=true";
    let without = ["-S", PACKAGE, "-B", &place("build"), &stub, &prefix, builder, "-DSHSA_BUILD=OFF"];
    let nowhere = "-DCMAKE_FIND_USE_SYSTEM_ENVIRONMENT_PATH=OFF";
    let said = run(&[&without[..], &[nowhere]].concat());
    let said = said.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(said.contains("install its Debian package"), "{said}");
    run(&["--install", &place("build")]);
    for file in ["launch/shsa.launch.py", "config/shsa.yaml"] {
        assert!(folder.join("installed/share/shsa").join(file).exists(), "{file}");
    }
    // With cargo, the command is built and installed; that is not carried out here.
    let cargo = std::env::var("CARGO").unwrap_or_else(|_| "cargo".into());
    let with = ["-S", PACKAGE, "-B", &place("with"), &stub, &prefix, builder, &format!("-DCARGO={cargo}")];
    run(&with);
    let steps = std::fs::read_to_string(folder.join("with/cmake_install.cmake")).unwrap();
    assert!(steps.contains("lib/shsa") && steps.contains("cargo/release/shsa"), "{steps}");
    std::fs::remove_dir_all(folder).unwrap();
}
