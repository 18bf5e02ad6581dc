//! The results as tables.

use super::experiment::Kind;
use super::published;
use super::record::{Record, Search};
use shsa_core::plan::Take;
use shsa_format::text::{self, seconds};

pub(super) const FIRST: [Search; 4] = [
    Search::BestFirst(Take::First),
    Search::PropertyGuided(Take::First),
    Search::Ontology,
    Search::DepthFirst(Take::First),
];

pub(super) const ALL: [Search; 4] = [
    Search::BestFirst(Take::All),
    Search::PropertyGuided(Take::All),
    Search::DepthFirst(Take::All),
    Search::Exhaustive,
];

/// A table with the text that explains it.
pub(super) struct Table {
    pub(super) title: &'static str,
    pub(super) note: &'static str,
    pub(super) head: Vec<&'static str>,
    pub(super) rows: Vec<Vec<String>>,
}

/// All tables for which there are measurements.
pub(super) fn tables(records: &[Record]) -> Vec<Table> {
    let groups = groups(records);
    [
        first(&groups),
        ratios(&groups),
        all(&groups),
        in_parts(&groups),
        public(&groups),
        quality(&groups),
        work(&groups),
        lookups(&groups),
    ]
    .into_iter()
    .filter(|table| !table.rows.is_empty())
    .collect()
}

/// All tables for the terminal.
pub(super) fn text(records: &[Record]) -> String {
    let table = |table: Table| {
        let rows = text::table(&table.head, table.rows);
        format!("{}\n{rows}\n{}\n", table.title, table.note)
    };
    tables(records).into_iter().map(table).collect::<Vec<_>>().join("\n").trim_end().to_owned()
}

/// The measurements of one kind of graph.
pub(super) struct Group<'a> {
    pub(super) kind: Kind,
    pub(super) records: &'a [Record],
}

/// The measurements by kind of graph, in their order.
pub(super) fn groups(records: &[Record]) -> Vec<Group<'_>> {
    let same = |one: &Record, other: &Record| one.case.kind == other.case.kind;
    let group = |records: &'_ [Record]| records.first().map(|first| first.case.kind);
    records.chunk_by(same).filter_map(|records| Some(Group { kind: group(records)?, records })).collect()
}

impl Group<'_> {
    /// The measurements of a search.
    pub(super) fn of(&self, search: Search) -> impl Iterator<Item = &Record> {
        self.records.iter().filter(move |record| record.search == search)
    }

    /// Median and worst time, and how many searches were stopped.
    fn time(&self, search: Search) -> String {
        let times = spread(self.of(search).map(|record| record.seconds), seconds);
        match self.of(search).filter(|record| record.is_limited()).count() {
            0 => times,
            stopped => format!("{times}, {stopped} stopped"),
        }
    }

    fn median(&self, value: impl FnMut(&Record) -> f64) -> String {
        middle(self.of(Search::Visit).map(value)).map_or_else(String::new, |value| format!("{value:.0}"))
    }

    /// For each graph, the number of reachable nodes, and the time of the best answer as a multiple of the time of a visit.
    fn ratios(&self) -> impl Iterator<Item = (usize, f64)> {
        let best = self.of(Search::BestFirst(Take::First));
        best.zip(self.of(Search::Visit)).map(|(best, visit)| (best.reached, best.seconds / visit.seconds))
    }

    /// How many times as long one search takes as another.
    fn gain(&self, one: Search, other: Search) -> String {
        spread(self.of(one).zip(self.of(other)).map(|(one, other)| one.seconds / other.seconds), tenths)
    }

    /// The smallest and the largest number of substitutions; `>` where a limit ended the search.
    fn substitutions(&self) -> String {
        let write =
            |record: &Record| format!("{}{}", if record.is_limited() { "> " } else { "" }, record.found);
        let all = || self.of(Search::BestFirst(Take::All));
        let (least, most) =
            (all().min_by_key(|record| record.found), all().max_by_key(|record| record.found));
        match (least.map(write), most.map(write)) {
            (Some(least), Some(most)) if least != most => format!("{least} to {most}"),
            (least, _) => least.unwrap_or_default(),
        }
    }

    /// How often the first answer is not the best, and its share of the best on average and at worst.
    fn quality(&self, search: Search) -> String {
        let share = |record: &Record| Some(record.utility? / record.best?);
        let shares: Vec<f64> = self.of(search).filter_map(share).collect();
        let below = shares.iter().filter(|&&share| share < 1.0 - 1e-9).count();
        let worst = shares.iter().copied().fold(1.0, f64::min);
        let mean = shares.iter().sum::<f64>() / shares.len() as f64;
        match self.of(search).count() - shares.len() {
            0 => format!("{below} of {}; {mean:.3}, {worst:.3}", shares.len()),
            without if shares.is_empty() => format!("no answer in {without}"),
            without => format!("{below} of {}; {mean:.3}, {worst:.3}; no answer in {without}", shares.len()),
        }
    }

    fn decisions(&self, search: Search) -> String {
        let middle = middle(self.of(search).map(|record| record.expanded as f64));
        let stopped = self.of(search).any(Record::is_limited);
        middle.map_or_else(String::new, |value| {
            format!("{value:.0}{}", if stopped { " (stopped)" } else { "" })
        })
    }

    fn count(&self) -> String {
        self.of(Search::Visit).count().to_string()
    }
}

fn first(groups: &[Group]) -> Table {
    let row = |group: &Group| {
        let [best, guided, ontology, depth] = FIRST.map(|search| group.time(search));
        vec![
            group.kind.to_string(),
            group.count(),
            group.median(|record| record.nodes as f64),
            group.median(|record| record.reached as f64),
            best,
            group.time(Search::Visit),
            spread(group.ratios().map(|(_, ratio)| ratio), tenths),
            guided,
            ontology,
            depth,
        ]
    };
    Table {
        title: "First answer",
        note: "Time until the first answer, median / worst over the graphs. best_first and property_guided prove that this answer is the best. visit only looks once at each \
               node that can be reached without passing a provided variable (reached), over flat arrays. ratio: best_first by visit. These two keep their working memory, including that of the answer, from one run to the next, so they \
               allocate nothing; the other searches start with empty memory each time.",
        head: vec![
            "graph",
            "graphs",
            "nodes",
            "reached",
            "best_first",
            "visit",
            "ratio",
            "property_guided",
            "ontology",
            "depth_first",
        ],
        rows: groups.iter().map(row).collect(),
    }
}

fn ratios(groups: &[Group]) -> Table {
    const STEPS: [usize; 7] = [0, 7, 30, 100, 300, 1_000, usize::MAX];
    let all: Vec<(usize, f64)> = groups.iter().flat_map(Group::ratios).collect();
    let row = |(&low, &high): (&usize, &usize)| {
        let ratios: Vec<f64> = all
            .iter()
            .filter(|(reached, _)| (low..high).contains(reached))
            .map(|(_, ratio)| *ratio)
            .collect();
        let reached =
            if high == usize::MAX { format!("{low} and more") } else { format!("{low} to {}", high - 1) };
        let within = ratios.iter().filter(|&&ratio| ratio <= 5.0).count();
        let cells = || {
            vec![
                reached,
                ratios.len().to_string(),
                spread(ratios.iter().copied(), tenths),
                within.to_string(),
            ]
        };
        (!ratios.is_empty()).then(cells)
    };
    Table {
        title: "The best answer beside a visit",
        note: "The ratio of best_first to visit over all graphs, by how many nodes can be reached: starting a search and returning an answer costs best_first about 50 ns for every graph.",
        head: vec!["reached", "graphs", "ratio", "at most 5"],
        rows: STEPS.iter().zip(STEPS.iter().skip(1)).filter_map(row).collect(),
    }
}

fn all(groups: &[Group]) -> Table {
    let row = |group: &Group| {
        let times = ALL.map(|search| group.time(search));
        let counted = group.of(Search::Exhaustive).count().to_string();
        [group.kind.to_string(), counted, group.substitutions()].into_iter().chain(times).collect()
    };
    Table {
        title: "All answers",
        note: "Time until all substitutions are found and sorted, median / worst over the graphs. \"n stopped\": the limit ended n searches; their times are those until that end.",
        head: vec![
            "graph",
            "graphs",
            "substitutions",
            "best_first",
            "property_guided",
            "depth_first",
            "exhaustive",
        ],
        rows: groups.iter().map(row).collect(),
    }
}

fn in_parts(groups: &[Group]) -> Table {
    let row = |group: &Group| {
        let [best, guided] = [
            (Search::BestFirst(Take::All), Search::BestFirstInParts),
            (Search::PropertyGuided(Take::All), Search::PropertyGuidedInParts),
        ]
        .map(|(one, several)| [group.time(one), group.time(several), group.gain(one, several)]);
        let head = [
            group.kind.to_string(),
            group.of(Search::BestFirstInParts).count().to_string(),
            group.substitutions(),
        ];
        let measured = group.of(Search::BestFirstInParts).next().is_some();
        measured.then(|| head.into_iter().chain(best).chain(guided).collect())
    };
    Table {
        title: "All answers, on several threads",
        note: "As \"All answers\", with each search dealt out to as many parts as there are threads (--threads); gain: the time of one thread by that of several.",
        head: vec![
            "graph",
            "graphs",
            "substitutions",
            "best_first",
            "in parts",
            "gain",
            "property_guided",
            "in parts",
            "gain",
        ],
        rows: groups.iter().filter_map(row).collect(),
    }
}

fn public(groups: &[Group]) -> Table {
    let row = |group: &Group| {
        let ours =
            |search| middle(group.of(search).map(|record| record.seconds)).map(seconds).unwrap_or_default();
        let stopped = |search| group.of(search).any(Record::is_limited);
        let all = |search| if stopped(search) { "stopped".to_owned() } else { ours(search) };
        let public = published::of(group.kind)?;
        let cells = [
            ours(Search::BestFirst(Take::First)),
            public.property_guided.to_owned(),
            ours(Search::Ontology),
            public.ontology.to_owned(),
            all(Search::BestFirst(Take::All)),
            public.property_guided_all.to_owned(),
            all(Search::DepthFirst(Take::All)),
            public.depth_first_all.to_owned(),
        ];
        Some([group.kind.to_string()].into_iter().chain(cells).collect())
    };
    Table {
        title: "Beside the public programs",
        note: "Medians; those of the public programs are from an earlier run. \"stopped\": the limit ended the search in some graphs.",
        head: vec![
            "graph",
            "best_first",
            "public SH-PGSA",
            "ontology",
            "public ORR",
            "best_first, all",
            "public SH-PGSA, all",
            "depth_first, all",
            "public DFS, all",
        ],
        rows: groups.iter().filter_map(row).collect(),
    }
}

fn quality(groups: &[Group]) -> Table {
    let row = |group: &Group| {
        let shares = FIRST.map(|search| group.quality(search));
        let public = published::quality(group.kind).map(str::to_owned);
        [group.kind.to_string()].into_iter().chain(shares).chain(public).collect()
    };
    Table {
        title: "Quality of the first answer",
        note: "The number of graphs in which the first answer has a lower utility than the best answer of any \
               search, and the ratio of these utilities, mean and worst. Public programs: for 60 other graphs of \
               the kind.",
        head: vec![
            "graph",
            "best_first",
            "property_guided",
            "ontology",
            "depth_first",
            "public SH-PGSA",
            "public ORR",
        ],
        rows: groups.iter().map(row).collect(),
    }
}

fn work(groups: &[Group]) -> Table {
    let row = |group: &Group| {
        let first = FIRST.map(|search| group.decisions(search));
        let all = ALL.map(|search| group.decisions(search));
        [group.kind.to_string()].into_iter().chain(first).chain(all).collect()
    };
    Table {
        title: "Decisions",
        note: "The number of decisions of the searches, median over the graphs; \"stopped\": the limit ended some searches.",
        head: vec![
            "graph",
            "best_first",
            "property_guided",
            "ontology",
            "depth_first",
            "best_first, all",
            "property_guided, all",
            "depth_first, all",
            "exhaustive",
        ],
        rows: groups.iter().map(row).collect(),
    }
}

fn lookups(groups: &[Group]) -> Table {
    let row = |group: &Group| {
        let count = group.of(Search::Table).count();
        (count > 0).then(|| vec![group.kind.to_string(), count.to_string(), group.time(Search::Table)])
    };
    Table {
        title: "A plan from the contingency table",
        note: "After the loss of each signal that matters, median / worst over the signals.",
        head: vec!["model", "losses", "time"],
        rows: groups.iter().filter_map(row).collect(),
    }
}

fn tenths(value: f64) -> String {
    format!("{value:.1}")
}

/// Median and worst, or the only value.
fn spread(values: impl Iterator<Item = f64>, write: impl Fn(f64) -> String) -> String {
    let values: Vec<f64> = values.collect();
    let worst = values.iter().copied().fold(0.0, f64::max);
    match middle(values.iter().copied()) {
        None => String::new(),
        Some(_) if values.len() == 1 => write(worst),
        Some(middle) => format!("{} / {}", write(middle), write(worst)),
    }
}

/// The median; the upper one of two.
pub(super) fn middle(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spread_is_the_median_and_the_worst() {
        let spread = |values: &[f64]| spread(values.iter().copied(), |value| value.to_string());
        assert_eq!([spread(&[]), spread(&[3.0]), spread(&[5.0, 1.0, 2.0])], ["", "3", "2 / 5"]);
    }
}
