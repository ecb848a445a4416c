//! Random runs with located impacts or an accuracy: they make no energy, and `verify` accepts them.

use super::scenario::run_scenario;
use super::support::{Table, run};
use std::fmt::Write;
use std::fs;

/// A cone and a box fall on the ground.
const CONE_AND_BOX: &str = r#"
steps = 113
time_step = 0.004
impacts = "located"
[ground]
friction = 0.2
[[bodies]]
name = "cone"
cone = { height = 0.0912260091648398, radius = 0.06831193097891194 }
mass = 4.2396323749351
position = [-0.28644164165060637, 0.26555158143442825, 0.7]
attitude = [-0.5888246427387959, -0.40958246748532395, -0.683729328801256, 0.13432031629335453]
velocity = [0.008023479872695756, 1.1525749226158035, -0.9029571957701399]
spin = [4.418393436346012, 4.060459602714559, 1.1414406046929844]
[[bodies]]
name = "box"
box = [0.1109688206879555, 0.09080154471162491, 0.16640480506185798]
mass = 2.7716028243522373
position = [0.6728168339178191, 0.04899123247554815, 1.15]
attitude = [0.15213503010225296, 0.6427135574015203, 0.7401054415459483, 0.12656283475865357]
velocity = [1.2409374825889696, 0.9108535522994426, -0.7217695815460334]
spin = [2.9324607435343584, 3.943054897480185, -1.17662616343445]
"#;

/// Random numbers of a scene, by SplitMix64.
struct Random(u64);

impl Random {
    /// Uniform in `low` to `high`.
    fn within(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut bits = self.0;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        bits ^= bits >> 31;
        low + (high - low) * ((bits >> 11) as f64 / (1_u64 << 53) as f64)
    }

    /// One of `count` numbers from 0.
    fn below(&mut self, count: u32) -> u32 {
        (self.within(0.0, f64::from(count)) as u32).min(count - 1)
    }

    /// Three numbers of at most `size`.
    fn vector(&mut self, size: f64) -> String {
        let [x, y, z] = [0; 3].map(|_| self.within(-size, size));
        format!("[{x}, {y}, {z}]")
    }
}

/// A scene of one to five bodies of all shapes, some in joints, on the ground or on terrain.
fn scene(seed: u64, impacts: &str) -> String {
    let mut random = Random(seed);
    let time_step = [0.001, 0.002, 0.004][random.below(3) as usize];
    let steps = (0.8 / time_step) as u32;
    let mut text = format!("steps = {steps}\ntime_step = {time_step}\n{impacts}\n[ground]\n");
    text += ["friction = 0.0\n", "friction = 0.3\n", "friction = 0.8\n"][random.below(3) as usize];
    match random.below(8) {
        0 => text += "static_friction = 0.9\n",
        1 => text += "rolling_friction = 0.004\n",
        2 => text += "torsional_friction = 0.004\n",
        3 => text += "restitution = 0.5\n",
        _ => {}
    }
    let has_terrain = random.below(6) == 0;
    if has_terrain {
        text += "none = true\n[[terrain]]\nname = \"hill\"\nspacing = 0.5\nheights = [";
        for row in 0..5 {
            let heights = [0; 5].map(|_| random.within(0.0, 0.15));
            let _ = write!(text, "{heights:?}{}", if row < 4 { ", " } else { "]\n" });
        }
    }
    let mut before = [0.0; 3];
    for body in 0..=random.below(5) {
        let mut size = || random.within(0.05, 0.16);
        let (a, b, c) = (size(), size(), size());
        let shape = match random.below(6) {
            0 => format!("sphere = {a}"),
            1 => format!("ellipsoid = [{a}, {b}, {c}]"),
            2 => format!("box = [{a}, {b}, {c}]"),
            3 => format!("cylinder = {{ length = {a}, radius = {b} }}"),
            4 => format!("cone = {{ height = {a}, radius = {b} }}"),
            _ => format!("capsule = {{ length = {a}, radius = {b} }}"),
        };
        let mut place = || random.within(-0.25, 0.25);
        let position = [place(), place(), 0.6 + 0.5 * f64::from(body)];
        let _ = write!(
            text,
            "[[bodies]]\nname = \"b{body}\"\n{shape}\nmass = {}\nposition = {position:?}\n\
             attitude = {{ axis = {}, degrees = {} }}\nvelocity = {}\nspin = {}\n",
            random.within(0.2, 4.0),
            random.vector(1.0),
            random.within(0.0, 180.0),
            random.vector(1.5),
            random.vector(6.0),
        );
        if body > 0 && random.below(4) == 0 {
            let anchor = [0, 1, 2].map(|k| 0.5 * (position[k] + before[k]));
            let (kind, axis) = match random.below(3) {
                0 => ("spherical", String::new()),
                1 => ("revolute", format!("axis = {}\nlimits = [-0.4, 0.4]\n", random.vector(1.0))),
                _ => ("prismatic", format!("axis = {}\n", random.vector(1.0))),
            };
            let bodies = [format!("b{body}"), format!("b{}", body - 1)];
            let _ = write!(
                text,
                "[[joints]]\nname = \"j{body}\"\ntype = \"{kind}\"\nbodies = {bodies:?}\n\
                 anchor = {anchor:?}\n{axis}"
            );
        }
        before = position;
    }
    text
}

/// Runs `scene`. Returns the largest rise of the energy from row to row in steps that are not marked, and
/// what `verify` says if it refuses the run. Rises count above 1e-5 J, relative to the energy that the run
/// loses.
fn judge(scene: &str) -> (f64, Option<String>) {
    let (end, directory) = run_scenario(scene, &[]);
    assert!(matches!(end.code, Some(0 | 3)), "{end:?}\n{scene}");
    let out = directory.path().join("out");
    let steps = Table::parse(&fs::read_to_string(out.join("steps.csv")).unwrap());
    let energies = steps.numbers("energy_J");
    let statuses = steps.texts("status");
    let least = energies.iter().copied().fold(f64::INFINITY, f64::min);
    let scale = energies[0] - least;
    let rises = energies.windows(2).zip(statuses);
    let rises = rises.filter(|(_, status)| !["wild", "failed"].contains(status));
    let rise = rises.map(|(pair, _)| pair[1] - pair[0]).fold(0.0, f64::max);
    let verified = run(&["verify", out.join("states.csv").to_str().unwrap()]);
    let refused = (verified.code == Some(1)).then_some(verified.stdout);
    ((rise - 1e-5).max(0.0) / scale, refused)
}

/// Errors of the velocities of the instant are below 1 % at these time steps.
fn assert_sound(seeds: impl Iterator<Item = u64>, impacts: &str) {
    for seed in seeds {
        let (rise, refused) = judge(&scene(seed, impacts));
        assert!(rise <= 0.01, "seed {seed} gains {rise}");
        assert!(refused.is_none(), "seed {seed}: {refused:?}");
    }
}

#[test]
fn a_cone_beside_a_box_makes_no_energy() {
    let (rise, refused) = judge(CONE_AND_BOX);
    assert!(rise <= 1e-4 && refused.is_none(), "{rise} {refused:?}");
}

#[test]
fn random_runs_with_located_impacts_make_no_energy() {
    assert_sound(0..4, "impacts = \"located\"");
}

#[test]
#[ignore = "slow"]
fn many_random_runs_with_located_impacts_make_no_energy() {
    assert_sound(100..180, "impacts = \"located\"");
}

#[test]
#[ignore = "slow"]
fn many_random_runs_with_an_accuracy_make_no_energy() {
    assert_sound(300..330, "accuracy = 1e-3");
}
