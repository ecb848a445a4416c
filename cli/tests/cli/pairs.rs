//! `tumble verify` accepts runs of all pairs of shapes, and no step of them makes energy.

use super::scenario::run_scenario;
use super::support::{Table, run};
use rand_mt::Mt;
use std::fmt::Write;
use std::fs;

pub struct Draws(pub Mt);

impl Draws {
    /// Number from `low` to `high`.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * f64::from(self.0.next_u32()) / f64::from(u32::MAX)
    }

    /// List of `count` numbers up to `size`.
    pub fn list(&mut self, count: usize, size: f64) -> Vec<f64> {
        (0..count).map(|_| self.between(-size, size)).collect()
    }
}

/// Shapes in the notation of a scene, with drawn sizes.
pub const SHAPES: [&str; 8] =
    ["box", "sphere", "capsule", "cylinder", "cone", "hull", "rounded hull", "ellipsoid"];

pub fn shape(name: &str, draws: &mut Draws) -> String {
    let mut sizes = || [(); 3].map(|()| draws.between(0.05, 0.15));
    let [a, b, c] = sizes();
    let mut corners = |count: usize| (0..count).map(|_| draws.list(3, 0.15)).collect::<Vec<_>>();
    match name {
        "box" => format!("box = [{}, {}, {}]", 2.0 * a, 2.0 * b, 2.0 * c),
        "sphere" => format!("sphere = {a}"),
        "capsule" => format!("capsule = {{ length = {}, radius = {b} }}", 2.0 * a),
        "cylinder" => format!("cylinder = {{ length = {}, radius = {b} }}", 2.0 * a),
        "cone" => format!("cone = {{ height = {}, radius = {b} }}", 2.0 * a),
        "hull" => format!("hull = {:?}", corners(8)),
        "rounded hull" => format!("hull = {:?}\nradius = 0.02", corners(6)),
        _ => format!("ellipsoid = [{a}, {b}, {c}]"),
    }
}

/// Two bodies that a force of 20 N presses together after an impact.
fn pair(first: &str, second: &str, draws: &mut Draws) -> String {
    let way = draws.list(3, 1.0);
    let length = way.iter().map(|x| x * x).sum::<f64>().sqrt().max(0.1);
    let along = |by: f64| way.iter().map(|x| by * x / length).collect::<Vec<_>>();
    let (speed, friction) = (draws.between(1.0, 6.0), draws.between(-0.3, 0.9).max(0.0));
    let mut text = format!(
        "steps = 90\ntime_step = 0.002\ngravity = 0\n[ground]\nnone = true\nfriction = {friction}\n"
    );
    for (name, place, velocity, force) in [
        (first, along(0.6), along(-speed), along(-20.0)),
        (second, along(0.0), along(0.0), along(20.0)),
    ] {
        let (shape, attitude) = (shape(name, draws), draws.list(4, 1.0));
        let spin = draws.list(3, 5.0);
        let _ = write!(
            text,
            "[[bodies]]\n{shape}\nmass = 1.0\nposition = {place:?}\nattitude = {attitude:?}\n\
             velocity = {velocity:?}\nspin = {spin:?}\nload = {{ force = {force:?} }}\n"
        );
    }
    text
}

/// Runs and verifies all pairs in `attitudes` attitudes each.
fn check_pairs(attitudes: u32) {
    let mut draws = Draws(Mt::new(68));
    let (mut wrong, mut steps, mut contact) = (Vec::new(), 0, 0);
    let (mut failed, mut misplaced) = (0, 0);
    for (at, first) in SHAPES.iter().enumerate() {
        for second in &SHAPES[at..] {
            for number in 0..attitudes {
                let text = pair(first, second, &mut draws);
                let (end, directory) = run_scenario(&text, &[]);
                let out = directory.path().join("out");
                let name = format!("{first} and {second}, {number}");
                if !matches!(end.code, Some(0 | 3)) {
                    wrong.push(format!("{name}: {end:?}\n{text}"));
                    continue;
                }
                let table = Table::parse(&fs::read_to_string(out.join("steps.csv")).unwrap());
                let column = table.column("status");
                let status: Vec<_> = table.rows.iter().map(|row| row[column].as_str()).collect();
                steps += status.len();
                let count = |of: &str| status.iter().filter(|status| **status == of).count();
                contact += status.len() - count("free");
                failed += count("failed");
                let placement = table.numbers("placement_m");
                misplaced += placement.iter().filter(|error| **error != 0.0).count();
                // Failed and wild steps are in the exit code of `verify`, too.
                let end = run(&["verify", out.join("states.csv").to_str().unwrap()]);
                let differs = !end.stdout.contains("steps that differ from their rows: 0\n");
                if differs || end.code != Some(0) && count("failed") + count("wild") == 0 {
                    wrong.push(format!("{name}: {end:?}\n{text}"));
                }
            }
        }
    }
    assert!(contact > steps / 5, "{contact} of {steps}");
    assert!(1000 * failed <= steps, "{failed} of {steps}");
    // A plane stops an edge also beside a face, up to the way of a step before the pieces meet.
    assert!(1000 * misplaced <= contact, "{misplaced} of {contact}");
    assert!(wrong.is_empty(), "{} wrong: {}", wrong.len(), wrong.join("\n"));
}

#[test]
fn runs_of_all_pairs_of_shapes_are_accepted() {
    check_pairs(1);
}

#[test]
#[ignore = "campaign"]
fn runs_of_all_pairs_of_shapes_in_eight_attitudes_are_accepted() {
    check_pairs(8);
}
