//! Solvers with a defect that the validation problems must find.

use crate::turning::step_attitude;
use tumble_core::contact::{Candidates, Contact, ContactLaw};
use tumble_core::error::Error;
use tumble_core::mechanics::State;
use tumble_core::mechanics::quaternion::advance;
use tumble_core::solver::native::NativeSolver;
use tumble_core::step::{Step, StepReport, StepSolution, StepSolver};
use tumble_core::world::World;

/// The native solver with a modified solution.
struct Planted {
    solver: NativeSolver,
    /// The solver's μ for a step, as a share of the world's.
    friction: fn(&Given) -> f64,
    defect: fn(&Given, &mut State),
}

/// Data of a step in the frame of the slope: x downhill, z along its normal.
struct Given {
    /// h, s.
    time_step: f64,
    /// μ.
    friction: f64,
    /// |g|, m/s².
    gravity: f64,
    state: State,
    free: State,
}

impl Given {
    fn from_step(step: &Step<'_>) -> Self {
        let (world, ground) = (step.world, step.world.ground().unwrap());
        Self {
            time_step: world.time_step(),
            friction: world.friction(),
            gravity: world.gravity().norm(),
            state: ground.state_to_ground(&step.states[0]),
            free: ground.state_to_ground(&step.free[0]),
        }
    }
}

impl StepSolver for Planted {
    /// The accepted residual must not reveal the defect. The quantities have to.
    fn accepted_residual(&self) -> f64 {
        f64::INFINITY
    }

    fn solve(
        &mut self,
        step: &Step<'_>,
        candidates: &mut Candidates,
        solution: &mut StepSolution,
    ) -> Result<StepReport, Error> {
        let given = Given::from_step(step);
        let law = ContactLaw::plastic((self.friction)(&given) * given.friction);
        let contacts = candidates.contacts();
        let known = contacts.len();
        let changed = contacts.iter().map(|contact| Contact { law, ..*contact });
        let mut others = Candidates::from(changed.collect::<Vec<_>>());
        let report = self.solver.solve(step, &mut others, solution)?;
        candidates.extend(others.contacts()[known..].iter().copied());
        let ground = step.world.ground().unwrap();
        let mut state = ground.state_to_ground(&solution.states[0]);
        (self.defect)(&given, &mut state);
        solution.states[0] = ground.state_to_world(&state);
        Ok(report)
    }
}

type Made = Result<Box<dyn StepSolver>, Error>;

fn with_defect(world: &World, defect: fn(&Given, &mut State)) -> Made {
    Ok(Box::new(Planted { solver: NativeSolver::new(world), friction: |_| 1.0, defect }))
}

fn with_friction(world: &World, friction: fn(&Given) -> f64) -> Made {
    Ok(Box::new(Planted { solver: NativeSolver::new(world), friction, defect: |_, _| () }))
}

/// r⁺ = r + h v, q⁺ by ω: the positions of explicit Euler.
pub fn explicit(world: &World) -> Made {
    with_defect(world, |given, state| {
        let h = given.time_step;
        state.position = given.state.position + h * given.state.velocity;
        state.attitude = step_attitude(&given.state.attitude, &given.state.spin, h);
    })
}

/// Positions of the trapezoidal rule, which free fall would agree with.
pub fn trapezoidal(world: &World) -> Made {
    with_defect(world, |given, state| {
        let mean = 0.5 * (given.state.velocity + state.velocity);
        state.position = given.state.position + given.time_step * mean;
    })
}

/// Turns by 2 atan(½ h ω⁺) instead of h ω⁺.
pub fn short_turn(world: &World) -> Made {
    with_defect(world, |given, state| {
        state.attitude = advance(&given.state.attitude, &state.spin, given.time_step);
    })
}

/// Nine tenths of the friction.
pub fn slippery(world: &World) -> Made {
    with_friction(world, |_| 0.9)
}

/// A pyramid for Coulomb's cone, with its edges along x and y: more friction in between.
pub fn pyramid(world: &World) -> Made {
    with_friction(world, |given| {
        let direction = given.state.velocity.xy().try_normalize(1e-9).unwrap_or_default();
        direction.amax().max(0.5).recip()
    })
}

/// Creeps by 10 µm a given.
pub fn creeping(world: &World) -> Made {
    with_defect(world, |_, state| state.position[0] += 1e-5)
}

/// A hundredth of the creep: 0.6 mm in the minute of slope-stick.
pub fn slowly_creeping(world: &World) -> Made {
    with_defect(world, |given, state| {
        if given.state.velocity.norm() < 1e-9 {
            state.position[0] += 1e-6;
        }
    })
}

/// Adds a thousandth to the velocities of every contact given.
pub fn energetic(world: &World) -> Made {
    with_defect(world, |_, state| {
        state.velocity *= 1.001;
        state.spin *= 1.001;
    })
}

/// Impacts give back a tenth.
pub fn bouncing(world: &World) -> Made {
    with_defect(world, |given, state| {
        let (velocity, spin) = (state.velocity - given.free.velocity, state.spin - given.free.spin);
        if velocity.norm() > 5.0 * given.gravity * given.time_step {
            state.velocity += 0.1 * velocity;
            state.spin += 0.1 * spin;
        }
    })
}

/// A sliding body floats at h μ |v|, as under a convex relaxation of the law.
pub fn floating(world: &World) -> Made {
    with_defect(world, |given, state| {
        state.position[2] += given.time_step * given.friction * state.velocity.xy().norm();
    })
}

/// Lets everything sink in by a micrometre.
pub fn sinking(world: &World) -> Made {
    with_defect(world, |_, state| state.position[2] -= 1e-6)
}
