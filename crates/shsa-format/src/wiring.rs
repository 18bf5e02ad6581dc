//! The wiring of needs to a bus, in a file of the operator: the form of their values, and for `takeover` the actions that silence
//! the source whose name a substitute takes.
//!
//! ```yaml
//! wiring:
//!   speed:                           # a need: its variable, or its name on the bus
//!     form: like                     # plain, json, or like the messages of its own source
//!     takeover: wheel_1              # whose name is taken; left out: of the signal that serves the need first
//!     silence: { command: [systemctl, stop, wheel-driver] }
//!     restore: { command: [systemctl, start, wheel-driver], within: 10 s }
//!     check: 500 ms                  # as long must nobody else be heard under the name
//!     retry: 30 s                    # after a refusal; twice as long after the next one, up to 20 times
//!     probe: 10 min                  # after so long the source gets a chance; left out: by order only
//! ```
//!
//! An action is one of
//!
//! | | does |
//! |---|---|
//! | `command: [PROGRAM, ARGUMENT, ..]` | runs a program, without a shell; it must exit with status 0 |
//! | `publish: { topic: .., payload: .. }` | sends a message |
//! | `request: { to: .., payload: .., expect: .. }` | Zenoh: a query; MQTT 5: a message that is answered under `to/response`; the answer must hold `expect` |
//! | `service: { name: .., type: .., data: .. }` | calls a service of ROS 2: `std_srvs/srv/SetBool`, `std_srvs/srv/Trigger`, or `lifecycle_msgs/srv/ChangeState` |
//! | `dynamic_security: { client: .. }` | Mosquitto: disables a client, and enables it again |
//!
//! and may have `within:`, its time limit.

mod read;

use shsa_core::knowledge::KnowledgeBase;
use shsa_core::time::Span;
use shsa_model::reader::Reader;
use shsa_model::tree::{self};
use shsa_model::{Report, read_text};
use std::path::Path;

/// The wiring of needs.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Wiring {
    /// The wirings by the names of needs.
    pub needs: Vec<NeedWiring>,
}

/// The wiring of one need.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NeedWiring {
    /// The variable of the need, or its name on the bus.
    pub need: String,
    /// The form of its values; `None` means the form of all others.
    pub form: Option<Form>,
    /// The takeover of the name of the failed source.
    pub takeover: Option<Takeover>,
}

/// The form of values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// The number alone.
    Plain,
    /// An object with value, bounds, time stamp, quality and source.
    Json,
    /// The form of the messages of the source.
    Like,
}

impl Form {
    /// All forms: the name, the form and its description.
    pub const ALL: [(&str, Form, &str); 3] = [
        ("plain", Form::Plain, "The number alone, of an interval its middle; a list in JSON"),
        ("json", Form::Json, "One JSON object: value, lo, hi, stamp_ns, quality, status, source"),
        ("like", Form::Like, "The messages of the need's own source, with the value and the stamp replaced"),
    ];

    /// The form with this name.
    #[must_use]
    pub fn named(name: &str) -> Option<Form> {
        Form::ALL.iter().find(|(known, ..)| *known == name).map(|(_, form, _)| *form)
    }
}

/// How a substitute takes the name of a source.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Takeover {
    /// The signal whose name is taken; `None` means the signal that serves the need first.
    pub signal: Option<String>,
    /// The action that silences the source.
    pub silence: Action,
    /// The action that lets the source publish again.
    pub restore: Option<Action>,
    /// The time during which no other publisher may use the name; `None` means some periods of the signal.
    pub check: Option<Span>,
    /// The time from the first refusal to the next attempt.
    pub retry: Span,
    /// The time after which the source may publish again on trial; `None` means only by order.
    pub probe: Option<Span>,
}

/// An action on a source.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Action {
    /// The kind of the action.
    pub kind: ActionKind,
    /// The time limit of the action.
    pub within: Span,
}

/// The kinds of actions.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ActionKind {
    /// A program and its arguments; never empty.
    Command(Vec<String>),
    /// A message.
    Publish {
        /// The name under which it is published.
        topic: String,
        /// The content.
        payload: String,
    },
    /// A message with an answer.
    Request {
        /// The receiver.
        to: String,
        /// The content.
        payload: String,
        /// A text that the answer must contain.
        expect: Option<String>,
    },
    /// A call of a service of ROS 2.
    Service {
        /// Its name.
        name: String,
        /// The request.
        call: Call,
    },
    /// Mosquitto: a client is enabled or disabled.
    DynamicSecurity {
        /// The user name of the client.
        client: String,
        /// Whether the client is enabled.
        enabled: bool,
    },
}

/// A request to a service of ROS 2.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Call {
    /// `std_srvs/srv/SetBool` with this data.
    SetBool(bool),
    /// `std_srvs/srv/Trigger`.
    Trigger,
    /// `lifecycle_msgs/srv/ChangeState` with the number of this transition.
    ChangeState(u8),
}

impl Wiring {
    /// Reads a file, and checks its names against the models of the run.
    ///
    /// # Errors
    /// All problems with their places.
    pub fn load(path: &Path, models: &[&KnowledgeBase]) -> Result<Wiring, Report> {
        let text = read_text(path, "wiring")?;
        Wiring::read(&text, &path.display().to_string(), models)
    }

    /// Reads a text; `name` is its name in reports.
    ///
    /// # Errors
    /// All problems with their places.
    pub fn read(text: &str, name: &str, models: &[&KnowledgeBase]) -> Result<Wiring, Report> {
        let mut tree = tree::read(text);
        let mut reader = Reader::default();
        let needs = match &tree.root {
            Some(root) => read::needs(&mut reader, root, models),
            None => Vec::new(),
        };
        tree.problems.append(&mut reader.problems);
        match tree.problems.is_empty() {
            true => Ok(Wiring { needs }),
            false => Err(Report::locate(name, text, tree.problems, &tree.rewritten)),
        }
    }

    /// The wiring of the need with this variable and name.
    #[must_use]
    pub fn of(&self, variable: &str, signal: &str) -> Option<&NeedWiring> {
        let named = |name: &str| self.needs.iter().find(|wiring| wiring.need == name);
        named(signal).or_else(|| named(variable))
    }
}

#[cfg(test)]
mod tests;
