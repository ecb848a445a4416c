//! Ctrl-C, SIGTERM and a closed terminal as a flag.

use super::outcome::Failure;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use std::fs;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Raises `flag` on Ctrl-C, SIGTERM and a closed terminal. A run then ends within a solver
/// iteration. Under `nohup` a closed terminal has no effect.
pub fn raise_on_signals(flag: &Arc<AtomicBool>) -> Result<(), Failure> {
    let hangup = if is_ignored(SIGHUP) { None } else { Some(SIGHUP) };
    for signal in [SIGINT, SIGTERM].into_iter().chain(hangup) {
        signal_hook::flag::register(signal, Arc::clone(flag))
            .map_err(|error| Failure::Other(format!("Ctrl-C cannot be caught: {error}")))?;
    }
    Ok(())
}

/// True if the program was started with `signal` ignored, or if the system does not say so.
fn is_ignored(signal: i32) -> bool {
    let mask = fs::read_to_string("/proc/self/status").ok().and_then(|status| {
        let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"))?;
        u64::from_str_radix(mask.trim(), 16).ok()
    });
    mask.is_none_or(|mask| mask >> (signal - 1) & 1 == 1)
}
