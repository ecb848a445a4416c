//! The joints of the program: their axes in its steps, and what motors add.

use super::super::axis::{
    AxisLaw, AxisUnits, END, FORCE, NUMBERS, Numbers, SPEED, SPEED_BEFORE, START, force_of,
};
use super::super::joint::{ANGULAR, At, Held, Tie, Tied};
use super::{AxisRows, Laws, PlanNlp, Read, refused};
use crate::joint::{Axis, Joint, JointAxis};
use crate::mechanics::State;
use crate::plan::axis::{AXES, axis_of, coasted};
use crate::plan::{AxisMode, ControlKind, PlanError, Problem, Replay, Side as BoundedSide};
use crate::solver::ipopt::units::Units;
use crate::step_nlp::several::component::Place;
use nalgebra::Vector3;

/// What of the joints is the same in all steps, one each.
#[derive(Default)]
pub(super) struct Joints {
    /// Each as it is in every step, of those whose frame in the world moves, and in all steps otherwise.
    ties: Vec<Vec<Tie>>,
    /// Of the place and of the turn.
    pub(super) units: Vec<[AxisUnits; 2]>,
    /// The controls that drive their axes: which control, which axis.
    motors: Vec<Vec<(usize, usize)>>,
    /// The speeds of the axes before the first step.
    speeds: Vec<Numbers>,
    /// Those whose frames in the world move, in every step.
    moved: Vec<Vec<Joint>>,
}

impl Joints {
    pub(super) fn new(problem: &Problem, units: &Units) -> Result<Self, PlanError> {
        let scene = problem.scene();
        let mut joints = Self::default();
        let moved = courses(problem);
        for (index, joint) in scene.world.joints().iter().enumerate() {
            let length = joint.length(scene.world.bodies());
            let own =
                std::iter::once(joint).filter(|_| moved[index].is_empty()).chain(&moved[index]);
            let ties: Option<Vec<_>> =
                own.map(|joint| Tie::new(joint, length, units.length())).collect();
            let Some(ties) = ties else {
                let name = scene.joints.get(index).map_or("a joint", |name| name);
                return refused(&format!(
                    "joint {name:?} turns about two axes or three, or within a cone"
                ));
            };
            let time = units.length() / units.speed();
            let place = AxisUnits { coordinate: units.length(), force: units.force(), time };
            let turn = AxisUnits {
                coordinate: units.length() / length,
                force: units.force() * length,
                time,
            };
            let drives = |(control, of): (usize, &crate::plan::Control)| {
                let ControlKind::Motor { axes } = &of.kind else { return Vec::new() };
                let own = axes.iter().filter(|(joint, _)| *joint == index);
                own.map(|(_, axis)| (control, number_of(*axis))).collect::<Vec<_>>()
            };
            let motors = problem.controls().iter().enumerate().flat_map(drives).collect();
            let start = joint.coordinates(&scene.starts);
            let angles = start.map(|at| joint.counted(&at, &Vector3::zeros()));
            let angles = angles.unwrap_or_default();
            let own = coasted(joint, &scene.starts, scene.world.time_step(), &angles);
            let mut speeds = Numbers::zeros();
            for k in 0..3 {
                speeds[k] = own.0[k] * place.time / place.coordinate;
                speeds[ANGULAR + k] = own.1[k] * turn.time / turn.coordinate;
            }
            joints.ties.push(ties);
            joints.units.push([place, turn]);
            joints.motors.push(motors);
            joints.speeds.push(speeds);
        }
        joints.moved = moved;
        Ok(joints)
    }

    /// The torque of a joint in a step from `states` about the axes of A (N m): of a frame that moves, from which the joint is off at the step's
    /// start, not what its axes there have.
    fn torque(
        &self,
        index: usize,
        step: usize,
        states: &[State],
        own: &Vector3<f64>,
    ) -> Vector3<f64> {
        let Some(joint) = self.moved[index].get(step) else { return *own };
        let about = |k: usize| joint.wrenches(states, JointAxis::Angular(k), own[k]);
        let sum = (0..3).filter_map(about).map(|[on_a, _]| on_a.torque).sum::<Vector3<f64>>();
        joint.frames()[0].rotation().tr_mul(&sum)
    }

    /// A joint as it is in a step.
    pub(super) fn tie(&self, index: usize, step: usize) -> &Tie {
        let ties = &self.ties[index];
        &ties[step.min(ties.len() - 1)]
    }
}

/// The joints whose frames in the world move, in every step where these are at its end: as the simulator has them throughout the step. Of
/// others, none.
fn courses(problem: &Problem) -> Vec<Vec<Joint>> {
    let scene = problem.scene();
    let mut world = scene.world.clone();
    let mut moved = vec![Vec::new(); world.joints().len()];
    if scene.courses.is_empty() {
        return moved;
    }
    for step in 1..=problem.steps() as u64 {
        world.follow(&scene.courses, (scene.start_index + step) as f64 * world.time_step());
        for (joint, _) in &scene.courses {
            moved[*joint].push(world.joints()[*joint].clone());
        }
    }
    moved
}

/// 0 to 2 of the place, 3 to 5 of the turn.
pub(super) fn number_of(axis: JointAxis) -> usize {
    match axis {
        JointAxis::Linear(k) => k,
        JointAxis::Angular(k) => ANGULAR + k,
    }
}

impl<'p> PlanNlp<'p> {
    /// Columns and rows of the axes of all joints in a step of the length `h`.
    pub(super) fn lay_axes(&mut self, step: usize, h: f64, laws: &Laws<'_>) -> Vec<Vec<Held>> {
        let problem = self.problem;
        let joints = problem.scene().world.joints().iter().enumerate();
        let mut all = Vec::with_capacity(self.joints.ties.len());
        for (index, joint) in joints {
            let mut of_joint: Vec<Held> = Vec::new();
            for (number, name) in AXES.into_iter().enumerate() {
                let units = self.joints.units[index][number / ANGULAR];
                let own = |of: &&AxisMode| of.joint == index && of.axis == name;
                let law = match laws.axes {
                    AxisRows::Smoothed(_) => AxisLaw::new(axis_of(joint, name), &units, h, None),
                    AxisRows::Fixed(modes) => {
                        let modes: Vec<_> = modes[step].iter().filter(own).collect();
                        let side = |part| {
                            let known = modes.iter().find(|of| of.part == part);
                            known.map_or(BoundedSide::Between, |of| of.side)
                        };
                        AxisLaw::new(axis_of(joint, name), &units, h, Some(&side))
                    }
                };
                let Some(mut law) = law else { continue };
                if let AxisRows::Smoothed(delta) = laws.axes {
                    law.delta = delta;
                }
                law.compliance = laws.compliance * h;
                let mut columns = [None; NUMBERS];
                for &(number, bounds) in law.variables() {
                    columns[number] = Some(self.add_variables(1, bounds));
                }
                let before = step.checked_sub(1).and_then(|before| {
                    let axes = &self.stages[before].axes[index];
                    axes.iter().find(|held| held.axis == number)?.columns[SPEED]
                });
                columns[SPEED_BEFORE] = before;
                let row = self.rows;
                for [low, high] in law.bounds() {
                    self.add_row_within(low, high);
                }
                of_joint.push(Held { axis: number, law, columns, row });
            }
            all.push(of_joint);
        }
        all
    }

    /// The numbers of all axes, of each step: angles with all the times that they went around.
    pub(super) fn read_axes(&self, x: &[f64], states: &[Vec<State>]) -> Vec<Vec<Vec<Numbers>>> {
        let mut last: Vec<Numbers> = vec![Numbers::zeros(); self.joints.ties.len()];
        let mut all = Vec::with_capacity(self.stages.len());
        for (step, stage) in self.stages.iter().enumerate() {
            let mut of_step = Vec::with_capacity(stage.axes.len());
            for (index, axes) in stage.axes.iter().enumerate() {
                let tie = self.joints.tie(index, step);
                let numbers = |held: &Held| {
                    let mut numbers = held.numbers(x);
                    let near = &mut last[index][held.axis];
                    let at = |step: usize| at(tie, &states[step]);
                    if step == 0 {
                        *near = tie.coordinate(held.axis, at(0), 0.0);
                        numbers[SPEED_BEFORE] = self.joints.speeds[index][held.axis];
                    }
                    numbers[START] = *near;
                    *near = tie.coordinate(held.axis, at(step + 1), *near);
                    numbers[END] = *near;
                    numbers
                };
                of_step.push(axes.iter().map(numbers).collect());
            }
            all.push(of_step);
        }
        all
    }

    /// Each joint, as it is asked.
    pub(super) fn each_tie<'a>(
        &'a self,
        step: usize,
        read: &'a Read,
    ) -> impl Iterator<Item = (&'a Tie, Tied<'a>)> {
        self.stages[step].axes.iter().enumerate().map(move |(index, axes)| {
            let tie = self.joints.tie(index, step);
            let numbers = &read.axes[step][index];
            let mut tied = Tied {
                a: self.side(step, tie.body, read),
                b: tie.other.map(|body| self.side(step, body, read)),
                axes,
                numbers,
                sizes: [[0.0; 3]; 2],
                acts: [Vec::new(), Vec::new()],
            };
            let forces = axes.iter().zip(numbers);
            for (held, numbers) in forces {
                let column = held.columns[FORCE].map(|column| (column, 1.0));
                tied.add_force(held.axis, numbers[FORCE], column);
            }
            for &(control, axis) in &self.joints.motors[index] {
                let knot = self.problem.knot(control, step);
                let (values, places) = self.problem.numbers(control, knot, &read.controls);
                let unit = self.joints.units[index][axis / ANGULAR].force;
                let column =
                    places[0].map(|place| (self.columns[place], self.scales[place] / unit));
                tied.add_force(axis, values[0] / unit, column);
            }
            self.add_gear_forces((step, index), read, &mut tied);
            (tie, tied)
        })
    }

    /// Puts the forces of the axes of a run into its point.
    pub(super) fn place_axes(&self, replay: &Replay, x: &mut [f64]) {
        for (step, stage) in self.stages.iter().enumerate() {
            for (index, axes) in stage.axes.iter().enumerate() {
                let Some(force) = replay.records[step].solution.joints.get(index) else { continue };
                let torque = self.joints.torque(index, step, &replay.states[step], &force.torque);
                for held in axes {
                    let (name, unit) =
                        (AXES[held.axis], self.joints.units[index][held.axis / ANGULAR].force);
                    let k = held.axis % ANGULAR;
                    let total = if held.axis < ANGULAR { force.force[k] } else { torque[k] };
                    if let Some(column) = held.columns[FORCE] {
                        x[column] = total / unit;
                    }
                    let modes = replay.modes.axes[step].iter();
                    for of in modes.filter(|of| of.joint == index && of.axis == name) {
                        if let Some(column) = held.columns[force_of(of.part)] {
                            x[column] = of.force / unit;
                        }
                    }
                }
            }
        }
        let h = self.problem.scene().world.time_step() * self.units.speed() / self.units.length();
        let read = self.read(x);
        for (stage, numbers) in self.stages.iter().zip(&read.axes) {
            for (held, numbers) in stage.axes.iter().flatten().zip(numbers.iter().flatten()) {
                if let Some(column) = held.columns[SPEED] {
                    x[column] = (numbers[END] - numbers[START]) / h;
                }
            }
        }
    }
}

/// Whether an axis of the scene has an armature.
pub(super) fn has_armature(problem: &Problem) -> bool {
    let joints = problem.scene().world.joints().iter();
    let mut axes = joints.flat_map(|joint| joint.linear().iter().chain(joint.angular()));
    axes.any(|axis| matches!(axis, Axis::Free(drive) if drive.armature > 0.0))
}

/// The poses of a joint's bodies.
pub(super) fn at(tie: &Tie, states: &[State]) -> At {
    let place = |body: usize| Place::of(&states[body]);
    (place(tie.body), tie.other.map(place))
}
