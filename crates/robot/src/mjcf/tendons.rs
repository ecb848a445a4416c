//! `<tendon>`: linear combinations of coordinates for actuators and equality constraints.

use super::MjcfReader;
use super::defaults::Defaulted;
use crate::model::{MimicJoint, Moves, TieForces};
use crate::xml::{Attributes, Element, Parsed};
use tumble_core::joint::Drive;
use tumble_model::shown;

/// A tendon. `joints` holds the joints of a fixed tendon with their coefficients.
pub struct Tendon {
    name: Option<String>,
    joints: Option<Vec<(usize, f64)>>,
    /// Index of its forces in the robot's `sums`.
    sum: Option<usize>,
    at: String,
}

/// Linear combination of coordinates: joint indices and coefficients.
type Summands = [(usize, f64)];

/// Index and joints of the fixed tendon with this name.
pub fn find<'t>(
    tendons: &'t [Tendon],
    element: &Element,
    field: &str,
    name: &str,
) -> Parsed<(usize, &'t Summands)> {
    let found = tendons.iter().position(|tendon| tendon.name.as_deref() == Some(name));
    let name = shown::line(name);
    match found.map(|place| (place, tendons[place].joints.as_deref())) {
        Some((place, Some(joints))) => Ok((place, joints)),
        Some((_, None)) => Err(element.wrong(format!(
            "{field}: {name:?} is a spatial tendon, which has no effect here; use a fixed tendon"
        ))),
        None => Err(element.wrong(format!("{field}: there is no tendon {name:?}"))),
    }
}

/// Passive forces of a tendon along its length.
struct TendonPull {
    stiffness: f64,
    damping: f64,
    friction: f64,
    rest: f64,
}

impl TendonPull {
    /// First nonzero field.
    fn first(&self) -> Option<&'static str> {
        let given = [
            ("stiffness", self.stiffness),
            ("damping", self.damping),
            ("frictionloss", self.friction),
        ];
        given.into_iter().find(|(_, value)| *value != 0.0).map(|(field, _)| field)
    }

    /// Equivalent drive along a coordinate, with length = `by` × coordinate.
    fn along(&self, by: f64) -> Drive {
        let square = by * by;
        Drive {
            friction: self.friction * by.abs(),
            stiffness: self.stiffness * square,
            rest: self.rest / by,
            damping: self.damping * square,
            ..Drive::NONE
        }
    }
}

/// Sorts two numbers.
fn sorted([a, b]: [f64; 2]) -> [f64; 2] {
    [a.min(b), a.max(b)]
}

impl MjcfReader<'_> {
    /// Reads all tendons. Passive forces and limits are supported on two joints. On one joint only
    /// a limit is supported. Others are rejected.
    pub(super) fn read_tendons(&mut self, root: &Element) -> Parsed<Vec<Tendon>> {
        let mut tendons = Vec::new();
        for element in root.all("tendon").flat_map(|section| &section.children) {
            let read = self.defaulted(element, "")?;
            if read.number("armature")?.is_some_and(|armature| armature != 0.0) {
                return Err(element.wrong("armature of tendons is not supported"));
            }
            let joints = (element.tag == "fixed").then(|| self.summed(element)).transpose()?;
            let range = self.compiler.range(&read, "range", "limited")?;
            let range = range.filter(|_| self.flags.limits);
            let effort = self.compiler.range(&read, "actuatorfrcrange", "actuatorfrclimited")?;
            if effort.is_some() {
                return Err(element.wrong("actuatorfrcrange of tendons is not supported"));
            }
            let pull = self.pull(&read, joints.as_deref().unwrap_or_default())?;
            let refused = |what: &str| {
                let field = match (range, pull.first()) {
                    (_, Some(field)) => field,
                    (Some(_), None) => "range",
                    (None, None) => return Ok(()),
                };
                Err(element.wrong(format!("{field}: {what}")))
            };
            let mut sum = None;
            // Two joints: a drive of their sum. One joint: its limit.
            match (joints.as_deref(), range) {
                (Some(&[first, second]), range) => {
                    if range.is_some() || pull.first().is_some() {
                        let by = first.1;
                        // The sum is a (q₁ + (b/a) q₂): its limits are divided by a.
                        let limits = range.map(|range| sorted(range.map(|end| end / by)));
                        let drive = Drive { limits, ..pull.along(by) };
                        sum = Some(self.add_sum([first, second], drive, element.at()));
                    }
                }
                (Some(&[(joint, factor)]), Some(range)) if pull.first().is_none() => {
                    self.limit(element, joint, range.map(|end| end / factor))?;
                }
                (Some(_), _) => refused(
                    "tendons with forces or limits are supported only for two joints; for one \
                     joint, set them on the joint itself",
                )?,
                (None, _) => {
                    refused("spatial tendons with forces or limits are not supported")?;
                    self.notes.idle("tendon without forces");
                }
            }
            let name = element.own("name").map(str::to_owned);
            let at = element.at();
            tendons.push(Tendon { name, joints, sum, at });
        }
        Ok(tendons)
    }

    /// Adds forces on a combination of two coordinates, divided by the first coefficient. Returns
    /// its index.
    fn add_sum(&mut self, joints: [(usize, f64); 2], drive: Drive, at: String) -> usize {
        let [(first, by), (second, other)] = joints;
        let of = MimicJoint { joints: [first, second], ratio: -other / by, offset: 0.0, at };
        self.robot.sums.push(TieForces { of, drive });
        self.robot.sums.len() - 1
    }

    /// Index of the combination for a tendon of two joints, and ratio of the tendon's length to it.
    /// Adds one if necessary. `None` for other tendons.
    pub(super) fn sum_of(&mut self, tendon: &mut Tendon) -> Option<(usize, f64)> {
        let [first, second] = tendon.joints.as_deref()?[..] else { return None };
        let joints = [first, second];
        let new = || self.add_sum(joints, Drive::NONE, tendon.at.clone());
        let index = tendon.sum.unwrap_or_else(new);
        tendon.sum = Some(index);
        Some((index, first.1))
    }

    /// Passive forces of a tendon of these joints.
    fn pull(&self, read: &Defaulted<'_>, joints: &Summands) -> Parsed<TendonPull> {
        let number = |field: &str, acts: bool| {
            let value = read.number(field)?.unwrap_or(0.0);
            if (0.0..=1e12).contains(&value) {
                Ok(if acts { value } else { 0.0 })
            } else {
                Err(read
                    .element()
                    .wrong(format!("{field} is {value:?}; allowed: one number from 0 to 1e12")))
            }
        };
        let stiffness = number("stiffness", self.flags.springs)?;
        let damping = number("damping", self.flags.dampers)?;
        let friction = number("frictionloss", self.flags.friction)?;
        // Default: the length with the springs of its joints relaxed.
        let slack = || joints.iter().map(|(joint, by)| by * self.robot.joints[*joint].rest).sum();
        let rest = match read.numbers("springlength")?.as_deref() {
            None | Some([] | [-1.0] | [-1.0, -1.0]) => slack(),
            Some([rest]) => *rest,
            Some([low, high]) if low == high || stiffness == 0.0 => *low,
            Some(_) => {
                let why = "springlength: a slack range is not supported; give one number";
                return Err(read.element().wrong(why));
            }
        };
        Ok(TendonPull { stiffness, damping, friction, rest })
    }

    /// Joints and coefficients of a fixed tendon.
    fn summed(&self, element: &Element) -> Parsed<Vec<(usize, f64)>> {
        let mut joints: Vec<(usize, f64)> = Vec::new();
        for part in &element.children {
            if part.tag != "joint" {
                return Err(part.wrong("this element is unknown in a fixed tendon"));
            }
            let joint = self.joint(part, "joint", part.needed("joint")?)?;
            part.needed("coef")?;
            let factor = part.bounded("coef", 0.0, [-1e6, 1e6])?;
            if !matches!(self.robot.joints[joint].moves, Moves::Hinge | Moves::Slide) {
                return Err(part.wrong("joint: a hinge or a slide is needed"));
            }
            if factor != 0.0 {
                match joints.iter_mut().find(|(known, _)| *known == joint) {
                    Some((_, sum)) => *sum += factor,
                    None => joints.push((joint, factor)),
                }
            }
        }
        joints.retain(|(_, factor)| *factor != 0.0);
        Ok(joints)
    }

    /// Restricts the range of a joint.
    fn limit(&mut self, element: &Element, joint: usize, [a, b]: [f64; 2]) -> Parsed<()> {
        let joint = &mut self.robot.joints[joint];
        let [low, high] = joint.range.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
        let within = [a.min(b).max(low), a.max(b).min(high)];
        if within[0] > within[1] {
            let name = shown::line(&joint.name);
            return Err(element.wrong(format!("range: it does not overlap the range of {name:?}")));
        }
        joint.range = Some(within);
        Ok(())
    }

    /// Couples a tendon to another one or fixes it. In lengths relative to those at the references:
    ///
    /// ```text
    /// L₁ − L₁₀ = c₀ + c₁ (L₂ − L₂₀),   L = Σ f q
    /// ```
    pub(super) fn tie_tendons(&mut self, element: &Element, tendons: &[Tendon]) -> Parsed<()> {
        let [constant, ratio] = coefficients(element, element.get("tendon2").is_some())?;
        let (_, own) = find(tendons, element, "tendon1", element.needed("tendon1")?)?;
        let other = element.get("tendon2").map(|name| find(tendons, element, "tendon2", name));
        let mut sum = own.to_vec();
        for (joint, factor) in other.transpose()?.map(|(_, joints)| joints).unwrap_or_default() {
            match sum.iter_mut().find(|(known, _)| known == joint) {
                Some((_, sum)) => *sum -= ratio * factor,
                None => sum.push((*joint, -ratio * factor)),
            }
        }
        sum.retain(|(_, factor)| *factor != 0.0);
        let reference = |joint: usize| self.robot.joints[joint].reference;
        let follows =
            |joint: usize| self.robot.follows.iter().any(|known| known.joints[0] == joint);
        // The first joint depends on the second, unless it already depends on another.
        if let [(first, _), (second, _)] = sum[..]
            && follows(first)
            && !follows(second)
        {
            sum.swap(0, 1);
        }
        match sum[..] {
            [(joint, factor)] => {
                let place = reference(joint) + constant / factor;
                self.limit(element, joint, [place; 2])
            }
            [(first, factor), (second, by)] => {
                let ratio = -by / factor;
                let offset = reference(first) + constant / factor - ratio * reference(second);
                self.follow(element, [first, second], [ratio, offset])
            }
            _ => Err(element.wrong(
                "tendon1: equality constraints of more than two joints, or of none, are not \
                 supported",
            )),
        }
    }
}

/// Constant and ratio of `polycoef`. Higher terms are rejected if the constraint `goes` with
/// another joint or tendon.
pub(super) fn coefficients(element: &Element, goes: bool) -> Parsed<[f64; 2]> {
    let given = element.numbers("polycoef")?.unwrap_or_default();
    if given.len() > 5 {
        return Err(element.wrong("polycoef: up to 5 numbers are needed"));
    }
    let mut all = [0.0, 1.0, 0.0, 0.0, 0.0];
    all[..given.len()].copy_from_slice(&given);
    let [constant, ratio, higher @ ..] = all;
    if goes && higher != [0.0; 3] {
        return Err(element.wrong(
            "polycoef: nonlinear relations between joints are not supported; the last three \
             numbers must be 0",
        ));
    }
    Ok([constant, ratio])
}
