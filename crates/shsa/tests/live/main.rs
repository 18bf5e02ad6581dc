//! `shsa run` from outside: real time, real processes, requests over HTTP.
#![cfg(test)]

mod running;

mod embedded;
