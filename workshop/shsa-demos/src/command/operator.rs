//! What the operator of the rover sees: the scan of a sensor that is trusted, the distance that is served, and what `shsa` has decided.

use serde_json::Value;
use shsa_bridge::BridgeError;
use shsa_core::engine::EventKind;
use shsa_core::time::{Span, Time};
use shsa_demo::rover::{DEPTH, LIDAR, NEED, ODOMETRY, SONAR, level};
use shsa_demo::scan::{SCAN_HEIGHT, SCAN_WIDTH, Scan};
use shsa_demo::terminal::{Cell, Ink, Line, Terminal, bar, ink_of, wrap};
use shsa_demo::verdict::State;
use shsa_demos::rover::port::{Port, Received, WISH};
use std::collections::BTreeMap;
use std::io;

/// The status of the need, and the decisions, as `shsa run` publishes them.
const STATUS: &str = "shsa/shsa/need/v_dmin";
const EVENTS: &str = "shsa/shsa/events";

/// The sensors with a picture, the most accurate first, each with its name.
const SENSORS: [(&str, &str); 3] = [(LIDAR, "lidar"), (DEPTH, "depth camera"), (SONAR, "sonar ring")];
/// What is older is not shown.
const STALE: Span = Span::from_millis(500);
/// How often the picture is drawn.
const FRAME: Span = Span::from_millis(100);

/// The newest numbers of a topic.
struct Newest {
    received: Time,
    numbers: Vec<f64>,
}

/// The operator's view.
pub(super) struct Operator {
    terminal: Terminal,
    /// When the times that are shown begin.
    began: Option<Time>,
    newest: BTreeMap<&'static str, Newest>,
    /// The sensors that were accused, by the names of their signals.
    states: BTreeMap<String, State>,
    quality: String,
    source: String,
    /// The last decision, its colour and its reason.
    decision: Option<(Ink, String)>,
    drawn: Time,
}

impl Operator {
    /// Nothing was seen yet.
    pub(super) fn new(terminal: Terminal) -> Operator {
        Operator {
            terminal,
            began: None,
            newest: BTreeMap::new(),
            states: BTreeMap::new(),
            quality: String::new(),
            source: String::new(),
            decision: None,
            drawn: Time::MIN,
        }
    }

    /// Subscribes to what the picture is made of.
    ///
    /// # Errors
    /// Errors of the bus.
    pub(super) fn subscribe(port: &mut Port) -> Result<(), BridgeError> {
        [LIDAR, SONAR, DEPTH, ODOMETRY, WISH, NEED]
            .into_iter()
            .try_for_each(|topic| port.subscribe(topic))?;
        port.subscribe_text(STATUS)
    }

    /// Subscribes to decisions, too.
    ///
    /// # Errors
    /// Errors of the bus.
    pub(super) fn subscribe_decisions(port: &mut Port) -> Result<(), BridgeError> {
        port.subscribe_text(EVENTS)
    }

    /// Takes in what has come from the bus.
    pub(super) fn observe(&mut self, now: Time, received: &Received) -> io::Result<()> {
        match received {
            Received::Numbers { topic, numbers, received } => {
                let newest = Newest { received: *received, numbers: numbers.clone() };
                self.newest.insert(*topic, newest);
            }
            Received::Text { topic, content } if **topic == *STATUS => {
                let word = |key: &str| content[key].as_str().unwrap_or_default().to_owned();
                (self.quality, self.source) = (word("quality"), word("source"));
            }
            Received::Text { content, .. } => self.decided(now, content)?,
        }
        Ok(())
    }

    /// Takes in a decision, and writes it as a permanent line.
    pub(super) fn decided(&mut self, now: Time, decision: &Value) -> io::Result<()> {
        let Some(kind) = EventKind::ALL.into_iter().find(|kind| decision["kind"] == kind.name()) else {
            return Ok(());
        };
        let signal = decision["signal"].as_str();
        if let (Some(signal), Some(state)) = (signal, State::after(kind)) {
            self.states.insert(signal.to_owned(), state);
        }
        // The status of the need follows within a second.
        if let Some(source) = decision["substitution"].as_str() {
            source.clone_into(&mut self.source);
        }
        let subject = signal.or(decision["variable"].as_str()).unwrap_or_default();
        let because = decision["because"].as_str().unwrap_or_default();
        self.decision = Some((ink_of(kind), format!("{} {subject}: {because}", kind.name())));
        self.say(now, kind.name(), ink_of(kind), &format!("{subject}: {because}"))
    }

    /// Writes a permanent line.
    pub(super) fn say(&mut self, now: Time, kind: &str, ink: Ink, text: &str) -> io::Result<()> {
        self.terminal.event(self.elapsed(now), kind, ink, text)
    }

    /// Counts the shown times from this moment on, if they do not count yet. There is no picture before.
    pub(super) fn begin(&mut self, now: Time) {
        self.began.get_or_insert(now);
    }

    fn elapsed(&self, now: Time) -> Time {
        self.began.map_or(Time(0), |began| Time(0) + (now - began))
    }

    /// Draws the picture if it is due.
    pub(super) fn frame(&mut self, now: Time) -> io::Result<()> {
        if !self.terminal.is_live() || self.began.is_none() || now < self.drawn + FRAME {
            return Ok(());
        }
        self.drawn = now;
        let (map, side) = (self.picture(now), self.side(now));
        self.terminal.draw(&map, &side)
    }

    /// Whether the preferred source serves the distance.
    pub(super) fn is_good(&self) -> bool {
        self.quality == "Good"
    }

    /// Leaves the last picture on the terminal.
    pub(super) fn leave_picture(&mut self) {
        self.terminal.leave_picture();
    }

    fn fresh(&self, topic: &str, now: Time) -> Option<&[f64]> {
        let newest = self.newest.get(topic).filter(|newest| now - newest.received <= STALE);
        newest.map(|newest| &*newest.numbers)
    }

    fn number(&self, topic: &str, now: Time) -> Option<f64> {
        self.fresh(topic, now)?.first().copied()
    }

    fn state(&self, topic: &str) -> State {
        self.states.get(topic).copied().unwrap_or(State::Trusted)
    }

    /// The sensor of the picture, with its name: one that serves the distance, else the most accurate one; none that is not trusted.
    fn eye(&self, now: Time) -> Option<(&'static str, &'static str)> {
        let usable = SENSORS.into_iter().filter(|(topic, _)| {
            self.state(topic) == State::Trusted && self.fresh(topic, now).is_some_and(|it| !it.is_empty())
        });
        usable.clone().find(|(topic, _)| self.source.contains(topic)).or_else(|| usable.clone().next())
    }

    /// The lowest and the highest value of the distance that is served.
    fn served(&self, now: Time) -> Option<[f64; 2]> {
        match self.fresh(NEED, now) {
            Some(&[lo, hi]) => Some([lo, hi]),
            _ => None,
        }
    }

    fn picture(&self, now: Time) -> Vec<Vec<Cell>> {
        let ink = quality_words(&self.quality).1;
        let nearest = self.served(now).map(|[lo, hi]| (lo.midpoint(hi), ink));
        let eye = self.eye(now);
        let ranges = eye.and_then(|(topic, _)| Some(level(topic, self.fresh(topic, now)?)));
        let topic = eye.map_or(LIDAR, |(topic, _)| topic);
        let title = match eye {
            Some((_, name)) => (format!("what the {name} sees"), Ink::Strong),
            None => ("no picture: no sensor can be trusted".to_owned(), Ink::Bad),
        };
        let scan = Scan { topic, ranges: ranges.unwrap_or_default(), nearest };
        let mut lines = vec![title_line(&title.0, title.1)];
        lines.extend(scan.drawn());
        lines
    }

    /// The lines beside the picture.
    fn side(&self, now: Time) -> Vec<Line> {
        let faint = |text: &str| vec![(text.to_owned(), Ink::Faint)];
        let (words, ink) = quality_words(&self.quality);
        let mut lines = vec![
            vec![
                (format!("{:>6.1} s   ", self.elapsed(now).seconds()), Ink::Strong),
                (words.to_owned(), ink),
            ],
            vec![(self.speeds(now), Ink::Plain)],
            Vec::new(),
            faint("nearest obstacle, dmin"),
        ];
        let served = self.served(now);
        lines.push(bar("used", served.map(|[lo, hi]| lo.midpoint(hi)), ink));
        lines.push(faint(&served.map_or_else(String::new, |[lo, hi]| format!("  {lo:.2} to {hi:.2} m"))));
        lines.extend(SENSORS.map(|(topic, name)| self.sensor(topic, name, now)));
        let room = self.terminal.beside(SCAN_WIDTH + 2);
        let wrapped = |text: &str, most: usize, ink: Ink| -> Vec<Line> {
            let lines = wrap(text, room).into_iter().take(most);
            lines.map(|line| vec![(format!("  {line}"), ink)]).collect()
        };
        if !self.source.is_empty() {
            lines.extend([Vec::new(), faint("dmin comes from")]);
            lines.extend(wrapped(&self.source, 2, Ink::Plain));
        }
        if let Some((ink, text)) = &self.decision {
            lines.extend([Vec::new(), faint("the last decision")]);
            lines.extend(wrapped(text, (SCAN_HEIGHT + 1).saturating_sub(lines.len()), *ink));
        }
        lines
    }

    fn speeds(&self, now: Time) -> String {
        let shown = |speed: Option<f64>| {
            speed.map_or("-".to_owned(), |speed| format!("{:.2}", (100.0 * speed).round() / 100.0 + 0.0))
        };
        let (wish, speed) = (shown(self.number(WISH, now)), shown(self.number(ODOMETRY, now)));
        format!("  drives {speed} of {wish} m/s")
    }

    /// The smallest distance that a sensor reports, and a word where it is not trusted.
    fn sensor(&self, topic: &str, name: &str, now: Time) -> Line {
        let ranges = self.fresh(topic, now).map(|numbers| level(topic, numbers));
        let dmin = ranges.and_then(|ranges| ranges.iter().copied().reduce(f64::min));
        let (words, ink) = match self.state(topic) {
            State::Trusted if dmin.is_none() => ("no data", Ink::Warning),
            state => state.words(),
        };
        let mut line = bar(name.split(' ').next().unwrap_or(name), dmin, ink);
        if ink != Ink::Good {
            line.truncate(2);
            line.push((format!(" {words}"), ink));
        }
        line
    }
}

fn title_line(text: &str, ink: Ink) -> Vec<Cell> {
    let padded = text.chars().chain(std::iter::repeat(' '));
    padded.take(SCAN_WIDTH).map(|sign| (sign, ink)).collect()
}

/// The words of the live page for a quality.
fn quality_words(quality: &str) -> (&'static str, Ink) {
    match quality {
        "Good" => ("✓ good", Ink::Good),
        "UncertainSubstituteValue" => ("⇄ substitute", Ink::Warning),
        "UncertainSubNormal" => ("? uncertain", Ink::Warning),
        "UncertainLastUsableValue" => ("… old", Ink::Warning),
        "Bad" => ("✗ unserved", Ink::Bad),
        _ => ("", Ink::Plain),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    /// An operator who has seen scans of all sensors at one second, each with its own distance.
    fn operator() -> Operator {
        let mut operator = Operator::new(Terminal::new(false, true));
        let seen = [
            (LIDAR, vec![1.0; 121]),
            (DEPTH, vec![2.0; 480]),
            (SONAR, vec![3.0; 12]),
            (NEED, vec![0.9, 1.1]),
        ];
        for (topic, numbers) in seen {
            let received = Time::from_seconds(1.0);
            operator.observe(received, &Received::Numbers { topic, numbers, received }).unwrap();
        }
        operator
    }

    fn status(operator: &mut Operator, quality: &str, source: &str) {
        let content = json!({ "quality": quality, "source": source });
        operator.observe(Time(0), &Received::Text { topic: STATUS.into(), content }).unwrap();
    }

    fn decide(operator: &mut Operator, kind: &str, signal: &str) {
        operator.decided(Time(0), &json!({ "kind": kind, "signal": signal, "because": "so it is" })).unwrap();
    }

    /// The title of the picture, and the texts beside it.
    fn shown(operator: &Operator, at_s: f64) -> (String, String) {
        let (map, side) =
            (operator.picture(Time::from_seconds(at_s)), operator.side(Time::from_seconds(at_s)));
        assert!(map.len() == SCAN_HEIGHT + 1 && side.len() <= map.len(), "{}", side.len());
        let title: String = map[0].iter().map(|cell| cell.0).collect();
        let beside = side.iter().map(|line| line.iter().map(|text| &*text.0).collect::<String>());
        (title.trim().to_owned(), beside.collect::<Vec<_>>().join("\n"))
    }

    #[test]
    fn the_picture_is_that_of_the_sensor_in_use() {
        let mut operator = operator();
        assert_eq!(shown(&operator, 1.1).0, "what the lidar sees");
        status(&mut operator, "UncertainSubstituteValue", "row, nearest of /sonar/ranges");
        let (title, beside) = shown(&operator, 1.1);
        assert_eq!(title, "what the sonar ring sees");
        assert!(beside.contains("⇄ substitute") && beside.contains("0.90 to 1.10 m"), "{beside}");
    }

    #[test]
    fn nothing_is_drawn_of_a_sensor_that_lies_or_is_silent() {
        let mut operator = operator();
        status(&mut operator, "Good", "nearest of /lidar/scan");
        decide(&mut operator, "failed", LIDAR);
        let (title, beside) = shown(&operator, 1.1);
        assert_eq!(title, "what the depth camera sees");
        assert!(beside.contains("failed") && beside.contains("failed /lidar/scan: so it is"), "{beside}");
        decide(&mut operator, "restored", LIDAR);
        assert_eq!(shown(&operator, 1.1).0, "what the lidar sees");
        let (title, beside) = shown(&operator, 2.0);
        assert_eq!(title, "no picture: no sensor can be trusted");
        assert!(beside.contains("no data"), "{beside}");
    }
}
