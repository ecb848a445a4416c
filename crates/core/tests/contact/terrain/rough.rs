//! Rough terrain: bodies of all shapes are thrown on random heights.

use super::*;
use tumble_core::contact::Candidates;

/// Random field of 40 × 40 cells of 0.1 m with heights up to `rough` (m).
fn rough_field(seed: u64, rough: f64) -> HeightField {
    let mut random = Mt64::new(seed);
    let heights = (0..41 * 41).map(|_| rough * uniform(&mut random)).collect();
    HeightField::new(heights, 41, [0.1; 2])
        .unwrap()
        .moved_by(&Matrix3::identity(), &V::new(-2.0, -2.0, 0.0))
        .unwrap()
}

/// Throws a body, and returns the numbers of failed and of wild steps. The body
/// stays above the terrain and gains no energy.
fn throw(name: &str, piece: &Piece, seed: u64, rough: f64, steps: usize) -> [usize; 2] {
    let mut random = Mt64::new(1000 + seed);
    let mut any = |size: f64| size * (2.0 * uniform(&mut random) - 1.0);
    let world = on_terrain(&empty(body(piece.clone()), 0.4), rough_field(seed, rough));
    let start = State {
        position: V::new(any(0.5), any(0.5), rough + 0.6),
        attitude: Vector4::new(any(1.0), any(1.0), any(1.0), any(1.0)).normalize(),
        velocity: V::new(any(1.0), any(1.0), any(1.0)),
        spin: V::new(any(5.0), any(5.0), any(5.0)),
    };
    let mut run = Simulation::new(world.clone(), [start], Motion::native(&world)).unwrap();
    let mut record = StepRecord::new();
    let (mut counts, mut before, mut energy) = ([0; 2], start, run.energy());
    for k in 0..steps {
        run.step(&mut record).unwrap();
        let state = record.next_states()[0];
        match record.status() {
            StepStatus::Failed => counts[0] += 1,
            StepStatus::Wild => counts[1] += 1,
            _ => {}
        }
        // Energy (35), which steps of any length conserve in free flight.
        let gained = run.energy() - std::mem::replace(&mut energy, run.energy());
        // Rolling from an edge onto a face leaves an overlap, and the next step ends it. A larger gain
        // is marked.
        let may = gained < 3e-3 || record.status() == StepStatus::Wild;
        let status = record.status();
        assert!(may, "{name}, seed {seed}, step {k}, {status}: {gained:e} J");
        assert!(state.position.z > 0.0, "{name}, seed {seed}, step {k}: below the terrain");
        before = state;
    }
    let overlap = Candidates::new().deepest_overlap(&world, &[before]);
    let depth = overlap.map_or(0.0, |(depth, ..)| depth);
    // The square of the rotation in a step, which the next step removes.
    assert!(depth < 1e-4, "{name}, seed {seed}: {depth:e} m deep at the end");
    counts
}

#[test]
fn bodies_come_to_rest_on_rough_ground() {
    let pieces = [
        ("ball", Piece::sphere(0.12).unwrap()),
        ("box", Piece::cuboid(V::new(0.2, 0.12, 0.07)).unwrap()),
        ("capsule", Piece::capsule(0.15, 0.06).unwrap()),
        ("cylinder", Piece::cylinder(0.1, 0.15, 24).unwrap()),
    ];
    let (mut failed, mut wild, mut all) = (0, 0, 0);
    for (name, piece) in &pieces {
        for seed in 0..8 {
            for rough in [0.02, 0.1] {
                let [no, odd] = throw(name, piece, seed, rough, 400);
                (failed, wild, all) = (failed + no, wild + odd, all + 400);
            }
        }
    }
    assert_eq!(failed, 0, "of {all} steps");
    // Where a round body rolls from an edge it may gain more energy than a step should.
    assert!(wild <= all / 2000, "{wild} of {all} steps");
}
