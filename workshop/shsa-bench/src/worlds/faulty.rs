//! Worlds with one fault or two, of sensors that lie by twice what can be hidden.

use super::fault::{FORMS, Fault, Form, inject, is_wrong};
use super::kinds::{Kind, world};
use super::readings::Reading;
use super::watch::{Finding, ORIGIN, Run, Watched, Wrong, about_value, is_by_rule, known, run, seconds};
use super::world::World;
use super::written::Names;
use shsa_core::analysis::{self, Analysis};
use shsa_core::engine::{EventKind, Quality};
use shsa_core::knowledge::{Id, KnowledgeBase, SignalId};
use shsa_core::monitor::Absence;
use shsa_core::trust::{Component, Verdict};
use shsa_lab::calibration::Chance;

/// How many sensors lie, and when.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Liars {
    One,
    /// Two, one after the other.
    Apart,
    /// Two at once, by different amounts.
    AtOnce,
    /// Two of one variable at once, by the same amount.
    Colluding,
}

/// A world with faults.
struct Faulty {
    watched: Watched,
    faults: Vec<Fault>,
}

/// A world with faults is so many times as long as one without.
const LENGTH: f64 = 4.0;
/// The share of wrong values of a fault from which on it has to be told, and the least number of them.
const WRONG_SHARE: f64 = 0.4;
const WRONG_COUNT: usize = 10;

/// A world with its readings and faults. `None` where the world has no sensor that could be found to lie so, or is untrue.
pub(super) fn posed(kinds: &[&Kind], seed: u64, liars: Liars) -> Option<(World, Vec<Reading>, Vec<Fault>)> {
    let (mut world, mut chance) = world(kinds, seed, LENGTH);
    world.demand_bounds();
    let sound = world.readings(&mut chance);
    let faults = chosen(&world, &mut chance, liars)?;
    if world.untrue(&sound).is_some() {
        return None;
    }
    let readings =
        faults.iter().fold(sound, |readings, fault| inject(&world, &mut chance, &readings, *fault));
    Some((world, readings, faults))
}

/// Watches a world with faults. `None` as for [`posed`].
///
/// # Errors
/// The generator has written a model that is none.
pub(super) fn watch(kinds: &[&Kind], seed: u64, liars: Liars) -> anyhow::Result<Option<Watched>> {
    let Some((world, readings, faults)) = posed(kinds, seed, liars) else { return Ok(None) };
    let knowledge = known(&world)?;
    let options = analysis::Options { only_runnable: true, addition_steps: 0, ..Default::default() };
    let analysis = analysis::analyze(&knowledge, options);
    let run = run(&world, knowledge, &readings, Names::Plain, ORIGIN);
    let counts = [run.publications.len(), 0, 0];
    let watched = Watched {
        world,
        readings,
        untrue: None,
        counts,
        findings: Vec::new(),
        faults: faults.iter().map(Fault::told).collect(),
    };
    let mut faulty = Faulty { watched, faults };
    faulty.judge(&run, &analysis);
    Ok(Some(faulty.watched))
}

impl World {
    /// Makes needs state how wide a value may be, so that uncertain ones are served.
    fn demand_bounds(&mut self) {
        for at in 0..self.needs.len() {
            let size = self.size(self.needs[at].variable);
            self.needs[at].max_width = Some(1e3 * size);
        }
    }
}

/// The faults of a world.
fn chosen(world: &World, chance: &mut Chance, liars: Liars) -> Option<Vec<Fault>> {
    let candidates: Vec<(usize, f64)> = (0..world.signals.len())
        .filter(|it| world.signals[*it].copies.is_none())
        .filter_map(|it| Some((it, 2.0 * world.hidden(it)?)))
        .filter(|(it, size)| {
            world.variables[world.signals[*it].variable].wraps.is_none_or(|turn| *size < 0.2 * turn)
        })
        .collect();
    let draw = |chance: &mut Chance, but: Option<usize>, like: Option<usize>| {
        let fits = |(it, _): &&(usize, f64)| {
            but != Some(*it)
                && like.is_none_or(|like| world.signals[like].variable == world.signals[*it].variable)
        };
        let all: Vec<&(usize, f64)> = candidates.iter().filter(fits).collect();
        (!all.is_empty()).then(|| *all[chance.below(all.len())])
    };
    let at = |share: f64| share * world.seconds;
    let side = if chance.below(2) == 0 { 1.0 } else { -1.0 };
    let (first, size) = draw(chance, None, None)?;
    let form = if liars == Liars::Colluding { Form::Bias } else { FORMS[chance.below(FORMS.len())] };
    let one = Fault { signal: first, form, size: side * size, from: at(0.25), to: at(0.5) };
    let another = |chance: &mut Chance, like: Option<usize>| {
        let (second, size) = draw(chance, Some(first), like)?;
        Some(Fault { signal: second, form: FORMS[chance.below(FORMS.len())], size, ..one })
    };
    Some(match liars {
        Liars::One => vec![one],
        Liars::Apart => vec![
            Fault { to: at(0.35), ..one },
            Fault { from: at(0.5), to: at(0.6), ..another(chance, None)? },
        ],
        Liars::AtOnce => vec![one, another(chance, None)?],
        Liars::Colluding => {
            let second = another(chance, Some(first))?;
            let size = side * size.max(second.size);
            vec![Fault { size, ..one }, Fault { size, form: Form::Bias, ..second }]
        }
    })
}

impl Faulty {
    fn judge(&mut self, run: &Run, analysis: &Analysis) {
        self.accusations(run);
        // The analysis is of one fault at a time.
        if !self.lie_together() || self.are_outnumbered() {
            for fault in self.faults.clone() {
                self.telling(run, analysis, fault);
            }
        }
        self.trust(run);
        self.coverage(run);
    }

    /// Whether a signal lies at some time.
    fn is_liar(&self, signal: usize) -> bool {
        self.faults.iter().any(|it| is_wrong(&self.watched.world, signal, it.signal))
    }

    fn lie_together(&self) -> bool {
        let is_before = |it: &[Fault]| it[0].to < it[1].from;
        !self.faults.windows(2).all(is_before)
    }

    /// Whether the sound sensors of the liars' variables outnumber the liars: else these may be right for all that is known.
    fn are_outnumbered(&self) -> bool {
        let variable_of = |signal: usize| self.watched.world.signals[signal].variable;
        self.faults.iter().all(|fault| {
            let all = self
                .watched
                .world
                .signals
                .iter()
                .filter(|it| it.copies.is_none() && it.variable == variable_of(fault.signal));
            let liars =
                self.faults.iter().filter(|it| variable_of(it.signal) == variable_of(fault.signal)).count();
            all.count() > 2 * liars
        })
    }

    /// No sound signal fails.
    fn accusations(&mut self, run: &Run) {
        if self.lie_together() && !self.are_outnumbered() {
            return;
        }
        for event in run
            .events
            .iter()
            .filter(|it| matches!(it.kind, EventKind::Failed | EventKind::Outlier))
            .filter(|it| !is_by_rule(&self.watched.world, it))
        {
            let signal = event.signal.map(Id::index);
            let is_sound = match signal {
                Some(signal) => !self.is_liar(signal),
                None => event.relation.is_some(),
            };
            if is_sound {
                let text = run.told(event);
                self.watched.findings.push(Finding {
                    wrong: Wrong::Failed,
                    time_s: seconds(event.time),
                    signal,
                    text,
                });
            }
        }
    }

    /// A fault is told where it is detectable, and named where it is isolable.
    fn telling(&mut self, run: &Run, analysis: &Analysis, fault: Fault) {
        let signal = SignalId::from_index(fault.signal);
        let during = |kind: EventKind| {
            let is_in = |time: f64| time >= fault.from && time <= fault.to + 0.1 * self.watched.world.seconds;
            run.events
                .iter()
                .find(move |it| it.kind == kind && it.signal == Some(signal) && is_in(seconds(it.time)))
        };
        let finding =
            |wrong| Finding { wrong, time_s: fault.from, signal: Some(fault.signal), text: fault.told() };
        if fault.form == Form::Drop {
            let declares = self.watched.world.signals[fault.signal].declares_rate
                && !self.watched.world.signals[fault.signal].holds;
            if declares && !self.watched.world.has_losses && during(EventKind::Silent).is_none() {
                self.watched.findings.push(finding(Wrong::Untold));
            }
            return;
        }
        let (wrong, all) =
            self.watched.world.far_off(&self.watched.readings, fault, fault.size.abs() * 0.999);
        let is_large = wrong >= WRONG_COUNT && wrong as f64 >= WRONG_SHARE * all as f64;
        let knowledge = run.engine.knowledge();
        if self.watched.world.has_losses || !is_large || !is_detectable(analysis, knowledge, signal) {
            return;
        }
        self.watched.counts[1] += 1;
        let (suspected, failed) = (during(EventKind::Suspected), during(EventKind::Failed));
        if suspected.or(failed).is_none() {
            self.watched.findings.push(finding(Wrong::Untold));
        }
        let is_isolable = knowledge.signals().ids().all(|it| {
            it == signal
                || is_wrong(&self.watched.world, it.index(), fault.signal)
                || analysis.is_isolable_from(Component::Signal(signal), Component::Signal(it))
        });
        if is_isolable && self.faults.len() == 1 {
            self.watched.counts[2] += 1;
            if failed.is_none() {
                self.watched.findings.push(finding(Wrong::Unnamed));
            }
        }
    }

    /// All signals are trusted again at the end, half of the world after the last fault, unless their witnesses may be lost.
    fn trust(&mut self, run: &Run) {
        if self.watched.world.has_losses {
            return;
        }
        for at in 0..self.watched.world.signals.len() {
            let signal = SignalId::from_index(at);
            let verdict = run.engine.verdict(signal);
            let is_absent = run.engine.absence(signal).is_some_and(|it| matches!(it, Absence::Silent));
            let last = run.events.iter().rev().find(|it| it.signal == Some(signal));
            let is_by_rule = last.is_some_and(|it| is_by_rule(&self.watched.world, it));
            if verdict > Verdict::Healthy && !is_absent && !is_by_rule {
                let text = last.map(|it| run.told(it)).unwrap_or_default();
                let text = format!("s{at} is {verdict:?} at the end; last: {text}");
                self.watched.findings.push(Finding {
                    wrong: Wrong::Untrusted,
                    time_s: self.watched.world.seconds,
                    signal: Some(at),
                    text,
                });
            }
        }
    }

    /// With one liar, uncertain values hold the truth. So do all after it is named, where it lies all the time.
    fn coverage(&mut self, run: &Run) {
        let [fault] = self.faults.as_slice() else { return };
        let liar = SignalId::from_index(fault.signal);
        let lies_on = matches!(fault.form, Form::Bias | Form::Drop);
        let named = run.events.iter().find(|it| it.kind == EventKind::Failed && it.signal == Some(liar));
        let named = named.map_or(f64::INFINITY, |it| seconds(it.time));
        for published in &run.publications {
            let time = seconds(published.time);
            let is_due =
                published.quality == Quality::Uncertain || lies_on && time > named && time < fault.to;
            let found = is_due.then(|| about_value(&self.watched.world, run, published)).flatten();
            let is_about_truth = |it: &Finding| matches!(it.wrong, Wrong::Uncovered(_));
            self.watched.findings.extend(found.filter(is_about_truth));
        }
    }
}

/// Whether a lasting fault of a signal is detectable by what the analysis says.
fn is_detectable(analysis: &Analysis, knowledge: &KnowledgeBase, signal: SignalId) -> bool {
    analysis.faults.is_detectable(signal) && !analysis.partly.is_in_part(knowledge, Component::Signal(signal))
}
