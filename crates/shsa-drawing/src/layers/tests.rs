//! The laws of a layout, on random graphs: nothing overlaps, and edges go around nodes.

use super::*;
use proptest::prelude::*;

type Rectangle = (f64, f64, f64, f64);

fn rectangle(size: &Size, (x, y): (f64, f64)) -> Rectangle {
    (x - size.width / 2.0, y - size.above, x + size.width / 2.0, y + size.below)
}

fn meet(a: Rectangle, b: Rectangle) -> bool {
    const ROUNDING: f64 = 1e-6;
    let apart =
        a.2 <= b.0 + ROUNDING || b.2 <= a.0 + ROUNDING || a.3 <= b.1 + ROUNDING || b.3 <= a.1 + ROUNDING;
    !apart
}

fn check(sizes: &[Size], edges: &[Edge]) -> Result<(), TestCaseError> {
    let layout = layout(sizes, edges).unwrap();
    let rectangles: Vec<Rectangle> =
        sizes.iter().zip(&layout.centres).map(|(size, &centre)| rectangle(size, centre)).collect();
    for (at, &a) in rectangles.iter().enumerate() {
        let whole = (0.0, 0.0, layout.size.0, layout.size.1);
        prop_assert!(
            a.0 >= -1e-6 && a.1 >= -1e-6 && a.2 <= whole.2 + 1e-6 && a.3 <= whole.3 + 1e-6,
            "{:?}",
            a
        );
        for &b in &rectangles[at + 1..] {
            prop_assert!(!meet(a, b), "{:?} lies on {:?}", a, b);
        }
    }
    for (edge, route) in edges.iter().zip(&layout.routes) {
        let mut ends = [route.left, route.right];
        ends.sort_unstable();
        prop_assert_eq!(ends, [edge.from.min(edge.to), edge.from.max(edge.to)]);
        let mut x = rectangles[route.left].2;
        let stops = route.bends.iter().flat_map(|bend| [bend.left_x, bend.right_x]);
        for next in [route.exit_x].into_iter().chain(stops).chain([route.entry_x, rectangles[route.right].0])
        {
            prop_assert!(next >= x - 1e-6, "it goes back from {} to {}", x, next);
            x = next;
        }
        for bend in &route.bends {
            let line = (bend.left_x, bend.y - 2.0, bend.right_x, bend.y + 2.0);
            let hit = rectangles.iter().find(|&&rectangle| meet(line, rectangle));
            prop_assert!(hit.is_none(), "{:?} goes through {:?}", bend, hit);
        }
    }
    Ok(())
}

prop_compose! {
    fn graph()(count in 1_usize..24)(
        sizes in prop::collection::vec((10.0..200.0, 5.0..60.0, 5.0..90.0), count),
        edges in prop::collection::vec((0..count, 0..count, 1_u8..5), 0..50),
    ) -> (Vec<Size>, Vec<Edge>) {
        let size = |(width, above, below)| Size { width, above, below };
        let mut edges = edges;
        edges.retain(|(from, to, _)| from != to);
        let edge = |(from, to, weight)| Edge { from, to, weight: f64::from(weight) };
        (sizes.into_iter().map(size).collect(), edges.into_iter().map(edge).collect())
    }
}

proptest! {
    #[test]
    fn nothing_lies_on_anything_else((sizes, edges) in graph()) {
        check(&sizes, &edges)?;
    }
}

#[test]
fn a_long_edge_with_room_is_straight() {
    let size = Size { width: 40.0, above: 10.0, below: 10.0 };
    let edges = [(0, 1), (1, 2), (2, 3), (3, 4), (0, 4)].map(|(from, to)| Edge { from, to, weight: 1.0 });
    let layout = layout(&[size; 5], &edges).unwrap();
    let bends: Vec<f64> = layout.routes[4].bends.iter().map(|bend| bend.y).collect();
    assert_eq!(bends.len(), 3);
    assert!(bends.iter().all(|y| *y == bends[0]), "{bends:?}");
}
