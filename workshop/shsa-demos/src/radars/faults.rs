//! What happens to a radar half-way.

use super::radar::Track;

/// What happens half-way, to the end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// Nothing.
    Nothing,
    /// The second radar sees nobody any more.
    Blind,
    /// The second radar is moved: all is seen 6 m further on.
    Shifted,
    /// The second radar's clock is 0.3 s ahead: what it stamps is as old.
    Delayed,
    /// The first radar is moved: all is seen 6 m further back.
    FirstShifted,
    /// The last radar sees nobody any more.
    LastBlind,
}

impl Fault {
    /// All of them.
    pub const ALL: [Fault; 6] =
        [Fault::Nothing, Fault::Blind, Fault::Shifted, Fault::Delayed, Fault::FirstShifted, Fault::LastBlind];

    /// What it is in words.
    #[must_use]
    pub const fn describe(self) -> &'static str {
        match self {
            Fault::Nothing => "nothing happens",
            Fault::Blind => "radar 2 goes blind",
            Fault::Shifted => "radar 2 shows all 6 m further on",
            Fault::Delayed => "radar 2 is 0.3 s late",
            Fault::FirstShifted => "radar 1 shows all 6 m further back",
            Fault::LastBlind => "radar 4 goes blind",
        }
    }

    /// The radar that is faulty, from 0.
    #[must_use]
    pub const fn radar(self) -> Option<usize> {
        match self {
            Fault::Nothing => None,
            Fault::Blind | Fault::Shifted | Fault::Delayed => Some(1),
            Fault::FirstShifted => Some(0),
            Fault::LastBlind => Some(3),
        }
    }

    /// Whether other radars tell the fault, or positions that vehicles tell: not that the last radar, which has one neighbour, is blind.
    #[must_use]
    pub const fn is_between(self) -> bool {
        matches!(self, Fault::Blind | Fault::Shifted | Fault::Delayed | Fault::FirstShifted)
    }

    /// How old what is scanned is, s.
    pub(super) const fn age_s(self) -> f64 {
        match self {
            Fault::Delayed => 0.3,
            _ => 0.0,
        }
    }

    /// What the faulty radar says in the place of its tracks.
    pub(super) fn said(self, tracks: Vec<Track>) -> Vec<Track> {
        let moved = |by: f64| tracks.iter().map(|track| Track { x: track.x + by, ..*track }).collect();
        match self {
            Fault::Nothing | Fault::Delayed => tracks,
            Fault::Blind | Fault::LastBlind => Vec::new(),
            Fault::Shifted => moved(6.0),
            Fault::FirstShifted => moved(-6.0),
        }
    }
}
