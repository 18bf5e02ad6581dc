//! What is left if more is lost: how many losses each need survives now, and what would take over.

use super::super::http::Shared;
use super::board::Board;
use serde_json::{Map, Value, json};
use shsa_core::analysis::{self, Tolerance};
use shsa_core::engine::WhatIf;
use shsa_core::knowledge::{KnowledgeBase, NeedId, SignalId, SignalSet};
use shsa_core::substitution::Way;
use std::collections::BTreeSet;
use tokio::task::spawn_blocking;

/// What may be spent on the needs of one model after a decision, in steps.
const STEPS: u64 = 300_000;
/// So many losses of one signal are told of each need.
const MOST_LOSSES: usize = 200;

/// Finds out how many losses the needs survive now, beside everything else; it is on the board when it is known.
pub(super) fn look_ahead(shared: &Shared, board: &Board) {
    // Who finds out already looks again when it is done.
    let Ok(turn) = shared.pages.turn.clone().try_lock_owned() else { return };
    let (shared, mut models) = (shared.clone(), losses(board));
    tokio::spawn(async move {
        loop {
            for (model, lost) in &models {
                let Some(rows) = tolerances(&shared, model, lost.clone()).await else { return };
                shared.pages.board.lock().await.add(model, "tolerance", rows);
            }
            let board = shared.pages.board.lock().await;
            let news = losses(&board);
            if news == models {
                // Before the board is let go: what is decided next finds the turn free.
                drop(turn);
                return;
            }
            models = news;
        }
    });
}

/// By model and version, the signals that nothing may rest on now.
fn losses(board: &Board) -> Vec<(String, BTreeSet<String>)> {
    let lost = |model: &str| {
        let rows = board.rows(model, "lost").map(|(name, _)| name.to_owned());
        (model.to_owned(), rows.collect())
    };
    board.models().map(lost).collect()
}

async fn tolerances(shared: &Shared, model: &str, lost: BTreeSet<String>) -> Option<Value> {
    let model = shared.pages.known.model(shared, model).await?;
    spawn_blocking(move || {
        let knowledge = model.knowledge();
        let lost: SignalSet = lost.iter().filter_map(|name| knowledge.signal(name)).collect();
        let options = analysis::Options { only_runnable: true, steps: STEPS, ..analysis::Options::default() };
        let needs = analysis::tolerances(knowledge, &lost, options);
        let row = |(need, tolerance)| (knowledge.need_name(need).to_owned(), row(knowledge, tolerance));
        Value::Object(needs.enumerate().map(row).collect())
    })
    .await
    .ok()
}

fn row(knowledge: &KnowledgeBase, tolerance: &Tolerance) -> Value {
    json!({
        "known": tolerance.known,
        "survives": tolerance.survives,
        "exact": tolerance.exact,
        "cut": tolerance.cut.iter().map(|signal| &*knowledge.signals()[signal].name).collect::<Vec<_>>(),
    })
}

/// What would serve each need without some signals, and what each further loss would bring.
///
/// # Errors
/// The name of a signal that the model does not have.
pub(super) fn what_if(model: &WhatIf, lost: &[String]) -> Result<Value, String> {
    let knowledge = model.knowledge();
    let find =
        |name: &String| knowledge.signal(name).ok_or_else(|| format!("the model has no signal '{name}'"));
    let lost: Vec<SignalId> = lost.iter().map(find).collect::<Result<_, _>>()?;
    let needs = knowledge
        .needs()
        .ids()
        .map(|need| (knowledge.need_name(need).to_owned(), of_need(model, need, &lost)));
    Ok(Value::Object(needs.collect::<Map<_, _>>()))
}

fn of_need(model: &WhatIf, need: NeedId, lost: &[SignalId]) -> Value {
    let knowledge = model.knowledge();
    let best = |lost: &[SignalId]| model.ways(need, lost).into_iter().next();
    let now = best(lost);
    let further = model.matters(need).iter().filter(|signal| !lost.contains(signal)).take(MOST_LOSSES);
    let further = further.map(|&signal| {
        let then = best(&[lost, &[signal]].concat());
        json!({
            "signal": knowledge.signals()[signal].name,
            "changes": then != now,
            "then": then.map(|way| told(knowledge, &way)),
        })
    });
    json!({
        "variable": knowledge.variables()[knowledge.needs()[need].variable].name,
        "whole": best(&[]).map(|way| told(knowledge, &way)),
        "now": now.as_ref().map(|way| told(knowledge, way)),
        "further": further.collect::<Vec<_>>(),
    })
}

fn told(knowledge: &KnowledgeBase, (way, utility): &(Way, f64)) -> Value {
    json!({ "words": way.describe(knowledge), "utility": utility })
}
