//! Finds demands that only a circle of demands could meet: no guarantee rests on itself, so nothing ever meets them.

use super::super::problems::Problems;
use super::matching::Market;
use crate::knowledge::contract::{Condition, ContractId, Contracts};
use crate::knowledge::draft::ContractDraft;
use crate::knowledge::{Id, IdVec};
use alloc::format;
use alloc::string::ToString;
use alloc::vec;
use alloc::vec::Vec;

/// The most demands that are tried until one is found that rests on itself: a limit for files that ask in circles only.
const MOST_TRIED: usize = 64;

/// A guarantee: its contract, and its place there.
type Offer = (ContractId, usize);

/// Which guarantees hold, by contract and place.
type Holds = IdVec<ContractId, Vec<bool>>;

/// A demand.
struct Ask {
    /// Whether it is met without a guarantee.
    is_met: bool,
    /// The guarantees that meet it.
    offers: Vec<Offer>,
}

/// Who can meet which demand, whichever source serves.
struct Flow<'a> {
    contracts: &'a Contracts,
    /// By contract and place of the demand.
    asks: IdVec<ContractId, Vec<Ask>>,
    /// By contract: who asks for one of its guarantees.
    askers: IdVec<ContractId, Vec<ContractId>>,
}

/// Warns of the first demand that rests on itself and on nothing else.
///
/// All evidence is taken as true, and each demand as asked of everybody who could serve: what is told holds for every choice of
/// sources. Time: linear in the demands and their offers, for each demand that is tried.
pub(super) fn check(problems: &mut Problems, market: &Market<'_>, drafts: &[&ContractDraft]) {
    let flow = Flow::new(market);
    let (least, greatest) = (flow.settled(false, None), flow.settled(true, None));
    let rows = market.contracts.rows();
    let asks = rows.enumerate().flat_map(|(id, row)| (0..row.asks.len()).map(move |at| (id, at)));
    let circular = asks.filter(|&(id, at)| flow.is_met(&greatest, id, at) && !flow.is_met(&least, id, at));
    let Some((id, at)) = circular.take(MOST_TRIED).find(|&(id, at)| flow.rests_on_itself(id, at)) else {
        return;
    };
    let (Some(asked), Some(draft)) = (rows[id].asks.get(at), drafts.get(id.index())) else { return };
    let place = draft.asks.iter().find(|it| it.name.text == asked.name).map_or(&draft.name, |it| &it.name);
    let message =
        format!("nothing can ever meet `{}`: whoever gives it asks for it, in a circle", asked.name);
    problems.warn(place, message, "nothing rests on itself: let one of the circle ask for less".to_string());
}

impl<'a> Flow<'a> {
    fn new(market: &Market<'a>) -> Flow<'a> {
        let rows = market.contracts.rows();
        let mut askers = IdVec::filled(rows.len(), |_: ContractId| Vec::new());
        let asks = IdVec::filled(rows.len(), |id: ContractId| {
            let ask = |asked| {
                let (is_met, offers) = market.meets(id, asked);
                offers.iter().for_each(|&(of, _): &Offer| askers[of].push(id));
                Ask { is_met, offers }
            };
            rows[id].asks.iter().map(ask).collect()
        });
        Flow { contracts: market.contracts, asks, askers }
    }

    /// The least fixed point where nothing holds at first, the greatest where all does; `met` is a demand that is taken as met.
    fn settled(&self, first: bool, met: Option<Offer>) -> Holds {
        let rows = self.contracts.rows();
        let mut holds = IdVec::filled(rows.len(), |id: ContractId| vec![first; rows[id].gives.len()]);
        let mut open: Vec<ContractId> = rows.ids().collect();
        while let Some(id) = open.pop() {
            let is_met = |at: usize| met == Some((id, at)) || self.is_met(&holds, id, at);
            let now: Vec<bool> = rows[id].gives.iter().map(|given| is_true(&given.when, &is_met)).collect();
            if now != holds[id] {
                holds[id] = now;
                open.extend(&self.askers[id]);
            }
        }
        holds
    }

    fn is_met(&self, holds: &Holds, id: ContractId, at: usize) -> bool {
        let holds = |&(of, at): &Offer| holds[of].get(at).copied().unwrap_or(false);
        self.asks[id].get(at).is_some_and(|ask| ask.is_met || ask.offers.iter().any(holds))
    }

    /// Whether a demand that nothing meets would be met if it were met.
    fn rests_on_itself(&self, id: ContractId, at: usize) -> bool {
        self.is_met(&self.settled(false, Some((id, at))), id, at)
    }
}

/// Whether a condition holds where all evidence does.
fn is_true(condition: &Condition, is_met: &dyn Fn(usize) -> bool) -> bool {
    match condition {
        Condition::All(parts) => parts.iter().all(|part| is_true(part, is_met)),
        Condition::Any(parts) => parts.iter().any(|part| is_true(part, is_met)),
        Condition::AtLeast(needed, parts) => {
            parts.iter().filter(|part| is_true(part, is_met)).count() >= *needed as usize
        }
        Condition::Asked(at) => is_met(*at),
        Condition::Watched(_) => true,
    }
}
