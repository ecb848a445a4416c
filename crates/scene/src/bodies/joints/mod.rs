//! Tables `[[joints]]` and `[[motors]]`, their exact form and the joints made of it.

mod entries;
mod motor;
mod placed;

pub use entries::{DriveEntry, JointEntry};
pub use motor::{MotorEntry, MotorFields};
pub use placed::{JointSide, JointStartFrame, anchor_in_range};

use super::copies::name_of;
use crate::bodies::entries::BodyEntry;
use crate::bodies::place::Place;
use entries::BodyNames;
use nalgebra::{Vector3, Vector4};
use placed::turned;
use std::f64::consts::PI;
use tumble_core::joint::{Drive, Joint, Middle};
use tumble_core::mechanics::quaternion::{left, rotation};
use tumble_model::fields::{Exactly, Numbers};
use tumble_model::joint::JointKind;

/// Maximum number of joints of a scene.
const MOST_JOINTS: usize = 10_000;

impl JointEntry {
    /// Name as an addition to error messages.
    pub fn error_suffix(&self) -> String {
        self.name.as_ref().map_or(String::new(), |name| format!(" ({name})"))
    }

    /// Name, if given.
    pub fn name(&self) -> Option<&str> {
        self.name.as_deref()
    }

    /// Entry in exact form. `bodies` are the names of A and, unless it is the world, of B.
    pub fn made(
        name: String,
        kind: JointKind,
        bodies: Vec<String>,
        frames: [Place; 2],
        drives: &[Drive],
    ) -> Self {
        let (bodies, frames) = (BodyNames::List(bodies), Some(Exactly(frames)));
        let mut entry = Self { name: Some(name), kind, bodies, frames, ..Self::default() };
        for ((axis, _), drive) in kind.driven().iter().zip(drives) {
            entry.set_drive(axis, drive);
        }
        entry
    }

    /// Sets the drive of an axis. Its motor is not part of the entry.
    pub fn set_drive(&mut self, axis: &str, drive: &Drive) {
        let entry = DriveEntry::from(drive);
        if self.kind.driven().len() == 1 {
            let DriveEntry { limits, restitution, friction, static_friction, .. } = entry;
            let DriveEntry { friction_curve, stiffness, rest, damping, force, armature, .. } =
                entry;
            let stops = Self { limits, restitution, start: None, ..std::mem::take(self) };
            let rubbing = Self { friction, static_friction, friction_curve, ..stops };
            *self = Self { stiffness, rest, damping, force, armature, ..rubbing };
            return;
        }
        let table = match axis {
            "slide" => &mut self.slide,
            "turn" => &mut self.turn,
            "x" => &mut self.x,
            "y" => &mut self.y,
            "z" => &mut self.z,
            "turn_x" => &mut self.turn_x,
            "turn_y" => &mut self.turn_y,
            _ => &mut self.turn_z,
        };
        *table = Some(entry).filter(|entry| *entry != DriveEntry::default());
    }

    /// Exact form: an entry for each joint. `first` is the number of joints before, and `find` returns the
    /// indices of the `bodies` with a name.
    pub fn exact(
        &self,
        bodies: &[BodyEntry],
        first: usize,
        find: impl Fn(&str) -> Result<Vec<usize>, String>,
    ) -> Result<Vec<Self>, String> {
        let pairs = self.pairs(find)?;
        let count = pairs.len();
        if count > MOST_JOINTS - first {
            return Err(format!(
                "bodies: with these {count} there are more than {MOST_JOINTS} joints"
            ));
        }
        self.refuse_idle()?;
        let drives = self.drives();
        let joint = |(number, (body, other)): (usize, (usize, Option<usize>))| {
            let name = name_of(self.name.as_deref(), "joint", first + number, number, count);
            let own = [Some(&bodies[body]), other.map(|other| &bodies[other])];
            let frames = self.frames(&own.map(JointSide::new))?;
            let names = own.into_iter().flatten().map(|body| body.name().to_owned()).collect();
            let Self { length, cone, middle, collide, .. } = *self;
            let collide = collide.filter(|collide| *collide);
            let made = Self::made(name, self.kind, names, frames, &drives);
            Ok(Self { length, cone, middle, collide, ..made })
        };
        pairs.into_iter().enumerate().map(joint).collect()
    }

    /// Joint of an entry in exact form, with these drives. `body` finds a body.
    pub fn joint(
        &self,
        drives: &[Drive],
        body: impl Fn(&str) -> Result<usize, String>,
    ) -> Result<Joint, String> {
        let (a, b) = match self.bodies.list() {
            [a] => (body(a)?, None),
            [a, b] => (body(a)?, Some(body(b)?)),
            _ => return Err("bodies: one name or two are needed".to_owned()),
        };
        let frames = self.frames.ok_or_else(|| "frames: they are needed".to_owned())?;
        let [x, y, z, rx, ry, rz] = self.kind.axes(drives, self.cone);
        let joint = Joint::between(a, b, frames.0.each_ref().map(Place::frame))
            .with_axes([x, y, z], [rx, ry, rz]);
        let joint = match self.kind {
            JointKind::Gimbal => joint.with_middle(self.middle.unwrap_or(Middle::STRAIGHT)),
            _ => joint,
        };
        let joint = match self.length {
            Some(length) => joint.with_length(length),
            None => joint,
        };
        Ok(if self.collide == Some(true) { joint.colliding() } else { joint })
    }

    /// Names of its bodies; `None` for the world.
    pub fn ends(&self) -> [Option<&str>; 2] {
        [0, 1].map(|k| self.bodies.list().get(k).map(String::as_str))
    }

    /// True if a body with this name is one of its bodies.
    pub fn has(&self, body: &str) -> bool {
        self.bodies.list().iter().any(|of| of == body)
    }

    /// Bodies A and B of the joints of the entry.
    ///
    /// Two names of equally many bodies join them pairwise. The same name twice makes a chain of
    /// copies: each is joined to the previous one.
    fn pairs(
        &self,
        find: impl Fn(&str) -> Result<Vec<usize>, String>,
    ) -> Result<Vec<(usize, Option<usize>)>, String> {
        let names = self.bodies.list();
        let find = |name: &str| find(name).map_err(|why| format!("bodies: {why}"));
        match names {
            [one] => Ok(find(one)?.into_iter().map(|body| (body, None)).collect()),
            [first, second] if first == second => {
                let copies = find(first)?;
                if copies.len() < 2 {
                    return Err(format!(
                        "bodies: {first:?} is one body; give two different bodies, or the name of \
                         copies for a chain"
                    ));
                }
                Ok(copies.windows(2).map(|two| (two[1], Some(two[0]))).collect())
            }
            [first, second] => {
                let (first, second) = (find(first)?, find(second)?);
                if first.len() != second.len() && first.len() != 1 && second.len() != 1 {
                    return Err(format!(
                        "bodies: {} and {} copies; as many of both, or one of either, are needed",
                        first.len(),
                        second.len()
                    ));
                }
                let count = first.len().max(second.len());
                let at = |of: &[usize], number: usize| of[number.min(of.len() - 1)];
                let pairs = (0..count).map(|k| (at(&first, k), Some(at(&second, k))));
                let pairs: Vec<_> = pairs.collect();
                if pairs.iter().any(|(a, b)| Some(*a) == *b) {
                    Err("bodies: two different bodies are needed".to_owned())
                } else {
                    Ok(pairs)
                }
            }
            _ => Err("bodies: two names are needed, or one for a joint with the world".to_owned()),
        }
    }

    /// Rejects fields without effect and missing fields.
    fn refuse_idle(&self) -> Result<(), String> {
        let (kind, driven) = (self.kind, self.kind.driven());
        let has_axis = kind.has_axis();
        let idle = |field: &str| {
            Err(format!("{field} has no meaning for a {} joint; leave it out", kind.name()))
        };
        let axes = [
            ("axis", self.axis.is_some()),
            ("axis_a", self.axis_a.is_some()),
            ("axis_b", self.axis_b.is_some()),
        ];
        match (kind, self.cone) {
            (JointKind::Ball, None) => return Err("cone: required, rad".to_owned()),
            (JointKind::Ball, Some(_)) | (_, None) => {}
            (_, Some(_)) => return idle("cone"),
        }
        if self.middle.is_some() && kind != JointKind::Gimbal {
            return idle("middle");
        }
        if let Some((field, _)) = axes.into_iter().find(|(_, given)| *given && !has_axis) {
            return idle(field);
        }
        if let Some((field, _)) = axes.into_iter().find(|(_, given)| *given)
            && kind == JointKind::Universal
        {
            let frame = field.replace("axis", "attitude");
            return Err(format!(
                "{field}: a universal joint turns about two axes, x and y of its frame; give `{frame}` instead"
            ));
        }
        for (field, _) in self.tables().into_iter().filter(|(_, table)| table.is_some()) {
            if driven.len() == 1 && driven[0].0 == field {
                return Err(format!(
                    "{field}: a {} joint has one axis; move these fields to the joint itself",
                    kind.name()
                ));
            }
            if driven.iter().all(|(name, _)| *name != field) {
                return idle(field);
            }
        }
        let turns = self.tables().into_iter().filter(|(name, _)| name.starts_with("turn_"));
        for (name, table) in turns.filter(|_| kind.turns_freely()) {
            let given = table.unwrap_or_default();
            if given.start.is_some() {
                return idle(&format!("{name}.start"));
            }
            if given.limits.is_some() {
                return idle(&format!("{name}.limits"));
            }
        }
        for ((axis, _), entry) in driven.iter().zip(self.drive_entries()) {
            if let Some((field, needed)) = entry.idle_field() {
                let table = if driven.len() == 1 { String::new() } else { format!("{axis}.") };
                return Err(format!(
                    "{table}{field} has no meaning without `{needed}`; leave it out"
                ));
            }
        }
        if let Some(field) = self.drive().first()
            && driven.len() != 1
        {
            if driven.is_empty() {
                return idle(field);
            }
            let names: Vec<_> = driven.iter().map(|(name, _)| format!("`{name}`")).collect();
            return Err(format!(
                "{field}: a {} joint has several axes; move {field} to one of {}",
                kind.name(),
                names.join(", ")
            ));
        }
        Ok(())
    }

    /// Drives of the driven axes, in their order, without motors.
    pub fn drives(&self) -> Vec<Drive> {
        self.drive_entries().iter().map(DriveEntry::drive).collect()
    }

    /// Tables of the driven axes, in their order.
    fn drive_entries(&self) -> Vec<DriveEntry> {
        let driven = self.kind.driven();
        if driven.len() == 1 {
            return vec![self.drive()];
        }
        let tables = self.tables();
        let of = |(axis_name, _): &(&str, usize)| {
            let table = tables.iter().find(|(name, _)| name == axis_name);
            table.and_then(|(_, table)| *table).unwrap_or_default()
        };
        driven.iter().map(of).collect()
    }

    /// Tables of drives with their names.
    fn tables(&self) -> [(&'static str, Option<DriveEntry>); 8] {
        [
            ("slide", self.slide),
            ("turn", self.turn),
            ("x", self.x),
            ("y", self.y),
            ("z", self.z),
            ("turn_x", self.turn_x),
            ("turn_y", self.turn_y),
            ("turn_z", self.turn_z),
        ]
    }

    /// Frames of the joint in both bodies.
    ///
    /// The frame in A is given. The frame in B is given too or follows from the initial states.
    fn frames(&self, sides: &[JointSide<'_>; 2]) -> Result<[Place; 2], String> {
        if let Some(frames) = &self.frames {
            let others = [&self.anchor, &self.anchor_a, &self.anchor_b, &self.axis, &self.axis_a];
            let turns = [&self.attitude, &self.attitude_a, &self.attitude_b];
            let is_alone = others.iter().all(|of| of.is_none()) && self.axis_b.is_none();
            return if is_alone && turns.iter().all(|of| of.is_none()) {
                Ok(frames.0)
            } else {
                Err("frames: they replace anchors, axes and attitudes; leave these out".to_owned())
            };
        }
        for (field, anchor) in
            [("anchor", &self.anchor), ("anchor_a", &self.anchor_a), ("anchor_b", &self.anchor_b)]
        {
            anchor_in_range(field, anchor.as_ref())?;
        }
        let [a, b] = sides;
        let needed = || {
            format!(
                "anchor: a position in the world at the start, or `anchor_a` in the frame of {}, \
                 is needed",
                a.name
            )
        };
        let still = Vector4::from(Place::ORIGIN.attitude);
        let in_world = turned("", self.axis.as_ref(), self.attitude.as_ref())?;
        let in_a = turned("_a", self.axis_a.as_ref(), self.attitude_a.as_ref())?;
        let in_b = turned("_b", self.axis_b.as_ref(), self.attitude_b.as_ref())?;
        let anchor = match (&self.anchor, &self.anchor_a) {
            (Some(_), Some(_)) => {
                return Err("anchor: only one of `anchor` and `anchor_a` can be given".to_owned());
            }
            (Some(anchor), None) => anchor.0.into(),
            (None, Some(anchor)) => a.placed(&anchor.0.into(), &still).anchor,
            (None, None) => return Err(needed()),
        };
        let has_axis = self.kind.has_axis();
        let attitude = match (in_world, in_a) {
            (Some(_), Some(_)) => {
                return Err(
                    "axis: only one of `axis` in the world and `axis_a` can be given".to_owned()
                );
            }
            (Some(attitude), None) => attitude,
            (None, Some(attitude)) => a.placed(&Vector3::zeros(), &attitude).attitude,
            (None, None) if has_axis => {
                let (field, what) = match self.kind {
                    JointKind::Universal => ("attitude", "a rotation to the world"),
                    _ => ("axis", "a direction in the world"),
                };
                return Err(format!(
                    "{field}: {what} at the start, or `{field}_a` in the frame of {}, is needed",
                    a.name
                ));
            }
            (None, None) => still,
        };
        let of_a = JointStartFrame { anchor, attitude };
        let mut of_b = self.at_its_start(of_a)?;
        if let Some(attitude) = in_b {
            of_b.attitude = b.placed(&Vector3::zeros(), &attitude).attitude;
        }
        if let Some(anchor) = &self.anchor_b {
            of_b.anchor = b.placed(&anchor.0.into(), &still).anchor;
        }
        // Values given in a body's own frame keep their bits, so that a saved scene continues
        // exactly.
        let exactly = |side: &JointSide<'_>,
                       placed,
                       anchor: Option<&Numbers<3>>,
                       attitude: Option<Vector4<f64>>| {
            let local = side.to_local(placed);
            Place {
                position: anchor
                    .map_or(local.position, |anchor| side.relative_to_centre(&anchor.0)),
                attitude: attitude.map_or(local.attitude, Vector4::into),
            }
        };
        Ok([
            exactly(a, &of_a, self.anchor_a.as_ref(), in_a),
            exactly(b, &of_b, self.anchor_b.as_ref(), in_b),
        ])
    }

    /// Frame in B at the start, for which the joint coordinates have their `start` values.
    fn at_its_start(&self, of_a: JointStartFrame) -> Result<JointStartFrame, String> {
        let mut at = [0.0; 6];
        let several = self.kind.driven().len() > 1;
        for ((name, axis), drive) in self.kind.driven().iter().zip(self.drive_entries()) {
            let Some(start) = drive.start else { continue };
            let field = if several { format!("{name}.start") } else { "start".to_owned() };
            let most = if *axis < 3 { 1e4 } else { PI };
            if start.is_nan() || start.abs() > most {
                let unit = if *axis < 3 { "m" } else { "rad" };
                return Err(format!("{field} is {start:?}; allowed: -{most} to {most} {unit}"));
            }
            if self.anchor_b.is_some() || self.axis_b.is_some() || self.attitude_b.is_some() {
                return Err(format!(
                    "{field}: it follows from the frames of both bodies; leave it out"
                ));
            }
            at[*axis] = start;
        }
        // Inverse rotation from A: about x, z and y; a hinge only rotates about z.
        let mut attitude = of_a.attitude;
        for axis in [3, 5, 4].into_iter().filter(|axis| at[*axis] != 0.0) {
            let (sine, cosine) = libm::sincos(-0.5 * at[axis]);
            let mut back = Vector4::new(cosine, 0.0, 0.0, 0.0);
            back[axis - 2] = sine;
            attitude = left(&attitude) * back;
        }
        let off = rotation(&attitude) * Vector3::new(at[0], at[1], at[2]);
        Ok(JointStartFrame { anchor: of_a.anchor - off, attitude })
    }
}
