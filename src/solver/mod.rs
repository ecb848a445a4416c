//! Alternatives to [`NativeSolver`](crate::NativeSolver): the contact step solved by Ipopt.

pub mod ipopt;
