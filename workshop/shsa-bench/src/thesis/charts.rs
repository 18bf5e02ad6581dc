//! The results as plots, beside the times of the public programs.

use super::experiment::Experiment;
use super::published::{self, Published};
use super::record::{Record, Search};
use super::report::{ALL, FIRST, Group, groups, middle};
use shsa_drawing::{Axis, Chart, Point, Scale, Series};

/// The plots with the names of their files.
pub(super) fn charts(records: &[Record]) -> Vec<(String, Chart)> {
    let groups = groups(records);
    let mut visited = FIRST.to_vec();
    visited.push(Search::Visit);
    let first: [Public; 2] =
        [("public SH-PGSA", |times| times.property_guided), ("public ORR", |times| times.ontology)];
    let all: [Public; 2] = [
        ("public SH-PGSA", |times| times.property_guided_all),
        ("public DFS", |times| times.depth_first_all),
    ];
    [("first", "First answer in ex2", &visited[..], first), ("all", "All answers in ex2", &ALL[..], all)]
        .into_iter()
        .map(|(name, title, searches, public)| {
            (format!("experiments-{name}.svg"), chart(&groups, title, searches, &public))
        })
        .filter(|(_, chart)| chart.series.iter().any(|series| !series.points.is_empty()))
        .collect()
}

/// A program of the thesis, and which of its times is shown.
type Public = (&'static str, fn(&Published) -> &'static str);

fn chart(groups: &[Group], title: &str, searches: &[Search], public: &[Public]) -> Chart {
    let axis = |label: &str, unit: &str| Axis { label: label.into(), unit: unit.into(), scale: Scale::Log };
    let ex2 = || groups.iter().filter(|group| group.kind.experiment == Experiment::Ex2);
    let series = searches.iter().map(|&search| Series {
        name: search.name().to_owned(),
        points: ex2().filter_map(|group| point(group, search)).collect(),
    });
    let published = public.iter().map(|(name, time)| Series {
        name: (*name).to_owned(),
        points: ex2().filter_map(|group| published_point(group, *time)).collect(),
    });
    Chart {
        title: title.to_owned(),
        x: axis("variables and relations of the tree", ""),
        y: axis("time", "s"),
        series: series.chain(published).filter(|series| !series.points.is_empty()).collect(),
    }
}

/// The median time of a public program over its own graphs of the same size.
fn published_point(group: &Group, time: fn(&Published) -> &'static str) -> Option<Point> {
    let y = published::seconds(time(published::of(group.kind)?))?;
    Some(Point { x: group.records.first()?.nodes as f64, low: y, y, high: y })
}

/// The times of a search, if it was never stopped.
fn point(group: &Group, search: Search) -> Option<Point> {
    let seconds = || group.of(search).map(|record| record.seconds);
    let x = group.of(search).next()?.nodes as f64;
    let (low, high) = (seconds().fold(f64::INFINITY, f64::min), seconds().fold(0.0, f64::max));
    let stopped = group.of(search).any(Record::is_limited);
    (!stopped).then_some(Point { x, low, y: middle(seconds())?, high })
}
