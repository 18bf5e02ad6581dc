//! Intervals against exact arithmetic: edges by table, points and inclusion at random.
#![cfg(test)]

mod edges;
mod inclusion;
mod oracle;
mod points;
