//! Plans through contact: which controls make the bodies end where they should.
//!
//! A [`Problem`] is a scene, a number of steps, [controls](Control), [targets](Target) of the states, rows to
//! [keep](Keep), and a weight of effort. A plan is its controls; what is said of it is said of its [`Replay`], the run that
//! the simulator makes of them, with its certificates: plan and simulator are the same equations, and a run is all that
//! counts. Controls are looked for by [legs](Leg), one after the other, each from where the best so far ended: whatever a
//! leg thinks of its own answer, the replay judges it.
//!
//! `docs/planning.md` derives the problem and the legs; equation numbers P1, P2, … are its.

mod axis;
mod boxed;
mod control;
mod cost;
mod ddp;
pub mod file;
mod find;
mod held;
mod keep;
mod leg;
mod mode;
mod model;
#[cfg(feature = "ipopt")]
mod polish;
mod problem;
#[cfg(feature = "ipopt")]
pub mod program;
mod replay;
mod sample;
mod scene;
mod shoot;
mod slopes;
mod target;

pub use axis::{AxisMode, DrivePart, Side, axis_modes_of};
pub use control::{Applied, Axes, Control, ControlKind, Push, StartPart};
pub use find::{EXACTLY, Plan, PlanStatus};
pub use keep::{Keep, KeepKind};
pub use leg::{Leg, LegEnd, LegReport, Progress, Watch};
pub use mode::{ContactMode, Mode, Modes, modes_of};
#[cfg(feature = "ipopt")]
pub use polish::Polish;
pub use problem::{Problem, Variable};
pub use replay::{Miss, Replay};
pub use sample::Sample;
pub use shoot::{Method, Shoot};
pub use target::{Row, Target, TargetKind};

use crate::error::Error;

/// Why there is no plan at all.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlanError {
    /// The problem is none: what of it, and what would be right.
    #[error("{0}")]
    Problem(String),
    /// A step that cannot be posed.
    #[error(transparent)]
    Step(Error),
    /// It was interrupted.
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
