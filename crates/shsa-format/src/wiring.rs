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

use crate::model::reader::{Fields, Keys, Reader};
use crate::model::tree::{self, Node, Value};
use crate::model::{Report, read_text};
use shsa_core::knowledge::{KnowledgeBase, Text, VariableId};
use shsa_core::time::Span;
use shsa_core::unit::nearest;
use shsa_message::span::parse_span;
use std::path::Path;

/// How long an action may take where it does not say so itself.
const WITHIN: Span = Span::from_millis(5_000);
/// The longest that an action may ask for.
const WITHIN_MAX: Span = Span::from_millis(300_000);
/// How long after a refusal the source is silenced again.
const RETRY: Span = Span::from_millis(30_000);

const ROOT: [&str; 1] = ["wiring"];
const NEED: [&str; 7] = ["form", "takeover", "silence", "restore", "check", "retry", "probe"];
const ACTION: [&str; 6] = ["command", "publish", "request", "service", "dynamic_security", "within"];
const EXAMPLE: &str = "silence: { command: [systemctl, stop, wheel-driver] }";

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

/// The transitions of a node's life by name: `lifecycle_msgs/msg/Transition`.
const TRANSITIONS: [(&str, u8); 4] = [("configure", 1), ("cleanup", 2), ("activate", 3), ("deactivate", 4)];

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
            Some(root) => needs(&mut reader, root, models),
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

fn needs(reader: &mut Reader, root: &Node, models: &[&KnowledgeBase]) -> Vec<NeedWiring> {
    let example = "wiring: { speed: { form: like } }";
    let fields = reader.fields(root, "a wiring: a mapping", &ROOT, example);
    let Some(node) = fields.get("wiring") else { return Vec::new() };
    let entries = reader.entries(node, "names of needs with their wiring", example);
    entries.iter().map(|entry| need(reader, entry, models)).collect()
}

fn need(reader: &mut Reader, (name, node): &(Text, Node), models: &[&KnowledgeBase]) -> NeedWiring {
    let variables = variables_of(reader, name, models);
    let fields = reader.fields(node, "the wiring of a need", &NEED, EXAMPLE);
    let mut keys = Keys { reader, fields };
    let form = keys.text("form", "`plain`, `json` or `like`", "like");
    let form = form.and_then(|form| form_of(keys.reader, &form));
    NeedWiring { need: name.text.clone(), form, takeover: takeover(&mut keys, name, &variables) }
}

/// The needed variable, in each model that has it.
fn variables_of<'m>(
    reader: &mut Reader,
    name: &Text,
    models: &[&'m KnowledgeBase],
) -> Vec<(&'m KnowledgeBase, VariableId)> {
    let names = |model: &'m KnowledgeBase| {
        let named = move |need: &'m shsa_core::knowledge::Need| {
            let variable = model.variables()[need.variable].name.as_str();
            (model, need.variable, variable, need.signal.as_str())
        };
        model.needs().iter().map(named)
    };
    let all = || models.iter().copied().flat_map(names);
    let found = all().filter(|(.., variable, signal)| name.text == *variable || name.text == *signal);
    let found: Vec<_> = found.map(|(model, variable, ..)| (model, variable)).collect();
    if found.is_empty() {
        let known: Vec<&str> = all().flat_map(|(.., variable, signal)| [variable, signal]).collect();
        let help = suggestion(&name.text, &known, "the needs are");
        reader.note(name.place, &format!("there is no need `{}`", name.text), &help);
    }
    found
}

fn suggestion(name: &str, known: &[&str], what: &str) -> String {
    let all = format!("{what}: {}", known.join(", "));
    nearest(name, known.iter().copied()).map_or(all.clone(), |near| format!("did you mean `{near}`? {all}"))
}

fn form_of(reader: &mut Reader, form: &Text) -> Option<Form> {
    let forms = [("plain", Form::Plain), ("json", Form::Json), ("like", Form::Like)];
    let found = forms.iter().find(|(name, _)| *name == form.text).map(|(_, form)| *form);
    if found.is_none() {
        let message = format!("there is no form `{}`", form.text);
        reader.note(form.place, &message, "write plain, json or like");
    }
    found
}

fn takeover(
    keys: &mut Keys<'_, '_>,
    name: &Text,
    variables: &[(&KnowledgeBase, VariableId)],
) -> Option<Takeover> {
    let signal = keys.text("takeover", "the name of a signal", "wheel_1");
    signal.iter().for_each(|signal| check_signal(keys.reader, signal, variables));
    let [silence, restore] = [("silence", false), ("restore", true)]
        .map(|(key, on)| keys.fields.get(key).map(|node| action(keys.reader, node, on)));
    let [check, retry, probe] = ["check", "retry", "probe"].map(|key| span(keys, key));
    let Some(silence) = silence else {
        if NEED.iter().any(|key| !["form", "silence"].contains(key) && keys.fields.get(key).is_some()) {
            let message = format!("`{}` does not say how the source is silenced", name.text);
            keys.reader.note(name.place, &message, &format!("write it like `{EXAMPLE}`"));
        }
        return None;
    };
    let silence = silence?;
    let restore = match (restore, &silence.kind) {
        (Some(restore), _) => Some(restore?),
        // The opposite is known.
        (None, ActionKind::DynamicSecurity { client, .. }) => Some(Action {
            kind: ActionKind::DynamicSecurity { client: client.clone(), enabled: true },
            within: silence.within,
        }),
        (None, _) => None,
    };
    if probe.is_some() && restore.is_none() {
        let message = format!("`{}` has `probe`, and no action that lets the source publish", name.text);
        keys.reader.note(name.place, &message, "give it `restore`, too");
    }
    let signal = signal.map(|signal| signal.text);
    Some(Takeover { signal, silence, restore, check, retry: retry.unwrap_or(RETRY), probe })
}

/// Only what carries the needed variable itself can be replaced by its value.
fn check_signal(reader: &mut Reader, signal: &Text, variables: &[(&KnowledgeBase, VariableId)]) {
    let carries = |(model, variable): &(&KnowledgeBase, VariableId)| {
        model.signal(&signal.text).is_some_and(|id| model.signals()[id].variable == *variable)
    };
    if variables.is_empty() || variables.iter().any(carries) {
        return;
    }
    let candidates = variables.iter().flat_map(|(model, variable)| {
        let of_variable = model.signals().iter().filter(|signal| signal.variable == *variable);
        of_variable.map(|signal| signal.name.as_str())
    });
    let candidates: Vec<&str> = candidates.collect();
    let message = format!("`{}` is no signal of the needed variable", signal.text);
    let help = match candidates.is_empty() {
        true => "no signal carries this variable: leave `takeover` and `silence` out".to_owned(),
        false => suggestion(&signal.text, &candidates, "its signals are"),
    };
    reader.note(signal.place, &message, &help);
}

fn span(keys: &mut Keys<'_, '_>, key: &str) -> Option<Span> {
    let text = keys.span(key)?;
    match parse_span(&text.text) {
        Ok(span) if span > Span::ZERO => Some(span),
        Ok(_) => {
            keys.reader.note(text.place, "a time longer than none is expected", "write it like `500 ms`");
            None
        }
        Err(why) => {
            keys.reader.note(text.place, &why, "write it like `500 ms`");
            None
        }
    }
}

fn action(reader: &mut Reader, node: &Node, on: bool) -> Option<Action> {
    let fields = reader.fields(node, "an action", &ACTION, EXAMPLE);
    let mut keys = Keys { reader, fields };
    let within = span(&mut keys, "within").unwrap_or(WITHIN);
    if within > WITHIN_MAX {
        keys.reader.wrong(node, "an action takes at most 5 min", "give `within` a shorter time");
    }
    let given: Vec<&str> = ACTION[..5].iter().copied().filter(|key| keys.fields.get(key).is_some()).collect();
    let [kind] = given.as_slice() else {
        let message = format!("an action is one thing, found {}", given.len());
        keys.reader.wrong(node, &message, &format!("one of {}", ACTION[..5].join(", ")));
        return None;
    };
    let node = keys.fields.get(kind)?;
    let kind = match *kind {
        "command" => command(keys.reader, node),
        "publish" => publish(keys.reader, node),
        "request" => request(keys.reader, node),
        "service" => service(keys.reader, node),
        _ => dynamic_security(keys.reader, node, on),
    };
    Some(Action { kind: kind?, within })
}

fn command(reader: &mut Reader, node: &Node) -> Option<ActionKind> {
    let example = "command: [systemctl, stop, wheel-driver]";
    let Value::List(_) = &node.value else {
        reader.wrong(node, "a program and its arguments are expected as a list: there is no shell", example);
        return None;
    };
    let words = reader.names(node, "a program and its arguments", example);
    if words.first().is_none_or(|program| program.text.is_empty()) {
        reader.wrong(node, "the program is missing", example);
        return None;
    }
    Some(ActionKind::Command(words.into_iter().map(|word| word.text).collect()))
}

fn publish(reader: &mut Reader, node: &Node) -> Option<ActionKind> {
    let example = "publish: { topic: robot/wheel/enable, payload: off }";
    let fields = reader.fields(node, "a message", &["topic", "payload"], example);
    let topic = required(reader, node, &fields, "topic", example)?;
    Some(ActionKind::Publish { topic, payload: payload(&fields) })
}

fn request(reader: &mut Reader, node: &Node) -> Option<ActionKind> {
    let example = "request: { to: robot/wheel/silence, payload: 1, expect: ok }";
    let fields = reader.fields(node, "a request", &["to", "payload", "expect"], example);
    let to = required(reader, node, &fields, "to", example)?;
    let expect = fields.get("expect").and_then(|node| reader.text(node, "a text", example));
    Some(ActionKind::Request { to, payload: payload(&fields), expect: expect.map(|text| text.text) })
}

fn service(reader: &mut Reader, node: &Node) -> Option<ActionKind> {
    let example = "service: { name: /wheel/enable, type: std_srvs/srv/SetBool, data: false }";
    let fields = reader.fields(node, "a call of a service", &["name", "type", "data"], example);
    let name = required(reader, node, &fields, "name", example)?;
    let service_type = required(reader, node, &fields, "type", example)?;
    let data = fields.get("data").and_then(|node| reader.text(node, "a word", example));
    let data = data.as_ref().map(|data| data.text.as_str());
    let transition = |name: &str| TRANSITIONS.iter().find(|(known, _)| *known == name).map(|(_, id)| *id);
    let call = match (service_type.trim_start_matches('/'), data) {
        ("std_srvs/srv/SetBool", Some("true")) => Call::SetBool(true),
        ("std_srvs/srv/SetBool", Some("false")) => Call::SetBool(false),
        ("std_srvs/srv/Trigger", None) => Call::Trigger,
        ("lifecycle_msgs/srv/ChangeState", Some(data)) if transition(data).is_some() => {
            Call::ChangeState(transition(data)?)
        }
        _ => {
            let help = "std_srvs/srv/SetBool with `data: true` or `false`, std_srvs/srv/Trigger without, \
                        lifecycle_msgs/srv/ChangeState with configure, cleanup, activate or deactivate";
            reader.wrong(node, &format!("`{service_type}` cannot be called like this"), help);
            return None;
        }
    };
    Some(ActionKind::Service { name, call })
}

fn dynamic_security(reader: &mut Reader, node: &Node, enabled: bool) -> Option<ActionKind> {
    let example = "dynamic_security: { client: wheel-driver }";
    let fields = reader.fields(node, "a client of Mosquitto", &["client"], example);
    let client = required(reader, node, &fields, "client", example)?;
    Some(ActionKind::DynamicSecurity { client, enabled })
}

fn required(
    reader: &mut Reader,
    node: &Node,
    fields: &Fields<'_>,
    key: &str,
    example: &str,
) -> Option<String> {
    let found = fields.get(key).and_then(|node| reader.text(node, "a text", example));
    let found = found.map(|text| text.text).filter(|text| !text.is_empty());
    if found.is_none() {
        reader.wrong(node, &format!("`{key}` is missing"), &format!("write it like `{example}`"));
    }
    found
}

/// A payload as it is sent: a text as it is, anything else as JSON, in which words stand in quotes and numbers do not.
fn payload(fields: &Fields<'_>) -> String {
    match fields.get("payload").map(|node| &node.value) {
        None => String::new(),
        Some(Value::Scalar(text)) => text.text.clone(),
        Some(value) => json(value).to_string(),
    }
}

fn json(value: &Value) -> serde_json::Value {
    match value {
        Value::Null | Value::Unread => serde_json::Value::Null,
        Value::Scalar(text) => {
            let number = serde_json::from_str::<serde_json::Value>(&text.text);
            let plain = number.ok().filter(|value| value.is_number() || value.is_boolean());
            plain.unwrap_or_else(|| text.text.clone().into())
        }
        Value::List(items) => items.iter().map(|item| json(&item.value)).collect(),
        Value::Map(entries) => {
            let entries = entries.iter().map(|(key, node)| (key.text.clone(), json(&node.value)));
            serde_json::Value::Object(entries.collect())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MODEL: &str = "
shsa: 1
variables: { speed: { unit: m/s }, place: { unit: m } }
signals:
  left:  { variable: speed }
  right: { variable: speed }
  where: { variable: place }
needs:
  speed: { signal: /car/speed, max_age: 1 s }
";

    fn read(text: &str) -> Result<Wiring, Report> {
        let loaded = crate::model::load(MODEL, "model.yaml");
        assert!(loaded.report.ok(), "{}", loaded.report.render(false));
        Wiring::read(text, "wiring.yaml", &[&loaded.knowledge])
    }

    fn action(text: &str) -> Action {
        let wiring = read(&format!("wiring: {{ speed: {{ silence: {text} }} }}"));
        let wiring = wiring.unwrap_or_else(|report| panic!("{}", report.render(false)));
        wiring.of("speed", "").unwrap().takeover.clone().unwrap().silence
    }

    /// The first problem: where, what, and the help.
    #[track_caller]
    fn check_wrong(text: &str, expected: &str) {
        let report = read(text).unwrap_err();
        let first = &report.diagnostics[0];
        let help = first.help.clone().unwrap_or_default();
        let found = format!("{}:{} {}; {help}", first.line, first.column, first.message);
        assert!(found.starts_with(expected), "{found}");
    }

    #[test]
    fn a_need_is_wired_by_its_variable_or_its_name() {
        let text = "
wiring:
  /car/speed:
    form: like
    takeover: right
    silence: { command: [systemctl, stop, 'wheel driver'], within: 2 s }
    restore: { publish: { topic: on, payload: 1 } }
    check: 500 ms
    probe: 10 min
";
        let wiring = read(text).unwrap();
        let need = wiring.of("speed", "/car/speed").unwrap();
        assert_eq!(need.form, Some(Form::Like));
        let takeover = need.takeover.clone().unwrap();
        let words = ["systemctl", "stop", "wheel driver"].map(String::from).into();
        let silence = Action { kind: ActionKind::Command(words), within: Span::from_millis(2_000) };
        let restore =
            Action { kind: ActionKind::Publish { topic: "on".into(), payload: "1".into() }, within: WITHIN };
        let expected = Takeover {
            signal: Some("right".into()),
            silence,
            restore: Some(restore),
            check: Some(Span::from_millis(500)),
            retry: RETRY,
            probe: Some(Span::from_millis(600_000)),
        };
        assert_eq!(takeover, expected);
        assert_eq!(read("").unwrap(), Wiring::default());
        assert!(read("wiring: { speed: { form: plain } }").unwrap().needs[0].takeover.is_none());
    }

    #[test]
    fn payloads_are_texts_or_json() {
        let payload = |text: &str| match action(text).kind {
            ActionKind::Request { payload, .. } | ActionKind::Publish { payload, .. } => payload,
            other => panic!("{other:?}"),
        };
        assert_eq!(payload("{ request: { to: a, payload: off } }"), "off");
        assert_eq!(payload("{ request: { to: a } }"), "");
        let nested = "{ publish: { topic: a, payload: { commands: [{ do: it, times: 2, now: true }] } } }";
        assert_eq!(payload(nested), r#"{"commands":[{"do":"it","times":2,"now":true}]}"#);
    }

    #[test]
    fn services_and_clients_are_named() {
        let service = |name: &str, call| ActionKind::Service { name: name.into(), call };
        let set = "{ service: { name: /wheel/enable, type: std_srvs/srv/SetBool, data: false } }";
        assert_eq!(action(set).kind, service("/wheel/enable", Call::SetBool(false)));
        let change =
            "{ service: { name: /w/change_state, type: lifecycle_msgs/srv/ChangeState, data: deactivate } }";
        assert_eq!(action(change).kind, service("/w/change_state", Call::ChangeState(4)));
        let client = |enabled| ActionKind::DynamicSecurity { client: "w".into(), enabled };
        assert_eq!(action("{ dynamic_security: { client: w } }").kind, client(false));
        let wiring = read("wiring: { speed: { silence: { dynamic_security: { client: w } } } }").unwrap();
        let takeover = wiring.needs[0].takeover.clone().unwrap();
        assert_eq!(takeover.restore.unwrap().kind, client(true));
    }

    #[test]
    fn what_is_wrong_has_a_place_and_help() {
        let silence = |text: &str| format!("wiring:\n  speed:\n    silence: {text}");
        for (text, expected) in [
            ("wirings: {}", "1:1 unknown key `wirings`; did you mean `wiring`?"),
            ("wiring:\n  sped: { form: json }", "2:3 there is no need `sped`; did you mean `speed`?"),
            ("wiring:\n  speed: { form: jsn }", "2:18 there is no form `jsn`; write plain"),
            ("wiring:\n  speed: { shape: json }", "2:12 unknown key `shape`"),
            ("wiring:\n  speed: { takeover: left }", "2:3 `speed` does not say how the source is silenced"),
            (
                "wiring:\n  speed: { takeover: where, silence: { command: [a] } }",
                "2:22 `where` is no signal of the needed variable; its signals are: left, right",
            ),
            (
                "wiring:\n  speed: { probe: 1 min, silence: { command: [a] } }",
                "2:3 `speed` has `probe`, and no action",
            ),
            (&silence("{ command: systemctl stop it }"), "3:25 a program and its arguments are expected"),
            (&silence("{ command: [] }"), "3:25 the program is missing"),
            (&silence("{ command: [a], publish: { topic: b } }"), "3:14 an action is one thing, found 2"),
            (&silence("{}"), "3:14 an action is one thing, found 0"),
            (&silence("{ command: [a], within: soon }"), "3:38 "),
            (&silence("{ command: [a], within: 1 h }"), "3:14 an action takes at most 5 min"),
            (&silence("{ request: { payload: 1 } }"), "3:25 `to` is missing"),
            (&silence("{ service: { name: /a, type: b/srv/C } }"), "3:25 `b/srv/C` cannot be called"),
            (&silence("{ dynamic_security: { client: a, user: a } }"), "3:47 unknown key `user`"),
        ] {
            check_wrong(text, expected);
        }
    }
}
