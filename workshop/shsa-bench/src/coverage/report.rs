//! What came of the recordings: as JSON, and as tables.

use super::lying::{Form, Lied};
use super::recorded::Recorded;
use super::witness::Covered;
use crate::table::Table;
use crate::voter::{Errors, MOST, SHARES};
use serde_json::{Value, json};
use shsa_core::engine::Quality;

/// The largest share of good values that a witness may exclude.
const MOST_EXCLUDED: f64 = 0.001;

/// The numbers of a recorded system.
#[derive(Clone, Debug)]
pub(super) struct Found {
    name: &'static str,
    refused: Option<String>,
    covered: Vec<Covered>,
    lied: Vec<Lied>,
}

impl Found {
    pub(super) fn new(recorded: &Recorded, covered: Vec<Covered>, lied: Vec<Lied>) -> Found {
        Found { name: recorded.name, refused: recorded.refused.clone(), covered, lied }
    }
}

impl Covered {
    fn share(&self) -> f64 {
        self.excluded as f64 / self.compared.max(1) as f64
    }

    fn is_right(&self) -> bool {
        self.share() <= MOST_EXCLUDED
    }

    fn quality(&self) -> &'static str {
        if self.quality == Quality::Good { "good" } else { "substitute" }
    }

    fn json(&self) -> Value {
        json!({
            "recording": self.recording, "need": self.need, "witness": self.witness, "quality": self.quality(), "values": self.values,
            "compared": self.compared, "excluded": self.excluded, "furthest": self.furthest, "unit": self.unit,
        })
    }

    fn cells(&self) -> Vec<String> {
        vec![
            self.recording.to_owned(),
            format!("`{}`", self.need),
            self.witness.clone(),
            self.quality().to_owned(),
            self.values.to_string(),
            self.compared.to_string(),
            self.excluded.to_string(),
            format!("{:.2} %", 100.0 * self.share()),
            if self.excluded > 0 { format!("{:.3} {}", self.furthest, self.unit) } else { "-".to_owned() },
        ]
    }
}

impl Lied {
    fn json(&self) -> Value {
        let (need, median) = self.errors.roots();
        json!({
            "recording": self.recording, "need": self.need, "liar": self.liar, "is_source": self.is_source, "form": self.form.name(),
            "share": self.share, "served": self.errors.served(), "error": need, "median": median, "far_off": self.far_off,
        })
    }
}

/// Whether all of it is as it must be.
pub(super) fn is_right(all: &[Found]) -> bool {
    let lied = || all.iter().flat_map(|it| &it.lied);
    all.iter().flat_map(|it| &it.covered).all(Covered::is_right)
        && sum(lied()).is_right()
        && lied().all(|it| it.far_off == 0)
}

/// A line for each row.
pub(super) fn lines(all: &[Found]) -> String {
    let covered = all.iter().flat_map(|it| &it.covered).map(|it| it.json().to_string());
    let lied = all.iter().flat_map(|it| &it.lied).map(|it| it.json().to_string());
    covered.chain(lied).collect::<Vec<_>>().join("\n")
}

/// Both tables.
pub(super) fn tables(all: &[Found]) -> [Table; 2] {
    [covered(all), lied(all)]
}

fn covered(all: &[Found]) -> Table {
    let refused = all.iter().filter_map(|it| {
        Some(format!("\n\n`{}` keeps the numbers of its model: {}.", it.name, it.refused.as_ref()?))
    });
    let note = format!(
        "Each witness is left out of the model of the run, with all that is derived from the same signals. Its own error is that which calibration \
         gives it. Values are compared as the monitor compares two ways: at the moments of the slower one, means with means. At most {} % may be excluded.{}",
        100.0 * MOST_EXCLUDED,
        refused.collect::<String>()
    );
    let head =
        ["recording", "need", "witness", "quality", "values", "compared", "excluded", "share", "furthest"];
    Table {
        title: "Values that a witness excludes".to_owned(),
        note,
        head: head.map(str::to_owned).to_vec(),
        rows: all.iter().flat_map(|it| &it.covered).map(Covered::cells).collect(),
    }
}

fn lied(all: &[Found]) -> Table {
    let every: Vec<&Lied> = all.iter().flat_map(|it| &it.lied).collect();
    let mut needs: Vec<&str> = every.iter().map(|it| it.need.as_str()).collect();
    needs.dedup();
    let row = |name: String, is_in: &dyn Fn(&Lied) -> bool| {
        let of = |need: Option<&str>| {
            sum(every.iter().copied().filter(|it| is_in(it) && need.is_none_or(|need| it.need == need)))
        };
        let cells = needs.iter().map(|it| cell(of(Some(it)))).chain([cell(of(None))]);
        [name].into_iter().chain(cells).collect::<Vec<String>>()
    };
    let mut rows = Vec::new();
    for form in Form::ALL {
        let sizes = SHARES.map(Some).into_iter().chain([None]);
        for share in sizes.filter(|share| every.iter().any(|it| it.form == form && it.share == *share)) {
            let size = share.map_or(String::new(), |it| format!(" {it}"));
            rows.push(row(format!("{}{size}", form.name()), &|it| it.form == form && it.share == share));
        }
    }
    rows.push(row("the source of the need lies".to_owned(), &|it| it.is_source));
    rows.push(row("another one lies".to_owned(), &|it| !it.is_source));
    rows.push(row("all".to_owned(), &|_| true));
    let far_off: usize = every.iter().map(|it| it.far_off).sum();
    let note = format!(
        "One of at least three ways of knowing a need lies for two fifths of the second half, each in turn, by a share of what comparisons may hide: the \
         widths of both ways. Root mean squares, in these shares: the error of the need, that of the median of the same ways, and their ratio, which may \
         be {MOST} over all; and the share of the time in which the need is served, where it is not all. Both are compared with what the need is where nothing is wrong. A need demands twice what may be \
         hidden as its `max_width`; {far_off} good values are further off than that."
    );
    let head = ["fault"].into_iter().chain(needs.iter().copied()).chain(["all"]);
    Table {
        title: "While one of the ways lies".to_owned(),
        note,
        head: head.map(str::to_owned).collect(),
        rows,
    }
}

fn cell(errors: Errors) -> String {
    if errors.is_empty() {
        return "-".to_owned();
    }
    let (need, median) = errors.roots();
    let served = 100.0 * errors.served();
    let partly = if served < 99.95 { format!(", {served:.0} %") } else { String::new() };
    format!("{need:.3} / {median:.3} = {:.2}{partly}", need / median)
}

fn sum<'l>(all: impl IntoIterator<Item = &'l Lied>) -> Errors {
    all.into_iter().fold(Errors::default(), |mut sum, it| {
        sum.add(it.errors);
        sum
    })
}
