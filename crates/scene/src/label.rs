//! Names of the components of a world's constants.

use super::scene::Scene;
use tumble_core::joint::JointAxis;
use tumble_core::world::{Constant, Partner};

/// Names of the coordinates.
const AXES: [&str; 3] = ["x", "y", "z"];

/// Name of the body, piece, pair or joint axis of a constant's `component`.
///
/// Empty for a constant of the world.
pub fn label(scene: &Scene, constant: Constant, component: usize) -> String {
    let world = &scene.world;
    let body = |index: usize| scene.bodies[index].clone();
    let axis = |(joint, axis): (usize, JointAxis)| match axis {
        JointAxis::Linear(k) => format!("{}, along {}", scene.joints[joint], AXES[k]),
        JointAxis::Angular(k) => format!("{}, about {}", scene.joints[joint], AXES[k]),
    };
    let owner = |of: Option<(Partner, Option<Partner>)>| match of {
        None => String::new(),
        Some((owner, None)) => scene.partner(owner).to_owned(),
        Some((one, Some(other))) => {
            format!("{} and {}", scene.partner(one), scene.partner(other))
        }
    };
    match constant {
        Constant::Mass | Constant::Size | Constant::Radius => body(component),
        Constant::Inertia => {
            let (row, column) = (component % 9 / 3, component % 3);
            format!("{}, {}{}", body(component / 9), AXES[row], AXES[column])
        }
        Constant::FrictionFactor => {
            owner(world.friction_axis_owner(component).map(|of| (of, None)))
        }
        Constant::Gravity => AXES[component].to_owned(),
        Constant::Anchor => {
            let (joint, side) = (&scene.joints[component / 6], component % 6 / 3);
            format!("{joint}, {} of {}", AXES[component % 3], ["a", "b"][side])
        }
        Constant::MotorTarget
        | Constant::MotorStiffness
        | Constant::MotorDamping
        | Constant::MotorMaxForce => axis(world.motors()[component]),
        Constant::JointFriction
        | Constant::JointStiffness
        | Constant::JointRest
        | Constant::JointDamping
        | Constant::JointForce
        | Constant::Armature
        | Constant::JointRestitution => axis(world.driven_axes()[component]),
        Constant::JointLimits => {
            let of = axis(world.limited_axes()[component / 2]);
            format!("{of}, {}", ["lower", "upper"][component % 2])
        }
        Constant::GearRatio | Constant::GearOffset => {
            let [first, second] =
                world.gears()[component].axes().map(|at| axis((at.joint, at.axis)));
            format!("{first}, with {second}")
        }
        Constant::Ground | Constant::TimeStep => String::new(),
        of_law => owner(world.coefficient_owner(of_law, component)),
    }
}
