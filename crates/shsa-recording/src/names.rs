//! Finds a column, a topic or a field by a name that is nearly right.

use super::stamp::split_unit;

/// How a name fits the headers of a table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Fit {
    /// One column.
    Column(usize),
    /// Several columns fit equally well.
    Several(Vec<usize>),
    /// No column fits.
    Nothing,
}

/// The column with a name: the full header, else the header without its unit, else in any letter case.
///
/// A name with a unit never fits a column of another unit.
pub(super) fn column_of(headers: &[String], name: &str) -> Fit {
    let name = name.trim();
    let small = name.to_lowercase();
    let ways: [&dyn Fn(&str) -> bool; 4] = [
        &|header| header.trim() == name,
        &|header| split_unit(header).0 == name,
        &|header| header.trim().to_lowercase() == small,
        &|header| split_unit(header).0.to_lowercase() == small,
    ];
    let fits = |way: &&dyn Fn(&str) -> bool| -> Vec<usize> {
        headers.iter().enumerate().filter(|(_, header)| way(header)).map(|(index, _)| index).collect()
    };
    let found = ways.iter().map(fits).find(|columns| !columns.is_empty()).unwrap_or_default();
    match found.as_slice() {
        [] => Fit::Nothing,
        [column] => Fit::Column(*column),
        _ => Fit::Several(found),
    }
}

/// A topic's name without its leading slash, which not all tools write.
pub(super) fn bare(topic: &str) -> &str {
    topic.strip_prefix('/').unwrap_or(topic)
}

/// `; did you mean 'x'?` for the nearest name, or nothing when none is near, and a list of the known names.
pub(super) fn hint<'a>(name: &str, known: impl Iterator<Item = &'a str> + Clone) -> String {
    let nearest = known.clone().min_by_key(|other| distance(name, other));
    let near = nearest.filter(|other| distance(name, other) <= name.chars().count() / 2);
    let meant = near.map_or(String::new(), |other| format!("; did you mean '{}'?", other.trim()));
    let mut listed: Vec<&str> = known.clone().take(40).map(str::trim).collect();
    if known.count() > listed.len() {
        listed.push("...");
    }
    if listed.is_empty() { meant } else { format!("{meant} (there is: {})", listed.join(", ")) }
}

/// Insertions, deletions and replacements between two names, letter case and units apart. `O(n m)`.
fn distance(a: &str, b: &str) -> usize {
    let letters =
        |text: &str| -> Vec<char> { bare(split_unit(text).0).to_lowercase().chars().take(200).collect() };
    let (a, b) = (letters(a), letters(b));
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, left) in a.iter().enumerate() {
        let mut diagonal = i;
        let mut before = i + 1;
        for (cell, right) in row.iter_mut().skip(1).zip(&b) {
            let replaced = diagonal + usize::from(left != right);
            diagonal = *cell;
            before = replaced.min(*cell + 1).min(before + 1);
            *cell = before;
        }
        if let Some(first) = row.first_mut() {
            *first = i + 1;
        }
    }
    row.last().copied().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_found_in_full_first() {
        #[track_caller]
        fn check(headers: &[&str], name: &str, expected: Fit) {
            let headers: Vec<String> = headers.iter().map(|header| (*header).to_owned()).collect();
            assert_eq!(column_of(&headers, name), expected);
        }
        check(&["t [s]", "wheel_1 [m/s]"], "wheel_1", Fit::Column(1));
        check(&["t [s]", "wheel_1 [m/s]"], "wheel_1 [m/s]", Fit::Column(1));
        check(&["t [s]", "wheel_1 [m/s]"], "wheel_1 [km/h]", Fit::Nothing);
        check(&[" xSpeed(m/s)"], "xspeed", Fit::Column(0));
        check(&["v", "V", "v [m/s]"], "v", Fit::Column(0));
        check(&["v [m/s]", "v [km/h]"], "v", Fit::Several(vec![0, 1]));
        check(&["Loop", "Loop"], "Loop", Fit::Several(vec![0, 1]));
        check(&["(m/s)"], "", Fit::Nothing);
    }

    #[test]
    fn the_nearest_name_is_offered() {
        assert_eq!(distance("kitten", "sitting"), 3);
        assert_eq!(distance("wheel_1", "Wheel_1 [m/s]"), 0);
        let known = ["speed [m/s]", "height"];
        let said = hint("sped", known.into_iter());
        assert_eq!(said, "; did you mean 'speed [m/s]'? (there is: speed [m/s], height)");
        assert_eq!(hint("zzz", known.into_iter()), " (there is: speed [m/s], height)");
        assert_eq!(hint("zzz", [].into_iter()), "");
    }
}
