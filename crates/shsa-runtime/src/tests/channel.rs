//! What contracts say of the connection to the bus.

use super::{Bench, Faulty, Refusals, TWO, named, options};
use crate::Runtime;
use shsa_bridge::memory::MemoryBus;
use shsa_bridge::{Bridge, Clock};
use shsa_format::wiring::Wiring;
use shsa_model::live::{Live, Written};

/// The answer of a run to a model whose contracts have these lines, on a bus without any protection and on one within the process.
#[track_caller]
fn check_channel(contracts: &str, refused: &str) {
    let text = format!("{TWO}contracts:\n  speed: {{ asks: {{ wire: {{ of: speed, {contracts} }} }} }}\n");
    let begin = |text: &str, is_plain: bool| {
        let bus = MemoryBus::new(Clock::running());
        let bridge: Box<dyn Bridge> = match is_plain {
            true => Box::new(Faulty { bus: bus.join(64), refusals: Refusals::default() }),
            false => Box::new(bus.join(64)),
        };
        let (live, _) = Live::load(Written { name: "model", text })
            .unwrap_or_else(|report| panic!("{}", report.render(false)));
        Runtime::new(vec![named(live)], options(Wiring::default()), bridge)
            .map(drop)
            .map_err(|it| it.to_string())
    };
    assert_eq!(begin(&text, false), Ok(()));
    let answer = begin(&text, true).err().unwrap_or_default();
    assert!(answer.starts_with(refused) && answer.is_empty() == refused.is_empty(), "{answer}");
    // A model that comes later is refused as well, and the run goes on with the one that it has.
    let bench = Bench::wired(TWO, "{ form: plain }", &[]);
    let changed = bench.change(&text).err().unwrap_or_default();
    assert!(changed.starts_with(refused) && changed.is_empty() == refused.is_empty(), "{changed}");
}

#[test]
fn what_contracts_say_of_the_connection_is_measured() {
    let told =
        |name: &str| format!("the contract of speed asks for `{name}`, but the connection to the bus is not");
    check_channel("encrypted: yes", &told("encrypted"));
    check_channel("error: at most 1 m/s, authenticated: yes", &told("authenticated"));
    check_channel("error: at most 1 m/s", "");
    check_channel("calibrated: yes", "");
}
