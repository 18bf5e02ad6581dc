//! Which values may be missing, for functions that pass over arguments without a value.
//!
//! An interval says what a number may be where it has a value. Over `a` from -1 to 1 that is 0 to 1 for `sqrt(a)`, and it may have
//! none. Most functions need all of their arguments, so their results say no more than that. But `mean(sqrt(a), b)` is `b` where
//! `a` is negative: its interval holds both. Only programs in which that can happen are weighed.

use super::program::{Program, Register};
use super::registers::{get, set};
use crate::time::Time;
use alloc::vec;
use alloc::vec::Vec;

/// Whether a number has a value, where its interval is not empty.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Presence {
    /// It has.
    #[default]
    Certain,
    /// Not for all values of its arguments. It is taken for granted in what needs it.
    Partial,
    /// One of two cases has none, and which one it is is open: so what needs it has none.
    Open,
}

/// The presences of a program's registers.
#[derive(Clone, Debug, Default)]
pub(super) struct Presences {
    pub(super) scalars: Vec<Presence>,
    truths: Vec<Presence>,
    /// Of the elements of vectors, one vector behind the other.
    elements: Vec<Presence>,
    stride: usize,
    /// Until when each time operator reaches samples that may have had no value.
    pub(super) until: Vec<Time>,
}

impl Presences {
    /// The memory for a program; empty for one that is not weighed.
    pub(super) fn new(program: &Program, stride: usize) -> Presences {
        if !program.is_weighed {
            return Presences::default();
        }
        let mut made = Presences {
            scalars: vec![Presence::Certain; program.scalar_count as usize],
            truths: vec![Presence::Certain; program.truth_count as usize],
            elements: Vec::new(),
            stride: 0,
            until: vec![Time::MIN; program.memories.len()],
        };
        made.widen(stride, program.vector_count as usize);
        made
    }

    /// Makes room for longer vectors, whose presences each evaluation sets anew.
    pub(super) fn widen(&mut self, stride: usize, count: usize) {
        if !self.scalars.is_empty() || !self.truths.is_empty() {
            self.stride = stride;
            self.elements.clear();
            self.elements.resize(stride.saturating_mul(count), Presence::Certain);
        }
    }

    /// Forgets all earlier evaluations.
    pub(super) fn clear(&mut self) {
        self.until.iter_mut().for_each(|until| *until = Time::MIN);
    }

    /// The presence of a register, or of an element of a vector.
    pub(super) fn of(&self, register: Register, place: usize) -> Presence {
        match register {
            Register::Scalar(scalar) => get(&self.scalars, scalar, Presence::Certain),
            Register::Truth(truth) => get(&self.truths, truth, Presence::Certain),
            Register::Vector(vector) => {
                let at = vector as usize * self.stride + place;
                self.elements.get(at).copied().unwrap_or(Presence::Certain)
            }
        }
    }

    pub(super) fn set(&mut self, register: Register, place: usize, presence: Presence) {
        match register {
            Register::Scalar(scalar) => set(&mut self.scalars, scalar, presence),
            Register::Truth(truth) => set(&mut self.truths, truth, presence),
            Register::Vector(vector) => {
                let at = vector as usize * self.stride + place;
                self.elements.get_mut(at).into_iter().for_each(|own| *own = presence);
            }
        }
    }
}
