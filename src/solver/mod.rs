//! Other solvers of the contact step than [`NativeSolver`](crate::NativeSolver): the tutorial's program by Ipopt.

pub mod ipopt;
