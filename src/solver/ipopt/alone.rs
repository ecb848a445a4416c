//! The tutorial's program on the ladder: one body and the ground.

use super::ladder::{Climb, Climber, Rung, Within};
use super::memory::Multipliers;
use super::posing::{Effort, pose, solve_posed};
use super::program::{Attempt, Attempted, StartMultipliers};
use super::units::Units;
use super::{BODY, Formulation, IpoptSolver, previous_point, set_point, set_solution};
use crate::contact::{Candidates, Contact};
use crate::error::Error;
use crate::mechanics::quaternion::advance;
use crate::step::{Step, StepReport, StepSolution, StepSolver};
use crate::step_nlp::ProgramPoint;
use crate::step_nlp::layout::STATE;
use crate::world::World;

/// How much friction yields to what differs from the forces of the start, as a part of the
/// body's own answer h/m, in the reduced program. Where the forces have settled that is nothing;
/// where they have not, and the residual says so, Ipopt goes on from the end with this as the
/// start, and what is left is this part of it (docs/ipopt-path.md).
const YIELDING: f64 = 1e-2;

/// Ipopt with the ladder behind it, for one body and the ground.
pub struct Ladder(Climb<Alone>);

/// The tutorial's program with its best end of the step.
struct Alone {
    ipopt: IpoptSolver,
    /// See [`YIELDING`].
    yielding: f64,
    best: ProgramPoint,
    multipliers: Option<Multipliers>,
}

impl Ladder {
    /// Ipopt and the rungs to try, in order; [`Rung::ALL`] is the recommended ladder.
    #[must_use]
    pub fn new(world: &World, ipopt: IpoptSolver, rungs: &[Rung]) -> Self {
        let exact = ipopt.program.formulation == Formulation::Clamped;
        let best = ProgramPoint::zeros(ipopt.program.points());
        let yielding = if exact { 0.0 } else { YIELDING };
        let alone = Alone { ipopt, yielding, best, multipliers: None };
        Self(Climb::of(world, alone, rungs))
    }
}

impl StepSolver for Ladder {
    fn accepted_residual(&self) -> f64 {
        self.0.accepted_residual()
    }

    fn solve(
        &mut self,
        step: &Step<'_>,
        candidates: &mut Candidates,
        solution: &mut StepSolution,
    ) -> Result<StepReport, Error> {
        self.0.solve(step, candidates, solution)
    }
}

impl Climber for Alone {
    /// Ten times what settled steps have. Steps of friction that has just stopped or begun are above it.
    const WORTH_IT: f64 = 1e-2;

    fn begin(&mut self, step: &Step<'_>, contacts: &[Contact]) -> Result<(), Error> {
        self.ipopt.begin(step, contacts)?;
        let units = self.ipopt.program.units;
        self.best.set_free(&units.state(&step.free[BODY]));
        self.multipliers = None;
        Ok(())
    }

    fn max_iterations(&self) -> u32 {
        self.ipopt.program.max_iterations()
    }

    fn patience(&self, rung: Rung, _: &[Rung]) -> u32 {
        rung.patience()
    }

    fn climb(
        &mut self,
        rung: Rung,
        step: &Step<'_>,
        candidates: &mut Candidates,
        native: &StepSolution,
        Within { limit, depth }: Within,
    ) -> Result<Option<Attempted>, Error> {
        let IpoptSolver { program, memory, flags, start, point, .. } = &mut self.ipopt;
        pose(step, candidates.contacts(), program.formulation, flags);
        let units = program.units;
        let mut multipliers = StartMultipliers::Estimated;
        match rung {
            Rung::Warm => match previous_point(memory, step, (flags, &units), start) {
                Some(known) => {
                    multipliers = StartMultipliers::Known(known);
                    coast(step, &units, start);
                }
                None => return Ok(None),
            },
            Rung::Previous => {
                previous_point(memory, step, (flags, &units), start);
            }
            Rung::NativeStart => {
                multipliers = StartMultipliers::Zero;
                flags.fill(false);
                for contact in native.contacts.iter().filter(|contact| contact.carries_force()) {
                    flags[contact.key.point] = true;
                }
                set_point(step, native, &units, start);
            }
            Rung::FreeFlight => start.set_free(&units.state(&step.free[BODY])),
            Rung::SharedWeight => share_weight(step, flags, &units, start),
            Rung::Native => return Ok(None),
        }
        let effort = Effort { limit, depth, yielding: self.yielding };
        let posed = (candidates, &mut flags[..]);
        solve_posed(program, step, (start, multipliers), effort, posed, point).map(Some)
    }

    fn tighten(
        &mut self,
        step: &Step<'_>,
        _: &[Contact],
        attempted: &Attempted,
        tightness: f64,
        limit: u32,
    ) -> Result<Option<Attempted>, Error> {
        let Some(known) = &attempted.multipliers else { return Ok(None) };
        let IpoptSolver { program, flags, start, point, .. } = &mut self.ipopt;
        start.copy_from(point);
        let multipliers = StartMultipliers::Known(known);
        let attempt = Attempt { start, multipliers, limit, tightness, yielding: self.yielding };
        program.attempt(step, flags, attempt, point).map(Some)
    }

    fn undo(&mut self) {
        let IpoptSolver { start, point, .. } = &mut self.ipopt;
        point.copy_from(start);
    }

    fn set_end(&mut self, step: &Step<'_>, _: &[Contact], solution: &StepSolution) {
        let IpoptSolver { program, point, .. } = &mut self.ipopt;
        set_point(step, solution, &program.units, point);
    }

    fn write(&self, step: &Step<'_>, contacts: &[Contact], solution: &mut StepSolution) {
        let IpoptSolver { program, point, .. } = &self.ipopt;
        set_solution(step, contacts, (point, &program.units), solution);
    }

    fn keep_best(&mut self, attempted: Attempted) {
        self.best.copy_from(&self.ipopt.point);
        self.multipliers = attempted.multipliers;
    }

    fn remember(&mut self, step: &Step<'_>, solution: &StepSolution) {
        let multipliers = self.multipliers.take();
        self.ipopt.memory.keep(step.previous, solution, &self.best, multipliers);
    }
}

/// Moves the state of `start` (in `units`), that of step k, on by one step at its own velocities:
/// what slides steadily is then where it will be.
fn coast(step: &Step<'_>, units: &Units, start: &mut ProgramPoint) {
    let (mut state, h) = (step.states[BODY], step.world.time_step());
    state.position += h * state.velocity;
    state.attitude = advance(&state.attitude, &state.spin, h);
    start.as_mut_slice()[STATE].copy_from_slice(units.state(&state).to_vector().as_slice());
}

/// Sets `start` (in `units`) to free flight with the weight on the flagged points.
fn share_weight(step: &Step<'_>, flags: &[bool], units: &Units, start: &mut ProgramPoint) {
    start.set_free(&units.state(&step.free[BODY]));
    let count = flags.iter().filter(|flag| **flag).count().max(1) as f64;
    let weight = step.world.bodies()[BODY].mass() * step.world.gravity().norm();
    let share = weight / units.force() / count;
    let normal = start.layout().force_z();
    let forces = start.as_mut_slice()[normal].iter_mut().zip(flags);
    for (force, _) in forces.filter(|(_, flag)| **flag) {
        *force = share;
    }
}
