//! Outcome and results of a run.

use super::scene::Scene;
use serde::{Deserialize, Serialize};
use std::time::Duration;
use tumble_core::simulation::summary::RunSummary;
use tumble_core::simulation::{Interval, Parting, Simulation, StepRecord};
use tumble_core::step::StepSolution;
use tumble_core::world::World;
use tumble_scene::joints_summary::{JointsSummary, StiffJointReport};
use tumble_scene::run_file::RunEnd;

/// Outcome in a checkpoint's run.json.
pub const UNFINISHED: &str = "unfinished";

/// End of a run.
#[derive(Clone, Copy, Default, PartialEq, Eq)]
pub enum RunOutcome {
    #[default]
    Complete,
    /// Interrupted by Ctrl-C.
    Interrupted,
    /// Stopped by a failed step under `--on-failure stop`.
    Stopped,
}

impl RunOutcome {
    /// Name in run.json.
    pub fn name(self) -> &'static str {
        match self {
            Self::Complete => "complete",
            Self::Interrupted => "interrupted",
            Self::Stopped => "stopped",
        }
    }
}

/// Results of a run so far. A saved state has those that a continuation needs.
#[derive(Clone, Default, Serialize, Deserialize)]
pub struct RunResults {
    #[serde(skip)]
    pub end: RunOutcome,
    pub summary: RunSummary,
    /// Time of the stepping alone.
    pub elapsed: Duration,
    /// Step and size (m) of the largest overlap; `None` without steps.
    pub overlap: Option<(u64, f64)>,
    /// Largest errors of joints; `None` without joints.
    pub joints: Option<JointsSummary>,
    /// Joints that are too stiff for the time step.
    pub stiff_joints: StiffJointReport,
    /// Body with the largest estimated error by the time step, and the error (m).
    #[serde(skip)]
    pub time_error: Option<(usize, f64)>,
    /// Displacement by which overlaps at the start were removed.
    #[serde(skip)]
    pub parting: Option<Parting>,
}

impl RunResults {
    /// Creates the results of a run of `scene` before its first step.
    pub fn new(scene: &Scene) -> Self {
        let joints = (!scene.joints.is_empty()).then(JointsSummary::default);
        Self { joints, ..Self::default() }
    }

    /// Adds a step of `scene`. `world` is its world; prescribed motions are moved to the step's end.
    pub fn add(&mut self, scene: &Scene, world: &mut World, record: &StepRecord) {
        self.summary.add(record);
        let overlap = record.overlap();
        if self.overlap.is_none_or(|(_, largest)| overlap > largest) {
            self.overlap = Some((record.index, overlap));
        }
        let Some(joints) = &mut self.joints else { return };
        world.follow(&scene.courses, world.time_after(record.index));
        for interval in record.intervals() {
            let world = interval.world(world);
            let Interval { states, solution, certificate, stiffness, .. } = interval;
            joints.add_errors(&world, &solution.states);
            joints.add_residual(certificate.joint, certificate.joint_law);
            joints.add_stiffness(*stiffness);
            let StepSolution { joints, gears, .. } = solution;
            self.stiff_joints.add(&world, states, joints, gears, *stiffness);
        }
    }

    /// Sets the estimated error by the time step.
    pub fn set_time_error(&mut self, simulation: &Simulation<'_>) {
        let errors = simulation.time_errors().iter().copied().enumerate();
        self.parting = simulation.parting();
        self.time_error = errors.max_by(|(_, a), (_, b)| a.total_cmp(b));
    }

    /// Results for run.json.
    pub fn ended(&self) -> RunEnd<'_> {
        RunEnd {
            outcome: self.end.name(),
            summary: &self.summary,
            seconds: self.elapsed.as_secs_f64(),
            largest_overlap: self.overlap.map_or(0.0, |(_, overlap)| overlap),
            joints: self.joints,
            stiff_joints: &self.stiff_joints,
        }
    }
}
