//! A safe wrapper around the C interface of [Ipopt], the interior-point optimiser of Wächter and
//! Biegler (*Math. Program.* 106, 2006).
//!
//! The wrapper is independent of contact problems. It adds these checks to the C interface:
//!
//! - The sparsity structure is checked once, bounds and start points before every solve.
//! - The lock of `ipopt-sys` is held from create to free, because Ipopt 3.11 and MUMPS keep global
//!   state. A solve started inside a callback is an error.
//! - The lock cannot detect a callback that starts a solve on another thread and waits for it. Such
//!   a callback blocks forever.
//! - A panic in a callback is caught, the solve is ended, and the panic is resumed.
//! - Numbers that are not finite never reach Ipopt's matrices, where they corrupt memory.
//! - Nothing is printed, and `ipopt.opt` in the working directory is not read.
//!
//! Inside this package, only `raw/` contains `unsafe` code.
//!
//! [Ipopt]: https://coin-or.github.io/Ipopt/

mod options;
mod problem;
#[allow(unsafe_code)]
mod raw;
mod status;

pub use options::{BarrierStrategy, MultiplierStep, Options, Scaling};
pub use problem::{Bounds, IpoptProgress, NonlinearProgram, StartPoint};
pub use raw::{IteratePoint, RawSolver, SolveOutcome};
pub use status::ReturnStatus;

/// Version of the linked Ipopt, "3.11.9" for example.
pub const VERSION: &str = env!("TUMBLE_IPOPT_VERSION");

/// Reason why the wrapper refused a solve before Ipopt ran.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum IpoptError {
    /// An array has the wrong length.
    #[error("{what}: {found} numbers given; {expected} are needed")]
    Length {
        /// Name of the array.
        what: &'static str,
        /// Length that the problem requires.
        expected: usize,
        /// Length of the array.
        found: usize,
    },
    /// A number is NaN or infinite.
    #[error("{what}: entry {index} is {value}; a finite number is needed")]
    NotFinite {
        /// Name of the array.
        what: &'static str,
        /// Index of the entry.
        index: usize,
        /// Value of the entry.
        value: f64,
    },
    /// Bounds are NaN, crossed, or infinite on the wrong side.
    #[error("{what}: entry {index} is the empty interval [{lower}, {upper}]")]
    Bounds {
        /// Name of the pair of arrays.
        what: &'static str,
        /// Index of the entry.
        index: usize,
        /// Lower bound.
        lower: f64,
        /// Upper bound.
        upper: f64,
    },
    /// A structural entry is out of range, above the diagonal, or listed twice.
    #[error("{what} pattern: entry {index} at ({row}, {col}) {why}")]
    Structure {
        /// Name of the matrix: Jacobian or Hessian.
        what: &'static str,
        /// Index of the entry.
        index: usize,
        /// Row of the entry.
        row: usize,
        /// Column of the entry.
        col: usize,
        /// Fault of the entry.
        why: &'static str,
    },
    /// The problem has no variables or is larger than C's int.
    #[error(
        "a problem of {variables} variables and {constraints} constraints cannot be given to Ipopt"
    )]
    Size {
        /// Number of variables n.
        variables: usize,
        /// Number of constraints m.
        constraints: usize,
    },
    /// An option is out of its range.
    #[error("Ipopt option {name} is {value:?}; allowed: {allowed}")]
    Option {
        /// Ipopt's name of the option.
        name: &'static str,
        /// Value of the option.
        value: f64,
        /// Allowed range.
        allowed: &'static str,
    },
    /// This build of Ipopt refused an option that the wrapper sets.
    #[error("this build of Ipopt refused its option {name}")]
    OptionRefused {
        /// Ipopt's name of the option.
        name: &'static str,
    },
    /// A solve was started inside a callback of another solve.
    #[error("a solve was started from inside a callback of another solve on the same thread")]
    Reentrant,
    /// Ipopt could not create the problem.
    #[error("Ipopt could not create the problem (out of memory?)")]
    Create,
}
