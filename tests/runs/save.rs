//! Simulations that are saved and restored continue with the same bits as an uninterrupted one, for
//! any solver and scene. Invalid states and states of other worlds are refused.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tumble_core::contact::Candidates;
use tumble_core::error::Error;
use tumble_core::mechanics::Wrench;
use tumble_core::simulation::save::{Saved, to_bytes};
use tumble_core::simulation::{Motion, Simulation, StepRecord};
use tumble_core::solver::native::NativeSolver;
use tumble_core::step::{Step, StepReport, StepSolution, StepSolver};
use tumble_scene::choices::SceneName;
use tumble_scene::overrides::FieldOverride;
use tumble_scene::scene::Scene;
use tumble_scene::settings::RobotSettings;

fn read(path: &Path, _: u64) -> std::io::Result<Vec<u8>> {
    std::fs::read(path)
}

fn scenario(name: &str, flags: &[FieldOverride]) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios").join(name);
    let text = std::fs::read_to_string(&path).unwrap();
    Scene::from_text(&text, &path, flags, &read).unwrap()
}

fn scenarios() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios");
    let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<_> =
        files.filter(|path| path.extension().is_some_and(|e| e == "toml")).collect();
    files.sort();
    files
}

fn simulation(scene: &Scene) -> Simulation<'static> {
    scene.simulation(&Arc::new(AtomicBool::new(false))).unwrap()
}

/// All data of a step as bytes.
fn bits(record: &StepRecord) -> Vec<u8> {
    let report = &record.report();
    let told = (record.index, report.status.name(), report.iterations, report.start);
    let judged = (record.residual(), record.overlap(), record.restitution_share());
    to_bytes(&(record.states(), &record.first().contacts, &record.first().solution, told, judged))
        .unwrap()
}

fn steps(simulation: &mut Simulation<'_>, count: u64) -> Vec<Vec<u8>> {
    let mut record = StepRecord::new();
    let step = |_| {
        simulation.step(&mut record).unwrap();
        bits(&record)
    };
    (0..count).map(step).collect()
}

/// Runs `scene` for `count` steps and saves at the indices `cuts`. From each, a new simulation is
/// restored through bytes and runs `after` steps. These must equal the steps of the full run.
fn goes_on_alike(scene: &Scene, count: u64, cuts: &[u64], after: u64) {
    let mut whole = simulation(scene);
    let (mut saved, mut known) = (Vec::new(), Vec::new());
    for index in 0..count {
        if cuts.contains(&index) {
            saved.push(whole.save());
        }
        known.extend(steps(&mut whole, 1));
    }
    assert_eq!(saved.len(), cuts.len());
    for state in saved {
        let read = Saved::from_bytes(&state.to_bytes().unwrap()).unwrap();
        assert_eq!(to_bytes(&read).unwrap(), to_bytes(&state).unwrap());
        let mut again = simulation(scene);
        again.restore(&read).unwrap();
        assert!(to_bytes(&again.save()).unwrap() == to_bytes(&read).unwrap(), "saved again");
        let from = usize::try_from(state.index()).unwrap();
        let left = after.min(count - state.index());
        for (place, step) in steps(&mut again, left).iter().enumerate() {
            assert!(
                *step == known[from + place],
                "{}: step {} from {from}",
                scene.name,
                from + place
            );
        }
    }
}

#[test]
fn every_scenario_resumes_bit_for_bit_from_any_step() {
    for path in scenarios() {
        let scene = scenario(path.file_name().unwrap().to_str().unwrap(), &[]);
        let count = (scene.rows - 1).min(240);
        goes_on_alike(&scene, count, &[0, 1, 37, 110, 111, 190, count - 1], 60);
    }
}

#[test]
fn a_heap_that_bounces_and_falls_goes_on_to_its_end() {
    let flags = [FieldOverride::parse("ground.restitution=0.6").unwrap()];
    let scene = scenario("pile.toml", &flags);
    goes_on_alike(&scene, 420, &[60, 150, 300], 420);
}

/// Checks that the search keeps its memory after bodies were added, removed or held and no search
/// has run since.
#[test]
fn contact_memory_survives_changes_of_bodies() {
    fn add(run: &mut Simulation<'_>) {
        let (body, mut state) = (run.world().bodies()[0].clone(), run.states()[0]);
        state.position.x += 3.0;
        run.add_body(body, state).unwrap();
    }
    type Change = fn(&mut Simulation<'_>);
    let changes: [(&str, Change); 4] = [
        ("stack", add),
        ("stack", |run| drop(run.remove_body(4).unwrap())),
        ("stack", |run| run.hold_body(0, true).unwrap()),
        ("real-cube", |run| {
            run.hold_body(0, true).unwrap();
            add(run);
        }),
    ];
    for (name, change) in changes {
        let scene = scenario(&format!("{name}.toml"), &[]);
        let mut whole = simulation(&scene);
        steps(&mut whole, 600.min(scene.rows - 1));
        change(&mut whole);
        let saved = whole.save();
        let world = whole.world().clone();
        let motion = Motion::native(&world);
        let mut again = Simulation::restored(world, motion, &saved).unwrap();
        for _ in 0..5 {
            assert!(steps(&mut again, 4) == steps(&mut whole, 4), "{name}");
            assert!(to_bytes(&again.save()).unwrap() == to_bytes(&whole.save()).unwrap(), "{name}");
        }
    }
}

/// Checks joints along random axes, whose numbers have rounding errors. They must be the same after
/// restoring.
#[test]
fn joints_along_any_axes_are_the_same_again() {
    let mut draws = rand_mt::Mt::new(4);
    let mut draw = || 2.0 * f64::from(draws.next_u32()) / f64::from(u32::MAX) - 1.0;
    for number in 0..60 {
        let kind = ["revolute", "prismatic", "spherical", "cylindrical"][number % 4];
        let [turn, axis] = [4, 3].map(|n| (0..n).map(|_| draw()).collect::<Vec<_>>());
        let norm = turn.iter().map(|x| x * x).sum::<f64>().sqrt();
        let turn: Vec<f64> = turn.iter().map(|x| x / norm).collect();
        let axis = if kind == "spherical" { String::new() } else { format!("axis = {axis:?}") };
        let text = format!(
            "steps = 100\n[ground]\nfriction = 0.5\n\
             [[bodies]]\nname = \"a\"\nbox = 0.2\nmass = 1.0\nposition = [0, 0, 0.6]\nattitude = {turn:?}\n\
             [[bodies]]\nname = \"b\"\nbox = 0.2\nmass = 1.0\nposition = [1, 0, 0.6]\n\
             [[joints]]\nname = \"joint\"\ntype = \"{kind}\"\nbodies = [\"a\", \"b\"]\nanchor = [0.5, 0.1, 0.6]\n{axis}\n"
        );
        let scene = Scene::from_text(&text, Path::new("scene.toml"), &[], &read);
        goes_on_alike(&scene.unwrap(), 50, &[0, 1, 30], 50);
    }
}

#[test]
fn ipopt_goes_on_with_its_multipliers() {
    let scene = Scene::from_tutorial(SceneName::Drop, &[], &RobotSettings::default()).unwrap();
    // The cube touches at step 193.
    goes_on_alike(&scene, 260, &[0, 192, 195, 201, 230], 60);
}

#[test]
fn ipopt_goes_on_under_a_load() {
    let flags = [FieldOverride::parse("solver.name=ipopt").unwrap()];
    goes_on_alike(&scenario("dragged-cube.toml", &flags), 60, &[3, 30], 60);
}

#[test]
fn a_state_goes_back_in_the_same_simulation() {
    let scene = scenario("stack.toml", &[]);
    let mut simulation = simulation(&scene);
    steps(&mut simulation, 20);
    let saved = simulation.save();
    let first = steps(&mut simulation, 30);
    simulation.restore(&saved).unwrap();
    assert_eq!(simulation.index(), 20);
    assert!(steps(&mut simulation, 30) == first);
}

/// Checks a body inside a held one. A held body has no contacts, so that others can move into it.
/// Such a state cannot be a new start, but it can be restored.
#[test]
fn body_inside_a_held_body_can_be_restored() {
    let scene = scenario("stack.toml", &[]);
    let mut whole = simulation(&scene);
    whole.hold_body(1, true).unwrap();
    steps(&mut whole, 150);
    let motion = || scene.motion(&scene.world).unwrap();
    let states = whole.states().to_vec();
    let start = Simulation::new(scene.world.clone(), states, motion());
    assert!(matches!(start, Err(Error::Overlap { .. })));
    let saved = Saved::from_bytes(&whole.save().to_bytes().unwrap()).unwrap();
    let mut again = Simulation::restored(scene.world.clone(), motion(), &saved).unwrap();
    assert_eq!(again.index(), 150);
    assert!(steps(&mut again, 30) == steps(&mut whole, 30));
    // States of another world are refused.
    let pyramid = scenario("pyramid.toml", &[]);
    let other = Simulation::restored(pyramid.world.clone(), motion(), &saved);
    assert!(matches!(other, Err(Error::Saved(_))));
}

#[test]
fn wrenches_that_were_set_and_a_step_that_was_taken_back_are_of_the_state() {
    let scene = scenario("stack.toml", &[]);
    let mut whole = simulation(&scene);
    let push = Wrench { force: [3.0, 0.5, 0.0].into(), torque: [0.0, 0.1, 0.0].into() };
    whole.set_wrench(2, push).unwrap();
    let mut record = StepRecord::new();
    for _ in 0..10 {
        whole.step(&mut record).unwrap();
    }
    whole.take_back(&record);
    let mut again = simulation(&scene);
    again.restore(&Saved::from_bytes(&whole.save().to_bytes().unwrap()).unwrap()).unwrap();
    again.take_back(&record);
    assert_eq!(again.index(), 9);
    assert!(steps(&mut again, 20) == steps(&mut whole, 20));
}

/// Native solver that returns an interrupt after solving a given step.
struct GivesUp {
    native: NativeSolver,
    left: u32,
}

impl StepSolver for GivesUp {
    fn accepted_residual(&self) -> f64 {
        self.native.accepted_residual()
    }

    fn solve(
        &mut self,
        step: &Step<'_>,
        candidates: &mut Candidates,
        solution: &mut StepSolution,
    ) -> Result<StepReport, Error> {
        let report = self.native.solve(step, candidates, solution);
        self.left = self.left.wrapping_sub(1);
        if self.left == 0 { Err(Error::Interrupted) } else { report }
    }
}

#[test]
#[ignore = "slow"]
fn interrupted_step_can_be_repeated_bit_for_bit() {
    let scene = scenario("pile.toml", &[]);
    let started = || {
        let native = NativeSolver::new(&scene.world);
        let motion = Motion::contact(GivesUp { native, left: 0 });
        Simulation::new(scene.world.clone(), scene.starts.clone(), motion).unwrap()
    };
    let known = steps(&mut started(), 260);
    for interrupted in [90, 150, 200, 240] {
        let mut simulation = started();
        simulation.interrupt_by(Arc::new(AtomicBool::new(false)));
        steps(&mut simulation, interrupted);
        let saved = simulation.save();
        let native = NativeSolver::new(&scene.world);
        simulation.swap_motion(&mut Motion::contact(GivesUp { native, left: 1 }));
        let error = simulation.step(&mut StepRecord::new()).unwrap_err();
        assert_eq!(error, Error::Interrupted);
        assert!(to_bytes(&simulation.save()).unwrap() == to_bytes(&saved).unwrap());
        let after = steps(&mut simulation, 260 - interrupted);
        assert!(after == known[interrupted as usize..], "{interrupted}");
    }
}

fn refusal(result: Result<impl Sized, Error>) -> String {
    result.err().expect("refused").to_string()
}

#[test]
fn invalid_saved_states_are_rejected_with_the_reason() {
    let scene = scenario("stack.toml", &[]);
    let mut run = simulation(&scene);
    steps(&mut run, 3);
    let bytes = run.save().to_bytes().unwrap();
    assert!(refusal(Saved::from_bytes(b"")).contains("cut off after 0 bytes"));
    assert!(
        refusal(Saved::from_bytes(b"k,time_s,x_m,y_m,z_m"))
            .contains("bad header: it is not a saved state")
    );
    for length in [8, 11, 19, 20, 27, 28, 100, bytes.len() - 1] {
        let sentence = refusal(Saved::from_bytes(&bytes[..length]));
        assert!(sentence.contains(&format!("cut off after {length} bytes")), "{sentence}");
    }
    let mut longer = bytes.clone();
    longer.extend(b"abc");
    assert!(refusal(Saved::from_bytes(&longer)).contains("3 bytes after its end"));
    let mut other = bytes.clone();
    other[8] = 77;
    assert!(refusal(Saved::from_bytes(&other)).contains("has format 77"));
    for place in (20..bytes.len()).step_by(997) {
        let mut changed = bytes.clone();
        changed[place] ^= 1;
        assert!(refusal(Saved::from_bytes(&changed)).contains("damaged"), "{place}");
    }
}

#[test]
fn a_state_of_another_world_is_refused_and_nothing_changes() {
    let scene = scenario("stack.toml", &[]);
    let mut run = simulation(&scene);
    steps(&mut run, 3);
    let saved = run.save();
    let mut rougher = simulation(&scenario(
        "stack.toml",
        &[FieldOverride::parse("ground.friction=0.4").unwrap()],
    ));
    let before = to_bytes(&rougher.save()).unwrap();
    assert!(refusal(rougher.restore(&saved)).contains("belongs to another world"));
    assert!(to_bytes(&rougher.save()).unwrap() == before);
    let sentence = refusal(simulation(&scenario("pyramid.toml", &[])).restore(&saved));
    assert!(sentence.contains("bodies; the world has"), "{sentence}");
}

/// Checks changed bytes with a valid checksum. They are refused or harmless: nothing panics,
/// neither when they are read nor in the steps after.
#[test]
fn numbers_that_contradict_each_other_are_refused_or_harmless() {
    let scene = scenario("stack.toml", &[]);
    let mut run = simulation(&scene);
    steps(&mut run, 12);
    let bytes = run.save().to_bytes().unwrap();
    let end = bytes.len() - 8;
    let fnv = |bytes: &[u8]| {
        bytes.iter().fold(0xCBF2_9CE4_8422_2325_u64, |hash, byte| {
            (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01B3)
        })
    };
    let (mut refused, mut taken) = (0, 0);
    for (round, place) in (20..end).step_by(41).enumerate() {
        let mut changed = bytes.clone();
        changed[place] = changed[place].wrapping_add([1, 127, 255][round % 3]);
        let checksum = fnv(&changed[..end]).to_le_bytes();
        changed[end..].copy_from_slice(&checksum);
        let Ok(saved) = Saved::from_bytes(&changed) else {
            refused += 1;
            continue;
        };
        let mut simulation = simulation(&scene);
        match simulation.restore(&saved) {
            Ok(()) => {
                taken += 1;
                let mut record = StepRecord::new();
                for _ in 0..2 {
                    let _ = simulation.step(&mut record);
                }
            }
            Err(_) => refused += 1,
        }
    }
    assert!(refused > 10 && taken > 10, "{refused} {taken}");
}
