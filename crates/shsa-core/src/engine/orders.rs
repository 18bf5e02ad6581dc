//! Carries out operators' orders: what is forbidden, what must serve a need, what is cleared.

use super::message::Output;
use super::operator::{Refusal, already, find_need};
use super::ways::{Lost, ways};
use super::{Engine, events};
use crate::diagnosis::rests_on;
use crate::knowledge::NeedId;
use crate::order::{Order, Subject};
use crate::plan::Requirements;
use crate::reason::{Joint, Reason, Reasons};
use crate::substitution::Way;
use crate::time::{Span, Time};
use crate::trust::Component;
use alloc::borrow::ToOwned;
use alloc::string::String;
use alloc::vec::Vec;

impl Engine {
    /// Carries out an order at a moment, after all earlier inputs. Events report the consequences, and name the order.
    ///
    /// # Errors
    /// When the order cannot be carried out: a name is unknown, or there is nothing to do. Then nothing changes, and the outputs
    /// have a [`Refused`](super::EventKind::Refused), so that the refusal is recorded with the decisions.
    pub fn order(&mut self, order: &Order, at: Time) -> Result<(), Refusal> {
        self.advance(at);
        if self.waiting {
            self.settle();
        }
        let now = self.now.unwrap_or(at);
        match self.obey(order, now) {
            Ok(reason) => {
                self.replan(now, reason);
                self.settle_after(true);
                Ok(())
            }
            Err(refusal) => {
                self.refuse(Reason::CannotObey { order: order.clone() }, refusal.clone(), now);
                Err(refusal)
            }
        }
    }

    /// The orders in force: what is forbidden, in file order, then the sources to which needs are tied.
    #[must_use]
    pub fn standing_orders(&self) -> Vec<Order> {
        let knowledge = &self.knowledge;
        let forbidden = self.ledger.forbidden().map(|it| Order::Forbid(Subject::of(knowledge, it)));
        let about_contracts = self.orders_about_contracts();
        let forced = self.providers.enumerate().filter_map(|(need, provider)| {
            let source = provider.forced()?.describe(knowledge);
            Some(Order::Force { need: knowledge.needs()[need].signal.clone(), source })
        });
        forbidden.chain(about_contracts).chain(forced).collect()
    }

    /// Carries out an order, and returns the reason for its consequences.
    fn obey(&mut self, order: &Order, now: Time) -> Result<Option<Reason>, Refusal> {
        match order {
            Order::Forbid(subject) => match self.ledger.forbid(self.usable(subject)?) {
                true => Ok(Some(Reason::MustNotBeUsed { subject: subject.clone() })),
                false => Err(already(order)),
            },
            Order::Allow(subject) => match self.ledger.allow(self.usable(subject)?) {
                true => Ok(Some(Reason::MayBeUsed { subject: subject.clone() })),
                false => {
                    let reason = Reason::NotForbidden { subject: subject.clone() };
                    Err(Refusal::new(reason, self.in_force()))
                }
            },
            Order::Force { need, source } => {
                let need = find_need(&self.knowledge, need)?;
                let way = self.source(need, source)?;
                if self.providers[need].forced() == Some(&way) {
                    return Err(already(order));
                }
                self.check_contract(need, &way, now)?;
                self.serve(need, Some(way), now);
                Ok(None)
            }
            Order::Release(name) => {
                let need = find_need(&self.knowledge, name)?;
                let is_override_over = self.end_override(need, now);
                if self.providers[need].forced().is_none() {
                    if is_override_over {
                        return Ok(Some(Reason::OverrideOver { need: name.clone() }));
                    }
                    let reason = Reason::ChoosesAlready { need: name.clone() };
                    return Err(Refusal::new(reason, self.in_force()));
                }
                self.serve(need, None, now);
                Ok(None)
            }
            Order::Clear(subject) => {
                self.clear(subject, now)?;
                Ok(Some(Reason::WasCleared { subject: subject.clone() }))
            }
            Order::Override { need, lasts, because } => {
                self.override_contract(order, need, *lasts, because, now)
            }
            Order::Attest { evidence, holds } => self.attest(evidence, *holds),
        }
    }

    /// The signal or relation of a subject.
    fn usable(&self, subject: &Subject) -> Result<Component, Refusal> {
        match subject.find(&self.knowledge)? {
            Component::Cause(cause) => {
                let shared = &self.knowledge.causes()[cause].signals;
                let names = shared.iter().map(|signal| self.knowledge.signals()[*signal].name.clone());
                let help = Reason::NameSharers { signals: names.collect() };
                Err(Refusal::new(Reason::NeitherSignalNorRelation { subject: subject.clone() }, help))
            }
            component => Ok(component),
        }
    }

    fn in_force(&self) -> Reason {
        let orders = self.standing_orders();
        match orders.is_empty() {
            true => Reason::NoneInForce,
            false => Reason::InForce { orders },
        }
    }

    /// Ties a need to a source, or ends that.
    fn serve(&mut self, need: NeedId, way: Option<Way>, now: Time) {
        let (providers, outputs, situation) = self.situation(now, Some(Reason::ChoosesItself));
        let provider = &mut providers[need];
        let event = match way {
            Some(way) => provider.force(way, &situation),
            None => provider.release(&situation),
        };
        outputs.extend(event.map(Output::Event));
    }

    /// The way of serving a need with this description. The search covers all ways with the elements of the text, so that it also
    /// finds ways that are not good enough for a plan.
    pub(super) fn source(&self, need: NeedId, text: &str) -> Result<Way, Refusal> {
        let Engine { knowledge, graph, .. } = self;
        let need_described = &knowledge.needs()[need];
        let (signals, relations) = (knowledge.signals().enumerate(), knowledge.relations().enumerate());
        let unnamed = Lost {
            signals: signals.filter(|(_, it)| !text.contains(&it.name)).map(|(id, _)| id).collect(),
            relations: relations.filter(|(_, it)| !text.contains(&it.name)).map(|(id, _)| id).collect(),
        };
        let found = ways(knowledge, graph, need_described.variable, &unnamed, &Requirements::default());
        let mut found = found.into_iter();
        let Some(source) = found.find(|source| source.way.describe(knowledge) == text) else {
            let all = self.ready_sources.sources(knowledge, graph, need, &Lost::default());
            let all: Vec<String> = all.iter().map(|source| source.way.describe(knowledge)).collect();
            let reason = Reason::NoSource { need: need_described.signal.clone(), name: text.to_owned() };
            return Err(Refusal::unknown(reason, text, all.iter().map(String::as_str)));
        };
        let shortfalls = Requirements::of(need_described).shortfalls_of_way(knowledge, &source.way);
        if let Some(shortfall) = shortfalls.first() {
            let reason = Reasons::from(Reason::DoesNotMeet { source: text.to_owned() });
            let reason = reason.then(Joint::Namely, shortfall.reason(knowledge));
            return Err(Refusal::new(reason, Reason::ChangeTheNeed));
        }
        Ok(source.way)
    }

    fn clear(&mut self, subject: &Subject, now: Time) -> Result<(), Refusal> {
        let component = subject.find(&self.knowledge)?;
        let Component::Cause(cause) = component else {
            return match self.clear_by_operator(component) {
                true => {
                    let event = events::cleared_by_operator(&self.knowledge, component, None, now);
                    self.outputs.push_back(Output::Event(event));
                    Ok(())
                }
                false => Err(self.nothing_to_clear(subject, component)),
            };
        };
        let sharing = self.knowledge.causes()[cause].signals.clone();
        let mut is_any = false;
        for signal in sharing.into_iter().map(Component::Signal) {
            if self.clear_by_operator(signal) {
                is_any = true;
                let event = events::cleared_by_operator(&self.knowledge, signal, Some(cause), now);
                self.outputs.push_back(Output::Event(event));
            }
        }
        match is_any {
            true => Ok(()),
            false => Err(self.nothing_to_clear(subject, component)),
        }
    }

    /// Clears a component, and returns whether it was accused. An operator cannot clear a signal that gives no value.
    fn clear_by_operator(&mut self, component: Component) -> bool {
        let signal = match component {
            Component::Signal(signal) => Some(signal),
            Component::Relation(_) | Component::Cause(_) => None,
        };
        if signal.is_some_and(|signal| self.absence(signal).is_some()) {
            return false;
        }
        let is_forgotten = self.forget_learned(component);
        if !self.ledger.clear_by_operator(component) && !is_forgotten {
            return false;
        }
        let pairs = self.monitor.residuals().iter().enumerate();
        let about = pairs.filter(|(_, pair)| rests_on(&self.monitor, pair, component));
        let about: Vec<usize> = about.map(|(place, _)| place).collect();
        self.monitor.forget_pairs(&about);
        signal.into_iter().for_each(|signal| self.monitor.forget_readings(signal));
        true
    }

    fn nothing_to_clear(&self, subject: &Subject, component: Component) -> Refusal {
        let subject = subject.clone();
        match component {
            Component::Signal(signal) if self.absence(signal).is_some() => {
                Refusal::new(Reason::GivesNothing { subject }, Reason::ClearLater)
            }
            _ => Refusal::new(Reason::NotAccused { subject }, Reason::NothingToClear),
        }
    }

    /// Takes over the orders in force before a change or a restart, as far as their names exist, and reports the others. Needs
    /// are tied without a switch, which the caller makes. `elapsed` is the time since the orders were stored.
    pub(super) fn keep_orders(&mut self, orders: &[Order], elapsed: Span, now: Time) {
        for order in orders {
            let kept = match order {
                Order::Forbid(subject) => {
                    self.usable(subject).map(|component| _ = self.ledger.forbid(component))
                }
                Order::Force { need, source } => find_need(&self.knowledge, need).and_then(|need| {
                    let way = self.source(need, source)?;
                    self.providers[need].tie(way);
                    Ok(())
                }),
                Order::Attest { evidence, holds } => self.attest(evidence, *holds).map(|_| ()),
                Order::Override { need, lasts, because } => {
                    self.keep_override(need, *lasts - elapsed, because, now)
                }
                Order::Allow(_) | Order::Release(_) | Order::Clear(_) => Ok(()),
            };
            if let Err(refusal) = kept {
                self.refuse(Reason::NoMoreInForce { order: order.clone() }, refusal, now);
            }
        }
    }

    /// Reports what cannot be done.
    pub(super) fn refuse(&mut self, what: Reason, refusal: Refusal, now: Time) {
        let event = events::refused(Reasons::from(what).then(Joint::Namely, refusal.reasons()), now);
        self.outputs.push_back(Output::Event(event));
    }
}
