//! The tosses of a part, and their rows.

use super::plan::Plan;
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
use tumble::rollout::{Batch, Outputs, Watch, roll_out};
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

/// Computes a part; `None` if `interrupt` is raised.
pub fn part(
    plan: &Plan,
    path: &Path,
    part: u32,
    threads: NonZeroUsize,
    interrupt: &Arc<AtomicBool>,
) -> Result<Option<Part>, Failure> {
    let tosses = plan.tosses_of(part);
    let scenes = tosses.clone().map(|toss| scene(plan, path, toss));
    let scenes = scenes.collect::<Result<Vec<_>, _>>()?;
    let starts = scenes.iter().flat_map(|scene| &scene.starts);
    let starts: Vec<f64> = starts.flat_map(|start| start.to_vector().data.0[0]).collect();
    let Some(first) = scenes.first() else {
        return Ok(Some(Part { csv: String::new(), unsolved: 0 }));
    };
    let motion = |world: &World| first.motion(world);
    let (rollouts, bodies) = (scenes.len(), first.bodies.len());
    let steps = usize::try_from(first.rows - 1)
        .map_err(|_| Failure::setting("steps", "more than this machine can count"))?;
    // The seed draws starts alone: the world is that of the first.
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
    let (mut residuals, mut statuses) = (vec![0.0; rollouts * steps], vec![0; rollouts * steps]);
    let outputs = Outputs {
        ends: &mut ends,
        residuals: &mut residuals,
        statuses: &mut statuses,
        ..Outputs::default()
    };
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
    let rows = residuals.chunks(steps).zip(statuses.chunks(steps)).zip(ends.chunks(13 * bodies));
    for ((toss, tempered), ((residuals, statuses), ends)) in tosses.zip(&report.tempered).zip(rows)
    {
        let how = Summary::of(residuals, statuses);
        for (body, state) in first.bodies.iter().zip(ends.chunks(13)) {
            let _ = write!(csv, "{toss},{},{body}", plan.seed + toss);
            for number in state {
                let _ = write!(csv, ",{number:?}");
            }
            let Summary { contact, failed, wild, largest } = how;
            let _ = writeln!(csv, ",{steps},{contact},{failed},{wild},{tempered},{largest:?}");
        }
    }
    Ok(Some(Part { csv, unsolved: report.unsolved.len() }))
}

/// What became of the steps of a toss.
#[derive(Clone, Copy)]
struct Summary {
    contact: usize,
    failed: usize,
    wild: usize,
    largest: f64,
}

impl Summary {
    fn of(residuals: &[f64], statuses: &[u8]) -> Self {
        let count = |wanted: StepStatus| {
            let is = |status: &&u8| StepStatus::ALL[usize::from(**status)] == wanted;
            statuses.iter().filter(is).count()
        };
        Self {
            contact: statuses.len() - count(StepStatus::Free),
            failed: count(StepStatus::Failed),
            wild: count(StepStatus::Wild),
            // A NaN is the largest of all.
            largest: residuals.iter().copied().fold(0.0, |a, b| if b <= a { a } else { b }),
        }
    }
}
