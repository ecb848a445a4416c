//! What settings are called: on the command line, in a scenario and in run.json.

use tumble_core::error::Error;

/// A file that gives settings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FileKind {
    /// A scenario.
    Scenario,
    /// A run.json.
    Run,
    /// A point of the tutorial's program.
    Point,
}

/// A setting: its flag, its field of a scenario and of run.json.
type SettingNames = (&'static str, &'static str, &'static str);

/// All but those that are called the same everywhere.
const NAMES: [SettingNames; 27] = [
    ("dt", "time_step", "parameters.dt"),
    ("rotation", "rotation", "parameters.rotation"),
    ("mu", "ground.friction", "parameters.mu"),
    ("restitution", "ground.restitution", "parameters.restitution"),
    ("rebound-speed", "ground.rebound_speed", "parameters.rebound_speed"),
    ("mass", "body.mass", "parameters.mass"),
    ("inertia", "body.inertia", "parameters.inertia"),
    ("box", "body.box", "parameters.contact_points"),
    ("points", "body.points", "parameters.contact_points"),
    ("plane", "ground", "parameters.plane"),
    ("gravity", "gravity", "parameters.gravity"),
    ("force", "load.force", "parameters.load.force"),
    ("torque", "load.torque", "parameters.load.torque"),
    ("force or torque", "load.force or load.torque", "parameters.load"),
    ("force-at", "load.at", "parameters.load.at"),
    ("position", "start.position", "start.position"),
    ("attitude", "start.attitude", "start.attitude"),
    ("velocity", "start.velocity", "start.velocity"),
    ("spin", "start.spin", "start.spin"),
    ("frame ground", "start.frame", "start.frame"),
    ("solver", "solver.name", "solver.name"),
    ("formulation", "solver.formulation", "solver.formulation"),
    ("detection", "solver.detection", "solver.detection"),
    ("tol", "solver.tolerance", "solver.tol"),
    ("max-iter", "solver.max_iterations", "solver.max_iter"),
    ("residual", "solver.residual", "solver.residual"),
    ("on-failure", "solver.on_failure", "solver.on_failure"),
];

/// The first word of a name is the flag, a second one the value in question.
fn flag_of(name: &str) -> &str {
    name.split(' ').next().unwrap_or(name)
}

/// Whether the setting `name` is one of `flags`, which may set it in another way.
pub fn is_among(name: &str, flags: &[&str]) -> bool {
    let also = match name {
        "position" => "height",
        "force or torque" => "torque",
        "points" => "box",
        _ => "",
    };
    flags.contains(&flag_of(name)) || flags.contains(&also)
}

/// What the setting is called on the command line.
pub fn flags(name: &str) -> String {
    match name {
        "position" => "--position or --height".to_owned(),
        "force or torque" => "--force or --torque".to_owned(),
        // A scenario alone gives points.
        "points" => "--box".to_owned(),
        _ => format!("--{name}"),
    }
}

/// What the setting is called in a file.
pub fn in_file(name: &str, kind: FileKind) -> &str {
    let find = |name: &str| NAMES.iter().find(|(flag, ..)| *flag == name);
    let entry = find(name).or_else(|| find(flag_of(name)));
    match (entry, kind) {
        (Some((_, field, _)), FileKind::Scenario) | (Some((_, _, field)), FileKind::Run) => field,
        (_, FileKind::Point) | (None, _) => name,
    }
}

/// The setting that the model refused.
pub fn behind(error: &Error) -> Option<&'static str> {
    match error {
        Error::Inertia(_) | Error::MomentsApart { .. } | Error::Moment { .. } => Some("inertia"),
        Error::StartBelowGround { .. } => Some("position"),
        Error::Count { field: "contact points", .. } => Some("points"),
        Error::OutOfRange { field, .. } => match *field {
            "time step (s)" => Some("dt"),
            "coefficient of friction" => Some("mu"),
            "coefficient of restitution" => Some("restitution"),
            "rebound speed (m/s)" => Some("rebound-speed"),
            "mass (kg)" => Some("mass"),
            "gravity (m/s²)" => Some("gravity"),
            "side of the box (m)" => Some("box"),
            "contact point coordinate (m)" | "farthest contact point coordinate (m)" => {
                Some("points")
            }
            "smoothing epsilon (N)" => Some("epsilon"),
            "position (m)" => Some("position"),
            "norm of the attitude quaternion" => Some("attitude"),
            "normal of the plane" | "length of the plane's normal" | "offset of the plane (m)" => {
                Some("plane")
            }
            "load (N, N m)" | "time of the load (s)" => Some("force or torque"),
            "point of the load (m)" => Some("force-at"),
            "velocity (m/s)" => Some("velocity"),
            "spin (rad/s)" => Some("spin"),
            _ => None,
        },
        _ => None,
    }
}
