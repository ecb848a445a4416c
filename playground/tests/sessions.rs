//! Sessions of the playground: bits, pulls, changes, the way back, and requests.

use nalgebra::Vector3;
use serde_json::{Value, json};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tumble_core::mechanics::State;
use tumble_core::simulation::StepRecord;
use tumble_core::simulation::energy::total;
use tumble_playground::change::{Change, NewShape};
use tumble_playground::export;
use tumble_playground::frame::{HEAD, NUMBERS_OF_BODY, NUMBERS_OF_CONTACT};
use tumble_playground::pull::Hand;
use tumble_playground::request::Program;
use tumble_playground::scenes::{self, SCENES};
use tumble_playground::session::{Hit, Session};
use tumble_scene::choices::SolverName;
use tumble_scene::solver_choice::SolverChoice;
use tumble_scene::solver_choice::SolverTable;

/// States of the scene of a text after `steps` steps, as the command line computes them.
fn run(text: &str, steps: usize) -> Vec<State> {
    let scene = scenes::read(text).unwrap();
    let mut simulation = scene.simulation(&Arc::new(AtomicBool::new(false))).unwrap();
    let mut record = StepRecord::new();
    for _ in 0..steps {
        simulation.step(&mut record).unwrap();
    }
    simulation.states().to_vec()
}

fn states(session: &Session) -> &[State] {
    session.simulation().states()
}

fn stepped(session: &mut Session, steps: usize) {
    for _ in 0..steps {
        session.step().unwrap();
    }
}

/// Bits of all coordinates.
fn bits(states: &[State]) -> Vec<u64> {
    states.iter().flat_map(|state| state.to_vector().map(f64::to_bits).data.0[0]).collect()
}

/// The tower with its fifth box pulled to the side and let go.
fn thrown() -> Session {
    let mut session = Session::open(SCENES[5].text).unwrap();
    stepped(&mut session, 25);
    let mut session = session.for_pulls().unwrap().unwrap();
    let hit = session.hit(Vector3::new(5.0, 0.1, 0.95), -Vector3::x()).unwrap();
    assert_eq!(hit.body, 4);
    assert!((hit.point - Vector3::new(0.2, 0.1, 0.95)).norm() < 1e-9, "{}", hit.point);
    session.grab(0, &hit).unwrap();
    for k in 0..60 {
        session.pull(0, hit.point + Vector3::new(0.02, 0.01, 0.002) * f64::from(k)).unwrap();
        session.step().unwrap();
    }
    session.release(0);
    session
}

#[test]
fn every_scene_of_the_page_runs_with_the_bits_of_its_text() {
    for scene in SCENES {
        let mut session = Session::open(scene.text).unwrap();
        stepped(&mut session, 60);
        let text = export::text(&session).unwrap();
        assert_eq!(bits(states(&session)), bits(&run(&text, 60)), "{}", scene.title);
        assert_eq!(session.unsolved().first, None, "{}", scene.title);
    }
}

/// The pull is a load of the step: the certificate covers it, and the exported text has it.
#[test]
fn a_thrown_body_has_the_same_bits_in_the_exported_text() {
    let mut session = thrown();
    let moved = states(&session)[4].velocity.norm();
    assert!(moved > 0.2, "{moved}");
    assert!(session.record().unwrap().residual() < 1e-8);
    stepped(&mut session, 200);
    let text = export::text(&session).unwrap();
    assert!(text.contains("load = "));
    assert_eq!(bits(states(&session)), bits(&run(&text, 260)));
    // The text itself can be opened, and the body thrown again.
    let mut again = Session::open(&text).unwrap();
    stepped(&mut again, 260);
    assert_eq!(bits(states(&again)), bits(states(&session)));
    let mut again = again.for_pulls().unwrap().unwrap();
    again.grab(0, &Hit { body: 4, point: states(&again)[4].position }).unwrap();
}

/// Terrain is written into the text: heights over a grid, and triangles.
#[test]
fn bodies_are_pulled_over_terrain_with_the_bits_of_the_text() {
    let hill = include_str!("../../scenarios/hill.toml");
    let moved = hill.replace("spacing = 0.5", "spacing = [0.6, 0.7]\nposition = [0.1, 0.07, -0.2]");
    let triangles = "[[terrain]]\nfriction = 0.3\nsurface = { vertices = [[-3, -3, 0.1], [3, -3, 0.2], [0, 3, 0]], \
                     triangles = [[0, 1, 2]] }\n\n[[bodies]]";
    let surface = hill.replacen("[[bodies]]", triangles, 1);
    let turned = hill
        .replace("spacing = 0.5", "spacing = 0.5\nattitude = { axis = [0, 0, 1], degrees = 180 }");
    for scene in [hill, &moved, &surface, &turned] {
        let mut session = Session::open(scene).unwrap();
        stepped(&mut session, 150);
        let mut session = session.for_pulls().unwrap().unwrap();
        let place = states(&session)[1].position;
        session.grab(0, &Hit { body: 1, point: place }).unwrap();
        for k in 0..60 {
            session.pull(0, place + Vector3::new(0.01, 0.005, 0.002) * f64::from(k)).unwrap();
            session.step().unwrap();
        }
        session.release(0);
        stepped(&mut session, 100);
        assert!((states(&session)[1].position - place).norm() > 0.1);
        let text = export::text(&session).unwrap();
        assert!(text.contains("[[terrain]]\nname = \"hill\"\nheights = { columns = "), "{text}");
        assert_eq!(bits(states(&session)), bits(&run(&text, 160)));
    }
}

#[test]
fn a_pulled_body_comes_to_rest_at_the_pointer() {
    let mut session = Session::open(SCENES[5].text).unwrap().for_pulls().unwrap().unwrap();
    let place = states(&session)[9].position;
    session.grab(0, &Hit { body: 9, point: place }).unwrap();
    let target = place + Vector3::new(0.4, -0.2, 0.5);
    session.pull(0, target).unwrap();
    stepped(&mut session, 1500);
    // Forces have five digits, of a weight of 9.81 N and a stiffness of 144 N/m.
    assert!((states(&session)[9].position - target).norm() < 1e-4);
    assert_eq!(session.pulls().grabbed(0).unwrap().body(), 9);
}

/// A pull of a lower card by the height of the house brings the house down.
#[test]
fn a_card_house_is_pulled_over() {
    let mut session = Session::open(SCENES[2].text).unwrap().for_pulls().unwrap().unwrap();
    let top = |session: &Session| {
        states(session).iter().map(|state| state.position.z).fold(f64::NEG_INFINITY, f64::max)
    };
    let (height, point) = (top(&session), states(&session)[0].position);
    session.grab(0, &Hit { body: 0, point }).unwrap();
    session.pull(0, point - Vector3::x() * height).unwrap();
    stepped(&mut session, 400);
    assert!(top(&session) < 0.7 * height, "{} of {height}", top(&session));
}

#[test]
fn a_step_back_is_exact_and_ends_the_pull() {
    let mut session = thrown();
    let before = bits(states(&session));
    stepped(&mut session, 13);
    for _ in 0..13 {
        session.back().unwrap();
    }
    assert_eq!(bits(states(&session)), before);
    for _ in 0..30 {
        session.back().unwrap();
    }
    let middle = session.simulation().index();
    assert_eq!(middle, 25 + 30);
    stepped(&mut session, 40);
    assert_eq!(bits(states(&session)), bits(&run(&export::text(&session).unwrap(), 70)));
    while session.back().is_ok() {}
    assert_eq!(session.simulation().index(), 25);
}

#[test]
fn changes_start_at_the_present_state_and_have_the_bits_of_their_text() {
    let mut session = Session::open(SCENES[0].text).unwrap();
    stepped(&mut session, 100);
    let changes = [
        Change::Friction(0.1),
        Change::Restitution(0.6),
        Change::Gravity { size: 5.0, slope: 20.0 },
        Change::Mass { body: 0, mass: 3.0 },
        Change::TimeStep(0.004),
        Change::Add(NewShape::Ball),
        Change::Add(NewShape::Cylinder),
        Change::Add(NewShape::Box),
        Change::Remove(1),
    ];
    for change in changes {
        let before = states(&session)[0];
        session = session.changed(change).unwrap();
        assert_eq!(states(&session)[0], before, "{change:?}");
        stepped(&mut session, 30);
        assert_eq!(
            bits(states(&session)),
            bits(&run(&export::text(&session).unwrap(), 30)),
            "{change:?}"
        );
    }
    let world = session.simulation().world();
    assert_eq!((world.friction(), world.restitution(), world.time_step()), (0.1, 0.6, 0.004));
    assert_eq!((world.bodies().len(), world.bodies()[0].mass()), (3, 3.0));
    let tilted = Vector3::new(20_f64.to_radians().sin(), 0.0, -20_f64.to_radians().cos());
    assert!((world.gravity() - 5.0 * tilted).norm() < 1e-15);
}

#[test]
fn hard_throws_at_extreme_friction_stay_counted_and_finite() {
    for friction in [0.0, 2.0] {
        let session = Session::open(SCENES[3].text).unwrap();
        let mut session = session.changed(Change::Friction(friction)).unwrap();
        for k in 0..40 {
            let body = (7 * k) % states(&session).len();
            let point = states(&session)[body].position + Vector3::new(0.0, 0.0, 0.02);
            session.grab(0, &Hit { body, point }).unwrap();
            let side = f64::from(u32::try_from(k % 5).unwrap()) - 2.0;
            session.pull(0, point + Vector3::new(9.0 * side, 5.0, -4.0)).unwrap();
            stepped(&mut session, 12);
            session.release(0);
        }
        assert!(
            states(&session).iter().all(|state| state.to_vector().iter().all(|x| x.is_finite()))
        );
        let summary = session.summary();
        let unsolved = session.unsolved();
        assert_eq!((unsolved.failed, unsolved.wild), (summary.failed, summary.wild));
    }
}

#[test]
fn invalid_values_are_rejected_and_change_nothing() {
    let session = Session::open(SCENES[1].text).unwrap();
    for change in [
        Change::Friction(-1.0),
        Change::Friction(f64::NAN),
        Change::Restitution(2.0),
        Change::TimeStep(0.0),
        Change::Gravity { size: f64::INFINITY, slope: 0.0 },
        Change::Mass { body: 99, mass: 1.0 },
        Change::Mass { body: 0, mass: 0.0 },
        Change::Remove(99),
    ] {
        let refused = session.changed(change).err();
        assert!(refused.is_some_and(|why| !why.is_empty()), "{change:?}");
    }
    let one = Session::open(SCENES[0].text).unwrap();
    assert!(one.changed(Change::Remove(0)).is_err());
    for text in [
        "",
        "steps = 3",
        "[[bodies]]",
        "<robot/>",
        "\u{0}",
        "name = \"a\"\n[[robots]]\nfile = \"b\"",
    ] {
        assert!(Session::open(text).is_err(), "{text:?}");
    }
}

fn answer(program: &mut Program, request: &Value) -> Value {
    answer_to(program, 0, request)
}

fn answer_to(program: &mut Program, hand: Hand, request: &Value) -> Value {
    program.answer(hand, request.to_string().as_bytes());
    serde_json::from_str(&program.text).unwrap()
}

/// A live run of the tower, with a residual in its file.
fn live() -> Program {
    let text = format!("{}\n[solver]\nname = \"native\"\nresidual = 1e-7\n", SCENES[5].text);
    Program::from_scene(scenes::read(&text).unwrap(), Arc::default()).unwrap()
}

#[test]
fn two_windows_pull_two_bodies_and_the_record_has_both_pulls() {
    let mut program = live();
    for (hand, body) in [(1, 9), (2, 8)] {
        let held = json!({ "do": "hold", "body": body });
        assert_eq!(answer_to(&mut program, hand, &held)["body"], body);
    }
    let heights = |program: &mut Program, hand: Hand| {
        answer_to(program, hand, &json!({ "do": "step", "count": 1, "contacts": false }));
        [9, 8].map(|body| program.numbers[HEAD + body * NUMBERS_OF_BODY + 2])
    };
    let start = heights(&mut program, 1);
    assert_eq!(program.numbers[13], 9.0, "the body in the first hand");
    for (hand, height) in [(1, 3.0), (2, 2.5)] {
        answer_to(&mut program, hand, &json!({ "do": "pull", "target": [0.0, 0.0, height] }));
    }
    for _ in 0..300 {
        heights(&mut program, 1);
    }
    let end = heights(&mut program, 2);
    assert_eq!(program.numbers[13], 8.0, "the body in the second hand");
    assert!(end[0] > start[0] + 0.5 && end[1] > start[1] + 0.3, "{start:?} {end:?}");
    // A body goes to the hand that takes it, and a closed window holds none.
    answer_to(&mut program, 2, &json!({ "do": "hold", "body": 9 }));
    heights(&mut program, 1);
    assert_eq!(program.numbers[13], -1.0);
    program.leave(2);
    let end = heights(&mut program, 2);
    assert_eq!(program.numbers[13], -1.0);
    let mut scene = program.recorded().unwrap().unwrap();
    assert!(scene.loads.iter().filter(|load| !load.is_none()).count() == 2);
    scene.start_index = 0;
    let mut simulation = scene.simulation(&Arc::new(AtomicBool::new(false))).unwrap();
    let mut record = StepRecord::new();
    for _ in 1..scene.rows {
        simulation.step(&mut record).unwrap();
    }
    assert_eq!([9, 8].map(|body| simulation.states()[body].position[2]), end);
}

#[test]
fn a_change_ends_a_part_of_the_record_and_nothing_is_lost() {
    let mut program = live();
    let step = |count: u32| json!({ "do": "step", "count": count, "contacts": false });
    let first = answer(&mut program, &step(30))["scene"].clone();
    let changed = answer(&mut program, &json!({ "do": "change", "change": { "friction": 0.1 } }));
    assert_eq!(changed["parts"], 1);
    assert_ne!(changed["scene"], first, "another window sees that the scene is another");
    // A change before a step adds no part.
    let changed = answer(&mut program, &json!({ "do": "change", "change": { "friction": 0.2 } }));
    assert_eq!(changed["parts"], 1);
    let back = answer(&mut program, &json!({ "do": "back", "contacts": false }));
    assert_eq!((back["parts"].clone(), program.numbers[0]), (json!(0), 29.0), "its part continues");
    answer(&mut program, &step(11));
    let before = program.numbers[HEAD..].to_vec();
    assert_eq!(answer(&mut program, &json!({ "do": "restart" }))["parts"], 1);
    answer(&mut program, &step(5));
    let opened = answer(&mut program, &json!({ "do": "open", "text": SCENES[0].text }));
    assert_eq!(opened["parts"], 2);
    let rows: Vec<_> =
        program.parts().iter().map(|text| scenes::read(text).unwrap().rows).collect();
    assert_eq!(rows, [41, 6]);
    let end = run(&program.parts()[0], 40);
    let end: Vec<_> = end.iter().flat_map(|state| state.position.iter().copied()).collect();
    let shown: Vec<_> =
        before.chunks(NUMBERS_OF_BODY).flat_map(|body| body[..3].to_vec()).collect();
    assert_eq!(end, shown, "a part repeats its steps");
    for text in program.parts() {
        let contact = scenes::read(text).unwrap().contact.unwrap();
        assert_eq!(contact.residual(), Some(1e-7), "the residual of the file");
    }
}

#[test]
fn a_live_run_refuses_a_file_that_names_ipopt() {
    let mut scene = scenes::read(SCENES[5].text).unwrap();
    let settings = SolverTable { name: Some(SolverName::Ipopt), ..SolverTable::default() };
    let ipopt = match SolverChoice::new(&settings) {
        Ok(ipopt) => ipopt,
        // Without the feature `ipopt` the choice itself is refused.
        Err(failure) => return assert!(failure.to_string().contains("Ipopt"), "{failure}"),
    };
    scene.contact = Some(ipopt);
    let refused = Program::from_scene(scene, Arc::default()).err().unwrap();
    assert!(refused.contains("Ipopt"), "{refused}");
}

#[test]
fn requests_have_the_answers_that_the_page_reads() {
    let mut program = Program::default();
    let list = answer(&mut program, &json!({ "do": "scenes" }));
    assert_eq!(list["scenes"].as_array().unwrap().len(), SCENES.len());
    for invalid in
        [json!({ "do": "step", "count": 1, "contacts": true }), json!({ "do": "dance" }), json!(3)]
    {
        assert!(answer(&mut program, &invalid)["error"].is_string(), "{invalid}");
    }
    let opened = answer(&mut program, &json!({ "do": "open", "text": SCENES[5].text }));
    assert_eq!(opened["film"]["bodies"].as_array().unwrap().len(), 10);
    assert_eq!(program.numbers.len(), HEAD + 10 * NUMBERS_OF_BODY);
    answer(&mut program, &json!({ "do": "step", "count": 50, "contacts": true }));
    assert_eq!(program.numbers[0], 50.0);
    let contacts = (program.numbers.len() - HEAD - 10 * NUMBERS_OF_BODY) / NUMBERS_OF_CONTACT;
    assert_eq!(contacts, 40, "four at each of ten boxes");
    assert_eq!(program.numbers[12], 40.0);
    let weight: f64 = (0..4)
        .map(|k| program.numbers[HEAD + 10 * NUMBERS_OF_BODY + k * NUMBERS_OF_CONTACT + 10])
        .sum();
    assert!((weight - 98.1).abs() < 1e-6, "{weight}");

    let aim = json!({ "do": "grab", "origin": [5.0, 0.0, 1.9], "direction": [-1.0, 0.0, 0.0] });
    assert_eq!(answer(&mut program, &aim)["body"], 9);
    answer(&mut program, &json!({ "do": "pull", "target": [3.0, 0.0, 3.0] }));
    answer(&mut program, &json!({ "do": "step", "count": 20, "contacts": false }));
    assert_eq!(program.numbers[13], 9.0, "the body in the hand");
    answer(&mut program, &json!({ "do": "release" }));
    assert_eq!(program.numbers[13], -1.0);
    let away = json!({ "do": "grab", "origin": [5.0, 0.0, 9.0], "direction": [1.0, 0.0, 0.0] });
    assert_eq!(answer(&mut program, &away)["body"], Value::Null);

    // The way back leads through the grab to the start of the scene.
    for index in (0..70).rev() {
        let back = answer(&mut program, &json!({ "do": "back", "contacts": false }));
        assert_eq!(back["error"], Value::Null, "{index}");
        assert_eq!(program.numbers[0], f64::from(index));
    }
    assert!(answer(&mut program, &json!({ "do": "back", "contacts": false }))["error"].is_string());
    // A text with a fault changes nothing.
    assert!(answer(&mut program, &json!({ "do": "open", "text": "steps" }))["error"].is_string());
    // A restart keeps changes.
    answer(&mut program, &json!({ "do": "change", "change": { "friction": 0.25 } }));
    answer(&mut program, &json!({ "do": "step", "count": 5, "contacts": false }));
    let restarted = answer(&mut program, &json!({ "do": "restart" }));
    assert_eq!((restarted["friction"].as_f64(), program.numbers[0]), (Some(0.25), 0.0));
}

#[test]
fn states_have_all_velocities_and_the_certificate_of_the_last_step() {
    let mut program = Program::default();
    let text = SCENES[1].text;
    let opened = answer(&mut program, &json!({ "do": "open", "text": text }));
    let bodies = opened["bodies"].as_array().unwrap().len();
    assert_eq!(answer(&mut program, &json!({ "do": "states" }))["status"], Value::Null);
    assert!(program.numbers[13 * bodies..].iter().all(|part| part.is_nan()));
    answer(&mut program, &json!({ "do": "step", "count": 20, "contacts": false }));
    let (residual, energy) = (program.numbers[3], program.numbers[5]);
    let found = answer(&mut program, &json!({ "do": "states" }));
    assert_eq!((&found["status"], &found["isSolved"]), (&json!("converged"), &json!(true)));
    let (states, parts) = program.numbers.split_at(13 * bodies);
    let states: Vec<_> = states.iter().map(|number| number.to_bits()).collect();
    assert_eq!(states, bits(&run(text, 20)));
    assert_eq!(parts.len(), 7);
    assert_eq!(parts.iter().copied().fold(0.0, f64::max), residual);
    // The energy is that of steps.csv.
    let mut session = Session::open(text).unwrap();
    stepped(&mut session, 20);
    let simulation = session.simulation();
    assert_eq!(energy, total(simulation.world(), simulation.step_states()));
}
