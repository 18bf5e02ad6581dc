//! The output of the robot in one process: events line by line, and on a terminal a live picture of the room below them.

use super::map::{self, MAP_WIDTH};
use shsa_bridge::Message;
use shsa_core::observation::RawValue;
use shsa_core::time::{Span, Time};
use shsa_demo::Decision;
use shsa_demo::rover::{
    Beams, DEPTH, LIDAR, Mode, NEED, ODOMETRY, Point, SONAR, View, lower_bound, nearest_seen, stop_distance,
};
use shsa_demo::terminal::{Cell, Ink, Line, Terminal, bar};
use shsa_demo::verdict::State;
use std::collections::{BTreeMap, VecDeque};
use std::io;

/// A sensor without a message for this long shows no value.
const STALE: Span = Span::from_millis(500);

/// What was seen, and where it is shown.
pub(super) struct Screen {
    terminal: Terminal,
    states: BTreeMap<String, State>,
    seen: BTreeMap<String, Message>,
    trail: VecDeque<Point>,
}

impl Screen {
    /// Nothing was seen yet.
    pub(super) fn new(terminal: Terminal) -> Screen {
        Screen { terminal, states: BTreeMap::new(), seen: BTreeMap::new(), trail: VecDeque::new() }
    }

    /// Takes in a message of the bus.
    pub(super) fn receive(&mut self, message: Message) {
        self.seen.insert(message.topic.to_string(), message);
    }

    /// Takes in a decision of the healer.
    pub(super) fn decided(&mut self, decision: &Decision) -> io::Result<()> {
        if let (Some(signal), Some(state)) = (&decision.signal, State::after(decision.kind)) {
            self.states.insert(signal.clone(), state);
        }
        self.terminal.decided(decision)
    }

    /// Writes a permanent line.
    pub(super) fn event(&mut self, time: Time, kind: &str, ink: Ink, text: &str) -> io::Result<()> {
        self.terminal.event(time, kind, ink, text)
    }

    /// Writes lines as they are.
    pub(super) fn print_line(&mut self, text: &str) -> io::Result<()> {
        self.terminal.print_line(text)
    }

    /// Draws the picture again, if there is one.
    pub(super) fn frame(&mut self, view: &View<'_>) -> io::Result<()> {
        if self.trail.back() != Some(&view.robot.pose.at) {
            self.trail.push_back(view.robot.pose.at);
        }
        if self.trail.len() > 200 {
            self.trail.pop_front();
        }
        if !self.terminal.is_live() {
            return Ok(());
        }
        let (map, side) = (self.map(view), self.side(view));
        self.terminal.draw(&map, &side)
    }

    /// Leaves the last picture on the terminal.
    pub(super) fn leave_picture(&mut self) {
        self.terminal.leave_picture();
    }

    fn state(&self, topic: &str) -> State {
        self.states.get(topic).copied().unwrap_or(State::Trusted)
    }

    fn map(&self, view: &View<'_>) -> Vec<Vec<Cell>> {
        let mut cells = map::furniture(view.room);
        map::draw_trail(&mut cells, self.trail.iter());
        if let Some(RawValue::Vector(scan)) = self.fresh(LIDAR, view.now).and_then(Message::value) {
            let angles = Beams::of(LIDAR, scan.len()).angles();
            map::draw_echoes(&mut cells, view.robot, angles.zip(scan.iter().copied()));
        }
        map::draw_robot(&mut cells, view.robot, mode_words(view.mode).1);
        cells
    }

    fn fresh(&self, topic: &str, now: Time) -> Option<&Message> {
        self.seen.get(topic).filter(|message| now - message.received <= STALE)
    }

    /// The lines beside the map.
    fn side(&self, view: &View<'_>) -> Vec<Line> {
        let (words, ink) = mode_words(view.mode);
        let plain = |text: String| vec![(text, Ink::Plain)];
        let faint = |text: &str| vec![(text.to_string(), Ink::Faint)];
        let collisions = if view.collisions > 0 { Ink::Bad } else { Ink::Plain };
        let mut lines = vec![
            vec![(format!("{:>6.2} s   ", view.now.seconds()), Ink::Strong), (words.to_string(), ink)],
            vec![
                (format!("{:>6.2} m/s ", view.robot.speed), Ink::Plain),
                (format!("collisions {}", view.collisions), collisions),
            ],
            Vec::new(),
            faint("nearest obstacle, dmin"),
            bar("truth", Some(view.true_dmin), Ink::Plain),
        ];
        for (name, topic) in [("lidar", LIDAR), ("sonar", SONAR), ("depth", DEPTH)] {
            lines.push(self.sensor(name, topic, view.now));
        }
        let published = self.fresh(NEED, view.now).and_then(|message| message.value().and_then(lower_bound));
        lines.push(bar("used", published, Ink::Strong));
        lines.push(faint(&format!("  stops below {:.2} m", stop_distance(view.robot.speed))));
        lines.push(Vec::new());
        lines.push(faint("signals"));
        for topic in [LIDAR, SONAR, DEPTH, ODOMETRY] {
            lines.push(self.signal(topic, view.now));
        }
        lines.push(Vec::new());
        lines.push(faint("dmin comes from"));
        let room = self.terminal.beside(MAP_WIDTH + 2);
        lines.push(plain(format!("  {}", view.source.chars().take(room).collect::<String>())));
        lines
    }

    fn sensor(&self, name: &str, topic: &str, now: Time) -> Line {
        let dmin = self
            .fresh(topic, now)
            .and_then(|message| message.value().and_then(|value| nearest_seen(topic, value)));
        bar(name, dmin, self.state(topic).words().1)
    }

    fn signal(&self, topic: &str, now: Time) -> Line {
        let (words, ink) = match self.state(topic) {
            State::Trusted if self.fresh(topic, now).is_none() => ("no data", Ink::Warning),
            state => state.words(),
        };
        vec![(format!("  {topic:<14} "), Ink::Plain), (words.to_string(), ink)]
    }
}

fn mode_words(mode: Mode) -> (&'static str, Ink) {
    match mode {
        Mode::Blind => ("stands: no dmin", Ink::Bad),
        Mode::Drive => ("drives", Ink::Good),
        Mode::Brake => ("brakes", Ink::Warning),
        Mode::Turn => ("turns", Ink::Warning),
        Mode::BackOff(_) => ("has crashed", Ink::Bad),
    }
}
