//! Gives the shared library its name for the dynamic linker: programs that were linked with 0.1 run with any 0.1.x.

use std::env;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let of_target = |name: &str| env::var(name).unwrap_or_default();
    if of_target("CARGO_CFG_TARGET_OS") == "linux" {
        let (major, minor) = (of_target("CARGO_PKG_VERSION_MAJOR"), of_target("CARGO_PKG_VERSION_MINOR"));
        println!("cargo::rustc-cdylib-link-arg=-Wl,-soname,libshsa.so.{major}.{minor}");
    }
}
