//! Random runs with located impacts or an accuracy: they make no energy, and `verify` accepts them.

use super::pairs::{Draws, SHAPES, shape};
use super::scenario::run_scenario;
use super::support::{Table, run};
use rand_mt::Mt;
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

/// One of these values.
fn one<'a>(values: &[&'a str], draws: &mut Draws) -> &'a str {
    values[draws.between(0.0, values.len() as f64 - 1e-9) as usize]
}

/// A scene of one to five bodies of all shapes, some in joints, on the ground or on terrain.
fn scene(seed: u32, impacts: &str) -> String {
    let draws = &mut Draws(Mt::new(seed));
    let time_step = one(&["0.001", "0.002", "0.004"], draws);
    let mut text = format!("steps = 200\ntime_step = {time_step}\n{impacts}\n[ground]\n");
    text += one(&["friction = 0.0\n", "friction = 0.3\n", "friction = 0.8\n"], draws);
    text += one(
        &[
            "static_friction = 0.9\n",
            "rolling_friction = 0.004\n",
            "torsional_friction = 0.004\n",
            "restitution = 0.5\n",
            "",
            "",
            "",
        ],
        draws,
    );
    if draws.between(0.0, 1.0) < 0.15 {
        text += "none = true\n[[terrain]]\nname = \"hill\"\nspacing = 0.5\nheights = ";
        let heights = [(); 5].map(|()| [(); 5].map(|()| draws.between(0.0, 0.15)));
        let _ = writeln!(text, "{heights:?}");
    }
    let mut before = [0.0; 3];
    for body in 0..draws.between(1.0, 5.99) as u32 {
        let form = shape(one(&SHAPES, draws), draws);
        let place = draws.list(2, 0.25);
        let position = [place[0], place[1], 0.5 + 0.45 * f64::from(body)];
        let _ = writeln!(
            text,
            "[[bodies]]\nname = \"b{body}\"\n{form}\nmass = {}\nposition = {position:?}\n\
             attitude = {:?}\nvelocity = {:?}\nspin = {:?}",
            draws.between(0.2, 4.0),
            draws.list(4, 1.0),
            draws.list(3, 1.5),
            draws.list(3, 6.0),
        );
        if body > 0 && draws.between(0.0, 1.0) < 0.25 {
            let anchor = [0, 1, 2].map(|k| 0.5 * (position[k] + before[k]));
            let kind = one(&["spherical", "revolute", "prismatic"], draws);
            let axis = if kind == "spherical" {
                String::new()
            } else {
                format!("axis = {:?}\nlimits = [-0.4, 0.4]\n", draws.list(3, 1.0))
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

/// Runs `scene`. Returns the largest rise of the energy above both rows before in steps that are not marked, and
/// what `verify` says if it refuses the run. Rises count above 1e-5 J, relative to the energy that the run
/// loses. A row after an abrupt change lacks half of what gravity changes in an interval (37a), and the next row has it
/// again.
fn judge(scene: &str) -> (f64, Option<String>) {
    let (end, directory) = run_scenario(scene, &[]);
    assert!(matches!(end.code, Some(0 | 3)), "{end:?}\n{scene}");
    let out = directory.path().join("out");
    let steps = Table::parse(&fs::read_to_string(out.join("steps.csv")).unwrap());
    let energies = steps.numbers("energy_J");
    let statuses = steps.texts("status");
    let least = energies.iter().copied().fold(f64::INFINITY, f64::min);
    let scale = energies[0] - least;
    let rises = energies.windows(3).zip(&statuses[1..]);
    let rises = rises.filter(|(_, status)| !["wild", "failed"].contains(status));
    let rise = rises.map(|(rows, _)| rows[2] - rows[0].max(rows[1])).fold(0.0, f64::max);
    let verified = run(&["verify", out.join("states.csv").to_str().unwrap()]);
    let refused = (verified.code == Some(1)).then_some(verified.stdout);
    let rise = if rise > 1e-5 { (rise - 1e-5) / scale } else { 0.0 };
    (rise, refused)
}

/// Errors of the velocities of the instant are below 1 % at these time steps.
fn assert_sound(seeds: impl Iterator<Item = u32>, impacts: &str) {
    let judged = seeds.map(|seed| (seed, judge(&scene(seed, impacts))));
    let unsound: Vec<_> =
        judged.filter(|(_, (rise, refused))| *rise > 0.01 || refused.is_some()).collect();
    assert!(unsound.is_empty(), "{unsound:?}");
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
