//! The process that computes one source of one need: it confines itself, reads tasks and writes answers until its input ends.

use super::confine;
use super::frame::{Order, Reply, Word};
use crate::error::{Context, RuntimeError, unfit};
use shsa_core::computation::{Computation, Computed};
use shsa_core::engine::PublishedValue;
use shsa_core::knowledge::{KnowledgeBase, RelationId, SignalId, VariableId};
use shsa_core::substitution::{Step, Substitution, Way};
use std::collections::BTreeMap;
use std::io::{self, Read, stdin, stdout};

/// The main function of the program of [`SandboxOptions`](crate::SandboxOptions). It confines itself, with `memory` bytes beyond
/// its present memory, and computes from standard input to standard output until the input ends. Returns `false` when it cannot
/// do as ordered; it has reported the reason to the starting process.
///
/// # Errors
/// When it cannot even report the reason.
pub fn substitute(memory: u64) -> Result<bool, RuntimeError> {
    let (mut input, mut output) = (stdin().lock(), stdout().lock());
    let prepared = confine::enter(memory)
        .context("shutting it in")
        .and_then(|()| first(&mut input))
        .and_then(|order| computation(&order));
    let mut computation = match prepared {
        Ok(computation) => computation,
        Err(error) => {
            Reply::Refused(error.chain()).write(&mut output)?;
            return Ok(false);
        }
    };
    Reply::Ready.write(&mut output)?;
    while let Some(word) = Word::read(&mut input)? {
        let Word::Task(task, number, is_past) = word else { return Ok(false) };
        let result = computation.carry_out(&task).map(|(computed, validity)| {
            let value = match computed {
                Computed::Scalar(value) => PublishedValue::Scalar(value),
                Computed::Vector(elements) => PublishedValue::Vector(elements.to_vec()),
            };
            (value, validity)
        });
        if !is_past {
            Reply::Answer { number, result }.write(&mut output)?;
        }
    }
    Ok(true)
}

fn first(input: &mut impl Read) -> Result<Order, RuntimeError> {
    match Word::read(input)? {
        Some(Word::Order(order)) => Ok(order),
        _ => Err(io::Error::from(io::ErrorKind::UnexpectedEof).into()),
    }
}

/// Prepares the ordered computation.
fn computation(order: &Order) -> Result<Computation, RuntimeError> {
    let loaded = shsa_model::load(&order.model, "order");
    let knowledge = &loaded.knowledge;
    if !loaded.report.ok() {
        return Err(unfit(loaded.report.render(false)));
    }
    let way = way(order, knowledge).context("the order does not fit its model")?;
    Computation::new(knowledge, way, Computation::fastest_input).context("it is structure only")
}

fn way(order: &Order, knowledge: &KnowledgeBase) -> Option<Way> {
    let relation = |name: &str| -> Option<RelationId> {
        knowledge.relations().enumerate().find(|(_, relation)| relation.name == name).map(|(id, _)| id)
    };
    let step = |(name, output): &(String, String)| -> Option<Step> {
        Some(Step { relation: relation(name)?, output: knowledge.variable(output)? })
    };
    // The steps keep their order, which is that of the inputs.
    let steps = order.steps.iter().map(step).collect::<Option<_>>()?;
    let source = |(variable, signal): &(String, Option<String>)| -> Option<(VariableId, Option<SignalId>)> {
        let signal = match signal {
            None => None,
            Some(signal) => Some(knowledge.signal(signal)?),
        };
        Some((knowledge.variable(variable)?, signal))
    };
    let sources: BTreeMap<_, _> = order.sources.iter().map(source).collect::<Option<_>>()?;
    let (sources, signals) = sources.into_iter().unzip();
    let substitution = Substitution { sink: knowledge.variable(&order.sink)?, steps, sources };
    Some(Way { substitution, signals })
}

impl Order {
    /// The order of a way, with the names and the needed part of the model.
    ///
    /// # Errors
    /// When the model lacks an entry that the way uses.
    pub(super) fn new(way: &Way, live: &shsa_model::live::Live) -> Result<Order, RuntimeError> {
        let knowledge = live.knowledge();
        let variable = |id: VariableId| knowledge.variables()[id].name.clone();
        let relation = |id: RelationId| knowledge.relations()[id].name.clone();
        let steps =
            way.substitution.steps.iter().map(|step| (relation(step.relation), variable(step.output)));
        let steps: Vec<(String, String)> = steps.collect();
        let signal = |id: &Option<SignalId>| id.map(|id| knowledge.signals()[id].name.clone());
        let sources = way.substitution.sources.iter().zip(&way.signals);
        let sources: Vec<_> = sources.map(|(source, id)| (variable(*source), signal(id))).collect();
        let names = steps.iter().map(|(relation, _)| relation.as_str());
        let names = names.chain(sources.iter().filter_map(|(_, signal)| signal.as_deref()));
        let part =
            shsa_core::knowledge::part(live.draft(), &names.collect::<Vec<_>>()).map_err(|unknown| {
                unfit(format!("the model has nothing with the name {}", unknown.join(", ")))
            })?;
        let model = shsa_model::write::yaml(&part);
        Ok(Order { model, sink: variable(way.substitution.sink), steps, sources })
    }
}
