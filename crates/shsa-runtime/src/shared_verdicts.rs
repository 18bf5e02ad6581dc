//! Verdicts of other instances on signals of which this one has no evidence.
//!
//! A spare that starts while the witnesses of a faulty signal are silent sees nothing against the signal. So an instance holds the token
//! `shsa/accused/INSTANCE/VERDICT/SIGNAL.SOURCE` for each signal that it accuses; SOURCE is a hash of the source on the bus, as other
//! models may use the same name. An instance that has no verdict of its own on the signal restores this one, as it restores its own state
//! after a restart: the accusation ends by evidence.

use crate::error::{Context, RuntimeError};
use crate::healer::Healer;
use crate::ownership::{hash, instance};
use shsa_bridge::{Attendance, Bridge, BridgeError, Presence};
use shsa_core::engine::{Engine, Remembered, Snapshot};
use shsa_core::knowledge::{Signal, SignalId};
use shsa_core::order::Subject;
use shsa_core::reason::Reason;
use shsa_core::time::Time;
use shsa_core::trust::{Accusation, Record, Verdict};
use std::collections::{BTreeMap, BTreeSet};

/// The prefix of the tokens.
const ACCUSED: &str = "shsa/accused";
/// What a token says of its signal.
const FAILED: &str = "failed";
const SUSPECT: &str = "suspect";

/// The verdicts that instances tell each other.
pub(super) struct SharedVerdicts {
    /// Our name, unique on the network.
    instance: String,
    attendance: Attendance,
    /// Our tokens.
    own: BTreeMap<String, Box<dyn Send>>,
    /// Whether a decision may have changed them.
    pub(super) is_due: bool,
}

impl SharedVerdicts {
    /// `None` where the bus does not list the present instances.
    ///
    /// # Errors
    /// When the bus refuses to list them.
    pub(super) fn new(name: &str, bridge: &dyn Bridge) -> Result<Option<SharedVerdicts>, RuntimeError> {
        let attendance = bridge.attendance(&format!("{ACCUSED}/**")).context("looking for verdicts")?;
        let instance = instance(name, bridge);
        Ok(attendance.map(|attendance| SharedVerdicts {
            instance,
            attendance,
            own: BTreeMap::new(),
            is_due: true,
        }))
    }

    /// Tells others whom this instance accuses, after a decision.
    ///
    /// # Errors
    /// When the bus refuses a token.
    pub(super) fn tell(&mut self, healers: &[Healer], bridge: &dyn Bridge) -> Result<(), BridgeError> {
        if !std::mem::take(&mut self.is_due) {
            return Ok(());
        }
        let accused = healers.iter().flat_map(|healer| accused(healer.engine()));
        let token = |(word, signal)| format!("{ACCUSED}/{}/{word}/{signal}", self.instance);
        let tokens: BTreeSet<String> = accused.map(token).collect();
        self.own.retain(|token, _| tokens.contains(token));
        for token in tokens {
            if !self.own.contains_key(&token)
                && let Some(held) = bridge.attend(&token)?
            {
                self.own.insert(token, held);
            }
        }
        Ok(())
    }

    /// Restores what others have found of signals of which this instance has no evidence; returns notes.
    pub(super) fn listen(&mut self, healers: &mut [Healer], now: Time) -> Vec<String> {
        let mut notes = Vec::new();
        while let Some(presence) = (self.attendance)() {
            let Presence::Alive(token) = presence else { continue };
            let Some(heard) = read(&token).filter(|heard| heard.instance != self.instance) else { continue };
            for healer in healers.iter_mut() {
                let Some(signal) = heard.about(healer.engine()) else { continue };
                let name = healer.engine().knowledge().signals()[signal].name.clone();
                notes.push(format!(
                    "{name} is {} by the evidence of {}; there is none here yet",
                    heard.word(),
                    heard.by()
                ));
                self.is_due = true;
                healer.restore(heard.snapshot(name, now), now);
            }
        }
        notes
    }
}

/// What another instance has found of a signal.
struct Heard<'t> {
    instance: &'t str,
    verdict: Verdict,
    signal: &'t str,
}

impl Heard<'_> {
    /// The name of the other instance.
    fn by(&self) -> &str {
        self.instance.rsplit_once('.').map_or(self.instance, |(name, _)| name)
    }

    fn word(&self) -> &'static str {
        if self.verdict == Verdict::Failed { FAILED } else { SUSPECT }
    }

    /// The signal, where this engine has no evidence about it.
    fn about(&self, engine: &Engine) -> Option<SignalId> {
        let (id, _) = engine.knowledge().signals().enumerate().find(|(_, it)| marked(it) == self.signal)?;
        (engine.verdict(id) == Verdict::Unknown).then_some(id)
    }

    /// The state of a run that knows nothing but this.
    fn snapshot(&self, name: String, now: Time) -> Snapshot {
        let because = Reason::FoundElsewhere { instance: self.by().to_owned() }.into();
        let accusation = Accusation { since: now, symptom: None, cause: None, probability: None, because };
        let record = Record {
            verdict: Some(self.verdict),
            alone: self.verdict == Verdict::Failed,
            contradicted: true,
            ..Record::default()
        };
        let remembered = Remembered {
            subject: Subject::Signal(name),
            record,
            accusation: Some(accusation),
            conflicts: Vec::new(),
        };
        Snapshot { time: now, verdicts: vec![remembered], ..Snapshot::default() }
    }
}

/// The signals that an engine accuses: how, and their marked names.
fn accused(engine: &Engine) -> impl Iterator<Item = (&'static str, String)> {
    engine.knowledge().signals().enumerate().filter_map(|(id, signal)| {
        engine.accusation(id)?;
        let is_suspect = engine.verdict(id) == Verdict::Suspect;
        Some((if is_suspect { SUSPECT } else { FAILED }, marked(signal)))
    })
}

/// The name of a signal as one level of a token, with a hash of its source.
fn marked(signal: &Signal) -> String {
    let source = if signal.source.is_empty() { &signal.name } else { &signal.source };
    let mut all = String::with_capacity(signal.name.len() + 17);
    for byte in signal.name.bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'-' | b'_' => all.push(char::from(byte)),
            _ => all.push_str(&format!("%{byte:02x}")),
        }
    }
    format!("{all}.{:016x}", hash(source.bytes()))
}

/// Tokens come from strangers.
fn read(token: &str) -> Option<Heard<'_>> {
    let (instance, rest) = token.strip_prefix(ACCUSED)?.strip_prefix('/')?.split_once('/')?;
    let (verdict, signal) = rest.split_once('/')?;
    let verdict = match verdict {
        FAILED => Verdict::Failed,
        SUSPECT => Verdict::Suspect,
        _ => return None,
    };
    Some(Heard { instance, verdict, signal })
}

#[cfg(test)]
mod tests {
    use super::*;
    use shsa_model::load;

    #[test]
    fn a_token_names_a_signal_and_its_source() {
        let model = "shsa: 1\nvariables: { x: {} }\nsignals:\n  \"/a b\": { variable: x, source: \"plant/a#v\" }\n  \
                     c: { variable: x, source: plant/c }\n";
        let loaded = load(model, "model.yaml");
        let engine = Engine::new(loaded.knowledge, shsa_core::engine::Options::default());
        let signals = engine.knowledge().signals();
        let names: Vec<String> = signals.iter().map(marked).collect();
        assert!(names[0].starts_with("%2fa%20b.") && names[1].starts_with("c."), "{names:?}");
        let found = |token: &str| read(token).and_then(|heard| heard.about(&engine));
        assert_eq!(found(&format!("shsa/accused/one.1/failed/{}", names[1])), engine.knowledge().signal("c"));
        assert_eq!(found(&format!("shsa/accused/one.1/wrong/{}", names[1])), None);
        assert_eq!(
            found("shsa/accused/one.1/failed/c.0000000000000000"),
            None,
            "the same name of another source"
        );
        assert_eq!(found("shsa/accused/one.1/failed"), None);
        assert_eq!(found("shsa/healer/one.1/failed/c"), None);
    }
}
