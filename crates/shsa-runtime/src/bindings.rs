//! How a model is bound to a bus: the topics of its signals, the outlets of its needs, the names that may be taken over.

use super::inputs::Inputs;
use super::outlet::Outlet;
use super::wiring::Takeover;
use crate::error::{Context, RuntimeError, unfit};
use shsa_bridge::{Bridge, BridgeError, Channel};
use shsa_core::knowledge::{Contract, IdVec, KnowledgeBase, NeedId, SignalId, Subject};
use shsa_core::statement::{Content, Statement};
use shsa_format::wiring::{Form, Wiring};
use std::collections::BTreeMap;

/// Without an identity, messages of others cannot be told from our own.
const NO_IDENTITY: &str = "a takeover needs MQTT 5, Zenoh or ROS 2: over MQTT 3.1.1 and Sparkplug nobody can tell our messages from those of the source that must be silent";

/// What to do where a contract asks for more than the connection has.
const HOW: &str = "use mqtts:// with user=, or with cert= and key=; or Zenoh with tls/ endpoints, and a user or a certificate";

/// What a model needs to know of the bus.
#[derive(Clone, Copy, Debug)]
pub(super) struct BusTraits {
    /// Whether it tells our messages from others.
    knows_own: bool,
    channel: Channel,
}

impl BusTraits {
    pub(super) fn of(bridge: &dyn Bridge) -> BusTraits {
        BusTraits { knows_own: bridge.knows_own(), channel: bridge.channel() }
    }
}

/// How needs go out.
#[derive(Clone, Debug)]
pub(super) struct OutputOptions {
    /// The form of needs for which `wiring` sets none.
    pub(super) form: Form,
    /// The settings of single needs.
    pub(super) wiring: Wiring,
}

/// The signal that serves a need in the fault-free state, by the names of both.
pub(super) type Carriers = BTreeMap<String, String>;

/// All bindings of one model, before anything has been received.
#[derive(Debug, Default)]
pub(super) struct Bindings {
    pub(super) inputs: Inputs,
    pub(super) outlets: IdVec<NeedId, Outlet>,
    pub(super) takeovers: Vec<Takeover>,
    pub(super) carriers: Carriers,
}

impl Bindings {
    /// `carriers` are those found before, `serving` gives the signal that serves a need now.
    ///
    /// # Errors
    /// When a signal's source names no topic and field, a need cannot be published as its wiring demands, or the bus is not
    /// protected as a contract says.
    pub(super) fn new(
        knowledge: &KnowledgeBase,
        output_options: &OutputOptions,
        carriers: &Carriers,
        serving: impl Fn(NeedId) -> Option<SignalId>,
        bus: BusTraits,
    ) -> Result<Bindings, RuntimeError> {
        knowledge.contracts().rows().iter().try_for_each(|contract| check_channel(contract, bus.channel))?;
        let (inputs, carriers) = (Inputs::new(knowledge)?, carriers.clone());
        let mut bindings = Bindings { inputs, carriers, ..Bindings::default() };
        for (id, need) in knowledge.needs().enumerate() {
            let own = own(knowledge, id, bindings.carriers.get(&need.signal), &serving);
            let name = |signal: SignalId| knowledge.signals()[signal].name.clone();
            bindings.carriers.extend(own.map(|own| (need.signal.clone(), name(own))));
            let OutputOptions { form, wiring } = output_options;
            let wiring = wiring.of(&knowledge.variables()[need.variable].name, &need.signal);
            let form = wiring.and_then(|wiring| wiring.form).unwrap_or(*form);
            bindings.outlets.push(Outlet::new(knowledge, id, form, own)?);
            let Some(settings) = wiring.and_then(|wiring| wiring.takeover.as_ref()) else { continue };
            if !bus.knows_own {
                return Err(BridgeError::Configuration(NO_IDENTITY.to_owned()).into());
            }
            let named = settings.signal.as_ref().map(|name| knowledge.signal(name));
            let signal =
                named.unwrap_or(own).with_context(|| format!("takeover for {}: no signal", need.signal))?;
            bindings.takeovers.push(Takeover::new(knowledge, id, signal, settings)?);
        }
        Ok(bindings)
    }
}

/// Checks that messages are protected as a contract asks or gives: `encrypted` and `authenticated` are measured, not declared.
fn check_channel(contract: &Contract, channel: Channel) -> Result<(), RuntimeError> {
    // A platform encrypts other things than messages.
    if contract.subject == Subject::Platform {
        return Ok(());
    }
    let asked = contract.asks.iter().map(|asked| ("asks for", &asked.statement));
    let given = contract.gives.iter().map(|given| ("gives", &given.statement));
    for (verb, statement) in asked.chain(given) {
        for (name, is_there) in channel.properties() {
            if !is_there && says(statement, name) {
                let contract = &contract.name;
                return Err(unfit(format!(
                    "the contract of {contract} {verb} `{name}`, but the connection to the bus is not {name}: {HOW}"
                )));
            }
        }
    }
    Ok(())
}

/// Whether a statement has a property that is true or false.
fn says(statement: &Statement, name: &str) -> bool {
    statement.properties.iter().any(|property| property.name == name && property.content == Content::Binary)
}

/// The signal that serves a need in the fault-free state: as found before, else the one that serves now, else the first one.
fn own(
    knowledge: &KnowledgeBase,
    need: NeedId,
    before: Option<&String>,
    serving: impl Fn(NeedId) -> Option<SignalId>,
) -> Option<SignalId> {
    let variable = knowledge.needs()[need].variable;
    let of_variable = |signal: &SignalId| knowledge.signals()[*signal].variable == variable;
    let before = before.and_then(|name| knowledge.signal(name));
    let found = before.or_else(|| serving(need)).filter(of_variable);
    found.or_else(|| knowledge.signals().ids().find(of_variable))
}
