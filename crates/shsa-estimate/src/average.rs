//! Averages and medians: over the last values of one input, and over several inputs by their confidence.

use crate::Error;

/// The last values of an input, newest last.
#[derive(Clone, Debug)]
pub struct Window {
    values: Vec<f64>,
    sorted: Vec<f64>,
    capacity: usize,
}

impl Window {
    /// A window for this many values, at least one.
    #[must_use]
    pub fn new(capacity: usize) -> Window {
        let capacity = capacity.max(1);
        Window { values: Vec::with_capacity(capacity), sorted: vec![0.0; capacity], capacity }
    }

    /// Takes in a value; a full window drops the oldest. Linear.
    pub fn push(&mut self, value: f64) {
        if self.values.len() == self.capacity {
            self.values.rotate_left(1);
            self.values.pop();
        }
        self.values.push(value);
    }

    /// The values, oldest first.
    #[must_use]
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// The largest number of values.
    #[must_use]
    pub fn capacity(&self) -> usize {
        self.capacity
    }

    /// Removes all values.
    pub fn clear(&mut self) {
        self.values.clear();
    }

    /// Whether the window is full.
    #[must_use]
    pub fn is_full(&self) -> bool {
        self.values.len() == self.capacity
    }

    /// The two middle values, which are the same for an odd number; `None` without values. Time: w log w for w values.
    ///
    /// The moving median and its robustness: J. W. Tukey, "Exploratory Data Analysis", 1977; N. Gallagher, G. Wise 1981,
    /// doi:10.1109/TASSP.1981.1163708.
    pub fn middle(&mut self) -> Option<(f64, f64)> {
        let count = self.values.len();
        let sorted = self.sorted.get_mut(..count)?;
        sorted.copy_from_slice(&self.values);
        sorted.sort_unstable_by(f64::total_cmp);
        Some((*sorted.get(count.checked_sub(1)? / 2)?, *sorted.get(count / 2)?))
    }

    /// The mean of the two middle values. As [`Window::middle`].
    pub fn median(&mut self) -> Option<f64> {
        self.middle().map(|(lower, upper)| lower / 2.0 + upper / 2.0)
    }
}

/// The result of a moving average until its window is full.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filling {
    /// The average of the present values.
    Partial,
    /// The input.
    Echo,
}

/// A weighted moving average: `sum(w_i x_i) / sum(w_i)` of the last values, in O(window).
///
/// With weights of its own last outputs it is recursive: the mean of both averages. A. Oppenheim, R. Schafer, "Discrete-Time
/// Signal Processing", 2010.
#[derive(Clone, Debug)]
pub struct MovingAverage {
    inputs: Window,
    outputs: Window,
    /// The weights, that of the newest value first.
    weights: Vec<f64>,
    output_weights: Vec<f64>,
    filling: Filling,
}

impl MovingAverage {
    /// A moving average with these weights, that of the newest value first; their number is the window.
    ///
    /// # Errors
    /// No weights, a weight that is not a number, or a sum that is not above zero.
    pub fn new(weights: &[f64], filling: Filling) -> Result<MovingAverage, Error> {
        MovingAverage::recursive(weights, &[], filling)
    }

    /// A moving average with weights of its last outputs, too, that of the newest one first.
    ///
    /// # Errors
    /// As [`MovingAverage::new`], for both lists of weights.
    pub fn recursive(
        weights: &[f64],
        output_weights: &[f64],
        filling: Filling,
    ) -> Result<MovingAverage, Error> {
        for (what, weights) in
            [("the sum of the weights", weights), ("the sum of the output weights", output_weights)]
        {
            let value = weights.iter().sum::<f64>();
            let is_used = what == "the sum of the weights" || !weights.is_empty();
            if is_used && !(value > 0.0 && value.is_finite()) {
                return Err(Error::Range { what, value, range: "finite and above 0" });
            }
        }
        Ok(MovingAverage {
            inputs: Window::new(weights.len()),
            outputs: Window::new(output_weights.len()),
            weights: weights.to_vec(),
            output_weights: output_weights.to_vec(),
            filling,
        })
    }

    /// Takes in a value and returns the average.
    pub fn push(&mut self, value: f64) -> f64 {
        self.inputs.push(value);
        let is_echo = self.filling == Filling::Echo && !self.inputs.is_full();
        let direct = if is_echo { value } else { weighted(&self.inputs, &self.weights).unwrap_or(value) };
        if self.output_weights.is_empty() {
            return direct;
        }
        let is_ready = self.inputs.is_full() && self.outputs.is_full();
        let past = weighted(&self.outputs, &self.output_weights).filter(|_| is_ready);
        let output = past.map_or(value, |past| (direct + past) / 2.0);
        self.outputs.push(output);
        output
    }

    /// The weights of the present values, that of the newest one first, scaled to sum to 1.
    pub(crate) fn shares(&self) -> impl Iterator<Item = f64> + Clone + '_ {
        let used = self.weights.get(..self.inputs.values().len()).unwrap_or(&self.weights);
        let sum: f64 = used.iter().sum();
        used.iter().map(move |weight| weight / sum)
    }

    /// Whether the average uses its own outputs.
    #[must_use]
    pub fn is_recursive(&self) -> bool {
        !self.output_weights.is_empty()
    }

    /// The input values; outputs of a recursive average are separate.
    pub(crate) fn window(&self) -> &Window {
        &self.inputs
    }

    /// The input values, mutable.
    pub(crate) fn window_mut(&mut self) -> &mut Window {
        &mut self.inputs
    }
}

/// The weighted mean of the values; `None` where the weights in use have no sum.
fn weighted(window: &Window, weights: &[f64]) -> Option<f64> {
    let pairs = window.values().iter().rev().zip(weights);
    let (sum, total) =
        pairs.fold((0.0, 0.0), |(sum, total), (value, weight)| (sum + value * weight, total + weight));
    (total > 0.0).then(|| sum / total)
}

/// The handling of a variance of zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Certain {
    /// A variance of zero is an error.
    Refused,
    /// The value is left out; where all variances are zero, all values have equal weights.
    LeftOut,
}

/// An average by confidence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Combined {
    /// `sum(x_i / V_i) / sum(1 / V_i)`.
    pub value: f64,
    /// `1 / sum(1 / V_i)`; the sample variance where all variances are zero.
    pub variance: f64,
    /// `sum((x_i - x)^2 / V_i)`: chi-square distributed with one degree of freedom less than values, if the variances are right.
    pub chi_square: f64,
    /// The number of values used.
    pub count: usize,
}

/// The average of values by their variances: the best linear unbiased one of independent values (A. C. Aitken 1936,
/// doi:10.1017/S0370164600014346). Missing values are left out. Linear.
///
/// # Errors
/// No value is present, or a variance is zero and that is refused.
pub fn by_confidence(values: &[(Option<f64>, f64)], certain: Certain) -> Result<Combined, Error> {
    let present = || {
        values.iter().enumerate().filter_map(|(place, (value, variance))| Some((place, (*value)?, *variance)))
    };
    if present().next().is_none() {
        return Err(Error::Nothing);
    }
    let is_certain = |variance: f64| variance.is_nan() || variance <= 0.0;
    let zero = present().find(|(.., variance)| is_certain(*variance));
    match (zero, certain) {
        (Some((place, ..)), Certain::Refused) => return Err(Error::ZeroVariance { place }),
        (Some(_), Certain::LeftOut) if present().all(|(.., variance)| is_certain(variance)) => {
            return Ok(alike(present().map(|(_, value, _)| value)));
        }
        _ => {}
    }
    let used = || present().filter(|(.., variance)| *variance > 0.0);
    let total: f64 = used().map(|(.., variance)| 1.0 / variance).sum();
    let value = used().map(|(_, value, variance)| value / variance).sum::<f64>() / total;
    let chi_square = used().map(|(_, other, variance)| (other - value).powi(2) / variance).sum();
    Ok(Combined { value, variance: 1.0 / total, chi_square, count: used().count() })
}

fn alike(values: impl Iterator<Item = f64> + Clone) -> Combined {
    let count = values.clone().count();
    let value = values.clone().sum::<f64>() / count as f64;
    let variance = values.map(|other| (other - value).powi(2)).sum::<f64>() / count as f64;
    Combined { value, variance, chi_square: 0.0, count }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_belong_to_the_newest_value_first() {
        let mut average = MovingAverage::new(&[2.0, 1.0], Filling::Partial).unwrap();
        assert_eq!(average.push(3.0), 3.0);
        assert_eq!(average.push(6.0), 5.0);
        assert_eq!(average.push(0.0), 2.0);
        assert!(MovingAverage::new(&[], Filling::Echo).is_err());
        assert!(MovingAverage::recursive(&[1.0], &[0.0], Filling::Echo).is_err());
    }

    #[test]
    fn a_median_of_an_even_number_lies_between_the_middle_two() {
        let mut window = Window::new(4);
        assert_eq!(window.median(), None);
        [5.0, 1.0, 9.0, 3.0].into_iter().for_each(|value| window.push(value));
        assert_eq!((window.middle(), window.median()), (Some((3.0, 5.0)), Some(4.0)));
        window.push(2.0);
        assert_eq!(window.values(), [1.0, 9.0, 3.0, 2.0]);
    }

    #[test]
    fn certain_values_are_refused_or_left_out() {
        let values = [(Some(1.0), 0.0), (None, 1.0), (Some(3.0), 0.5)];
        assert_eq!(by_confidence(&values, Certain::Refused), Err(Error::ZeroVariance { place: 0 }));
        let left_out = by_confidence(&values, Certain::LeftOut).unwrap();
        assert_eq!((left_out.value, left_out.variance, left_out.count), (3.0, 0.5, 1));
        assert_eq!(by_confidence(&[(None, 1.0)], Certain::LeftOut), Err(Error::Nothing));
    }
}
