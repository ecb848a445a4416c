//! Statics: whether a structure can stand, by how much, and where it is weak.
//!
//! Contact forces f in the exact friction cones K, and the forces of joints, balance the loads w of
//! all free bodies,
//!
//! ```text
//! A f + w = 0,   f ∈ K                                                      (S1)
//! ```
//!
//! or a field of velocities y proves that none can,
//!
//! ```text
//! u = Aᵀ y ∈ K*:  u_n ≥ μ ‖u_t‖,   w · y > 0                                 (S2)
//! ```
//!
//! because 0 = y · (A f + w) ≥ w · y for every force state. Both are second-order cone problems,
//! solved by Clarabel and checked here. A force state shows that the structure *can* stand under
//! Coulomb's law. A mechanism shows that it must move.
//!
//! ```
//! use tumble::nalgebra::Vector3;
//! use tumble::statics::{LoadCase, Structure, Verdict};
//! use tumble::{Parameters, RigidBody, State, World};
//!
//! // A cube of 1 kg on the ground, pushed sideways at its centre.
//! let world = World::new(Parameters::new(vec![RigidBody::solid_box(1.0, Vector3::repeat(0.1))?]))?;
//! let states = [State::at_rest([0.0, 0.0, 0.1])];
//! let structure = Structure::at_rest(&world, &states, &[])?.0;
//! assert!(matches!(structure.verdict(), Verdict::Equilibrium(_)));
//! let push = LoadCase::push(&structure, 0, Vector3::x(), Vector3::zeros())?;
//! let limit = structure.largest_factor(&push);
//! assert!((limit.factor().unwrap() - 0.5 * 9.81).abs() < 1e-6); // μ m g
//! # Ok::<(), tumble::Error>(())
//! ```
//!
//! Equation numbers S1, S2, … are those of `docs/statics.md`.

mod at_rest;
mod certificate;
mod conic;
mod friction;
mod limit;
mod loads;
mod slopes;
mod structure;
mod verdict;

pub use at_rest::FromRest;
pub use certificate::{ForceCheck, ForceState, Mechanism, MechanismCheck};
pub use friction::FrictionLimit;
pub use limit::{Limit, WeakSpot};
pub use loads::{LoadCase, Twist};
pub use slopes::Slope;
pub use structure::{AxisRow, ContactRow, Structure};
pub use verdict::Verdict;
