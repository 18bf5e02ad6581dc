//! A scan drawn around the robot with characters: what it sees ahead of it, two rows of squares in one line of text.

use crate::rover::Beams;
use crate::terminal::{Cell, Ink};

/// Columns of the picture; the robot is in the middle.
pub const SCAN_WIDTH: usize = 47;
/// Lines of the picture: squares ahead of the robot, and the robot below them.
pub const SCAN_HEIGHT: usize = 18;

const ROWS: usize = SCAN_HEIGHT - 1;
/// The side of a square, metres; a line is twice as high.
const SQUARE: f64 = 0.125;

/// The content of a square.
#[derive(Clone, Copy, PartialEq)]
enum Seen {
    /// Beyond an echo, or outside of the field of view.
    Nothing,
    Free,
    /// As far away as the nearest obstacle is said to be.
    Near,
    Echo,
}

/// A scan, and the distance of the nearest obstacle that is served.
#[derive(Clone, Copy)]
pub struct Scan<'v> {
    /// The topic of the sensor.
    pub topic: &'v str,
    /// The distances in the horizontal plane, metres.
    pub ranges: &'v [f64],
    /// Metres, and the colour of its arc.
    pub nearest: Option<(f64, Ink)>,
}

impl Scan<'_> {
    /// The lines of the picture; without a scan there is only the robot.
    #[must_use]
    pub fn drawn(self) -> Vec<Vec<Cell>> {
        let mut lines: Vec<Vec<Cell>> =
            (0..ROWS).map(|row| (0..SCAN_WIDTH).map(|column| self.cell(column, row)).collect()).collect();
        let mut last = vec![(' ', Ink::Plain); SCAN_WIDTH];
        let middle = SCAN_WIDTH / 2;
        for (cell, sign) in last.iter_mut().skip(middle.saturating_sub(1)).zip(['(', '↑', ')']) {
            *cell = (sign, Ink::Strong);
        }
        lines.push(last);
        lines
    }

    fn cell(self, column: usize, row: usize) -> Cell {
        let near = self.nearest.map_or(Ink::Plain, |(_, ink)| ink);
        match [0, 1].map(|half| self.square(column, 2 * row + half)) {
            [Seen::Echo, Seen::Echo] => ('█', Ink::Echo),
            [Seen::Echo, _] => ('▀', Ink::Echo),
            [_, Seen::Echo] => ('▄', Ink::Echo),
            [Seen::Near, _] | [_, Seen::Near] => ('•', near),
            [Seen::Free, _] | [_, Seen::Free] if (column + row).is_multiple_of(2) => ('·', Ink::Faint),
            _ => (' ', Ink::Plain),
        }
    }

    /// What is in a square, counted from the top left.
    fn square(self, column: usize, row: usize) -> Seen {
        let ahead = ((2 * ROWS - row) as f64 - 0.5) * SQUARE;
        let left = (SCAN_WIDTH / 2) as f64 * SQUARE - column as f64 * SQUARE;
        let distance = ahead.hypot(left);
        let beam = Beams::of(self.topic, self.ranges.len()).nearest(left.atan2(ahead));
        let Some(&range) = beam.and_then(|beam| self.ranges.get(beam)) else { return Seen::Nothing };
        let is_near = self.nearest.is_some_and(|(nearest, _)| (distance - nearest).abs() <= SQUARE / 2.0);
        match distance - range {
            beyond if beyond > SQUARE => Seen::Nothing,
            beyond if beyond > -SQUARE / 2.0 => Seen::Echo,
            _ if is_near => Seen::Near,
            _ => Seen::Free,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rover::LIDAR;

    fn text(scan: Scan<'_>) -> Vec<String> {
        let lines = scan.drawn();
        assert!(lines.len() == SCAN_HEIGHT && lines.iter().all(|line| line.len() == SCAN_WIDTH));
        lines.iter().map(|line| line.iter().map(|cell| cell.0).collect()).collect()
    }

    #[test]
    fn a_wall_ahead_is_a_line_with_free_space_before_it() {
        // A wall that is 2 m ahead.
        let ranges: Vec<f64> = Beams::of(LIDAR, 121).angles().map(|angle| 2.0 / angle.cos()).collect();
        let lines = text(Scan { topic: LIDAR, ranges: &ranges, nearest: Some((1.5, Ink::Good)) });
        let is_echo = |sign: char| "█▀▄".contains(sign);
        for (row, line) in lines.iter().enumerate() {
            // 2 m are 16 squares, which are 8 lines above the robot; squares at the edge may be part of the wall.
            let echoes = line.chars().filter(|&sign| is_echo(sign)).count();
            assert!(if row == 8 { echoes > 40 } else { echoes < 10 }, "{row}: {line}");
            assert!(row > 7 || line.trim().is_empty(), "{row}: {line}");
        }
        let middle = |row: usize| lines[row].chars().nth(SCAN_WIDTH / 2).unwrap();
        assert!((10..13).any(|row| middle(row) == '•') && middle(17) == '↑', "{}", lines.join("\n"));
        // Beside the field of view there is nothing.
        assert!(lines[16].starts_with(&" ".repeat(20)), "{}", lines[16]);
    }

    #[test]
    fn without_a_scan_there_is_only_the_robot() {
        let lines = text(Scan { topic: LIDAR, ranges: &[], nearest: None });
        assert_eq!(lines.concat().trim(), "(↑)");
    }
}
