//! The tosses of a part, and their rows.

use super::plan::{LARGEST_PART_FILE, Plan};
use crate::cli::choices::SolverName;
use crate::cli::input;
use crate::cli::outcome::Failure;
use crate::cli::shown;
use std::fmt::Write as _;
use std::num::NonZeroUsize;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tumble::error::Error;
use tumble::rollout::{Batch, Outputs, Tally, Watch, roll_out};
use tumble::scenario::scene::Scene;
use tumble::scenario::settings::Settings;
use tumble::step::StepStatus;
use tumble::world::World;

/// The header of the table: a row a toss and body, with its state at the end.
pub const HEADER: &str = "toss,seed,body,x_m,y_m,z_m,qw,qx,qy,qz,vx_m_s,vy_m_s,vz_m_s,wx_rad_s,\
                          wy_rad_s,wz_rad_s,steps,contact_steps,failed,wild,\
                          tempered,largest_residual_m_s\n";

/// The rows of a part, without the header, and how many of its steps were not solved.
pub struct Part {
    pub csv: String,
    pub unsolved: usize,
}

/// The scene of a toss.
pub fn scene(plan: &Plan, path: &Path, toss: u32) -> Result<Scene, Failure> {
    let flags = Settings {
        seed: Some(plan.seed + toss),
        steps: plan.steps,
        mu: plan.mu,
        solver: Some(SolverName::Native),
        ..Settings::default()
    };
    let scene = Scene::of_text(&plan.scenario, path, flags, &input::bytes);
    let scene = scene.map_err(|failure| in_sweep(failure, path))?;
    if scene.rows < 2 {
        return Err(Failure::setting("steps", "a toss has 2 rows at least, one step"));
    }
    Ok(scene)
}

/// Says of the file what the scene says of settings that a sweep gives by itself.
fn in_sweep(failure: Failure, path: &Path) -> Failure {
    let why = match &failure {
        Failure::Setting { name, .. } if name == "seed" => {
            "nothing of it is random; a sweep needs a random attitude or jitter"
        }
        Failure::Setting { name, .. } if name == "solver" => {
            "it has no ground; a sweep is of bodies that touch something"
        }
        _ => return failure,
    };
    Failure::Input(format!("{}: {why}", shown::path(path)))
}

/// Refuses a scene of so many bodies that a part of its tosses would be a longer file than is read.
pub fn check_size(plan: &Plan, scene: &Scene) -> Result<(), Failure> {
    /// A row has 16 numbers of up to 24 characters, five counts, and the name of a body.
    const LONGEST_ROW: u64 = 600;
    let rows = u64::from(plan.size()) * scene.bodies.len() as u64;
    if rows * LONGEST_ROW <= LARGEST_PART_FILE {
        return Ok(());
    }
    let (tosses, bodies) = (plan.size(), scene.bodies.len());
    let why = format!(
        "parts of {tosses} tosses of {bodies} bodies would have more than {LARGEST_PART_FILE} bytes; fewer are needed"
    );
    Err(Failure::setting("tosses", why))
}

/// Computes a part; `None` if `interrupt` is raised.
pub fn part(
    plan: &Plan,
    path: &Path,
    part: u32,
    threads: NonZeroUsize,
    interrupt: &Arc<AtomicBool>,
) -> Result<Option<Part>, Failure> {
    let tosses = plan.tosses_of(part);
    if tosses.is_empty() {
        return Ok(Some(Part { csv: String::new(), unsolved: 0 }));
    }
    // The seed draws starts alone: the world is that of the first.
    let (first, mut starts) = (scene(plan, path, tosses.start)?, Vec::new());
    let mut add = |scene: &Scene| {
        starts.extend(scene.starts.iter().flat_map(|start| start.to_vector().data.0[0]));
    };
    add(&first);
    for toss in tosses.clone().skip(1) {
        add(&scene(plan, path, toss)?);
    }
    let motion = |world: &World| first.motion(world);
    let (rollouts, bodies) = (tosses.len(), first.bodies.len());
    let steps = usize::try_from(first.rows - 1)
        .map_err(|_| Failure::setting("steps", "more than this machine can count"))?;
    let batch = Batch {
        motors: &[],
        joint_forces: &[],
        world: &first.world,
        motion: &motion,
        loads: &first.loads,
        courses: &first.courses,
        index: first.start_index,
        rollouts,
        steps,
        starts: &starts,
        controls: &[],
        parameters: &[],
    };
    let mut ends = vec![0.0; rollouts * bodies * 13];
    let outputs = Outputs { ends: &mut ends, ..Outputs::default() };
    let watch = Watch { interrupt: Some(interrupt), done: None };
    let report = match roll_out(&batch, outputs, threads, watch) {
        Ok(report) => report,
        Err(error) if error.error == Error::Interrupted => return Ok(None),
        Err(error) => {
            let toss = error.rollout.map_or(tosses.start, |index| tosses.start + index as u32);
            return Err(Failure::Input(format!("toss {toss}: {}", error.error)));
        }
    };
    let mut csv = String::new();
    for ((toss, tally), ends) in tosses.zip(&report.each).zip(ends.chunks(13 * bodies)) {
        for (body, state) in first.bodies.iter().zip(ends.chunks(13)) {
            let _ = write!(csv, "{toss},{},{body}", plan.seed + toss);
            for number in state {
                let _ = write!(csv, ",{number:?}");
            }
            let contact = tally.steps() - tally.count(StepStatus::Free);
            let [failed, wild] = [StepStatus::Failed, StepStatus::Wild].map(|it| tally.count(it));
            let Tally { tempered, largest_residual: largest, .. } = tally;
            let _ = writeln!(csv, ",{steps},{contact},{failed},{wild},{tempered},{largest:?}");
        }
    }
    Ok(Some(Part { csv, unsolved: report.unsolved.len() }))
}
