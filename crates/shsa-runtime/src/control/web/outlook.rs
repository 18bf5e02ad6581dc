//! How many further losses each need survives, and what would serve it next.

use super::super::http::Shared;
use super::board::Board;
use super::what_if::Served;
use serde_json::{Value, json};
use shsa_core::analysis::{self, Tolerance};
use shsa_core::knowledge::{KnowledgeBase, SignalSet};
use std::collections::{BTreeMap, BTreeSet};
use tokio::task::spawn_blocking;

/// The effort for the needs of one model after a decision, in steps.
const STEPS: u64 = 300_000;

/// Computes in a thread of its own how many losses the needs survive now; the result goes to the board.
pub(super) fn look_ahead(shared: &Shared, board: &Board) {
    // The thread that computes at present starts again at its end.
    let Ok(turn) = shared.pages.turn.clone().try_lock_owned() else { return };
    let (shared, mut known) = (shared.clone(), situations(board));
    tokio::spawn(async move {
        loop {
            for situation in &known {
                let Some(rows) = tolerances(&shared, situation.clone()).await else { return };
                shared.pages.board.lock().await.add(&situation.model, "tolerance", rows);
            }
            let board = shared.pages.board.lock().await;
            let now = situations(&board);
            if now == known {
                // Released before the board, so that the next decision can start a new computation.
                drop(turn);
                return;
            }
            known = now;
        }
    });
}

/// The present state of a model.
#[derive(Clone, PartialEq, Eq)]
struct Situation {
    model: String,
    /// The signals that nothing may rest on.
    lost: BTreeSet<String>,
    /// The signals that serve each need.
    serving: BTreeMap<String, Vec<String>>,
}

fn situations(board: &Board) -> Vec<Situation> {
    let of_model = |model: &str| Situation {
        model: model.to_owned(),
        lost: board.rows(model, "lost").map(|(name, _)| name.to_owned()).collect(),
        serving: board
            .rows(model, "needs")
            .map(|(name, need)| (name.to_owned(), serving(board, model, name, need)))
            .collect(),
    };
    board.models().map(of_model).collect()
}

/// The signals of the way that serves a need.
fn serving(board: &Board, model: &str, name: &str, need: &Value) -> Vec<String> {
    let mut ahead = board.rows(model, "ahead").filter(|(need, _)| *need == name);
    let ways = ahead.next().and_then(|(_, ways)| ways.as_array()).into_iter().flatten();
    let signals = ways
        .filter(|way| way.get("words") == need.get("way"))
        .filter_map(|way| way.get("signals")?.as_array());
    signals.flatten().filter_map(|signal| signal.as_str().map(str::to_owned)).collect()
}

/// How many more losses each need survives, and what would serve it if the signals that serve it now were lost.
async fn tolerances(shared: &Shared, situation: Situation) -> Option<Value> {
    let model = shared.pages.known.model(shared, &situation.model).await?;
    spawn_blocking(move || {
        let knowledge = model.knowledge();
        let lost: SignalSet = situation.lost.iter().filter_map(|name| knowledge.signal(name)).collect();
        let options = analysis::Options { only_runnable: true, steps: STEPS, ..analysis::Options::default() };
        let needs = analysis::tolerances(knowledge, &lost, options);
        let rows = needs.enumerate().map(|(need, tolerance)| {
            let name = knowledge.need_name(need);
            let serving = situation.serving.get(name).into_iter().flatten();
            let all = lost.iter().chain(serving.filter_map(|name| knowledge.signal(name)));
            let next = model.best(need, &all.collect::<Vec<_>>()).filter(Served::is_admitted);
            (name.to_owned(), row(knowledge, tolerance, next.map(|next| next.way.describe(knowledge))))
        });
        Value::Object(rows.collect())
    })
    .await
    .ok()
}

fn row(knowledge: &KnowledgeBase, tolerance: &Tolerance, next: Option<String>) -> Value {
    json!({
        "next": next,
        "known": tolerance.known,
        "survives": tolerance.survives,
        "exact": tolerance.exact,
        "cut": tolerance.cut.iter().map(|signal| &*knowledge.signals()[signal].name).collect::<Vec<_>>(),
    })
}
