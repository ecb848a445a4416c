//! Lock for exclusive use of Ipopt.

use std::cell::Cell;
use std::fmt;
use std::marker::PhantomData;
use std::sync::{Mutex, MutexGuard, PoisonError};

static IPOPT: Mutex<()> = Mutex::new(());

thread_local! {
    /// True if this thread holds [`IPOPT`].
    static HELD: Cell<bool> = const { Cell::new(false) };
}

/// Exclusive use of Ipopt by this thread until the value is dropped. It cannot change threads.
///
/// ```compile_fail,E0277
/// let lock = ipopt_sys::lock().unwrap();
/// std::thread::scope(|scope| {
///     scope.spawn(|| drop(lock));
/// });
/// ```
#[derive(Debug)]
pub struct Exclusive {
    _guard: MutexGuard<'static, ()>,
    /// Makes the type neither `Send` nor `Sync`.
    _here: PhantomData<*mut ()>,
}

/// Error if the thread already holds the lock, for example inside a callback.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reentrant;

impl fmt::Display for Reentrant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("this thread is inside Ipopt already")
    }
}

impl std::error::Error for Reentrant {}

/// Waits until no other thread uses Ipopt. A panic while the lock is held has no effect.
///
/// # Errors
/// [`Reentrant`] if this thread already holds the lock, which would be a deadlock.
pub fn lock() -> Result<Exclusive, Reentrant> {
    if HELD.get() {
        return Err(Reentrant);
    }
    // The lock protects no data, so a poisoned lock is harmless.
    let guard = IPOPT.lock().unwrap_or_else(PoisonError::into_inner);
    HELD.set(true);
    Ok(Exclusive { _guard: guard, _here: PhantomData })
}

impl Drop for Exclusive {
    fn drop(&mut self) {
        HELD.set(false);
    }
}
