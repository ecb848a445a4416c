//! Planning problems: checks, variables and runs.

mod checks;

use super::control::{Applied, Control, ControlKind};
use super::path_constraint::PathConstraint;
use super::target::Target;
use super::{PlanError, piecewise_loads};
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tumble_core::joint::{Joint, JointAxis};
use tumble_core::mechanics::{Load, State, Wrench};
use tumble_core::simulation::{Simulation, StepRecord};
use tumble_core::world::{Integrator, World};
use tumble_scene::scene::Scene;

use checks::{bad_input, check_control, has_body, sets_alike};

/// Largest number of steps.
const MOST_STEPS: usize = 100_000;

/// A planning problem: a scene, its number of steps, controls, targets and path constraints.
///
/// The plan minimises the cost
///
/// ```text
/// J = Σ_targets w |rows(X_after)|² + Σ_path w Σ_k min(0, g(r_k))² + Σ_controls e Σ_k |u_k|²      (P1)
/// ```
#[derive(Clone)]
pub struct PlanProblem {
    pub(super) scene: Scene,
    pub(super) steps: usize,
    controls: Vec<Control>,
    targets: Vec<Target>,
    path_constraints: Vec<PathConstraint>,
    variables: Vec<Variable>,
    /// First variable of each control.
    offsets: Vec<usize>,
    /// True for each body with a wrench from a control.
    pushed: Vec<bool>,
}

/// A variable of the search.
#[derive(Debug, Clone, PartialEq)]
pub struct Variable {
    /// Index of the control.
    pub control: usize,
    /// Piece of the control.
    pub knot: usize,
    /// [Component](ControlKind::components) of the control.
    pub component: usize,
    /// Bounds.
    pub bounds: [f64; 2],
    /// Weight of its square in the cost: e of (P1), times the number of steps of the piece.
    pub effort: f64,
}

impl Variable {
    /// Length of the bounds.
    pub fn scale(&self) -> f64 {
        self.bounds[1] - self.bounds[0]
    }
}

/// Visitor of the steps of a run: the simulation after the step, the wrenches, and the record of the step.
pub(super) type Visit<'a> =
    dyn FnMut(&Simulation<'_>, &[Wrench], &StepRecord) -> Result<(), PlanError> + 'a;

/// Callback that sets the controls of a step from the states at its start.
///
/// Changes to starts, constants and pieces that began earlier have no effect.
pub(super) type Choose<'a> = dyn FnMut(usize, &[State], &mut [f64]) + 'a;

impl PlanProblem {
    /// Builds a problem from its parts and checks them.
    ///
    /// # Errors
    /// [`PlanError::Problem`] for:
    /// - no steps, too many steps, or more knots than steps;
    /// - an unknown body, joint or axis, or a constant that cannot be a control;
    /// - no controls, a push that pulls or that acts beside its body;
    /// - bounds out of order or of a constant out of its range, tolerances or weights that are not above 0;
    /// - two controls of one name, or of the same start or constant;
    /// - targets and path constraints beyond the reach of a state, or none at all.
    pub fn new(
        scene: Scene,
        steps: usize,
        controls: Vec<Control>,
        targets: Vec<Target>,
        path_constraints: Vec<PathConstraint>,
    ) -> Result<Self, PlanError> {
        // A plan needs states that begin steps.
        if scene.world.integrator() != Integrator::Euler {
            return bad_input(
                "the scene has the integrator \"leapfrog\"; a plan needs integrator = \"euler\", whose \
                 steps begin at the states of a run"
                    .to_owned(),
            );
        }
        if !(1..=MOST_STEPS).contains(&steps) {
            return bad_input(format!("steps is {steps}; allowed: 1 to {MOST_STEPS}"));
        }
        // Controls
        for (index, control) in controls.iter().enumerate() {
            check_control(control, &scene.world, steps)
                .or_else(|why| bad_input(format!("control {:?}: {why}", control.name)))?;
            if controls[..index].iter().any(|other| other.name == control.name) {
                return bad_input(format!("controls: {:?} is named twice", control.name));
            }
            if let Some(other) = controls[..index].iter().find(|other| sets_alike(other, control)) {
                let (first, second) = (&other.name, &control.name);
                let why = "set the same value; remove one";
                return bad_input(format!("controls: {first:?} and {second:?} {why}"));
            }
        }
        if targets.is_empty() && path_constraints.is_empty() {
            return bad_input(
                "targets: there are none; a [target] or [[path_constraints]] is needed".to_owned(),
            );
        }
        let bodies = scene.world.bodies().len();
        let positive = |of: &str, name: &str, what: &str, value: f64| {
            if value > 0.0 && value.is_finite() {
                return Ok(());
            }
            bad_input(format!("{of} {name:?}: {what} is {value}; a number above 0 is needed"))
        };
        // Targets and path constraints
        for Target { name, body, after, kind, tolerance, weight } in &targets {
            has_body("target", name, *body, bodies)?;
            if !(1..=steps).contains(after) {
                return bad_input(format!(
                    "target {name:?}: after is {after}; allowed: 1 to {steps}"
                ));
            }
            if let Err(why) = kind.check() {
                return bad_input(format!("target {name:?}: {why}"));
            }
            positive("target", name, "tolerance", *tolerance)?;
            positive("target", name, "weight", *weight)?;
        }
        for PathConstraint { name, body, kind, tolerance, weight } in &path_constraints {
            has_body("path constraint", name, *body, bodies)?;
            if let Err(why) = kind.check() {
                return bad_input(format!("path constraint {name:?}: {why}"));
            }
            positive("path constraint", name, "tolerance", *tolerance)?;
            positive("path constraint", name, "weight", *weight)?;
        }
        // At least one control
        if controls.is_empty() {
            return bad_input(
                "controls: there are none; at least one [[controls]] is needed".to_owned(),
            );
        }
        // One variable for each knot and component whose bounds differ. Its effort counts once a step.
        let (mut variables, mut offsets) = (Vec::new(), Vec::new());
        let mut pushed = vec![false; bodies];
        for (index, control) in controls.iter().enumerate() {
            offsets.push(variables.len());
            for body in control.kind.pushes(&scene.world) {
                pushed[body] = true;
            }
            for knot in 0..control.knots {
                let count = steps_of(knot, control.knots, steps).len();
                for (component, bounds) in control.bounds.iter().enumerate() {
                    if bounds[0] < bounds[1] {
                        let cost = f64::from(u8::from(control.kind.costs(component)));
                        let effort = cost * control.effort * count as f64;
                        let bounds = *bounds;
                        variables.push(Variable {
                            control: index,
                            knot,
                            component,
                            bounds,
                            effort,
                        });
                    }
                }
            }
        }
        let scene = Scene { rows: steps as u64 + 1, ..scene };
        Ok(Self { scene, steps, controls, targets, path_constraints, variables, offsets, pushed })
    }

    /// Scene of the problem.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Number of steps N.
    pub fn steps(&self) -> usize {
        self.steps
    }

    /// Controls.
    pub fn controls(&self) -> &[Control] {
        &self.controls
    }

    /// Targets.
    pub fn targets(&self) -> &[Target] {
        &self.targets
    }

    /// Path constraints.
    pub fn path_constraints(&self) -> &[PathConstraint] {
        &self.path_constraints
    }

    /// Variables in the order of the vector of controls: by control, then by piece, then by component.
    pub fn variables(&self) -> &[Variable] {
        &self.variables
    }

    /// Name of a variable: its control, its component, and its piece if there are several.
    pub fn name_of(&self, variable: &Variable) -> String {
        let control = &self.controls[variable.control];
        let component = control.kind.components()[variable.component];
        match control.knots {
            1 => format!("{}.{component}", control.name),
            _ => format!("{}.{component}[{}]", control.name, variable.knot),
        }
    }

    /// Default start of a search: forces of zero and the scene's starts and constants, clipped to the bounds.
    pub fn zero(&self) -> Vec<f64> {
        let value = |variable: &Variable| {
            let own = match &self.controls[variable.control].kind {
                ControlKind::Start { body, part } => {
                    part.value(&self.scene.starts[*body])[variable.component]
                }
                ControlKind::Constant(constant) => constant.one_number(&self.scene.world),
                _ => 0.0,
            };
            own.clamp(variable.bounds[0], variable.bounds[1])
        };
        self.variables.iter().map(value).collect()
    }

    /// Clips `controls` to their bounds.
    ///
    /// # Errors
    /// A wrong number of controls, or one that is not finite.
    pub fn clipped(&self, controls: &[f64]) -> Result<Vec<f64>, PlanError> {
        let (count, wanted) = (controls.len(), self.variables.len());
        if count != wanted {
            return bad_input(format!("controls: {count} numbers are given; {wanted} are needed"));
        }
        let pairs = controls.iter().zip(&self.variables);
        let clip = |(value, variable): (&f64, &Variable)| {
            if value.is_finite() {
                return Ok(value.clamp(variable.bounds[0], variable.bounds[1]));
            }
            bad_input(format!(
                "controls: {} is {value}; a number is needed",
                self.name_of(variable)
            ))
        };
        pairs.map(clip).collect()
    }

    /// Variables at a bound, to 1e-9 of the length of the bounds.
    pub fn at_bounds(&self, controls: &[f64]) -> Vec<usize> {
        let pairs = controls.iter().zip(&self.variables).enumerate();
        let near = |value: f64, variable: &Variable| {
            let far = variable.bounds.map(|bound| (value - bound).abs());
            far[0].min(far[1]) <= 1e-9 * variable.scale()
        };
        pairs.filter(|(_, (value, of))| near(**value, of)).map(|(index, _)| index).collect()
    }

    /// Piece of `control` in `step`.
    pub fn knot(&self, control: usize, step: usize) -> usize {
        step * self.controls[control].knots / self.steps
    }

    /// Steps of the piece `knot` of `control`.
    pub fn steps_of(&self, control: usize, knot: usize) -> Range<usize> {
        steps_of(knot, self.controls[control].knots, self.steps)
    }

    /// Components of `control` in its piece `knot`, and the index of each one that is a variable.
    pub fn numbers(
        &self,
        control: usize,
        knot: usize,
        controls: &[f64],
    ) -> (Vec<f64>, Vec<Option<usize>>) {
        let bounds = &self.controls[control].bounds;
        let free = bounds.iter().filter(|bounds| bounds[0] < bounds[1]).count();
        let mut next = self.offsets[control] + knot * free;
        let each = bounds.iter().map(|bounds| {
            if bounds[0] < bounds[1] {
                next += 1;
                (controls[next - 1], Some(next - 1))
            } else {
                (bounds[0], None)
            }
        });
        each.unzip()
    }

    /// Force and torque of `control` in `step`, the values of its components, and their indices among the variables.
    ///
    /// `None` if the control is not a force on one body.
    pub fn applied(
        &self,
        control: usize,
        step: usize,
        controls: &[f64],
    ) -> Option<(Applied, Vec<f64>, Vec<Option<usize>>)> {
        let (numbers, places) = self.numbers(control, self.knot(control, step), controls);
        let applied = self.controls[control].kind.applied(&numbers)?;
        Some((applied, numbers, places))
    }

    /// True for each body with a wrench from a control.
    pub fn pushed(&self) -> &[bool] {
        &self.pushed
    }

    /// Wrenches on each body in `step` from `states`: loads of the scene and controls, without gravity.
    pub fn wrenches(
        &self,
        step: usize,
        states: &[State],
        controls: &[f64],
        wrenches: &mut Vec<Wrench>,
    ) {
        let h = self.scene.world.time_step();
        let index = self.scene.start_index + step as u64;
        wrenches.clear();
        let loads = self.scene.loads.iter().zip(states);
        wrenches.extend(loads.map(|(load, state)| load.wrench(index, h, &state.attitude)));
        for (control, Control { kind, .. }) in self.controls.iter().enumerate() {
            if let ControlKind::Motor { axes } = kind {
                let (numbers, _) = self.numbers(control, self.knot(control, step), controls);
                for (joint, axis) in axes {
                    let of = &self.scene.world.joints()[*joint];
                    for (body, wrench) in motor_wrenches(of, states, *axis, numbers[0]) {
                        wrenches[body] = wrenches[body].plus(&wrench);
                    }
                }
            }
            let Some(body) = kind.body() else { continue };
            if let Some((applied, ..)) = self.applied(control, step, controls) {
                wrenches[body] = wrenches[body].plus(&applied.wrench(&states[body]));
            }
        }
    }

    /// Wrenches of the controls alone: `wrenches` of `step` without the loads of the scene.
    pub(super) fn without_loads(
        &self,
        step: usize,
        states: &[State],
        wrenches: &[Wrench],
    ) -> Vec<Wrench> {
        let h = self.scene.world.time_step();
        let index = self.scene.start_index + step as u64;
        let bodies = wrenches.iter().zip(&self.pushed).zip(&self.scene.loads).zip(states);
        let each = bodies.map(|(((wrench, pushed), load), state)| {
            if !pushed {
                return Wrench::zero();
            }
            if load.is_none() {
                return *wrench;
            }
            let own = load.wrench(index, h, &state.attitude);
            Wrench { force: wrench.force - own.force, torque: wrench.torque - own.torque }
        });
        each.collect()
    }

    /// Rounds the wrenches of `step` as the means of loads that hold them are rounded.
    ///
    /// The scene of a plan then runs to the same bits.
    fn held(&self, step: usize, wrenches: &mut [Wrench]) {
        let h = self.scene.world.time_step();
        let index = self.scene.start_index + step as u64;
        let (from, to) = (index as f64 * h, (index + 1) as f64 * h);
        for (wrench, pushed) in wrenches.iter_mut().zip(&self.pushed) {
            if *pushed {
                wrench.force = piecewise_loads::mean(&wrench.force, from, to);
                wrench.torque = piecewise_loads::mean(&wrench.torque, from, to);
            }
        }
    }

    /// Initial states.
    pub fn starts(&self, controls: &[f64]) -> Vec<State> {
        let mut starts = self.scene.starts.clone();
        for (index, Control { kind, .. }) in self.controls.iter().enumerate() {
            if let ControlKind::Start { body, .. } = kind {
                let (numbers, _) = self.numbers(index, 0, controls);
                starts[*body] = kind.started(&numbers, &starts[*body]);
            }
        }
        starts
    }

    /// World with the constants among the controls.
    ///
    /// # Errors
    /// As [`World::with_constants`].
    pub fn world(&self, controls: &[f64]) -> Result<World, PlanError> {
        let chosen = |(index, control): (usize, &Control)| match control.kind {
            ControlKind::Constant(constant) => {
                let (numbers, _) = self.numbers(index, 0, controls);
                Some((constant, constant.from_one_number(&self.scene.world, numbers[0])))
            }
            _ => None,
        };
        let given: Vec<_> = self.controls.iter().enumerate().filter_map(chosen).collect();
        if given.is_empty() {
            return Ok(self.scene.world.clone());
        }
        let given: Vec<_> = given.iter().map(|(constant, of)| (*constant, &of[..])).collect();
        Ok(self.scene.world.with_constants(&given)?)
    }

    /// Runs `controls`, which are within their bounds, and calls `visit` after each step.
    pub(super) fn simulate(
        &self,
        controls: &[f64],
        interrupt: Option<&Arc<AtomicBool>>,
        visit: &mut Visit<'_>,
    ) -> Result<(), PlanError> {
        self.simulate_choosing(&mut controls.to_vec(), &mut |_, _, _| {}, interrupt, visit)
    }

    /// Runs controls that `choose` sets before each step. The run equals that of the resulting controls.
    pub(super) fn simulate_choosing(
        &self,
        controls: &mut [f64],
        choose: &mut Choose<'_>,
        interrupt: Option<&Arc<AtomicBool>>,
        visit: &mut Visit<'_>,
    ) -> Result<(), PlanError> {
        let world = self.world(controls)?;
        let motion = self.scene.motion(&world)?;
        let mut simulation = Simulation::new(world, self.starts(controls), motion)?;
        self.scene.prepare(&mut simulation)?;
        for (body, _) in self.pushed.iter().enumerate().filter(|(_, pushed)| **pushed) {
            simulation.set_load(body, Load::none())?;
        }
        if let Some(flag) = interrupt {
            simulation.interrupt_by(Arc::clone(flag));
        }
        let (mut record, mut wrenches) = (StepRecord::new(), Vec::new());
        for step in 0..self.steps {
            choose(step, simulation.states(), controls);
            self.wrenches(step, simulation.states(), controls, &mut wrenches);
            self.held(step, &mut wrenches);
            for (body, wrench) in wrenches.iter().enumerate() {
                if self.pushed[body] {
                    simulation.set_wrench(body, *wrench)?;
                }
            }
            simulation.step(&mut record)?;
            visit(&simulation, &wrenches, &record)?;
        }
        Ok(())
    }
}

/// Wrenches of a motor of `joint` with a force of `size` on its bodies.
pub(super) fn motor_wrenches(
    joint: &Joint,
    states: &[State],
    axis: JointAxis,
    size: f64,
) -> impl Iterator<Item = (usize, Wrench)> {
    let sides = [Some(joint.body()), joint.other()].into_iter();
    let wrenches = joint.wrenches(states, axis, size).unwrap_or([Wrench::zero(); 2]);
    sides.zip(wrenches).filter_map(|(body, wrench)| body.map(|body| (body, wrench)))
}

/// Steps k of the piece `knot`: those with ⌊k knots/steps⌋ = knot.
fn steps_of(knot: usize, knots: usize, steps: usize) -> Range<usize> {
    (knot * steps).div_ceil(knots)..((knot + 1) * steps).div_ceil(knots)
}
