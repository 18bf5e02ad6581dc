//! A recorded system: its model, calibrated on the first half of the recording, and the observations of the second half.

use anyhow::{Context, bail};
use shsa_core::knowledge::{Draft, IdVec, KnowledgeBase, Severity, SignalId, build};
use shsa_core::observation::Observation;
use shsa_lab::calibration::{Options, Parted, Session, calibrate};
use shsa_model::Report;
use shsa_model::live::{Live, Written};
use shsa_recording::{ReadOptions, Wanted, read};
use std::path::Path;

/// The models with the recordings of what they are of.
pub(super) const RECORDED: [(&str, &str); 6] = [
    ("car", "comma2k19"),
    ("quad", "quad"),
    ("husky", "husky"),
    ("turtlebot", "turtlebot3"),
    ("motes", "suthaharan"),
    ("cell", "battery/discharge_1c.csv"),
];

/// A system with its second half.
pub(super) struct Recorded {
    pub(super) name: &'static str,
    pub(super) draft: Draft,
    pub(super) knowledge: KnowledgeBase,
    /// Why the numbers are those of the model and not the calibrated ones, where they are.
    pub(super) refused: Option<String>,
    /// The second half of each session.
    pub(super) unseen: Vec<Session>,
}

impl Recorded {
    /// Reads a recording and calibrates its model, as `shsa calibrate` does by default.
    ///
    /// # Errors
    /// The model is wrong, or the recording does not fit it.
    pub(super) fn read(name: &'static str, model: &Path, recording: &Path) -> anyhow::Result<Recorded> {
        let live = loaded(model).map_err(|it| anyhow::anyhow!("{}", it.render(false)))?;
        let wanted: Vec<Wanted> = live
            .knowledge()
            .signals()
            .iter()
            .map(|it| Wanted::new(it.name.clone(), it.source.clone()))
            .collect();
        let recording = read(&[recording.to_owned()], &wanted, &ReadOptions::default())?;
        let parted = Parted::of(&recording, None, &[])?;
        let options = Options { finds_steps: false, ..Options::default() };
        let found = calibrate(live.draft(), &parted.fitted, &parted.unseen, &options)
            .with_context(|| format!("{} cannot be calibrated", model.display()))?;
        let refused = found.refusal().or_else(|| found.blindness());
        let draft = if refused.is_some() { live.draft().clone() } else { found.draft };
        let knowledge = built(&draft)?;
        Ok(Recorded { name, draft, knowledge, refused, unseen: parted.unseen })
    }

    /// The second halves, for a model with some of the signals, by their names.
    pub(super) fn observations(&self, knowledge: &KnowledgeBase) -> Vec<Vec<Observation>> {
        let ids: IdVec<SignalId, Option<SignalId>> =
            IdVec::filled(self.knowledge.signals().len(), |it: SignalId| {
                knowledge.signal(&self.knowledge.signals()[it].name)
            });
        let renamed = |it: &Observation| Some(Observation { signal: ids[it.signal]?, ..it.clone() });
        let stretches = self.unseen.iter().flat_map(Session::stretches);
        stretches.map(|it| it.iter().filter_map(renamed).collect()).collect()
    }

    /// The model with some of its signals only.
    pub(super) fn with_signals(&self, keeps: impl Fn(SignalId) -> bool) -> Draft {
        let mut draft = self.draft.clone();
        let names: Vec<&str> = (self.knowledge.signals().enumerate())
            .filter(|it| keeps(it.0))
            .map(|it| it.1.name.as_str())
            .collect();
        draft.signals.retain(|it| names.contains(&it.name.text.as_str()));
        for signal in &mut draft.signals {
            signal.derived_from.retain(|it| names.contains(&it.text.as_str()));
        }
        draft
    }
}

/// The knowledge of a draft.
///
/// # Errors
/// The draft has an error.
pub(super) fn built(draft: &Draft) -> anyhow::Result<KnowledgeBase> {
    let (knowledge, found) = build(draft);
    match found.into_iter().find(|it| it.severity == Severity::Error) {
        Some(error) => bail!("{}", error.message),
        None => Ok(knowledge),
    }
}

fn loaded(path: &Path) -> Result<Live, Report> {
    let name = path.display().to_string();
    let text = shsa_model::read_text(path, "model")?;
    Live::load(Written { name: &name, text: &text }).map(|(live, _)| live)
}
