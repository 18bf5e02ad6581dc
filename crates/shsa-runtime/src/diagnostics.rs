//! The states of needs and signals for the tools that the middleware has for them, as `/diagnostics` in ROS.

use crate::healer::Healer;
use crate::outlet::Outlet;
use crate::ownership::Ownership;
use shsa_bridge::{Diagnostic, Level, Quality};
use shsa_core::knowledge::{Id, SignalId};
use shsa_core::monitor::Symptom;
use shsa_core::time::Time;
use shsa_format::event;

/// Of a model with more signals, only those are reported that are not well.
const MOST_SIGNALS: usize = 256;

/// Who reports.
struct Reporter<'a> {
    instance: &'a str,
    /// The name of the model, where the instance has several.
    model: Option<&'a str>,
}

/// The states of all needs that this instance serves, and of its signals.
pub(super) fn of(
    instance: &str,
    healers: &[Healer],
    ownership: Option<&Ownership>,
    now: Time,
) -> Vec<Diagnostic> {
    let is_others = |topic: &str| ownership.is_some_and(|ownership| ownership.is_others(topic));
    let mut all = Vec::new();
    for healer in healers {
        let reporter = Reporter { instance, model: (healers.len() > 1).then(|| healer.name()) };
        let needs = healer.outlets().map(|(_, outlet)| outlet).filter(|outlet| !is_others(outlet.topic()));
        all.extend(needs.map(|outlet| reporter.of_need(outlet, now)));
        let count = healer.engine().knowledge().signals().len();
        let signals = (0..count).map(|at| reporter.of_signal(healer, SignalId::from_index(at)));
        let is_listed = |it: &Diagnostic| count <= MOST_SIGNALS || it.level != Level::Ok;
        all.extend(signals.filter(is_listed).take(MOST_SIGNALS));
    }
    all
}

impl Reporter<'_> {
    fn diagnostic(
        &self,
        level: Level,
        what: &str,
        message: String,
        details: Vec<(&'static str, String)>,
    ) -> Diagnostic {
        let instance = self.instance.to_owned();
        let name = match self.model {
            Some(model) => format!("{instance}: {model}: {what}"),
            None => format!("{instance}: {what}"),
        };
        Diagnostic { level, name, message, reporter: instance, details }
    }

    fn of_need(&self, outlet: &Outlet, now: Time) -> Diagnostic {
        let (quality, source) = (outlet.quality(now), outlet.provenance().source.clone());
        let (level, message) = match quality {
            Quality::Good => (Level::Ok, "from its own source".to_owned()),
            Quality::Substitute => (Level::Warn, format!("substituted by {source}")),
            Quality::Uncertain => (Level::Warn, "only its bounds are known".to_owned()),
            Quality::LastUsable => (Level::Warn, "nothing serves it: its last value".to_owned()),
            Quality::Bad => (Level::Error, "nothing serves it".to_owned()),
        };
        let details = vec![
            ("quality", quality.name().to_owned()),
            ("source", source),
            ("topic", outlet.topic().to_owned()),
            ("variable", outlet.variable().0.to_owned()),
        ];
        self.diagnostic(level, &format!("need {}", outlet.key()), message, details)
    }

    fn of_signal(&self, healer: &Healer, id: SignalId) -> Diagnostic {
        let engine = healer.engine();
        let verdict = event::verdict(engine.absence(id), engine.verdict(id));
        let level = match verdict {
            "silent" => Level::Stale,
            "failed" => Level::Error,
            "suspect" => Level::Warn,
            _ => Level::Ok,
        };
        let symptom = engine.fault(id).map(Symptom::name);
        let details = [("verdict", Some(verdict)), ("symptom", symptom)];
        let details = details.into_iter().filter_map(|(key, value)| Some((key, value?.to_owned()))).collect();
        let message = match symptom {
            Some(symptom) if symptom != verdict => format!("{verdict}: {symptom}"),
            _ => verdict.to_owned(),
        };
        let name = &engine.knowledge().signals()[id].name;
        self.diagnostic(level, &format!("signal {name}"), message, details)
    }
}
