//! Shapes, called geoms, and the meshes that some are of.

use super::Reader;
use super::compiler::Compiler;
use super::defaults::Defaulted;
use crate::robot::frame::{Frame, from_z};
use crate::robot::mass::solid;
use crate::robot::meshes::{self, stem};
use crate::robot::model::{Form, Look, Mass, Seen, Shape};
use crate::robot::xml::{Attributes, Element};
use crate::scenario::shown;
use nalgebra::Vector3;
use std::collections::BTreeSet;

/// What a shape weighs, in the frame of its link, and its group.
pub struct Matter {
    pub group: f64,
    pub mass: Mass,
}

/// The kinds of shapes: how many of their sizes count, without and with `fromto`.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Plane,
    Sphere,
    Capsule,
    Cylinder,
    Ellipsoid,
    Box,
    Mesh,
    Field,
}

const KINDS: [(&str, Kind); 9] = [
    ("plane", Kind::Plane),
    ("sphere", Kind::Sphere),
    ("capsule", Kind::Capsule),
    ("cylinder", Kind::Cylinder),
    ("ellipsoid", Kind::Ellipsoid),
    ("box", Kind::Box),
    ("mesh", Kind::Mesh),
    ("hfield", Kind::Field),
    ("sdf", Kind::Field),
];

impl Reader<'_> {
    /// A shape in `frame` of the link.
    pub(super) fn read_shape(
        &mut self,
        element: &Element,
        (link, frame): (usize, &Frame),
        class: &str,
    ) -> Result<(), String> {
        const READ: [&str; 24] = [
            "name",
            "class",
            "type",
            "contype",
            "conaffinity",
            "condim",
            "group",
            "priority",
            "size",
            "friction",
            "mass",
            "density",
            "shellinertia",
            "fromto",
            "pos",
            "quat",
            "axisangle",
            "xyaxes",
            "zaxis",
            "euler",
            "mesh",
            "fitscale",
            "fluidshape",
            "hfield",
        ];
        const SOFT: [&str; 5] = ["solmix", "solref", "solimp", "margin", "gap"];
        element.refuse_others(
            &READ,
            &[&SOFT[..], &["material", "rgba", "user", "fluidcoef"]].concat(),
        )?;
        let read = self.defaulted(element, class)?;
        if SOFT.iter().any(|soft| read.get(soft).is_some()) {
            self.notes.soft();
        }
        let usual = if read.get("mesh").is_some() { Kind::Mesh } else { Kind::Sphere };
        let kind = read.word("type", &KINDS)?.unwrap_or(usual);
        let groups = [group(&read, "contype")?, group(&read, "conaffinity")?];
        let touches = groups != [0, 0];
        if kind == Kind::Field {
            return match touches {
                true => Err(element.wrong("height fields and distance fields are not supported")),
                false => {
                    self.notes.idle("geom of a field");
                    Ok(())
                }
            };
        }
        let (form, own, is_whole) = self.form(&read, kind)?;
        let placed = frame.then(&own);
        let condim = read.whole("condim")?.unwrap_or(3);
        if ![1, 3, 4, 6].contains(&condim) {
            return Err(element.wrong("condim: 1, 3, 4 or 6 is needed"));
        }
        let friction = read.numbers("friction")?.unwrap_or_default();
        if friction.len() > 3 || friction.iter().any(|part| *part < 0.0) {
            return Err(element.wrong("friction: one to three numbers from 0 are needed"));
        }
        let rolling = [friction.get(1).unwrap_or(&0.005), friction.get(2).unwrap_or(&0.0001)];
        if condim > 3 && touches && rolling.iter().any(|part| **part > 0.0) {
            return Err(element.wrong(
                "friction against turning and rolling, condim 4 and 6, is not supported; give condim 3",
            ));
        }
        self.weigh(&read, (link, &placed), &form, is_whole)?;
        if !touches && link > 0 {
            self.read_look(&read, (link, placed), &form);
        }
        let index = self.robot.shapes.len();
        self.robot.shapes.push(Shape {
            name: element.own("name").map_or(format!("geom-{index}"), str::to_owned),
            link,
            form,
            frame: placed,
            groups: if self.robot.options.contacts { groups } else { [0, 0] },
            friction: Some(*friction.first().unwrap_or(&1.0)),
            rubs: condim > 1,
            priority: read.whole("priority")?.unwrap_or(0),
            at: element.at(),
        });
        Ok(())
    }

    /// A shape that touches nothing, as a part of what its link looks like.
    fn read_look(&mut self, read: &Defaulted<'_>, (link, frame): (usize, Frame), form: &Form) {
        let file = read.get("mesh").and_then(|mesh| self.files.get(mesh));
        let seen = match (form, file) {
            (Form::Hull(_), Some((file, scale))) => {
                match meshes::surface(self.reading, file, *scale, &self.robot.looks) {
                    Ok(surface) => Seen::Mesh(surface),
                    Err(why) => {
                        if self.unseen.insert(link) {
                            self.notes.unseen(read.element().wrong(why));
                        }
                        return;
                    }
                }
            }
            (Form::Ellipsoid(_) | Form::Plane, _) => return,
            (form, _) => Seen::Form(form.clone()),
        };
        self.robot.looks.push(Look { link, seen, frame });
    }

    /// Of the looks those of links that have a mesh among them: others look like all their shapes.
    pub(super) fn keep_looks(&mut self) {
        let looks = std::mem::take(&mut self.robot.looks);
        let meshed = looks.iter().filter(|look| look.triangles() > 0).map(|look| look.link);
        let meshed: BTreeSet<_> = meshed.filter(|link| !self.unseen.contains(link)).collect();
        let kept = looks.into_iter().filter(|look| meshed.contains(&look.link));
        self.robot.looks = kept.collect();
    }

    /// What a form is, where it is in its frame, and whether its mass follows from it.
    fn form(&self, read: &Defaulted<'_>, kind: Kind) -> Result<(Form, Frame, bool), String> {
        let element = read.element();
        let sizes = read.numbers("size")?.unwrap_or_default();
        let size = |index: usize| match sizes.get(index) {
            Some(size) if (1e-6..=1e4).contains(size) => Ok(*size),
            Some(size) => {
                Err(element.wrong(format!("size: {size:?} is none; 1e-6 to 1e4 m is needed")))
            }
            None => Err(element.wrong(format!("size: {} numbers are needed", index + 1))),
        };
        if let Some([a, b, c, d, e, f]) = read.exactly::<6>("fromto")? {
            let (from, to) = (Vector3::new(a, b, c), Vector3::new(d, e, f));
            let half = 0.5 * (to - from).norm();
            if !(1e-6..=1e4).contains(&half) {
                return Err(element.wrong("fromto: two points 2e-6 to 2e4 m apart are needed"));
            }
            let radius = size(0)?;
            let form = match kind {
                Kind::Capsule => Form::Capsule(half, radius),
                Kind::Cylinder => Form::Cylinder(half, radius),
                Kind::Ellipsoid => Form::Ellipsoid(Vector3::new(radius, radius, half)),
                Kind::Box => Form::Box(Vector3::new(radius, radius, half)),
                _ => {
                    return Err(
                        element.wrong("fromto is for capsules, cylinders, boxes and ellipsoids")
                    );
                }
            };
            let attitude = from_z(&(from - to).normalize());
            return Ok((form, Frame { position: (from + to) * 0.5, attitude }, true));
        }
        let three = || Ok::<_, String>(Vector3::new(size(0)?, size(1)?, size(2)?));
        let mut is_whole = true;
        let form = match kind {
            Kind::Plane => Form::Plane,
            Kind::Sphere => Form::Sphere(size(0)?),
            Kind::Capsule => Form::Capsule(size(1)?, size(0)?),
            Kind::Cylinder => Form::Cylinder(size(1)?, size(0)?),
            Kind::Ellipsoid => Form::Ellipsoid(three()?),
            Kind::Box => Form::Box(three()?),
            Kind::Mesh | Kind::Field => {
                let name = read.needed("mesh")?;
                let known = self.meshes.get(name).cloned();
                let hulled = known.ok_or_else(|| {
                    element.wrong(format!("mesh: there is no mesh {:?}", shown::line(name)))
                })?;
                is_whole = hulled.is_whole;
                Form::Hull(hulled.corners)
            }
        };
        if kind != Kind::Mesh && read.get("mesh").is_some() {
            return Err(
                element.wrong("a form that is fitted to a mesh is not supported; give its size")
            );
        }
        Ok((form, self.compiler.frame(read)?, is_whole))
    }

    /// What a shape adds to its link.
    fn weigh(
        &mut self,
        read: &Defaulted<'_>,
        (link, frame): (usize, &Frame),
        form: &Form,
        is_whole: bool,
    ) -> Result<(), String> {
        let element = read.element();
        let given = read.get("mass").is_some().then(|| read.bounded("mass", 0.0, [0.0, 1e9]));
        let given = given.transpose()?;
        let density = read.bounded("density", 1000.0, [0.0, 1e9])?;
        let group = read.number("group")?.unwrap_or(0.0);
        if read.word("shellinertia", &super::compiler::SWITCH)? == Some(true) {
            return Err(element.wrong("shellinertia is not supported; give <inertial>"));
        }
        if link == 0 || given == Some(0.0) || (given.is_none() && density == 0.0) {
            return Ok(());
        }
        let unit = solid(form).map_err(|why| element.wrong(why))?;
        if unit.mass <= 0.0 {
            return Ok(());
        }
        let factor = given.map_or(density, |mass| mass / unit.mass);
        // Of a mesh that is no convex solid the inertia is not known.
        let mass = if is_whole { given.unwrap_or(density * unit.mass) } else { f64::NAN };
        let own = Mass { mass, centre: unit.centre, inertia: unit.inertia * factor };
        self.add_matter(link, Matter { group, mass: own.placed(frame) });
        Ok(())
    }

    /// Meshes; what is for the eye is noted.
    pub(super) fn read_assets(&mut self, section: &Element) -> Result<(), String> {
        for asset in &section.children {
            match &*asset.tag {
                "mesh" => self.read_mesh(asset)?,
                "texture" | "material" | "skin" | "hfield" => self.notes.idle(&asset.tag),
                _ => return Err(asset.wrong("this asset is not supported")),
            }
        }
        Ok(())
    }

    fn read_mesh(&mut self, element: &Element) -> Result<(), String> {
        const READ: [&str; 6] = ["name", "class", "file", "vertex", "scale", "inertia"];
        const IDLE: [&str; 10] = [
            "face",
            "normal",
            "texcoord",
            "smoothnormal",
            "maxhullvert",
            "content_type",
            "material",
            "needsdf",
            "octree_maxdepth",
            "refpos",
        ];
        element.refuse_others(&READ, &IDLE)?;
        let read = self.defaulted(element, "")?;
        let scale = read.exactly::<3>("scale")?.unwrap_or([1.0; 3]);
        if element.get("refpos").is_some() {
            return Err(element.wrong("refpos is not supported; move the vertices"));
        }
        let (name, found) = match (element.get("file"), element.numbers("vertex")?) {
            (Some(file), None) => {
                let name = element.own("name").map_or_else(|| stem(file), str::to_owned);
                let file = self.mesh_file(file);
                let found = meshes::read(self.reading, &file, scale);
                if let Some(note) = found.as_ref().ok().and_then(|found| found.note(&file)) {
                    self.notes.say(note);
                }
                self.files.insert(name.clone(), (file, scale));
                (name, found)
            }
            (None, Some(numbers)) if numbers.len().is_multiple_of(3) => {
                let point = |three: &[f64]| std::array::from_fn(|k| three[k] * scale[k]);
                let found = meshes::hull(numbers.chunks_exact(3).map(point));
                (element.needed("name")?.to_owned(), found)
            }
            _ => {
                return Err(
                    element.wrong("either file or vertex, of three numbers each, is needed")
                );
            }
        };
        self.meshes.insert(name, found.map_err(|why| element.wrong(why))?);
        Ok(())
    }

    fn mesh_file(&self, file: &str) -> String {
        let Compiler { meshes, strip, .. } = &self.compiler;
        let file = if *strip { file.rsplit(['/', '\\']).next().unwrap_or(file) } else { file };
        if meshes.is_empty() { file.to_owned() } else { format!("{meshes}/{file}") }
    }
}

/// A set of groups, as its bits.
fn group(read: &Defaulted<'_>, field: &str) -> Result<u32, String> {
    match read.whole(field)?.unwrap_or(1) {
        bits if (0..=i64::from(u32::MAX)).contains(&bits) => Ok(bits as u32),
        _ => Err(read.element().wrong(format!("{field}: 0 to 4294967295 is allowed"))),
    }
}
