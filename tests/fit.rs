//! Fits: hidden parameters come back, broken recordings are refused, threads change nothing.

#[path = "fit/synthetic.rs"]
mod synthetic;

#[path = "fit/recordings.rs"]
mod recordings;

#[path = "fit/search.rs"]
mod search;
