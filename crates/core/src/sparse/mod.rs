//! Sparse direct solver: elimination order, symbolic plan, and numerical factorisation.
//!
//! The [`Pattern`] of a system of 6 × 6 blocks selects its kernels: plain block elimination
//! ([`BlockSystem`]) or dense [`Fronts`] along a [`SymbolicFactorisation`]. Systems with nodes of other sizes
//! always use fronts.

mod blocks;
mod dense;
mod multifrontal;
mod ordering;
mod pattern;
mod six;
mod symbolic;

pub(crate) use blocks::BlockSystem;
pub(crate) use multifrontal::Fronts;
pub(crate) use pattern::Pattern;
pub(crate) use six::SixFactors;
pub(crate) use symbolic::SymbolicFactorisation;
