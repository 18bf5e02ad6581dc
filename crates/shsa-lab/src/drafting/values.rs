//! The values of all columns while recordings are read: finite numbers over seconds, sessions one after the other.

use shsa_core::observation::RawValue;
use shsa_core::time::Time;
use shsa_recording::Sample;

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
    count: usize,
    sessions: Vec<OfSession>,
}

/// The values of a session: the times of each column in seconds from its first moment.
struct OfSession {
    first: Option<Time>,
    columns: Vec<Vec<(f64, f64)>>,
    last_s: f64,
}

impl Values {
    pub(super) fn new(count: usize) -> Values {
        Values { count, sessions: Vec::new() }
    }

    /// Begins a session.
    pub(super) fn begin(&mut self) {
        let columns = vec![Vec::new(); self.count];
        self.sessions.push(OfSession { first: None, columns, last_s: 0.0 });
    }

    pub(super) fn take(&mut self, sample: &Sample) {
        let Some(session) = self.sessions.last_mut() else { return };
        let first = *session.first.get_or_insert(sample.time);
        let (RawValue::Number(value), Some(column)) = (&sample.value, session.columns.get_mut(sample.wanted))
        else {
            return;
        };
        let time_s = (sample.time - first).seconds();
        session.last_s = session.last_s.max(time_s);
        if is_known(*value) {
            column.push((time_s, *value));
        }
    }

    /// The columns, and a time between each two sessions. Sessions follow each other in the order of time, and those that begin at one
    /// time in the order of their values, however the files were named.
    pub(super) fn in_order(mut self) -> (Vec<Points>, Vec<f64>) {
        self.sessions.retain(|session| session.first.is_some());
        self.sessions
            .sort_by(|one, other| one.first.cmp(&other.first).then_with(|| one.keys().cmp(other.keys())));
        let mut columns = vec![Points::default(); self.count];
        let (mut shift_s, mut joints) = (0.0, Vec::new());
        for (number, session) in self.sessions.into_iter().enumerate() {
            if number > 0 {
                joints.push(shift_s - 0.5 * BETWEEN_S);
            }
            for (column, own) in columns.iter_mut().zip(session.columns) {
                if !column.points.is_empty() && !own.is_empty() {
                    column.breaks.push(column.points.len());
                }
                column.points.extend(own.into_iter().map(|(time_s, value)| (time_s + shift_s, value)));
            }
            shift_s += session.last_s + BETWEEN_S;
        }
        (columns, joints)
    }
}

impl OfSession {
    /// What tells sessions apart that begin at one time.
    fn keys(&self) -> impl Iterator<Item = (usize, u64, u64)> {
        self.columns.iter().enumerate().flat_map(|(number, points)| {
            points.iter().map(move |(time_s, value)| (number, time_s.to_bits(), value.to_bits()))
        })
    }
}
