//! The room drawn with characters: two rows of the room in one line of text.

use shsa_demo::rover::{Point, Robot, Room};
use shsa_demo::terminal::{Cell, Ink};

/// Columns of the map, walls included.
pub(super) const MAP_WIDTH: usize = 50;
/// Rows of the map, walls included.
pub(super) const MAP_HEIGHT: usize = 19;
/// The width of a column in metres; a row is twice as high.
const COLUMN: f64 = 0.15;

const ARROWS: [char; 8] = ['→', '↗', '↑', '↖', '←', '↙', '↓', '↘'];

/// The centre of a cell's upper (`half` 0) or lower (1) half.
fn place(column: usize, row: usize, half: usize) -> Point {
    let x = (column as f64 - 0.5) * COLUMN;
    let y = ((MAP_HEIGHT - 1 - row) as f64 - 0.25 - 0.5 * half as f64) * 2.0 * COLUMN;
    Point { x, y }
}

/// The cell of a point; `None` outside the map.
fn cell_of(place: Point) -> Option<(usize, usize)> {
    let column = (place.x / COLUMN + 1.0).floor();
    let row = (MAP_HEIGHT - 1) as f64 - (place.y / (2.0 * COLUMN)).floor() - 1.0;
    let within = (0.0..MAP_WIDTH as f64).contains(&column) && (0.0..MAP_HEIGHT as f64).contains(&row);
    within.then_some((column as usize, row as usize))
}

/// The room alone.
pub(super) fn furniture(room: &Room) -> Vec<Vec<Cell>> {
    let solid = |column, row| match [0, 1].map(|half| room.is_solid(place(column, row, half))) {
        [true, true] => '█',
        [true, false] => '▀',
        [false, true] => '▄',
        [false, false] => ' ',
    };
    let line = |row| (0..MAP_WIDTH).map(|column| (solid(column, row), Ink::Plain)).collect();
    (0..MAP_HEIGHT).map(line).collect()
}

/// Puts a mark into a free cell, and colours an occupied one.
fn mark(map: &mut [Vec<Cell>], place: Point, sign: char, ink: Ink) {
    let Some((column, row)) = cell_of(place) else { return };
    let cell = &mut map[row][column];
    let free = matches!(cell.0, ' ' | '·');
    *cell = (if free { sign } else { cell.0 }, ink);
}

/// Draws the robot's past positions.
pub(super) fn draw_trail<'a>(map: &mut [Vec<Cell>], trail: impl Iterator<Item = &'a Point>) {
    for &place in trail {
        mark(map, place, '·', Ink::Faint);
    }
}

/// Draws the echoes of a scan.
pub(super) fn draw_echoes(map: &mut [Vec<Cell>], robot: &Robot, echoes: impl Iterator<Item = (f64, f64)>) {
    for (angle, distance) in echoes {
        mark(map, robot.pose.at.ahead(robot.pose.heading + angle, distance), '•', Ink::Echo);
    }
}

/// Draws the robot as an arrow in brackets.
pub(super) fn draw_robot(map: &mut [Vec<Cell>], robot: &Robot, ink: Ink) {
    let Some((column, row)) = cell_of(robot.pose.at) else { return };
    let eighth = (robot.pose.heading / std::f64::consts::FRAC_PI_4).round() as i64;
    let arrow = ARROWS[eighth.rem_euclid(8) as usize];
    for (offset, sign) in [(-1, '('), (0, arrow), (1, ')')] {
        if let Some(cell) = column.checked_add_signed(offset).and_then(|column| map[row].get_mut(column)) {
            *cell = (sign, ink);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shsa_demo::rover::Pose;

    #[test]
    fn a_place_is_drawn_where_it_is() {
        for (column, row) in [(0, 0), (1, 1), (25, 9), (49, 18)] {
            assert_eq!(cell_of(place(column, row, 0)), Some((column, row)));
            assert_eq!(cell_of(place(column, row, 1)), Some((column, row)));
        }
    }

    #[test]
    fn the_room_has_walls_around_and_the_robot_in_it() {
        let mut map = furniture(&Room::furnished());
        let robot = Robot::at(Pose { at: Point { x: 1.0, y: 1.5 }, heading: 0.0 });
        draw_robot(&mut map, &robot, Ink::Good);
        let text: Vec<String> = map.iter().map(|row| row.iter().map(|cell| cell.0).collect()).collect();
        assert!(text[0].chars().all(|sign| sign == '█') && text[18].chars().all(|sign| sign == '█'));
        assert!(text.iter().all(|row| row.starts_with('█') && row.ends_with('█')));
        assert_eq!(text.iter().filter(|row| row.contains("(→)")).count(), 1);
    }
}
