//! A copy of the filter: what has happened if its hypothesis is true.

/// A copy of the filter.
#[derive(Clone, Debug)]
pub(super) struct Hypothesis {
    pub(super) memory: Vec<f64>,
    /// The logarithm of its weight.
    pub(super) weight: f64,
    /// The place of its fault; `None`: nothing has happened.
    pub(super) fault: Option<usize>,
    /// How long ago its fault began, in seconds.
    pub(super) age: f64,
    /// The sensors that are noisier or stuck, as bits by the places of the faults.
    pub(super) faulty: u64,
    /// The group that its faults are of.
    pub(super) group: usize,
}

impl Hypothesis {
    /// How many numbers stand beside the memory of the filter.
    pub(super) const BESIDE: usize = 5;

    /// A copy of a filter, before any fault.
    pub(super) fn new(memory: Vec<f64>, group: usize) -> Hypothesis {
        Hypothesis { memory, weight: 0.0, fault: None, age: 0.0, faulty: 0, group }
    }

    pub(super) fn becomes(&mut self, other: &Hypothesis) {
        self.memory.copy_from_slice(&other.memory);
        (self.weight, self.fault, self.age) = (other.weight, other.fault, other.age);
        (self.faulty, self.group) = (other.faulty, other.group);
    }

    pub(super) fn has(&self, fault: usize) -> bool {
        self.faulty >> fault & 1 == 1
    }

    pub(super) fn is_of(&self, group: usize, fault: usize) -> bool {
        self.group == group && self.fault == Some(fault)
    }

    pub(super) fn save(&self, to: &mut [f64]) {
        let fault = self.fault.map_or(-1.0, |fault| fault as f64);
        let beside = [self.weight, fault, self.age, f64::from_bits(self.faulty), self.group as f64];
        put_first(to, &beside).and_then(|to| put_first(to, &self.memory));
    }

    pub(super) fn restore(&mut self, from: &[f64]) {
        let Some(([weight, fault, age, faulty, group], saved)) = from.split_first_chunk() else { return };
        (self.weight, self.age, self.faulty) = (*weight, *age, faulty.to_bits());
        self.fault = (*fault >= 0.0).then_some(*fault as usize);
        self.group = *group as usize;
        self.memory.copy_from_slice(saved);
    }
}

/// Copies numbers to the begin of a memory; returns the rest.
pub(super) fn put_first<'m>(memory: &'m mut [f64], numbers: &[f64]) -> Option<&'m mut [f64]> {
    let (own, rest) = memory.split_at_mut_checked(numbers.len())?;
    own.copy_from_slice(numbers);
    Some(rest)
}
