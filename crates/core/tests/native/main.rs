//! Tests of the native solver: its solutions, its selection rule, stand-alone problems and memory.

#![allow(clippy::disallowed_methods)]

mod allocations;
mod at_rest;
#[path = "../common/mod.rs"]
mod common;
#[path = "../common/contact_problem.rs"]
mod contact_problem;
mod contact_problems;
mod crowded_heap;
mod determinism;
mod heap_in_a_bin;
mod islands_on_threads;
mod motions;
mod pieces;
mod piles;
mod problems;
mod properties;
mod selection;
mod several_bodies;
mod symmetric;
#[path = "../common/toss.rs"]
mod toss;
mod wide_cones;
