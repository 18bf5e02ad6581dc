//! The assurance cases over a recording, for `shsa assure --over`: how each claim and each piece of evidence stood, and when.

use super::picture::{Course, NeedCase, Recorder, WayCase};
use serde_json::{Value, json};
use shsa_core::assurance::Verdict;
use shsa_core::time::{Span, Time, Validity};
use shsa_drawing::case::gsn::{self, Listed, Stretch};
use shsa_drawing::case::words;
use shsa_format::drive::Run;

/// The cases of all needs under contract, over the run of one recording.
#[derive(Clone, Copy)]
pub struct CasesOverTime<'a> {
    recorder: &'a Recorder,
    run: &'a Run,
    title: &'a str,
}

/// The case of a way, as a module of its own.
struct Module<'a> {
    /// The need's published name.
    need: &'a str,
    way: &'a WayCase,
    name: String,
    /// How each node stood.
    stretches: Vec<Vec<Stretch>>,
}

impl<'a> CasesOverTime<'a> {
    /// The cases of a run at its end; `title` names the model.
    #[must_use]
    pub fn new(recorder: &'a Recorder, run: &'a Run, title: &'a str) -> CasesOverTime<'a> {
        CasesOverTime { recorder, run, title }
    }

    /// Whether each need has a way at the end whose claim is given.
    #[must_use]
    pub fn is_given(&self) -> bool {
        let is_given = |way: &WayCase| way.argument.state() == Verdict::Holds;
        self.recorder.cases.needs.iter().all(|case| case.ways.iter().any(is_given))
    }

    /// The ways of a need whose cases are shown: those that have served, or else the best way.
    fn described(case: &NeedCase) -> impl Iterator<Item = &WayCase> {
        let any_has_served = case.ways.iter().any(|way| way.has_served);
        let ways = case.ways.iter().enumerate();
        ways.filter(move |(at, way)| way.has_served || !any_has_served && *at == 0).map(|(_, way)| way)
    }

    fn seconds(&self, stretch: Validity) -> (f64, f64) {
        let since = |at: Time| rounded(at - self.run.first);
        (since(stretch.from), since(stretch.to.min(self.run.last)))
    }

    fn stretches(&self, course: &Course) -> Vec<Stretch> {
        let stretch = |(stretch, verdict)| {
            let (from_s, to_s) = self.seconds(stretch);
            Stretch { from_s, to_s, verdict }
        };
        course.stretches().into_iter().map(stretch).collect()
    }

    fn modules(&self) -> Vec<Module<'_>> {
        let needs = self.recorder.cases.needs.iter();
        let described: Vec<(&str, &WayCase)> =
            needs.flat_map(|case| Self::described(case).map(|way| (case.signal.as_str(), way))).collect();
        let names = gsn::modules(described.iter().map(|(need, _)| *need));
        let module = |((need, way), name): ((&'a str, &'a WayCase), String)| {
            let stretches = way.courses.iter().map(|course| self.stretches(course)).collect();
            Module { need, way, name, stretches }
        };
        described.into_iter().zip(names).map(module).collect()
    }

    /// The module of GSN over those of all shown cases: of the ways of one need, one is enough.
    #[must_use]
    pub fn index(&self) -> String {
        let listed = self.modules().into_iter().map(|Module { need, way, name, .. }| Listed {
            of: need.to_owned(),
            module: name,
            state: way.argument.state(),
        });
        let brief = format!("{}, at the end of {} s", self.title, self.duration_s());
        gsn::index(&listed.collect::<Vec<_>>(), &brief)
    }

    /// A module of GSN for each shown case, with its name.
    #[must_use]
    pub fn gsn(&self) -> Vec<(String, String)> {
        let module = |Module { need, way, name, stretches }: Module<'_>| {
            let brief = format!("{}, {} by {}, over {} s", self.title, need, way.name, self.duration_s());
            let described: Vec<String> = stretches.iter().map(|it| gsn::course(it)).collect();
            let text = gsn::write(&way.argument, &name, &brief, &described);
            (name, text)
        };
        self.modules().into_iter().map(module).collect()
    }

    fn duration_s(&self) -> f64 {
        rounded(self.run.last - self.run.first)
    }

    /// As one object: see `docs/json.md`, assure.
    #[must_use]
    pub fn json(&self) -> Value {
        json!({
            "model": self.title,
            "given": self.is_given(),
            "duration_s": self.duration_s(),
            "needs": self.recorder.cases.needs.iter().map(|case| self.need_json(case)).collect::<Vec<_>>(),
        })
    }

    fn need_json(&self, case: &NeedCase) -> Value {
        let scales = self.run.engine.knowledge().contracts().scales();
        let record = self.recorder.needs.iter().find(|record| record.signal == case.signal);
        let admitted =
            record.into_iter().flat_map(|record| &record.admissions.all).map(|(stretch, admitted)| {
                let (from_s, to_s) = self.seconds(*stretch);
                let level = admitted.level.map(|level| scales.written(level));
                json!({ "from_s": from_s, "to_s": to_s, "admitted": admitted.ground.name(), "level": level })
            });
        let modules = self.modules();
        let way = |way: &WayCase| {
            let described = modules.iter().find(|module| std::ptr::eq(module.way, way));
            json!({
                "way": way.name,
                "served": way.has_served,
                "verdict": words::verdict(way.argument.state()),
                "over_time": way.courses.first().map(|it| gsn::course_json(&self.stretches(it))),
                "case": described.map(|it| gsn::json(&it.way.argument, &it.name, &it.stretches)),
            })
        };
        json!({
            "need": case.signal,
            "given": case.ways.iter().any(|way| way.argument.state() == Verdict::Holds),
            "admissions": admitted.collect::<Vec<_>>(),
            "ways": case.ways.iter().map(way).collect::<Vec<_>>(),
            "complete": case.more_ways == 0,
        })
    }

    /// For people: what went out on which ground, and how each way stood.
    #[must_use]
    pub fn text(&self) -> String {
        let mut lines = vec![format!("{}, over {} s", self.title, self.duration_s())];
        let scales = self.run.engine.knowledge().contracts().scales();
        for case in &self.recorder.cases.needs {
            lines.push(format!("\n{}", case.signal));
            let record = self.recorder.needs.iter().find(|record| record.signal == case.signal);
            for (stretch, admitted) in record.into_iter().flat_map(|record| &record.admissions.all) {
                let (from, to) = self.seconds(*stretch);
                let level = admitted.level.map_or("no level".to_owned(), |level| scales.written(level));
                lines.push(format!("  {from} to {to} s: {}, {level}", admitted.ground.name()));
            }
            let ways = case.ways.iter().map(|way| {
                let described = way.courses.first().map(|it| gsn::course(&self.stretches(it)));
                vec![way.name.clone(), described.unwrap_or_default()]
            });
            lines.push(shsa_format::text::table(&["way", "over time"], ways.collect()));
        }
        lines.join("\n") + "\n"
    }
}

/// Seconds to the millisecond.
fn rounded(span: Span) -> f64 {
    (span.seconds() * 1e3).round() / 1e3
}
