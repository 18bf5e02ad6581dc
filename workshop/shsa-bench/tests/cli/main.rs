//! `shsa-bench` from outside: small runs.

mod bench;
mod documents;
mod estimation;
mod experiments;
#[path = "../../../../crates/shsa/tests/cli/folder.rs"]
#[allow(dead_code, reason = "the tests of the command use all of it")]
mod folder;
mod oracle;
mod soak;

use std::path::Path;
use std::process::Command;
use std::sync::Once;

/// The program under test.
const PROGRAM: &str = env!("CARGO_BIN_EXE_shsa-bench");

/// `shsa` must stand beside the program; if only this package was built, `shsa` is built now.
fn with_shsa() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let shsa = Path::new(PROGRAM).with_file_name("shsa");
        let build = || Command::new(env!("CARGO")).args(["build", "--package", "shsa"]).status();
        assert!(shsa.exists() || build().is_ok_and(|status| status.success()), "{}", shsa.display());
    });
}
