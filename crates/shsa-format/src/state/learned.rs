//! What was learned of slow variables, as a state holds it.

use super::{Number, interval};
use serde::{Deserialize, Serialize};
use shsa_core::engine::Recollection;
use shsa_core::parameter::{Known, Memory};
use shsa_core::time::Time;

#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LearnedForm {
    variable: String,
    newest: KnownForm,
    confirmed: KnownForm,
    anchor: KnownForm,
}

#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct KnownForm {
    time_ns: i64,
    lo: Number,
    hi: Number,
}

impl From<&Recollection> for LearnedForm {
    fn from(recollection: &Recollection) -> LearnedForm {
        let Memory { newest, confirmed, anchor } = recollection.memory;
        let [newest, confirmed, anchor] = [newest, confirmed, anchor].map(KnownForm::from);
        LearnedForm { variable: recollection.variable.clone(), newest, confirmed, anchor }
    }
}

impl LearnedForm {
    pub(super) fn recollection(self) -> Recollection {
        let [newest, confirmed, anchor] = [self.newest, self.confirmed, self.anchor].map(KnownForm::known);
        Recollection { variable: self.variable, memory: Memory { newest, confirmed, anchor } }
    }
}

impl From<Known> for KnownForm {
    fn from(known: Known) -> KnownForm {
        KnownForm { time_ns: known.at.0, lo: known.set.lo().into(), hi: known.set.hi().into() }
    }
}

impl KnownForm {
    fn known(self) -> Known {
        Known { set: interval(self.lo, self.hi), at: Time(self.time_ns) }
    }
}
