//! Unit tests of `contact_runs.rs`: a box falls, comes to rest, and is pushed.

use super::super::{IntervalRows, Streams, TableShape, TablesReader, TablesWriter};
use nalgebra::{Vector3, Vector4};
use tumble_core::contact::Plane;
use tumble_core::mechanics::{RigidBody, Rotation, State, Wrench};
use tumble_core::simulation::{Motion, Simulation, StepRecord};
use tumble_core::world::{Parameters, World};

fn world() -> World {
    World::new(Parameters {
        bodies: vec![RigidBody::solid_box(2.0, Vector3::new(0.2, 0.2, 0.1)).unwrap()],
        ground: Some(Plane::new(Vector3::z(), 0.0).unwrap()),
        gravity: Vector3::z() * -9.81,
        friction: 0.5,
        time_step: 2e-3,
        rotation: Rotation::Momentum,
    })
    .unwrap()
}

/// Tables of 400 steps, of which every `every`-th has rows, and those rows. After step 300 a force pushes
/// the box. `is_short` requests short tables.
fn written(world: &World, every: u64, is_short: bool) -> (Streams<Vec<u8>>, Vec<IntervalRows>) {
    let start = State {
        position: Vector3::new(0.0, 0.0, 0.11),
        attitude: Vector4::new(1.0, 0.0, 0.0, 0.0),
        velocity: Vector3::zeros(),
        spin: Vector3::zeros(),
    };
    let mut simulation = Simulation::new(world.clone(), [start], Motion::native(world)).unwrap();
    let streams = Streams {
        states: Vec::new(),
        contacts: Some(Vec::new()),
        steps: Vec::new(),
        joints: None,
        gears: None,
        ends: Some(Vec::new()),
    };
    let mut writer = TablesWriter::new(streams, world).unwrap().every(every, 0).short(is_short);
    let (mut record, mut rows) = (StepRecord::new(), Vec::new());
    for k in 0..=400 {
        if k == 300 {
            let force = Vector3::x() * 15.0;
            simulation.set_wrench(0, Wrench { force, torque: Vector3::zeros() }).unwrap();
        }
        match k {
            400 => simulation.end(&mut record),
            _ => simulation.step(&mut record).unwrap(),
        }
        writer.write(&record).unwrap();
        if k % every == 0 || k == 400 {
            rows.extend(IntervalRows::from_step(world, &record));
        }
    }
    (writer.finish().unwrap(), rows)
}

fn reader<'a>(world: &World, tables: &'a Streams<Vec<u8>>, every: u64) -> TablesReader<&'a [u8]> {
    let streams = Streams {
        states: &tables.states[..],
        contacts: tables.contacts.as_deref(),
        steps: &tables.steps[..],
        joints: None,
        gears: None,
        ends: tables.ends.as_deref().filter(|rows| !rows.is_empty()),
    };
    TablesReader::new(streams, TableShape::new(world)).unwrap().every(every)
}

/// Every interval has its contacts again. A box at rest has one row a corner and block of 32 steps.
#[test]
fn contacts_are_read_back_and_resting_ones_have_few_rows() {
    let world = world();
    for every in [1, 3] {
        let (tables, rows) = written(&world, every, false);
        let mut reader = reader(&world, &tables, every);
        for expected in &rows {
            let found = reader.next_interval().unwrap().unwrap();
            assert_eq!(found.contacts, expected.contacts, "k = {}", expected.row.index);
        }
        assert!(reader.next_interval().unwrap().is_none());
        let all: usize = rows.iter().map(|rows| rows.contacts.len()).sum();
        let text = String::from_utf8(tables.contacts.unwrap()).unwrap();
        let lines = text.lines().count() - 1;
        assert!(all > 2 * lines, "{lines} lines for {all} contacts");
    }
}

/// Short tables have rounded numbers except at both ends, and no rows of a resting box.
#[test]
fn short_tables_are_read_back_rounded_and_have_few_rows_of_states() {
    let world = world();
    for every in [1, 3] {
        let (tables, rows) = written(&world, every, true);
        let mut reader = reader(&world, &tables, every).short(true);
        for expected in &rows {
            let (k, found) = (expected.row.index, reader.next_interval().unwrap().unwrap());
            let off = found.states[0].to_vector() - expected.states[0].to_vector();
            assert!(off.amax() <= 1e-12, "k = {k}: {off}");
            assert!([0, 400].contains(&k) <= (found.states == expected.states), "k = {k}");
            let read = |rows: &IntervalRows| (rows.row.residual, rows.contacts.len());
            assert_eq!(read(&found), read(expected), "k = {k}");
        }
        assert!(reader.next_interval().unwrap().is_none());
        let lines = String::from_utf8(tables.states).unwrap().lines().count() - 1;
        assert!(rows.len() > lines + 100 / every as usize, "{lines} lines for {} rows", rows.len());
    }
}

/// A missing row of states is an unchanged state in short tables only.
#[test]
fn missing_rows_of_states_are_refused_in_long_tables() {
    let world = world();
    let (mut tables, _) = written(&world, 1, false);
    let text = String::from_utf8(tables.states).unwrap();
    let lines: Vec<_> = text.lines().enumerate().filter(|(line, _)| *line != 5).collect();
    tables.states = lines.iter().flat_map(|(_, line)| [line, "\n"].concat().into_bytes()).collect();
    for is_short in [false, true] {
        let mut reader = reader(&world, &tables, 1).short(is_short);
        let read = (0..=400).try_for_each(|_| reader.next_interval().map(drop));
        assert_eq!(read.is_ok(), is_short, "{read:?}");
    }
}

/// A row that lasts into other contacts, or that has another one beside it, is refused.
#[test]
fn runs_that_contradict_other_rows_are_refused() {
    let world = world();
    let fault = |change: fn(&mut Vec<String>)| {
        let (mut tables, _) = written(&world, 1, false);
        let text = String::from_utf8(tables.contacts.take().unwrap()).unwrap();
        let mut lines: Vec<_> = text.lines().map(str::to_owned).collect();
        change(&mut lines);
        tables.contacts = Some((lines.join("\n") + "\n").into_bytes());
        let mut reader = reader(&world, &tables, 1);
        loop {
            match reader.next_interval() {
                Ok(Some(_)) => {}
                Ok(None) => return String::new(),
                Err(error) => return error.to_string(),
            }
        }
    };
    fn set_last(line: &mut String, last: &str) {
        let cells: Vec<_> = line.splitn(3, ',').collect();
        *line = [cells[0], last, cells[2]].join(",");
    }
    assert_eq!(fault(|_| ()), "");
    let longer = fault(|lines| set_last(&mut lines[1], "400"));
    assert!(longer.contains("contact is 0"), "{longer}");
    let after = fault(|lines| set_last(lines.last_mut().unwrap(), "400"));
    assert!(after.contains("lasts into"), "{after}");
    let before = fault(|lines| set_last(&mut lines[1], "0"));
    assert!(before.contains("last_k"), "{before}");
}
