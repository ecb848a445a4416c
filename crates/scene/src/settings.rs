//! Settings of a simulation, from flags, scenario files or the tutorial's scenes.

use super::choices::SolverName;
use super::coefficients::Each;
pub use super::tables::SolverTable;
use nalgebra::Vector3;
use std::array::from_fn;
use std::path::PathBuf;
use tumble_core::error::Error;
use tumble_core::mechanics::Rotation;
use tumble_core::mechanics::load::Polyline;
use tumble_core::world::{Impacts, Integrator, Plane, StickSpeed};
use tumble_model::failure::{Failure, refuse_flags};

/// Default seed.
pub const USUAL_SEED: u32 = 42;

/// Largest start index k. The times k h of all later steps are still distinct doubles.
pub const LARGEST_START: u64 = 9_000_000_000_000_000;

/// Settings of a simulation; `None` for a setting that is not given.
#[derive(Debug, Default)]
pub struct Settings {
    /// Number of rows.
    pub steps: Option<u64>,
    /// Start index k.
    pub start_index: Option<u64>,
    /// Seed of random starts.
    pub seed: Option<u32>,
    /// Time step h (s).
    pub dt: Option<f64>,
    /// Discretisation of the rotational equations of motion in contact steps.
    pub rotation: Option<Rotation>,
    /// Meaning of the velocities of a run.
    pub integrator: Option<Integrator>,
    /// Growth of the error of the time step that a run keeps (m/s).
    pub accuracy: Option<f64>,
    /// When impacts happen.
    pub impacts: Option<Impacts>,
    /// Coefficient of friction μ.
    pub mu: Option<f64>,
    /// Other coefficients of the world.
    pub coefficients: Each<f64>,
    /// Slips that have the static coefficients.
    pub stick_speed: Option<StickSpeed>,
    /// Coefficient of restitution e of the world.
    pub restitution: Option<f64>,
    /// Approach speed below which contacts do not bounce (m/s).
    pub rebound_speed: Option<f64>,
    /// Gravitational acceleration (m/s²), world frame.
    pub gravity: Option<Vector3<f64>>,
    /// Plane of the ground.
    pub plane: Option<Plane>,
    /// Solver of contact steps.
    pub solver: SolverTable,
    /// Settings for a single robot file.
    pub robot: RobotSettings,
}

/// Import settings of a single robot file; `[[robots]]` has the same fields in a scenario.
#[derive(Debug, Clone, Default)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
pub struct RobotSettings {
    /// Folder for `package://name/rest` in a robot file: DIR/name/rest is read [default: the
    /// nearest folder that has it, from the robot file upwards].
    #[cfg_attr(feature = "clap", arg(long, value_name = "DIR"))]
    pub packages: Option<PathBuf>,
    /// Part of a robot file to ignore: `tag` or `name` of elements, `tag:name` of one element, or
    /// `@attribute` of all.
    ///
    /// Can be repeated.
    #[cfg_attr(feature = "clap", arg(long, value_name = "WHAT"))]
    pub leave_out: Vec<String>,
    /// Treat contacts of an MJCF file with torsional and rolling friction (condim 4 and 6) as
    /// points with sliding friction only.
    #[cfg_attr(feature = "clap", arg(long))]
    pub point_contacts: bool,
}

impl RobotSettings {
    /// Names of the flags, and whether each is given.
    pub fn given(&self) -> [(&'static str, bool); 3] {
        [
            ("packages", self.packages.is_some()),
            ("leave-out", !self.leave_out.is_empty()),
            ("point-contacts", self.point_contacts),
        ]
    }

    /// Rejects these flags for a file that is not a robot's.
    ///
    /// # Errors
    /// The first given flag.
    pub fn refuse(&self) -> Result<(), Failure> {
        refuse_flags("anything but a robot file; in a scenario, use [[robots]]", &self.given())
    }
}

impl Settings {
    /// Integrator of a run: leapfrog unless another one is given, the rotation is the tutorial's or
    /// Ipopt solves the tutorial's program.
    pub fn integrator(&self) -> Integrator {
        let is_tutorials =
            self.solver.preset.is_some() || self.solver.name == Some(SolverName::Ipopt);
        let rotation = self.rotation.filter(|_| !is_tutorials).unwrap_or(Rotation::Tutorial);
        self.integrator.unwrap_or(Integrator::usual(rotation))
    }

    /// Merges two layers of settings: values of `self` take precedence over those of `below`.
    pub fn over(self, below: Self) -> Self {
        Self {
            steps: self.steps.or(below.steps),
            start_index: self.start_index.or(below.start_index),
            seed: self.seed.or(below.seed),
            dt: self.dt.or(below.dt),
            rotation: self.rotation.or(below.rotation),
            integrator: self.integrator.or(below.integrator),
            accuracy: self.accuracy.or(below.accuracy),
            impacts: self.impacts.or(below.impacts),
            mu: self.mu.or(below.mu),
            coefficients: from_fn(|of| self.coefficients[of].or(below.coefficients[of])),
            stick_speed: self.stick_speed.or(below.stick_speed),
            restitution: self.restitution.or(below.restitution),
            rebound_speed: self.rebound_speed.or(below.rebound_speed),
            gravity: self.gravity.or(below.gravity),
            plane: self.plane.or(below.plane),
            solver: self.solver.over(below.solver),
            robot: self.robot,
        }
    }

    /// Names of the flags that change a value of `below`.
    ///
    /// Only settings that affect the motion count. The seed and the solver are part of every title.
    pub fn changed(&self, below: &Self) -> Vec<String> {
        fn is_other<T: PartialEq>(given: &Option<T>, below: &Option<T>) -> bool {
            given.is_some() && given != below
        }
        let changes = [
            ("start-index", is_other(&self.start_index, &Some(below.start_index.unwrap_or(0)))),
            ("dt", is_other(&self.dt, &below.dt)),
            ("rotation", is_other(&self.rotation, &below.rotation)),
            ("integrator", is_other(&self.integrator, &below.integrator)),
            ("accuracy", is_other(&self.accuracy, &below.accuracy)),
            ("impacts", is_other(&self.impacts, &below.impacts)),
            ("mu", is_other(&self.mu, &below.mu)),
            ("restitution", is_other(&self.restitution, &Some(below.restitution.unwrap_or(0.0)))),
            ("rebound-speed", is_other(&self.rebound_speed, &below.rebound_speed)),
            ("gravity", is_other(&self.gravity, &below.gravity)),
        ];
        let changed = changes.into_iter().filter(|(_, changed)| *changed);
        let robot = self.robot.given().into_iter().skip(1).filter(|(_, given)| *given);
        changed.chain(robot).map(|(name, _)| name.to_owned()).collect()
    }
}

/// Value of a load, and its time (s) if given.
pub type LoadKnot = (Option<f64>, Vector3<f64>);

/// Polyline through the knots of a flag; `None` without knots.
pub fn polyline(flag: &str, knots: &[LoadKnot]) -> Result<Option<Polyline>, Failure> {
    let named = |error: Error| Failure::setting(flag, error);
    match knots {
        [] => Ok(None),
        [(None, value)] => Polyline::constant(*value).map(Some).map_err(named),
        _ => {
            let timed = knots.iter().map(|(time, value)| time.map(|time| (time, *value)));
            let knots = timed.collect::<Option<Vec<_>>>().ok_or_else(|| {
                Failure::setting(flag, "it is given more than once; each needs a time, T:X,Y,Z")
            })?;
            Polyline::new(knots).map(Some).map_err(named)
        }
    }
}
