//! Moves the places of a draft, so that places of several files stay apart.

use super::draft::{
    BodyDraft, Bounds, ContractDraft, Draft, NeedDraft, Place, PropertyDrafts, SignalDraft, Text,
    UtilityDraft,
};
use alloc::vec::Vec;

impl Draft {
    /// The draft with every place moved by this many bytes, as if that much text stood before it.
    #[must_use]
    pub fn moved(mut self, by: u32) -> Draft {
        self.texts(&mut |text| {
            text.place.from = text.place.from.saturating_add(by);
            text.place.to = text.place.to.saturating_add(by);
        });
        self
    }

    /// The places of all texts.
    #[must_use]
    pub fn places(&self) -> Vec<Place> {
        let mut places = Vec::new();
        self.clone().texts(&mut |text| places.push(text.place));
        places
    }

    /// Visits every text, to change it.
    fn texts(&mut self, each: &mut dyn FnMut(&mut Text)) {
        for it in &mut self.variables {
            each(&mut it.name);
            [&mut it.unit, &mut it.shape, &mut it.max_rate, &mut it.wraps]
                .into_iter()
                .flatten()
                .for_each(&mut *each);
            it.range.iter_mut().flat_map(|(lo, hi)| [lo, hi]).for_each(&mut *each);
            properties(&mut it.properties, each);
        }
        for (name, value) in &mut self.constants {
            each(name);
            bounds(value, each);
        }
        self.functions.iter_mut().flat_map(|(head, body)| [head, body]).for_each(&mut *each);
        for it in &mut self.relations {
            each(&mut it.name);
            match &mut it.body {
                BodyDraft::Equation(text) => each(text),
                BodyDraft::Structure { outputs, inputs } => {
                    outputs.iter_mut().chain(inputs).for_each(&mut *each)
                }
                BodyDraft::Specification(specification) => specification.texts_mut().for_each(&mut *each),
            }
            it.directions.iter_mut().flatten().chain(&mut it.condition).for_each(&mut *each);
            it.error.iter_mut().for_each(|error| bounds(error, each));
            it.learn.iter_mut().for_each(&mut *each);
            properties(&mut it.properties, each);
        }
        self.signals.iter_mut().for_each(|it| signal(it, each));
        self.fusions.iter_mut().for_each(|fusion| fusion.texts(each));
        self.needs.iter_mut().for_each(|it| need(it, each));
        self.platform.iter_mut().chain(&mut self.contracts).for_each(|it| contract(it, each));
        match &mut self.utility {
            Some(UtilityDraft::Named(text)) => each(text),
            Some(UtilityDraft::Own { at, aggregate, relation, signal, way, defaults }) => {
                each(at);
                [aggregate, relation, signal, way].into_iter().flatten().for_each(&mut *each);
                properties(defaults, each);
            }
            None => {}
        }
    }
}

fn signal(it: &mut SignalDraft, each: &mut dyn FnMut(&mut Text)) {
    each(&mut it.name);
    let texts = [
        &mut it.variable,
        &mut it.source,
        &mut it.unit,
        &mut it.scale,
        &mut it.offset,
        &mut it.rate,
        &mut it.change_error,
        &mut it.noise,
        &mut it.delay,
        &mut it.mean_over,
        &mut it.timeout,
        &mut it.max_rate,
        &mut it.max_delay,
        &mut it.frozen_after,
        &mut it.rests_at,
        &mut it.rests_for,
        &mut it.hold,
        &mut it.counter,
        &mut it.access,
    ];
    texts.into_iter().flatten().chain(&mut it.derived_from).for_each(&mut *each);
    it.shares.iter_mut().for_each(|(cause, prior)| {
        each(cause);
        prior.iter_mut().for_each(&mut *each);
    });
    it.value_error.iter_mut().chain(&mut it.time_error).for_each(|error| bounds(error, each));
    it.range.iter_mut().chain(&mut it.saturates).flat_map(|(lo, hi)| [lo, hi]).for_each(&mut *each);
    properties(&mut it.properties, each);
}

fn need(it: &mut NeedDraft, each: &mut dyn FnMut(&mut Text)) {
    each(&mut it.variable);
    let limits = [&mut it.signal, &mut it.max_age, &mut it.max_width, &mut it.integrity];
    let demands = [&mut it.min_rate, &mut it.when_unsure];
    let switching = [&mut it.hold, &mut it.probation, &mut it.blend, &mut it.hysteresis, &mut it.isolation];
    limits.into_iter().chain(demands).chain(switching).flatten().for_each(&mut *each);
}

fn contract(it: &mut ContractDraft, each: &mut dyn FnMut(&mut Text)) {
    each(&mut it.name);
    [&mut it.runs_on, &mut it.policy].into_iter().flatten().for_each(&mut *each);
    for given in &mut it.gives {
        each(&mut given.name);
        [&mut given.of, &mut given.level, &mut given.when].into_iter().flatten().for_each(&mut *each);
        given.redundant.iter_mut().flatten().for_each(&mut *each);
        properties(&mut given.properties, each);
    }
    for asked in &mut it.asks {
        each(&mut asked.name);
        [&mut asked.of, &mut asked.level].into_iter().flatten().for_each(&mut *each);
        properties(&mut asked.properties, each);
    }
    properties(&mut it.evidence, each);
}

fn bounds(bounds: &mut Bounds, each: &mut dyn FnMut(&mut Text)) {
    match bounds {
        Bounds::One(text) => each(text),
        Bounds::Two(lo, hi) => [lo, hi].into_iter().for_each(each),
    }
}

fn properties(properties: &mut PropertyDrafts, each: &mut dyn FnMut(&mut Text)) {
    properties.iter_mut().flat_map(|(name, value)| [name, value]).for_each(each);
}
