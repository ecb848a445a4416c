//! A safe wrapper around the C interface of [Ipopt], the interior-point optimiser
//! of Wächter and Biegler (*Math. Program.* 106, 2006).
//!
//! The wrapper knows nothing of contact. It adds to the C interface what its users
//! would otherwise find out one crash at a time:
//!
//! - the sparsity structure is checked once, bounds and starts before every solve;
//! - the lock of `ipopt-sys` is held from create to free, because Ipopt 3.11 and MUMPS
//!   keep global state; a solve started inside a callback is an error;
//! - a solve that a callback starts on another thread and waits for would wait for ever:
//!   the lock cannot see that;
//! - a panic in a callback is caught, the solve ended, and the panic resumed;
//! - numbers that are not finite never reach Ipopt's matrices, where they corrupt
//!   memory;
//! - nothing is printed, and no `ipopt.opt` in the working directory is read.
//!
//! `unsafe` stands in `raw/` and nowhere else in this package.
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

/// The version of the Ipopt this build is linked with, "3.11.9" for example.
pub const VERSION: &str = env!("TUMBLE_IPOPT_VERSION");

/// Why a solve was refused before Ipopt ran.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum IpoptError {
    /// An array of the wrong length.
    #[error("{what}: {found} numbers given where the problem has {expected}")]
    Length {
        /// Which array.
        what: &'static str,
        /// The length the problem asks for.
        expected: usize,
        /// The length given.
        found: usize,
    },
    /// A number that is NaN or infinite.
    #[error("{what}: entry {index} is {value}, a finite number is needed")]
    NotFinite {
        /// Which array.
        what: &'static str,
        /// Where.
        index: usize,
        /// What stands there.
        value: f64,
    },
    /// Bounds that are NaN, crossed, or infinite on the wrong side.
    #[error("{what}: entry {index} is the empty interval [{lower}, {upper}]")]
    Bounds {
        /// Which pair of arrays.
        what: &'static str,
        /// Where.
        index: usize,
        /// The lower bound.
        lower: f64,
        /// The upper bound.
        upper: f64,
    },
    /// A structural entry out of range, above the diagonal, or listed twice.
    #[error("{what} pattern: entry {index} at ({row}, {col}) {why}")]
    Structure {
        /// Jacobian or Hessian.
        what: &'static str,
        /// Index of the entry.
        index: usize,
        /// Its row.
        row: usize,
        /// Its column.
        col: usize,
        /// What is wrong with it.
        why: &'static str,
    },
    /// A problem without variables, or larger than C's int.
    #[error(
        "a problem of {variables} variables and {constraints} constraints cannot be given to Ipopt"
    )]
    Size {
        /// n.
        variables: usize,
        /// m.
        constraints: usize,
    },
    /// An option out of its range.
    #[error("Ipopt option {name} is {value:?}; allowed is {allowed}")]
    Option {
        /// Ipopt's name of the option.
        name: &'static str,
        /// The value given.
        value: f64,
        /// The range.
        allowed: &'static str,
    },
    /// This build of Ipopt refused an option that the wrapper sets.
    #[error("this build of Ipopt refused its option {name}")]
    OptionRefused {
        /// Ipopt's name of the option.
        name: &'static str,
    },
    /// A solve was started from inside a callback of another one.
    #[error("a solve was started from inside a callback of another solve on the same thread")]
    Reentrant,
    /// Ipopt could not create the problem.
    #[error("Ipopt could not create the problem (out of memory?)")]
    Create,
}
