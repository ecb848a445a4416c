//! Rigid bodies in hard frictional contact, exactly.
//!
//! Each time step is one problem: the semi-implicit equations of motion, no
//! penetration, complementarity of normal force and gap, Coulomb's cone, and maximum
//! dissipation. The equations and their derivatives are derived in
//! `docs/formulation.md`; the equation numbers in this documentation are that page's.
//!
//! The parts, from the inside out:
//!
//! | module | what it is |
//! |---|---|
//! | [`quaternion`], [`body`], [`state`], [`dynamics`] | a rigid body in free motion |
//! | [`model`], [`detection`] | the ground: constants of a step, contact flags |
//! | [`step_nlp`] | the step as a nonlinear program with exact sparse derivatives |
//! | [`certificate`] | how exact a step is, whoever computed it |
//! | [`ipopt`] | a safe wrapper of Ipopt, which knows nothing of contact |
//! | [`solver`] | solvers of the step behind one trait |
//! | [`simulation`], [`scene`], [`random`] | one step after another |
//! | [`trajectory`], [`summary`] | what comes out |
//!
//! The library prints nothing, opens no file and reads no environment. Bad input is an
//! [`error::Error`] with the field in it; a step that does not converge is a
//! [`solver::StepStatus`].

#![deny(unsafe_code)]

pub mod body;
pub mod certificate;
pub mod detection;
pub mod dynamics;
pub mod error;
pub mod ipopt;
pub mod load;
pub mod model;
pub mod plane;
pub mod quaternion;
pub mod random;
pub mod scene;
pub mod simulation;
pub mod solver;
pub mod sparsity;
pub mod state;
pub mod step_nlp;
pub mod summary;
pub mod trajectory;
pub mod validation;
