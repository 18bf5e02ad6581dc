//! A recorded rover whose wheel odometry freezes for 20 s: a filter that believes it, and one in the loop, which leaves it out.
//!
//! The recording is `test1.bag` of robot_localization (T. Moore, D. Stouch 2014, doi:10.1007/978-3-319-08338-4_25).

use crate::in_loop::{Recorded, Served};
use crate::table::{Errors, Table};
use serde_json::json;
use shsa_core::time::{Span, Time};
use std::io::{Write, stdout};
use std::path::Path;

/// The filter with wheels and gyroscope as they come, and the one in the loop.
const MODELS: [&str; 2] =
    [include_str!("odometry.yaml"), include_str!("../../../../models/husky-filter.yaml")];

/// The needs of both.
const POSITION: [&str; 2] = ["/husky/north", "/husky/east"];

const FROZEN_S: i64 = 20;
/// Errors count until this long after the wheels have begun to freeze.
const JUDGED_S: i64 = 30;

/// Positions are compared this often.
const STEP: Span = Span(100_000_000);

/// A fault that misleads the first filter by more than this, in metres, matters.
const MATTERS_M: f64 = 1.0;

/// The errors of both filters while the wheels are frozen from a time on.
struct Window {
    from_s: i64,
    errors: [Errors; 2],
}

/// The error of both filters while the wheels are frozen in one window after the other. The truth is the same filter without the
/// fault. Prints an object for each window where `is_json`.
///
/// # Errors
/// The recording cannot be read, or lacks one of the signals.
pub(super) fn table(path: &Path, is_json: bool) -> anyhow::Result<Table> {
    let mut windows: Vec<Window> = Vec::new();
    for (place, model) in MODELS.into_iter().enumerate() {
        let recorded = Recorded::new(model, path)?;
        let (begin, end) = recorded.span()?;
        let healthy = recorded.serve(None, POSITION)?.served;
        let mut from_s = FROZEN_S;
        while begin + seconds(from_s + JUDGED_S) < end {
            let fault = format!("stuck:wheels@{from_s}s..{}s", from_s + FROZEN_S);
            let found = recorded.serve(Some(&fault), POSITION)?.served;
            let errors = apart(&found, &healthy, begin + seconds(from_s));
            match windows.iter_mut().find(|window| window.from_s == from_s) {
                Some(window) => window.errors[place] = errors,
                None => windows.push(Window { from_s, errors: [errors; 2] }),
            }
            from_s += FROZEN_S;
        }
    }
    for Window { from_s, errors } in windows.iter().filter(|_| is_json) {
        let line = json!({ "frozen_from_s": from_s, "rms_m": errors.map(|it| it.rms()) });
        writeln!(stdout().lock(), "{line}")?;
    }
    Ok(shown(&windows))
}

fn seconds(seconds: i64) -> Span {
    Span(seconds * 1_000_000_000)
}

/// The distance of two runs from a time on.
fn apart(found: &[Vec<Served>; 2], healthy: &[Vec<Served>; 2], from: Time) -> Errors {
    let (mut errors, mut at) = (Errors::default(), from);
    while at < from + seconds(JUDGED_S) {
        let off = |axis: usize| position(&found[axis], at) - position(&healthy[axis], at);
        errors.add(off(0).hypot(off(1)), 1.0);
        at = at + STEP;
    }
    errors
}

/// What was served at a time: the latest value; not a number before the first.
fn position(served: &[Served], at: Time) -> f64 {
    let known = served.partition_point(|it| it.at <= at);
    known.checked_sub(1).and_then(|place| served.get(place)).map_or(f64::NAN, |it| it.value.midpoint())
}

/// The root of the mean square over windows.
fn together<'w>(windows: impl Iterator<Item = &'w Window>) -> [f64; 2] {
    let mut all = [Errors::default(); 2];
    for window in windows {
        all.iter_mut().zip(&window.errors).for_each(|(all, own)| all.add(own.rms(), 1.0));
    }
    all.map(|errors| errors.rms())
}

fn shown(windows: &[Window]) -> Table {
    let row = |name: String, [without, with]: [f64; 2]| {
        vec![name, format!("{without:.2}"), format!("{with:.2}"), format!("{:.1}", without / with)]
    };
    let window = |it: &Window| {
        row(format!("{} to {} s", it.from_s, it.from_s + FROZEN_S), it.errors.map(|it| it.rms()))
    };
    let mut rows: Vec<Vec<String>> = windows.iter().map(window).collect();
    let misled = || windows.iter().filter(|it| it.errors[0].rms() > MATTERS_M);
    rows.push(row("all".to_owned(), together(windows.iter())));
    rows.push(row(format!("the {} above {MATTERS_M} m", misled().count()), together(misled())));
    let head = ["wheels frozen", "wheels and gyroscope, m", "in the loop, m", "ratio"];
    Table {
        title: "A recorded rover: wheel odometry frozen for 20 s".to_owned(),
        note: NOTE.to_owned(),
        head: head.map(str::to_owned).into(),
        rows,
    }
}

const NOTE: &str = "\
*Wheels and gyroscope*: an extended Kalman filter that trusts both sensors, as robot_localization does \
(`workshop/shsa-bench/src/navigation/odometry.yaml`). The same filter by filterpy 1.4.5 (`filterpy_ekf.py` in the \
same folder; its head gives the command) computes the same positions: over the 358.9 m of the recording they \
differ by at most 0.084 m, and by 0.0056 m on average. *In the loop*: `models/husky-filter.yaml`, which also has \
accelerometer and satellite fixes. The engine detects frozen wheels after 1 s while they turn, and after 10 s at \
zero, which is longer than any stop of the rover. The filter then excludes the wheels until they are trusted \
again.

The table gives the distance to the position of the same filter without the fault, as the root mean square over \
the 30 s after the onset. While the rover keeps its speed of 1 m/s, the values of frozen wheels are correct, and \
excluding the wheels costs accuracy. When the rover brakes, these values are wrong. The filter in the loop has little \
noise of the speed while the rover keeps its pace, and more in turns and below 0.8 m/s, as the recorded speeds show.";
