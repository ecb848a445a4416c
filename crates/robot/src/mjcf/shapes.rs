//! Shapes (`geom` in MJCF), including those of meshes.

use super::MjcfReader;
use super::bodies::Within;
use super::defaults::Defaulted;
use super::sites::ends;
use crate::frame::LinkFrame;
use crate::mass::solid;
use crate::meshes::{self, Volume};
use crate::model::{LinkMass, LookForm, RobotForm, RobotLook, RobotShape};
use crate::painted::colour_of;
use crate::xml::{Attributes, Element, Parsed};
use nalgebra::Vector3;
use std::collections::BTreeSet;
use tumble_model::shown;

/// Half width and depth (m) of the box that replaces a plane other than the ground.
const WALL: f64 = 10.0;

/// Kinds of shapes.
#[derive(Clone, Copy, PartialEq)]
enum GeomKind {
    Plane,
    Sphere,
    Capsule,
    Cylinder,
    Ellipsoid,
    Box,
    Mesh,
    Field,
    Distances,
}

const KINDS: [(&str, GeomKind); 9] = [
    ("plane", GeomKind::Plane),
    ("sphere", GeomKind::Sphere),
    ("capsule", GeomKind::Capsule),
    ("cylinder", GeomKind::Cylinder),
    ("ellipsoid", GeomKind::Ellipsoid),
    ("box", GeomKind::Box),
    ("mesh", GeomKind::Mesh),
    ("hfield", GeomKind::Field),
    ("sdf", GeomKind::Distances),
];

impl MjcfReader<'_> {
    /// Reads a shape in `frame` of the link.
    pub(super) fn read_shape(&mut self, element: &Element, within: &Within<'_>) -> Parsed<()> {
        let &Within { link, ref frame, class } = within;
        const READ: &str = "\
            name class type contype conaffinity condim group priority size friction mass \
            density shellinertia fromto pos quat axisangle xyaxes zaxis euler mesh fitscale \
            fluidshape hfield surfacevel adhesion";
        const SOFT: &str = "solmix solref solimp margin gap";
        element.refuse_others(READ, &format!("{SOFT} material rgba user fluidcoef"))?;
        let read = self.defaulted(element, class)?;
        self.note_soft(&read, SOFT);
        read.refuse_unless_zero(
            0,
            &[
                ("surfacevel", "moving surfaces are not read; use [[surfaces]] of a scenario file"),
                ("adhesion", "shapes that adhere are not read"),
            ],
        )?;
        let usual = if read.get("mesh").is_some() { GeomKind::Mesh } else { GeomKind::Sphere };
        // Kind of the shape; a mesh if one is named
        let kind = read.word("type", &KINDS)?.unwrap_or(usual);
        // Shapes that touch nothing have a mass and a look.
        let groups = [group(&read, "contype")?, group(&read, "conaffinity")?];
        let touches = groups != [0, 0];
        if matches!(kind, GeomKind::Field | GeomKind::Distances) && !touches {
            self.notes.idle("geom with a field");
            return Ok(());
        }
        if kind == GeomKind::Distances {
            return Err(element.wrong("distance fields are not supported"));
        }
        if kind == GeomKind::Mesh && !touches && !self.weighs(&read, link)? {
            let placed = frame.then(&self.compiler.frame(&read)?);
            let name = read.needed("mesh")?;
            if let Some(Err(_)) = self.meshes.get(name) {
                // Drawing only: a flat mesh has no hull and needs none.
                self.flat.insert(name.to_owned());
                if link > 0 && self.files.contains_key(name) {
                    self.read_look(&read, link, placed, &RobotForm::Hull(Vec::new()))
                } else {
                    self.notes.idle("geom with a mesh without a hull")
                }
                return Ok(());
            }
        }
        let (form, own, volume) = self.form(&read, kind)?;
        let placed = frame.then(&own);
        // Sliding, torsional and rolling friction; the last two have MuJoCo's defaults.
        let friction = read.numbers("friction")?.unwrap_or_default();
        if friction.len() > 3 || friction.iter().any(|part| *part < 0.0) {
            return Err(element.wrong("friction: one to three numbers of 0 or more are needed"));
        }
        let turning = [(1, 0.005), (2, 0.0001)]
            .map(|(index, usual)| friction.get(index).copied().unwrap_or(usual));
        let turning = if touches { turning } else { [0.0; 2] };
        let condim = self.condim(&read, turning)?;
        // Mass, then the first plane as ground and others as boxes
        self.add_geom_inertia(&read, link, &placed, &form, &volume)?;
        let (form, placed) = match form {
            RobotForm::Plane if touches && std::mem::replace(&mut self.has_ground, true) => {
                self.notes.say(format!(
                    "planes after the first become boxes, {0} m wide and {WALL} m deep",
                    2.0 * WALL
                ));
                let middle = placed.point(&Vector3::new(0.0, 0.0, -0.5 * WALL));
                let form = RobotForm::Box(Vector3::new(WALL, WALL, 0.5 * WALL));
                (form, LinkFrame { position: middle, ..placed })
            }
            form => (form, placed),
        };
        if !touches && link > 0 {
            self.read_look(&read, link, placed, &form);
        }
        self.robot.shapes.push(RobotShape {
            name: element.own("name").map(str::to_owned),
            link,
            form,
            frame: placed,
            groups: if self.robot.options.contacts { groups } else { [0, 0] },
            friction: Some(*friction.first().unwrap_or(&1.0)),
            turning,
            condim,
            priority: read.whole("priority")?.unwrap_or(0),
            at: element.at(),
        });
        Ok(())
    }

    /// Adds a shape without contacts to the visual geometry of its link.
    fn read_look(&mut self, read: &Defaulted<'_>, link: usize, frame: LinkFrame, form: &RobotForm) {
        let file = read.get("mesh").and_then(|mesh| self.files.get(mesh));
        let colour = self.colour(read);
        let mut push = |seen, own: Option<[u8; 3]>| {
            let colour = colour.or(own);
            self.robot.looks.push(RobotLook { link, seen, colour, frame });
        };
        match (form, file) {
            (RobotForm::Hull(_), Some((file, scale))) => {
                match meshes::surfaces(self.reading, file, *scale) {
                    Ok(painted) => painted
                        .into_iter()
                        .for_each(|part| push(LookForm::Mesh(part.surface), part.colour)),
                    Err(why) => {
                        if self.unseen.insert(link) {
                            self.notes.unseen(read.element().wrong(why));
                        }
                    }
                }
            }
            (RobotForm::Plane | RobotForm::Field(_), _) => {}
            (form, _) => push(LookForm::Form(form.clone()), None),
        }
    }

    /// Colour of a shape: its own, or that of its material. One that cannot be read has no effect.
    fn colour(&self, read: &Defaulted<'_>) -> Option<[u8; 3]> {
        let material = read.get("material").and_then(|name| self.materials.get(name)).copied();
        let own = read.numbers("rgba").ok().flatten().and_then(|rgba| colour_of(&rgba));
        own.or(material)
    }

    /// Keeps the visual geometry of links that have a visual mesh. Other links are drawn with all
    /// their shapes.
    pub(super) fn retain_visuals_of_meshed_links(&mut self) {
        let looks = std::mem::take(&mut self.robot.looks);
        let meshed = looks.iter().filter(|look| look.triangles() > 0).map(|look| look.link);
        let meshed: BTreeSet<_> = meshed.filter(|link| !self.unseen.contains(link)).collect();
        let kept = looks.into_iter().filter(|look| meshed.contains(&look.link));
        self.robot.looks = kept.collect();
        if let Some(sentence) = meshes::share_triangles(&mut self.robot.looks) {
            self.notes.say(sentence);
        }
    }

    /// Geometry, its pose, and the source of its mass properties.
    fn form(&self, read: &Defaulted<'_>, kind: GeomKind) -> Parsed<(RobotForm, LinkFrame, Volume)> {
        let element = read.element();
        let sizes = read.numbers("size")?.unwrap_or_default();
        let size = |index: usize| match sizes.get(index) {
            Some(size) if (1e-6..=1e4).contains(size) => Ok(*size),
            Some(size) => {
                Err(element.wrong(format!("size: {size:?} m is given; allowed: 1e-6 to 1e4 m")))
            }
            None => Err(element.wrong(format!("size: {} numbers are needed", index + 1))),
        };
        // `fromto` has both ends, and `size` the radius only.
        if let Some((frame, half)) = ends(read)? {
            let radius = size(0)?;
            let form = match kind {
                GeomKind::Capsule => RobotForm::Capsule(half, radius),
                GeomKind::Cylinder => RobotForm::Cylinder(half, radius),
                GeomKind::Ellipsoid => RobotForm::Ellipsoid(Vector3::new(radius, radius, half)),
                GeomKind::Box => RobotForm::Box(Vector3::new(radius, radius, half)),
                _ => {
                    return Err(element
                        .wrong("fromto is only for capsules, cylinders, boxes and ellipsoids"));
                }
            };
            return Ok((form, frame, Volume::Hull));
        }
        // Sizes by kind: half lengths and radii
        let three = || Ok::<_, String>(Vector3::new(size(0)?, size(1)?, size(2)?));
        let mut volume = Volume::Hull;
        let form = match kind {
            GeomKind::Plane => RobotForm::Plane,
            GeomKind::Sphere => RobotForm::Sphere(size(0)?),
            GeomKind::Capsule => RobotForm::Capsule(size(1)?, size(0)?),
            GeomKind::Cylinder => RobotForm::Cylinder(size(1)?, size(0)?),
            GeomKind::Ellipsoid => RobotForm::Ellipsoid(three()?),
            GeomKind::Box => RobotForm::Box(three()?),
            GeomKind::Field => {
                volume = Volume::Unknown;
                RobotForm::Field(self.field_of(read)?)
            }
            GeomKind::Mesh | GeomKind::Distances => {
                let name = read.needed("mesh")?;
                let known = self.meshes.get(name).cloned();
                let hulled = known.ok_or_else(|| {
                    element.wrong(format!("mesh: there is no mesh {:?}", shown::line(name)))
                })??;
                volume = hulled.volume;
                RobotForm::Hull(hulled.corners)
            }
        };
        if kind != GeomKind::Mesh && read.get("mesh").is_some() {
            return Err(element.wrong("fitting a geom to a mesh is not supported; give its size"));
        }
        Ok((form, self.compiler.frame(read)?, volume))
    }

    /// True if the shape contributes to the mass of its link.
    fn weighs(&self, read: &Defaulted<'_>, link: usize) -> Parsed<bool> {
        let [low, high] = self.compiler.inertia_groups;
        let group = read.number("group")?.unwrap_or(0.0);
        let counts = self.matter[link].is_some() && (low..=high).contains(&group);
        Ok(mass_of(read)?.unwrap_or(density_of(read)?) != 0.0 && counts)
    }

    /// Adds the mass of a shape to its link.
    fn add_geom_inertia(
        &mut self,
        read: &Defaulted<'_>,
        link: usize,
        frame: &LinkFrame,
        form: &RobotForm,
        volume: &Volume,
    ) -> Parsed<()> {
        let element = read.element();
        let (given, density) = (mass_of(read)?, density_of(read)?);
        if read.word("shellinertia", &super::compiler::SWITCH)? == Some(true) {
            return Err(element.wrong("shellinertia is not supported; give <inertial>"));
        }
        if !self.weighs(read, link)? {
            return Ok(());
        }
        let unit = match volume {
            Volume::Triangles(both) => both[0],
            Volume::Hull | Volume::Unknown => solid(form).map_err(|why| element.wrong(why))?,
        };
        if matches!(form, RobotForm::Plane | RobotForm::Field(_)) {
            return Ok(());
        }
        if unit.mass <= 0.0 {
            return Err(element.wrong(
                "mesh: its triangles have no volume or are inside out; reverse them, or add \
                 <inertial>",
            ));
        }
        let factor = given.map_or(density, |mass| mass / unit.mass);
        let mass = match volume {
            Volume::Unknown => f64::NAN,
            Volume::Hull | Volume::Triangles(_) => given.unwrap_or(density * unit.mass),
        };
        let own = LinkMass { mass, centre: unit.centre, inertia: unit.inertia * factor };
        self.matter[link].iter_mut().for_each(|matter| matter.push(own.placed(frame)));
        Ok(())
    }
}

/// Attribute `mass` of a shape (kg).
fn mass_of(read: &Defaulted<'_>) -> Parsed<Option<f64>> {
    read.get("mass").is_some().then(|| read.bounded("mass", 0.0, [0.0, 1e9])).transpose()
}

/// Density of a shape (kg/m³).
fn density_of(read: &Defaulted<'_>) -> Parsed<f64> {
    read.bounded("density", 1000.0, [0.0, 1e9])
}

/// Bit mask of collision groups.
fn group(read: &Defaulted<'_>, field: &str) -> Parsed<u32> {
    match read.whole(field)?.unwrap_or(1) {
        bits if (0..=i64::from(u32::MAX)).contains(&bits) => Ok(bits as u32),
        _ => Err(read
            .element()
            .wrong(format!("{field}: a whole number from 0 to 4294967295 is needed"))),
    }
}
