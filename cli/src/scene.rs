//! Scene from the arguments of a simulation.

use super::args::{CubeArgs, SetupArgs};
use super::outcome::{Failure, refuse_flags};
use super::{input, scenario};
use tumble_model::names::FileKind;
use tumble_scene::choices::SceneName;
use tumble_scene::overrides::overridden;
use tumble_scene::run_file;
pub use tumble_scene::scene::Scene;
use tumble_scene::settings::{Settings, SolverTable, polyline};
use tumble_scene::solver_choice::unsuitable;
use tumble_scene::tutorial::CubeChanges;

/// Number of contact points above which Ipopt needs more than 10 ms per iteration
/// (docs/ipopt-path.md).
const MANY_POINTS: usize = 100;

/// Creates and checks the scene.
pub fn from_args(args: &SetupArgs, cube: &CubeArgs) -> Result<Scene, Failure> {
    let flags = settings_from_flags(args);
    let changes = cube_changes(cube)?;
    let scene = match args.scene.path() {
        None => {
            let name = cube.tutorial.unwrap_or(SceneName::Drop);
            let is_set = !args.scene.overrides.is_empty();
            refuse_flags("the tutorial's scenes, which have no file", &[("set", is_set)])?;
            Scene::from_tutorial(name, flags, changes)?
        }
        Some(path) => {
            cube.refuse_with_file()?;
            let mut text = scenario::read_text(path)?;
            let overrides = &args.scene.overrides;
            if !overrides.is_empty() {
                text = overridden(&text, overrides)?;
            }
            let mut scene = Scene::parse_with(&text, path, flags, &args.given(), &input::bytes)?;
            let large = run_file::refuse_large(&scene.model);
            large.map_err(|failure| failure.in_file(path, FileKind::Scenario, &[]))?;
            scene.changed.extend(overrides.iter().map(|field| field.path().to_owned()));
            scene
        }
    };
    let scene = match args.solver.substeps {
        Some(substeps) => scene.in_substeps(substeps)?,
        None => scene,
    };
    on_threads(args, scene)
}

/// Sets the number of threads from the arguments.
pub fn on_threads(args: &SetupArgs, mut scene: Scene) -> Result<Scene, Failure> {
    if let Some(threads) = args.solver.threads {
        let place = "one body, whose steps are one problem each";
        refuse_flags(place, &[("--threads", scene.bodies.len() == 1)])?;
        if let Some(contact) = &mut scene.contact {
            contact.set_threads(threads)?;
        }
    }
    Ok(scene)
}

/// Note at the start of a run: the native solver in place of Ipopt, or that many contact points are
/// slow with Ipopt.
pub fn note(scene: &Scene, args: &SetupArgs) -> Option<String> {
    let is_ipopt = scene.contact.as_ref()?.is_ipopt();
    if !is_ipopt && scene.trajectory && args.solver.solver.is_none() {
        let why = unsuitable(&scene.world)?;
        return Some(format!("the native solver solves this scene: {why}"));
    }
    let points = scene.world.bodies().iter().map(|body| body.contact_points().len());
    let points = points.max().unwrap_or(0);
    (is_ipopt && points > MANY_POINTS).then(|| {
        format!(
            "Ipopt may take seconds per step with {points} contact points; --solver native is faster"
        )
    })
}

/// Settings from the flags of a simulation.
fn settings_from_flags(args: &SetupArgs) -> Settings {
    let physics = &args.physics;
    Settings {
        steps: args.scene.steps,
        start_index: args.scene.start_index,
        seed: args.scene.seed,
        solver: SolverTable {
            name: args.solver.solver,
            preset: args.solver.preset,
            detection: args.solver.detection,
            tolerance: args.solver.tol,
            max_iterations: args.solver.max_iter,
            residual: args.solver.residual,
            on_failure: args.solver.on_failure,
        },
        dt: physics.dt,
        rotation: physics.rotation,
        integrator: physics.integrator,
        accuracy: physics.accuracy,
        impacts: physics.impacts,
        mu: physics.mu,
        restitution: physics.restitution,
        rebound_speed: physics.rebound_speed,
        gravity: physics.gravity,
        robot: args.robot.clone(),
        ..Settings::default()
    }
}

/// Changes of the tutorial's cube from its flags.
fn cube_changes(cube: &CubeArgs) -> Result<CubeChanges, Failure> {
    Ok(CubeChanges {
        mass: cube.mass,
        inertia: cube.inertia.clone(),
        sides: cube.sides,
        plane: cube.plane.clone(),
        force: polyline("force", &cube.force)?,
        torque: polyline("torque", &cube.torque)?,
        force_at: cube.force_at,
        position: cube.position,
        height: cube.height,
        attitude: cube.attitude.clone(),
        velocity: cube.velocity,
        spin: cube.spin,
        frame: cube.frame,
    })
}
