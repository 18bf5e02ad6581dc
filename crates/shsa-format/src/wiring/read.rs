//! Reads the wiring of needs from its tree; every key is checked against the models of the run.

use super::{Action, ActionKind, Call, Form, NeedWiring, Takeover};
use shsa_core::knowledge::{KnowledgeBase, Text, VariableId};
use shsa_core::time::Span;
use shsa_core::unit::nearest;
use shsa_message::span::parse_span;
use shsa_model::reader::{Fields, Keys, Reader};
use shsa_model::tree::{Node, Value};

/// The default time limit of an action.
pub(super) const WITHIN: Span = Span::from_millis(5_000);

/// The largest time limit of an action.
const WITHIN_MAX: Span = Span::from_millis(300_000);

/// The default time from a refusal to the next attempt to silence the source.
pub(super) const RETRY: Span = Span::from_millis(30_000);

const ROOT: [&str; 1] = ["wiring"];

const NEED: [&str; 7] = ["form", "takeover", "silence", "restore", "check", "retry", "probe"];

const ACTION: [&str; 6] = ["command", "publish", "request", "service", "dynamic_security", "within"];

const EXAMPLE: &str = "silence: { command: [systemctl, stop, wheel-driver] }";

/// The transitions of a node's life by name: `lifecycle_msgs/msg/Transition`.
const TRANSITIONS: [(&str, u8); 4] = [("configure", 1), ("cleanup", 2), ("activate", 3), ("deactivate", 4)];

pub(super) fn needs(reader: &mut Reader, root: &Node, models: &[&KnowledgeBase]) -> Vec<NeedWiring> {
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
    let found = Form::named(&form.text);
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
