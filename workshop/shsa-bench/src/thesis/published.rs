//! The times of the thesis's public programs.
//!
//! github.com/dratasich/shsa, run with Python 3.11 and networkx 3.6 (`python -O`) on two shared cores, on graphs of its own
//! generators. The times do not include making the graph. CPU time, or for short searches the smallest wall time of ten. Medians
//! over 1 to 11 graphs; a search was stopped after 60 s.

use super::experiment::{Experiment, Kind};

/// Median times of the public programs over graphs of one kind.
pub(super) struct Published {
    experiment: Experiment,
    size: Option<(usize, usize)>,
    /// The first answer of SH-PGSA.
    pub(super) property_guided: &'static str,
    /// The answer of ORR.
    pub(super) ontology: &'static str,
    /// All answers of SH-PGSA.
    pub(super) property_guided_all: &'static str,
    /// All answers, depth first.
    pub(super) depth_first_all: &'static str,
}

/// The times for a kind of graph, if it was measured.
pub(super) fn of(kind: Kind) -> Option<&'static Published> {
    PUBLISHED.iter().find(|published| published.experiment == kind.experiment && published.size == kind.size)
}

/// The number of seconds of a time as written here; `None` for a search that was stopped, or not run.
pub(super) fn seconds(text: &str) -> Option<f64> {
    let (number, unit) = text.split_once(' ')?;
    let factor = match unit {
        "s" => 1.0,
        "ms" => 1e-3,
        "us" => 1e-6,
        _ => return None,
    };
    Some(number.parse::<f64>().ok()? * factor)
}

const fn tree(
    experiment: Experiment,
    size: (usize, usize),
    [property_guided, property_guided_all, ontology, depth_first_all]: [&'static str; 4],
) -> Published {
    Published {
        experiment,
        size: Some(size),
        property_guided,
        ontology,
        property_guided_all,
        depth_first_all,
    }
}

const PUBLISHED: [Published; 26] = [
    tree(Experiment::Ex1, (2, 2), ["58 us", "91 us", "20 us", "74 us"]),
    tree(Experiment::Ex1, (2, 4), ["168 us", "583 us", "55 us", "1.1 ms"]),
    tree(Experiment::Ex1, (2, 6), ["1 ms", "18 ms", "183 us", "21 ms"]),
    tree(Experiment::Ex1, (2, 8), ["398 ms", "10.4 s", "668 us", "8.7 s"]),
    tree(Experiment::Ex1, (2, 10), ["> 60 s", "", "2.5 ms", ""]),
    tree(Experiment::Ex2, (2, 2), ["50 us", "79 us", "19 us", "73 us"]),
    tree(Experiment::Ex2, (2, 4), ["113 us", "238 us", "52 us", "384 us"]),
    tree(Experiment::Ex2, (2, 6), ["175 us", "1 ms", "167 us", "1.9 ms"]),
    tree(Experiment::Ex2, (2, 8), ["173 us", "6.5 ms", "629 us", "9.2 ms"]),
    tree(Experiment::Ex2, (2, 10), ["584 us", "239 ms", "2.5 ms", "232 ms"]),
    tree(Experiment::Ex2, (2, 12), ["545 us", "851 ms", "19 ms", "760 ms"]),
    tree(Experiment::Ex2, (2, 14), ["4.4 ms", "8.8 s", "82 ms", "11.6 s"]),
    tree(Experiment::Ex2, (2, 16), ["30 ms", "> 60 s", "168 ms", "> 60 s"]),
    tree(Experiment::Ex2, (2, 18), ["121 ms", "> 60 s", "681 ms", "> 60 s"]),
    tree(Experiment::Ex3, (1, 6), ["35 us", "37 us", "17 us", "32 us"]),
    tree(Experiment::Ex3, (2, 6), ["171 us", "1.1 ms", "170 us", "1.9 ms"]),
    tree(Experiment::Ex3, (3, 6), ["514 us", "136 ms", "1.4 ms", "131 ms"]),
    tree(Experiment::Ex3, (4, 6), ["254 ms", "> 60 s", "12 ms", "> 60 s"]),
    tree(Experiment::Ex3c, (2, 6), ["132 us", "1.1 ms", "169 us", "1.9 ms"]),
    tree(Experiment::Ex4, (1, 8), ["51 us", "50 us", "22 us", "89 us"]),
    tree(Experiment::Ex4, (2, 8), ["68 us", "105 us", "76 us", "164 us"]),
    tree(Experiment::Ex4, (3, 8), ["102 us", "515 us", "356 us", "1.3 ms"]),
    tree(Experiment::Ex4, (4, 8), ["193 us", "123 ms", "2.9 ms", "160 ms"]),
    tree(Experiment::Ex4, (5, 8), ["93 us", "> 60 s", "17 ms", "> 60 s"]),
    tree(Experiment::Ex4, (6, 8), ["121 us", "> 60 s", "42 ms", "> 60 s"]),
    Published {
        experiment: Experiment::Drivetrain,
        size: None,
        property_guided: "104 us",
        ontology: "50 us",
        property_guided_all: "158 us",
        depth_first_all: "341 us",
    },
];

/// In how many of 60 graphs of a kind the first answers of SH-PGSA and of ORR are below the best; their share of the best,
/// mean and worst.
pub(super) fn quality(kind: Kind) -> [&'static str; 2] {
    let known = QUALITY
        .iter()
        .find(|(experiment, size, _)| *experiment == kind.experiment && Some(*size) == kind.size);
    known.map_or(["", ""], |(.., shares)| *shares)
}

const QUALITY: [(Experiment, (usize, usize), [&str; 2]); 9] = [
    (Experiment::Ex2, (2, 6), ["20 of 60; 0.952, 0.755", "30 of 60; 0.881, 0.501"]),
    (Experiment::Ex2, (2, 8), ["25 of 60; 0.919, 0.647", "37 of 60; 0.805, 0.418"]),
    (Experiment::Ex2, (2, 10), ["33 of 60; 0.886, 0.554", "42 of 60; 0.752, 0.226"]),
    (Experiment::Ex2, (2, 12), ["40 of 60; 0.835, 0.475", "46 of 60; 0.678, 0.146"]),
    (Experiment::Ex3, (3, 6), ["19 of 60; 0.953, 0.694", "53 of 60; 0.648, 0.233"]),
    (Experiment::Ex3c, (2, 6), ["28 of 60; 0.917, 0.513", "44 of 60; 0.677, 0.080"]),
    (Experiment::Ex3c, (3, 6), ["34 of 60; 0.887, 0.492", "57 of 60; 0.323, 0.009"]),
    (Experiment::Ex4, (3, 8), ["15 of 60; 0.970, 0.634", "39 of 60; 0.777, 0.233"]),
    (Experiment::Ex4, (4, 8), ["15 of 60; 0.965, 0.646", "51 of 60; 0.630, 0.130"]),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_read_and_searches_that_were_stopped_have_none() {
        assert_eq!(
            ["58 us", "1.1 ms", "8.7 s"].map(seconds),
            [Some(58.0 * 1e-6), Some(1.1 * 1e-3), Some(8.7)]
        );
        assert_eq!(["> 60 s", ""].map(seconds), [None, None]);
    }
}
