//! Reader of the elements `<option>`, `<equality>` and `<keyframe>` of MJCF.
//!
//! An equality constraint is called a tie here. It becomes a joint between two links, or couples
//! the coordinates of two joints.

use super::MjcfReader;
use super::compiler::SWITCH;
use super::defaults::Defaulted;
use super::tendons::{Tendon, coefficients};
use crate::frame::LinkFrame;
use crate::model::{Key, MimicJoint, Moves, RobotOptions, RobotTie};
use crate::notes::RobotNotes;
use crate::xml::{Attributes, Element, Parsed, is_listed};
use nalgebra::{Vector3, Vector4};
use tumble_model::shown;

/// Effects that the file enables, from `<flag>` in `<option>`. All are enabled by default.
#[derive(Debug, Clone, Copy)]
pub struct Flags {
    /// Joint limits.
    pub limits: bool,
    /// Dry friction of joints (`frictionloss`).
    pub friction: bool,
    /// Equality constraints.
    pub ties: bool,
    /// Springs of joints and tendons.
    pub springs: bool,
    /// Damping of joints and tendons.
    pub dampers: bool,
    /// Actuators.
    pub actuators: bool,
    /// Limits of controls (`clampctrl`).
    pub clamps: bool,
}

/// Flags of MuJoCo 3 and 4. Some have no effect here.
const FLAGS: &str = "\
    constraint equality frictionloss limit contact passive spring damper gravity clampctrl \
    warmstart filterparent actuation refsafe sensor midphase eulerdamp autoreset nativeccd \
    island override energy fwdinv invdiscrete multiccd sleep diagexact ipc speculative";

/// Note on parameters of `<option>` for all contacts.
const OVERRIDE: &str = "the flag override has no effect: contacts keep their friction and margins, not o_friction and o_margin";

/// Values of a flag.
const ABLE: [(&str, bool); 2] = [("enable", true), ("disable", false)];

/// Attributes of `<option>` that are read, or rejected with a message of their own.
const READ: &str = "timestep gravity density viscosity actuatorgroupdisable";

/// Attributes of `<option>` without effect here. They configure MuJoCo's solver and contacts, a
/// medium around the bodies, or a magnetic field.
const IDLE: &str = "\
    apirate impratio tolerance ls_tolerance noslip_tolerance ccd_tolerance mpr_tolerance \
    sleep_tolerance wind magnetic o_margin o_solref o_solimp o_friction integrator collision \
    cone jacobian solver iterations ls_iterations noslip_iterations ccd_iterations \
    mpr_iterations sdf_iterations sdf_initpoints";

/// Attributes of a constraint between two bodies.
const TIED: &str = "name class active body1 body2 anchor site1 site2 solref";

/// Reads all `<option>` elements in `root` and their flags.
pub fn options(root: &Element, notes: &mut RobotNotes) -> Parsed<(RobotOptions, Flags)> {
    let mut options = RobotOptions::usual(true);
    let mut flags = Flags {
        limits: true,
        friction: true,
        ties: true,
        springs: true,
        dampers: true,
        actuators: true,
        clamps: true,
    };
    for element in root.all("option") {
        options.time_step = element.bounded("timestep", options.time_step, [1e-6, 0.1])?;
        if let Some(gravity) = element.exactly::<3>("gravity")? {
            options.gravity = gravity.into();
        }
        for medium in ["density", "viscosity"] {
            if element.number(medium)?.unwrap_or(0.0) != 0.0 {
                return Err(element.wrong(format!(
                    "{medium}: a surrounding medium is not supported; ignore it with leave_out or \
                     --leave-out @{medium}"
                )));
            }
        }
        if element.own("actuatorgroupdisable").is_some_and(|groups| !groups.trim().is_empty()) {
            return Err(
                element.wrong("actuatorgroupdisable is not supported; remove the actuators")
            );
        }
        element.refuse_others(READ, IDLE)?;
        if element.attributes.iter().any(|(name, _)| is_listed(name, IDLE)) {
            notes.say("integrator, solver and cone of <option> have no effect".to_owned());
        }
        for flag in &element.children {
            set_flags(flag, &mut options, &mut flags, notes)?;
        }
    }
    Ok((options, flags))
}

/// Reads one `<flag>` element. Flags without effect here are ignored.
fn set_flags(
    element: &Element,
    options: &mut RobotOptions,
    flags: &mut Flags,
    notes: &mut RobotNotes,
) -> Parsed<()> {
    if element.tag != "flag" {
        return Err(element.wrong("this element is unknown in <option>"));
    }
    for (name, _) in &element.attributes {
        let on = element.word(name, &ABLE)?.unwrap_or(true);
        if !is_listed(name, FLAGS) {
            return Err(element.wrong(format!("the flag {name} is not known; leave it out")));
        }
        match (&**name, on) {
            ("constraint", false) => {
                (flags.limits, flags.friction, flags.ties) = (false, false, false);
                options.contacts = false;
            }
            ("equality", false) => flags.ties = false,
            ("frictionloss", false) => flags.friction = false,
            ("limit", false) => flags.limits = false,
            ("contact", false) => options.contacts = false,
            ("passive", false) => (flags.springs, flags.dampers) = (false, false),
            ("spring", false) => flags.springs = false,
            ("damper", false) => flags.dampers = false,
            ("gravity", false) => options.gravity = Vector3::zeros(),
            ("clampctrl", false) => flags.clamps = false,
            ("filterparent", on) => options.neighbours_touch = !on,
            ("actuation", false) => flags.actuators = false,
            ("override", true) => notes.say(OVERRIDE.to_owned()),
            _ => {}
        }
    }
    Ok(())
}

impl MjcfReader<'_> {
    /// Reads the constraints in `<equality>`. Inactive ones are skipped. MuJoCo's constraints are
    /// soft, these are rigid, and a note says so.
    pub(super) fn read_equality(&mut self, section: &Element, tendons: &[Tendon]) -> Parsed<()> {
        for element in &section.children {
            let read = self.defaulted(element, "")?;
            let is_active = read.word("active", &SWITCH)?.unwrap_or(true) && self.flags.ties;
            self.notes.soft();
            let tie = match &*element.tag {
                _ if !is_active => continue,
                "connect" => self.connected(&read)?,
                "weld" => self.welded(&read)?,
                "joint" => {
                    self.tie_joints(element)?;
                    continue;
                }
                "tendon" => {
                    self.tie_tendons(element, tendons)?;
                    continue;
                }
                _ => return Err(element.wrong("this equality constraint is not supported")),
            };
            self.robot.ties.push(tie);
        }
        Ok(())
    }

    /// Indices of both links of a constraint. Without a second body it is link 0, the world.
    fn tied(&self, read: &Defaulted<'_>) -> Parsed<[usize; 2]> {
        let element = read.element();
        if read.get("site1").is_some() || read.get("site2").is_some() {
            return Err(element
                .wrong("equality constraints of sites are not supported; use body1 and body2"));
        }
        let first = self.link(element, "body1", read.needed("body1")?)?;
        let second = read.get("body2").map(|name| self.link(element, "body2", name));
        Ok([first, second.transpose()?.unwrap_or(0)])
    }

    /// Reads `<connect>`: a common point of two links.
    fn connected(&self, read: &Defaulted<'_>) -> Parsed<RobotTie> {
        read.refuse_others(TIED, "solimp")?;
        let anchor = read.exactly::<3>("anchor")?;
        let anchor = anchor.ok_or_else(|| read.element().wrong("anchor is needed"))?;
        let links = self.tied(read)?;
        Ok(RobotTie::Point { links, anchor: anchor.into(), at: read.element().at() })
    }

    /// Reads `<weld>`: a fixed relative pose of two links.
    fn welded(&self, read: &Defaulted<'_>) -> Parsed<RobotTie> {
        read.refuse_others(&format!("{TIED} relpose torquescale"), "solimp")?;
        let links = self.tied(read)?;
        // Pose of the second body in the first. Without it, or with a zero quaternion, the pose is
        // that of the reference configuration.
        let frame = match read.exactly::<7>("relpose")? {
            Some([x, y, z, q @ ..]) if q != [0.0; 4] => {
                let attitude = Vector4::from(q);
                if attitude.norm() <= 1e-12 {
                    return Err(read
                        .element()
                        .wrong("relpose: the length of its quaternion is zero"));
                }
                Some(LinkFrame { position: Vector3::new(x, y, z), attitude: attitude.normalize() })
            }
            _ => None,
        };
        Ok(RobotTie::Whole { links, frame, at: read.element().at() })
    }

    /// Reads `<joint>` in `<equality>`, with `polycoef` = (c₀, c₁, …) and the reference coordinates
    /// q₁₀ and q₂₀:
    ///
    /// ```text
    /// q₁ − q₁₀ = c₀ + c₁ (q₂ − q₂₀)
    /// ```
    ///
    /// Without a second joint, the first one is fixed at q₁₀ + c₀ by equal limits.
    fn tie_joints(&mut self, element: &Element) -> Parsed<()> {
        let find = |field: &str, name: &str| {
            let joint = self.joint(element, field, name)?;
            match self.robot.joints[joint].moves {
                Moves::Hinge | Moves::Slide => Ok(joint),
                Moves::Free | Moves::Ball => {
                    Err(element.wrong(format!("{field}: a hinge or a slide is needed")))
                }
            }
        };
        let first = find("joint1", element.needed("joint1")?)?;
        let second = element.get("joint2").map(|name| find("joint2", name)).transpose()?;
        let [constant, ratio] = coefficients(element, second.is_some())?;
        let reference = |joint: usize| self.robot.joints[joint].reference;
        let place = reference(first) + constant;
        let Some(second) = second else {
            self.robot.joints[first].range = Some([place; 2]);
            return Ok(());
        };
        let offset = place - ratio * reference(second);
        self.follow(element, [first, second], [ratio, offset])
    }

    /// Couples the first joint to the second: q₁ = `ratio` q₂ + `offset`.
    pub(super) fn follow(
        &mut self,
        element: &Element,
        joints: [usize; 2],
        [ratio, offset]: [f64; 2],
    ) -> Parsed<()> {
        if self.robot.follows.iter().any(|known| known.joints[0] == joints[0]) {
            let name = shown::line(&self.robot.joints[joints[0]].name);
            return Err(element
                .wrong(format!("{name:?} already follows another joint; only one is allowed")));
        }
        if [ratio, offset].into_iter().any(|number| !(-1e6..=1e6).contains(&number)) {
            return Err(element.wrong("polycoef: numbers from -1e6 to 1e6 are needed"));
        }
        self.robot.follows.push(MimicJoint { joints, ratio, offset, at: element.at() });
        Ok(())
    }

    /// Reads the keyframes: named sets of coordinates, velocities and controls.
    pub(super) fn read_keys(&mut self, section: &Element) -> Parsed<()> {
        let (positions, rates) = self.robot.counts();
        for key in section.all("key") {
            key.refuse_others("name time qpos qvel act ctrl mpos mquat", "")?;
            let numbers = |field: &str, count: usize| match key.numbers(field)? {
                Some(all) if all.len() != count => {
                    let given = all.len();
                    Err(key
                        .wrong(format!("{field}: {given} numbers are given; {count} are needed")))
                }
                all => Ok(all),
            };
            let index = self.robot.keys.len();
            self.robot.keys.push(Key {
                name: key.own("name").map_or(format!("key-{index}"), str::to_owned),
                positions: numbers("qpos", positions)?,
                rates: numbers("qvel", rates)?,
                controls: numbers("ctrl", self.robot.actuators.len())?,
            });
        }
        Ok(())
    }
}
