//! Scene from the arguments of a simulation.

use super::args::SetupArgs;
use super::outcome::Failure;
use super::{input, scenario};
use tumble_scene::choices::SceneName;
use tumble_scene::overrides::FieldOverride;
use tumble_scene::run_file;
pub use tumble_scene::scene::Scene;
use tumble_scene::solver_choice::unsuitable;

/// Number of contact points above which Ipopt needs more than 10 ms per iteration
/// (docs/ipopt-path.md).
const MANY_POINTS: usize = 100;

/// Creates and checks the scene.
pub fn from_args(args: &SetupArgs) -> Result<Scene, Failure> {
    from_fields(args, &[])
}

/// Creates and checks the scene with more fields, which are set last.
pub fn from_fields(args: &SetupArgs, more: &[FieldOverride]) -> Result<Scene, Failure> {
    let overrides = [&args.overrides()?[..], more].concat();
    let scene = match &args.scene.file {
        None => {
            let name = args.scene.tutorial.unwrap_or(SceneName::Drop);
            Scene::from_tutorial(name, &overrides, &args.robot).map_err(Failure::as_flag)?
        }
        Some(path) => {
            let text = scenario::read_text(path)?;
            let scene = Scene::parse_with(&text, path, &overrides, &args.robot, &input::bytes);
            let scene = scene.map_err(Failure::as_flag)?;
            run_file::refuse_large(&scene.document).map_err(|failure| failure.in_file(path))?;
            scene
        }
    };
    let scene = match args.solver.substeps {
        Some(substeps) => scene.in_substeps(substeps).map_err(Failure::as_flag)?,
        None => scene,
    };
    on_threads(args, scene)
}

/// Sets the number of threads from the arguments.
pub fn on_threads(args: &SetupArgs, mut scene: Scene) -> Result<Scene, Failure> {
    if let Some(threads) = args.solver.threads {
        let place = "one body, whose steps are one problem each";
        Failure::refuse_idle(place, &[("threads", scene.bodies.len() == 1)])
            .map_err(Failure::as_flag)?;
        if let Some(contact) = &mut scene.contact {
            contact.set_threads(threads).map_err(Failure::as_flag)?;
        }
    }
    Ok(scene)
}

/// Note at the start of a run: the native solver in place of Ipopt, or that many contact points are
/// slow with Ipopt.
pub fn note(scene: &Scene, args: &SetupArgs) -> Option<String> {
    let is_ipopt = scene.contact.as_ref()?.is_ipopt();
    if !is_ipopt && scene.trajectory && args.fields.get("solver").is_none() {
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
