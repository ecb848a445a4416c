//! `<actuator>`: motors of hinges and slides.

use super::MjcfReader;
use super::defaults::Defaulted;
use super::tendons::{self, Tendon};
use crate::model::{Actuator, Moves};
use crate::xml::{Attributes, Element, Parsed};

/// Attributes of every kind of actuator.
const READ: &str = "\
    name class group ctrllimited forcelimited ctrlrange forcerange gear joint jointinparent \
    tendon site refsite body slidersite cranksite cranklength actlimited actrange user";

impl MjcfReader<'_> {
    pub(super) fn read_actuators(
        &mut self,
        section: &Element,
        tendons: &mut [Tendon],
    ) -> Parsed<()> {
        for element in &section.children {
            let read = self.defaulted(element, "")?;
            // Force gain u + b₀ + b₁ q + b₂ q̇
            let (gain, mut bias) = match &*element.tag {
                "motor" => (1.0, [0.0; 3]),
                "position" => position(&read)?,
                "pid" => {
                    let why = "an integral term is not supported; leave it out";
                    read.refuse_unless_zero(0, &[("ki", why)])?;
                    position(&read)?
                }
                "velocity" => {
                    let kv = first(&read, "kv", 1.0)?;
                    (kv, [0.0, 0.0, -kv])
                }
                "general" => general(&read)?,
                _ => {
                    return Err(element.wrong(
                        "this actuator is not supported; use motor, position, velocity, pid or general",
                    ));
                }
            };
            // Fields of each kind
            let is_position = matches!(&*element.tag, "position" | "pid");
            let own = match &*element.tag {
                "position" => "kp kv dampratio timeconst inheritrange",
                "pid" => "kp kv ki dampratio inheritrange",
                "velocity" => "kv",
                "general" => "dyntype gaintype biastype dynprm gainprm biasprm actdim actearly",
                _ => "",
            };
            read.refuse_others(&format!("{READ} {own}"), "lengthrange nsample interp")?;
            // Joint, or joints of a tendon
            let (tendon, joints) = match read.get("tendon") {
                Some(name) => {
                    let (place, joints) = tendons::find(tendons, element, "tendon", name)?;
                    (Some(place), joints.to_vec())
                }
                None => (None, vec![(self.driven(&read)?, 1.0)]),
            };
            if joints.is_empty() {
                return Err(
                    element.wrong("tendon: it has no joint, so the actuator drives nothing")
                );
            }
            // A force by position or speed along a tendon acts on the sum of two joints.
            let depends = tendon.filter(|_| joints.len() > 1 && (bias[1], bias[2]) != (0.0, 0.0));
            if depends.is_some() && joints.len() > 2 {
                return Err(element.wrong(
                    "tendon: actuators of more than two joints with a force that depends on \
                     position or speed are not supported",
                ));
            }
            let gear = read.numbers("gear")?.and_then(|all| all.first().copied()).unwrap_or(1.0);
            if !(1e-9..=1e9).contains(&gear.abs()) {
                return Err(element
                    .wrong(format!("gear is {gear:?}; allowed: 1e-9 to 1e9, or -1e9 to -1e-9")));
            }
            let ratio = read.number("dampratio")?.filter(|_| is_position);
            if let Some(ratio) = ratio.filter(|ratio| *ratio > 0.0) {
                // Effective mass M and gear g: d = 2 ζ √(k M/g²).
                let moved = self.moved_alone()?;
                let mass: f64 =
                    joints.iter().map(|(joint, by)| moved[*joint] / (by * gear).powi(2)).sum();
                bias[2] = -2.0 * ratio * (gain * mass).sqrt();
            }
            // Range of the control, or that of the joint scaled by `inheritrange`
            let mut control_range = self.compiler.range(&read, "ctrlrange", "ctrllimited")?;
            let inherited = read.number("inheritrange")?.unwrap_or(0.0);
            if inherited > 0.0 && is_position && control_range.is_none() {
                let [low, high] = match joints[..] {
                    [(joint, 1.0)] => self.robot.joints[joint].range,
                    _ => None,
                }
                .ok_or_else(|| element.wrong("inheritrange: the joint has no range"))?;
                let middle = 0.5 * (low + high);
                let half = 0.5 * (high - low) * inherited;
                control_range = Some([middle - half, middle + half]);
            }
            // Without actuators the file is still checked.
            if !self.flags.actuators {
                continue;
            }
            let sum = depends.and_then(|place| self.sum_of(&mut tendons[place]));
            let index = self.robot.actuators.len();
            self.robot.actuators.push(Actuator {
                name: element.own("name").map_or(format!("actuator-{index}"), str::to_owned),
                joints,
                sum,
                gear,
                gain,
                bias,
                control_range: control_range.filter(|_| self.flags.clamps),
                force_range: self.compiler.range(&read, "forcerange", "forcelimited")?,
                at: element.at(),
            });
        }
        Ok(())
    }

    /// Hinge or slide that an actuator drives.
    fn driven(&self, read: &Defaulted<'_>) -> Parsed<usize> {
        let element = read.element();
        let Some(joint) = read.get("joint").or(read.get("jointinparent")) else {
            return Err(element.wrong(
                "only actuators of joints and of tendons of joints are supported; give joint",
            ));
        };
        let joint = self.joint(element, "joint", joint)?;
        match self.robot.joints[joint].moves {
            Moves::Hinge | Moves::Slide => Ok(joint),
            Moves::Ball | Moves::Free => {
                Err(element.wrong("joint: actuators of balls and free joints are not supported"))
            }
        }
    }
}

/// Parameter of an actuator shortcut: the attribute itself, else the first number of `gainprm`.
fn first(read: &Defaulted<'_>, field: &str, usual: f64) -> Parsed<f64> {
    if let Some(given) = read.number(field)? {
        return Ok(given);
    }
    let gain = read.numbers("gainprm")?;
    Ok(gain.and_then(|all| all.first().copied()).unwrap_or(usual))
}

/// Gain and bias of kp (u − x) − kv ẋ.
fn position(read: &Defaulted<'_>) -> Parsed<(f64, [f64; 3])> {
    if read.number("timeconst")?.unwrap_or(0.0) != 0.0 {
        return Err(read.element().wrong("timeconst is not supported; give kp and kv"));
    }
    let kp = first(read, "kp", 1.0)?;
    let kv = read.number("kv")?.unwrap_or(0.0);
    if read.number("dampratio")?.unwrap_or(0.0) > 0.0 && kv != 0.0 {
        return Err(read.element().wrong("dampratio: kv is also given; leave one out"));
    }
    Ok((kp, [0.0, -kp, -kv]))
}

/// Gain and bias of a stateless `<general>` actuator with fixed gain and affine bias.
fn general(read: &Defaulted<'_>) -> Parsed<(f64, [f64; 3])> {
    let only = |field: &str, allowed: &[&str]| match read.get(field).map(str::trim) {
        Some(given) if !allowed.contains(&given) => {
            let allowed = allowed.join(" or ");
            Err(read.element().wrong(format!("{field}: only {allowed} is supported")))
        }
        _ => Ok(()),
    };
    only("dyntype", &["none"])?;
    only("gaintype", &["fixed"])?;
    only("biastype", &["none", "affine"])?;
    let gain = read.numbers("gainprm")?.and_then(|all| all.first().copied()).unwrap_or(1.0);
    let mut bias = [0.0; 3];
    if read.get("biastype").map(str::trim) == Some("affine") {
        for (to, from) in bias.iter_mut().zip(read.numbers("biasprm")?.unwrap_or_default()) {
            *to = from;
        }
    }
    Ok((gain, bias))
}
