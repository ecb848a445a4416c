//! Passive mechanisms: joints with stops and dry friction, and contacts, make no energy.

use crate::common::prelude::*;
use crate::energy::{self, PassiveSteps};
use std::fmt::Write as _;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tumble_core::mechanics::quaternion::product;

/// Two capsules with a cone between them, which falls onto ice.
const CAPSULES: &str = include_str!("../../cli/tests/cli/hard/cone31.toml");
/// A cone of 6 g at the cone's stop of an ellipsoid of 57 kg. A light box hangs on it by a gimbal.
const LIGHT_CONE: &str = include_str!("scenes/light-cone-at-a-stop.toml");
/// A cylinder and a cone on an ellipsoid that falls onto the ground.
const CONE_STOP: &str = include_str!("scenes/cone-stop-on-the-ground.toml");
/// A thrown capsule that meets the edge of a fixed box.
const CAPSULE: &str = include_str!("scenes/capsule-on-an-edge.toml");

#[test]
fn a_capsule_on_an_edge_gains_nothing() {
    let mut found = PassiveSteps::default();
    for h in [4.0, 2.0, 1.0, 0.5, 0.25] {
        let text = CAPSULE.replace("time_step = 0.004", &format!("time_step = {}", h * 1e-3));
        found.run(&format!("{h} ms"), &text, (1000.0 / h) as usize);
    }
    println!("{found}");
    assert!(found.gains.is_empty(), "{found}");
    assert!(found.failed.is_empty(), "{found}");
}

#[test]
fn cones_stop_without_making_energy() {
    for (name, text, steps, most_failed) in
        [("capsules", CAPSULES, 240, 0), ("light", LIGHT_CONE, 400, 0), ("stop", CONE_STOP, 666, 0)]
    {
        let mut found = PassiveSteps::default();
        found.run(name, text, steps);
        println!("{found}");
        assert!(found.gains.is_empty(), "{found}");
        assert!(found.failed.len() <= most_failed, "{found}");
    }
}

/// A ball without weight whose arm circles along its cone at 4 rad/s. The stop takes 2 (h ψ̇ cos σ)² of its
/// energy in a step, and never gives any.
#[test]
fn an_arm_that_circles_along_its_cone_loses_energy_to_first_order() {
    let (rate, swing) = (4.0_f64, 0.6_f64);
    for h in [0.002, 0.001] {
        let (sin, cos) = swing.sin_cos();
        // The arm circles about z. Without spin about its own axis, ω is across both.
        let across = Vector3::new(0.0, rate * sin, 0.0);
        let along = Vector3::new(sin, 0.0, cos);
        let spin = along.cross(&across);
        let turned = turn(Vector3::y(), swing);
        let text = format!(
            "steps = 501\ntime_step = {h}\ngravity = 0\n[ground]\nnone = true\nfriction = 0\n[[bodies]]\n\
             name = \"ball\"\nsphere = 0.28\nmass = 1.0\nposition = {}\n\
             attitude = {:?}\nvelocity = {}\nspin = {}\n[[joints]]\ntype = \"ball\"\nbodies = \"ball\"\n\
             anchor = [0, 0, 0]\naxis_a = [0, 0, 1]\naxis_b = [0, 0, 1]\ncone = {swing}\n",
            list(&(along * 0.3)),
            turned.data.0[0],
            list(&(spin.cross(&along) * 0.3)),
            list(&rotation(&turned).tr_mul(&spin)),
        );
        let scene = energy::scene(&text);
        let mut simulation = scene.simulation(&Arc::new(AtomicBool::new(false))).unwrap();
        let mut record = StepRecord::new();
        for k in 0..500 {
            simulation.step(&mut record).unwrap();
            let [before, after] = [record.states(), record.next_states()];
            let lengths = vec![scene.world.time_step(); scene.world.bodies().len()];
            let total = |states| energy::total(&scene.world, states, &lengths);
            let [before, after] = [before, after].map(total);
            let lost = (before - after) / before;
            let expected = 2.0 * (h * rate * cos).powi(2);
            // The rate falls, by the sum of the losses.
            if k > 10 {
                assert!(
                    lost > 0.8 * expected && lost < 1.1 * expected,
                    "{k}: {lost:e} {expected:e}"
                );
            }
        }
    }
}

/// Draws of a mechanism.
struct Mechanism {
    draws: Draws,
    text: String,
}

fn turn(axis: Vector3<f64>, angle: f64) -> Vector4<f64> {
    let (sin, cos) = (0.5 * angle).sin_cos();
    let v = axis.normalize() * sin;
    Vector4::new(cos, v[0], v[1], v[2])
}

impl Mechanism {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.draws.unit()
    }

    fn direction(&mut self) -> Vector3<f64> {
        rotation(&self.draws.attitude()) * Vector3::z()
    }

    /// One of `count` numbers.
    fn pick(&mut self, count: usize) -> usize {
        (self.draws.unit() * count as f64) as usize
    }

    fn shape(&mut self) -> String {
        let [a, b, c] = [0.03, 0.02, 0.02].map(|least| self.between(least, 3.0 * least));
        match self.pick(6) {
            0 => format!("sphere = {a}"),
            1 => format!("box = [{}, {}, {}]", 2.0 * a, 2.0 * b, 2.0 * c),
            2 => format!("capsule = {{ length = {}, radius = {b} }}", 2.0 * a),
            3 => format!("cylinder = {{ length = {}, radius = {b} }}", 2.0 * a),
            4 => format!("cone = {{ height = {}, radius = {b} }}", 2.0 * a),
            _ => format!("ellipsoid = [{a}, {b}, {c}]"),
        }
    }

    /// Passive drive of an axis with a range in m or rad.
    fn drive(&mut self, range: f64) -> String {
        let mut all = Vec::new();
        if self.pick(3) > 0 {
            let [low, high] = [-self.between(0.1, 1.0), self.between(0.1, 1.0)];
            all.push(format!("limits = [{}, {}]", low * range, high * range));
        }
        if self.pick(3) == 0 {
            all.push(format!("friction = {}", self.between(0.01, 1.0) * range));
        }
        if self.pick(3) == 0 {
            all.push(format!("damping = {}", self.between(0.001, 0.1) * range));
        }
        all.join(", ")
    }

    /// Type of a joint with its drives.
    fn joint(&mut self) -> String {
        let cone = self.between(0.1, 2.0);
        let table = |name: &str, drive: String| {
            if drive.is_empty() { String::new() } else { format!("{name} = {{ {drive} }}\n") }
        };
        let lines =
            |drive: String| drive.replace(", ", "\n").replace("\n-", ", -").replace("\n0", ", 0");
        match self.pick(10) {
            0 | 1 => format!("type = \"ball\"\ncone = {cone}\n{}\n", lines(self.drive(1.0))),
            2 => format!("type = \"revolute\"\n{}\n", lines(self.drive(1.0))),
            3 => format!("type = \"prismatic\"\n{}\n", lines(self.drive(0.05))),
            4 => {
                let (slide, turned) = (self.drive(0.05), self.drive(1.0));
                format!(
                    "type = \"cylindrical\"\n{}{}",
                    table("slide", slide),
                    table("turn", turned)
                )
            }
            5 => {
                let [x, y] = [0.05, 0.05].map(|range| self.drive(range));
                format!("type = \"planar\"\n{}{}", table("x", x), table("y", y))
            }
            6 => "type = \"spherical\"\n".to_owned(),
            7 => {
                let [x, y] = [1.0, 1.0].map(|range| self.drive(range));
                format!("type = \"universal\"\n{}{}", table("turn_x", x), table("turn_y", y))
            }
            8 => {
                let [x, y, z] = [1.0, 1.0, 1.0].map(|range| self.drive(range));
                let [x, y] = [table("turn_x", x), table("turn_y", y)];
                format!("type = \"gimbal\"\n{x}{y}{}", table("turn_z", z))
            }
            _ => "type = \"fixed\"\n".to_owned(),
        }
    }

    /// Text of a tree of 2 to 5 bodies that moves as one rigid body at first. One of three hangs on
    /// the world, one of three has no ground.
    fn random(seed: u32) -> String {
        let mut own = Self { draws: Draws::new(seed), text: String::new() };
        let ground = if own.pick(3) == 0 { "none = true\n" } else { "" };
        let friction = own.between(0.0, 0.8);
        let h = [0.001, 0.002, 0.005][own.pick(3)];
        let count = 2 + own.pick(4);
        let hangs = own.pick(3) == 0;
        own.text =
            format!("steps = 401\ntime_step = {h}\n[ground]\n{ground}friction = {friction}\n");
        let (velocity, spin) = if hangs {
            (Vector3::zeros(), Vector3::zeros())
        } else {
            (own.direction() * own.between(0.0, 3.0), own.direction() * own.between(0.0, 10.0))
        };
        let mut places: Vec<Vector3<f64>> = Vec::new();
        let mut joints = String::new();
        for body in 0..count {
            let parent = own.pick(body.max(1));
            let place = match body {
                0 => Vector3::new(0.0, 0.0, 1.0),
                _ => places[parent] + own.direction() * own.between(0.1, 0.3),
            };
            let attitude = own.draws.attitude();
            let shape = own.shape();
            let mass = 10_f64.powf(own.between(-2.0, 1.0));
            let turned = rotation(&attitude).tr_mul(&spin);
            let moved = velocity + spin.cross(&(place - Vector3::new(0.0, 0.0, 1.0)));
            let _ = write!(
                own.text,
                "[[bodies]]\nname = \"b{body}\"\n{shape}\nmass = {mass}\nposition = {}\n\
                 attitude = {:?}\nvelocity = {}\nspin = {}\n",
                list(&place),
                attitude.data.0[0],
                list(&moved),
                list(&turned)
            );
            places.push(place);
            if body > 0 || hangs {
                let anchor = match body {
                    0 => place + own.direction() * 0.1,
                    _ => 0.5 * (place + places[parent]),
                };
                let frame = product(&turn(own.direction(), 1.0), &own.draws.attitude());
                let kind = own.joint();
                let others = if body > 0 {
                    format!("[\"b{body}\", \"b{parent}\"]")
                } else {
                    "\"b0\"".to_owned()
                };
                let _ = write!(
                    joints,
                    "[[joints]]\nbodies = {others}\nanchor = {}\nattitude = {:?}\n{kind}",
                    list(&anchor),
                    frame.data.0[0]
                );
            }
        }
        own.text += &joints;
        for body in 0..count {
            for other in 0..body {
                let _ = write!(own.text, "[[apart]]\nbetween = [\"b{body}\", \"b{other}\"]\n");
            }
        }
        own.text
    }
}

fn list(v: &Vector3<f64>) -> String {
    format!("{:?}", v.data.0[0])
}

/// Examines 400 steps of each of these mechanisms.
fn examine(seeds: std::ops::Range<u32>) -> PassiveSteps {
    let mut found = PassiveSteps::default();
    for seed in seeds {
        found.run(&format!("seed {seed}"), &Mechanism::random(seed), 400);
    }
    println!("{found}");
    assert!(found.gains.is_empty(), "{found}");
    assert!(found.inexact.is_empty(), "{found}");
    assert!(found.failed.len() * 1000 <= found.steps, "{found}");
    found
}

#[test]
fn random_mechanisms_make_no_energy() {
    examine(0..20);
}

/// A slide holds at its stop while its anchors rotate. The work of its stop must not hide a gain of the
/// step.
#[test]
fn slide_that_holds_at_its_stop_makes_no_energy() {
    examine(66..67);
}

#[test]
#[ignore = "slow"]
fn three_hundred_random_mechanisms_make_no_energy() {
    examine(0..300);
}
