//! Contact pairs of a robot and their friction coefficients.

use super::forms::form_of;
use super::{Assembled, Carried, Placing, place_of};
use crate::bodies::entries::{ApartEntry, FixedEntry, PairEntry};
use crate::bodies::exact::Owner;
use crate::bodies::terrain::TerrainEntry;
use crate::document::Document;
use tumble_core::contact::Plane;
use tumble_core::geometry::Terrain;
use tumble_core::geometry::terrain::HeightField;
use tumble_core::world::Coefficient;
use tumble_model::fields::Exactly;
use tumble_robot::model::{PairFriction, RobotForm, RobotShape};

/// Torsional and rolling friction, in the order of MJCF.
const TURNING: [Coefficient; 2] = [Coefficient::TorsionalFriction, Coefficient::RollingFriction];

/// Shape with contacts, and its owner in the scene.
pub(super) struct ContactRules {
    /// Index of the shape.
    shape: usize,
    owner: Owner,
}

impl Assembled {
    /// Adds the fixed pieces, and lists all shapes with contacts.
    pub(super) fn add_shapes(
        &mut self,
        placing: &Placing,
        document: &mut Document,
    ) -> Result<Vec<ContactRules>, String> {
        let (mut touching, mut links) = (Vec::new(), Vec::new());
        let shapes = self.robot.shapes.iter().enumerate();
        for (index, shape) in shapes.filter(|(index, _)| self.robot.touches(*index)) {
            let owner = match self.links[shape.link].0 {
                Some(place) => {
                    let Carried { body, parts, .. } = &self.bodies[place];
                    let part = parts.iter().position(|part| part.contains(&index));
                    Owner::Body(body + part.unwrap_or(0))
                }
                None if shape.form == RobotForm::Plane => {
                    if !placing.has_ground {
                        continue;
                    }
                    let Some(ground) = &mut document.ground else { continue };
                    if ground.plane()?.is_some() {
                        return Err(format!(
                            "{}: only one plane is supported; use a box",
                            shape.at
                        ));
                    }
                    let frame = self.world().then(&self.in_body(shape));
                    let normal = frame.rotation().column(2).into_owned();
                    let plane = Plane::new(normal, normal.dot(&frame.position));
                    let plane = plane.map_err(|error| format!("{}: {error}", shape.at))?;
                    ground.set_plane(Some(&plane));
                    ground.friction = friction_of(shape).or(ground.friction);
                    Owner::Ground
                }
                None if let RobotForm::Field(field) = &shape.form => {
                    let frame = self.world().then(&self.in_body(shape));
                    let field = HeightField::clone(field);
                    let field = field.moved_by(&frame.rotation(), &frame.position);
                    let field = field.map_err(|error| format!("{}: {error}", shape.at))?;
                    let name = self.piece_name(shape, &links, document);
                    let made = TerrainEntry::made(name, Terrain::from(field));
                    document.terrain.push(TerrainEntry { friction: friction_of(shape), ..made });
                    Owner::Terrain(document.terrain.len() - 1)
                }
                None => {
                    let Some(form) = form_of(shape, placing.sides)? else { continue };
                    let frame = self.world().then(&self.in_body(shape));
                    let piece = form.placed_at(&place_of(&frame));
                    piece.piece().map_err(|error| format!("{}: {error}", shape.at))?;
                    let name = self.piece_name(shape, &links, document);
                    links.push(shape.link);
                    document.fixed.push(FixedEntry {
                        name: Some(name),
                        pieces: Some(vec![piece]),
                        friction: friction_of(shape),
                        ..FixedEntry::default()
                    });
                    Owner::Fixed(document.fixed_count() - 1)
                }
            };
            touching.push(ContactRules { shape: index, owner });
        }
        self.fixed_links = links;
        Ok(touching)
    }

    /// Free name of the fixed piece of a shape: that of the shape, or else of its link, with a
    /// number if it is taken. `links` are the links of the pieces so far.
    fn piece_name(&self, shape: &RobotShape, links: &[usize], document: &Document) -> String {
        let name = shape.name.as_ref().unwrap_or(&self.robot.links[shape.link].name);
        let before = links.iter().filter(|link| **link == shape.link).count();
        let numbers = before.max(1)..;
        let numbered = numbers.map(|number| self.named(&format!("{name}-{number}")));
        let is_free = |name: &String| document.colliders().all(|object| object.name != name);
        std::iter::once(self.named(name)).chain(numbered).find(is_free).unwrap_or_default()
    }

    /// Adds exclusions and friction coefficients for all pairs of owners.
    pub(super) fn keep_apart(
        &self,
        placing: &Placing,
        touching: &[ContactRules],
        document: &mut Document,
    ) {
        // First shape of each owner. All shapes of an owner have the same contact rules.
        let mut owners: Vec<(Owner, usize)> = Vec::new();
        for ContactRules { shape, owner } in touching {
            if !owners.iter().any(|(known, _)| known == owner) {
                owners.push((*owner, *shape));
            }
        }
        let usual = document.friction_of_ground();
        let names: Vec<_> = owners.iter().map(|(owner, _)| document.name_of(*owner)).collect();
        for (index, (owner, shape)) in owners.iter().enumerate() {
            let Owner::Body(_) = *owner else { continue };
            for (other_index, (other, theirs)) in owners.iter().enumerate() {
                let is_later = other_index > index || !matches!(other, Owner::Body(_));
                if !is_later {
                    continue;
                }
                let friction = self.law(placing, *shape, *theirs, usual);
                let own = [*shape, *theirs].map(|shape| {
                    let PairFriction { torsional, rolling, .. } =
                        self.robot.shapes[shape].own_friction(usual);
                    [torsional, rolling]
                });
                let between = Exactly([index, other_index].map(|owner| names[owner].clone()));
                let [ours, theirs] = [*shape, *theirs]
                    .map(|shape| friction_of(&self.robot.shapes[shape]).unwrap_or(usual));
                let Some(PairFriction { sliding, torsional, rolling }) = friction else {
                    document.apart.push(ApartEntry { between });
                    continue;
                };
                let pair = |coefficient| PairEntry { between: between.clone(), coefficient };
                if ours != theirs || ours != sliding {
                    document.friction.get_or_insert_default().push(pair(sliding));
                }
                for (k, (friction, of)) in [torsional, rolling].into_iter().zip(TURNING).enumerate()
                {
                    if friction != own[0][k].max(own[1][k]) {
                        document.coefficient_mut(of).get_or_insert_default().push(pair(friction));
                    }
                }
            }
        }
        let ground = owners.iter().find(|(owner, _)| *owner == Owner::Ground);
        let ground = ground.map(|(_, shape)| self.robot.shapes[*shape].own_friction(usual));
        let has_ground = ground.map_or([false; 2], |own| [own.torsional > 0.0, own.rolling > 0.0]);
        // Two shapes of an MJCF file do not have the friction of another ground.
        let has_world = TURNING.map(|of| {
            let of_world = document.ground.as_mut().and_then(|ground| *ground.coefficient_mut(of));
            self.robot.options.has_world && of_world > Some(0.0)
        });
        for (owner, shape) in owners {
            let own = self.robot.shapes[shape].own_friction(usual);
            let turning = [own.torsional, own.rolling].into_iter().zip(TURNING);
            // Bodies without their own coefficients would have the ground's.
            for (k, (friction, of)) in turning.enumerate() {
                let is_needed = match owner {
                    Owner::Ground => friction > 0.0,
                    _ => friction > 0.0 || has_ground[k] || has_world[k],
                };
                if let Some(own) = document.own_coefficient(owner, of).filter(|_| is_needed) {
                    *own = Some(friction);
                }
            }
        }
    }

    /// Friction of two shapes; `None` if they do not collide. Explicit pairs take precedence over groups
    /// and links.
    pub(super) fn law(
        &self,
        placing: &Placing,
        a: usize,
        b: usize,
        usual: f64,
    ) -> Option<PairFriction> {
        let [ours, theirs] = [a, b].map(|index| &self.robot.shapes[index]);
        let links = [ours.link, theirs.link];
        let both_move = links.iter().all(|link| self.links[*link].0.is_some());
        if both_move && !placing.touches_itself {
            return None;
        }
        let excluded = |pair: &[usize; 2]| *pair == links || *pair == [links[1], links[0]];
        let meets = || {
            ours.meets(theirs)
                && !self.robot.apart.iter().any(excluded)
                && !self.are_neighbours(links[0], links[1])
        };
        let usual = || meets().then(|| ours.friction_with(theirs, usual));
        self.robot.pair(a, b).or_else(usual)
    }

    /// True if the links belong to one body, or if a joint between them disables contacts.
    fn are_neighbours(&self, a: usize, b: usize) -> bool {
        let (a, b) = (self.carriers[a], self.carriers[b]);
        let links = &self.robot.links;
        let parent = |link: usize| {
            let mut above = self.carriers[links[link].parent];
            while links[above].is_between {
                above = self.carriers[links[above].parent];
            }
            above
        };
        // MJCF lets children of the world collide with it; URDF does not.
        let hangs = (a != 0 && b != 0) || !self.robot.options.has_world;
        a == b
            || !self.robot.options.neighbours_touch && hangs && (parent(a) == b || parent(b) == a)
    }
}

/// Friction coefficient of a single shape.
pub(super) fn friction_of(shape: &RobotShape) -> Option<f64> {
    if shape.condim > 1 { shape.friction } else { Some(0.0) }
}
