//! Document of a scene that was made: the content of run.json, and of scenario files that are written.
//!
//! Its numbers are exact: the world made of it has the same bits.

use super::scene::Scene;
use nalgebra::Vector3;
use serde::Serialize;
use std::collections::HashMap;
use std::fmt::Write as _;
use toml::{Table, Value};
use tumble_core::geometry::terrain::TerrainShape;
use tumble_core::joint::{Drive, Gear, GearAxis, Motor};
use tumble_core::mechanics::load::Polyline;
use tumble_core::mechanics::quaternion::unit;
use tumble_core::mechanics::{Load, State};
use tumble_core::world::{Impacts, Plane};
use tumble_model::failure::Failure;
use tumble_model::groups::GroupsModel;
use tumble_model::joint::JointModel;
use tumble_model::packed::{pack_floats, pack_indices};
use tumble_model::shape::{ModelForm, ModelPlace, ModelShape, PlacedForm};
use tumble_model::{FixedModel, Model, PairModel, PartnerModel, TerrainModel};

/// First line of a scenario file that may be replaced.
pub const HEAD: &str = "# Written by tumble, which may replace this file.\n";

/// Table with these fields. A field whose value is `None` is left out.
macro_rules! table {
    ($($name:literal: $value:expr),* $(,)?) => {{
        let mut table = Table::new();
        $(put(&mut table, $name, &$value);)*
        table
    }};
}

/// Sets a field of `table`, unless its value is `None`, which TOML does not have.
fn put(table: &mut Table, name: &str, value: &impl Serialize) {
    if let Ok(value) = Value::try_from(value) {
        table.insert(name.to_owned(), value);
    }
}

/// Scenario file that reproduces this scene except for its solver.
///
/// # Errors
/// A terrain that cannot be packed.
pub fn text(scene: &Scene) -> Result<String, Failure> {
    let start_index = Some(scene.start_index).filter(|index| *index > 0);
    let mut document =
        table! { "name": scene.name, "steps": scene.rows, "start_index": start_index };
    document.extend(document_of(&scene.model, scene.contact.is_none())?);
    // The draws of a seed are numbers in a file.
    for body in document.get_mut("bodies").and_then(Value::as_array_mut).into_iter().flatten() {
        body.as_table_mut().map(|body| body.remove("drawn"));
    }
    Ok(toml_text(&document))
}

/// Text of a document: plain fields, then tables, then lists of tables, each field in a line.
pub fn toml_text(document: &Table) -> String {
    let (mut out, mut tables) = (String::new(), String::new());
    // Writing to a string cannot fail.
    for (name, value) in document {
        let is_list = |entries: &[Value]| entries.first().is_some_and(Value::is_table);
        match value {
            Value::Table(table) => {
                let _ = writeln!(tables, "\n[{name}]");
                fields(&mut tables, table);
            }
            Value::Array(entries) if is_list(entries) => {
                for table in entries.iter().filter_map(Value::as_table) {
                    let _ = writeln!(tables, "\n[[{name}]]");
                    fields(&mut tables, table);
                }
            }
            value => {
                let _ = writeln!(out, "{name} = {value}");
            }
        }
    }
    out + &tables
}

fn fields(out: &mut String, table: &Table) {
    for (field, value) in table {
        let _ = writeln!(out, "{field} = {value}");
    }
}

/// TOML string.
pub fn quoted(text: &str) -> String {
    Value::from(text).to_string()
}

/// Document of `model`, without its solver and number of steps. A body that `floats` has no ground.
///
/// # Errors
/// A terrain that cannot be packed.
pub fn document_of(model: &Model, floats: bool) -> Result<Table, Failure> {
    let mut document = table! {
        "time_step": model.dt,
        "rotation": (!floats).then(|| model.rotation.name()),
        "integrator": (!floats).then(|| model.integrator.name()),
        "accuracy": model.accuracy,
        "impacts": (model.impacts == Impacts::Located).then(|| model.impacts.name()),
        "gravity": model.gravity,
        "groups": Some(&model.groups).filter(|groups| !groups.is_empty()),
        "ground": (!floats).then(|| ground(model)),
    };
    let mut shapes = HashMap::new();
    let mut looks = HashMap::new();
    let bodies: Vec<_> =
        (0..model.bodies.len()).map(|index| body(model, index, &mut shapes, &mut looks)).collect();
    let terrains: Result<Vec<_>, String> =
        (0..model.terrains.len()).map(|index| terrain(model, index)).collect();
    let courses = |joint: &&JointModel| joint.course.is_some();
    let joints = model.joints.iter().filter(|joint| joint.course.is_none());
    let apart = model.apart.iter().map(|pair| {
        table! { "between": [object_name(model, PartnerModel::Body(pair.body)), object_name(model, pair.partner)] }
    });
    let surfaces = model.surfaces.iter().map(|surface| {
        table! {
            "of": object_name(model, surface.of),
            "velocity": surface.velocity,
            "axis": surface.friction_axis.map(|(axis, _)| axis),
            "factor": surface.friction_axis.map(|(_, factor)| factor),
        }
    });
    let driven = model.joints.iter().filter(courses).map(|joint| {
        table! {
            "name": joint.name,
            "body": object_name(model, PartnerModel::Body(joint.body)),
            "frames": joint.frames,
            "course": joint.course,
        }
    });
    let pairs = |pairs: &[PairModel]| -> Vec<Table> {
        let pair = |pair: &PairModel| {
            let between = [
                object_name(model, PartnerModel::Body(pair.body)),
                object_name(model, pair.partner),
            ];
            table! { "between": between, "coefficient": pair.coefficient }
        };
        pairs.iter().map(pair).collect()
    };
    let laws = model.coefficients.iter().map(|(law, all)| (law.name(), pairs(&all.pairs)));
    let lists = [
        ("bodies", bodies),
        ("fixed", fixed(model)),
        ("terrain", terrains.map_err(Failure::Other)?),
        ("friction", pairs(&model.frictions)),
        ("restitution", pairs(&model.restitutions)),
        ("apart", apart.collect()),
        ("joints", joints.clone().map(|joint| joint_table(model, joint)).collect()),
        ("motors", joints.flat_map(motors).collect()),
        ("gears", model.gears.iter().map(|one| gear(model, one)).collect()),
        ("driven", driven.collect()),
        ("surfaces", surfaces.collect()),
    ];
    for (name, entries) in lists.into_iter().chain(laws).filter(|(_, list)| !list.is_empty()) {
        document.insert(name.to_owned(), entries.into());
    }
    Ok(document)
}

fn ground(model: &Model) -> Table {
    let plane = model.plane.as_ref();
    let mut ground = table! {
        "none": plane.is_none().then_some(true),
        "normal": plane.map(|plane| <[f64; 3]>::from(*plane.normal())),
        "offset": plane.map(Plane::offset),
        "friction": model.mu,
    };
    for (law, all) in &model.coefficients {
        put(&mut ground, law.name(), &all.world);
    }
    put(&mut ground, "stick_speed", &model.stick_speed);
    put(&mut ground, "restitution", &some(model.restitution));
    put(&mut ground, "rebound_speed", &model.rebound_speed);
    ground
}

/// The number, unless it is zero.
fn some(number: f64) -> Option<f64> {
    Some(number).filter(|number| *number != 0.0)
}

/// A unit quaternion, so that it keeps its bits when it is read.
fn attitude(quaternion: [f64; 4]) -> Value {
    let given = Value::from(quaternion.to_vec());
    if <[f64; 4]>::from(unit(quaternion.into())) == quaternion {
        return given;
    }
    Value::Table(table! { "exactly": given })
}

/// A convex piece. A mesh is a `surface` in visual shapes.
fn piece(PlacedForm { form, place }: &PlacedForm, mesh: &str) -> Table {
    let mut table = match form {
        ModelForm::Box { sides } => table! { "box": sides },
        ModelForm::Sphere { radius } => table! { "sphere": radius },
        ModelForm::Capsule { length, radius } => {
            table! { "capsule": table! { "length": length, "radius": radius } }
        }
        ModelForm::Cylinder { length, radius, sides } => {
            table! { "cylinder": table! { "length": length, "radius": radius }, "sides": sides }
        }
        ModelForm::Cone { height, radius, sides } => {
            table! { "cone": table! { "height": height, "radius": radius }, "sides": sides }
        }
        ModelForm::Ellipsoid { half_axes, sides } => {
            table! { "ellipsoid": half_axes, "sides": sides }
        }
        ModelForm::Hull { points, radius } => table! { "hull": points, "radius": some(*radius) },
        ModelForm::Mesh { vertices, triangles, radius, colour } => {
            let own = table! { "vertices": vertices, "triangles": triangles, "colour": colour };
            let mut table = table! { "radius": some(*radius) };
            table.insert(mesh.to_owned(), own.into());
            table
        }
    };
    if *place != ModelPlace::ORIGIN {
        put(&mut table, "position", &place.position);
        put(&mut table, "attitude", &attitude(place.attitude));
    }
    table
}

/// Body of the model. Its shape and its look are those of the first body that has them.
fn body<'a>(
    model: &'a Model,
    index: usize,
    shapes: &mut HashMap<usize, &'a str>,
    looks: &mut HashMap<usize, &'a str>,
) -> Table {
    let body = &model.bodies[index];
    let mut table = table! { "name": body.name };
    let first = *shapes.entry(body.shape).or_insert(&body.name);
    match model.shapes.get(body.shape) {
        _ if first != body.name => put(&mut table, "shape", &first),
        Some(ModelShape::Points(points)) => put(&mut table, "points", points),
        Some(ModelShape::Pieces(pieces)) => {
            let pieces: Vec<_> = pieces.iter().map(|one| piece(one, "mesh")).collect();
            put(&mut table, "pieces", &pieces);
        }
        None => {}
    }
    table.extend(table! {
        "centre": Some(body.centre).filter(|centre| *centre != [0.0; 3]),
        "mass": body.mass,
        "inertia": body.inertia,
        "friction": body.friction,
    });
    own(&mut table, model, PartnerModel::Body(index));
    table.extend(table! {
        "restitution": body.restitution,
        "touches": (!body.touches).then_some(false),
    });
    groups(&mut table, &body.groups);
    let State { position, attitude: turned, velocity, spin } = body.start;
    let moving = |rate: Vector3<f64>| Some(<[f64; 3]>::from(rate)).filter(|rate| *rate != [0.0; 3]);
    table.extend(table! {
        "frame": "centre",
        "position": <[f64; 3]>::from(position),
        "attitude": attitude(turned.into()),
        "velocity": moving(velocity),
        "spin": moving(spin),
        "drawn": body.drawn,
        "load": (!body.load.is_none()).then(|| load(&body.load)),
        "colour": body.colour,
        "label": body.label,
    });
    if let Some((look, parts)) = body.look.and_then(|look| Some((look, model.looks.get(look)?))) {
        let first = *looks.entry(look).or_insert(&body.name);
        if first == body.name {
            let parts: Vec<_> = parts.iter().map(|one| piece(one, "surface")).collect();
            put(&mut table, "look", &parts);
        } else {
            put(&mut table, "look", &first);
        }
    }
    table
}

fn load(load: &Load) -> Table {
    let knots = |line: &Polyline| {
        let knots = line.knots().iter().map(|(time, v)| [*time, v[0], v[1], v[2]]);
        Some(knots.collect::<Vec<_>>()).filter(|knots| !knots.is_empty())
    };
    let force = knots(&load.force);
    let at = force.is_some().then(|| <[f64; 3]>::from(*load.point()));
    table! { "force": force, "torque": knots(&load.torque), "at": at }
}

/// Own coefficients of a body or fixed piece.
fn own(table: &mut Table, model: &Model, owner: PartnerModel) {
    for (law, all) in &model.coefficients {
        put(table, law.name(), &all.own(owner));
    }
}

fn groups(table: &mut Table, groups: &GroupsModel) {
    let members = Some(&groups.members).filter(|members| !members.is_empty());
    table.extend(table! { "groups": members, "collides_with": groups.collides_with });
}

/// Fixed geometry. Consecutive pieces that differ in their shapes only form one object.
fn fixed(model: &Model) -> Vec<Table> {
    // Fields of a piece besides its shape.
    let fields: Vec<Table> = (0..model.fixed.len())
        .map(|index| {
            let FixedModel { name, friction, groups: of, .. } = &model.fixed[index];
            let mut table = table! { "name": name, "friction": friction };
            own(&mut table, model, PartnerModel::Fixed(index));
            groups(&mut table, of);
            table
        })
        .collect();
    let mut pieces = model.fixed.iter().map(|fixed| piece(&fixed.piece, "mesh"));
    let object = |alike: &[Table]| {
        let pieces: Vec<_> = pieces.by_ref().take(alike.len()).collect();
        let mut table = alike[0].clone();
        put(&mut table, "pieces", &pieces);
        table
    };
    fields.chunk_by(|a, b| a == b).map(object).collect()
}

fn terrain(model: &Model, index: usize) -> Result<Table, String> {
    let TerrainModel { name, terrain, friction, groups: of } = &model.terrains[index];
    let mut table = table! { "name": name };
    table.extend(match terrain.shape() {
        TerrainShape::Field(field) => {
            let heights = pack_floats(field.heights().iter().copied())?;
            table! {
                "heights": table! { "columns": field.columns(), "packed": heights },
                "spacing": field.spacing(),
                "corner": <[f64; 3]>::from(*field.position()),
                "turned": <[[f64; 3]; 3]>::from(field.rotation().transpose()),
            }
        }
        TerrainShape::Mesh(mesh) => {
            let vertices = pack_floats(mesh.vertices().iter().flatten().copied())?;
            let triangles = pack_indices(mesh.triangles().iter().flatten().copied())?;
            table! { "surface": table! { "vertices": vertices, "triangles": triangles } }
        }
    });
    put(&mut table, "friction", friction);
    own(&mut table, model, PartnerModel::Terrain(index));
    groups(&mut table, of);
    Ok(table)
}

/// Name of a body, a fixed object or the ground. One of several pieces of an object has its number.
fn object_name(model: &Model, partner: PartnerModel) -> String {
    match partner {
        PartnerModel::Ground => "ground".to_owned(),
        PartnerModel::Body(index) => model.bodies[index].name.clone(),
        PartnerModel::Terrain(index) => model.terrains[index].name.clone(),
        PartnerModel::Fixed(index) => {
            let name = &model.fixed[index].name;
            let is_alone = model.fixed.iter().filter(|fixed| fixed.name == *name).count() == 1;
            if is_alone { name.clone() } else { format!("fixed[{index}]") }
        }
    }
}

fn joint_table(model: &Model, joint: &JointModel) -> Table {
    let bodies = [Some(joint.body), joint.other].into_iter().flatten();
    let bodies: Vec<_> = bodies.map(|body| &model.bodies[body].name).collect();
    let mut table = table! {
        "name": joint.name,
        "type": joint.kind.name(),
        "bodies": bodies,
        "frames": joint.frames,
        "length": joint.length,
        "cone": joint.cone,
        "middle": joint.middle,
        "collide": joint.collide.then_some(true),
    };
    let driven = joint.kind.driven();
    for ((axis, _), drive) in driven.iter().zip(&joint.drives) {
        let fields = drive_table(drive);
        if driven.len() == 1 {
            table.extend(fields);
        } else if !fields.is_empty() {
            put(&mut table, axis, &fields);
        }
    }
    table
}

/// Fields of a drive that differ from their defaults.
fn drive_table(drive: &Drive) -> Table {
    table! {
        "limits": drive.limits,
        "friction": some(drive.friction),
        "static_friction": drive.static_friction,
        "stiffness": some(drive.stiffness),
        "rest": some(drive.rest),
        "damping": some(drive.damping),
        "force": some(drive.force),
        "armature": some(drive.armature),
    }
}

fn motor_table(motor: &Motor) -> Table {
    match motor {
        Motor::Speed { target, max_force } => table! { "speed": target, "max_force": max_force },
        Motor::Position { target, stiffness, damping, max_force } => table! {
            "position": target, "stiffness": stiffness, "damping": damping, "max_force": max_force,
        },
        Motor::Damper { target, damping, max_force } => {
            table! { "speed": target, "damping": damping, "max_force": max_force }
        }
    }
}

/// Motors of a joint.
fn motors(joint: &JointModel) -> impl Iterator<Item = Table> {
    let driven = joint.kind.driven();
    driven.iter().zip(&joint.drives).filter_map(move |((axis, _), drive)| {
        let axis = (driven.len() > 1).then_some(axis);
        let mut table = table! { "joint": joint.name, "axis": axis };
        table.extend(motor_table(drive.motor.as_ref()?));
        Some(table)
    })
}

fn gear(model: &Model, gear: &Gear) -> Table {
    let axis = |of: &GearAxis| {
        let driven = model.joints[of.joint].kind.driven();
        let axis = driven.iter().find(|(_, axis)| GearAxis::new(of.joint, *axis) == *of);
        axis.map_or("", |(name, _)| name)
    };
    table! {
        "joints": gear.axes().each_ref().map(|of| &model.joints[of.joint].name),
        "axes": gear.axes().each_ref().map(axis),
        "ratio": gear.ratio(),
        "offset": gear.offset(),
        "drive": gear.drive().map(drive_table),
        "motor": gear.drive().and_then(|drive| drive.motor).as_ref().map(motor_table),
    }
}
