//! Rigid bodies in hard frictional contact. Every time step is one problem, solved and judged by a
//! certificate.
//!
//! A step of length h finds the states X⁺ and the contact forces f of all bodies at once:
//!
//! ```text
//! M (v⁺ − v) = h (f_ext + Jᵀ f)        dynamics
//! 0 ≤ f_n ⊥ φ⁺ ≥ 0                     no penetration, complementarity
//! ‖f_t‖ ≤ μ f_n,  f_t · u_t minimal    Coulomb's cone, maximum dissipation
//! ```
//!
//! Every step has a [`Certificate`]. It holds the residual of the step in these equations, in m/s,
//! and is independent of the solver. [`StepStatus`] marks steps that did not converge.
//!
//! ```
//! use tumble::nalgebra::Vector3;
//! use tumble::{
//!     Motion, Parameters, Plane, RigidBody, Rotation, Simulation, State, StepRecord, World,
//! };
//!
//! let world = World::new(Parameters {
//!     bodies: vec![RigidBody::solid_box(1.0, Vector3::repeat(0.1))?], // kg, half sides in m
//!     ground: Some(Plane::level()),
//!     gravity: Vector3::new(0.0, 0.0, -9.81), // m/s²
//!     friction: 0.5,
//!     time_step: 0.002, // s
//!     rotation: Rotation::Momentum,
//! })?;
//! let start = State {
//!     position: Vector3::new(0.0, 0.0, 0.5), // m, the centre of mass
//!     attitude: tumble::random_attitude(42), // unit quaternion (w, x, y, z), body → world
//!     velocity: Vector3::new(3.0, 0.0, 0.0), // m/s, world
//!     spin: Vector3::new(0.0, 10.0, 5.0),    // rad/s, body
//! };
//! let motion = Motion::native(&world);
//! let mut simulation = Simulation::new(world, [start], motion)?;
//! let mut record = StepRecord::new();
//! for _ in 0..1000 {
//!     simulation.step(&mut record)?;
//!     assert!(record.residual() < 1e-9); // m/s
//! }
//! assert!((simulation.state().position.z - 0.1).abs() < 1e-9); // it lies on a face
//! # Ok::<(), tumble::Error>(())
//! ```
//!
//! The guide shows more: joints, several bodies, derivatives and custom solvers
//! ([`docs/guide.md`](https://docs.rs/crate/tumble/latest/source/docs/guide.md)). Scenario files,
//! robots, plans and pictures are separate crates: `tumble-scene`, `tumble-robot`, `tumble-plan`,
//! `tumble-view`.
//!
//! The library prints nothing, opens no file, and reads neither the environment nor a clock. The
//! same input produces the same bits on any number of threads.

#![deny(unsafe_code)]

pub use nalgebra;
pub use tumble_core::contact::certificate::Claim;
pub use tumble_core::contact::{
    Candidates, Certificate, Certifier, Contact, ContactKey, Detection, Features, KeyIndex,
    PairFeatures, Response,
};
pub use tumble_core::derivative::StateChange;
pub use tumble_core::error::Error;
pub use tumble_core::geometry::ContactPoint;
pub use tumble_core::geometry::Piece;
pub use tumble_core::geometry::mesh::Mesh;
#[cfg(feature = "mesh")]
pub use tumble_core::geometry::mesh::{parse_obj, parse_stl};
pub use tumble_core::joint::{
    Axis, Course, Drive, Gear, GearAxis, Joint, JointAxis, JointForce, JointFrame, JointLoad,
    Knots, Motor, TurnKind,
};
pub use tumble_core::mechanics::{Load, Polyline, Pose, RigidBody, Rotation, State, Wrench};
pub use tumble_core::query;
pub use tumble_core::simulation::random::random_attitude;
pub use tumble_core::simulation::scene::{TutorialScene, tutorial_parameters};
pub use tumble_core::simulation::summary::RunSummary;
pub use tumble_core::simulation::{
    Assembly, EnergyBalance, InfeasibleGap, Motion, Simulation, StepRecord, Stiffness,
    UnphysicalCause,
};
#[cfg(feature = "save")]
pub use tumble_core::simulation::{Checkpoints, Run, RunGradient, Saved};
pub use tumble_core::solver::native::{
    NativeSolver, Smoothing, StepChange, StepDerivative, StepGradient,
};
pub use tumble_core::step::{
    ContactForce, IslandSolver, Step, StepReport, StepSolution, StepSolver, StepStatus,
};
pub use tumble_core::world::{
    Coefficient, Constant, ContactLaw, Groups, Integrator, Parameters, Partner, Plane, StickSpeed,
    Touching, TurningFriction, World,
};

pub mod problem;
#[cfg(feature = "rollout")]
pub mod rollout;

#[cfg(feature = "ipopt")]
pub mod ipopt;
#[cfg(feature = "program")]
pub mod solver;
#[cfg(feature = "program")]
pub mod sparsity;
#[cfg(feature = "statics")]
pub mod statics;
#[cfg(feature = "program")]
pub mod step_nlp;

/// Programs of the guide, compiled and run as doctests.
#[cfg(all(doctest, feature = "ipopt", feature = "rollout", feature = "save"))]
#[doc = include_str!("../docs/guide.md")]
struct Guide;
