//! Summary of a run from its rows.

use crate::joints_summary::{JointsSummary, StiffJointReport};
use crate::output::tables::{IntervalRows, StepRow};
use tumble_core::joint::Knots;
use tumble_core::simulation::summary::{RunSummary, StatusCount};
use tumble_core::step::StepStatus;
use tumble_core::world::World;

/// Statistics of the rows of a run, as the run itself counts its steps.
#[derive(Debug, Clone)]
pub struct RowCounts {
    world: World,
    /// Prescribed motions of joint frames in the world.
    courses: Vec<(usize, Knots)>,
    /// Counts of steps.
    pub summary: RunSummary,
    /// Largest errors of joints.
    pub joints: JointsSummary,
    /// Joints that are too stiff for the time step.
    pub stiff_joints: StiffJointReport,
    /// Largest overlap (m).
    pub largest_overlap: f64,
    /// Number of steps.
    pub steps: u64,
    /// Step whose intervals are not complete.
    open: Option<StatusCount>,
    is_first: bool,
}

impl RowCounts {
    /// Statistics of a run of `world` without rows so far.
    pub fn new(world: World, courses: Vec<(usize, Knots)>) -> Self {
        Self {
            world,
            courses,
            summary: RunSummary::default(),
            joints: JointsSummary::default(),
            stiff_joints: StiffJointReport::default(),
            largest_overlap: 0.0,
            steps: 0,
            open: None,
            is_first: true,
        }
    }

    /// Adds the rows of an interval, in their order, with the last row.
    pub fn add(&mut self, rows: &IntervalRows) {
        self.count(&rows.row);
        let Self { world, courses, .. } = self;
        world.set_span(rows.span(world));
        if !std::mem::take(&mut self.is_first) {
            world.follow(courses, world.time_before(rows.row.index));
            self.joints.add_errors(world, &rows.states);
        }
        self.joints.add_rows(world, rows);
        world.follow(courses, world.time_after(rows.row.index));
        let forces = rows.joint_forces(world);
        let gears: Vec<_> =
            (0..rows.gears.len()).map(|index| rows.gear_force(world, index)).collect();
        self.stiff_joints.add(world, &rows.states, &forces, &gears, rows.row.stiffness);
    }

    /// Counts an interval of a step. The steps are counted when the next one begins.
    fn count(&mut self, row: &StepRow) {
        self.largest_overlap = self.largest_overlap.max(row.overlap);
        let interval = row.count();
        let is_same_step = row.interval > 0 && row.status != StepStatus::End;
        match &mut self.open {
            Some(open) if is_same_step => {
                open.status = open.status.max(interval.status);
                open.iterations = open.iterations.saturating_add(interval.iterations);
                open.restitution_share = open.restitution_share.min(interval.restitution_share);
                if interval.residual.is_nan() || interval.residual > open.residual {
                    open.residual = interval.residual;
                }
            }
            open => {
                if let Some(step) = open.replace(interval) {
                    self.summary.count(&step);
                }
                self.steps += 1;
            }
        }
    }
}
