//! Interrupts in the middle of a step.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use tumble_core::error::Error;
use tumble_core::simulation::{Simulation, StepRecord};

/// Steps the simulation and raises its interrupt flag after `delay`. Returns the time from the flag
/// to the end of the interrupted step. A thousand steps must take longer than `delay`.
pub fn interrupt_after(
    delay: Duration,
    simulation: &mut Simulation<'_>,
    record: &mut StepRecord,
) -> Duration {
    let flag = Arc::new(AtomicBool::new(false));
    simulation.interrupt_by(Arc::clone(&flag));
    let raised = std::thread::spawn(move || {
        std::thread::sleep(delay);
        flag.store(true, Ordering::Relaxed);
        Instant::now()
    });
    let end = (0..1000).find_map(|_| simulation.step(record).err());
    let late = raised.join().unwrap().elapsed();
    assert_eq!(end, Some(Error::Interrupted));
    late
}
