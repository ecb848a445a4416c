//! Solvers with a defect, which the answers must find out.

use nalgebra::Vector4;
use tumble::error::Error;
use tumble::model::{ContactModel, Parameters};
use tumble::quaternion::{advance, left};
use tumble::solver::native::NativeSolver;
use tumble::solver::{Decision, Step, StepReport, StepSolver};
use tumble::state::State;

/// The native solver's answer, with a change.
struct Planted {
    /// The solver's μ for a step, as a share of the model's.
    friction: fn(&Step<'_>) -> f64,
    defect: fn(&Step<'_>, &mut State),
}

impl StepSolver for Planted {
    /// The simulation must not tell on it: the answers have to.
    fn accepted_certificate(&self) -> f64 {
        f64::INFINITY
    }

    fn solve(
        &mut self,
        step: &Step<'_>,
        active: &mut [bool],
        solution: &mut Decision,
    ) -> Result<StepReport, Error> {
        let friction = (self.friction)(step) * step.model.friction();
        let parameters = Parameters { friction, ..step.model.parameters().clone() };
        let model = ContactModel::new(parameters)?;
        let mut solver = NativeSolver::new(&model);
        let report = solver.solve(&Step { model: &model, ..*step }, active, solution)?;
        let mut state = solution.state();
        (self.defect)(step, &mut state);
        solution.as_mut_slice()[..13].copy_from_slice(state.to_vector().as_slice());
        Ok(report)
    }
}

type Made = Result<Box<dyn StepSolver>, Error>;

fn with_defect(defect: fn(&Step<'_>, &mut State)) -> Made {
    Ok(Box::new(Planted { friction: |_| 1.0, defect }))
}

fn with_friction(friction: fn(&Step<'_>) -> f64) -> Made {
    Ok(Box::new(Planted { friction, defect: |_, _| () }))
}

/// r⁺ = r + h v, q⁺ by ω: the positions of explicit Euler.
pub fn explicit(_: &ContactModel) -> Made {
    with_defect(|step, state| {
        let h = step.model.time_step();
        state.position = step.state.position + h * step.state.velocity;
        state.attitude = advance(&step.state.attitude, &step.state.spin, h);
    })
}

/// Positions of the trapezoidal rule, which free fall would agree with.
pub fn trapezoidal(_: &ContactModel) -> Made {
    with_defect(|step, state| {
        let mean = 0.5 * (step.state.velocity + state.velocity);
        state.position = step.state.position + step.model.time_step() * mean;
    })
}

/// Turns by h ω⁺ instead of 2 atan(½ h ω⁺).
pub fn exact_turn(_: &ContactModel) -> Made {
    with_defect(|step, state| {
        let angle = step.model.time_step() * state.spin.norm();
        let axis = state.spin.try_normalize(0.0).unwrap_or_default() * (0.5 * angle).sin();
        let turn = Vector4::new((0.5 * angle).cos(), axis[0], axis[1], axis[2]);
        state.attitude = left(&step.state.attitude) * turn;
    })
}

/// Nine tenths of the friction.
pub fn slippery(_: &ContactModel) -> Made {
    with_friction(|_| 0.9)
}

/// A pyramid for Coulomb's cone, with its edges along x and y: more friction in between.
pub fn pyramid(_: &ContactModel) -> Made {
    with_friction(|step| {
        let direction = step.state.velocity.xy().try_normalize(1e-9).unwrap_or_default();
        direction.amax().max(0.5).recip()
    })
}

/// Creeps by 10 µm a step.
pub fn creeping(_: &ContactModel) -> Made {
    with_defect(|_, state| state.position[0] += 1e-5)
}

/// A hundredth of the creep: 0.6 mm in the minute of slope-stick.
pub fn slowly_creeping(_: &ContactModel) -> Made {
    with_defect(|step, state| {
        if step.state.velocity.norm() < 1e-9 {
            state.position[0] += 1e-6;
        }
    })
}

/// Adds a thousandth to the velocities of every contact step.
pub fn energetic(_: &ContactModel) -> Made {
    with_defect(|_, state| {
        state.velocity *= 1.001;
        state.spin *= 1.001;
    })
}

/// Impacts give back a tenth.
pub fn bouncing(_: &ContactModel) -> Made {
    with_defect(|step, state| {
        let (velocity, spin) = (state.velocity - step.free.velocity, state.spin - step.free.spin);
        if velocity.norm() > 5.0 * step.model.gravity().norm() * step.model.time_step() {
            state.velocity += 0.1 * velocity;
            state.spin += 0.1 * spin;
        }
    })
}

/// A sliding body floats at h μ |v|, as that of a convex relaxation of the law does.
pub fn floating(_: &ContactModel) -> Made {
    with_defect(|step, state| {
        state.position[2] +=
            step.model.time_step() * step.model.friction() * state.velocity.xy().norm();
    })
}

/// Lets everything sink in by a micrometre.
pub fn sinking(_: &ContactModel) -> Made {
    with_defect(|_, state| state.position[2] -= 1e-6)
}
