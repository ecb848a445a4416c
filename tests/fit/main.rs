//! Fits: hidden parameters come back, broken recordings are refused, threads change nothing.

mod mechanism;
mod polish;
mod recordings;
mod search;
mod synthetic;
