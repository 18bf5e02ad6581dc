//! Random contracts, as far as they are text.

use super::{named, names, some, text};
use proptest::prelude::*;
use shsa_core::knowledge::{ContractDraft, DemandDraft, GuaranteeDraft, Text};

pub(super) fn contract() -> impl Strategy<Value = ContractDraft> {
    // What a key of the format names is no property.
    let keys = ["of", "level", "when", "redundant"];
    let bounds = move || {
        let bounds = named((Just(Text::default()), text()), |(name, _), text| *name = text);
        bounds.prop_map(move |mut bounds| {
            bounds.retain(|(name, _)| !keys.contains(&name.text.as_str()));
            bounds
        })
    };
    let given = (some(text()), some(text()), some(text()), some(names(2)), bounds()).prop_map(
        |(of, level, when, redundant, properties)| GuaranteeDraft {
            name: Text::default(),
            of,
            level,
            when,
            redundant,
            properties,
        },
    );
    let asked = (some(text()), some(text()), bounds()).prop_map(|(of, level, properties)| DemandDraft {
        name: Text::default(),
        of,
        level,
        properties,
    });
    let gives = named(given, |given, text| given.name = text);
    let asks = named(asked, |asked, text| asked.name = text);
    (some(text()), some(text()), gives, asks, bounds()).prop_map(
        |(runs_on, policy, gives, asks, evidence)| ContractDraft {
            name: Text::default(),
            runs_on,
            policy,
            gives,
            asks,
            evidence,
        },
    )
}
