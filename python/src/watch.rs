//! Long work without the interpreter's lock, with interruption by Ctrl-C and progress reports.

use pyo3::prelude::*;
use std::panic::resume_unwind;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::thread;
use std::time::Duration;

/// Interval between checks for signals.
const PERIOD: Duration = Duration::from_millis(20);
/// Number of checks between two progress reports.
const LOOKS: u32 = 5;

/// Work with progress reports and interruption.
pub struct Watched<'a, 'py> {
    /// Flag that ends the work.
    pub interrupt: &'a Arc<AtomicBool>,
    /// Amount of work done, of `total`.
    pub done: &'a AtomicU64,
    pub total: u64,
    /// Callback for both numbers, on the calling thread.
    pub progress: Option<&'a Bound<'py, PyAny>>,
}

impl Watched<'_, '_> {
    /// Runs `work` on its own thread without the interpreter's lock. A signal or an exception in
    /// the progress callback sets the flag. Its exception is raised after the work has ended.
    pub fn run<T: Send>(self, py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
        let result = thread::scope(|scope| {
            let (sender, mut receiver) = sync_channel(1);
            let worker = scope.spawn(move || {
                // The receiver exists until it has received a value.
                let _ = sender.send(work());
            });
            let (mut raised, mut looks) = (None, 0);
            loop {
                let got;
                (receiver, got) = py.detach(move || {
                    let got = receiver.recv_timeout(PERIOD);
                    (receiver, got)
                });
                match got {
                    Ok(value) => return raised.map_or(Ok(value), Err),
                    Err(RecvTimeoutError::Disconnected) => match worker.join() {
                        Err(panic) => resume_unwind(panic),
                        Ok(()) => unreachable!("finished work has sent its result"),
                    },
                    Err(RecvTimeoutError::Timeout) => {}
                }
                looks += 1;
                if raised.is_none() {
                    let report = looks % LOOKS == 0;
                    raised = py.check_signals().and_then(|()| self.report(report)).err();
                    if raised.is_some() {
                        self.interrupt.store(true, Ordering::Relaxed);
                    }
                }
            }
        });
        // The flag applies to this work alone.
        self.interrupt.store(false, Ordering::Relaxed);
        let value = result?;
        self.report(true)?;
        Ok(value)
    }

    fn report(&self, wanted: bool) -> PyResult<()> {
        match self.progress {
            Some(progress) if wanted => {
                progress.call1((self.done.load(Ordering::Relaxed), self.total)).map(|_| ())
            }
            _ => Ok(()),
        }
    }
}
