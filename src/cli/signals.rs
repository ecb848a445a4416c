//! Ctrl-C and a polite kill as a flag.

use super::outcome::Failure;
use signal_hook::consts::{SIGINT, SIGTERM};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Ctrl-C and a polite kill raise `flag`; a run then ends within a solver iteration.
pub fn raise_on_signals(flag: &Arc<AtomicBool>) -> Result<(), Failure> {
    for signal in [SIGINT, SIGTERM] {
        signal_hook::flag::register(signal, Arc::clone(flag))
            .map_err(|error| Failure::Other(format!("Ctrl-C cannot be caught: {error}")))?;
    }
    Ok(())
}
