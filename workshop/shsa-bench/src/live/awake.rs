//! Keeps the processors awake during a measurement, as `cyclictest` does: the wake-up time is the machine's, and in a virtual
//! machine it exceeds all else.

use std::fs::{File, OpenOptions};
use std::io::{self, Write};

/// While this exists, processors poll instead of sleeping: it asks for a wake-up latency of at most 0 us
/// (<https://docs.kernel.org/admin-guide/pm/cpuidle.html>, power management quality of service).
pub(super) struct Awake {
    /// The request holds until this file is closed.
    _held: File,
}

impl Awake {
    /// # Errors
    /// When the system has no such file, or the user may not open it: only an administrator may.
    pub(super) fn keep() -> io::Result<Awake> {
        let mut held = OpenOptions::new().write(true).open("/dev/cpu_dma_latency")?;
        held.write_all(&0_i32.to_ne_bytes())?;
        Ok(Awake { _held: held })
    }
}
