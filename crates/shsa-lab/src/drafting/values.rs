//! The values of all columns while recordings are read: finite numbers over seconds, sessions one after the other.

use shsa_core::observation::RawValue;
use shsa_core::time::Time;
use shsa_format::recording::Sample;

/// A number from this size on counts as missing, as NaN and infinity do: its square is beyond the numbers, so it has no variance.
const TOO_LARGE: f64 = 1e150;

/// The time between two sessions in seconds: longer than any delay, so that none reaches from one into the other.
const BETWEEN_S: f64 = 10.0;

/// The times in seconds and the values of a column, and where its sessions after the first one begin.
#[derive(Clone, Default)]
pub(super) struct Points {
    pub(super) points: Vec<(f64, f64)>,
    pub(super) breaks: Vec<usize>,
}

impl Points {
    /// The values that are numbers, as one session.
    pub(super) fn of(points: Vec<(f64, f64)>) -> Points {
        let points = points.into_iter().filter(|point| is_known(point.1)).collect();
        Points { points, breaks: Vec::new() }
    }
}

/// Whether a value is a number.
fn is_known(value: f64) -> bool {
    value.abs() < TOO_LARGE
}

/// The values of all columns while they are read.
pub(super) struct Values {
    pub(super) columns: Vec<Points>,
    /// When each session begins, in seconds.
    pub(super) begins: Vec<f64>,
    /// Where the first moment of the session lies, and how much later the session is put.
    first: Option<Time>,
    shift_s: f64,
    last_s: f64,
}

impl Values {
    pub(super) fn new(count: usize) -> Values {
        Values {
            columns: vec![Points::default(); count],
            begins: Vec::new(),
            first: None,
            shift_s: 0.0,
            last_s: 0.0,
        }
    }

    /// Begins a session, which follows at the end of the one before.
    pub(super) fn begin(&mut self) {
        if self.first.take().is_some() {
            self.shift_s = self.last_s + BETWEEN_S;
        }
        self.begins.push(self.shift_s);
        for column in self.columns.iter_mut().filter(|column| !column.points.is_empty()) {
            column.breaks.push(column.points.len());
        }
    }

    pub(super) fn take(&mut self, sample: &Sample) {
        let first = *self.first.get_or_insert(sample.time);
        let (RawValue::Number(value), Some(column)) = (&sample.value, self.columns.get_mut(sample.wanted))
        else {
            return;
        };
        let time_s = (sample.time - first).seconds() + self.shift_s;
        self.last_s = self.last_s.max(time_s);
        if is_known(*value) {
            column.points.push((time_s, *value));
        }
    }
}
