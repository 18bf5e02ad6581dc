//! How a faulty signal misbehaves: what its detector saw.

/// The kind of a fault, as far as it shows. Each has its own detector and evidence.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Symptom {
    /// Nothing comes.
    Silent,
    /// Values come later than the declared delay allows.
    Late,
    /// Values come in another order than they were taken.
    OutOfOrder,
    /// What comes is no number, infinite or of a wrong shape.
    Invalid,
    /// Values lie outside of what is possible for the variable.
    OutOfRange,
    /// Values change faster than the variable can.
    TooFast,
    /// Time stamps are not those of the moments at which values were taken: far off, or standing still.
    WrongClock,
    /// Values stay the same: for longer than they may, or although related signals move.
    Frozen,
    /// Values disagree with what other signals imply.
    Inconsistent,
    /// The difference from what other signals imply builds up slowly.
    Drifting,
    /// Values scatter more than the declared error.
    Noisy,
    /// Values tell of moments other than their time stamps say.
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

    /// What it is called in files and on screens.
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
