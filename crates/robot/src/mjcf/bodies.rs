//! `<worldbody>`: links, their joints and masses.

use super::MjcfReader;
use super::compiler::{LIMITED, SWITCH};
use crate::between::carried;
use crate::frame::LinkFrame;
use crate::mass::symmetric;
use crate::model::{LinkMass, Moves, RobotJoint, RobotLink};
use crate::urdf::masses::LEAST_MASS;
use crate::xml::{Attributes, Element, Parsed, is_listed};
use nalgebra::{Matrix3, Vector3};
use tumble_model::{nearest, shown};

/// Maximum number of links.
const MOST_LINKS: usize = 2000;

/// Elements that do not affect the motion.
const IDLE: &str = "camera light";
/// Elements of a body that are read.
const READ: &str = "geom body joint freejoint site inertial frame";

/// Context of child elements: link, their frame in it, and their default class.
#[derive(Clone)]
pub(super) struct Within<'e> {
    pub link: usize,
    pub frame: LinkFrame,
    pub class: &'e str,
}

impl MjcfReader<'_> {
    /// Reads all bodies.
    pub(super) fn read_world(&mut self, root: &Element) -> Parsed<()> {
        self.matter.push(None);
        let mut below = Vec::new();
        for world in root.all("worldbody") {
            let within = Within { link: 0, frame: LinkFrame::identity(), class: "" };
            self.read_contents(world, &within, &mut below)?;
        }
        self.read_bodies(below)
    }

    /// Reads bodies in order, each with its descendants.
    fn read_bodies<'e>(&mut self, bodies: Vec<(&'e Element, Within<'e>)>) -> Parsed<()> {
        for (body, within) in bodies {
            self.read_body(body, &within)?;
        }
        Ok(())
    }

    fn read_body<'e>(&mut self, body: &'e Element, within: &Within<'e>) -> Parsed<()> {
        const READ: &str = "\
            name childclass pos quat axisangle euler xyaxes zaxis gravcomp mocap class";
        body.refuse_others(READ, "user sleep")?;
        let is_mocap = body.word("mocap", &SWITCH)? == Some(true);
        if is_mocap {
            self.notes.say(format!("{}: mocap bodies stay fixed", body.at()));
        }
        let index = self.robot.links.len();
        if index > MOST_LINKS {
            return Err(body.wrong(format!("there are more than {MOST_LINKS} bodies")));
        }
        let name = body.own("name").map_or(format!("body-{index}"), str::to_owned);
        if self.robot.link(&name).is_some() {
            return Err(body.wrong("this name is used twice; each body needs its own"));
        }
        let class = self.childclass(body, within.class)?;
        let own = self.defaulted(body, "")?;
        let frame = within.frame.then(&self.compiler.frame(&own)?);
        self.robot.links.push(RobotLink {
            name,
            parent: within.link,
            frame,
            mass: LinkMass::NONE,
            weightless: body.bounded("gravcomp", 0.0, [-1e3, 1e3])?,
            is_mocap,
            is_between: false,
            joints: (self.robot.joints.len(), 0),
            at: body.at(),
        });
        // Shapes define the mass if requested, or without `<inertial>`.
        let given = body.one("inertial")?.map(|inertial| self.inertial(inertial)).transpose()?;
        let counts = self.compiler.inertia_from_shapes.unwrap_or(given.is_none());
        self.matter.push(counts.then(Vec::new));
        let within = Within { link: index, frame: LinkFrame::identity(), class };
        let mut below = Vec::new();
        self.read_contents(body, &within, &mut below)?;
        self.robot.links[index].mass = given.unwrap_or(LinkMass::NONE);
        self.read_bodies(below)
    }

    fn childclass<'e>(&self, element: &'e Element, outer: &'e str) -> Parsed<&'e str> {
        match element.own("childclass") {
            Some(class) if self.classes.knows(class) => Ok(class),
            Some(class) => {
                let class = shown::line(class);
                Err(element.wrong(format!("childclass: there is no default class {class:?}")))
            }
            None => Ok(outer),
        }
    }

    /// Reads the content of a body or frame. Child bodies are collected in `below`.
    fn read_contents<'e>(
        &mut self,
        element: &'e Element,
        within: &Within<'e>,
        below: &mut Vec<(&'e Element, Within<'e>)>,
    ) -> Parsed<()> {
        for child in &element.children {
            match &*child.tag {
                "geom" => self.read_shape(child, within)?,
                "body" => below.push((child, within.clone())),
                "joint" | "freejoint" => self.read_joint(child, within)?,
                "site" => self.read_site(child, within)?,
                "inertial" if within.link > 0 && element.tag == "body" => {}
                "frame" => {
                    let read = "pos quat axisangle euler xyaxes zaxis childclass name";
                    child.refuse_others(read, "")?;
                    let own = self.defaulted(child, "")?;
                    let frame = within.frame.then(&self.compiler.frame(&own)?);
                    let class = self.childclass(child, within.class)?;
                    self.read_contents(child, &Within { frame, class, ..*within }, below)?;
                }
                tag if is_listed(tag, IDLE) => self.notes.idle(tag),
                tag => {
                    let hint = nearest::hint(tag, READ.split(' ').chain(IDLE.split(' ')));
                    let why = format!("this element is not supported in a body{hint}");
                    return Err(child.wrong(why));
                }
            }
        }
        Ok(())
    }

    fn read_joint(&mut self, element: &Element, within: &Within<'_>) -> Parsed<()> {
        const READ: &str = "\
            name class type pos axis springdamper stiffness range limited actuatorfrclimited \
            actuatorfrcrange actuatorgravcomp ref springref springyield armature damping frictionloss align";
        const SOFT: &str = "solreflimit solimplimit solreffriction solimpfriction margin";
        element.refuse_others(READ, &format!("{SOFT} group user"))?;
        let link = within.link;
        if link == 0 {
            return Err(element.wrong("the world cannot have joints"));
        }
        let index = self.robot.joints.len();
        let name = element.own("name").map_or(format!("joint-{index}"), str::to_owned);
        if self.robot.joint(&name).is_some() {
            return Err(element.wrong("this name is used twice; each joint needs its own"));
        }
        let mut read = self.defaulted(element, within.class)?;
        if element.tag == "freejoint" {
            read = self.defaulted(element, "")?;
        }
        self.note_soft(&read, SOFT);
        // Kind of the joint
        let kinds = [
            ("hinge", Moves::Hinge),
            ("slide", Moves::Slide),
            ("ball", Moves::Ball),
            ("free", Moves::Free),
        ];
        let moves = match &*element.tag {
            "freejoint" => Moves::Free,
            _ => read.word("type", &kinds)?.unwrap_or(Moves::Hinge),
        };
        if read.word("align", &LIMITED)?.flatten() == Some(true) {
            return Err(element.wrong("align: moving the frame is not supported"));
        }
        let mut joint = RobotJoint::bare(name, link, moves, element.at());
        if moves == Moves::Free && self.robot.links[link].parent != 0 {
            return Err(element.wrong("only a direct child of the world can be free"));
        }
        let angle = |value: f64| match moves {
            Moves::Hinge | Moves::Ball => self.compiler.angle(value),
            Moves::Slide | Moves::Free => value,
        };
        // Axis, anchor and range
        if matches!(moves, Moves::Hinge | Moves::Slide) {
            let axis = Vector3::from(read.exactly::<3>("axis")?.unwrap_or([0.0, 0.0, 1.0]));
            if axis.norm() <= 1e-12 {
                return Err(element.wrong("axis: its length is zero"));
            }
            joint.axis = within.frame.rotation() * axis.normalize();
            joint.reference = angle(read.number("ref")?.unwrap_or(0.0));
            joint.rest = angle(read.number("springref")?.unwrap_or(0.0));
        }
        if moves != Moves::Free {
            let anchor = Vector3::from(read.exactly::<3>("pos")?.unwrap_or_default());
            joint.anchor = within.frame.point(&anchor);
            let range = self.compiler.range(&read, "range", "limited")?;
            joint.range = range.map(|range| range.map(angle)).filter(|_| self.flags.limits);
        }
        // Springs, dampers and friction
        read.refuse_unless_zero(0, &[("springyield", "springs that yield are not supported")])?;
        let one = "terms of higher order are not supported; give one number";
        read.refuse_unless_zero(1, &[("stiffness", one), ("damping", one)])?;
        let [damping, stiffness, friction, armature] =
            ["damping", "stiffness", "frictionloss", "armature"]
                .map(|field| read.first_bounded(field, 0.0, [0.0, 1e12]));
        let (damping, stiffness, friction) = (damping?, stiffness?, friction?);
        joint.armature = armature?;
        joint.damping = if self.flags.dampers { damping } else { 0.0 };
        joint.stiffness = if self.flags.springs { stiffness } else { 0.0 };
        joint.friction = if self.flags.friction { friction } else { 0.0 };
        // `springdamper` needs the inertia that the joint moves, which is known after all bodies.
        let timed = read.exactly::<2>("springdamper")?;
        if let Some(two) = timed.filter(|two| two.iter().all(|one| *one > 0.0)) {
            if !matches!(moves, Moves::Hinge | Moves::Slide) {
                return Err(element.wrong("springdamper: a hinge or a slide is needed"));
            }
            self.timed.push((index, two));
        }
        joint.effort = self.compiler.range(&read, "actuatorfrcrange", "actuatorfrclimited")?;
        // Gravity compensation acts directly on the link. A limit on motor forces would not include
        // it.
        if read.word("actuatorgravcomp", &SWITCH)? == Some(true) && joint.effort.is_some() {
            return Err(
                element.wrong("actuatorgravcomp is not supported together with actuatorfrcrange")
            );
        }
        self.robot.joints.push(joint);
        let joints = &mut self.robot.links[link].joints;
        joints.1 += 1;
        Ok(())
    }

    /// Reads `<inertial>`.
    fn inertial(&self, element: &Element) -> Parsed<LinkMass> {
        const READ: &str = "pos quat axisangle euler xyaxes zaxis mass diaginertia fullinertia";
        element.refuse_others(READ, "")?;
        element.needed("mass")?;
        let mass = element.bounded("mass", 0.0, [0.0, 1e9])?;
        let attitude = self.compiler.attitude(element)?;
        let position = element.exactly::<3>("pos")?;
        let position = position.ok_or_else(|| element.wrong("pos is needed"))?;
        let inertia =
            match (element.exactly::<3>("diaginertia")?, element.exactly::<6>("fullinertia")?) {
                (Some(diagonal), None) => Matrix3::from_diagonal(&diagonal.into()),
                (None, Some([xx, yy, zz, xy, xz, yz])) if attitude.is_none() => {
                    Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
                }
                (None, None) if mass == 0.0 => Matrix3::zeros(),
                _ => {
                    let why =
                        "either diaginertia, or fullinertia without an orientation, is needed";
                    return Err(element.wrong(why));
                }
            };
        let frame = LinkFrame {
            position: position.into(),
            attitude: attitude.unwrap_or(LinkFrame::identity().attitude),
        };
        Ok(LinkMass { mass, centre: Vector3::zeros(), inertia }.placed(&frame))
    }

    /// Sums the masses of shapes and applies the mass options of the compiler.
    pub(super) fn set_masses(&mut self) -> Parsed<()> {
        for (link, matter) in self.robot.links.iter_mut().zip(&self.matter) {
            let Some(matter) = matter.as_ref().filter(|matter| !matter.is_empty()) else {
                continue;
            };
            link.mass = LinkMass::sum(matter);
            if link.mass.mass.is_nan() {
                let why = "the mass of one of its meshes is unknown: a .dae file, a reduced hull, \
                           or a shell; add <inertial>";
                return Err(format!("{}: {why}", link.at));
            }
        }
        // Bounds of `boundmass` and `boundinertia`, and `balanceinertia`
        let [least_mass, least_moment] = self.compiler.least;
        for link in self.robot.links.iter_mut().skip(1) {
            let own = &mut link.mass;
            own.mass = own.mass.max(least_mass);
            let eigen = own.inertia.symmetric_eigen();
            let mut moments = eigen.eigenvalues;
            if self.compiler.balanced {
                let [a, b, c] = [moments[0], moments[1], moments[2]];
                // Moments that no body has: one exceeds the sum of the others.
                if a + b < c || b + c < a || c + a < b {
                    moments = Vector3::repeat((a + b + c) / 3.0);
                }
            }
            let bounded = moments.map(|moment| moment.max(least_moment));
            if bounded != eigen.eigenvalues {
                let axes = eigen.eigenvectors;
                own.inertia =
                    symmetric(&(axes * Matrix3::from_diagonal(&bounded) * axes.transpose()));
            }
        }
        // All masses are scaled to `settotalmass`.
        if let Some(total) = self.compiler.total_mass {
            let sum: f64 = self.robot.links.iter().map(|link| link.mass.mass).sum();
            if sum <= 0.0 {
                return Err(
                    "<compiler>: settotalmass: no body has a mass; give one a mass".to_owned()
                );
            }
            for link in &mut self.robot.links {
                link.mass.mass *= total / sum;
                link.mass.inertia *= total / sum;
            }
        }
        self.raise_masses();
        Ok(())
    }

    /// Raises the mass of moving bodies to that of a scene body. The rotors of their joints are often
    /// far heavier.
    fn raise_masses(&mut self) {
        let carriers = self.robot.carriers();
        let mut names = Vec::new();
        for (index, carried) in carried(&self.robot).into_iter().enumerate().skip(1) {
            let is_faint = 0.0 < carried.mass && carried.mass < LEAST_MASS;
            if !is_faint || self.robot.links[index].joints.1 == 0 {
                continue;
            }
            // The sum of several masses may be rounded down.
            let factor = LEAST_MASS / carried.mass * (1.0 + 1e-12);
            for (link, _) in
                self.robot.links.iter_mut().zip(&carriers).filter(|(_, carrier)| **carrier == index)
            {
                link.mass.mass *= factor;
                link.mass.inertia *= factor;
            }
            names.push(shown::line(&self.robot.links[index].name).to_string());
        }
        if !names.is_empty() {
            let names = names.join(", ");
            self.notes.say(format!("bodies below {LEAST_MASS:e} kg have this mass: {names}"));
        }
    }

    /// Effective mass or moment of inertia of each joint at the reference with all others free:
    /// 1/(M⁻¹)ⱼⱼ of the mass matrix M.
    pub(super) fn moved_alone(&self) -> Parsed<Vec<f64>> {
        let still = vec![0.0; self.robot.counts().1];
        let motion = self.robot.motion(&self.robot.reference(), &still)?;
        let inverse = motion.mass_matrix(&self.robot).cholesky().map(|parts| parts.inverse());
        let inverse = inverse.ok_or("<body>: a joint moves no mass; add <inertial>")?;
        Ok(self.robot.places().iter().map(|&(_, rate)| inverse[(rate, rate)].recip()).collect())
    }

    /// Sets springs and dampers from a time constant T and a damping ratio ζ. M is the effective
    /// mass or moment of inertia of the joint at the reference:
    ///
    /// ```text
    /// k = M/(T ζ)²,   d = 2 M/T
    /// ```
    pub(super) fn set_springs(&mut self) -> Parsed<()> {
        if self.timed.is_empty() {
            return Ok(());
        }
        let moved = self.moved_alone()?;
        for (index, [time, ratio]) in std::mem::take(&mut self.timed) {
            let joint = &mut self.robot.joints[index];
            let stiffness = moved[index] / (time * ratio).powi(2);
            let damping = 2.0 * moved[index] / time;
            if ![stiffness, damping].iter().all(|one| (0.0..=1e12).contains(one)) {
                return Err(format!(
                    "{}: springdamper: its spring has {stiffness:.1e} and its damper \
                     {damping:.1e}; allowed: up to 1e12",
                    joint.at
                ));
            }
            joint.stiffness = if self.flags.springs { stiffness } else { 0.0 };
            joint.damping = if self.flags.dampers { damping } else { 0.0 };
        }
        Ok(())
    }
}
