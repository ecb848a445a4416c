//! Bindings to the C interface of the installed [Ipopt], made sound by two measures:
//!
//! - **One lock for the process.** Ipopt 3.11 and MUMPS keep global state: two concurrent problems
//!   crash the process. [`lock`] returns an [`Exclusive`]. Every call is a method of it or of the
//!   [`Problem`] that borrows it. The lock is unique because cargo allows only one crate that links
//!   `ipopt`.
//! - **A guard against C++ exceptions**, `guard/guard.cpp`: an exception in Ipopt becomes `None`,
//!   `false` or the status −101. It never reaches Rust.
//!
//! The only `unsafe` function is [`Problem::solve`], because the callbacks are C functions. Its
//! documentation lists their obligations.
//!
//! Bindgen generates the types at build time from the installed header. Versions 3.11 (Debian 12)
//! and 3.14 of Ipopt work. They differ in [`Bool`], the type in the callbacks: a C `int` up to 3.13
//! and a C `bool` from 3.14 on. Use [`to_bool`] for both.
//!
//! [Ipopt]: https://coin-or.github.io/Ipopt/

mod lock;
mod problem;

/// Bindings of `guard/guard.h`. The functions are private to this crate.
#[allow(non_camel_case_types, non_snake_case, non_upper_case_globals, missing_docs)]
mod raw {
    include!(concat!(env!("OUT_DIR"), "/bindings.rs"));
}

pub use lock::{Exclusive, Reentrant, lock};
pub use problem::{Arrays, Definition, Problem};
pub use raw::{
    AlgorithmMode, ApplicationReturnStatus, Bool, Eval_F_CB, Eval_G_CB, Eval_Grad_F_CB, Eval_H_CB,
    Eval_Jac_G_CB, Intermediate_CB, UserDataPtr,
};

/// Version of Ipopt whose headers were used for these bindings, such as "3.11.9".
pub const VERSION: &str = env!("IPOPT_SYS_VERSION");

/// Converts `value` to the `Bool` of the installed header.
pub fn to_bool(value: bool) -> Bool {
    value.into()
}
