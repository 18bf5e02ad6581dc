//! What the trials of several systems have in common.

use crate::healer::Decision;

/// What provides the numbers that a system needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Provision {
    /// The engine over the model of the system, from whatever can be trusted.
    Healed,
    /// The sensors, right or wrong: of the rover the lidar, of the battery each as it is, at a border of radars the one that is left.
    SensorsAlone,
}

/// Something worth telling of a trial with one fault of type `F`.
#[derive(Clone, Debug, PartialEq)]
pub enum Happening<F> {
    /// The fault begins.
    FaultBegins(F),
    /// The engine has decided something.
    Decided(Decision),
}
