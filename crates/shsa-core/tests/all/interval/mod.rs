//! Intervals against exact arithmetic: edges by table, points and inclusion at random.

mod edges;
mod inclusion;
mod oracle;
mod points;
