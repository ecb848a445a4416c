//! Alternatives to [`NativeSolver`](crate::NativeSolver): the contact step solved by Ipopt.
//!
//! The constants in this module judge recorded steps of Ipopt, so they need no Ipopt.

#[cfg(feature = "ipopt")]
pub mod ipopt;
mod rung;

pub use rung::Rung;

/// Residual above which a step of Ipopt alone counts as failed, m/s. Ipopt's tolerance can be met
/// by points that grossly violate the contact law. The number holds for the tutorial's cube and is
/// scaled with the world's [speed](crate::World::speed_scale).
pub const ACCEPTED_RESIDUAL: f64 = 0.1;

/// Largest residual of a step solved by the [ladder](Rung), m/s, whatever status Ipopt reports. It
/// is 100 times the usual residual. The number holds for the tutorial's cube and is scaled with the
/// world's [speed](crate::World::speed_scale).
pub const LADDER_RESIDUAL: f64 = 1e-3;
