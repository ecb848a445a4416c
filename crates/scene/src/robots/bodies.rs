//! Bodies of a robot's links: grouping, masses, shapes and initial states.

use super::forms::{equivalent, fit, form_of, scene_form};
use super::touching::friction_of;
use super::{Assembled, Carried, Placing, place_of};
use crate::bodies::entries::{BodyEntry, LookValue, PieceEntry, SurfaceTable};
use crate::bodies::shape::BodyShape;
use crate::document::Document;
use crate::tables::LoadTable;
use nalgebra::Vector3;
use tumble_core::mechanics::{Load, Polyline};
use tumble_model::colour::Colour;
use tumble_model::fields::{Exactly, numbers};
use tumble_robot::LinkFrame;
use tumble_robot::model::{LinkMass, LookForm, Robot, RobotForm, RobotLook, RobotShape};
use tumble_robot::motion::RobotMotion;

/// Maximum number of shapes with contacts.
const MOST_TOUCHING: usize = 2000;

impl Assembled {
    /// Assigns bodies of the scene to all groups of links.
    pub(super) fn number_bodies(
        &mut self,
        placing: &Placing,
        document: &Document,
    ) -> Result<(), String> {
        let mut next = document.bodies.len();
        for place in 0..self.bodies.len() {
            self.bodies[place].parts = self.parts(place, placing, document.friction_of_ground())?;
            self.bodies[place].body = next;
            next += self.bodies[place].parts.len();
        }
        Ok(())
    }

    pub(super) fn add_bodies(
        &mut self,
        placing: &Placing,
        motion: &RobotMotion,
        document: &mut Document,
    ) -> Result<(), String> {
        let mut notes = Vec::new();
        for place in 0..self.bodies.len() {
            let link = self.bodies[place].link;
            let mass = self.mass_of(place);
            let at = &self.robot.links[link].at;
            let wrong = |why: String| format!("{at}: {why}");
            if mass.mass <= 0.0 {
                return Err(wrong(
                    "it moves, but its mass is below 1e-9 kg; add <inertial>".to_owned(),
                ));
            }
            self.bodies[place].centre = mass.centre;
            let start = self.state_of(place, motion.links());
            let share = 1.0 / self.bodies[place].parts.len() as f64;
            let held = self.held_up(place, document.gravity(), share);
            // The first body of a group carries its visual geometry.
            let look = self.look_of(place, placing);
            let mut look = look.map(LookValue::Parts);
            for (number, part) in self.bodies[place].parts.iter().enumerate() {
                let name = self.part_name(link, number);
                if document.bodies.iter().any(|known| known.name() == name) {
                    return Err(wrong(format!(
                        "the body name {name:?} is already used; set a prefix"
                    )));
                }
                let (shape, note, touches) = self.shape_of(place, part, &mass, placing)?;
                notes.extend(note.map(|note| format!("{name}: {note}")));
                let first = part.first().map(|shape| &self.robot.shapes[*shape]);
                let mut body = BodyEntry {
                    name: Some(name),
                    centre: Some(numbers(&mass.centre)),
                    friction: first.and_then(friction_of),
                    touches: (!touches).then_some(false),
                    load: LoadTable::new(&held),
                    look: look.take(),
                    ..BodyEntry::default()
                };
                body.set_mass(mass.mass * share, &(mass.inertia * share));
                body.set_start(&start);
                body.rigid_body(&shape).map_err(|error| wrong(error.to_string()))?;
                document.add_body(body, shape);
            }
        }
        self.robot.notes.extend(notes);
        Ok(())
    }

    /// Mass properties of a group of links, in the frame of its first link.
    fn mass_of(&self, place: usize) -> LinkMass {
        let parts = self.robot.links.iter().zip(&self.links);
        let parts = parts.filter(|(link, (body, _))| *body == Some(place) && link.mass.mass > 0.0);
        let parts: Vec<_> = parts.map(|(link, (_, frame))| link.mass.placed(frame)).collect();
        LinkMass::sum(&parts)
    }

    /// Gravity compensation as a load at the centre of the compensated mass. `share` is the body's
    /// share of the mass.
    fn held_up(&self, place: usize, gravity: Vector3<f64>, share: f64) -> Load {
        let (mut mass, mut moment) = (0.0, Vector3::zeros());
        for (link, (_, frame)) in
            self.robot.links.iter().zip(&self.links).filter(|(_, (body, _))| *body == Some(place))
        {
            let held = link.weightless * link.mass.mass;
            mass += held;
            moment += frame.point(&link.mass.centre) * held;
        }
        if mass == 0.0 {
            return Load::none();
        }
        let force = Polyline::constant(-gravity * (mass * share));
        let at = moment / mass - self.bodies[place].centre;
        let load = force.and_then(|force| Load::new(force, Polyline::default(), at));
        load.unwrap_or_default()
    }

    /// Collision shapes of a group of links, partitioned into sets with the same contact rules.
    fn parts(
        &self,
        place: usize,
        placing: &Placing,
        usual: f64,
    ) -> Result<Vec<Vec<usize>>, String> {
        let counts = |index: usize, shape: &RobotShape| {
            self.robot.touches(index) && (placing.has_ground || shape.form != RobotForm::Plane)
        };
        let shapes = self.robot.shapes.iter().enumerate();
        let touching = shapes.filter(|(index, shape)| counts(*index, shape));
        let touching: Vec<_> = touching.collect();
        if let Some((_, excess)) = touching.get(MOST_TOUCHING) {
            let at = &excess.at;
            return Err(format!("{at}: more than {MOST_TOUCHING} shapes have contacts"));
        }
        let is_own = |shape: &RobotShape| self.links[shape.link].0 == Some(place);
        let others: Vec<_> = touching.iter().filter(|(_, shape)| !is_own(shape)).collect();
        let law = |a: usize, b: usize| self.law(placing, a, b, usual);
        let own_friction = |index: usize| friction_of(&self.robot.shapes[index]);
        let alike = |a: usize, b: usize| {
            let [of_a, of_b] = [a, b].map(|index| self.robot.shapes[index].own_friction(usual));
            own_friction(a) == own_friction(b)
                && of_a == of_b
                && others.iter().all(|(other, _)| law(a, *other) == law(b, *other))
        };
        let mut parts: Vec<Vec<usize>> = Vec::new();
        for (index, _) in touching.iter().filter(|(_, shape)| is_own(shape)) {
            match parts.iter_mut().find(|part| alike(part[0], *index)) {
                Some(part) => part.push(*index),
                None => parts.push(vec![*index]),
            }
        }
        Ok(if parts.is_empty() { vec![Vec::new()] } else { parts })
    }

    /// Shape of a body with the collision shapes `part`, an optional note, and true if it collides.
    fn shape_of(
        &self,
        place: usize,
        part: &[usize],
        mass: &LinkMass,
        placing: &Placing,
    ) -> Result<(BodyShape, Option<String>, bool), String> {
        let placed = |shape: &RobotShape| {
            let form = form_of(shape, placing.sides)?;
            Ok(form.map(|form| form.placed_at(&place_of(&self.in_body(shape)))))
        };
        let wrong = |why: tumble_core::error::Error| {
            format!("{}: {why}", self.robot.links[self.bodies[place].link].at)
        };
        let all = |shapes: &mut dyn Iterator<Item = &RobotShape>| {
            let placed: Result<Vec<Option<PieceEntry>>, String> = shapes.map(placed).collect();
            Ok::<Vec<_>, String>(placed?.into_iter().flatten().collect())
        };
        if !part.is_empty() {
            let mut touching = all(&mut part.iter().map(|shape| &self.robot.shapes[*shape]))?;
            let note = fit(&mut touching).map_err(wrong)?;
            return Ok((BodyShape::Pieces(touching), note, true));
        }
        let own = |shape: &&RobotShape| self.links[shape.link].0 == Some(place);
        let mut seen = all(&mut self.robot.shapes.iter().filter(own))?;
        // Only drawn.
        fit(&mut seen).map_err(wrong)?;
        let pieces = if seen.is_empty() { vec![equivalent(mass)] } else { seen };
        Ok((BodyShape::Pieces(pieces), None, false))
    }

    /// Visual geometry of a body whose links have any.
    fn look_of(&self, place: usize, placing: &Placing) -> Option<Vec<PieceEntry>> {
        let is_own = |link: usize| self.links[link].0 == Some(place);
        let looks: Vec<_> = self.robot.looks.iter().filter(|look| is_own(look.link)).collect();
        if looks.is_empty() {
            return None;
        }
        let has_look = |link: usize| looks.iter().any(|look| look.link == link);
        let shapes =
            self.robot.shapes.iter().filter(|shape| is_own(shape.link) && !has_look(shape.link));
        let shapes = shapes.filter_map(|shape| {
            let form = scene_form(&shape.form, placing.sides)?;
            Some(form.placed_at(&place_of(&self.in_body(shape))))
        });
        let seen = |look: &&RobotLook| {
            let form = match &look.seen {
                LookForm::Form(form) => scene_form(form, placing.sides)?,
                LookForm::Mesh(surface) => {
                    let vertices = surface.vertices.iter().copied().map(Exactly).collect();
                    let triangles = surface.triangles.iter().copied().map(Exactly).collect();
                    let colour = look.colour.map(Colour);
                    let surface = Some(SurfaceTable { vertices, triangles, colour });
                    PieceEntry { surface, ..PieceEntry::default() }
                }
            };
            let frame = self.links[look.link].1.then(&look.frame);
            Some(form.placed_at(&place_of(&frame)))
        };
        Some(looks.iter().filter_map(seen).chain(shapes).collect())
    }
}

/// Groups of rigidly connected links. For each link, its group and its pose in the group's first
/// link.
pub(super) fn carried(
    robot: &Robot,
    merges: bool,
) -> (Vec<Carried>, Vec<(Option<usize>, LinkFrame)>) {
    let mut bodies = Vec::new();
    let mut links: Vec<(Option<usize>, LinkFrame)> = Vec::with_capacity(robot.links.len());
    for (index, link) in robot.links.iter().enumerate() {
        if index == 0 {
            links.push((None, LinkFrame::identity()));
            continue;
        }
        let (above, frame) = links[link.parent];
        // A massive link fixed to a body may be a body of its own, but not one fixed to the world.
        let is_own = link.joints.1 > 0 || !merges && above.is_some() && link.mass.mass > 0.0;
        if is_own {
            links.push((Some(bodies.len()), LinkFrame::identity()));
            let (body, centre, parts) = (0, Vector3::zeros(), Vec::new());
            bodies.push(Carried { link: index, body, centre, parts });
        } else {
            links.push((above, frame.then(&link.frame)));
        }
    }
    (bodies, links)
}
