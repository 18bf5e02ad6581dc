//! The assignment of least cost: the Hungarian method by shortest augmenting paths.

/// What a pair costs that is impossible, or that makes the matrix square.
const NONE: f64 = 1e9;

/// Assigns rows to columns, each at most once, so that first as many as possible are assigned, and then the sum of their costs is
/// least. `cost(row, column)` is `None` where a pair is impossible, else below 1e6. Returns the column of each row.
///
/// Complexity: O(n^3) for n rows and columns. Source: H. W. Kuhn 1955, DOI 10.1002/nav.3800020109; by potentials and shortest augmenting
/// paths as R. Jonker and A. Volgenant 1987, DOI 10.1007/BF02278710. A dependency for it would be larger than it is.
///
/// # Example
/// ```
/// use shsa_estimate::association::assign;
///
/// let costs = [[Some(1.0), Some(2.0)], [Some(1.5), None]];
/// assert_eq!(assign(2, 2, |row, column| costs[row][column]), [Some(1), Some(0)]);
/// ```
#[must_use]
pub fn assign(rows: usize, columns: usize, cost: impl Fn(usize, usize) -> Option<f64>) -> Vec<Option<usize>> {
    let size = rows.max(columns);
    let price = |row: usize, column: usize| {
        let is_real = row < rows && column < columns;
        if is_real { cost(row, column) } else { None }.unwrap_or(NONE)
    };
    let mut of_rows = vec![0.0; size];
    let mut all = vec![Column::default(); size];
    for row in 0..size {
        let end = shortest(row, &mut all, &mut of_rows, price);
        flip(row, end, &mut all);
    }
    let mut assigned = vec![None; rows];
    for (column, row) in all.iter().enumerate().filter_map(|(column, it)| Some((column, it.row?))) {
        if let Some(place) = assigned.get_mut(row).filter(|_| price(row, column) < NONE) {
            *place = Some(column);
        }
    }
    assigned
}

/// A column, with what the search for a path knows of it.
#[derive(Clone, Copy, Debug, Default)]
struct Column {
    /// The row that it is assigned to.
    row: Option<usize>,
    potential: f64,
    /// What the path to it costs more than those that are done.
    slack: f64,
    /// The column before it on the path; `None` where the path begins.
    before: Option<usize>,
    is_done: bool,
}

/// The end of the shortest augmenting path from a row, a free column; changes the potentials.
fn shortest(
    start: usize,
    columns: &mut [Column],
    of_rows: &mut [f64],
    price: impl Fn(usize, usize) -> f64,
) -> usize {
    for column in columns.iter_mut() {
        (column.slack, column.before, column.is_done) = (f64::INFINITY, None, false);
    }
    let (mut row, mut from) = (start, None);
    loop {
        let own = of_rows.get(row).copied().unwrap_or(0.0);
        for (at, column) in columns.iter_mut().enumerate().filter(|(_, column)| !column.is_done) {
            let reduced = price(row, at) - own - column.potential;
            if reduced < column.slack {
                (column.slack, column.before) = (reduced, from);
            }
        }
        let open = columns.iter().enumerate().filter(|(_, column)| !column.is_done);
        let Some((next, step)) =
            open.map(|(at, column)| (at, column.slack)).min_by(|one, other| one.1.total_cmp(&other.1))
        else {
            // There are as many columns as rows: one is free.
            return 0;
        };
        lower(start, columns, of_rows, step);
        let Some(column) = columns.get_mut(next) else { return 0 };
        column.is_done = true;
        match column.row {
            Some(other) => (row, from) = (other, Some(next)),
            None => return next,
        }
    }
}

/// Changes the potentials by the step to the next column.
fn lower(start: usize, columns: &mut [Column], of_rows: &mut [f64], step: f64) {
    let mut raise = |row: usize| {
        if let Some(potential) = of_rows.get_mut(row) {
            *potential += step;
        }
    };
    raise(start);
    for column in columns {
        if column.is_done {
            column.potential -= step;
            column.row.into_iter().for_each(&mut raise);
        } else {
            column.slack -= step;
        }
    }
}

/// Assigns the columns along the path anew.
fn flip(start: usize, end: usize, columns: &mut [Column]) {
    let mut at = end;
    while let Some(before) = columns.get(at).and_then(|column| column.before) {
        let row = columns.get(before).and_then(|column| column.row);
        if let Some(column) = columns.get_mut(at) {
            column.row = row;
        }
        at = before;
    }
    if let Some(column) = columns.get_mut(at) {
        column.row = Some(start);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// How many are assigned, and the negative sum of their costs, by the best of all assignments.
    fn best(costs: &[Vec<Option<f64>>], free: &[usize]) -> (usize, f64) {
        let Some((prices, rest)) = costs.split_first() else { return (0, 0.0) };
        let without = best(rest, free);
        let with = free.iter().filter_map(|&column| {
            let price = prices[column]?;
            let others: Vec<usize> = free.iter().copied().filter(|&other| other != column).collect();
            let (count, sum) = best(rest, &others);
            Some((count + 1, sum - price))
        });
        with.fold(without, |best, here| if here > best { here } else { best })
    }

    proptest! {
        #[test]
        fn it_is_as_good_as_the_best_of_all_assignments(
            rows in 0..5_usize,
            columns in 0..5_usize,
            prices in prop::collection::vec(prop::option::weighted(0.7, 0.0..20.0), 25),
        ) {
            let costs: Vec<Vec<Option<f64>>> = prices.chunks(5).take(rows).map(|row| row[..columns].to_vec()).collect();
            let assigned = assign(rows, columns, |row, column| costs[row][column]);
            let pairs: Vec<(usize, usize)> =
                assigned.iter().enumerate().filter_map(|(row, column)| Some((row, (*column)?))).collect();
            let used: std::collections::BTreeSet<usize> = pairs.iter().map(|pair| pair.1).collect();
            prop_assert_eq!(used.len(), pairs.len());
            let sum: f64 = pairs.iter().map(|&(row, column)| costs[row][column].unwrap()).sum();
            let (count, best_sum) = best(&costs, &(0..columns).collect::<Vec<_>>());
            prop_assert!(pairs.len() == count && (sum + best_sum).abs() < 1e-6, "{:?}: {:?}", costs, assigned);
        }
    }
}
