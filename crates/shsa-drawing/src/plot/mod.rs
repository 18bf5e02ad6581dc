//! Line charts: several series of measured values with their median and extremes, over linear or logarithmic axes.

mod ticks;
mod chart;
mod hatched;
mod timeline;

pub use timeline::{Band, Mark, Slice, Timeline};

/// A chart of lines: x to the right, y upwards.
///
/// ```
/// use shsa_drawing::{Axis, Chart, Point, Scale, Series};
/// let axis = |label: &str, unit: &str| Axis { label: label.into(), unit: unit.into(), scale: Scale::Log };
/// let points = vec![
///     Point { x: 1e3, low: 2e-3, y: 2.1e-3, high: 4e-3 },
///     Point { x: 1e6, low: 2.0, y: 2.2, high: 2.9 },
/// ];
/// let chart = Chart {
///     title: "Loading by size".into(),
///     x: axis("relations", ""),
///     y: axis("time to load", "s"),
///     series: vec![Series { name: "JSON".into(), points }],
/// };
/// assert!(chart.svg().contains("JSON at 1,000: 2.1 ms (2 ms to 4 ms)"));
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Chart {
    /// The subject, in one line.
    pub title: String,
    /// The axis to the right.
    pub x: Axis,
    /// The axis upwards.
    pub y: Axis,
    /// The series in the order of the legend.
    pub series: Vec<Series>,
}

/// The quantity of an axis, its unit and its scale.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Axis {
    /// The quantity, such as `time of a search`.
    pub label: String,
    /// The unit of the points, such as `s` or `B`; the ticks get SI prefixes (`10 µs`, `1 MB`). Empty for plain numbers and `%`
    /// for shares, without prefixes.
    pub unit: String,
    /// The scale of the values.
    pub scale: Scale,
}

/// The scale of the values along an axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scale {
    /// Equal differences have equal lengths.
    #[default]
    Linear,
    /// Equal ratios have equal lengths; only positive values can be shown.
    Log,
}

/// Points that are joined by a line.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Series {
    /// The name in the legend.
    pub name: String,
    /// The points, joined in this order.
    pub points: Vec<Point>,
}

/// One measured value with its spread.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// The position on the x axis.
    pub x: f64,
    /// The lowest value: the lower end of the whisker.
    pub low: f64,
    /// The value of the line, usually the median.
    pub y: f64,
    /// The highest value: the upper end of the whisker.
    pub high: f64,
}

impl Point {
    /// A value without spread, which gets no whisker.
    #[must_use]
    pub fn exact(x: f64, y: f64) -> Point {
        Point { x, low: y, y, high: y }
    }
}
