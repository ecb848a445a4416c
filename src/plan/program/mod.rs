//! N steps as one nonlinear program, solved by Ipopt: the leg `program`.
//!
//! Every step has the equations of motion of its bodies and, of each contact, the law as equations smoothed by δ, with a
//! compliance ε that makes the forces of a step a function of its states. Along a path of falling δ each program starts where the
//! one before ended, with all multipliers. What comes out is controls; the replay says what they are worth.
//!
//! `docs/planning.md` derives the rows (P10 to P18, P24 to P27) and their derivatives (P19 to P23).

mod axis;
mod candidates;
mod contact;
mod goal;
mod joint;
mod law;
mod motion;
mod shift;
mod smoothing;
mod solve;
mod staged;
mod summed;

pub use smoothing::Smoothing;
pub use solve::ProgramLeg;
pub use staged::PlanNlp;

pub(super) use solve::{MINIMUM_FILL, Solved, Told, UNSCALED, or_refused, solve, usual_cost};
