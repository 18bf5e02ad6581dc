//! The output: events line by line, and on a terminal a live picture below them.

use super::map::{self, Cell, Ink, MAP_HEIGHT, MAP_WIDTH};
use crate::show::colour;
use shsa_bridge::Message;
use shsa_core::engine::EventKind;
use shsa_core::observation::RawValue;
use shsa_core::time::{Span, Time};
use shsa_demo::Decision;
use shsa_demo::rover::{
    DEPTH, LIDAR, Mode, NEED, ODOMETRY, Point, SONAR, View, lidar_angles, lower_bound, nearest_seen,
    stop_distance,
};
use std::collections::{BTreeMap, VecDeque};
use std::io::{self, IsTerminal, Write};
use terminal_size::{Height, Width, terminal_size};

/// A sensor without a message for this long shows no value.
const STALE: Span = Span::from_millis(500);
/// The full scale of a bar, metres.
const BAR_RANGE: f64 = 3.2;
/// The length of a bar in characters.
const BAR_LENGTH: usize = 10;
/// The size of terminal that the picture needs: columns, rows.
const NEEDED: (u16, u16) = (80, MAP_HEIGHT as u16 + 4);

/// The displayed state of a signal.
#[derive(Clone, Copy, Debug, PartialEq)]
enum State {
    Trusted,
    Suspect,
    Failed,
    Silent,
}

/// The terminal, or its replacement.
pub(super) struct Screen {
    live: bool,
    quiet: bool,
    colour: bool,
    /// The number of the picture's rows on the terminal.
    drawn: usize,
    states: BTreeMap<String, State>,
    seen: BTreeMap<String, Message>,
    trail: VecDeque<Point>,
}

impl Screen {
    /// `live` draws the picture if the terminal allows it; `quiet` suppresses all output.
    pub(super) fn new(live: bool, quiet: bool) -> Screen {
        let terminal = io::stdout().is_terminal();
        Screen {
            live: live && terminal && !quiet,
            quiet,
            colour: colour(terminal),
            drawn: 0,
            states: BTreeMap::new(),
            seen: BTreeMap::new(),
            trail: VecDeque::new(),
        }
    }

    /// Takes in a message of the bus.
    pub(super) fn receive(&mut self, message: Message) {
        self.seen.insert(message.topic.to_string(), message);
    }

    /// Takes in a decision of the healer.
    pub(super) fn decided(&mut self, decision: &Decision) -> io::Result<()> {
        let (state, ink) = match decision.kind {
            EventKind::Suspected => (Some(State::Suspect), Ink::Warning),
            EventKind::Failed => (Some(State::Failed), Ink::Bad),
            EventKind::Silent => (Some(State::Silent), Ink::Bad),
            EventKind::Restored => (Some(State::Trusted), Ink::Good),
            EventKind::Substituted => (None, Ink::Good),
            EventKind::Unhealable | EventKind::Refused => (None, Ink::Bad),
            EventKind::Ageing => (None, Ink::Warning),
        };
        if let (Some(signal), Some(state)) = (&decision.signal, state) {
            self.states.insert(signal.clone(), state);
        }
        let subject = decision.signal.as_ref().or(decision.variable.as_ref());
        let mut text = format!("{}: {}", subject.map_or("", String::as_str), decision.because);
        if let Some(substitution) = &decision.substitution {
            text.push_str(&format!("; now from {substitution}"));
        }
        self.event(decision.time, decision.kind.name(), ink, &text)
    }

    /// Writes a permanent line.
    pub(super) fn event(&mut self, time: Time, kind: &str, ink: Ink, text: &str) -> io::Result<()> {
        let lines = wrap(text, self.width().saturating_sub(26));
        let head = format!("{:>8.2} s  {kind:<12}", time.seconds());
        let mut out = String::new();
        for (index, line) in lines.iter().enumerate() {
            let left = if index == 0 { self.paint(&head, ink) } else { " ".repeat(22) };
            out.push_str(&format!("{left}  {line}\x1b[K\n"));
        }
        self.print_line(&out)
    }

    /// Writes lines as they are.
    pub(super) fn print_line(&mut self, text: &str) -> io::Result<()> {
        if self.quiet {
            return Ok(());
        }
        let above = self.to_top();
        let text = if self.live { text.to_string() } else { text.replace("\x1b[K", "") };
        let clear = if self.live { "\x1b[J" } else { "" };
        self.drawn = 0;
        write(&format!("{above}{clear}{text}"))
    }

    /// Draws the picture again, if there is one.
    pub(super) fn frame(&mut self, view: &View<'_>) -> io::Result<()> {
        if self.trail.back() != Some(&view.robot.pose.at) {
            self.trail.push_back(view.robot.pose.at);
        }
        if self.trail.len() > 200 {
            self.trail.pop_front();
        }
        if !self.live || !fits() {
            return Ok(());
        }
        let side = self.side(view);
        let blank = vec![(String::new(), Ink::Plain)];
        let mut out = self.to_top();
        let map = self.map(view);
        for (row, cells) in map.iter().enumerate() {
            let line: String =
                side.get(row).unwrap_or(&blank).iter().map(|(text, ink)| self.paint(text, *ink)).collect();
            out.push_str(&format!("{}  {line}\x1b[K\n", self.paint_cells(cells)));
        }
        self.drawn = map.len();
        write(&out)
    }

    /// Leaves the last picture on the terminal.
    pub(super) fn leave_picture(&mut self) {
        self.drawn = 0;
    }

    fn to_top(&self) -> String {
        if self.drawn > 0 { format!("\x1b[{}A\r", self.drawn) } else { String::new() }
    }

    fn width(&self) -> usize {
        terminal_size().map_or(120, |(Width(columns), _)| usize::from(columns))
    }

    fn state(&self, topic: &str) -> State {
        self.states.get(topic).copied().unwrap_or(State::Trusted)
    }

    fn map(&self, view: &View<'_>) -> Vec<Vec<Cell>> {
        let mut cells = map::furniture(view.room);
        map::draw_trail(&mut cells, self.trail.iter());
        if let Some(RawValue::Vector(scan)) = self.fresh(LIDAR, view.now).and_then(Message::value) {
            map::draw_echoes(&mut cells, view.robot, lidar_angles().zip(scan.iter().copied()));
        }
        map::draw_robot(&mut cells, view.robot, mode_words(view.mode).1);
        cells
    }

    fn fresh(&self, topic: &str, now: Time) -> Option<&Message> {
        self.seen.get(topic).filter(|message| now - message.received <= STALE)
    }

    /// The lines beside the map.
    fn side(&self, view: &View<'_>) -> Vec<Vec<(String, Ink)>> {
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
        let room = self.width().saturating_sub(MAP_WIDTH + 4);
        lines.push(plain(format!("  {}", view.source.chars().take(room).collect::<String>())));
        lines
    }

    fn sensor(&self, name: &str, topic: &str, now: Time) -> Vec<(String, Ink)> {
        let dmin = self
            .fresh(topic, now)
            .and_then(|message| message.value().and_then(|value| nearest_seen(topic, value)));
        bar(name, dmin, state_words(self.state(topic)).1)
    }

    fn signal(&self, topic: &str, now: Time) -> Vec<(String, Ink)> {
        let (words, ink) = match self.state(topic) {
            State::Trusted if self.fresh(topic, now).is_none() => ("no data", Ink::Warning),
            state => state_words(state),
        };
        vec![(format!("  {topic:<14} "), Ink::Plain), (words.to_string(), ink)]
    }

    fn paint(&self, text: &str, ink: Ink) -> String {
        let code = match ink {
            Ink::Plain => return text.to_string(),
            Ink::Faint => 2,
            Ink::Strong => 1,
            Ink::Good => 32,
            Ink::Warning => 33,
            Ink::Bad => 31,
            Ink::Echo => 36,
        };
        if self.colour { format!("\x1b[{code}m{text}\x1b[0m") } else { text.to_string() }
    }

    fn paint_cells(&self, cells: &[Cell]) -> String {
        let same = cells.chunk_by(|a, b| a.1 == b.1);
        same.map(|run| self.paint(&run.iter().map(|cell| cell.0).collect::<String>(), run[0].1)).collect()
    }
}

fn write(text: &str) -> io::Result<()> {
    let mut out = io::stdout().lock();
    out.write_all(text.as_bytes())?;
    out.flush()
}

fn fits() -> bool {
    terminal_size().is_none_or(|(Width(columns), Height(rows))| columns >= NEEDED.0 && rows >= NEEDED.1)
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

fn state_words(state: State) -> (&'static str, Ink) {
    match state {
        State::Trusted => ("ok", Ink::Good),
        State::Suspect => ("suspect", Ink::Warning),
        State::Failed => ("failed", Ink::Bad),
        State::Silent => ("silent", Ink::Bad),
    }
}

/// A name, a bar in eighths of a character, and the number.
fn bar(name: &str, metres: Option<f64>, ink: Ink) -> Vec<(String, Ink)> {
    const PARTS: [&str; 8] = ["", "▏", "▎", "▍", "▌", "▋", "▊", "▉"];
    let share = (metres.unwrap_or(0.0) / BAR_RANGE).clamp(0.0, 1.0);
    let eighths = (share * (8 * BAR_LENGTH) as f64).round() as usize;
    let filled = format!("{}{}", "█".repeat(eighths / 8), PARTS[eighths % 8]);
    let number = metres.map_or("   -".to_string(), |metres| format!("{metres:>4.2}"));
    vec![
        (format!("  {name:<6}"), Ink::Plain),
        (format!("{filled:<BAR_LENGTH$}"), ink),
        (format!(" {number} m"), Ink::Plain),
    ]
}

/// Wraps text into lines of at most `width` characters, unless a word is longer.
fn wrap(text: &str, width: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let line = lines.last_mut().map_or(0, |line| line.chars().count());
        if line > 0 && line + 1 + word.chars().count() > width {
            lines.push(String::new());
        }
        if let Some(line) = lines.last_mut() {
            line.push_str(if line.is_empty() { "" } else { " " });
            line.push_str(word);
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bars_grow_by_eighths() {
        let text = |metres| bar("x", metres, Ink::Plain)[1].0.trim_end().to_string();
        assert_eq!(text(Some(BAR_RANGE / 2.0)), "█████");
        assert_eq!(text(Some(BAR_RANGE / 80.0 * 3.0)), "▍");
        assert_eq!(text(Some(9.0)), "██████████");
        assert_eq!(text(None), "");
    }

    #[test]
    fn long_text_is_wrapped_between_words() {
        assert_eq!(wrap("one two three four", 9), ["one two", "three", "four"]);
        assert_eq!(wrap("unbreakable", 4), ["unbreakable"]);
    }
}
