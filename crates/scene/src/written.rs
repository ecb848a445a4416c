//! Text of a scenario file for a given scene.

use super::scene::Scene;
use nalgebra::{Matrix3, Vector3};
use std::fmt::Write as _;
use tumble_core::geometry::terrain::TerrainShape;
use tumble_core::joint::{Drive, Middle, Motor};
use tumble_core::world::{Impacts, StickSpeed};
use tumble_model::failure::Failure;
use tumble_model::gear::GearModel;
use tumble_model::groups::GroupsModel;
use tumble_model::joint::{CourseModel, JointModel};
use tumble_model::shape::{ModelForm, ModelPlace, ModelShape, PlacedForm};
use tumble_model::{FixedModel, Model, PartnerModel};

/// First line of a scenario file that may be replaced.
pub const HEAD: &str = "# Written by tumble, which may replace this file.\n";

/// Scenario file that reproduces this scene except for its solver; numbers are exact.
///
/// # Errors
/// Bodies with a mesh file and turned height fields, which a text cannot contain.
pub fn text(scene: &Scene) -> Result<String, Failure> {
    let mut out = String::new();
    let model = &scene.model;
    // Writing to a string cannot fail.
    let _ = head(&mut out, scene, model);
    for (index, body) in model.bodies.iter().enumerate() {
        body_table(&mut out, index, model)
            .map_err(|why| Failure::Input(format!("bodies[{index}] ({}): {why}", body.name)))?;
    }
    fixed_tables(&mut out, model).map_err(Failure::Input)?;
    terrain_tables(&mut out, model).map_err(Failure::Input)?;
    pair_tables(&mut out, model);
    for joint in &model.joints {
        match &joint.course {
            Some(course) => driven_table(&mut out, joint, course, model),
            None => joint_table(&mut out, joint, model),
        }
    }
    for gear in &model.gears {
        gear_table(&mut out, gear, model);
    }
    surface_tables(&mut out, model);
    Ok(out)
}

fn head(out: &mut String, scene: &Scene, model: &Model) -> std::fmt::Result {
    writeln!(out, "name = {}", quoted(&scene.name))?;
    writeln!(out, "steps = {}", scene.rows)?;
    if scene.start_index > 0 {
        writeln!(out, "start_index = {}", scene.start_index)?;
    }
    writeln!(out, "time_step = {:?}", model.dt)?;
    let floats = scene.contact.is_none();
    if !floats {
        writeln!(out, "rotation = \"{}\"", model.rotation.name())?;
        writeln!(out, "integrator = \"{}\"", model.integrator.name())?;
        if let Some(accuracy) = model.accuracy {
            writeln!(out, "accuracy = {accuracy:?}")?;
        }
        if model.impacts == Impacts::Located {
            writeln!(out, "impacts = \"located\"")?;
        }
    }
    writeln!(out, "gravity = {:?}", model.gravity)?;
    if floats {
        return Ok(());
    }
    writeln!(out, "\n[ground]")?;
    match &model.plane {
        None => writeln!(out, "none = true")?,
        Some(plane) => {
            writeln!(out, "normal = {:?}\noffset = {:?}", plane.normal.0, plane.offset)?;
        }
    }
    writeln!(out, "friction = {:?}", model.mu)?;
    let coefficients = model.coefficients.iter().map(|(of, all)| (of.name(), all.world));
    for (field, value) in coefficients {
        if let Some(value) = value {
            writeln!(out, "{field} = {value:?}")?;
        }
    }
    match &model.stick_speed {
        Some(StickSpeed::Limit(speed)) => writeln!(out, "stick_speed = {speed:?}")?,
        Some(StickSpeed::Table(rows)) => writeln!(out, "stick_speed = {rows:?}")?,
        None => {}
    }
    if model.restitution != 0.0 {
        writeln!(out, "restitution = {:?}", model.restitution)?;
    }
    match model.rebound_speed {
        Some(speed) => writeln!(out, "rebound_speed = {speed:?}"),
        None => Ok(()),
    }
}

/// TOML string.
pub fn quoted(text: &str) -> String {
    let mut quoted = String::from("\"");
    for letter in text.chars() {
        match letter {
            '"' | '\\' => quoted.extend(['\\', letter]),
            letter if letter.is_control() => {
                let _ = write!(quoted, "\\u{:04X}", u32::from(letter));
            }
            letter => quoted.push(letter),
        }
    }
    quoted.push('"');
    quoted
}

/// Form with its place, as an inline table.
fn piece(placed: &PlacedForm) -> Result<String, String> {
    let form = match &placed.form {
        ModelForm::Box { sides } => format!("box = {sides:?}"),
        ModelForm::Sphere { radius } => format!("sphere = {radius:?}"),
        ModelForm::Capsule { length, radius } => {
            format!("capsule = {{ length = {length:?}, radius = {radius:?} }}")
        }
        ModelForm::Cylinder { length, radius, sides } => {
            format!("cylinder = {{ length = {length:?}, radius = {radius:?} }}, sides = {sides}")
        }
        ModelForm::Cone { height, radius, sides } => {
            format!("cone = {{ height = {height:?}, radius = {radius:?} }}, sides = {sides}")
        }
        ModelForm::Ellipsoid { half_axes, sides } => {
            format!("ellipsoid = {half_axes:?}, sides = {sides}")
        }
        ModelForm::Hull { points, radius } => format!("hull = {points:?}, radius = {radius:?}"),
        ModelForm::Mesh { .. } => {
            return Err("mesh: a scenario text cannot contain a mesh; use a mesh file".to_owned());
        }
    };
    Ok(at_place(&form, placed))
}

/// Part of a visual shape, as an inline table.
fn visual_part(placed: &PlacedForm) -> Result<String, String> {
    match &placed.form {
        ModelForm::Mesh { vertices, triangles, colour, .. } => {
            let colour = colour.map(|colour| format!(", colour = \"{}\"", String::from(colour)));
            let colour = colour.unwrap_or_default();
            let surface = format!(
                "surface = {{ vertices = {vertices:?}, triangles = {triangles:?}{colour} }}"
            );
            Ok(at_place(&surface, placed))
        }
        _ => piece(placed),
    }
}

fn at_place(form: &str, placed: &PlacedForm) -> String {
    let ModelPlace { position, attitude } = placed.place;
    format!("{{ {form}, position = {position:?}, attitude = {attitude:?} }}")
}

fn pieces<'a>(placed: impl Iterator<Item = &'a PlacedForm>) -> Result<String, String> {
    let lines: Result<Vec<_>, String> = placed.map(piece).collect();
    Ok(format!("pieces = [\n    {},\n]", lines?.join(",\n    ")))
}

fn body_table(out: &mut String, index: usize, model: &Model) -> Result<(), String> {
    let body = &model.bodies[index];
    let shape =
        model.shapes.get(body.shape).ok_or_else(|| "shape: it does not exist".to_owned())?;
    let start = body.start.state();
    let centre = Vector3::from(body.centre);
    let origin = start.position - start.pose().rotation * centre;
    let mut lines = vec![format!("name = {}", quoted(&body.name))];
    match shape {
        ModelShape::Pieces(placed) => {
            lines.push(pieces(placed.iter())?);
            lines.push(format!("centre = {:?}", body.centre));
        }
        ModelShape::Points(points) => lines.push(format!("points = {points:?}")),
    }
    lines.push(format!("mass = {:?}\ninertia = {:?}", body.mass, body.inertia));
    let own = own(model, PartnerModel::Body(index));
    let restitution = body.restitution.map(|value| ("restitution", value));
    let friction = body.friction.map(|value| ("friction", value));
    for (field, value) in friction.into_iter().chain(own).chain(restitution) {
        lines.push(format!("{field} = {value:?}"));
    }
    if !body.touches {
        lines.push("touches = false".to_owned());
    }
    lines.extend(group_lines(&body.groups));
    lines.push(format!("position = {:?}", <[f64; 3]>::from(origin)));
    lines.push(format!("attitude = {:?}", body.start.attitude));
    for (field, value) in [("velocity", body.start.velocity), ("spin", body.start.spin)] {
        if value != [0.0; 3] {
            lines.push(format!("{field} = {value:?}"));
        }
    }
    if let Some(load) = &body.load {
        let knots = |knots: &[tumble_model::fields::Numbers<4>]| {
            knots.iter().map(|knot| knot.0).collect::<Vec<_>>()
        };
        let (force, torque) = (knots(&load.force), knots(&load.torque));
        let at = if force.is_empty() { String::new() } else { format!(", at = {:?}", load.at.0) };
        let of = |field: &str, knots: &[[f64; 4]]| match knots {
            [] => None,
            knots => Some(format!("{field} = {knots:?}")),
        };
        let parts: Vec<_> =
            [of("force", &force), of("torque", &torque)].into_iter().flatten().collect();
        lines.push(format!("load = {{ {}{at} }}", parts.join(", ")));
    }
    lines.extend(body.colour.map(|colour| format!("colour = \"{}\"", String::from(colour))));
    if let Some(look) = body.look.and_then(|look| model.looks.get(look)) {
        let parts: Result<Vec<_>, String> = look.iter().map(visual_part).collect();
        lines.push(format!("look = [\n    {},\n]", parts?.join(",\n    ")));
    }
    lines.extend(body.label.as_ref().map(|label| format!("label = {}", quoted(&label.0))));
    let _ = writeln!(out, "\n[[bodies]]\n{}", lines.join("\n"));
    Ok(())
}

/// Fields of collision groups.
fn group_lines(groups: &GroupsModel) -> impl Iterator<Item = String> {
    let members = Some(&groups.members).filter(|members| !members.is_empty());
    let fields = [("groups", members), ("collides_with", groups.collides_with.as_ref())];
    fields.into_iter().filter_map(|(field, names)| {
        let names: Vec<_> = names?.iter().map(|name| quoted(name)).collect();
        Some(format!("{field} = [{}]", names.join(", ")))
    })
}

/// Tables of fixed geometry. Consecutive pieces with the same name form one object.
fn fixed_tables(out: &mut String, model: &Model) -> Result<(), String> {
    type Own<'a> = (&'a FixedModel, Vec<(&'static str, f64)>);
    let of_each: Vec<Own<'_>> = (0..model.fixed.len())
        .map(|index| (&model.fixed[index], own(model, PartnerModel::Fixed(index))))
        .collect();
    let one = |(a, of_a): &Own<'_>, (b, of_b): &Own<'_>| {
        a.name == b.name && a.friction == b.friction && of_a == of_b && a.groups == b.groups
    };
    for thing in of_each.chunk_by(one) {
        let (first, own) = &thing[0];
        let name = quoted(&first.name);
        let pieces = pieces(thing.iter().map(|(fixed, _)| &fixed.piece))?;
        let _ = writeln!(out, "\n[[fixed]]\nname = {name}\n{pieces}");
        coefficient_lines(out, first.friction, own, &first.groups);
    }
    Ok(())
}

/// Coefficients and groups of something fixed.
fn coefficient_lines(
    out: &mut String,
    friction: Option<f64>,
    own: &[(&'static str, f64)],
    groups: &GroupsModel,
) {
    for (field, value) in friction.map(|value| ("friction", value)).iter().chain(own) {
        let _ = writeln!(out, "{field} = {value:?}");
    }
    for line in group_lines(groups) {
        let _ = writeln!(out, "{line}");
    }
}

/// Tables of terrain. Turned height fields have no exact text.
fn terrain_tables(out: &mut String, model: &Model) -> Result<(), String> {
    for (index, thing) in model.terrains.iter().enumerate() {
        let form = match thing.terrain.shape() {
            TerrainShape::Field(field) if *field.rotation() == Matrix3::identity() => {
                let rows = field.heights().chunks(field.columns());
                let rows: String = rows.map(|row| format!("    {row:?},\n")).collect();
                let (spacing, corner) = (field.spacing(), <[f64; 3]>::from(*field.position()));
                format!("heights = [\n{rows}]\nspacing = {spacing:?}\ncorner = {corner:?}")
            }
            TerrainShape::Field(_) => {
                let why = "a text cannot contain a turned height field; keep run.json";
                return Err(format!("terrain ({}): {why}", thing.name));
            }
            TerrainShape::Mesh(mesh) => {
                let vertices: Vec<[f64; 3]> =
                    mesh.vertices().iter().map(|at| (*at).into()).collect();
                let triangles = mesh.triangles();
                format!("surface = {{ vertices = {vertices:?}, triangles = {triangles:?} }}")
            }
        };
        let _ = writeln!(out, "\n[[terrain]]\nname = {}\n{form}", quoted(&thing.name));
        let own = own(model, PartnerModel::Terrain(index));
        coefficient_lines(out, thing.friction, &own, &thing.groups);
    }
    Ok(())
}

/// Name of a body, fixed piece or the ground in a scenario file.
fn name_of(partner: PartnerModel, model: &Model) -> &str {
    match partner {
        PartnerModel::Ground => "ground",
        PartnerModel::Fixed(index) => model.fixed.get(index).map_or("", |fixed| &fixed.name),
        PartnerModel::Terrain(index) => {
            model.terrains.get(index).map_or("", |terrain| &terrain.name)
        }
        PartnerModel::Body(index) => model.bodies.get(index).map_or("", |body| &body.name),
    }
}

/// Own coefficients of a body or fixed piece, with their fields.
fn own(model: &Model, owner: PartnerModel) -> Vec<(&'static str, f64)> {
    let all = model.coefficients.iter();
    all.filter_map(|(of, all)| Some((of.name(), all.own(owner)?))).collect()
}

fn pair_tables(out: &mut String, model: &Model) {
    let between = |body: usize, partner: PartnerModel| {
        let names = [PartnerModel::Body(body), partner].map(|of| quoted(name_of(of, model)));
        format!("between = [{}, {}]", names[0], names[1])
    };
    let coefficients = model.coefficients.iter().map(|(of, all)| (of.name(), &all.pairs));
    let of_laws = [("friction", &model.frictions), ("restitution", &model.restitutions)];
    for (table, pairs) in of_laws.into_iter().chain(coefficients) {
        for pair in pairs {
            let (between, coefficient) = (between(pair.body, pair.partner), pair.coefficient);
            let _ = writeln!(out, "\n[[{table}]]\n{between}\ncoefficient = {coefficient:?}");
        }
    }
    for pair in &model.apart {
        let _ = writeln!(out, "\n[[apart]]\n{}", between(pair.body, pair.partner));
    }
}

/// Table of a prescribed motion.
///
/// It has places at times, or a constant velocity about a point other than the shape's origin.
fn driven_table(out: &mut String, joint: &JointModel, course: &CourseModel, model: &Model) {
    let body = model.bodies.get(joint.body);
    let centre = body.map_or([0.0; 3], |body| body.centre);
    let about = Vector3::from(joint.frames[0].position) + Vector3::from(centre);
    let mut lines = vec![
        format!("name = {}", quoted(&joint.name)),
        format!("body = {}", quoted(body.map_or("", |body| &body.name))),
    ];
    if about == Vector3::zeros() {
        let positions: Vec<_> = course.places.iter().map(|place| place.position).collect();
        let attitudes: Vec<_> = course.places.iter().map(|place| place.attitude).collect();
        lines.push(format!("times = {:?}", course.times));
        lines.push(format!("positions = {positions:?}\nattitudes = {attitudes:?}"));
    } else {
        // The point is given at its initial position in the world.
        lines.extend(course.places.first().map(|place| format!("about = {:?}", place.position)));
    }
    for (field, value) in [("velocity", course.velocity), ("spin", course.spin)] {
        if value != [0.0; 3] {
            lines.push(format!("{field} = {value:?}"));
        }
    }
    let _ = writeln!(out, "\n[[driven]]\n{}", lines.join("\n"));
}

fn gear_table(out: &mut String, gear: &GearModel, model: &Model) {
    let of = |k: usize| {
        let joint = model.joints.get(gear.joints[k]);
        let driven = joint.map_or(&[][..], |joint| joint.kind.driven());
        let axis = driven.iter().find(|(_, axis)| *axis == gear.axes[k]);
        let name = joint.map_or("", |joint| &joint.name);
        (quoted(name), quoted(axis.map_or("", |(axis, _)| axis)))
    };
    let (first, second) = (of(0), of(1));
    let _ = writeln!(
        out,
        "\n[[gears]]\njoints = [{}, {}]\naxes = [{}, {}]\nratio = {:?}\noffset = {:?}",
        first.0, second.0, first.1, second.1, gear.ratio, gear.offset
    );
    if let Some(drive) = &gear.drive {
        let _ = writeln!(out, "drive = {{ {} }}", drive_fields(drive).join(", "));
        if let Some(motor) = &drive.motor {
            let _ = writeln!(out, "motor = {{ {} }}", motor_fields(motor).join(", "));
        }
    }
}

/// Tables of surfaces. All pieces of the same name share one.
fn surface_tables(out: &mut String, model: &Model) {
    let mut names = Vec::new();
    for surface in &model.surfaces {
        let name = name_of(surface.of, model);
        if !names.contains(&name) {
            names.push(name);
            let _ = writeln!(out, "\n[[surfaces]]\nof = {}", quoted(name));
            if let Some(velocity) = surface.velocity {
                let _ = writeln!(out, "velocity = {velocity:?}");
            }
            if let Some((axis, factor)) = surface.friction_axis {
                let _ = writeln!(out, "axis = {axis:?}\nfactor = {factor:?}");
            }
        }
    }
}

/// Fields of a drive that differ from their defaults.
fn drive_fields(drive: &Drive) -> Vec<String> {
    let mut fields = Vec::new();
    fields.extend(drive.limits.map(|limits| format!("limits = {limits:?}")));
    let sticks = drive.static_friction.map(|friction| format!("static_friction = {friction:?}"));
    fields.extend(sticks);
    for (field, value) in [
        ("friction", drive.friction),
        ("stiffness", drive.stiffness),
        ("rest", drive.rest),
        ("damping", drive.damping),
        ("force", drive.force),
        ("armature", drive.armature),
    ] {
        if value != 0.0 {
            fields.push(format!("{field} = {value:?}"));
        }
    }
    fields
}

fn motor_fields(motor: &Motor) -> Vec<String> {
    let fields: &[(&str, f64)] = match motor {
        Motor::Speed { target, max_force } => &[("speed", *target), ("max_force", *max_force)],
        Motor::Position { target, stiffness, damping, max_force } => &[
            ("position", *target),
            ("stiffness", *stiffness),
            ("damping", *damping),
            ("max_force", *max_force),
        ],
        Motor::Damper { target, damping, max_force } => {
            &[("speed", *target), ("damping", *damping), ("max_force", *max_force)]
        }
    };
    fields.iter().map(|(field, value)| format!("{field} = {value:?}")).collect()
}

fn joint_table(out: &mut String, joint: &JointModel, model: &Model) {
    let name = |index: usize| model.bodies.get(index).map_or("", |body| &body.name);
    let names =
        [Some(joint.body), joint.other].into_iter().flatten().map(|body| quoted(name(body)));
    let names: Vec<_> = names.collect();
    let mut lines = vec![
        format!("name = {}", quoted(&joint.name)),
        format!("type = \"{}\"", joint.kind.name()),
        format!("bodies = [{}]", names.join(", ")),
    ];
    let owners = [Some(joint.body), joint.other];
    for ((side, place), owner) in ["a", "b"].into_iter().zip(&joint.frames).zip(owners) {
        // For a body, the anchor is in the shape's frame.
        let centre =
            owner.and_then(|body| model.bodies.get(body)).map_or([0.0; 3], |body| body.centre);
        let anchor = Vector3::from(place.position) + Vector3::from(centre);
        lines.push(format!("anchor_{side} = {:?}", <[f64; 3]>::from(anchor)));
        lines.push(format!("attitude_{side} = {:?}", place.attitude));
    }
    lines.extend(joint.length.map(|length| format!("length = {length:?}")));
    lines.extend(joint.cone.map(|cone| format!("cone = {cone:?}")));
    if let Some(middle) = &joint.middle {
        let Middle { backwards, zero } = middle;
        lines.push(format!("middle = {{ backwards = {backwards}, zero = {zero:?} }}"));
    }
    if joint.collide {
        lines.push("collide = true".to_owned());
    }
    let driven = joint.kind.driven();
    for ((axis, _), drive) in driven.iter().zip(&joint.drives) {
        let fields = drive_fields(drive);
        match driven.len() {
            1 => lines.extend(fields),
            _ if fields.is_empty() => {}
            _ => lines.push(format!("{axis} = {{ {} }}", fields.join(", "))),
        }
    }
    let _ = writeln!(out, "\n[[joints]]\n{}", lines.join("\n"));
    for ((axis, _), drive) in driven.iter().zip(&joint.drives) {
        let Some(motor) = &drive.motor else { continue };
        let axis = if driven.len() == 1 { String::new() } else { format!("axis = \"{axis}\"\n") };
        let law = motor_fields(motor).join("\n");
        let _ = writeln!(out, "\n[[motors]]\njoint = {}\n{axis}{law}", quoted(&joint.name));
    }
}
