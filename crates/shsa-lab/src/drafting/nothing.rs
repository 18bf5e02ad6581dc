//! Why nothing in a recording can be a signal, for the one who has to choose another recording or option.

use super::{Columns, Drafted, Facts, Role};

/// The most reasons that are told.
const MOST: usize = 4;

/// Why a draft has no signal: the reasons for all fields, the most frequent first, each with the first field that it holds for.
#[must_use]
pub fn why_nothing(read: &Columns, drafted: &Drafted) -> String {
    let mut reasons: Vec<(String, usize, &str)> = Vec::new();
    let mut count = |reason: String, source| match reasons.iter_mut().find(|it| it.0 == reason) {
        Some(known) => known.1 += 1,
        None => reasons.push((reason, 1, source)),
    };
    for ((role, facts), about) in drafted.roles.iter().zip(&drafted.facts).zip(&read.about) {
        of_role(role, facts.as_ref()).into_iter().for_each(|it| count(it.to_owned(), &about.source));
    }
    read.left_out.iter().for_each(|(source, reason)| count(reason.clone(), source));
    reasons.sort_by_key(|(_, count, _)| std::cmp::Reverse(*count));
    let told = reasons.iter().take(MOST).map(|(reason, fields, source)| match fields {
        1 => format!("{source}: {reason}"),
        _ => format!("{source} and {} more: {reason}", fields - 1),
    });
    let told: Vec<String> = told.collect();
    let told = match told.is_empty() {
        true => "no value in it has a time".to_owned(),
        false => told.join("; "),
    };
    format!("nothing in the recording can be a signal: {told}")
}

/// Why a column of a role is no signal of its own; `None` for one that is.
fn of_role(role: &Role, facts: Option<&Facts>) -> Option<&'static str> {
    match (role, facts) {
        (Role::Constant, None) => Some("fewer than two values"),
        (Role::Constant, _) => Some("it never changes"),
        (Role::Untimed, _) => Some("its times do not advance"),
        (Role::Clock, _) => Some("it grows evenly with time: a clock or a counter"),
        (Role::Copy(_) | Role::RunningMaximum(_), _) => Some("it is computed from another one"),
        (Role::Signal, _) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drafting::{Series, draft};

    #[test]
    fn each_reason_is_told_with_the_number_of_its_fields() {
        type Value = fn(f64) -> f64;
        let kinds: [(&str, Value, &str); 3] = [
            ("flat", |_| 3.0, "it never changes"),
            ("missing", |_| f64::NAN, "fewer than two values"),
            ("clock", |time| 5.0 + time, "it grows evenly with time: a clock or a counter"),
        ];
        for mask in 0..27_usize {
            let counts = [mask % 3, mask / 3 % 3, mask / 9];
            let series = kinds.iter().zip(counts).flat_map(|((name, value, _), count)| {
                (0..count).map(move |at| Series {
                    topic: "one".to_owned(),
                    path: format!("{name}{at}"),
                    source: format!("one#{name}{at}"),
                    points: (0..200).map(f64::from).map(|time| (time, value(time))).collect(),
                })
            });
            let read = Columns::of_series(series.collect());
            let drafted = draft(&read.columns, &[], &()).unwrap();
            let text = why_nothing(&read, &drafted);
            for ((name, _, reason), count) in kinds.iter().zip(counts) {
                let expected = match count {
                    0 => String::new(),
                    1 => format!("one#{name}0: {reason}"),
                    _ => format!("one#{name}0 and 1 more: {reason}"),
                };
                assert!(text.contains(&expected), "{text}");
                assert_eq!(count > 0, text.contains(reason), "{text}");
            }
            assert_eq!(mask == 0, text.ends_with("no value in it has a time"), "{text}");
        }
    }
}
