//! The assignment of least cost: the Hungarian method by shortest augmenting paths.

/// Assigns rows to columns, each at most once, so that first as many as possible are assigned, and then the sum of their costs is
/// least. `cost(row, column)` is `None` where a pair is impossible, else below 1e6. Returns the column of each row.
///
/// Complexity: O(n^3) for n rows and columns. Source: H. W. Kuhn 1955, DOI 10.1002/nav.3800020109; by potentials and shortest augmenting
/// paths as R. Jonker and A. Volgenant 1987, DOI 10.1007/BF02278710. A dependency for it would be larger than it is.
///
/// # Example
/// ```
/// use shsa_demo::radars::assign;
///
/// let costs = [[Some(1.0), Some(2.0)], [Some(1.5), None]];
/// assert_eq!(assign(2, 2, |row, column| costs[row][column]), [Some(1), Some(0)]);
/// ```
#[must_use]
pub fn assign(rows: usize, columns: usize, cost: impl Fn(usize, usize) -> Option<f64>) -> Vec<Option<usize>> {
    /// What a pair costs that is impossible, or that makes the matrix square.
    const NONE: f64 = 1e9;
    let size = rows.max(columns);
    let price = |row: usize, column: usize| {
        let is_real = row < rows && column < columns;
        if is_real { cost(row, column) } else { None }.unwrap_or(NONE)
    };
    let (mut of_rows, mut of_columns) = (vec![0.0; size], vec![0.0; size]);
    let mut taken: Vec<Option<usize>> = vec![None; size];
    for row in 0..size {
        let path = shortest(row, &taken, &mut of_rows, &mut of_columns, price);
        flip(row, &mut taken, &path);
    }
    let mut assigned = vec![None; rows];
    for (column, row) in taken.into_iter().enumerate() {
        if let Some(row) = row.filter(|&row| price(row, column) < NONE)
            && let Some(place) = assigned.get_mut(row)
        {
            *place = Some(column);
        }
    }
    assigned
}

/// A path from a row to a free column.
struct Path {
    end: usize,
    /// The column before each column; `None` where the row itself is before it.
    before: Vec<Option<usize>>,
}

/// The shortest augmenting path from a row, and new potentials.
fn shortest(
    start: usize,
    taken: &[Option<usize>],
    of_rows: &mut [f64],
    of_columns: &mut [f64],
    price: impl Fn(usize, usize) -> f64,
) -> Path {
    let size = taken.len();
    let (mut slack, mut before, mut done) = (vec![f64::INFINITY; size], vec![None; size], vec![false; size]);
    let (mut row, mut from) = (start, None);
    loop {
        for column in (0..size).filter(|&column| !done[column]) {
            let reduced = price(row, column) - of_rows[row] - of_columns[column];
            if reduced < slack[column] {
                (slack[column], before[column]) = (reduced, from);
            }
        }
        let open = (0..size).filter(|&column| !done[column]);
        let Some(next) = open.min_by(|&one, &other| slack[one].total_cmp(&slack[other])) else {
            // There are as many columns as rows: one is free.
            return Path { end: 0, before };
        };
        let step = slack[next];
        of_rows[start] += step;
        for column in 0..size {
            if done[column] {
                of_columns[column] -= step;
                if let Some(row) = taken[column] {
                    of_rows[row] += step;
                }
            } else {
                slack[column] -= step;
            }
        }
        done[next] = true;
        match taken[next] {
            Some(other) => (row, from) = (other, Some(next)),
            None => return Path { end: next, before },
        }
    }
}

/// Takes the columns along the path.
fn flip(start: usize, taken: &mut [Option<usize>], path: &Path) {
    let mut column = path.end;
    while let Some(before) = path.before[column] {
        taken[column] = taken[before];
        column = before;
    }
    taken[column] = Some(start);
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// How many are assigned, and the negative sum of their costs, over all assignments.
    fn best(costs: &[Vec<Option<f64>>], row: usize, free: &[usize]) -> (usize, f64) {
        let Some(prices) = costs.get(row) else { return (0, 0.0) };
        let mut best_so_far = best(costs, row + 1, free);
        for &column in free {
            let Some(price) = prices[column] else { continue };
            let rest: Vec<usize> = free.iter().copied().filter(|&other| other != column).collect();
            let (count, sum) = best(costs, row + 1, &rest);
            let here = (count + 1, sum - price);
            if here > best_so_far {
                best_so_far = here;
            }
        }
        best_so_far
    }

    #[test]
    fn it_is_as_good_as_the_best_of_all_assignments() {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        for _ in 0..300 {
            let (rows, columns) = (random.random_range(0..5), random.random_range(0..5));
            let mut price = || random.random_bool(0.7).then(|| random.random_range(0.0..20.0));
            let costs: Vec<Vec<Option<f64>>> =
                (0..rows).map(|_| (0..columns).map(|_| price()).collect()).collect();
            let assigned = assign(rows, columns, |row, column| costs[row][column]);
            let pairs: Vec<(usize, usize)> = assigned
                .iter()
                .enumerate()
                .filter_map(|(row, column)| column.map(|column| (row, column)))
                .collect();
            let columns_used: std::collections::BTreeSet<usize> = pairs.iter().map(|pair| pair.1).collect();
            assert_eq!(columns_used.len(), pairs.len());
            let sum: f64 = pairs.iter().map(|&(row, column)| costs[row][column].unwrap()).sum();
            let (count, best_sum) = best(&costs, 0, &(0..columns).collect::<Vec<_>>());
            assert!(pairs.len() == count && (sum + best_sum).abs() < 1e-6, "{costs:?}: {assigned:?}");
        }
    }
}
