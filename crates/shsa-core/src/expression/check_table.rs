//! Checks tables: the units of their points, and that these ascend.

use alloc::vec::Vec;
use core::ops::Range;

use super::check::{Checker, Typed};
use super::curve::Point;
use super::formula::Formula;
use super::measure::Measure;
use super::operation::{Constant, Reduction};
use super::problem::Problem;
use super::syntax::{Expr, Node};

const NOTATION: &str = "write `table(x, [0, 1], [2, 5])`: each point is an argument and its value";

/// One side of all points, and before it what is looked up: checked, and as it was written.
#[derive(Default)]
struct Column {
    typed: Vec<Typed>,
    written: Vec<Expr>,
}

impl Checker<'_> {
    pub(super) fn table(&mut self, span: &Range<usize>, of: &Expr, points: &[Expr]) -> Option<Typed> {
        let typed = self.numeric("`table`", of);
        let (mut arguments, mut values) = (Column::default(), Column::default());
        let mut curve = Vec::new();
        let mut is_complete = true;
        for point in points {
            match self.point(point, &mut arguments, &mut values) {
                Some(point) => curve.push(point),
                None => is_complete = false,
            }
        }
        let typed = typed.filter(|_| is_complete)?;
        self.ascend(&curve, points)?;
        let formula = Formula::table(typed.formula.clone(), &curve);
        arguments.typed.insert(0, typed);
        arguments.written.insert(0, of.clone());
        self.column(span, &arguments);
        let (measure, weight) = self.column(span, &values);
        Some(self.made(span, formula, measure)?.weighing(weight))
    }

    /// Reports a point that stands outside of a table.
    pub(super) fn point_alone(&mut self, span: &Range<usize>) -> Option<Typed> {
        self.error(span, "a point `[x, y]` stands outside of a table", NOTATION)
    }

    fn point(&mut self, point: &Expr, arguments: &mut Column, values: &mut Column) -> Option<Point> {
        let Node::Point(at, value) = &point.node else {
            self.error(&point.span, "this is no point of a table", NOTATION);
            return None;
        };
        let at = self.exact(at, arguments);
        let value = self.exact(value, values);
        at.zip(value).map(|(at, value)| Point { at, value })
    }

    /// Checks an exact constant, and adds it to its column.
    fn exact(&mut self, expression: &Expr, column: &mut Column) -> Option<Constant> {
        let (constant, typed) = self.constant("a point of a table", expression)?;
        if !constant.is_certain() {
            let help = "state the `error` of the relation for what the table leaves open";
            self.error(&expression.span, "a point of a table is exact", help);
            return None;
        }
        column.typed.push(typed);
        column.written.push(expression.clone());
        Some(constant)
    }

    fn ascend(&mut self, curve: &[Point], points: &[Expr]) -> Option<()> {
        let pairs = curve.iter().zip(curve.iter().skip(1)).zip(points.iter().skip(1));
        let mut is_ascending = true;
        for ((one, next), place) in pairs {
            let message = if one.at.value > next.at.value {
                "the points of a table ascend"
            } else if one == next {
                "this point of a table stands here twice"
            } else {
                continue;
            };
            let help = "two points of one argument are a jump between their values";
            self.report(Problem::error(place.span.clone(), message).with_help(help));
            is_ascending = false;
        }
        is_ascending.then_some(())
    }

    /// The unit that all of a column has, and its weight.
    fn column(&mut self, span: &Range<usize>, column: &Column) -> (Measure, super::affine::Weight) {
        let measures = column.typed.iter().map(|typed| typed.measure);
        let common = measures.reduce(|one, other| self.common(span, "table", one, other));
        let weight = self.reduced(span, "table", Reduction::Min, &column.typed, &column.written);
        (common.unwrap_or(Measure::Unknown), weight)
    }
}
