//! The registers of a program: numbers, truths, and vectors of one maximal length.

use super::number::Number;
use super::operation::Binary;
use super::program::Register;
use alloc::vec;
use alloc::vec::Vec;

/// Vectors of one maximal length, one behind the other.
#[derive(Clone, Debug)]
pub(super) struct Vectors<N> {
    pub(super) elements: Vec<N>,
    /// The lengths; 0 for a missing vector.
    pub(super) lengths: Vec<usize>,
    pub(super) stride: usize,
}

/// An argument of an operation on elements.
#[derive(Clone, Copy)]
pub(super) enum Operand<'a, N> {
    Scalar(N),
    Vector(&'a [N]),
}

impl<N: Number> Operand<'_, N> {
    pub(super) fn at(&self, place: usize) -> N {
        match self {
            Operand::Scalar(number) => *number,
            Operand::Vector(numbers) => numbers.get(place).copied().unwrap_or(N::MISSING),
        }
    }

    fn length(&self) -> Option<usize> {
        match self {
            Operand::Scalar(_) => None,
            Operand::Vector(numbers) => Some(numbers.len()),
        }
    }
}

impl<N: Number> Vectors<N> {
    pub(super) fn get(&self, place: u32) -> &[N] {
        let start = place as usize * self.stride;
        let length = self.lengths.get(place as usize).copied().unwrap_or(0);
        self.elements.get(start..start + length).unwrap_or(&[])
    }

    pub(super) fn widen(&mut self, stride: usize) {
        if self.lengths.is_empty() || stride <= self.stride {
            return;
        }
        let mut elements = vec![N::MISSING; stride.saturating_mul(self.lengths.len())];
        for (place, wider) in (0..).zip(elements.chunks_mut(stride)) {
            wider.iter_mut().zip(self.get(place)).for_each(|(to, from)| *to = *from);
        }
        (self.elements, self.stride) = (elements, stride);
    }

    pub(super) fn set_length(&mut self, place: u32, length: usize) {
        if let Some(own) = self.lengths.get_mut(place as usize) {
            *own = length;
        }
    }

    pub(super) fn fill(&mut self, place: u32, numbers: impl ExactSizeIterator<Item = N>) {
        let (start, length) = (place as usize * self.stride, numbers.len());
        let own = self.elements.get_mut(start..start + length).filter(|_| length <= self.stride);
        let length = own.map_or(0, |own| {
            for (element, number) in own.iter_mut().zip(numbers) {
                *element = number;
            }
            length
        });
        self.set_length(place, length);
    }

    pub(super) fn copy(&mut self, from: u32, to: u32) {
        let length = self.get(from).len();
        let (from, start) = (from as usize * self.stride, to as usize * self.stride);
        if start + length <= self.elements.len() {
            self.elements.copy_within(from..from + length, start);
            self.set_length(to, length);
        }
    }

    /// Computes the elements of one vector from earlier ones. A vector's arguments always have lower numbers, as the compiler
    /// numbers the registers in the order of computation.
    pub(super) fn compute(&mut self, place: u32, f: impl FnOnce(&Below<'_, N>, &mut [N]) -> usize) {
        let start = place as usize * self.stride;
        let Some((elements, own)) = self.elements.split_at_mut_checked(start) else { return };
        let Some(own) = own.get_mut(..self.stride) else { return };
        let below = Below { elements, lengths: &self.lengths, stride: self.stride };
        let length = f(&below, own);
        self.set_length(place, length);
    }
}

/// The vectors with lower numbers than the computed one.
pub(super) struct Below<'a, N> {
    elements: &'a [N],
    lengths: &'a [usize],
    stride: usize,
}

impl<'a, N: Number> Below<'a, N> {
    pub(super) fn operand(&self, register: Register, scalars: &[N]) -> Operand<'a, N> {
        match register {
            Register::Scalar(place) => Operand::Scalar(get(scalars, place, N::MISSING)),
            Register::Vector(place) => Operand::Vector(self.get(place)),
            Register::Truth(_) => Operand::Scalar(N::MISSING),
        }
    }

    pub(super) fn get(&self, place: u32) -> &'a [N] {
        let start = place as usize * self.stride;
        let length = self.lengths.get(place as usize).copied().unwrap_or(0);
        self.elements.get(start..start + length).unwrap_or(&[])
    }
}

pub(super) fn get<T: Copy>(registers: &[T], place: u32, missing: T) -> T {
    registers.get(place as usize).copied().unwrap_or(missing)
}

pub(super) fn set<T>(registers: &mut [T], place: u32, value: T) {
    if let Some(register) = registers.get_mut(place as usize) {
        *register = value;
    }
}

/// Applies a function to every element; returns the number of elements.
pub(super) fn each<N: Number>(own: &mut [N], operand: Operand<'_, N>, f: impl Fn(N) -> N) -> usize {
    let Operand::Vector(numbers) = operand else { return 0 };
    for (element, number) in own.iter_mut().zip(numbers) {
        *element = f(*number);
    }
    numbers.len()
}

/// Applies an operator to the elements of vectors of the same length, or of a vector and a number.
pub(super) fn each_two<N: Number>(
    own: &mut [N],
    left: Operand<'_, N>,
    right: Operand<'_, N>,
    binary: Binary,
) -> usize {
    let length = match (left.length(), right.length()) {
        (Some(left), Some(right)) if left != right => 0,
        (left, right) => left.or(right).unwrap_or(0),
    };
    for (place, element) in own.iter_mut().enumerate().take(length) {
        *element = left.at(place).binary(binary, right.at(place));
    }
    length
}
