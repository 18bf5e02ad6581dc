//! How needs are wired to a bus, in a file of the operator: the form of their values, and for `takeover` the actions that
//! silence the source whose name a substitute takes.
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

use crate::model::reader::Reader;
use crate::model::tree::{self};
use crate::model::{Report, read_text};
use shsa_core::knowledge::KnowledgeBase;
use shsa_core::time::Span;
use std::path::Path;

/// How needs are wired.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Wiring {
    /// By the names of needs.
    pub needs: Vec<NeedWiring>,
}

/// How one need is wired.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NeedWiring {
    /// The need's variable, or its name on the bus.
    pub need: String,
    /// How its values are written; `None`: as those of all others.
    pub form: Option<Form>,
    /// Where the substitute takes the name of the failed source.
    pub takeover: Option<Takeover>,
}

/// How values are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// The number alone.
    Plain,
    /// An object with value, bounds, stamp, quality and source.
    Json,
    /// As the source writes its messages.
    Like,
}

impl Form {
    /// All of them: how each is called, and what it is.
    pub const ALL: [(&str, Form, &str); 3] = [
        ("plain", Form::Plain, "The number alone, of an interval its middle; a list in JSON"),
        ("json", Form::Json, "One JSON object: value, lo, hi, stamp_ns, quality, status, source"),
        ("like", Form::Like, "The messages of the need's own source, with the value and the stamp replaced"),
    ];

    /// The one that is called so.
    #[must_use]
    pub fn named(name: &str) -> Option<Form> {
        Form::ALL.iter().find(|(known, ..)| *known == name).map(|(_, form, _)| *form)
    }
}

/// What is done with a source so that its name can be taken.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Takeover {
    /// The signal whose name is taken; `None`: of the one that serves the need first.
    pub signal: Option<String>,
    /// Silences its source.
    pub silence: Action,
    /// Lets it publish again.
    pub restore: Option<Action>,
    /// As long must nobody else be heard under the name; `None`: some periods of the signal.
    pub check: Option<Span>,
    /// How long after the first refusal it is tried again.
    pub retry: Span,
    /// After so long the source gets a chance; `None`: by order only.
    pub probe: Option<Span>,
}

/// Something that is done to a source.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Action {
    /// What.
    pub kind: ActionKind,
    /// How long it may take.
    pub within: Span,
}

/// The kinds of actions.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ActionKind {
    /// A program and its arguments; never empty.
    Command(Vec<String>),
    /// A message.
    Publish {
        /// The name to publish under.
        topic: String,
        /// What it holds.
        payload: String,
    },
    /// A message that is answered.
    Request {
        /// Who answers.
        to: String,
        /// What it holds.
        payload: String,
        /// What the answer must hold.
        expect: Option<String>,
    },
    /// A call of a service of ROS 2.
    Service {
        /// Its name.
        name: String,
        /// What is asked.
        call: Call,
    },
    /// Mosquitto: a client is enabled or disabled.
    DynamicSecurity {
        /// The user name under which the client comes.
        client: String,
        /// Whether it may come.
        enabled: bool,
    },
}

/// What a service of ROS 2 is asked.
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
    /// Reads a file, and checks the names in it against the models that are run.
    ///
    /// # Errors
    /// Everything that is wrong with it, with places.
    pub fn load(path: &Path, models: &[&KnowledgeBase]) -> Result<Wiring, Report> {
        let text = read_text(path, "wiring")?;
        Wiring::read(&text, &path.display().to_string(), models)
    }

    /// Reads a text; `name` is what reports call it.
    ///
    /// # Errors
    /// Everything that is wrong with it, with places.
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

    /// How a need of this variable and this name is wired.
    #[must_use]
    pub fn of(&self, variable: &str, signal: &str) -> Option<&NeedWiring> {
        let named = |name: &str| self.needs.iter().find(|wiring| wiring.need == name);
        named(signal).or_else(|| named(variable))
    }
}

#[cfg(test)]
mod tests;
