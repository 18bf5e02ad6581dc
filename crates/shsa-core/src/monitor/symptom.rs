//! Symptoms: how a faulty signal misbehaves.

/// The kind of a fault, as far as it is known. Each kind has its own detector and evidence.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Symptom {
    /// No readings come.
    Silent,
    /// Values come later than the declared delay allows.
    Late,
    /// Values come in another order than they were taken.
    OutOfOrder,
    /// Readings are not numbers, are infinite or have a wrong shape.
    Invalid,
    /// Values lie outside of the variable's possible range.
    OutOfRange,
    /// Values change faster than the variable can.
    TooFast,
    /// Time stamps do not show when values were taken: the stamps are far off, or stand still.
    WrongClock,
    /// Values stay the same for longer than they may, or although related signals move.
    Frozen,
    /// Values disagree with those that other signals imply.
    Inconsistent,
    /// The difference from the values that other signals imply grows slowly.
    Drifting,
    /// Values scatter more than the declared error.
    Noisy,
    /// Values belong to moments other than their time stamps.
    Skewed,
}

impl Symptom {
    /// Every kind.
    pub const ALL: [Symptom; 12] = [
        Symptom::Silent,
        Symptom::Late,
        Symptom::OutOfOrder,
        Symptom::Invalid,
        Symptom::OutOfRange,
        Symptom::TooFast,
        Symptom::WrongClock,
        Symptom::Frozen,
        Symptom::Inconsistent,
        Symptom::Drifting,
        Symptom::Noisy,
        Symptom::Skewed,
    ];

    /// The symptom's name in files and on screens.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Symptom::Silent => "silent",
            Symptom::Late => "late",
            Symptom::OutOfOrder => "out of order",
            Symptom::Invalid => "invalid",
            Symptom::OutOfRange => "out of range",
            Symptom::TooFast => "too fast",
            Symptom::WrongClock => "wrong clock",
            Symptom::Frozen => "frozen",
            Symptom::Inconsistent => "inconsistent",
            Symptom::Drifting => "drifting",
            Symptom::Noisy => "noisy",
            Symptom::Skewed => "skewed",
        }
    }
}
