//! The faults: their targets and kinds.

use std::fmt;

/// The target of a fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Target {
    Wheel(usize),
    Broker,
    /// `shsa run` itself.
    Run,
    Disk,
}

/// The kind of a fault; with an amount if a sensor needs one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Kind {
    Killed,
    Suspended,
    Full,
    /// An order to a sensor.
    Ordered(&'static str, f64),
}

impl Kind {
    /// Whether a sensor publishes wrong but plausible values.
    pub(crate) fn is_a_lie(self) -> bool {
        matches!(self, Kind::Ordered("bias" | "drift" | "freeze", _))
    }
}

/// A fault with its beginning and end, seconds.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fault {
    pub(crate) target: Target,
    pub(crate) kind: Kind,
    pub(crate) from: f64,
    pub(crate) until: f64,
}

impl Fault {
    /// A fault of a sensor, made by an order to the sensor.
    pub(crate) fn ordered(
        wheel: usize,
        order: &'static str,
        amount: f64,
        (from, until): (f64, f64),
    ) -> Fault {
        Fault { target: Target::Wheel(wheel), kind: Kind::Ordered(order, amount), from, until }
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Fault { target, kind, from, until } = self;
        write!(formatter, "{from:5.1} to {until:5.1} s: {target:?} {kind:?}")
    }
}
