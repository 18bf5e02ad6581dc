//! What happens to the battery half-way.

use super::battery::Battery;
use super::model::CELLS;
use super::sensors::Place;

/// What happens half-way, to the end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// Nothing.
    Nothing,
    /// The shunt falls silent.
    CurrentLost,
    /// The shunt shows 25 A too little.
    CurrentWrong,
    /// The voltage of the weakest cell is not measured any more.
    CellLost,
    /// The voltage of the weakest cell is shown 0.2 V too high.
    CellWrong,
    /// The weakest cell gets weaker: no sensor is wrong.
    CellWeak,
    /// The voltage of the weakest cell's module is shown 2 V too high.
    ModuleWrong,
    /// The thermometer of the hottest module falls silent.
    TemperatureLost,
    /// The thermometer of the hottest module shows 20 K too much.
    TemperatureWrong,
    /// The voltage of the battery is not measured any more.
    VoltageLost,
    /// The voltage of the battery is shown 8 V too high.
    VoltageWrong,
}

impl Fault {
    /// All of them.
    pub const ALL: [Fault; 11] = [
        Fault::Nothing,
        Fault::CurrentLost,
        Fault::CurrentWrong,
        Fault::CellLost,
        Fault::CellWrong,
        Fault::CellWeak,
        Fault::ModuleWrong,
        Fault::TemperatureLost,
        Fault::TemperatureWrong,
        Fault::VoltageLost,
        Fault::VoltageWrong,
    ];

    /// What it is in words.
    #[must_use]
    pub const fn describe(self) -> &'static str {
        match self {
            Fault::Nothing => "nothing happens",
            Fault::CurrentLost => "the shunt falls silent",
            Fault::CurrentWrong => "the shunt shows 25 A too little",
            Fault::CellLost => "the weakest cell is not measured any more",
            Fault::CellWrong => "the weakest cell is shown 0.2 V too high",
            Fault::CellWeak => "the weakest cell gets weaker: no sensor is wrong",
            Fault::ModuleWrong => "a module's voltage is shown 2 V too high",
            Fault::TemperatureLost => "the hottest module's thermometer falls silent",
            Fault::TemperatureWrong => "the hottest module is shown 20 K too hot",
            Fault::VoltageLost => "the battery's voltage is not measured any more",
            Fault::VoltageWrong => "the battery's voltage is shown 8 V too high",
        }
    }

    /// Whether a sensor is faulty.
    #[must_use]
    pub const fn is_of_a_sensor(self) -> bool {
        !matches!(self, Fault::Nothing | Fault::CellWeak)
    }

    /// The sensor that is faulty, of a battery as it is half-way.
    pub(super) fn place(self, battery: &Battery) -> Option<Place> {
        match self {
            Fault::Nothing | Fault::CellWeak => None,
            Fault::CurrentLost | Fault::CurrentWrong => Some(Place::Shunt),
            Fault::CellLost | Fault::CellWrong => Some(Place::Cell(battery.weakest)),
            Fault::ModuleWrong => Some(Place::Module(battery.weakest / CELLS)),
            Fault::TemperatureLost | Fault::TemperatureWrong => Some(Place::Temperature(battery.hottest())),
            Fault::VoltageLost | Fault::VoltageWrong => Some(Place::Voltage),
        }
    }

    /// What the faulty sensor says in the place of a value; `None` when it is silent.
    pub(super) fn said(self, value: f64) -> Option<f64> {
        match self {
            Fault::Nothing | Fault::CellWeak => Some(value),
            Fault::CurrentWrong => Some(value - 25.0),
            Fault::CellWrong => Some(value + 0.2),
            Fault::ModuleWrong => Some(value + 2.0),
            Fault::TemperatureWrong => Some(value + 20.0),
            Fault::VoltageWrong => Some(value + 8.0),
            Fault::CurrentLost | Fault::CellLost | Fault::TemperatureLost | Fault::VoltageLost => None,
        }
    }
}
