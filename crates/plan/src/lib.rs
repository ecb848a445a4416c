//! Plans through contact: controls that make the bodies of a scene end where they should.
//!
//! A [`PlanProblem`] has a scene, a number of steps, [controls](Control) within bounds,
//! [targets](Target) of the states, [path constraints](PathConstraint) and a weight of effort. A
//! [`Plan`] is a set of controls together with its [`Replay`]: the simulator's own run of these
//! controls, with the certificate of every step. The replay determines cost, misses and status.
//! [Stages](Stage) search one after the other, each from the best replay so far.
//!
//! `docs/planning.md` states the problem and derives the stages. Its equations have the numbers P1, P2, and so on.

mod boxed;
mod cma_es;
mod control;
mod cost;
mod ddp;
pub mod file;
mod mode;
mod model;
mod path_constraint;
mod piecewise_loads;
mod problem;
mod replay;
mod sample;
mod scene;
mod search;
mod shoot;
mod slopes;
mod stage;
mod target;

pub use control::{Applied, Control, ControlFrame, ControlKind, PushControl, StartPart};
pub use mode::{ContactMode, Mode, modes_of};
pub use path_constraint::{PathConstraint, PathConstraintKind};
pub use problem::{PlanProblem, Variable};
pub use replay::{Miss, Replay};
pub use sample::Sample;
pub use search::{Plan, PlanStatus};
pub use shoot::{Method, Shoot};
pub use stage::{SearchProgress, SearchWatch, Stage, StageReport, StageResult};
pub use target::{Target, TargetKind, TargetResidual};

use tumble_core::error::Error;

/// Reason why a search returns no plan.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlanError {
    /// A problem that cannot be posed: one sentence with the fault and the remedy.
    #[error("{0}")]
    Problem(String),
    /// A step that cannot be posed.
    #[error(transparent)]
    Step(Error),
    /// An interrupt before the first run was complete.
    #[error("interrupted")]
    Interrupted,
}

impl From<Error> for PlanError {
    fn from(error: Error) -> Self {
        match error {
            Error::Interrupted => Self::Interrupted,
            other => Self::Step(other),
        }
    }
}
