//! Kinds of faults, and the injected fault for each kind and multiple of the signal's declared error.

use super::size::numbers;
use shsa_core::knowledge::Scaling;
use shsa_core::time::{Span, Time};
use shsa_format::fault::FaultKind;
use shsa_recording::Sample;

/// A kind of fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// The value stays.
    Stuck,
    /// The amount is added.
    Bias,
    /// Nothing comes.
    Drop,
    /// Up to plus or minus the amount is added.
    Noise,
    /// More and more is added, the amount at the fault's end.
    Drift,
    /// The amount is added to one value in ten.
    Spike,
    /// Values are multiplied: the one of median size is off by the amount.
    Scale,
    /// Values come later, by the amount.
    Delay,
    /// The last value before the fault plus the amount comes instead.
    Spoof,
}

impl Kind {
    /// All kinds, in the order of reports.
    pub const ALL: [Kind; 9] = [
        Kind::Stuck,
        Kind::Bias,
        Kind::Drop,
        Kind::Noise,
        Kind::Drift,
        Kind::Spike,
        Kind::Scale,
        Kind::Delay,
        Kind::Spoof,
    ];

    /// The name as in `--inject`.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Stuck => "stuck",
            Kind::Bias => "bias",
            Kind::Drop => "drop",
            Kind::Noise => "noise",
            Kind::Drift => "drift",
            Kind::Spike => "spike",
            Kind::Scale => "scale",
            Kind::Delay => "delay",
            Kind::Spoof => "spoof",
        }
    }

    /// Whether the fault is random, so that its seed matters.
    pub fn is_random(self) -> bool {
        matches!(self, Kind::Noise | Kind::Spike)
    }

    /// Whether the kind has an amount.
    pub fn has_amount(self) -> bool {
        !matches!(self, Kind::Stuck | Kind::Drop)
    }

    /// Whether the amount may be negative.
    pub fn has_sides(self) -> bool {
        matches!(self, Kind::Bias | Kind::Drift | Kind::Spike | Kind::Scale | Kind::Spoof)
    }

    /// The multiples for this kind among the wanted ones: a single `None` for a kind without an amount.
    pub(super) fn multiples(self, wanted: &[f64]) -> Vec<Option<f64>> {
        match self {
            Kind::Stuck | Kind::Drop => vec![None],
            Kind::Noise | Kind::Delay => wanted.iter().filter(|by| **by > 0.0).copied().map(Some).collect(),
            _ => wanted.iter().copied().map(Some).collect(),
        }
    }
}

/// A kind of fault, and its amount as a multiple of the signal's declared error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct What {
    /// The kind of fault.
    pub kind: Kind,
    /// The multiple; `None` for a kind without an amount.
    pub multiple: Option<f64>,
}

impl What {
    /// A label such as `bias 2×`.
    pub fn label(self) -> String {
        self.multiple.map_or(self.kind.name().to_owned(), |by| format!("{} {by}×", self.kind.name()))
    }
}

/// The fault with an amount; `None` for a spoof without a value before it.
pub(super) fn fault_kind(
    kind: Kind,
    size: f64,
    own: &[&Sample],
    scaling: Option<Scaling>,
    onset: Time,
) -> Option<FaultKind> {
    Some(match kind {
        Kind::Stuck => FaultKind::Stuck(None),
        Kind::Bias => FaultKind::Bias(size),
        Kind::Drop => FaultKind::Drop,
        Kind::Noise => FaultKind::Noise(size),
        Kind::Drift => FaultKind::Drift(size),
        Kind::Spike => FaultKind::Spike(size),
        Kind::Scale => FaultKind::Scale(size),
        Kind::Delay => FaultKind::Delay(Span::from_seconds(size)),
        Kind::Spoof => {
            let before = own.partition_point(|sample| sample.received < onset).checked_sub(1)?;
            FaultKind::Spoof(numbers(&own.get(before)?.value, scaling).first()? + size)
        }
    })
}
