//! Messages of one shape, as a sender repeats them: what is between their numbers and texts is compared with an earlier message,
//! which is quicker than a pass through it.

use super::scanner::Scanner;
use super::walk::{Broken, Kind, Place, Visitor, scalar, walk};

/// The most shapes that are known at a time: those that came last.
const SHAPES_MAX: usize = 4;
/// The longest message whose shape is kept, bytes.
const TEXT_MAX: usize = 1 << 14;
/// The most messages for which no shape is tried or learnt, where none of the known ones comes again: as in lists of any length.
const PAUSE_MAX: u32 = 1 << 10;

/// The shapes of the last messages of one kind. `N` is the node of their visitor.
#[derive(Debug)]
pub struct Shapes<N> {
    /// The latest one is the last.
    known: Vec<Shape<N>>,
    /// For how many more messages none is tried, and for how many after the next that is learnt.
    left: u32,
    pause: u32,
    /// The numbers and texts of the current message.
    scalars: Vec<Place>,
}

impl<N> Default for Shapes<N> {
    fn default() -> Shapes<N> {
        Shapes { known: Vec::new(), left: 0, pause: 0, scalars: Vec::new() }
    }
}

/// The shape of a message.
#[derive(Debug)]
struct Shape<N> {
    /// All between its scalars, and before and behind them.
    between: Vec<u8>,
    /// Where each part of it ends; there is one more than there are scalars.
    ends: Vec<usize>,
    events: Vec<Event<N>>,
    /// Whether another message had it.
    came_again: bool,
}

/// What a visitor is told.
#[derive(Clone, Copy, Debug)]
enum Event<N> {
    Enter(N),
    /// A scalar, by its number.
    Scalar(N, usize),
    /// A list or an object.
    Whole {
        node: N,
        kind: Kind,
        from: Anchor,
        to: Anchor,
    },
}

/// A place by the number of the scalars before it, and the bytes since the last of them.
#[derive(Clone, Copy, Debug)]
struct Anchor {
    scalars: usize,
    bytes: usize,
}

impl<N: Copy> Shapes<N> {
    /// As [`walk`], of which it tells the visitor the same. The nodes that the visitor gives must depend on nothing but the nodes
    /// above, the names and the indices. `O(bytes)`; allocates only where it learns a shape.
    ///
    /// # Errors
    /// As [`walk`].
    pub fn walk<V: Visitor<Node = N>>(&mut self, text: &str, root: N, visitor: &mut V) -> Result<(), Broken> {
        if self.left > 0 || text.len() > TEXT_MAX {
            self.left = self.left.saturating_sub(1);
            return walk(text, root, visitor);
        }
        let fits = |shape: &Shape<N>| shape.fits(text, &mut self.scalars);
        if let Some(at) = self.known.iter().rposition(fits) {
            self.known.get_mut(at..).unwrap_or_default().rotate_left(1);
            self.known.last_mut().into_iter().for_each(|shape| shape.came_again = true);
            self.known.last().into_iter().for_each(|shape| shape.tell(&self.scalars, visitor));
            return Ok(());
        }
        let shape = Shape::learn(text, root, visitor)?;
        if self.known.len() == SHAPES_MAX {
            let oldest = self.known.remove(0);
            self.pause = if oldest.came_again { 0 } else { (2 * self.pause + 1).min(PAUSE_MAX) };
            self.left = self.pause;
        }
        self.known.push(shape);
        Ok(())
    }
}

impl<N> Shape<N> {
    /// Whether a message has this shape; then these are its scalars.
    fn fits(&self, text: &str, scalars: &mut Vec<Place>) -> bool {
        scalars.clear();
        let (mut scanner, mut begin) = (Scanner::new(text), 0);
        for end in &self.ends {
            let part = self.between.get(begin..*end).unwrap_or_default();
            if !text.as_bytes().get(scanner.at..).is_some_and(|rest| rest.starts_with(part)) {
                return false;
            }
            begin = *end;
            scanner.at += part.len();
            if scalars.len() + 1 == self.ends.len() {
                break;
            }
            let from = scanner.at;
            let Ok(kind) = scalar(&mut scanner) else { return false };
            scalars.push(Place::between(kind, from, scanner.at));
        }
        scanner.at == text.len()
    }
}

impl<N: Copy> Shape<N> {
    /// Tells the visitor what a pass through a message with these scalars would.
    fn tell<V: Visitor<Node = N>>(&self, scalars: &[Place], visitor: &mut V) {
        let at = |anchor: Anchor| {
            let last = anchor.scalars.checked_sub(1).and_then(|last| scalars.get(last));
            last.map_or(0, |last| last.outside().end) + anchor.bytes
        };
        for event in &self.events {
            match *event {
                Event::Enter(node) => visitor.enter(node),
                Event::Scalar(node, number) => {
                    scalars.get(number).into_iter().for_each(|place| visitor.leave(node, *place));
                }
                Event::Whole { node, kind, from, to } => {
                    visitor.leave(node, Place { kind, from: at(from), to: at(to) });
                }
            }
        }
    }

    /// Passes through a message, and keeps its shape.
    fn learn<V: Visitor<Node = N>>(text: &str, root: N, visitor: &mut V) -> Result<Shape<N>, Broken> {
        let mut learner = Learner { visitor, scalars: Vec::new(), events: Vec::new(), begun: Vec::new() };
        walk(text, Some(root), &mut learner)?;
        let Learner { scalars, events, .. } = learner;
        let mut shape = Shape { between: Vec::new(), ends: Vec::new(), events, came_again: false };
        let mut begin = 0;
        let end = Place { kind: Kind::Null, from: text.len(), to: text.len() };
        for place in scalars.iter().chain([&end]).map(|place| place.outside()) {
            shape.between.extend_from_slice(text.as_bytes().get(begin..place.start).unwrap_or_default());
            shape.ends.push(shape.between.len());
            begin = place.end;
        }
        Ok(shape)
    }
}

/// A visitor that wants all scalars, and tells another one what that wants.
struct Learner<'v, V: Visitor> {
    visitor: &'v mut V,
    scalars: Vec<Place>,
    events: Vec<Event<V::Node>>,
    /// For each list and object that is open, the number of scalars before it.
    begun: Vec<usize>,
}

impl<V: Visitor> Learner<'_, V> {
    /// A place of the message, behind all scalars before this one.
    fn anchor(&self, scalars: usize, at: usize) -> Anchor {
        let last = scalars.checked_sub(1).and_then(|last| self.scalars.get(last));
        Anchor { scalars, bytes: at - last.map_or(0, |last| last.outside().end) }
    }
}

impl<V: Visitor> Visitor for Learner<'_, V> {
    /// That of the other visitor, where it wants the value.
    type Node = Option<V::Node>;

    fn member(&mut self, of: Self::Node, name: &str) -> Option<Self::Node> {
        Some(of.and_then(|of| self.visitor.member(of, name)))
    }

    fn element(&mut self, of: Self::Node, index: usize) -> Option<Self::Node> {
        Some(of.and_then(|of| self.visitor.element(of, index)))
    }

    fn enter(&mut self, node: Self::Node) {
        self.begun.push(self.scalars.len());
        if let Some(node) = node {
            self.visitor.enter(node);
            self.events.push(Event::Enter(node));
        }
    }

    fn leave(&mut self, node: Self::Node, place: Place) {
        let begun = self.begun.pop().unwrap_or(0);
        let is_whole = matches!(place.kind, Kind::List | Kind::Object);
        if !is_whole {
            self.scalars.push(place);
        }
        let Some(node) = node else { return };
        self.visitor.leave(node, place);
        self.events.push(match is_whole {
            true => {
                let to = self.anchor(self.scalars.len(), place.to);
                Event::Whole { node, kind: place.kind, from: self.anchor(begun, place.from), to }
            }
            false => Event::Scalar(node, self.scalars.len() - 1),
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Writes down all that it is told, and leaves out what is below the name `skip`.
    #[derive(Default)]
    struct Log(Vec<String>);

    impl Visitor for Log {
        /// The depth.
        type Node = usize;

        fn member(&mut self, of: usize, name: &str) -> Option<usize> {
            (name != "skip").then_some(of + 1)
        }

        fn element(&mut self, of: usize, index: usize) -> Option<usize> {
            (index < 3).then_some(of + 1)
        }

        fn enter(&mut self, node: usize) {
            self.0.push(format!("{node}"));
        }

        fn leave(&mut self, node: usize, place: Place) {
            self.0.push(format!("{node} {place:?}"));
        }
    }

    /// What the visitor is told of each message by a pass, and by the shapes of those before.
    fn told(messages: &[String]) -> (Vec<String>, Vec<String>) {
        let (mut shapes, mut by_pass, mut by_shapes) = (Shapes::default(), Vec::new(), Vec::new());
        for text in messages {
            let (mut one, mut other) = (Log::default(), Log::default());
            let result = walk(text, 0, &mut one);
            assert_eq!(shapes.walk(text, 0, &mut other), result, "{text}");
            // Of what is no JSON, nothing that was told counts.
            if result.is_ok() {
                by_pass.extend(one.0);
                by_shapes.extend(other.0);
            }
        }
        (by_pass, by_shapes)
    }

    fn scalars() -> impl Strategy<Value = String> {
        prop_oneof![
            "-?[0-9]{1,3}",
            "[1-9][0-9]{0,2}\\.[0-9]{1,3}(e[0-9])?",
            "\"[a\\\\\" ,é]{0,4}\"",
            "(null|true|NaN|-Infinity|nul)"
        ]
    }

    fn values() -> impl Strategy<Value = String> {
        scalars().prop_recursive(3, 12, 4, |inner| {
            let name = prop_oneof!["(a|b|skip)"];
            prop_oneof![
                prop::collection::vec(inner.clone(), 0..4).prop_map(|all| format!("[{}]", all.join(", "))),
                prop::collection::vec((name, inner), 0..4).prop_map(|all| {
                    let all: Vec<String> =
                        all.iter().map(|(name, value)| format!("\"{name}\":{value}")).collect();
                    format!("{{{} }}", all.join(","))
                }),
            ]
        })
    }

    /// The message with other numbers.
    fn renumbered(text: &str, by: u32) -> String {
        text.chars().map(|it| it.to_digit(10).map_or(it, |_| char::from(b'1' + (by % 9) as u8))).collect()
    }

    proptest! {
        #[test]
        fn shapes_tell_what_a_pass_tells(some in prop::collection::vec(values(), 1..7), order in prop::collection::vec((0..7_usize, 0..9_u32), 0..30), other in scalars()) {
            let message = |(which, by): &(usize, u32)| {
                let text = renumbered(&some[which % some.len()], *by);
                if *by == 8 { text.replace('1', &other) } else { text }
            };
            let messages: Vec<String> = some.iter().cloned().chain(order.iter().map(message)).collect();
            let (by_pass, by_shapes) = told(&messages);
            prop_assert_eq!(by_pass, by_shapes);
        }
    }

    #[test]
    fn a_shape_comes_again_with_other_scalars() {
        let first = r#"{"a": [1, {"b": "x"}], "skip": 3, "c": {} }"#;
        let mut shapes = Shapes::default();
        shapes.walk(first, 0, &mut Log::default()).unwrap();
        let fits = |text: &str| shapes.known[0].fits(text, &mut Vec::new());
        assert!(fits(first) && fits(r#"{"a": [-1.5e3, {"b": null}], "skip": "\"", "c": {} }"#));
        for other in [
            r#"{"a": [1, {"b": "x"}], "skip": 3, "c": {} } "#,
            r#"{"a": [1, {"b": "x"}], "skip": 3, "c": {}"#,
            r#"{"a": [1, {"b": "x"}], "skip": [], "c": {} }"#,
            r#"{"a": [01, {"b": "x"}], "skip": 3, "c": {} }"#,
            r#"{"a": [1, {"b": "x}], "skip": 3, "c": {} }"#,
            r#"{"a": [1, 2, {"b": "x"}], "skip": 3, "c": {} }"#,
            "",
        ] {
            assert!(!fits(other), "{other}");
        }
    }

    #[test]
    fn what_never_comes_again_is_learnt_rarely() {
        let mut shapes = Shapes::default();
        let mut learnt = 0;
        for length in 0..500 {
            let text = format!("[{}0]", "0,".repeat(length));
            let before = shapes.known.last().map(|shape| shape.ends.len());
            shapes.walk(&text, 0, &mut Log::default()).unwrap();
            learnt += usize::from(shapes.known.last().map(|shape| shape.ends.len()) != before);
        }
        assert!((SHAPES_MAX..20).contains(&learnt), "{learnt}");
    }
}
