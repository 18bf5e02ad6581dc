//! The stream of an instance over HTTP: all rows first, then those that have changed (`GET /changes`).

use serde_json::Value;
use shsa_runtime::Token;
use std::io::{BufRead, BufReader};
use std::sync::mpsc::Sender;
use std::time::Duration;
use ureq::Agent;

/// The time between two attempts to connect.
const PAUSE: Duration = Duration::from_secs(1);
/// How long connecting and the first answer may take.
const PATIENCE: Duration = Duration::from_secs(4);
/// The longest part of a stream: all rows of a large model.
const LONGEST: u64 = 256 << 20;

/// What there is to know of an instance, or of the way to it.
pub(super) enum News {
    /// A part of the stream.
    Part(Part),
    /// The instance does not answer, or no longer, with the reason.
    Lost(String),
    /// The instance refuses, with the reason.
    Refused(String),
    /// The user ends it.
    Interrupted,
}

/// A part of the stream.
pub(super) struct Part {
    /// Whether it has all rows.
    pub(super) is_whole: bool,
    /// Its content.
    pub(super) content: Value,
}

/// Follows an instance in a thread of its own, and connects again when it goes.
pub(super) fn follow(address: &str, token: Option<Token>, news: Sender<News>) {
    let url = format!("http://{address}/changes");
    std::thread::spawn(move || {
        let config = Agent::config_builder()
            .timeout_connect(Some(PATIENCE))
            .timeout_recv_response(Some(PATIENCE))
            .http_status_as_error(false)
            .build();
        let agent = Agent::new_with_config(config);
        loop {
            let ended = match read(&agent, &url, token.as_ref(), &news) {
                Ok(ended) => ended,
                Err(error) => News::Lost(error.to_string()),
            };
            if news.send(ended).is_err() {
                return;
            }
            std::thread::sleep(PAUSE);
        }
    });
}

/// Reads until the stream ends; returns why it has.
fn read(agent: &Agent, url: &str, token: Option<&Token>, news: &Sender<News>) -> anyhow::Result<News> {
    let mut request = agent.get(url);
    if let Some(token) = token {
        request = request.header("Authorization", token.bearer());
    }
    let mut answer = request.call()?;
    if answer.status() == 401 {
        return Ok(News::Refused("looking needs a token: --view-token-file or SHSA_VIEW_TOKEN".to_owned()));
    }
    if answer.status() != 200 {
        return Ok(News::Lost(format!("it answers with the status {}", answer.status())));
    }
    let mut is_whole = false;
    let body = answer.body_mut().with_config().limit(u64::MAX).reader();
    let mut lines = BufReader::new(body);
    loop {
        let mut line = String::new();
        if std::io::Read::take(&mut lines, LONGEST).read_line(&mut line)? == 0 {
            return Ok(News::Lost("it has ended".to_owned()));
        }
        if let Some(event) = line.strip_prefix("event: ") {
            is_whole = event.trim_end() == "state";
        } else if let Some(data) = line.strip_prefix("data: ") {
            let part = Part { is_whole, content: serde_json::from_str(data)? };
            if news.send(News::Part(part)).is_err() {
                return Ok(News::Interrupted);
            }
        }
    }
}
