//! What a service computes, between its bus and its loop.

use super::outlet::Outlet;
use super::ports::Ports;
use super::program::Formulas;
use super::timing::{Figures, Pace};
use shsa_bridge::{Bridge, Clock, Message, Provenance};
use shsa_core::time::{Time, Validity};
use std::collections::BTreeSet;
use std::sync::Arc;

/// The work of a service: messages in, messages out.
pub(super) trait Work {
    /// The topics that it reads.
    fn topics(&self) -> BTreeSet<Arc<str>>;

    /// Takes a message in; returns the time of its newest value, by our clock. `None`: there is nothing new in it.
    fn receive(&mut self, message: &Message, clock: &Clock) -> Option<Time>;

    /// Whether there is something to compute now.
    fn is_due(&self, pace: Pace) -> bool;

    /// Computes and publishes.
    ///
    /// # Errors
    /// When the bus refuses a publication.
    fn compute(
        &mut self,
        at: Time,
        clock: &Clock,
        bridge: &mut dyn Bridge,
        figures: &mut Figures,
    ) -> anyhow::Result<()>;

    /// The number of unreadable payloads, and the reason for the last one.
    fn unreadable(&self) -> (u64, Option<&str>);
}

/// Formulas over the latest values of the inputs.
pub(super) struct Computation {
    pub(super) ports: Ports,
    pub(super) formulas: Formulas,
    pub(super) outlets: Vec<Outlet>,
    /// The provenance of its outputs.
    pub(super) provenance: Provenance,
}

impl Work for Computation {
    fn topics(&self) -> BTreeSet<Arc<str>> {
        self.ports.topics().cloned().collect()
    }

    fn receive(&mut self, message: &Message, clock: &Clock) -> Option<Time> {
        self.ports.receive(message, clock)
    }

    fn is_due(&self, pace: Pace) -> bool {
        match pace {
            Pace::Any | Pace::Every(_) => self.ports.are_known(),
            Pace::All => self.ports.are_new(),
        }
    }

    fn compute(
        &mut self,
        at: Time,
        clock: &Clock,
        bridge: &mut dyn Bridge,
        figures: &mut Figures,
    ) -> anyhow::Result<()> {
        let values = self.ports.values(clock.now());
        let outputs = self.formulas.evaluate(&values, Validity { from: at, to: at });
        self.ports.use_up();
        self.provenance.quality = self.ports.quality();
        for (outlet, value) in self.outlets.iter().zip(outputs) {
            match value {
                Some(value) => {
                    outlet.send(&value, clock.by_wall(at), &self.provenance, bridge)?;
                    figures.published += 1;
                }
                None => figures.without += 1,
            }
        }
        Ok(())
    }

    fn unreadable(&self) -> (u64, Option<&str>) {
        (self.ports.unreadable, self.ports.because.as_deref())
    }
}
