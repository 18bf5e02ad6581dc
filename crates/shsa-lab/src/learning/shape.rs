//! The forms of relations.

use crate::learning::signal::Signal;
use shsa_core::unit::Dimension;

/// A signal that repeats another.
#[derive(Clone, Debug, PartialEq)]
pub struct Copied {
    /// The copy.
    pub signal: usize,
    /// The original.
    pub of: usize,
    /// The factor, in SI units.
    pub factor: f64,
    /// The offset, in SI units.
    pub offset: f64,
}

impl Copied {
    /// Becomes a copy of what its original has turned out to repeat.
    pub(crate) fn follow(&mut self, original: &Copied) {
        self.offset += self.factor * original.offset;
        self.factor *= original.factor;
        self.of = original.of;
    }
}

/// How the target follows from the inputs; the constants are in [`Relation::numbers`].
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// `x(t - lag) + n0`.
    Equal {
        /// The delay of the target, in seconds.
        lag_s: f64,
    },
    /// `n0 x(t - lag) + n1`.
    Line {
        /// The delay of the target, in seconds.
        lag_s: f64,
    },
    /// `n0 + n1 x + n2 x^2 ..`, of this degree.
    Polynomial(usize),
    /// `n0` times x, which is above 0, to this power.
    Power(f64),
    /// `n0 |x| + n1`.
    Absolute,
    /// `n0` times the first input times the cosine, or the sine, of the second one.
    Projected {
        /// Whether it is the sine.
        is_sine: bool,
    },
    /// `n0 x + n1`, limited to `n2` below and `n3` above; one of them is infinite where too few samples show it.
    Saturated,
    /// The lines between the values `n_i` that the target has at these values of the first input, and beyond the outer ones; `+ n`
    /// times the second input, where there is one.
    Table(Vec<f64>),
    /// `n0` times the mean of x over a window, `+ n1`.
    Mean {
        /// The window in seconds.
        window_s: f64,
    },
    /// The mean of the target over a window is `n0` times the mean rate of x over it.
    Rate {
        /// The window in seconds.
        window_s: f64,
    },
    /// `n0` times the integral of x since the first moment, `+ n1`.
    Integral,
    /// `n0` times the product of the inputs with these powers.
    Product(Vec<i8>),
    /// `n0 x0 + n1 x1 .. + c`.
    Sum,
    /// `n_i x0` while x1 has the i-th of these values.
    Gears(Vec<f64>),
    /// `n_i` times one of the inputs, which the last one selects.
    Modes(Vec<Mode>),
    /// `n0` times what follows x with a time constant, `+ n1`.
    Follower {
        /// The time constant in seconds.
        tau_s: f64,
    },
    /// The largest of the inputs, `+ n0`.
    Largest,
    /// The smallest of the inputs, `+ n0`.
    Smallest,
    /// The root of `n0 x0^2 + n1 x1^2 ..`.
    Norm,
    /// `n0` times the first term, `+ n1` times the second .. `+ c`; each term is the product of the inputs with its powers.
    Terms(Vec<Vec<i8>>),
}

/// A value of a signal that selects, and the input, by its place, that it selects.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mode {
    /// The value.
    pub level: f64,
    /// The place of the input.
    pub input: usize,
}

impl Shape {
    /// The name of the form.
    #[must_use]
    pub fn kind(&self) -> &'static str {
        match self {
            Shape::Equal { lag_s } if *lag_s == 0.0 => "equal",
            Shape::Equal { .. } => "delay",
            Shape::Line { .. } => "line",
            Shape::Polynomial(_) => "polynomial",
            Shape::Power(_) => "power",
            Shape::Absolute => "absolute",
            Shape::Projected { .. } => "projection",
            Shape::Saturated => "saturation",
            Shape::Table(_) => "table",
            Shape::Mean { .. } => "mean",
            Shape::Rate { .. } => "derivative",
            Shape::Integral => "integral",
            Shape::Product(_) => "product",
            Shape::Sum => "sum",
            Shape::Gears(_) => "gears",
            Shape::Modes(_) => "modes",
            Shape::Follower { .. } => "follower",
            Shape::Largest => "largest",
            Shape::Smallest => "smallest",
            Shape::Norm => "norm",
            Shape::Terms(_) => "terms",
        }
    }

    /// Whether the target takes steps when a mode changes, so that some samples around each change may be wrong.
    pub(crate) fn takes_steps(&self) -> bool {
        matches!(self, Shape::Gears(_) | Shape::Modes(_))
    }
}

/// A relation that was fitted.
#[derive(Clone, Debug, PartialEq)]
pub struct Relation {
    /// The determined signal, by its index.
    pub target: usize,
    /// The signals that determine the target, by their indices.
    pub inputs: Vec<usize>,
    /// The form.
    pub shape: Shape,
    /// The constants of the form, in SI units from the zeros of the signals' own units.
    pub numbers: Vec<f64>,
    /// For an integral, the window in seconds over which its rate is compared.
    pub window_s: Option<f64>,
    /// The errors.
    pub score: Score,
}

/// The unexplained part of the target in each part of the data, as shares of its standard deviation, with the constants of the
/// fitted part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Score {
    /// In the part to which the constants were fitted.
    pub fitted: f64,
    /// In the part by which the form was chosen.
    pub chosen: f64,
    /// In the remaining part.
    pub unseen: f64,
}

impl Score {
    /// The largest share.
    #[must_use]
    pub fn worst(&self) -> f64 {
        self.fitted.max(self.chosen).max(self.unseen)
    }

    /// The root of the mean square of all parts.
    pub(crate) fn all(&self) -> f64 {
        (0.5 * self.fitted.powi(2) + 0.2 * self.chosen.powi(2) + 0.3 * self.unseen.powi(2)).sqrt()
    }
}

impl Relation {
    /// All signals, in order.
    #[must_use]
    pub fn signals(&self) -> Vec<usize> {
        let mut all: Vec<usize> = self.inputs.iter().copied().chain([self.target]).collect();
        all.sort_unstable();
        all
    }

    /// Whether only the recording is evidence for the relation: a line or a curve between two quantities of different kinds, unless
    /// it is a radius that turns an angle into a length, or a length into an angle.
    #[must_use]
    pub fn is_statistical(&self, signals: &[Signal]) -> bool {
        let dimension = |signal: usize| signals[signal].unit.as_ref().map(|unit| unit.dimension);
        let (length, angle) = (Dimension::LENGTH, Dimension::ANGLE);
        let radius = [length.over(angle), angle.over(length)];
        let has_ground = |input: usize| {
            let (own, other) = (dimension(self.target), dimension(input));
            let ratio = own.zip(other).and_then(|(own, other)| own.over(other));
            let is_multiple = matches!(self.numbers[..], [_, 0.0]);
            own == other || is_multiple && ratio.is_some() && radius.contains(&ratio)
        };
        let is_curve = matches!(
            self.shape,
            Shape::Line { .. } | Shape::Polynomial(_) | Shape::Power(_) | Shape::Absolute | Shape::Saturated
        );
        let is_curve = is_curve || matches!(self.shape, Shape::Table(_)) && self.inputs.len() == 1;
        is_curve && !self.inputs.iter().all(|input| has_ground(*input))
    }
}
