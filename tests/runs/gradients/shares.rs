//! Forces that the laws leave open: derivatives follow the selection rule that shares them.

use super::{Direction, apart, difference, size, step};
use std::path::Path;
use tumble_core::derivative::StateChange;
use tumble_core::solver::native::{StepChange, StepDerivative};
use tumble_core::world::Constant;
use tumble_scene::scene::Scene;
use tumble_scene::settings::Settings;

/// Two capsules that lie in line, are joined by a ball joint and slide across: five vertical forces
/// for four equations. Their shares decide the friction. Differences below 1e-5 feel gaps of 1e-16 m.
#[test]
fn two_capsules_on_a_ball_joint_that_slide() {
    let capsule = |name: &str, x: f64, speed: f64| {
        format!(
            "[[bodies]]\nname = \"{name}\"\nmass = 0.2\nposition = [{x}, 0, 0.03]\n\
             velocity = [0, {speed}, 0]\ncapsule = {{ length = 0.15, radius = 0.03 }}\n\
             attitude = {{ axis = [0, 1, 0], degrees = 90 }}\n"
        )
    };
    let text = format!(
        "time_step = 1e-3\n[ground]\nfriction = 0.4\n{}{}[[joints]]\nname = \"j\"\n\
         type = \"spherical\"\nbodies = [\"b\", \"a\"]\nanchor = [0.2, 0, 0.03]\n",
        capsule("a", 0.1, 0.2),
        capsule("b", 0.3, 0.7),
    );
    let none = |_: &Path, _: u64| Ok(Vec::new());
    let scene = Scene::of_text(&text, Path::new("s.toml"), Settings::default(), &none).unwrap();
    let (world, states) = (&scene.world, &scene.starts[..]);
    let (simulation, base) = step(world, states, &[]).unwrap();
    let mut derivative = StepDerivative::new();
    simulation.linearise(&base, &mut derivative).unwrap();
    for (constant, size_of) in [(Constant::TimeStep, 1.0), (Constant::Friction, 1.0)] {
        let along = Direction {
            name: format!("{constant:?}"),
            states: vec![StateChange::zero(); 2],
            wrenches: vec![],
            constants: vec![(constant, vec![size_of])],
        };
        let constants: Vec<_> = along.constants.iter().map(|(c, n)| (*c, &n[..])).collect();
        let change = StepChange { constants: &constants, ..StepChange::default() };
        let mut found = Vec::new();
        derivative.push(&change, &mut found).unwrap();
        for by in [1e-4, 1e-5] {
            let ends = (states, &base.solution.states[..]);
            let (expected, _) = difference(world, ends, &along, by).unwrap();
            let (off, scale) = (apart(&found, &expected), size(&expected));
            assert!(off < 1e-6 * scale, "{}, {by:e}: {off:e} of {scale}", along.name);
        }
    }
}
