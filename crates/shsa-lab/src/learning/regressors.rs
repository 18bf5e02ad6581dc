//! The terms of a form at a moment.

use crate::curve::Curve;
use crate::learning::shape::Shape;
use crate::learning::tables::between;

/// The terms of one form over some inputs.
pub(crate) struct Regressors<'s> {
    curves: &'s [Curve],
    inputs: &'s [usize],
    shape: &'s Shape,
    /// What follows the input.
    followed: Option<Curve>,
}

impl<'s> Regressors<'s> {
    pub(crate) fn new(curves: &'s [Curve], inputs: &'s [usize], shape: &'s Shape) -> Regressors<'s> {
        let followed = match (shape, inputs) {
            (Shape::Follower { tau_s }, [first, ..]) => Some(curves[*first].followed(*tau_s)),
            _ => None,
        };
        Regressors { curves, inputs, shape, followed }
    }

    /// The term with the factor 1, and those whose factors are fitted, at a time at which the signals have these values; `None`
    /// where there is none.
    pub(crate) fn at(&self, time: f64, value: impl Fn(usize) -> Option<f64>) -> Option<(f64, Vec<f64>)> {
        let first = *self.inputs.first()?;
        let curve = &self.curves[first];
        let lagged = |lag_s: f64| if lag_s == 0.0 { value(first) } else { curve.before(time, lag_s) };
        let values = || self.inputs.iter().map(|input| value(*input));
        let fixed = |of: f64| Some((of, vec![1.0]));
        let columns = match self.shape {
            Shape::Equal { lag_s } => return fixed(lagged(*lag_s)?),
            Shape::Largest => {
                return fixed(
                    values().collect::<Option<Vec<_>>>()?.into_iter().fold(f64::NEG_INFINITY, f64::max),
                );
            }
            Shape::Smallest => {
                return fixed(
                    values().collect::<Option<Vec<_>>>()?.into_iter().fold(f64::INFINITY, f64::min),
                );
            }
            Shape::Line { lag_s } => vec![lagged(*lag_s)?, 1.0],
            Shape::Polynomial(degree) => {
                let x = value(first)?;
                (0..=*degree as i32).map(|power| x.powi(power)).collect()
            }
            Shape::Power(power) => vec![Some(value(first)?).filter(|it| *it > 0.0)?.powf(*power)],
            Shape::Absolute => vec![value(first)?.abs(), 1.0],
            Shape::Projected { is_sine } => {
                let angle = value(*self.inputs.get(1)?)?;
                vec![value(first)? * if *is_sine { angle.sin() } else { angle.cos() }]
            }
            Shape::Saturated => vec![value(first)?, 1.0],
            Shape::Table(arguments) => {
                let load = self.inputs.get(1).map(|input| value(*input).ok_or(()));
                let load = load.transpose().ok()?;
                between(arguments, value(first)?).into_iter().chain(load).collect()
            }
            Shape::Mean { window_s } => vec![curve.at(time - window_s, time)?, 1.0],
            Shape::Follower { .. } => vec![self.followed.as_ref()?.read(time)?.0, 1.0],
            Shape::Rate { window_s } => {
                vec![(curve.read(time)?.0 - curve.before(time, *window_s)?) / window_s]
            }
            Shape::Integral => vec![curve.read(time)?.1, 1.0],
            Shape::Product(powers) => vec![self.product(powers, &value)?],
            Shape::Sum => values().chain([Some(1.0)]).collect::<Option<_>>()?,
            Shape::Norm => values().map(|it| it.map(|it| it * it)).collect::<Option<_>>()?,
            Shape::Terms(terms) => {
                let terms = terms.iter().map(|powers| self.product(powers, &value));
                terms.chain([Some(1.0)]).collect::<Option<_>>()?
            }
            Shape::Gears(levels) => {
                let x = value(first)?;
                let level = self.selected(time)?;
                let is_known = levels.contains(&level);
                is_known.then(|| levels.iter().map(|it| if *it == level { x } else { 0.0 }).collect())?
            }
            Shape::Modes(modes) => {
                let level = self.selected(time)?;
                let mode = modes.iter().find(|it| it.level == level)?;
                let x = value(*self.inputs.get(mode.input)?)?;
                modes.iter().map(|it| if it.level == level { x } else { 0.0 }).collect()
            }
        };
        Some((0.0, columns))
    }

    fn product(&self, powers: &[i8], value: &impl Fn(usize) -> Option<f64>) -> Option<f64> {
        let powered = self.inputs.iter().zip(powers).filter(|(_, power)| **power != 0);
        powered.map(|(input, power)| Some(value(*input)?.powi(i32::from(*power)))).product()
    }

    /// The value of the last input, which selects.
    fn selected(&self, time: f64) -> Option<f64> {
        self.curves[*self.inputs.last()?].nearest(time)
    }
}
