//! Tests of the native solver: its solutions, its selection rule, refused input and memory.

mod allocations;
mod at_rest;
mod bouncing_islands;
#[path = "../common/mod.rs"]
mod common;
mod contact_problems;
mod crowded_heap;
mod determinism;
mod hard_steps;
mod heap_in_a_bin;
mod islands_on_threads;
mod motions;
mod pieces;
mod piles;
mod properties;
mod reference;
mod selection;
mod several_bodies;
mod starts;
mod symmetric;
mod take_back;
#[path = "../common/toss.rs"]
mod toss;
mod wide_cones;
mod wrong_input;
