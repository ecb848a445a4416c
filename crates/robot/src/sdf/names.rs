//! Names of elements and attributes of SDF.

use crate::urdf::names::{ElementNames, FORMS};

/// Names in the elements that affect the motion.
pub const NAMES: [ElementNames; 31] = [
    ["sdf", "world model", "light actor", "version"],
    [
        "world",
        "model frame joint gravity physics",
        "gui scene light plugin state atmosphere wind magnetic_field spherical_coordinates road \
         audio actor population",
        "name",
    ],
    [
        "physics",
        "max_step_size",
        "real_time_factor real_time_update_rate max_contacts ode bullet dart simbody",
        "name type default",
    ],
    [
        "model",
        "link joint frame model pose static self_collide",
        "plugin allow_auto_disable enable_wind gripper",
        "name canonical_link placement_frame",
    ],
    [
        "link",
        "inertial collision pose gravity self_collide",
        "visual sensor light projector audio_sink audio_source battery plugin enable_wind \
         particle_emitter must_be_base_link",
        "name",
    ],
    ["inertial", "pose mass inertia density", "", "auto"],
    ["inertia", "ixx ixy ixz iyy iyz izz", "", ""],
    [
        "collision",
        "pose geometry surface proximity_properties density",
        "laser_retro max_contacts",
        "name",
    ],
    ["surface", "friction contact", "soft_contact", ""],
    ["contact", "", "ode bullet", ""],
    ["friction", "ode", "bullet torsional", ""],
    ["ode", "mu mu2", "fdir1 slip1 slip2", ""],
    [
        "proximity_properties",
        "mu_dynamic mu_static",
        "compliant_hydroelastic rigid_hydroelastic hydroelastic_modulus mesh_resolution_hint \
         hunt_crossley_dissipation relaxation_time point_contact_stiffness",
        "",
    ],
    ["geometry", FORMS, "empty", ""],
    ["box", "size", "", ""],
    ["sphere", "radius", "", ""],
    ["cylinder", "radius length", "", ""],
    ["capsule", "radius length", "", ""],
    ["cone", "radius length", "", ""],
    ["ellipsoid", "radii", "", ""],
    ["plane", "normal", "size", ""],
    ["mesh", "uri scale", "declare_convex", ""],
    [
        "joint",
        "parent child pose axis axis2 screw_thread_pitch thread_pitch mimic rotor_inertia gear_ratio",
        "physics sensor plugin controller_gains",
        "name type",
    ],
    ["axis", "xyz limit dynamics mimic use_parent_model_frame", "", ""],
    ["axis2", "xyz limit dynamics mimic use_parent_model_frame", "", ""],
    ["xyz", "", "", "expressed_in"],
    ["limit", "lower upper effort velocity", "stiffness dissipation", ""],
    ["dynamics", "damping friction spring_stiffness spring_reference", "", ""],
    ["mimic", "multiplier offset reference", "", "joint axis multiplier offset"],
    ["frame", "pose", "", "name attached_to"],
    ["pose", "", "", "relative_to degrees rotation_format frame"],
];
