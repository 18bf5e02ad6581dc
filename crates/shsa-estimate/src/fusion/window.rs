//! The last innovations of a sensor, which show a slow change long before a single one does.

use crate::method::Innovation;

/// The number of innovations in a window.
const WINDOW: usize = 16;

/// The last 16 innovations, each in its standard deviations.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Window {
    ring: [f64; WINDOW],
    noted: u32,
}

impl Window {
    pub(super) fn note(&mut self, innovation: Innovation) {
        let place = self.noted as usize % WINDOW;
        if let Some(own) = self.ring.get_mut(place) {
            *own = innovation.value / innovation.variance.sqrt();
        }
        // The count goes on in a circle above the window, so that a full window stays full.
        self.noted = if self.noted as usize >= 2 * WINDOW - 1 { WINDOW as u32 } else { self.noted + 1 };
    }

    /// The mean: its variance is at most 1, and a sixteenth for independent innovations. `None` for fewer.
    pub(super) fn mean(&self) -> Option<f64> {
        let is_full = self.noted as usize >= WINDOW;
        is_full.then(|| self.ring.iter().sum::<f64>() / WINDOW as f64)
    }

    /// The mean in its own standard deviations, for independent innovations.
    pub(super) fn drift(&self) -> Option<f64> {
        self.mean().map(|mean| mean * (WINDOW as f64).sqrt())
    }
}
