//! Collision and visual geometry of a URDF file.

use super::masses::origin;
use super::{UrdfReader, extra};
use crate::PiecesOfMesh;
use crate::meshes::{self, PaintedSurface};
use crate::model::{LookForm, RobotForm, RobotLook, RobotShape};
use crate::painted::colour_of;
use crate::xml::{Attributes, Element, Parsed};
use nalgebra::Vector3;

/// Message for other geometry.
const FORMS: &str =
    "one of box, sphere, cylinder, capsule, cone, ellipsoid, plane and mesh is needed";

impl UrdfReader<'_> {
    /// Reads the collision geometry of the link with index `link`. Shapes of size 0 are dropped
    /// with a note.
    pub(super) fn read_shapes(&mut self, element: &Element, link: usize) -> Parsed<()> {
        for collision in element.all("collision") {
            let geometry = collision.one("geometry")?;
            let geometry = geometry.ok_or_else(|| collision.wrong("<geometry> is needed"))?;
            let [form] = &geometry.children[..] else {
                return Err(geometry.wrong(FORMS));
            };
            if is_empty(form)? {
                self.notes.empty(format!("{} of {}", collision.at(), element.at()));
                continue;
            }
            let frame = origin(collision)?;
            let friction = collision.number(extra::FRICTION)?;
            let groups = collision.exactly::<2>(extra::GROUPS)?.unwrap_or([1.0; 2]);
            for form in self.forms(form)? {
                self.robot.shapes.push(RobotShape {
                    name: collision.own("name").map(str::to_owned),
                    link,
                    form,
                    frame,
                    groups: groups.map(|mask| mask as u32),
                    friction,
                    turning: [0.0; 2],
                    condim: 3,
                    priority: 0,
                    at: format!("{} of {}", collision.at(), element.at()),
                });
            }
        }
        Ok(())
    }

    /// Reads the visual geometry of the link with index `link`. If any part of it is invalid, all
    /// of it is dropped with a note: pictures then show the collision shapes.
    pub(super) fn read_looks(&mut self, element: &Element, link: usize) {
        let before = self.robot.looks.len();
        for visual in element.all("visual") {
            match self.look(visual, link) {
                Ok(look) => self.robot.looks.extend(look),
                Err(why) => {
                    self.robot.looks.truncate(before);
                    self.notes.unseen(why);
                    return;
                }
            }
        }
    }

    /// Visual geometry of one `<visual>` by colour; none for a shape of size 0.
    fn look(&self, visual: &Element, link: usize) -> Parsed<Vec<RobotLook>> {
        let geometry = visual.one("geometry")?;
        let geometry = geometry.ok_or_else(|| visual.wrong("<geometry> is needed"))?;
        let [form] = &geometry.children[..] else {
            return Err(geometry.wrong(FORMS));
        };
        if is_empty(form)? {
            return Ok(Vec::new());
        }
        let (frame, colour) = (origin(visual)?, self.colour(visual)?);
        if form.tag != "mesh" {
            let seen = LookForm::Form(self.form(form)?);
            return Ok(vec![RobotLook { link, seen, colour, frame }]);
        }
        let scale = form.exactly::<3>("scale")?.unwrap_or([1.0; 3]);
        let name = form.needed("filename")?;
        let painted = meshes::surfaces(self.reading, name, scale);
        let painted = painted.map_err(|why| form.wrong(why))?.into_iter();
        let look = |part: PaintedSurface| RobotLook {
            link,
            seen: LookForm::Mesh(part.surface),
            // The material of the link replaces those of the mesh.
            colour: colour.or(part.colour),
            frame,
        };
        Ok(painted.map(look).collect())
    }

    /// Colour of the material of a `<visual>`, given there or by name in the robot.
    fn colour(&self, visual: &Element) -> Parsed<Option<[u8; 3]>> {
        let Some(material) = visual.all("material").next() else { return Ok(None) };
        let own = material.all("color").next();
        let known = || {
            let name = material.own("name")?;
            let same = |other: &&Element| other.own("name") == Some(name);
            self.materials.iter().copied().find(same)?.all("color").next()
        };
        let Some(colour) = own.or_else(known) else { return Ok(None) };
        Ok(colour_of(&colour.numbers("rgba")?.unwrap_or_default()))
    }

    /// Geometry of a collision shape: one primitive, or the convex hull of a mesh.
    ///
    /// If the caller has chosen convex pieces for the mesh, it is one hull per piece. Hulls are
    /// computed once per file and scale.
    fn forms(&mut self, element: &Element) -> Parsed<Vec<RobotForm>> {
        if element.tag != "mesh" {
            return Ok(vec![self.form(element)?]);
        }
        let name = element.needed("filename")?;
        let scale = element.exactly::<3>("scale")?.unwrap_or([1.0; 3]);
        let one = [name.to_owned()];
        let (names, settings) = match self.reading.pieces.get(name) {
            None => (&one[..], None),
            Some(PiecesOfMesh::Files(names)) => (&names[..], None),
            Some(PiecesOfMesh::Decomposed(settings)) => (&one[..], Some(settings)),
        };
        let mut forms = Vec::with_capacity(names.len());
        for name in names {
            let key = (name.clone(), scale.map(f64::to_bits), settings.is_some());
            if !self.hulls.contains_key(&key) {
                let hulls = match settings {
                    Some(settings) => meshes::decomposed(self.reading, name, scale, settings),
                    None => self.hull(name, scale).map(|hull| vec![hull]),
                };
                self.hulls.insert(key.clone(), hulls.map_err(|why| element.wrong(why))?);
            }
            forms.extend(self.hulls[&key].iter().cloned().map(RobotForm::Hull));
        }
        Ok(forms)
    }

    /// Vertices of the convex hull of a mesh, and a note if they are not all.
    fn hull(&mut self, name: &str, scale: [f64; 3]) -> Parsed<Vec<[f64; 3]>> {
        let hulled = meshes::read(self.reading, name, scale)?;
        self.notes.hull(name, &hulled);
        Ok(hulled.corners)
    }

    /// Primitive geometry. Boxes have half sides, cylinders and capsules a half length (m).
    fn form(&self, element: &Element) -> Parsed<RobotForm> {
        let length = |field: &str| {
            element.needed(field)?;
            element.bounded(field, 0.0, [1e-9, 1e6])
        };
        match &*element.tag {
            "box" => {
                let size = element.exactly::<3>("size")?;
                let size = Vector3::from(size.ok_or_else(|| element.wrong("size is needed"))?);
                if size.iter().all(|side| (2e-6..=2e4).contains(side)) {
                    Ok(RobotForm::Box(size * 0.5))
                } else {
                    Err(element.wrong("size: sides from 2e-6 to 2e4 m are needed"))
                }
            }
            "sphere" => Ok(RobotForm::Sphere(length("radius")?)),
            "cylinder" => Ok(RobotForm::Cylinder(0.5 * length("length")?, length("radius")?)),
            "capsule" => Ok(RobotForm::Capsule(0.5 * length("length")?, length("radius")?)),
            "cone" => Ok(RobotForm::Cone(0.5 * length("length")?, length("radius")?)),
            "plane" => Ok(RobotForm::Plane),
            "ellipsoid" => {
                let radii = element.exactly::<3>("radii")?;
                let radii = Vector3::from(radii.ok_or_else(|| element.wrong("radii is needed"))?);
                if radii.iter().all(|radius| (1e-6..=1e4).contains(radius)) {
                    Ok(RobotForm::Ellipsoid(radii))
                } else {
                    Err(element.wrong("radii: numbers from 1e-6 to 1e4 m are needed"))
                }
            }
            _ => Err(element.wrong(FORMS)),
        }
    }
}

/// True if the geometry has size 0 and cannot collide.
fn is_empty(form: &Element) -> Parsed<bool> {
    let fields: &[&str] = match &*form.tag {
        "box" => &["size"],
        "mesh" => &["scale"],
        // A capsule of length 0 is a sphere.
        "sphere" | "capsule" => &["radius"],
        "cylinder" | "cone" => &["length", "radius"],
        "ellipsoid" => &["radii"],
        _ => &[],
    };
    for field in fields {
        let sizes = form.own(field).map(|value| form.numbers_of(field, value)).transpose()?;
        if sizes.is_some_and(|sizes| sizes.contains(&0.0)) {
            return Ok(true);
        }
    }
    Ok(false)
}
