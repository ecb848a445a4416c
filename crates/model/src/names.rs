//! Names of settings on the command line, in scenario files and in run.json.

use tumble_core::error::Error;
use tumble_core::world::Coefficient;

/// Kind of a file with settings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FileKind {
    /// Scenario file.
    Scenario,
    /// File run.json of a run.
    Run,
}

/// Names of a setting: flag, field of a scenario, field of run.json.
type SettingNames = (&'static str, &'static str, &'static str);

/// Settings whose names differ between these places.
const NAMES: [SettingNames; 27] = [
    ("dt", "time_step", "parameters.dt"),
    ("rotation", "rotation", "parameters.rotation"),
    ("mu", "ground.friction", "parameters.mu"),
    ("stick-speed", "ground.stick_speed", "parameters.stick_speed"),
    ("restitution", "ground.restitution", "parameters.restitution"),
    ("rebound-speed", "ground.rebound_speed", "parameters.rebound_speed"),
    ("mass", "mass", "parameters.mass"),
    ("inertia", "inertia", "parameters.inertia"),
    ("box", "box", "parameters.contact_points"),
    ("points", "points", "parameters.contact_points"),
    ("plane", "ground", "parameters.plane"),
    ("gravity", "gravity", "parameters.gravity"),
    ("force", "load.force", "parameters.load.force"),
    ("torque", "load.torque", "parameters.load.torque"),
    ("force or torque", "load.force or load.torque", "parameters.load"),
    ("force-at", "load.at", "parameters.load.at"),
    ("position", "position", "start.position"),
    ("attitude", "attitude", "start.attitude"),
    ("velocity", "velocity", "start.velocity"),
    ("spin", "spin", "start.spin"),
    ("frame ground", "frame", "start.frame"),
    ("solver", "solver.name", "solver.name"),
    ("detection", "solver.detection", "solver.detection"),
    ("tol", "solver.tolerance", "solver.tol"),
    ("max-iter", "solver.max_iterations", "solver.max_iter"),
    ("residual", "solver.residual", "solver.residual"),
    ("on-failure", "solver.on_failure", "solver.on_failure"),
];

/// Flag of a setting: the first word of its name. A second word is a value.
fn flag_of(name: &str) -> &str {
    name.split(' ').next().unwrap_or(name)
}

/// True if `name`, or another flag for the same quantity, is among `flags`.
pub fn is_among(name: &str, flags: &[&str]) -> bool {
    let also = match name {
        "position" => "height",
        "force or torque" => "torque",
        "points" => "box",
        _ => "",
    };
    flags.contains(&flag_of(name)) || flags.contains(&also)
}

/// Name of the setting on the command line.
pub fn flags(name: &str) -> String {
    match name {
        "position" => "--position or --height".to_owned(),
        "force or torque" => "--force or --torque".to_owned(),
        // Only a scenario file can set points.
        "points" => "--box".to_owned(),
        _ => format!("--{name}"),
    }
}

/// Name of the setting in a file of this kind.
pub fn in_file(name: &str, kind: FileKind) -> String {
    let find = |name: &str| NAMES.iter().find(|(flag, ..)| *flag == name);
    let entry = find(name).or_else(|| find(flag_of(name)));
    match (entry, kind) {
        (Some((_, field, _)), FileKind::Scenario) | (Some((_, _, field)), FileKind::Run) => {
            (*field).to_owned()
        }
        (None, FileKind::Run) if Coefficient::ALL.iter().any(|of| of.name() == name) => {
            format!("parameters.coefficients.{name}")
        }
        (None, _) => name.to_owned(),
    }
}

/// Setting that causes an error of the core.
pub fn behind(error: &Error) -> Option<&'static str> {
    match error {
        Error::Inertia(_) | Error::MomentsApart { .. } | Error::Moment { .. } => Some("inertia"),
        Error::StartBelowGround { .. } => Some("position"),
        Error::Count { field: "contact points", .. } => Some("points"),
        Error::OutOfRange { field, .. } => match *field {
            "time step (s)" => Some("dt"),
            "coefficient of friction" => Some("mu"),
            "stick speed (m/s)" => Some("stick-speed"),
            "coefficient of restitution" => Some("restitution"),
            "rebound speed (m/s)" => Some("rebound-speed"),
            "mass (kg)" => Some("mass"),
            "gravity (m/s²)" => Some("gravity"),
            "side of the box (m)" => Some("box"),
            "contact point coordinate (m)" | "farthest contact point coordinate (m)" => {
                Some("points")
            }
            "position (m)" => Some("position"),
            "norm of the attitude quaternion" => Some("attitude"),
            "normal of the plane" | "length of the plane's normal" | "offset of the plane (m)" => {
                Some("plane")
            }
            "load (N, N m)" | "time of the load (s)" => Some("force or torque"),
            "point of the load (m)" => Some("force-at"),
            "velocity (m/s)" => Some("velocity"),
            "spin (rad/s)" => Some("spin"),
            other => Coefficient::from_quantity(other).map(Coefficient::name),
        },
        _ => None,
    }
}
