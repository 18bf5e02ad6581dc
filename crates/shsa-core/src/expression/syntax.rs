//! The tree of a formula as it was written, each node with its place in the text.

use alloc::boxed::Box;
use alloc::string::String;
use alloc::vec::Vec;
use core::ops::Range;

use crate::unit::Unit;

/// A formula as it was written; names are not resolved yet.
#[derive(Clone, Debug, PartialEq)]
pub struct Expr {
    /// The kind of node.
    pub node: Node,
    /// The place, in bytes of the text.
    pub span: Range<usize>,
    depth: usize,
}

/// The kinds of nodes of a written formula.
#[derive(Clone, Debug, PartialEq)]
pub enum Node {
    /// A number, with a unit when one is written behind it.
    Number(f64, Option<Unit>),
    /// A variable, a parameter, or a constant such as `pi`.
    Name(String),
    /// A function and its arguments; `if` counts as one, too.
    Call(String, Vec<Expr>),
    /// A sign before a term.
    Prefix(Prefix, Box<Expr>),
    /// An operator between two terms.
    Infix(Infix, Box<Expr>, Box<Expr>),
    /// `vector[index]`
    Index(Box<Expr>, Box<Expr>),
    /// A point of a table: `[argument, value]`
    Point(Box<Expr>, Box<Expr>),
    /// `vector[from..to]`, half open, each end may be left out.
    Slice(Box<Expr>, Option<Box<Expr>>, Option<Box<Expr>>),
}

/// The operators before a term.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Prefix {
    /// `-`
    Minus,
    /// `not`
    Not,
}

/// The operators between two terms.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Infix {
    /// `+`
    Add,
    /// `-`
    Subtract,
    /// `*`
    Multiply,
    /// `/`
    Divide,
    /// `^`
    Power,
    /// `<`
    Less,
    /// `<=`
    AtMost,
    /// `>`
    Greater,
    /// `>=`
    AtLeast,
    /// `==`
    Equal,
    /// `!=`
    Unequal,
    /// `and`
    And,
    /// `or`
    Or,
}

impl Infix {
    /// The operator's notation.
    #[must_use]
    pub const fn symbol(self) -> &'static str {
        match self {
            Infix::Add => "+",
            Infix::Subtract => "-",
            Infix::Multiply => "*",
            Infix::Divide => "/",
            Infix::Power => "^",
            Infix::Less => "<",
            Infix::AtMost => "<=",
            Infix::Greater => ">",
            Infix::AtLeast => ">=",
            Infix::Equal => "==",
            Infix::Unequal => "!=",
            Infix::And => "and",
            Infix::Or => "or",
        }
    }

    /// All operators of the parser.
    pub const ALL: [Infix; 13] = [
        Infix::Or,
        Infix::And,
        Infix::Less,
        Infix::AtMost,
        Infix::Greater,
        Infix::AtLeast,
        Infix::Equal,
        Infix::Unequal,
        Infix::Add,
        Infix::Subtract,
        Infix::Multiply,
        Infix::Divide,
        Infix::Power,
    ];
}

impl Prefix {
    /// The operator's notation.
    #[must_use]
    pub const fn symbol(self) -> &'static str {
        match self {
            Prefix::Minus => "-",
            Prefix::Not => "not",
        }
    }

    /// All operators of the parser.
    pub const ALL: [Prefix; 2] = [Prefix::Minus, Prefix::Not];
}

/// Two formulas that are equal: `lhs = rhs`.
#[derive(Clone, Debug, PartialEq)]
pub struct Equation {
    /// The left side.
    pub lhs: Expr,
    /// The right side.
    pub rhs: Expr,
}

/// A function of the model: `name(parameters): body`.
#[derive(Clone, Debug, PartialEq)]
pub struct Function {
    /// The name.
    pub name: String,
    /// The names of the parameters, all different.
    pub parameters: Vec<String>,
    /// The formula of the result; spans count in the body's text.
    pub body: Expr,
}

impl Expr {
    pub(super) fn new(node: Node, span: Range<usize>) -> Expr {
        let deepest = node.children().map(|child| child.depth).max().unwrap_or(0);
        Expr { node, span, depth: deepest + 1 }
    }

    /// The number of nodes on the longest path from here to a leaf.
    pub(super) fn depth(&self) -> usize {
        self.depth
    }

    /// The places of a name, in the order of the text.
    #[must_use]
    pub fn places_of(&self, name: &str) -> Vec<Range<usize>> {
        let own = matches!(&self.node, Node::Name(own) if own == name).then(|| self.span.clone());
        own.into_iter().chain(self.node.children().flat_map(|child| child.places_of(name))).collect()
    }
}

impl Node {
    fn children(&self) -> impl Iterator<Item = &Expr> {
        let (fixed, list): ([Option<&Expr>; 3], &[Expr]) = match self {
            Node::Number(..) | Node::Name(_) => ([None; 3], &[]),
            Node::Call(_, arguments) => ([None; 3], arguments),
            Node::Prefix(_, of) => ([Some(of), None, None], &[]),
            Node::Infix(_, left, right) | Node::Index(left, right) | Node::Point(left, right) => {
                ([Some(left), Some(right), None], &[])
            }
            Node::Slice(of, from, to) => ([Some(of), from.as_deref(), to.as_deref()], &[]),
        };
        fixed.into_iter().flatten().chain(list)
    }
}
