//! Processors that do not sleep while something is measured, as `cyclictest` has it: how long they take to wake is the machine's,
//! and in a virtual one longer than all else.

use std::fs::{File, OpenOptions};
use std::io::{self, Write};

/// While it is there, processors poll instead of sleeping: a bound of 0 us on how long they may take to wake
/// (<https://docs.kernel.org/admin-guide/pm/cpuidle.html>, power management quality of service).
pub(super) struct Awake {
    /// The bound holds until it is closed.
    _held: File,
}

impl Awake {
    /// # Errors
    /// Where that is not possible, or not allowed: it needs the rights of an administrator.
    pub(super) fn keep() -> io::Result<Awake> {
        let mut held = OpenOptions::new().write(true).open("/dev/cpu_dma_latency")?;
        held.write_all(&0_i32.to_ne_bytes())?;
        Ok(Awake { _held: held })
    }
}
